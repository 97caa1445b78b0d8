#include "runtime/view/folder_models.h"

#include "format/cad_names.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace trimray {
namespace {
namespace fs = std::filesystem;

void sort_by_name(std::vector<std::string>& names)
{
    std::sort(names.begin(), names.end(), [](const std::string& a, const std::string& b) {
        const int order = strverscmp(a.c_str(), b.c_str());
        return order != 0 ? order < 0 : a < b;
    });
}

} // namespace

Result<FolderListing> list_folder(const std::string& folder)
{
    FolderListing listing;
    std::error_code failed;
    fs::directory_iterator it(folder, failed);
    if (failed)
        return Error{failed == std::errc::no_such_file_or_directory ? ErrorCode::FileNotFound
                                                                    : ErrorCode::FileNotReadable,
                     folder, failed.message()};
    for (const fs::directory_iterator end; it != end && !failed; it.increment(failed)) {
        const std::string name = it->path().filename().string();
        std::error_code unknown; // what cannot be asked about is no folder
        if (name.starts_with('.'))
            continue;
        if (it->is_directory(unknown))
            listing.folders.push_back(name);
        else if (name.ends_with(".tray") || is_cad_name(name))
            listing.models.push_back(name);
    }
    sort_by_name(listing.folders);
    sort_by_name(listing.models);
    return listing;
}

std::vector<std::string> models_beside(const std::string& file)
{
    const fs::path folder = fs::path(file).parent_path();
    const std::string own = fs::path(file).filename().string();
    Result<FolderListing> listing = list_folder(folder.empty() ? "." : folder.string());
    std::vector<std::string> names = listing.ok() ? std::move(listing->models) : std::vector<std::string>();
    if (std::find(names.begin(), names.end(), own) == names.end()) { // gone since, or of another name
        names.push_back(own);
        sort_by_name(names);
    }
    for (std::string& name : names)
        name = (folder / name).string();
    return names;
}

} // namespace trimray
