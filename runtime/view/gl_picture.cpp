#include "runtime/view/gl_picture.h"

#include <epoxy/gl.h>

namespace trimray {

GlPicture::~GlPicture()
{
    if (texture_ != 0)
        glDeleteTextures(1, &texture_);
}

void GlPicture::set(const Picture& picture, bool smooth)
{
    if (texture_ == 0)
        glGenTextures(1, &texture_);
    glBindTexture(GL_TEXTURE_2D, texture_);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, smooth ? GL_LINEAR : GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    const auto w = static_cast<GLsizei>(picture.width), h = static_cast<GLsizei>(picture.height);
    if (picture.width == width_ && picture.height == height_)
        glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, w, h, GL_RGBA, GL_UNSIGNED_BYTE, picture.rgba.data());
    else
        glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, w, h, 0, GL_RGBA, GL_UNSIGNED_BYTE, picture.rgba.data());
    width_ = picture.width;
    height_ = picture.height;
}

} // namespace trimray
