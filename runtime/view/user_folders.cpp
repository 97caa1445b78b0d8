#include "runtime/view/user_folders.h"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <system_error>

namespace trimray {
namespace {
namespace fs = std::filesystem;

struct Names {
    const char *variable, *below_home, *what;
};
constexpr Names names_of(UserFolder folder)
{
    return folder == UserFolder::Cache ? Names{"XDG_CACHE_HOME", ".cache", "cache"}
                                       : Names{"XDG_STATE_HOME", ".local/state", "state"};
}

} // namespace

Result<std::string> user_folder(UserFolder folder, const std::string& below)
{
    const Names names = names_of(folder);
    const char* own = std::getenv(names.variable);
    const char* home = std::getenv("HOME");
    fs::path path;
    if (own && fs::path(own).is_absolute()) // as the specification says, others are ignored
        path = own;
    else if (home && *home)
        path = fs::path(home) / names.below_home;
    else
        return Error{ErrorCode::FileNotFound, names.what,
                     fmt::format("neither {} nor HOME is set; set one", names.variable)};
    path /= "trimray";
    if (!below.empty())
        path /= below;
    std::error_code failed;
    fs::create_directories(path, failed);
    if (failed)
        return Error{ErrorCode::FileNotWritable, path.string(),
                     fmt::format("cannot be made: {}; set {} to another folder", failed.message(), names.variable)};
    return path.string();
}

} // namespace trimray
