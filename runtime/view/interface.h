// What is drawn around and over the picture: the panels (panels.h, tree_panel.h), messages, the progress of opening.
#pragma once

#include "runtime/view/gl_picture.h"
#include "runtime/view/gl_proxy.h"
#include "runtime/view/open_panel.h"
#include "runtime/view/tree_panel.h"
#include "runtime/view/viewer.h"

#include <cstdint>

namespace trimray {

class Interface {
public:
    explicit Interface(float scale) : scale_(scale) {}

    /// Draws all of it into the frame at hand of a window of so many pixels, and tells the viewer where its picture is.
    void draw(Viewer& viewer, int width, int height);
    /// Whether the pointer, or the keys, are the interface's now: the viewer does not get them.
    bool wants_pointer() const { return wants_pointer_; }
    bool wants_keys() const { return wants_keys_; }
    /// The first picture, drawn until there is a traced one.
    const GlProxy& proxy() const { return proxy_; }

private:
    void draw_picture(Viewer& viewer);
    void draw_early(Viewer& viewer);
    void draw_selection(Viewer& viewer);
    void draw_toasts(Viewer& viewer);
    void draw_open(Viewer& viewer);
    void draw_progress(Viewer& viewer);

    float scale_;
    GlPicture picture_, selection_, errors_;
    const ErrorMask* drawn_errors_ = nullptr;
    uint64_t drawn_errors_count_ = 0;
    GlProxy proxy_;
    uint64_t uploaded_ = 0;
    TreePanel tree_;
    OpenPanel open_;
    bool wants_pointer_ = false, wants_keys_ = false;
};

} // namespace trimray
