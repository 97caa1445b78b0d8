#include "preprocess/batch/file_class.h"

#include <algorithm>
#include <fmt/format.h>
#include <iterator>

namespace trimray {

const char* class_name(FileClass kind)
{
    switch (kind) {
    case FileClass::Done:
        break;
    case FileClass::Incomplete:
        return "incomplete";
    case FileClass::Invalid:
        return "invalid";
    case FileClass::Unsupported:
        return "unsupported";
    case FileClass::Timeout:
        return "timeout";
    case FileClass::Memory:
        return "memory";
    case FileClass::Crash:
        return "crash";
    case FileClass::Io:
        return "io";
    }
    return "done";
}

std::optional<FileClass> class_named(std::string_view name)
{
    for (const FileClass kind : kFileClasses)
        if (name == class_name(kind))
            return kind;
    return std::nullopt;
}

FileClass class_of(const Error& error)
{
    switch (error.code) {
    case ErrorCode::KernelTimedOut:
        return FileClass::Timeout;
    case ErrorCode::KernelOutOfMemory:
        return FileClass::Memory;
    case ErrorCode::KernelWroteTooMuch:
        return FileClass::Io;
    default:
        break;
    }
    switch (exit_code(error)) {
    case kExitIo:
        return FileClass::Io;
    case kExitInvalid:
        return FileClass::Invalid;
    case kExitUnsupported:
        return FileClass::Unsupported;
    default:
        return FileClass::Crash;
    }
}

ExitCode exit_code(FileClass kind)
{
    switch (kind) {
    case FileClass::Done:
        return kExitOk;
    case FileClass::Incomplete:
        return kExitPartial;
    case FileClass::Invalid:
        return kExitInvalid;
    case FileClass::Unsupported:
        return kExitUnsupported;
    case FileClass::Io:
        return kExitIo;
    default:
        return kExitInternal;
    }
}

bool has_pack(FileClass kind)
{
    return kind == FileClass::Done || kind == FileClass::Incomplete;
}

bool worth_a_retry(FileClass kind)
{
    return kind == FileClass::Crash || kind == FileClass::Timeout;
}

Result<std::set<FileClass>> parse_classes(const std::string& option, const std::vector<std::string>& names)
{
    std::set<FileClass> classes;
    for (const std::string& name : names) {
        const std::optional<FileClass> kind = class_named(name);
        if (kind)
            classes.insert(*kind);
        else if (name == "failed")
            std::copy_if(kFileClasses.begin(), kFileClasses.end(), std::inserter(classes, classes.end()),
                         [](FileClass each) { return !has_pack(each); });
        else
            return Error{ErrorCode::Usage, option,
                         fmt::format("'{}' is no class; there are failed (all that have no pack), incomplete, invalid, "
                                     "unsupported, timeout, memory, crash, io",
                                     name)};
    }
    return classes;
}

} // namespace trimray
