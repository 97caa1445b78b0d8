// How far a picture is from that of the reference for closest hits: in decibels, and in pixels that show something
// else.
#pragma once

#include "format/closest_reference.h"
#include "runtime/image_io.h"
#include "runtime/reference_rays.h"
#include "runtime/tracer.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace trimray {

struct ClosestErrors {
    double psnr_db = 0; // over white; ties count as equal
    uint64_t pixels = 0;
    // of pixels whose answer stays where their ray moves by 1e-3 pixels
    uint64_t missing = 0, extra = 0;
    uint64_t wrong_depth = 0; // both hit, more than kWrongDepth apart
    uint64_t tangent = 0;     // any of these, but such a move changes the reference's answer
    // Pixels that show another face than the reference's picture, of two that lie within 1e-3 pixels of each other
    // there: which of them is seen is open, and their colours differ. Ascending indices
    std::vector<size_t> ties;
    uint64_t wrong() const { return missing + extra + wrong_depth; }
};
constexpr double kWrongDepth = 0.1; // footprints: distance times the angle of a pixel

/// The reference's picture of one view, made once, and its own doubts about pixels, which are asked for as they come
/// and remembered.
class ReferencePicture {
public:
    /// `options` say camera and size; the picture is certified, with exact trims. Fails: as Tracer::render.
    static Result<ReferencePicture> make(std::shared_ptr<const Scene> scene, const RenderOptions& options);

    /// Compares a frame of the same view and size, on all cores.
    ClosestErrors errors(const Frame& frame);

    /// A picture of the same view with the reference's own colours in those pixels.
    Picture without_ties(Picture picture, const std::vector<size_t>& ties) const;

    const Frame& frame() const { return frame_; }
    const Picture& picture() const { return picture_; } // the frame over white
    /// A pixel's width where pixel i hits, world mm: its distance times its angle. Domain: it hits.
    double footprint_mm(size_t i) const;

private:
    ReferencePicture(std::shared_ptr<const Scene> scene, const RenderOptions& options, Frame frame);

    bool is_tangent(uint32_t x, uint32_t y);
    /// Domain: pixel i hits in both.
    bool is_tie(size_t i, const Frame& frame) const;

    enum class Asked : uint8_t { No, Sure, Tangent };
    std::shared_ptr<const Scene> scene_; // before what refers to it
    ClosestReference closest_;
    CameraRays steps_; // from pixel to pixel
    ReferenceRays rays_;
    uint32_t width_, height_;
    Frame frame_;
    Picture picture_; // over white
    std::vector<Asked> asked_;
};

} // namespace trimray
