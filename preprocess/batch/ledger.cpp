#include "preprocess/batch/ledger.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fstream>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace trimray {
namespace {

namespace fs = std::filesystem;

constexpr int kMostWriters = 10000; // at once, of one shard

/// The line that a machine's crash has cut short is ended, so that the next begins on its own.
void end_last_line(int descriptor)
{
    struct stat status {};
    char last = '\n';
    if (fstat(descriptor, &status) == 0 && status.st_size > 0 && pread(descriptor, &last, 1, status.st_size - 1) == 1 &&
        last != '\n') [[maybe_unused]]
        const ssize_t a_courtesy = write(descriptor, "\n", 1);
}

} // namespace

std::string time_text()
{
    const auto now = std::chrono::system_clock::now();
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count();
    return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03d}Z", fmt::gmtime(static_cast<std::time_t>(ms / 1000)), ms % 1000);
}

fs::path ledger_lock(fs::path ledger)
{
    return ledger.replace_extension(".lock");
}

Result<LedgerWriter> LedgerWriter::open(const Store& store, const std::string& shard)
{
    for (int i = 1; i <= kMostWriters; ++i) {
        const fs::path path =
            store.ledger_folder() / (i == 1 ? shard + ".jsonl" : fmt::format("{}-{}.jsonl", shard, i));
        const fs::path lock_path = ledger_lock(path);
        std::optional<FileLock> lock = FileLock::take(lock_path);
        if (!lock && is_locked(lock_path))
            continue;
        const int descriptor = ::open(path.c_str(), O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC, 0666);
        if (!lock || descriptor < 0)
            return Error{ErrorCode::FileNotWritable, path.string(), std::strerror(errno)};
        end_last_line(descriptor);
        return LedgerWriter(path, std::move(*lock), descriptor);
    }
    return Error{ErrorCode::FileNotWritable, store.ledger_folder().string(), "too many processes write this shard"};
}

LedgerWriter::LedgerWriter(LedgerWriter&& other) noexcept
    : path_(std::move(other.path_)), lock_(std::move(other.lock_)), descriptor_(std::exchange(other.descriptor_, -1))
{
}

LedgerWriter::~LedgerWriter()
{
    if (descriptor_ >= 0)
        close(descriptor_);
}

Status LedgerWriter::append(const char* event, const Json& keys) const
{
    Json line = {{"event", event}, {"time", time_text()}};
    line.update(keys);
    const std::string text = line.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
    // one write: of appends at the same time each stays whole, and a killed process has written all or nothing
    const ssize_t written = write(descriptor_, text.data(), text.size());
    if (written == static_cast<ssize_t>(text.size()))
        return Done{};
    return Error{ErrorCode::FileNotWritable, path_.string(),
                 fmt::format("{}; make room and go on with --resume",
                             written < 0 ? std::strerror(errno) : std::strerror(ENOSPC))};
}

Result<size_t> read_ledger(const fs::path& folder, const std::function<void(const Json&)>& take)
{
    std::error_code failed;
    std::vector<fs::path> files;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, failed))
        if (entry.path().extension() == ".jsonl")
            files.push_back(entry.path());
    if (failed)
        return Error{ErrorCode::FileNotReadable, folder.string(),
                     fmt::format("{}; give the folder that a batch wrote to", failed.message())};
    std::sort(files.begin(), files.end());
    size_t torn = 0;
    for (const fs::path& path : files) {
        std::ifstream file(path, std::ios::binary);
        if (!file)
            return Error{ErrorCode::FileNotReadable, path.string(), std::strerror(errno)};
        for (std::string line; std::getline(file, line);) {
            const Json event = Json::parse(line, nullptr, false);
            if (event.is_object() && event.contains("event"))
                take(event);
            else if (!line.empty())
                ++torn;
        }
    }
    return torn;
}

Result<std::unordered_map<std::string, FileState>> read_states(const fs::path& folder)
{
    std::unordered_map<std::string, FileState> states;
    std::unordered_map<std::string, std::string> basis_of_run;
    const Result<size_t> read = read_ledger(folder, [&](const Json& event) {
        const std::string kind = json_value<std::string>(event, "event", "");
        if (kind == "run")
            basis_of_run[json_value<std::string>(event, "run", "")] = json_value<std::string>(event, "basis", "");
        const std::string file = json_value<std::string>(event, "file", "");
        if (file.empty())
            return;
        if (kind == "start") {
            states[file]; // whatever is known of it stands until it ends anew
        } else if (kind == "end" && json_value(event, "final", false)) {
            FileState& state = states[file];
            const std::string time = json_value<std::string>(event, "time", "");
            if (state.ended && time < state.time) // of an older shard
                return;
            state.time = time;
            state.kind = class_named(json_value<std::string>(event, "class", "")).value_or(FileClass::Crash);
            state.ended = true;
            state.bytes = json_value<uint64_t>(event, "bytes", 0);
            state.modified_ns = json_value<int64_t>(event, "modified_ns", 0);
            state.basis = basis_of_run[json_value<std::string>(event, "run", "")];
            state.key = has_pack(state.kind) ? json_value<std::string>(event, "key", "") : "";
        }
    });
    if (!read)
        return read.error();
    return states;
}

} // namespace trimray
