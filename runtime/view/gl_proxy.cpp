#include "runtime/view/gl_proxy.h"

#include "runtime/camera_frame.h"
#include "runtime/image_io.h"
#include "runtime/view/proxy_shaders.h"
#include "runtime/view/proxy_view.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>

namespace trimray {
namespace {

constexpr uint32_t kDefaultColor = 0xffb4b0acu; // as in shaders/shared/shading.h

struct Vertex {
    float position[3];
    uint32_t srgb; // R in the low byte; alpha 0: the placement's
};
enum Attribute : GLuint { kPosition, kFaceColor, kRowX, kRowY, kRowZ, kPlacementColor };

const void* at(size_t offset)
{
    return reinterpret_cast<const void*>(offset);
}

/// Adds a shader to the program. Fails: DeviceFailed.
Status add_shader(GLuint program, GLenum kind, std::initializer_list<const char*> texts)
{
    const GLuint shader = glCreateShader(kind);
    glShaderSource(shader, static_cast<GLsizei>(texts.size()), texts.begin(), nullptr);
    glCompileShader(shader);
    glAttachShader(program, shader);
    GLint compiled = 0;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    std::array<char, 1024> said{};
    if (compiled == 0)
        glGetShaderInfoLog(shader, static_cast<GLsizei>(said.size()), nullptr, said.data());
    glDeleteShader(shader); // the program keeps it
    if (compiled == 0)
        return Error{ErrorCode::DeviceFailed, "first picture", said.data()};
    return Done{};
}

/// The vertices with the colours of their faces; each lies on one face.
std::vector<Vertex> vertices_of(const EarlyModel& model)
{
    std::vector<Vertex> vertices(model.mesh.positions.size() / 3);
    for (size_t v = 0; v < vertices.size(); ++v)
        std::copy_n(&model.mesh.positions[3 * v], 3, vertices[v].position);
    for (size_t t = 0; t < model.mesh.triangle_face.size(); ++t) {
        const FaceRecord& face = model.outline.faces[model.mesh.triangle_face[t]];
        const uint32_t color = (face.flags & kFaceHasColor) != 0 ? face.color_rgba | 0xff000000u : 0;
        for (size_t k = 0; k < 3; ++k)
            vertices[model.mesh.triangles[3 * t + k]].srgb = color;
    }
    return vertices;
}

/// As bytes of a picture have it, but in [0, 1]; none: transparent.
std::array<float, 4> background_of(const std::optional<std::array<float, 3>>& linear)
{
    std::array<float, 4> srgb{};
    if (!linear)
        return srgb;
    Frame pixel;
    pixel.width = pixel.height = 1;
    pixel.rgba = {(*linear)[0], (*linear)[1], (*linear)[2], 1};
    const Picture picture = to_picture(pixel);
    std::transform(picture.rgba.begin(), picture.rgba.end(), srgb.begin(), [](uint8_t c) { return float(c) / 255; });
    return srgb;
}

/// What a first draw takes: nothing to speak of on a GPU.
double expected_seconds(const EarlyModel& model, const PlacementView& placed)
{
    const auto* const name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    const std::string_view driver = name != nullptr ? name : "";
    if (driver.find("llvmpipe") == driver.npos && driver.find("softpipe") == driver.npos)
        return 0;
    std::vector<uint64_t> triangles(placed.parts.size());
    for (const uint face : model.mesh.triangle_face)
        ++triangles[model.outline.faces[face].part];
    double count = 0;
    for (size_t i = 0; i < placed.instances.size(); ++i)
        if (placed.shows(i))
            count += double(triangles[placed.instances[i].part]);
    constexpr double kShaders = 0.07, kTriangle = 0.2e-6; // seconds, of llvmpipe on two cores
    return kShaders + kTriangle * count;
}

} // namespace

GlProxy::~GlProxy()
{
    clear();
    if (program_ != 0)
        glDeleteProgram(program_);
}

void GlProxy::clear()
{
    awaited_.reset();
    uploaded_.reset();
    if (texture_ == 0)
        return;
    glDeleteVertexArrays(1, &vertex_array_);
    for (uint32_t* buffer : {&vertices_, &indices_, &placements_})
        glDeleteBuffers(1, buffer);
    glDeleteFramebuffers(1, &framebuffer_);
    glDeleteRenderbuffers(1, &depths_);
    glDeleteTextures(1, &texture_);
    texture_ = width_ = height_ = 0;
    parts_.clear();
    drawn_ = {};
}

Status GlProxy::make_program()
{
    if (program_ != 0)
        return Done{};
    const GLuint program = glCreateProgram();
    Status made = add_shader(program, GL_VERTEX_SHADER, {kProxyVertexShader});
    if (made.ok())
        made = add_shader(program, GL_FRAGMENT_SHADER, {kProxyShadingPrelude, kProxyShading, kProxyFragmentShader});
    if (made.ok()) {
        const std::pair<GLuint, const char*> names[] = {{kPosition, "position"}, {kFaceColor, "face_color"},
                                                        {kRowX, "row_x"},        {kRowY, "row_y"},
                                                        {kRowZ, "row_z"},        {kPlacementColor, "placement_color"}};
        for (const auto& [attribute, name] : names)
            glBindAttribLocation(program, attribute, name);
        glLinkProgram(program);
        GLint linked = 0;
        glGetProgramiv(program, GL_LINK_STATUS, &linked);
        std::array<char, 1024> said{};
        glGetProgramInfoLog(program, static_cast<GLsizei>(said.size()), nullptr, said.data());
        if (linked == 0)
            made = Error{ErrorCode::DeviceFailed, "first picture", said.data()};
    }
    if (!made.ok())
        glDeleteProgram(program);
    else
        program_ = program;
    return made;
}

void GlProxy::upload(const EarlyModel& model)
{
    if (texture_ == 0) {
        glGenVertexArrays(1, &vertex_array_);
        for (uint32_t* buffer : {&vertices_, &indices_, &placements_})
            glGenBuffers(1, buffer);
        glGenFramebuffers(1, &framebuffer_);
        glGenRenderbuffers(1, &depths_);
        glGenTextures(1, &texture_);
    }
    glBindVertexArray(vertex_array_);
    const std::vector<Vertex> vertices = vertices_of(model);
    glBindBuffer(GL_ARRAY_BUFFER, vertices_);
    glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(vertices.size() * sizeof(Vertex)), vertices.data(), GL_STATIC_DRAW);
    glVertexAttribPointer(kPosition, 3, GL_FLOAT, GL_FALSE, sizeof(Vertex), at(offsetof(Vertex, position)));
    glVertexAttribPointer(kFaceColor, 4, GL_UNSIGNED_BYTE, GL_TRUE, sizeof(Vertex), at(offsetof(Vertex, srgb)));
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, GLsizeiptr(model.mesh.triangles.size() * sizeof(uint)),
                 model.mesh.triangles.data(), GL_STATIC_DRAW);
    for (const GLuint attribute : {kPosition, kFaceColor, kRowX, kRowY, kRowZ, kPlacementColor})
        glEnableVertexAttribArray(attribute);
    for (const GLuint attribute : {kRowX, kRowY, kRowZ, kPlacementColor})
        glVertexAttribDivisor(attribute, 1);
    // triangles are in the order of faces, and those in the order of parts
    parts_.clear();
    for (size_t t = 0; t < model.mesh.triangle_face.size(); ++t) {
        const uint32_t part = model.outline.faces[model.mesh.triangle_face[t]].part;
        if (parts_.empty() || parts_.back().part != part)
            parts_.push_back({part, uint32_t(3 * t), 0});
        parts_.back().count += 3;
    }
}

void GlProxy::make_target(PictureSize size)
{
    if (size.width == width_ && size.height == height_)
        return;
    width_ = size.width;
    height_ = size.height;
    const auto w = static_cast<GLsizei>(width_), h = static_cast<GLsizei>(height_);
    glBindRenderbuffer(GL_RENDERBUFFER, depths_);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, w, h);
    glBindTexture(GL_TEXTURE_2D, texture_);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, w, h, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
    for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
        glTexParameteri(GL_TEXTURE_2D, filter, GL_NEAREST); // as large as it is shown
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_, 0);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depths_);
}

void GlProxy::set_uniforms(const Drawing& drawing, const Camera& camera) const
{
    const auto uniform = [this](const char* name) { return glGetUniformLocation(program_, name); };
    const ProxyProjection& projection = drawing.projection;
    glUniform4f(uniform("projection"), float(projection.scale_x), float(projection.scale_y),
                float(projection.depth_scale), float(projection.depth_offset));
    glUniform1i(uniform("parallel"), projection.parallel ? 1 : 0);
    const CameraAxes axes = camera_axes(camera);
    for (const auto& [name, axis] :
         {std::pair{"right", &axes.right}, std::pair{"up", &axes.up}, std::pair{"forward", &axes.forward}})
        glUniform3f(uniform(name), float((*axis)[0]), float((*axis)[1]), float((*axis)[2]));
    glUniform1i(uniform("cut_count"), static_cast<GLint>(drawing.cuts.size()));
    if (!drawing.cuts.empty())
        glUniform4fv(uniform("cuts"), static_cast<GLsizei>(drawing.cuts.size()), drawing.cuts.front().data());
}

/// The placements of each part that has triangles, one part after another.
GlProxy::Drawing GlProxy::drawing_of(const EarlyModel& model, const PlacementView& placed, const ViewState& state,
                                     PictureSize size) const
{
    Drawing drawing;
    drawing.projection = proxy_projection(state.camera, placed, size);
    drawing.cuts = proxy_cuts(state.camera, state.look.look.section);
    drawing.background = background_of(state.look.background);
    std::vector<std::vector<uint32_t>> of_part(placed.parts.size());
    for (uint32_t i = 0; i < placed.instances.size(); ++i)
        if (placed.shows(i))
            of_part[placed.instances[i].part].push_back(i);
    for (const PartRange& range : parts_) {
        drawing.first.push_back(drawing.placements.size());
        for (const uint32_t i : of_part[range.part]) {
            const uint32_t color = model.outline.instances[i].color_rgba;
            drawing.placements.push_back(
                {proxy_placement(state.camera, placed, i), color >> 24 != 0 ? color : kDefaultColor});
        }
    }
    drawing.first.push_back(drawing.placements.size());
    return drawing;
}

void GlProxy::draw_parts(const Drawing& drawing) const
{
    glBindBuffer(GL_ARRAY_BUFFER, placements_);
    glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(drawing.placements.size() * sizeof(Placement)), drawing.placements.data(),
                 GL_STREAM_DRAW);
    for (size_t r = 0; r < parts_.size(); ++r) {
        const size_t offset = drawing.first[r] * sizeof(Placement);
        for (const GLuint row : {0u, 1u, 2u})
            glVertexAttribPointer(kRowX + row, 4, GL_FLOAT, GL_FALSE, sizeof(Placement),
                                  at(offset + row * sizeof(std::array<float, 4>)));
        glVertexAttribPointer(kPlacementColor, 4, GL_UNSIGNED_BYTE, GL_TRUE, sizeof(Placement),
                              at(offset + offsetof(Placement, srgb)));
        glDrawElementsInstanced(GL_TRIANGLES, static_cast<GLsizei>(parts_[r].count), GL_UNSIGNED_INT,
                                at(parts_[r].first * sizeof(uint)),
                                static_cast<GLsizei>(drawing.first[r + 1] - drawing.first[r]));
    }
}

bool GlProxy::is_due(const std::shared_ptr<const EarlyModel>& model, const PlacementView& placed)
{
    if (awaited_ != model) {
        awaited_ = model;
        uploaded_.reset();
        due_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                  std::chrono::duration<double>(expected_seconds(*model, placed)));
    }
    return uploaded_ == model || Clock::now() >= due_;
}

double GlProxy::patience() const
{
    if (!awaited_ || uploaded_)
        return -1;
    return std::max(0.001, std::chrono::duration<double>(due_ - Clock::now()).count());
}

Status GlProxy::draw(const std::shared_ptr<const EarlyModel>& model, const PlacementView& placed,
                     const ViewState& state, PictureSize size)
{
    if (!is_due(model, placed))
        return Done{};
    if (Status made = make_program(); !made.ok())
        return made;
    const bool is_new = uploaded_ != model || size.width != width_ || size.height != height_;
    if (uploaded_ != model)
        upload(*model);
    uploaded_ = model;
    make_target(size);
    Drawing drawing = drawing_of(*model, placed, state, size);
    if (!is_new && drawing == drawn_)
        return Done{}; // it is in the texture
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
    glViewport(0, 0, static_cast<GLsizei>(width_), static_cast<GLsizei>(height_));
    const std::array<float, 4>& background = drawing.background;
    glClearColor(background[0], background[1], background[2], background[3]);
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_BLEND);
    glDisable(GL_CULL_FACE);
    glEnable(GL_DEPTH_TEST);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glUseProgram(program_);
    glBindVertexArray(vertex_array_);
    set_uniforms(drawing, state.camera);
    draw_parts(drawing);
    glDisable(GL_DEPTH_TEST);
    glBindVertexArray(0);
    glUseProgram(0);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    drawn_ = std::move(drawing);
    return Done{};
}

} // namespace trimray
