#include "preprocess/batch/resume.h"

namespace trimray {

std::vector<BatchFile> unsettled(std::vector<BatchFile> files, const Store& store, const std::string& basis,
                                 const std::set<FileClass>& retry,
                                 const std::unordered_map<std::string, FileState>& states)
{
    std::erase_if(files, [&](const BatchFile& file) {
        const auto it = states.find(file.name);
        if (it == states.end() || !it->second.ended)
            return false;
        const FileState& state = it->second;
        if (state.bytes != file.bytes || state.modified_ns != file.modified_ns || state.basis != basis ||
            retry.count(state.kind) > 0)
            return false;
        std::error_code failed;
        return !has_pack(state.kind) || std::filesystem::exists(store.pack_path(state.key), failed);
    });
    return files;
}

} // namespace trimray
