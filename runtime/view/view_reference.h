// What a view shows in truth, made once and asked often: what pictures of the same view by other settings are held
// against, pixel by pixel.
//
// The reference is the one in double (format/closest_reference.h): it shares no code with the tracers, and no setting
// that a person can choose changes it. Where planes cut the model, which it does not know, it is the best picture that
// the CPU tracer makes instead (exact trims, certified hits, an error of kBestErrorPx); in_double() says so. Either is
// of surfaces alone: where their first hit lies and which face of which placement it is, not of lines, colours or what
// is seen through them.
#pragma once

#include "format/closest_reference.h"
#include "format/result.h"
#include "runtime/arrangement.h"
#include "runtime/reference_rays.h"
#include "runtime/spread.h"
#include "runtime/tracer.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace trimray {

constexpr float kBestErrorPx = 1e-4f;

enum class PixelVerdict : uint8_t {
    Right,     // as the reference, as far as is asked
    OtherFace, // at the right depth another face, or another placement's
    Wrong,     // hits where the reference misses, misses where it hits, or hits too near or too far
    // Another answer than the reference's, whose own answer changes so where its ray moves by kHairPx, or two faces lie
    // at one depth there and either may be seen
    Open,
};
constexpr double kHairPx = 1e-3;

struct ViewErrors {
    uint64_t pixels = 0;
    uint64_t wrong = 0, other_face = 0, open = 0; // PixelVerdict, at kWrongDepth (closest_errors.h)
    uint64_t uncertified = 0;                     // by the picture itself
    // Of pixels that hit in both, but for open ones: distances between the hits along the ray, in mm and in widths of a
    // pixel there
    Spread depth_mm, depth_px;
    // Over all pixels, in widths of a pixel: a hit's distance from the right one, at most 1; 1 where it is another face
    // or one of both misses; 0 where the verdict is open
    double mean_error_px = 0;

    double differing_share() const { return pixels > 0 ? double(wrong + other_face) / double(pixels) : 0; }
};

class ViewReference {
public:
    /// Of a picture's camera, size, arrangement and sections; everything else that `options` ask for does not matter.
    /// In double about a hundred thousand pixels a second and core. `progress` is told the share that is done, by one
    /// thread at a time. Fails: Interrupted (options.cancelled), as Tracer::render.
    static Result<ViewReference> make(std::shared_ptr<const Scene> scene, const RenderOptions& options,
                                      const std::function<void(double share)>& progress = {});

    bool in_double() const { return in_double_; }
    uint32_t width() const { return width_; }
    uint32_t height() const { return height_; }

    /// Of every pixel of a frame of the same view. A hit is wrong farther than `depth_px` widths of a pixel from the
    /// reference's. Where the answers differ the reference is asked around the pixel, once. Fails: Interrupted.
    Result<std::vector<PixelVerdict>> verdicts(const Frame& frame, double depth_px,
                                               const std::function<bool()>& cancelled = {});

    /// Fails: Interrupted.
    Result<ViewErrors> errors(const Frame& frame, const std::function<bool()>& cancelled = {});

private:
    ViewReference(std::shared_ptr<const Scene> scene, const RenderOptions& options);
    Status trace_in_double(const RenderOptions& options, const std::function<void(double)>& progress);
    Status trace_best(const RenderOptions& options);
    PixelVerdict verdict(const Frame& frame, size_t i, double depth_px);
    PixelVerdict changes_within_a_hair(size_t i) const;
    bool is_tie(const Frame& frame, size_t i) const;
    reference::Ray ray_at(size_t i, double x, double y) const;
    double footprint_mm(size_t i) const;

    std::shared_ptr<const Scene> scene_; // before what refers to it
    std::unique_ptr<KeptArrangement> arrangement_;
    std::unique_ptr<ClosestReference> closest_; // null: not in double
    ReferenceRays rays_;
    uint32_t width_, height_;
    bool in_double_;
    std::vector<double> depth_mm_; // infinite: a miss
    std::vector<int32_t> face_, instance_;
    // By pixel, once it was asked for: what it may become a hair beside itself: Right (the same), OtherFace, Wrong
    std::vector<PixelVerdict> beside_;
    std::vector<uint8_t> asked_;
};

} // namespace trimray
