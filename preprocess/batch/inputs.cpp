#include "preprocess/batch/inputs.h"

#include "format/cad_names.h"
#include "preprocess/source/source_file.h"
#include "preprocess/worker/worker.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <fnmatch.h>
#include <fstream>
#include <glob.h>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <xxhash.h>

namespace trimray {
namespace {

namespace fs = std::filesystem;

constexpr WorkerLimits kListing{60, 1ull << 30, 0, true, true, true}; // of an archive

/// Without what leads out of packs/.
std::string name_of(const std::string& path)
{
    std::string name;
    for (const fs::path& part : fs::path(path).lexically_normal().relative_path())
        if (part != ".." && part != "." && !part.empty())
            name += (name.empty() ? "" : "/") + part.string();
    return name;
}

bool is_zip(const std::string& path)
{
    return path.size() > 4 && strcasecmp(path.c_str() + path.size() - 4, ".zip") == 0;
}

bool matches(const std::vector<std::string>& patterns, const std::string& name)
{
    return patterns.empty() || std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
               const bool whole = pattern.find('/') != std::string::npos;
               return fnmatch(pattern.c_str(), whole ? name.c_str() : fs::path(name).filename().c_str(), 0) == 0;
           });
}

int64_t modified_ns(const struct stat& status)
{
    return static_cast<int64_t>(status.st_mtim.tv_sec) * 1'000'000'000 + status.st_mtim.tv_nsec;
}

class Lister {
public:
    explicit Lister(const InputOptions& options) : options_(options) {}

    Status add_input(const std::string& input)
    {
        if (input == "-")
            return add_list(std::cin, "stdin");
        struct stat status {};
        if (stat(input.c_str(), &status) == 0) {
            if (S_ISDIR(status.st_mode))
                add_folder(input);
            else
                add_file(input, status);
            return Done{};
        }
        const size_t member = input.find("!/");
        if (member != std::string::npos && stat(input.substr(0, member).c_str(), &status) == 0) {
            add(input, 0, status);
            return Done{};
        }
        return input.find_first_of("*?[") == std::string::npos
                   ? Error{ErrorCode::FileNotFound, input, fmt::format("{}; check the path", std::strerror(errno))}
                   : add_pattern(input);
    }

    Status add_list(std::istream& lines, const std::string& where)
    {
        for (std::string line; std::getline(lines, line);) {
            if (line.ends_with('\r'))
                line.pop_back();
            if (line.empty() || line.starts_with('#'))
                continue;
            if (line == "-")
                return Error{ErrorCode::Usage, where, "a list cannot name stdin"};
            if (const Status added = add_input(line); !added)
                return added;
        }
        return Done{};
    }

    Result<InputList> finish()
    {
        std::vector<BatchFile>& files = list_.files;
        std::sort(files.begin(), files.end(), [](const BatchFile& a, const BatchFile& b) {
            return a.name != b.name ? a.name < b.name : a.path < b.path;
        });
        // a file that was named twice is one; two files of one name would overwrite each other's links
        for (size_t i = 0; i + 1 < files.size(); ++i)
            if (files[i].name == files[i + 1].name &&
                fs::path(files[i].path).lexically_normal() != fs::path(files[i + 1].path).lexically_normal())
                return Error{ErrorCode::Usage, files[i].path,
                             fmt::format("would have the same name in packs/ as {}; convert them in two runs",
                                         files[i + 1].path)};
        const auto same = [](const BatchFile& a, const BatchFile& b) { return a.name == b.name; };
        files.erase(std::unique(files.begin(), files.end(), same), files.end());
        list_.files_of_all_shards = files.size();
        const Shard& shard = options_.shard;
        std::erase_if(files, [&](const BatchFile& file) {
            return shard.count > 1 && XXH3_64bits(file.name.data(), file.name.size()) % shard.count != shard.index;
        });
        std::stable_sort(files.begin(), files.end(),
                         [](const BatchFile& a, const BatchFile& b) { return a.bytes > b.bytes; });
        return std::move(list_);
    }

private:
    void add(const std::string& path, uint64_t bytes, const struct stat& status)
    {
        BatchFile file{path, name_of(path), bytes, modified_ns(status)};
        if (matches(options_.include, file.name))
            list_.files.push_back(std::move(file));
    }

    void add_file(const std::string& path, const struct stat& status)
    {
        if (is_zip(path))
            add_members(path, status);
        else
            add(path, static_cast<uint64_t>(status.st_size), status);
    }

    /// Listed in a worker: an archive is as hostile as any other file.
    void add_members(const std::string& path, const struct stat& status)
    {
        const auto list = [&](const WorkerReport&) -> Result<std::string> {
            const Result<std::vector<ArchiveMember>> members = list_members(path);
            if (!members)
                return members.error();
            nlohmann::json names = nlohmann::json::array();
            for (const ArchiveMember& member : *members)
                names.push_back({nlohmann::json::binary({member.path.begin(), member.path.end()}), member.bytes});
            const std::vector<uint8_t> bytes = nlohmann::json::to_cbor(names); // names need not be UTF-8
            return std::string(bytes.begin(), bytes.end());
        };
        const Result<std::string> answer = run_in_worker(path, list, kListing, {});
        if (!answer) {
            list_.unreadable.push_back(answer.error());
            return;
        }
        for (const auto& member : nlohmann::json::from_cbor(*answer)) {
            const auto& name = member[0].get_binary();
            add(path + "!/" + std::string(name.begin(), name.end()), std::max<int64_t>(0, member[1].get<int64_t>()),
                status);
        }
    }

    void add_folder(const std::string& folder)
    {
        std::error_code failed;
        fs::recursive_directory_iterator it(folder, fs::directory_options::skip_permission_denied, failed);
        for (; !failed && it != fs::recursive_directory_iterator(); it.increment(failed)) {
            const std::string path = it->path().string();
            struct stat status {};
            if ((is_cad_name(path) || is_zip(path)) && stat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode))
                add_file(path, status);
        }
        if (failed)
            list_.unreadable.push_back(
                {ErrorCode::FileNotReadable, folder, fmt::format("cannot be listed: {}", failed.message())});
    }

    Status add_pattern(const std::string& pattern)
    {
        glob_t found{};
        const int failed = glob(pattern.c_str(), GLOB_NOSORT | GLOB_BRACE, nullptr, &found);
        Status added = failed == 0 ? Status(Done{})
                                   : Error{ErrorCode::FileNotFound, pattern, "no file matches; check the pattern"};
        for (size_t i = 0; added && i < found.gl_pathc; ++i)
            added = add_input(found.gl_pathv[i]);
        globfree(&found);
        return added;
    }

    const InputOptions& options_;
    InputList list_;
};

} // namespace

Result<Shard> parse_shard(const std::string& text)
{
    Shard shard;
    const char* end = text.data() + text.size();
    const auto index = std::from_chars(text.data(), end, shard.index);
    const bool slash = index.ec == std::errc() && index.ptr != end && *index.ptr == '/';
    const auto count = slash ? std::from_chars(index.ptr + 1, end, shard.count) : index;
    if (!slash || count.ec != std::errc() || count.ptr != end || shard.count == 0 || shard.index >= shard.count)
        return Error{ErrorCode::Usage, "--shard", fmt::format("'{}' is not I/N with I from 0 to N-1, like 0/8", text)};
    return shard;
}

std::string shard_name(const Shard& shard)
{
    return fmt::format("{}-of-{}", shard.index, shard.count);
}

Result<InputList> list_inputs(const InputOptions& options)
{
    Lister lister(options);
    for (const std::string& input : options.inputs)
        if (const Status added = lister.add_input(input); !added)
            return added.error();
    if (!options.list.empty()) {
        std::ifstream lines(options.list);
        if (!lines)
            return Error{ErrorCode::FileNotReadable, options.list, std::strerror(errno)};
        if (const Status added = lister.add_list(lines, options.list); !added)
            return added.error();
    }
    return lister.finish();
}

BatchFile as_it_is_now(BatchFile file)
{
    struct stat status {};
    if (stat(file.path.c_str(), &status) == 0) {
        file.bytes = static_cast<uint64_t>(status.st_size);
        file.modified_ns = modified_ns(status);
    } else if (const size_t member = file.path.find("!/");
               member != std::string::npos && stat(file.path.substr(0, member).c_str(), &status) == 0) {
        file.modified_ns = modified_ns(status);
    }
    return file;
}

} // namespace trimray
