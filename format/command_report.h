// How every program and subcommand speaks: results on stdout, all else on stderr; an error is one line that says what
// went wrong, where, and what to do; its exit code is its class (format/result.h).
#pragma once

#include "format/result.h"

#include <string>
#include <string_view>

namespace trimray {

/// `text` on one line without control characters: names in a hostile file can neither break a line nor steer a
/// terminal.
std::string printable(std::string_view text);

/// Prints `<program>: <where>: <detail> [E<number>]` on stderr. Returns the exit code of the error's class.
int report_error(const Error& error, std::string_view program = "trimray");

/// Prints `<program>: <text>` on stderr: what was chosen and why, never an error.
void report_note(std::string_view text, std::string_view program = "trimray");

/// Shows what is being done in place of what was shown before, where stderr is a terminal; "" removes it.
void report_progress(std::string_view text);

} // namespace trimray
