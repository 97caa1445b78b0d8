// JSON files that the viewer keeps between runs.
#pragma once

#include "format/result.h"
#include "runtime/command_json.h"

#include <string>

namespace trimray {

/// Null where there is no such file. Fails: FileNotReadable; InvalidScene (not JSON).
Result<Json> read_state_json(const std::string& file);

/// What is there that is not what was written: to be moved away by hand, for it is not overwritten.
Error not_state(const std::string& file, const std::string& why);

/// As such a file has it.
std::string state_text(const Json& json);

/// Fails: FileNotWritable.
Status write_state_json(const std::string& file, const Json& json);

} // namespace trimray
