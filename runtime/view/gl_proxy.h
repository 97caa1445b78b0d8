// A pack's proxy drawn by OpenGL into a texture, for the interface to show until there is a traced picture: seen by the
// same camera, in the pack's colours under the tracers' light at the eye, each triangle flat. Section planes cut it,
// without caps. Lines, other lights, materials of a scene and maps wait for the tracer.
#pragma once

#include "format/result.h"
#include "runtime/placement_view.h"
#include "runtime/view/early_model.h"
#include "runtime/view/proxy_view.h"
#include "runtime/view/view_state.h"

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace trimray {

class GlProxy {
public:
    GlProxy() = default;
    ~GlProxy();
    GlProxy(const GlProxy&) = delete;
    GlProxy& operator=(const GlProxy&) = delete;

    /// Fills the texture; the first time of a model not before it has been asked to for as long as that takes on a
    /// driver that draws on the processor: whenever a traced picture comes then, it loses little by this one. Needs a
    /// current OpenGL context of version 3.2, as all below; leaves the window's framebuffer bound. `placed`: of
    /// model.outline's placements. Fails: DeviceFailed (what the driver says of the shaders).
    Status draw(const std::shared_ptr<const EarlyModel>& model, const PlacementView& placed, const ViewState& state,
                PictureSize size);
    bool is_drawn() const { return uploaded_ != nullptr; }
    /// Straight alpha, sRGB, its first row the picture's lowest. Domain: is_drawn().
    uint32_t texture() const { return texture_; }
    /// Seconds until draw should be called though nothing happens; negative: as long as it takes.
    double patience() const;
    /// Lets go of the model and its picture.
    void clear();

private:
    /// Of the index buffer.
    struct PartRange {
        uint32_t part = 0, first = 0, count = 0;
    };
    struct Placement {
        std::array<std::array<float, 4>, 3> rows;
        uint32_t srgb = 0;
        bool operator==(const Placement&) const = default;
    };
    /// What the picture in the texture is made of, beside the model.
    struct Drawing {
        ProxyProjection projection;
        std::vector<std::array<float, 4>> cuts;
        std::array<float, 4> background{};
        std::vector<Placement> placements;
        std::vector<size_t> first; // of each of parts_, and the end
        bool operator==(const Drawing&) const = default;
    };
    using Clock = std::chrono::steady_clock;
    bool is_due(const std::shared_ptr<const EarlyModel>& model, const PlacementView& placed);
    Status make_program();
    void upload(const EarlyModel& model);
    void make_target(PictureSize size);
    Drawing drawing_of(const EarlyModel& model, const PlacementView& placed, const ViewState& state,
                       PictureSize size) const;
    void set_uniforms(const Drawing& drawing, const Camera& camera) const;
    void draw_parts(const Drawing& drawing) const;

    uint32_t program_ = 0, vertex_array_ = 0, vertices_ = 0, indices_ = 0, placements_ = 0;
    uint32_t framebuffer_ = 0, depths_ = 0, texture_ = 0;
    uint32_t width_ = 0, height_ = 0;
    std::vector<PartRange> parts_;
    Drawing drawn_;
    std::shared_ptr<const EarlyModel> uploaded_, awaited_;
    Clock::time_point due_{}; // when the first picture of awaited_ is to be drawn
};

} // namespace trimray
