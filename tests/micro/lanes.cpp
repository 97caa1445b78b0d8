// Compiled once for each target by foreach_target.h, as runtime/cpu_lanes.cpp is.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/micro/lanes.cpp"
#include <hwy/foreach_target.h>

#include "runtime/cpu_leaf_roots.h"
#include "runtime/plain_newton.h"
#include "tests/micro/lanes.h"

HWY_BEFORE_NAMESPACE();
namespace trimray {
namespace HWY_NAMESPACE {

using micro::LanePatch;
using micro::PacketUv;
using micro::Solved;

FN float sum_of_lanes(real a)
{
    alignas(64) float lanes[kLanes];
    store(a, lanes);
    float sum = 0;
    for (const float lane : lanes)
        sum += lane;
    return sum;
}

FN real3 load3(const float (&at)[3][kLanes])
{
    return real3(load(at[0]), load(at[1]), load(at[2]));
}

FN NewtonPatch newton_patch(const FetchSource& source, const PatchRecord& patch)
{
    const int degree_u = int(patch.shape >> 8 & 0xffu), degree_v = int(patch.shape >> 16 & 0xffu);
    return {source,
            patch.first_control_point,
            degree_u,
            degree_v,
            find_evaluate(patch.shape),
            kLeastLastResidual,
            patch_rounding(degree_u, degree_v),
            patch_slack(scalar2(patch.uv_scale[0], patch.uv_scale[1])),
            (patch.shape & kShapeRational) != 0};
}

HWY_ATTR void write_points(const LanePatch& at, std::span<const PacketUv> packets,
                           std::span<micro::PacketPoints> points)
{
    const FetchSource source = fetch_source(at.image, nullptr);
    const NewtonPatch newton = newton_patch(source, at.image.patches[at.patch]);
    for (size_t i = 0; i < packets.size(); ++i) {
        const SurfacePoint s = newton.at(real2(load(packets[i].u), load(packets[i].v)));
        store(s.p.x, points[i].p[0]);
        store(s.p.y, points[i].p[1]);
        store(s.p.z, points[i].p[2]);
    }
}

HWY_ATTR float points_of_packets(const LanePatch& at, std::span<const PacketUv> packets)
{
    const FetchSource source = fetch_source(at.image, nullptr);
    const NewtonPatch newton = newton_patch(source, at.image.patches[at.patch]);
    real sum(0.0f);
    for (const PacketUv& packet : packets) {
        const SurfacePoint s = newton.at(real2(load(packet.u), load(packet.v)));
        sum = sum + dot(s.p, s.du) + s.dv.x;
    }
    return sum_of_lanes(sum);
}

HWY_ATTR float steps_of_packets(const LanePatch& at, std::span<const micro::PacketRays> rays)
{
    const FetchSource source = fetch_source(at.image, nullptr);
    const real2 middle(real(0.5f), real(0.5f));
    const SurfacePoint s = newton_patch(source, at.image.patches[at.patch]).at(middle);
    real sum(0.0f);
    for (const micro::PacketRays& packet : rays) {
        const RayPlanes planes = ray_planes(load3(packet.origin), load3(packet.direction));
        const NewtonStep next = newton_step(seen_point(s, planes), middle);
        sum = sum + next.uv.x + next.uv.y + next.residual;
    }
    return sum_of_lanes(sum);
}

HWY_ATTR Solved solve_plain(const LanePatch& at, uint32_t leaf, std::span<const micro::PacketRays> rays)
{
    const FetchSource source = fetch_source(at.image, nullptr);
    const NewtonPatch newton = newton_patch(source, at.image.patches[at.patch]);
    const LeafBox box = decode_leaf(at.image.leaves[leaf]);
    Solved solved;
    for (const micro::PacketRays& packet : rays) {
        const RayPlanes planes = ray_planes(load3(packet.origin), load3(packet.direction));
        const PlainEnd end = plain_newton([&](real2 uv) HWY_ATTR { return newton.at(uv); },
                                          [&](mask lanes) HWY_ATTR { solved.steps += lane_count(lanes); }, planes, box,
                                          newton.enough, real2(leaf_middle(box)), mask(true));
        solved.found += lane_count(end.settled);
    }
    return solved;
}

HWY_ATTR Solved solve_proved(const LanePatch& at, uint32_t leaf_id, std::span<const micro::PacketRays> rays)
{
    const FetchSource source = fetch_source(at.image, nullptr);
    const PatchRecord& patch = at.image.patches[at.patch];
    const NewtonPatch newton = newton_patch(source, patch);
    const LeafBox box = decode_leaf(at.image.leaves[leaf_id]);
    const SurfacePoint s = newton.at(real2(leaf_middle(box)));
    const LeafPlane leaf =
        leaf_plane(box, first_lane(s.p), first_lane(s.du), first_lane(s.dv),
                   derivative_loss(box, scalar2(patch.param[0], patch.param[1]), newton.degree_u, newton.degree_v));
    const SurfacePoint middle{real3(leaf.p), real3(leaf.du), real3(leaf.dv)};
    const scalar2 per_side(1.0f / leaf.half_side.x, 1.0f / leaf.half_side.y);
    Solved solved;
    for (const micro::PacketRays& packet : rays) {
        const RayPlanes planes = ray_planes(load3(packet.origin), load3(packet.direction));
        const SeenPoint seen = seen_point(middle, planes);
        const RayBend bend = middle_bend(leaf, seen);
        const Rectangle whole{leaf.middle, leaf.half_side, per_side, real(1.0f), bend, mask(false)};
        const Search search = find_root(newton, leaf, whole, planes, middle, seen, mask(true), solved.steps);
        solved.found += lane_count(search.settled);
    }
    return solved;
}

} // namespace HWY_NAMESPACE
} // namespace trimray
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace trimray {

HWY_EXPORT(write_points);
HWY_EXPORT(points_of_packets);
HWY_EXPORT(steps_of_packets);
HWY_EXPORT(solve_plain);
HWY_EXPORT(solve_proved);

namespace micro {

const char* lanes_name()
{
    const int64_t supported = hwy::SupportedTargets() & HWY_TARGETS;
    return hwy::TargetName(supported & -supported); // the lowest bit is the best
}

void surface_points(const LanePatch& patch, std::span<const PacketUv> at, std::span<PacketPoints> points)
{
    HWY_DYNAMIC_DISPATCH(write_points)(patch, at, points);
}

float evaluate_points(const LanePatch& patch, std::span<const PacketUv> at)
{
    return HWY_DYNAMIC_DISPATCH(points_of_packets)(patch, at);
}

float newton_steps(const LanePatch& patch, std::span<const PacketRays> rays)
{
    return HWY_DYNAMIC_DISPATCH(steps_of_packets)(patch, rays);
}

Solved newton_plain(const LanePatch& patch, uint32_t leaf, std::span<const PacketRays> rays)
{
    return HWY_DYNAMIC_DISPATCH(solve_plain)(patch, leaf, rays);
}

Solved newton_proved(const LanePatch& patch, uint32_t leaf, std::span<const PacketRays> rays)
{
    return HWY_DYNAMIC_DISPATCH(solve_proved)(patch, leaf, rays);
}

} // namespace micro
} // namespace trimray

#endif
