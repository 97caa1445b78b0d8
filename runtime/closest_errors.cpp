#include "runtime/closest_errors.h"

#include "runtime/psnr.h"

#include <algorithm>
#include <cmath>
#include <tbb/parallel_for.h>
#include <utility>

namespace trimray {
namespace {

constexpr double kHairPx = 1e-3;

} // namespace

Result<ReferencePicture> ReferencePicture::make(std::shared_ptr<const Scene> scene, const RenderOptions& options)
{
    RenderOptions traced = options;
    traced.closest = ClosestPolicy::Certified;
    traced.trim = TrimMode::Exact;
    traced.threads = 0;
    traced.frames = 1;
    RenderStats stats;
    Result<Frame> frame = make_reference_tracer(scene)->render(traced, stats);
    if (!frame.ok())
        return frame.error();
    return ReferencePicture(std::move(scene), options, std::move(*frame));
}

ReferencePicture::ReferencePicture(std::shared_ptr<const Scene> scene, const RenderOptions& options, Frame frame)
    : scene_(std::move(scene)), closest_(scene_->pack.image),
      steps_(camera_rays(options.camera, options.width, options.height)),
      rays_(options.camera, options.width, options.height), width_(options.width), height_(options.height),
      frame_(std::move(frame)), picture_(over_white(frame_)), asked_(frame_.depth_mm.size(), Asked::No)
{
}

double ReferencePicture::footprint_mm(size_t i) const
{
    const auto x = uint32_t(i % width_), y = uint32_t(i / width_);
    return rays_.footprint_mm(x + 0.5, y + 0.5, double(frame_.depth_mm[i]));
}

bool ReferencePicture::is_tangent(uint32_t x, uint32_t y)
{
    Asked& asked = asked_[size_t{y} * width_ + x];
    if (asked == Asked::No) {
        const reference::Ray ray = rays_.through(x + 0.5, y + 0.5);
        const Doubt doubt = closest_.hair(ray, closest_.closest(ray), steps_.step_x, steps_.step_y, kHairPx).doubt;
        asked = doubt == Doubt::Tangent ? Asked::Tangent : Asked::Sure;
    }
    return asked == Asked::Tangent;
}

bool ReferencePicture::is_tie(size_t i, const Frame& frame) const
{
    if (frame.face[i] == frame_.face[i] && frame.instance[i] == frame_.instance[i])
        return false;
    const PackImage& image = scene_->pack.image;
    if (size_t(frame.instance[i]) >= image.instances.size() || size_t(frame.face[i]) >= image.faces.size())
        return false; // a picture of something else than the pack
    const reference::Ray ray = rays_.through(double(i % width_) + 0.5, double(i / width_) + 0.5);
    const ReferenceHit other = closest_.closest_of(ray, uint(frame.instance[i]), uint(frame.face[i]));
    return other.hit && std::abs(other.distance_mm - double(frame_.depth_mm[i])) <= kHairPx * footprint_mm(i);
}

Picture ReferencePicture::without_ties(Picture picture, const std::vector<size_t>& ties) const
{
    for (const size_t i : ties)
        std::copy_n(&picture_.rgba[4 * i], 4, &picture.rgba[4 * i]);
    return picture;
}

ClosestErrors ReferencePicture::errors(const Frame& frame)
{
    std::vector<ClosestErrors> rows(height_);
    tbb::parallel_for(0u, height_, [&](uint32_t y) {
        ClosestErrors& row = rows[y];
        for (uint32_t x = 0; x < width_; ++x) {
            const size_t i = size_t{y} * width_ + x;
            const double right = double(frame_.depth_mm[i]), traced = double(frame.depth_mm[i]);
            const bool hits = std::isfinite(right), traced_hits = std::isfinite(traced);
            const bool apart = hits && traced_hits && std::abs(traced - right) > kWrongDepth * footprint_mm(i);
            if (hits == traced_hits && !apart) {
                if (hits && is_tie(i, frame))
                    row.ties.push_back(i);
                continue;
            }
            if (is_tangent(x, y))
                ++row.tangent;
            else
                ++(apart ? row.wrong_depth : hits ? row.missing : row.extra);
        }
    });
    ClosestErrors sum;
    for (const ClosestErrors& row : rows) {
        sum.missing += row.missing;
        sum.extra += row.extra;
        sum.wrong_depth += row.wrong_depth;
        sum.tangent += row.tangent;
        sum.ties.insert(sum.ties.end(), row.ties.begin(), row.ties.end());
    }
    sum.pixels = uint64_t{width_} * height_;
    sum.psnr_db = psnr_db(without_ties(over_white(frame), sum.ties), picture_);
    return sum;
}

} // namespace trimray
