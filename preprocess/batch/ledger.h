// What happened to the files of a batch: append-only lines of JSON in OUTDIR/ledger, one file a shard, one line an
// event (run, start, end, stop). BATCH.md has every key.
#pragma once

#include "format/result.h"
#include "preprocess/batch/file_class.h"
#include "preprocess/batch/store.h"

#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <unordered_map>
#include <vector>

namespace trimray {

using Json = nlohmann::ordered_json;

/// The value under `key`; `otherwise`, where it is missing or of another kind.
template <class T>
T json_value(const Json& object, const char* key, T otherwise)
{
    const auto it = object.find(key);
    if (it == object.end())
        return otherwise;
    if constexpr (std::is_same_v<T, std::string>)
        return it->is_string() ? it->template get<std::string>() : otherwise;
    else if constexpr (std::is_same_v<T, bool>)
        return it->is_boolean() ? it->template get<bool>() : otherwise;
    else
        return it->is_number() ? it->template get<T>() : otherwise;
}

/// "2026-11-23T17:00:00.123Z"
std::string time_text();

/// The file beside a ledger's that is locked while somebody writes it. Not the ledger itself: on some network file
/// systems nobody else could read that meanwhile.
std::filesystem::path ledger_lock(std::filesystem::path ledger);

/// Appends events. Each is on the disk as one whole line, or not at all, whenever this process is ended.
class LedgerWriter {
public:
    /// Opens `shard`.jsonl, or `shard`-2.jsonl and so on while living processes hold those before.
    /// Fails: FileNotWritable.
    static Result<LedgerWriter> open(const Store& store, const std::string& shard);
    LedgerWriter(LedgerWriter&& other) noexcept;
    ~LedgerWriter();

    const std::filesystem::path& path() const { return path_; }

    /// Adds the time and writes. Fails: FileNotWritable (the disk is full, say).
    Status append(const char* event, const Json& keys) const;

private:
    LedgerWriter(std::filesystem::path path, FileLock lock, int descriptor)
        : path_(std::move(path)), lock_(std::move(lock)), descriptor_(descriptor)
    {
    }
    std::filesystem::path path_;
    FileLock lock_;
    int descriptor_;
};

/// Calls `take` with every event of every file of the ledger, by file and in order. Lines that are no events (cut short
/// by a crash of the machine) are counted, not taken. Fails: FileNotReadable.
Result<size_t> read_ledger(const std::filesystem::path& folder, const std::function<void(const Json&)>& take);

/// The last that is known of a file.
struct FileState {
    FileClass kind = FileClass::Done;
    bool ended = false; // else it was started, and the run ended before it
    uint64_t bytes = 0;
    int64_t modified_ns = 0;
    std::string basis; // of the run that ended it
    std::string key;   // of its pack; empty: none
    std::string time;  // when it ended
};

/// The state of every file that the ledger speaks of, by name.
Result<std::unordered_map<std::string, FileState>> read_states(const std::filesystem::path& folder);

} // namespace trimray
