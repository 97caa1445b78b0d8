// A picture's rays as the CPU tracer takes them. Everything here is double and the same for all rays of a block of
// pixels; the lanes (cpu_lanes.h) take over with what it prepares, and find the leaves that the rays can meet.
//
// A pixel at (x, y) from the picture's centre looks along w = w0 + x step_x + y step_y; a point of its ray is eye + tau
// w. Affine maps keep tau, so it compares across parts; in the world |w0| = 1 and tau is in mm. In a part, w0 and the
// steps are scaled by 1 / k so that |w0| = 1 again, and tau_part = k tau. See shaders/shared/precision.h.
#pragma once

#include "format/derive_kd.h"
#include "format/pack_image.h"
#include "runtime/camera.h"
#include "runtime/placement_view.h"
#include "runtime/tracer.h"

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

namespace trimray {

/// What the tracer adds to a pack at load: the leaves' boxes in part units, colours in linear light.
struct CpuScene {
    explicit CpuScene(const PackImage& image);

    struct LeafBounds {
        float center[3];
        float half_axis[3][3]; // the box's half sides as vectors
    };
    const PackImage& image;
    std::vector<LeafBounds> leaf_bounds;
    std::vector<std::array<float, 3>> face_color; // linear; of faces that have one
    std::vector<std::array<float, 3>> instance_color;
    std::vector<uint8_t> left_handed;  // patches whose axes are a mirror image
    std::vector<uint8_t> shared_patch; // native patches with several leaves
    /// A box around a part's leaves, part units.
    struct PartBox {
        double lo[3], hi[3];
        bool has_rims; // a face of the part has one
    };
    std::vector<PartBox> part_boxes;
    size_t bytes() const;

    /// The kd-trees of the pack's trims, built when first asked for. Fails: as derive_kd.
    const Result<KdTrims>& kd_trims() const;

private:
    mutable std::once_flag kd_once_;
    mutable std::optional<Result<KdTrims>> kd_;
};

/// The scene's own, or a new one.
std::shared_ptr<const CpuScene> prepared(const Scene& scene);

/// The view seen from one instance's part.
struct InstanceView {
    double eye[3]; // part units
    double w0[3], step_x[3], step_y[3];
    double k; // tau_part = k * tau
    // tau, tau x and tau y of a point p are rows of the inverse of (w0, step_x, step_y) times p - eye
    double row_tau[3], row_x[3], row_y[3];
    float normal[3][3];   // part to world, for normals: inverse transpose, any length
    double far_slack = 0; // what doubles lose of a tau where the eye stands far back for parallel rays, part units
    bool outside = false; // seen_from_outside
};

struct View {
    PlacementView placed;
    double eye_mm[3], w0[3], step_x[3], step_y[3]; // world
    double tau_ref = 0;                            // mm; distances are stored relative to this
    double plane_mm = 0;                           // CameraRays::plane_mm: what has a smaller tau is not seen
    double depth_ref = 0;                          // tau_ref - plane_mm, a float's value
    std::vector<InstanceView> instances;
    std::optional<uint32_t> alone; // the only instance that rays meet, without the tree
};

/// Rays of a camera. x runs from -width / 2 to width / 2.
View make_view(const PlacementView& placed, const CameraRays& rays, uint32_t width, uint32_t height);
/// The ray at x = y = 0 alone; pixels are 1e-4 wide.
View make_single_ray_view(const PlacementView& placed, const std::array<double, 3>& origin_mm,
                          const std::array<double, 3>& direction);

/// The top tree's units seen as an instance's part.
InstanceView world_view(const View& view);

/// A rectangle of the picture, in pixels from its centre.
struct PixelRect {
    float x0, x1, y0, y1;
};

/// The constants of a patch for the rays of a view. Ray: origin + tau * d, direction w0 + d, d = x step_x + y step_y.
struct PatchView {
    float origin[3];                   // patch space
    float tau;                         // patch units
    float w0[3], step_x[3], step_y[3]; // patch axes
    float base_mm, mm_per_t;           // tau - tau_ref of a point at t on the ray = base_mm + mm_per_t * t
    float slack_mm;                    // rounding of that
    float pixel;                       // a pixel's width where tau is 1
};

/// A strip of the picture, in pixels from its centre: lo <= nx x + ny y <= hi. The larger of |nx| and |ny| is 1.
struct PixelStrip {
    float nx, ny, lo, hi;
};
constexpr PixelStrip kWholePicture{0, 0, -1, 1};

/// A leaf that rays of a block may meet, nearest first.
struct Candidate {
    PixelRect rect;      // of its box on the picture
    PixelStrip strip[2]; // along the two sides of its box that are the longest there: they fit what lies askew
    float near_mm;       // least tau - tau_ref of its box
    uint32_t leaf, instance;
};

PatchView make_patch_view(const PatchRecord& patch, const InstanceView& instance, double tau_ref);

} // namespace trimray
