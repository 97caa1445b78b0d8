// The panel that opens files: those that were open last, with the pictures that their packs hold, and what lies in a
// folder.
#pragma once

#include "runtime/view/folder_models.h"
#include "runtime/view/gl_picture.h"
#include "runtime/view/recent_files.h"
#include "runtime/view/viewer.h"

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace trimray {

class OpenPanel {
public:
    /// Over the picture. `invites`: there is nothing else to see; it cannot be closed.
    void draw(Viewer& viewer, bool invites, float scale);
    /// It was not drawn: what it lists is read anew the next time.
    void forget() { listed_ = false; }

private:
    struct Recent {
        RecentFile file;
        std::unique_ptr<GlPicture> picture; // null: the pack is gone, or has none
    };
    void list(const Viewer& viewer);
    void list_folder_of(const std::string& folder);
    void draw_recent(Viewer& viewer, float scale);
    void draw_folder(Viewer& viewer);
    void open(Viewer& viewer, const std::string& file);

    bool listed_ = false;
    std::vector<Recent> recent_;
    std::string folder_, failure_;
    FolderListing listing_;
    std::array<char, 1024> typed_{};
};

} // namespace trimray
