// A tracer's frame against the reference for closest hits, pixel by pixel: where they disagree, by how much, and what
// of it a hair decides.
#pragma once

#include "format/closest_reference.h"
#include "runtime/tracer.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace trimray {

enum class Fault {
    FalseMiss,  // the reference has a hit, the tracer none
    FalseHit,   // the other way round
    WrongDepth, // both hit, farther apart than kWrongDepthPx
    WrongFace,  // the same depth, another face or instance
};
inline constexpr const char* kFaultNames[] = {"false miss", "false hit", "wrong depth", "wrong face"};
inline constexpr size_t kFaultCount = 4;
inline constexpr double kWrongDepthPx = 1; // footprints: distance times the angle of a pixel
inline constexpr double kDepthOffPx = 0.1, kNormalOffDeg = 0.1;

struct FaultyPixel {
    uint32_t x = 0, y = 0;
    Fault fault = Fault::FalseMiss;
    Doubt doubt = Doubt::None; // what the reference says of it within 1e-3 pixels
    double hair_px = 0;        // the least of 1e-3, 1e-2, 0.1 and 1 pixels by which moving the ray makes it doubtful
    bool certified = false;    // by the tracer
    double tracer_mm = 0, reference_mm = 0, footprint_mm = 0;
    int32_t tracer_face = -1, reference_face = -1;
    std::array<double, 2> reference_uv_face{};
    double cosine = 0; // of the angle between the ray and the reference's normal
};

struct AgainstReference {
    uint64_t rays = 0, both_hit = 0, agree = 0;      // agree: both hit, in one face, kWrongDepthPx apart at most
    std::array<uint64_t, kFaultCount> faults{};      // of rays that the reference is sure of
    std::array<uint64_t, kFaultCount> doubtful{};    // of rays that a hair decides (of wrong faces: a border)
    uint64_t certified_wrong = 0;                    // of `faults` but for wrong faces: claimed to be right
    uint64_t uncertified = 0, uncertified_right = 0; // pixels; and those of them that agree
    uint64_t not_finite = 0;                         // NaN, or an infinity other than a miss's depth
    uint64_t open = 0;                               // pixels at which the reference gave a search up
    // Of those that agree. Off: by more than kDepthOffPx or kNormalOffDeg, and more than a hair changes.
    uint64_t depths_off = 0;
    std::array<uint64_t, kSurfaceKindCount> agree_by_kind{}, normals_off{}; // by the surface's kind
    double largest_depth_px = 0, sum_depth_px = 0;                          // |dt| in footprints
    double largest_normal_deg = 0, sum_normal_deg = 0;
    std::array<uint32_t, 2> normal_pixel{}; // where the largest is
    std::vector<FaultyPixel> pixels;        // every fault and doubtful one, row by row

    double mean_depth_px() const { return sum_depth_px / double(std::max<uint64_t>(agree, 1)); }
    double mean_normal_deg() const { return sum_normal_deg / double(std::max<uint64_t>(agree, 1)); }
    uint64_t all_normals_off() const { return std::accumulate(normals_off.begin(), normals_off.end(), uint64_t(0)); }

    /// Adds other rays'; their pixels follow.
    void add(const AgainstReference& other)
    {
        const auto each = [](auto& to, const auto& from) {
            for (size_t k = 0; k < to.size(); ++k)
                to[k] += from[k];
        };
        rays += other.rays;
        both_hit += other.both_hit;
        agree += other.agree;
        each(faults, other.faults);
        each(doubtful, other.doubtful);
        certified_wrong += other.certified_wrong;
        uncertified += other.uncertified;
        uncertified_right += other.uncertified_right;
        not_finite += other.not_finite;
        open += other.open;
        depths_off += other.depths_off;
        each(agree_by_kind, other.agree_by_kind);
        each(normals_off, other.normals_off);
        largest_depth_px = std::max(largest_depth_px, other.largest_depth_px);
        sum_depth_px += other.sum_depth_px;
        if (other.largest_normal_deg > largest_normal_deg) {
            largest_normal_deg = other.largest_normal_deg;
            normal_pixel = other.normal_pixel;
        }
        sum_normal_deg += other.sum_normal_deg;
        pixels.insert(pixels.end(), other.pixels.begin(), other.pixels.end());
    }
};

inline AgainstReference compare_with_reference(const Frame& frame, const Camera& camera,
                                               const ClosestReference& closest)
{
    using reference::Vec3;
    using reference::operator+;
    using reference::operator*;
    // Parallel rays are compared with the reference's own. What a hair changes is asked of the pinhole far back, whose
    // rays a hair turns as it would move parallel ones.
    const CameraRays rays = camera_rays(camera, frame.width, frame.height);
    const bool parallel = camera.orthographic_mm > 0;
    const ParallelRays beside = parallel_rays(camera, frame.width, frame.height);
    std::vector<AgainstReference> rows(frame.height);
    tbb::parallel_for(0u, frame.height, [&](uint32_t y) {
        AgainstReference& row = rows[y];
        for (uint32_t x = 0; x < frame.width; ++x) {
            const size_t i = size_t(y) * frame.width + x;
            const reference::Ray turned{rays.eye, rays.corner + rays.step_x * (x + 0.5) + rays.step_y * (y + 0.5)};
            const reference::Ray ray =
                parallel ? reference::Ray{beside.corner + beside.step_x * (x + 0.5) + beside.step_y * (y + 0.5),
                                          beside.direction}
                         : turned;
            const ReferenceHit hit = closest.closest(ray);
            ReferenceHit from_eye = hit;
            from_eye.distance_mm += rays.plane_mm;
            const double speed = reference::length(ray.direction);
            const double pixel = std::max(reference::length(rays.step_x), reference::length(rays.step_y)) / speed;
            ++row.rays;
            row.open += hit.open;
            row.uncertified += !frame.certified[i];
            const bool traced = frame.face[i] >= 0;
            bool finite = !std::isnan(frame.depth_mm[i]) && std::isfinite(frame.depth_mm[i]) == traced;
            for (size_t k = 0; k < 4; ++k)
                finite &= std::isfinite(frame.rgba[4 * i + k]);
            for (size_t k = 0; k < 3; ++k)
                finite &= std::isfinite(frame.normal[3 * i + k]);
            for (size_t k = 0; k < 2; ++k)
                finite &= std::isfinite(frame.uv[2 * i + k]);
            row.not_finite += !finite;

            FaultyPixel fault;
            bool wrong = true;
            const double footprint = pixel * from_eye.distance_mm;
            const double depth_px = std::abs(double(frame.depth_mm[i]) - hit.distance_mm) / footprint;
            if (hit.hit != traced) {
                fault.fault = hit.hit ? Fault::FalseMiss : Fault::FalseHit;
            } else if (!hit.hit) {
                wrong = false;
            } else if (!(depth_px <= kWrongDepthPx)) {
                fault.fault = Fault::WrongDepth;
            } else if (frame.face[i] != int32_t(hit.face) || frame.instance[i] != int32_t(hit.instance)) {
                fault.fault = Fault::WrongFace;
            } else {
                wrong = false;
            }
            row.both_hit += hit.hit && traced;
            if (!wrong) {
                row.uncertified_right += !frame.certified[i];
                if (!hit.hit)
                    continue;
                const Vec3 n{frame.normal[3 * i], frame.normal[3 * i + 1], frame.normal[3 * i + 2]};
                const double deg = reference::angle_deg(n, hit.normal);
                if (depth_px > kDepthOffPx || deg > kNormalOffDeg) {
                    const Hair hair = closest.hair(turned, from_eye, rays.step_x, rays.step_y);
                    const bool of_face = hair.doubt != Doubt::None; // beside a border
                    row.depths_off += !of_face && depth_px > kDepthOffPx && depth_px * footprint > hair.depth_mm;
                    row.normals_off[hit.kind] += !of_face && deg > kNormalOffDeg && deg > hair.turn_deg;
                }
                ++row.agree;
                ++row.agree_by_kind[hit.kind];
                row.sum_depth_px += depth_px;
                row.largest_depth_px = std::max(row.largest_depth_px, depth_px);
                row.sum_normal_deg += deg;
                if (deg > row.largest_normal_deg) {
                    row.largest_normal_deg = deg;
                    row.normal_pixel = {x, y};
                }
                continue;
            }
            fault.x = x;
            fault.y = y;
            fault.hair_px = std::numeric_limits<double>::infinity();
            for (const double reach_px : {1e-3, 1e-2, 0.1, 1.0}) {
                const Doubt doubt = closest.hair(turned, from_eye, rays.step_x, rays.step_y, reach_px).doubt;
                if (reach_px == 1e-3)
                    fault.doubt = doubt;
                if (doubt == Doubt::None || (doubt == Doubt::Face && fault.fault != Fault::WrongFace))
                    continue;
                fault.hair_px = reach_px;
                break;
            }
            fault.certified = frame.certified[i] != 0;
            fault.tracer_mm = frame.depth_mm[i];
            fault.reference_mm = hit.distance_mm;
            fault.footprint_mm = footprint;
            fault.tracer_face = frame.face[i];
            fault.reference_face = hit.hit ? int32_t(hit.face) : -1;
            fault.reference_uv_face = hit.uv_face;
            fault.cosine = std::abs(reference::dot(hit.normal, ray.direction)) / speed;
            const bool of_face = fault.fault == Fault::WrongFace;
            const bool sure = fault.doubt == Doubt::None || (!of_face && fault.doubt == Doubt::Face);
            ++(sure ? row.faults : row.doubtful)[size_t(fault.fault)];
            row.certified_wrong += sure && !of_face && fault.certified;
            row.pixels.push_back(fault);
        }
    });
    AgainstReference all;
    for (const AgainstReference& row : rows)
        all.add(row);
    return all;
}

} // namespace trimray
