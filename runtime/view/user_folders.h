// Where a user's files of this program lie, by the XDG base directory specification.
#pragma once

#include "format/result.h"

#include <string>

namespace trimray {

enum class UserFolder {
    Cache, // what can be made again: $XDG_CACHE_HOME/trimray, ~/.cache/trimray
    State, // what was done last: $XDG_STATE_HOME/trimray, ~/.local/state/trimray
};

/// A folder below the user's, made if it is not there. Fails: FileNotWritable, FileNotFound (neither the variable nor
/// HOME is set).
Result<std::string> user_folder(UserFolder folder, const std::string& below = "");

} // namespace trimray
