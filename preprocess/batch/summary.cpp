#include "preprocess/batch/summary.h"

#include "format/shell_word.h"
#include "preprocess/worker/worker.h"

#include <algorithm>
#include <cctype>
#include <fmt/format.h>
#include <map>
#include <unordered_map>
#include <utility>

namespace trimray {
namespace {

std::vector<std::string> words(const Json& object, const char* key)
{
    std::vector<std::string> list;
    const auto it = object.find(key);
    if (it != object.end() && it->is_array())
        for (const Json& word : *it)
            if (word.is_string())
                list.push_back(word.get<std::string>());
    return list;
}

RunSummary run_from(const Json& event)
{
    RunSummary run;
    run.run = json_value<std::string>(event, "run", "");
    run.time = json_value<std::string>(event, "time", "");
    run.host = json_value<std::string>(event, "host", "");
    run.shard = json_value<std::string>(event, "shard", "");
    run.folder = json_value<std::string>(event, "folder", "");
    run.basis = json_value<std::string>(event, "basis", "");
    run.command = words(event, "command");
    run.pack_words = words(event, "pack_words");
    run.timeout_seconds = json_value(event, "timeout_seconds", 0.0);
    run.memory_limit_bytes = json_value<uint64_t>(event, "memory_limit_bytes", 0);
    return run;
}

FileSummary file_from(const Json& event)
{
    FileSummary file;
    file.file = json_value<std::string>(event, "file", "");
    file.path = json_value<std::string>(event, "path", file.file);
    file.run = json_value<std::string>(event, "run", "");
    file.time = json_value<std::string>(event, "time", "");
    file.kind = class_named(json_value<std::string>(event, "class", "")).value_or(FileClass::Crash);
    file.attempt = json_value(event, "attempt", 1);
    file.peak_memory_bytes = json_value<uint64_t>(event, "peak_memory_bytes", 0);
    file.listed_bytes = json_value<uint64_t>(event, "bytes", 0);
    file.source_bytes = json_value<uint64_t>(event, "source_bytes", file.listed_bytes);
    file.pack_bytes = json_value<uint64_t>(event, "pack_bytes", 0);
    file.faces = json_value<uint64_t>(event, "faces", 0);
    file.dropped_faces = json_value<uint64_t>(event, "dropped_faces", 0);
    file.found = json_value(event, "found", false);
    file.key = json_value<std::string>(event, "key", "");
    if (const auto seconds = event.find("seconds"); seconds != event.end() && seconds->is_object())
        for (const auto& [name, value] : seconds->items()) {
            if (!value.is_number())
                continue;
            if (name == "wall")
                file.wall_seconds = value;
            else if (name == "cpu")
                file.cpu_seconds = value;
            else if (name != "total")
                file.phases.emplace_back(name, value);
        }
    if (const auto error = event.find("error"); error != event.end() && error->is_object()) {
        file.detail = json_value<std::string>(*error, "detail", "");
        file.phase = json_value<std::string>(*error, "phase", "");
        file.signal = json_value<std::string>(*error, "signal", "");
        file.frame = json_value<std::string>(*error, "frame", "");
    }
    if (const auto dropped = event.find("dropped"); dropped != event.end() && dropped->is_array() && !dropped->empty())
        file.dropped_reason = json_value<std::string>(dropped->front(), "reason", "");
    return file;
}

/// "8GiB": as the options for limits take it.
std::string size_word(uint64_t bytes)
{
    if (bytes > 0 && bytes % (1ull << 30) == 0)
        return fmt::format("{}GiB", bytes >> 30);
    return bytes > 0 && bytes % (1ull << 20) == 0 ? fmt::format("{}MiB", bytes >> 20) : std::to_string(bytes);
}

/// Without what differs from file to file: numbers, and what stands in quotes.
std::string pattern_of(const std::string& text)
{
    std::string pattern;
    for (size_t i = 0; i < text.size(); ++i) {
        if (text[i] == '"') {
            const size_t end = text.find('"', i + 1);
            if (end != std::string::npos) {
                pattern += "\"...\"";
                i = end;
                continue;
            }
        }
        const bool digit = std::isdigit(static_cast<unsigned char>(text[i])) != 0;
        if (!digit)
            pattern += text[i];
        else if (!pattern.ends_with('N'))
            pattern += 'N';
    }
    constexpr size_t kLongest = 200;
    return pattern.substr(0, kLongest);
}

std::string reason_of(const FileSummary& file)
{
    if (!file.frame.empty())
        return fmt::format("{} in {}", file.signal, file.frame);
    if (file.kind == FileClass::Incomplete)
        return pattern_of(file.dropped_reason);
    if (file.kind == FileClass::Timeout || file.kind == FileClass::Memory)
        return file.phase.empty() ? "before its first phase" : fmt::format("in phase {}", file.phase);
    return pattern_of(file.detail);
}

std::vector<FailureGroup> groups_of(const std::vector<FileSummary>& files)
{
    std::map<std::pair<FileClass, std::string>, std::vector<size_t>> by_reason;
    for (size_t i = 0; i < files.size(); ++i)
        if (files[i].kind != FileClass::Done)
            by_reason[{files[i].kind, reason_of(files[i])}].push_back(i);
    std::vector<FailureGroup> groups;
    for (auto& [reason, members] : by_reason)
        groups.push_back({reason.first, reason.second, std::move(members)});
    std::stable_sort(groups.begin(), groups.end(),
                     [](const FailureGroup& a, const FailureGroup& b) { return a.files.size() > b.files.size(); });
    return groups;
}

} // namespace

Result<BatchSummary> summarize(const std::filesystem::path& output)
{
    BatchSummary summary;
    std::unordered_map<std::string, FileSummary> ended;
    std::unordered_map<std::string, FileSummary> started;
    const Result<size_t> torn = read_ledger(output / "ledger", [&](const Json& event) {
        const std::string kind = json_value<std::string>(event, "event", "");
        if (kind == "run") {
            summary.runs.push_back(run_from(event));
        } else if (kind == "stop") {
            for (RunSummary& run : summary.runs)
                if (run.run == json_value<std::string>(event, "run", "-"))
                    run.stop = event;
        } else if (kind == "start") {
            FileSummary start = file_from(event);
            if (FileSummary& last = started[start.file]; start.time >= last.time)
                last = std::move(start);
        } else if (kind == "end" && json_value(event, "final", false)) {
            FileSummary file = file_from(event);
            const auto it = ended.find(file.file);
            if (it == ended.end()) {
                std::string name = file.file;
                ended.emplace(std::move(name), std::move(file));
            } else if (file.time >= it->second.time) {
                // a look at a pack that was there says less than the end that made it
                if (file.found && it->second.kind == file.kind && it->second.key == file.key)
                    it->second.time = file.time;
                else
                    it->second = std::move(file);
            }
        }
    });
    if (!torn)
        return torn.error();
    summary.torn_lines = *torn;
    for (auto& [name, start] : started) {
        const auto it = ended.find(name);
        if (it == ended.end() || it->second.time < start.time)
            summary.begun.push_back(std::move(start));
    }
    for (auto& [name, file] : ended)
        summary.files.push_back(std::move(file));
    for (std::vector<FileSummary>* const list : {&summary.begun, &summary.files})
        std::sort(list->begin(), list->end(),
                  [](const FileSummary& a, const FileSummary& b) { return a.file < b.file; });
    std::sort(summary.runs.begin(), summary.runs.end(),
              [](const RunSummary& a, const RunSummary& b) { return a.time < b.time; });
    summary.groups = groups_of(summary.files);
    return summary;
}

const RunSummary* run_of(const BatchSummary& summary, const FileSummary& file)
{
    const auto run =
        std::find_if(summary.runs.begin(), summary.runs.end(), [&](const RunSummary& r) { return r.run == file.run; });
    return run == summary.runs.end() ? nullptr : &*run;
}

std::string repeat_command(const BatchSummary& summary, const FileSummary& file)
{
    const RunSummary* const run = run_of(summary, file);
    std::string command = fmt::format("trimray pack {} -o repeated.tray", shell_word(file.path));
    if (run == nullptr)
        return command;
    for (const std::string& word : run->pack_words)
        command += ' ' + shell_word(word);
    if (run->timeout_seconds != WorkerLimits{}.wall_seconds)
        command += fmt::format(" --timeout {}", run->timeout_seconds);
    command += fmt::format(" --memory-limit {}", size_word(run->memory_limit_bytes));
    const bool absolute = file.path.starts_with('/');
    return absolute || run->folder.empty() ? command : fmt::format("cd {} && {}", shell_word(run->folder), command);
}

double quantile(const std::vector<double>& sorted, double share)
{
    if (sorted.empty())
        return 0;
    const auto at = static_cast<size_t>(share * static_cast<double>(sorted.size() - 1) + 0.5);
    return sorted[std::min(at, sorted.size() - 1)];
}

} // namespace trimray
