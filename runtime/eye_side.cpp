#include "runtime/eye_side.h"

#include "runtime/trace_one.h"

namespace trimray {
namespace {

bool in_box(const CpuScene::PartBox& box, const double eye[3])
{
    for (int c = 0; c < 3; ++c)
        if (!(eye[c] >= box.lo[c] && eye[c] <= box.hi[c]))
            return false;
    return true;
}

bool most_rays_meet_fronts(const CpuScene& scene, const PlacementView& placed, uint32_t instance,
                           const std::array<double, 3>& eye_mm)
{
    // no two opposite, none along an axis, a diagonal or in a coordinate plane, where models have their faces
    constexpr std::array<std::array<double, 3>, 9> kDirections{{{0.93, 0.31, 0.17},
                                                                {-0.83, 0.47, -0.29},
                                                                {0.23, -0.89, 0.37},
                                                                {-0.41, -0.73, -0.53},
                                                                {0.13, 0.29, -0.95},
                                                                {-0.19, 0.37, 0.91},
                                                                {0.61, -0.43, -0.67},
                                                                {-0.59, -0.31, 0.79},
                                                                {0.37, 0.87, 0.43}}};
    size_t backs = 0;
    for (const std::array<double, 3>& direction : kDirections) {
        const RayHit hit = trace_one(scene, placed, eye_mm, direction, instance);
        backs +=
            hit.hit && direction[0] * hit.normal[0] + direction[1] * hit.normal[1] + direction[2] * hit.normal[2] > 0;
    }
    return 2 * backs < kDirections.size();
}

} // namespace

std::vector<uint8_t> seen_from_outside(const CpuScene& scene, const PlacementView& placed,
                                       const std::array<double, 3>& eye_mm)
{
    const View view = make_single_ray_view(placed, eye_mm, {0, 0, 1});
    std::vector<uint8_t> outside(placed.instances.size());
    for (uint32_t i = 0; i < outside.size(); ++i) {
        const CpuScene::PartBox& box = scene.part_boxes[placed.instances[i].part];
        outside[i] = placed.shows(i) && box.has_rims &&
                     (!in_box(box, view.instances[i].eye) || most_rays_meet_fronts(scene, placed, i, eye_mm));
    }
    return outside;
}

} // namespace trimray
