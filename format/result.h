// Errors are values: a function that can meet bad input returns Result<T>. Libraries neither print, exit nor throw.
#pragma once

#include <cassert>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace trimray {

/// Process exit codes, the command line's contract.
enum ExitCode : int {
    kExitOk = 0,
    kExitUsage = 1,
    kExitIo = 2,          // a file could not be read or written
    kExitInvalid = 3,     // the input is not what it claims to be
    kExitUnsupported = 4, // valid, but not something this build can do
    kExitInternal = 5,
    kExitPartial = 6, // done, but some faces were dropped, and named
};

/// Numbered once and never reused: scripts and bug reports refer to them. Hundreds give the class:
/// 1xx usage, 2xx files, 3xx invalid input (31x pack findings are listed in format/SPEC.md), 4xx unsupported, 5xx
/// internal.
enum class ErrorCode : int {
    Usage = 100,
    FileNotFound = 200,
    FileNotReadable = 201,
    FileNotWritable = 202,
    ImageNotWritten = 203,
    InvalidCad = 300,
    EmptyCad = 301,
    InvalidPack = 310, // `where` carries the finding number and section
    InvalidSurface = 320,
    InvalidTrim = 321,
    InvalidScene = 330,
    InvalidMesh = 340,
    InvalidBaseline = 350, // a stored run of `bench speed`
    UnsupportedFormat = 400,
    UnsupportedSurface = 401,
    UnsupportedPackFeature = 402,
    NoDevice = 410,
    Internal = 500,
    KernelCrashed = 501,
    KernelTimedOut = 502,
    KernelOutOfMemory = 503,
    KernelWroteTooMuch = 504,
    Interrupted = 505,
    DeviceFailed = 510,
};

/// What went wrong (`code`), where (`file, section or face`), and what was expected, found, and can be done (`detail`).
struct Error {
    ErrorCode code = ErrorCode::Internal;
    std::string where;
    std::string detail;
};

/// The exit code that stands for an error's class.
inline ExitCode exit_code(const Error& error)
{
    switch (static_cast<int>(error.code) / 100) {
    case 1:
        return kExitUsage;
    case 2:
        return kExitIo;
    case 3:
        return kExitInvalid;
    case 4:
        return kExitUnsupported;
    default:
        return kExitInternal;
    }
}

/// A value or the reason why there is none.
template <class T>
class [[nodiscard]] Result {
public:
    Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
    Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

    bool ok() const { return state_.index() == 0; }
    explicit operator bool() const { return ok(); }
    const Error& error() const { return std::get<1>(state_); }

    T& value() &
    {
        assert(ok() && "ask ok() first");
        return std::get<0>(state_);
    }
    const T& value() const&
    {
        assert(ok() && "ask ok() first");
        return std::get<0>(state_);
    }
    T&& value() && { return std::get<0>(std::move(state_)); }

    T& operator*() & { return value(); }
    const T& operator*() const& { return value(); }
    T* operator->() { return &value(); }
    const T* operator->() const { return &value(); }

private:
    std::variant<T, Error> state_;
};

/// Success without a value.
struct Done {};
using Status = Result<Done>;

} // namespace trimray
