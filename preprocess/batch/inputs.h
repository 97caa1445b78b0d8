// INPUTS of a batch -> its files, in the order of work.
#pragma once

#include "format/result.h"

#include <cstdint>
#include <string>
#include <vector>

namespace trimray {

struct BatchFile {
    std::string path; // to open: as given, or below a folder as given; a member of an archive is ARCHIVE!/MEMBER
    std::string name; // in the ledger and in packs/: the path without "/", "./" and "../" at its start
    uint64_t bytes = 0;
    int64_t modified_ns = 0; // of the file, or of its archive
};

/// Part `index` of `count`, as --shard I/N says.
struct Shard {
    uint32_t index = 0, count = 1;
};
/// "2/8" -> part 2 of 0..7. Fails: Usage.
Result<Shard> parse_shard(const std::string& text);
/// "2-of-8": the ledger's file name.
std::string shard_name(const Shard& shard);

struct InputOptions {
    std::vector<std::string> inputs;  // folders, files, patterns (quoted "*.step"), "-" for a list on stdin
    std::string list;                 // a file with a path a line; empty: none
    std::vector<std::string> include; // patterns that a name has to match, one of them; none: every CAD file
    Shard shard;
};

struct InputList {
    std::vector<BatchFile> files;     // of the shard; the largest first, then by name, each file once
    std::vector<Error> unreadable;    // archives and folders that could not be listed: failures of their own
    uint64_t files_of_all_shards = 0; // of which `files` is a part
};

/// Lists the inputs. Folders are walked, and .zip files in them; links to folders are not followed. Which shard a file
/// falls to depends on its name alone, so that hosts agree.
/// Fails: FileNotFound (an input that does not exist, a pattern that matches nothing), Usage (two inputs with one
/// name).
Result<InputList> list_inputs(const InputOptions& options);

/// A file of an earlier batch as it is now: with its size (a member of an archive keeps the one it had) and its time.
/// It may be gone: then those stay as they were.
BatchFile as_it_is_now(BatchFile file);

} // namespace trimray
