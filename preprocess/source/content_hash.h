// The hash that identifies a model's content: its file's bytes and those of the files it refers to.
#pragma once

#include "format/result.h"
#include "preprocess/source/byte_stream.h"
#include "preprocess/source/step_references.h"

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace trimray {

/// What one pass over a file's bytes finds.
struct Content {
    uint64_t bytes = 0;
    std::string hash; // "xxh3-128:<32 hex digits>", as xxh128sum prints them
    StepReferences references;
};

/// Reads all of `stream`; each chunk goes to `sink` too, if there is one. Fails: as `stream` and `sink`.
Result<Content> read_content(ByteStream& stream, const std::function<Status(std::string_view)>& sink = {});

/// The hash of `content`, that of the file `path`, and of the files beside it that it refers to, and those that these
/// refer to, each once; of the same form, and content.hash itself if there are none. A file that is not there, not
/// readable or empty counts by its name alone, which is among the bytes that are hashed.
/// Fails: FileNotReadable (while reading), UnsupportedFormat (too many files, or too large).
Result<std::string> hash_with_references(const Content& content, const std::string& path);

} // namespace trimray
