// What a map draws on the surfaces that a packet's rays hit. Included once per target by cpu_write.h; nothing here runs
// unless a picture asks for a map.
#if defined(TRIMRAY_CPU_MAPS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_MAPS_H
#undef TRIMRAY_CPU_MAPS_H
#else
#define TRIMRAY_CPU_MAPS_H
#endif

#include "format/pack_layout.h"
#include "runtime/cpu_fetch.h"
#include "runtime/cpu_lanes.h"
#include "runtime/cpu_native.h"
#include "runtime/patch_normal.h"
#include "shaders/shared/bezier_derivatives.h"
#include "shaders/shared/curvature.h"
#include "shaders/shared/derivatives.h"
#include "shaders/shared/language.h"
#include "shaders/shared/pixel_map.h"
#include "shaders/shared/surface_map.h"
#include "shaders/shared/torus.h"

SHARED_OPEN

/// Hits of a packet's rays.
struct MapHits {
    real x; // pixels from the picture's centre
    real y;
    real past; // tau - tau_ref, mm
    integer leaf;
    integer instance;
    real2 uv_face;
    real3 normal; // unit, world, outward
    real3 to_eye; // unit, world
};

/// A leaf's hits in its patch's space.
struct PatchHits {
    real2 uv_patch; // in [0,1]^2, of Bezier patches
    real3 p;
    PixelRows rows;
};

HWY_INLINE scalar3 scalar3_of(const float (&v)[3])
{
    return scalar3(v[0], v[1], v[2]);
}
HWY_INLINE scalar3 scalar3_of(const double (&v)[3])
{
    return scalar3(float(v[0]), float(v[1]), float(v[2]));
}

FN PatchHits patch_hits(const MapHits& hits, const PatchRecord& patch, const PatchView& view)
{
    const scalar3 step_x = scalar3_of(view.step_x), step_y = scalar3_of(view.step_y);
    const real3 across = hits.x * step_x + hits.y * step_y;
    const real3 along = scalar3_of(view.w0) + across;
    const real t = (hits.past - view.base_mm) * (1 / view.mm_per_t);
    PatchHits at;
    at.p = scalar3_of(view.origin) + across * real(view.tau) + along * t;
    at.rows = pixel_rows(along, step_x, step_y, t + view.tau);
    const real u = (hits.uv_face.x - patch.uv_offset[0]) * (1 / patch.uv_scale[0]);
    const real v = (hits.uv_face.y - patch.uv_offset[1]) * (1 / patch.uv_scale[1]);
    at.uv_patch = real2(clamp(u, real(0.0f), real(1.0f)), clamp(v, real(0.0f), real(1.0f)));
    return at;
}

/// Of a Bezier patch, for the lanes `here`; near poles those a little way inside.
[[maybe_unused]] static HWY_ATTR HWY_NOINLINE Derivatives map_derivatives(const FetchSource& source,
                                                                          const PatchRecord& patch, real2 uv, mask here)
{
    const auto at = [&](real2 where) HWY_ATTR {
        return bezier_derivatives(source, patch.first_control_point, int(patch.shape >> 8 & 0xffu),
                                  int(patch.shape >> 16 & 0xffu), (patch.shape & kShapeRational) != 0, where);
    };
    Derivatives s = at(uv);
    const real thin = thinness(s);
    if (!any_lane(here && thin < kThin))
        return s;
    const Derivatives inside = at(from_pole(uv));
    const mask pole = thin < kThin && is_pole(thin, inside);
    s.u = select(pole, inside.u, s.u);
    s.v = select(pole, inside.v, s.v);
    s.uu = select(pole, inside.uu, s.uu);
    s.uv = select(pole, inside.uv, s.uv);
    s.vv = select(pole, inside.vv, s.vv);
    return s;
}

FN Curvatures native_curvatures(const PatchRecord& patch, real3 p)
{
    const scalar r = patch.param[0], second = patch.param[1];
    switch (patch.shape & 0xffu) {
    case kKindCylinder:
        return cylinder_curvatures(r);
    case kKindCone:
        return cone_curvatures(r, second, p);
    case kKindSphere:
        return sphere_curvatures(r);
    case kKindTorus:
        return torus_curvatures(r, second, p);
    default:
        return curvatures_of(real(0.0f), real(0.0f));
    }
}

FN PixelSteps to_world(const float (&m)[3][3], PixelSteps v)
{
    return {to_world(m, v.x), to_world(m, v.y)};
}

/// Of the outward unit normal of one leaf's hits, in the world.
[[maybe_unused]] static HWY_ATTR HWY_NOINLINE PixelSteps world_normal_steps(const PatchRecord& patch,
                                                                            const InstanceView& instance, Derivatives s,
                                                                            PixelRows rows, real3 normal)
{
    const scalar3 x = scalar3_of(patch.axis_x), y = scalar3_of(patch.axis_y), z = scalar3_of(patch.axis_z);
    const real3 across = to_world(instance.normal, combine(x, y, z, cross(s.u, s.v)));
    const PixelSteps in_patch = normal_steps(s, rows);
    const PixelSteps steps = to_world(instance.normal, {combine(x, y, z, in_patch.x), combine(x, y, z, in_patch.y)});
    const real per_length = 1.0f / max(length(across), real(1e-30f));
    return unit_steps(normal, steps, select(dot(across, normal) < 0.0f, -per_length, per_length));
}

/// What the job's map draws at the hits in `hit_lanes`: one leaf at a time, in all the lanes that hit it.
[[maybe_unused]] static HWY_ATTR HWY_NOINLINE MapColor map_hits(const BlockJob& job, const MapHits& hits,
                                                                uint hit_lanes)
{
    const PackImage& image = job.scene.image;
    const FetchSource source = fetch_source(image, nullptr);
    const uint map = job.map->map;
    const real none = real(0.0f);
    alignas(64) uint leaves[kLanes], instances[kLanes];
    store(hits.leaf, leaves);
    store(hits.instance, instances);
    MapPoint point;
    point.normal = hits.normal;
    point.to_eye = hits.to_eye;
    point.normal_steps = {real3(none, none, none), real3(none, none, none)};
    point.curvatures = curvatures_of(none, none);
    for (uint left = hit_lanes; left != 0;) {
        const int lane = __builtin_ctz(left);
        const uint leaf_id = leaves[lane], instance_id = instances[lane];
        const mask here = hits.leaf == integer(leaf_id) && hits.instance == integer(instance_id);
        left &= ~lane_bits(here);
        const uint patch_id = image.leaves[leaf_id].patch;
        const PatchRecord& patch = image.patches[patch_id];
        const InstanceView& instance = job.view.instances[instance_id];
        const PatchView view = make_patch_view(patch, instance, job.view.tau_ref);
        const PatchHits at = patch_hits(hits, patch, view);
        const bool is_bezier = (patch.shape & 0xffu) == kKindBezier;
        if (is_curvature_map(map)) {
            const Curvatures k = is_bezier
                                     ? curvatures_of_derivatives(map_derivatives(source, patch, at.uv_patch, here))
                                     : native_curvatures(patch, at.p);
            const float per_mm = outward_turn(job.scene, patch_id) / view.mm_per_t;
            const Curvatures outward = turned_curvatures(k, real(per_mm));
            point.curvatures.larger = select(here, outward.larger, point.curvatures.larger);
            point.curvatures.smaller = select(here, outward.smaller, point.curvatures.smaller);
        } else {
            const Derivatives s =
                is_bezier ? map_derivatives(source, patch, at.uv_patch, here) : native_derivatives(patch, at.p);
            const PixelSteps steps = world_normal_steps(patch, instance, s, at.rows, hits.normal);
            point.normal_steps.x = select(here, steps.x, point.normal_steps.x);
            point.normal_steps.y = select(here, steps.y, point.normal_steps.y);
        }
    }
    const scalar3 step_x = scalar3_of(job.view.step_x), step_y = scalar3_of(job.view.step_y);
    const real3 along = scalar3_of(job.view.w0) + hits.x * step_x + hits.y * step_y;
    point.to_eye_steps = unit_steps(hits.to_eye, {real3(step_x), real3(step_y)}, -1.0f / length(along));
    return map_color(map, job.map->view, point);
}

SHARED_CLOSE
#endif
