#include "runtime/view/recent_files.h"

#include "format/pack_writer.h"
#include "runtime/view/state_json.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <span>
#include <system_error>

namespace trimray {
namespace fs = std::filesystem;

Result<std::vector<RecentFile>> read_recent_files(const std::string& list)
{
    const Result<Json> read = read_state_json(list);
    if (!read.ok())
        return read.error();
    std::vector<RecentFile> files;
    for (const Json& item : *read) {
        if (!item.is_object() || !item.contains("file") || !item["file"].is_string() || !item.contains("pack") ||
            !item["pack"].is_string())
            return not_state(list, "expected a list of objects with 'file' and 'pack'");
        files.push_back({item["file"], item["pack"]});
        if (files.size() == kMostRecentFiles)
            break;
    }
    return files;
}

Status remember_file(const std::string& list, const RecentFile& opened)
{
    const Result<std::vector<RecentFile>> before = read_recent_files(list);
    if (!before.ok())
        return before.error();
    std::error_code failed;
    const auto absolute = [&](const std::string& file) {
        return fs::absolute(file, failed).lexically_normal().string();
    };
    std::vector<RecentFile> files{{absolute(opened.file), absolute(opened.pack)}};
    for (const RecentFile& file : *before)
        if (file.file != files.front().file && files.size() < kMostRecentFiles)
            files.push_back(file);
    if (files == *before)
        return Done{};
    Json json = Json::array();
    for (const RecentFile& file : files)
        json.push_back({{"file", file.file}, {"pack", file.pack}});
    return write_state_json(list, json);
}

} // namespace trimray
