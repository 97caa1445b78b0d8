// How a file of a batch ended: its class, the exit status that stands for it, and what is done about it.
#pragma once

#include "format/result.h"

#include <array>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace trimray {

enum class FileClass {
    Done,        // every face is in the pack
    Incomplete,  // a pack, with faces dropped and named
    Invalid,     // no CAD file, or none with faces
    Unsupported, // a format or surface that cannot be converted
    Timeout,
    Memory,
    Crash, // of the CAD kernel, or ours
    Io,    // the file could not be read, or the pack not written
};

inline constexpr std::array kFileClasses{FileClass::Done,        FileClass::Incomplete, FileClass::Invalid,
                                         FileClass::Unsupported, FileClass::Timeout,    FileClass::Memory,
                                         FileClass::Crash,       FileClass::Io};

/// "done", "incomplete", "invalid", ...
const char* class_name(FileClass kind);
std::optional<FileClass> class_named(std::string_view name);

/// Classes as words of an option; "failed" is all that have no pack. Fails: Usage.
Result<std::set<FileClass>> parse_classes(const std::string& option, const std::vector<std::string>& names);

/// The class of a conversion that failed.
FileClass class_of(const Error& error);

/// As `trimray pack` would end.
ExitCode exit_code(FileClass kind);

/// Done and Incomplete.
bool has_pack(FileClass kind);

/// Whether a second attempt, with the kernel's healing switched the other way, is worth it: it takes another path
/// through the kernel, so it can help where that crashed or hung, and never where the file is not what it claims to be.
bool worth_a_retry(FileClass kind);

} // namespace trimray
