// The models that lie in a folder.
#pragma once

#include "format/result.h"

#include <string>
#include <vector>

namespace trimray {

struct FolderListing {
    std::vector<std::string> folders, models; // names; numbers within them in order of their values
};

/// Packs and CAD files, compressed ones too, and the folders beside them; hidden ones left out. Fails: FileNotFound,
/// FileNotReadable.
Result<FolderListing> list_folder(const std::string& folder);

/// The models beside a file, itself among them, as paths that begin as its own does.
std::vector<std::string> models_beside(const std::string& file);

} // namespace trimray
