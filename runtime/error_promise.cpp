#include "runtime/error_promise.h"

#include "runtime/reference_rays.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tbb/parallel_for.h>

namespace trimray {
namespace {

/// A place of the picture, and what the reference shows there.
struct Shown {
    double x = 0, y = 0;
    bool hit = false;
    double distance_mm = std::numeric_limits<double>::infinity();
    int64_t face = -1, instance = -1;
};

/// What a pixel claims.
struct Claim {
    bool hit = false;
    double distance_mm = 0, slack_mm = 0;
    int64_t face = -1, instance = -1;

    bool meets(const Shown& shown) const
    {
        return shown.hit == hit && (!hit || std::abs(shown.distance_mm - distance_mm) <= slack_mm);
    }
    bool is_of_face(const Shown& shown) const
    {
        return hit && shown.hit && shown.face == face && shown.instance == instance;
    }
};

/// The reference around one pixel's middle.
class Surroundings {
public:
    Surroundings(const ClosestReference& closest, const ReferenceRays& rays, uint32_t x, uint32_t y)
        : closest_(closest), rays_(rays), x_(x + 0.5), y_(y + 0.5)
    {
    }

    /// Whether `claim` is met within reach_px, by `directions` rays around the middle at each of `rings` distances,
    /// each half of the next: what a ray grazes is often seen a hair beside it alone.
    bool show(const Claim& claim, double reach_px, int directions, int rings) const
    {
        const Shown middle = at(x_, y_);
        if (claim.meets(middle))
            return true;
        std::vector<Shown> inner(size_t(directions), middle);
        for (int ring = 1; ring <= rings; ++ring) {
            std::vector<Shown> outer;
            const double away = std::ldexp(reach_px, ring - rings);
            for (int i = 0; i < directions; ++i) {
                const double angle = 2 * std::numbers::pi * i / directions;
                outer.push_back(at(x_ + away * std::cos(angle), y_ + away * std::sin(angle)));
                if (claim.meets(outer.back()))
                    return true;
            }
            for (size_t i = 0; i < outer.size(); ++i)
                if (met_between(claim, inner[i], outer[i]) ||
                    met_between(claim, outer[i], outer[(i + 1) % outer.size()]))
                    return true;
            inner = std::move(outer);
        }
        return false;
    }

private:
    Shown at(double x, double y) const
    {
        const ReferenceHit hit = closest_.closest(rays_.through(x, y));
        if (!hit.hit)
            return {.x = x, .y = y};
        return {x, y, true, hit.distance_mm, int64_t(hit.face), int64_t(hit.instance)};
    }

    /// Whether a place on the line between two meets the claim. Where both hit its face, before it and behind it, one
    /// does, unless the face has a jump there or something hides it; where one alone hits it, its rim is between them,
    /// and depths beside a rim change faster than any ring of places sees.
    bool met_between(const Claim& claim, Shown a, Shown b) const
    {
        constexpr int kHalvings = 40;
        if (!claim.is_of_face(a) && !claim.is_of_face(b))
            return false;
        const bool to_rim = !claim.is_of_face(a) || !claim.is_of_face(b);
        // of the halves the one that keeps its ends unlike: one of the face and one not, or one before the claim
        const auto side = [&](const Shown& shown) {
            return to_rim ? claim.is_of_face(shown) : shown.distance_mm < claim.distance_mm;
        };
        if (side(a) == side(b))
            return false;
        for (int i = 0; i < kHalvings; ++i) {
            const Shown middle = at(0.5 * (a.x + b.x), 0.5 * (a.y + b.y));
            if (claim.meets(middle))
                return true;
            if (!to_rim && !claim.is_of_face(middle))
                return false;
            (side(middle) == side(a) ? a : b) = middle;
        }
        return false;
    }

    const ClosestReference& closest_;
    const ReferenceRays& rays_;
    double x_, y_;
};

constexpr int kDirections = 8, kRings = 2;
constexpr int kManyDirections = 64, kManyRings = 13; // before a pixel is called broken: to 1/4096 of the reach

} // namespace

const BrokenPixel* PromiseKept::worst() const
{
    const auto most = std::max_element(broken.begin(), broken.end(), [](const BrokenPixel& a, const BrokenPixel& b) {
        return a.shown_within_px < b.shown_within_px;
    });
    return most == broken.end() ? nullptr : &*most;
}

PromiseKept hold_to_promise(const Frame& traced, const Frame& right, const Camera& camera,
                            const ClosestReference& closest, double error_px)
{
    const ReferenceRays rays(camera, traced.width, traced.height);
    std::vector<PromiseKept> rows(traced.height);
    tbb::parallel_for(0u, traced.height, [&](uint32_t y) {
        PromiseKept& row = rows[y];
        for (uint32_t x = 0; x < traced.width; ++x) {
            const size_t i = size_t{y} * traced.width + x;
            ++row.pixels;
            // by the face: a depth that is no number meets nothing
            Claim claim{traced.face[i] >= 0, double(traced.depth_mm[i]), 0, traced.face[i], traced.instance[i]};
            const double nearest = double(std::min(traced.depth_mm[i], right.depth_mm[i]));
            const double footprint = std::isfinite(nearest) ? rays.footprint_mm(x + 0.5, y + 0.5, nearest) : 0;
            claim.slack_mm = error_px * footprint;
            const bool right_hits = std::isfinite(right.depth_mm[i]);
            row.hits += right_hits;
            if (claim.meets({.hit = right_hits, .distance_mm = double(right.depth_mm[i])})) {
                ++row.at_centre;
                continue;
            }
            const Surroundings around(closest, rays, x, y);
            if (around.show(claim, error_px, kDirections, kRings) ||
                around.show(claim, error_px, kManyDirections, kManyRings)) {
                ++row.within;
                continue;
            }
            BrokenPixel& broken = row.broken.emplace_back(
                BrokenPixel{x, y, double(traced.depth_mm[i]), double(right.depth_mm[i]), footprint, traced.face[i],
                            right.face[i], traced.certified[i] != 0, right.certified[i] != 0});
            for (double reach = 2 * error_px; reach <= kFarthestPx; reach *= 2)
                if (around.show(claim, reach, kManyDirections, kManyRings)) {
                    broken.shown_within_px = reach;
                    break;
                }
        }
    });
    PromiseKept all;
    for (const PromiseKept& row : rows) {
        all.pixels += row.pixels;
        all.hits += row.hits;
        all.at_centre += row.at_centre;
        all.within += row.within;
        all.broken.insert(all.broken.end(), row.broken.begin(), row.broken.end());
    }
    return all;
}

} // namespace trimray
