// A picture as a texture, for the interface to draw.
#pragma once

#include "runtime/image_io.h"

#include <cstdint>

namespace trimray {

class GlPicture {
public:
    GlPicture() = default;
    ~GlPicture();
    GlPicture(const GlPicture&) = delete;
    GlPicture& operator=(const GlPicture&) = delete;

    /// Needs a current OpenGL context, as all below. Straight alpha, sRGB: what the interface draws with.
    /// `smooth`: blended between pixels where it is drawn larger than it is.
    void set(const Picture& picture, bool smooth);
    uint32_t texture() const { return texture_; } // 0: none yet
    uint32_t width() const { return width_; }
    uint32_t height() const { return height_; }

private:
    uint32_t texture_ = 0, width_ = 0, height_ = 0;
};

} // namespace trimray
