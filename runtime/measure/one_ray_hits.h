// One ray against one leaf: its box, the roots, the face's domain and its trims. What runtime/cpu_leaf_hits.h does for
// packets with ClosestPolicy::Stochastic.
#pragma once

#include "runtime/face_uv.h"
#include "runtime/measure/one_ray_scene.h"
#include "runtime/measure/one_ray_trim.h"
#include "runtime/patch_normal.h"
#include "runtime/tracer.h"
#include "shaders/shared/leaf_start.h"
#include "shaders/shared/quadric.h"
#include "shaders/shared/rim.h"
#include "shaders/shared/torus.h"

#include <cmath>

SHARED_OPEN

/// The nearest hit so far.
struct NearestHit {
    float past = kHuge; // tau - tau_ref in mm; kHuge: none
    uint leaf = ~0u;    // of the pack
    uint instance = ~0u;
    real2 uv_face = real2(0, 0);
    real3 normal = real3(0, 0, 1); // S_u x S_v in patch space, right-handed axes, any length
    bool back = false;             // it may be a rim's
};

/// A pixel's ray from the eye, pixels from the picture's centre.
struct Pixel {
    float x, y;
};

/// A pixel's ray as a patch or a tree has it: a point at t is origin + t direction.
struct SeenRay {
    real3 origin;
    real3 direction;
};
FN SeenRay seen_ray(const PatchView& view, Pixel pixel)
{
    const real3 across = real3(view.step_x[0], view.step_x[1], view.step_x[2]) * pixel.x +
                         real3(view.step_y[0], view.step_y[1], view.step_y[2]) * pixel.y;
    return {real3(view.origin[0], view.origin[1], view.origin[2]) + across * view.tau,
            real3(view.w0[0], view.w0[1], view.w0[2]) + across};
}

/// What all rays of a frame share.
struct FrameJob {
    const CpuScene& scene;
    const View& view;
    const OpenedScene& opened;
    std::vector<PatchView> part_views; // of the parts' trees, by instance
    PatchView top_view;                // of the top tree
    FetchSource source;
    float error_px;
    scalar2 start; // start_of_frame
};

class LeafHits {
public:
    LeafHits(const FrameJob& job, SeenPatches& seen, WorkCounts& work)
        : job_(job), seen_(seen), work_(work), image_(job.scene.image), begin_(-float(job.view.depth_ref))
    {
    }

    /// Offers the ray's hits with one leaf.
    void intersect(Pixel pixel, uint leaf_id, uint instance, NearestHit& hit)
    {
        constexpr float kBoxMargin = 1e-6f; // patch units: the ray's rounding
        ++work_.leaf_visits;
        const OpenedLeaf& leaf = job_.opened.leaves[leaf_id];
        const PatchView& view = seen_.of(image_, job_.view, instance, leaf.patch);
        const SeenRay ray = seen_ray(view, pixel);
        const real3 o = ray.origin;
        const BoxHit in_box =
            leaf_box_hit(leaf.box, o, ray.direction, kBoxMargin * (1 + abs(o.x) + abs(o.y) + abs(o.z)));
        if (!in_box.hit || !(view.base_mm + view.mm_per_t * in_box.near < hit.past + view.slack_mm) ||
            !(view.base_mm + view.mm_per_t * in_box.far > begin_))
            return;
        const PatchRecord& patch = image_.patches[leaf.patch];
        const Target target{view, ray, patch, image_.faces[patch.face], leaf_id, instance};
        if ((patch.shape & 0xffu) == kKindBezier)
            intersect_bezier(target, leaf, hit);
        else
            intersect_native(target, hit);
    }

    bool rims_cut = false; // rims are no surface

private:
    struct Target {
        const PatchView& view;
        const SeenRay& ray;
        const PatchRecord& patch;
        const FaceRecord& face;
        uint leaf, instance;
    };

    /// In front of the eye and not behind the nearest hit.
    bool in_range(const Target& target, real t, const NearestHit& hit) const
    {
        const real past = target.view.base_mm + target.view.mm_per_t * t;
        return past > begin_ && past < hit.past + target.view.slack_mm && t < kHuge;
    }

    void intersect_bezier(const Target& target, const OpenedLeaf& leaf, NearestHit& hit)
    {
        const PatchRecord& patch = target.patch;
        const SeenRay& ray = target.ray;
        const RayPlanes planes = ray_planes(ray.origin, ray.direction);
        const float footprint = target.view.pixel * std::abs(target.view.tau);
        const PlainEnd end = leaf.search(job_.source, patch, leaf.box, planes, last_residual(job_.error_px * footprint),
                                         leaf_start(job_.start, leaf.box.uv_lo, leaf.box.uv_hi), work_.newton_steps);
        if (!end.settled)
            return;
        const real2 overlap = patch_overlap(root_blur(seen_point(end.s, planes), leaf.rounding), leaf.slack);
        if (!(abs(end.uv.x - 0.5f) <= 0.5f + overlap.x && abs(end.uv.y - 0.5f) <= 0.5f + overlap.y))
            return;
        const real t = dot(end.s.p - ray.origin, ray.direction) / dot(ray.direction, ray.direction);
        if (!in_range(target, t, hit))
            return;
        const auto evaluate = [&](real2 uv) {
            return bezier_point(job_.source, patch.first_control_point, int(patch.shape >> 8 & 0xffu),
                                int(patch.shape >> 16 & 0xffu), (patch.shape & kShapeRational) != 0, uv);
        };
        offer(
            target, t, end.uv, [&] { return bezier_normal(evaluate, end.s, end.uv, true); }, hit);
    }

    __attribute__((noinline)) void intersect_native(const Target& target, NearestHit& hit)
    {
        const real3 o = target.ray.origin, d = target.ray.direction;
        const scalar r = target.patch.param[0], second = target.patch.param[1];
        switch (target.patch.shape & 0xffu) {
        case kKindPlane:
            return offer_pair(
                target, plane_roots(o, d), [](real3 p) { return plane_uv(p); }, [](real3) { return plane_normal(); },
                hit);
        case kKindCylinder:
            return offer_pair(
                target, cylinder_roots(r, o, d), [](real3 p) { return cylinder_uv(p); },
                [](real3 p) { return cylinder_normal(p); }, hit);
        case kKindCone:
            return offer_pair(
                target, cone_roots(r, second, o, d), [=](real3 p) { return cone_uv(r, second, p); },
                [=](real3 p) { return cone_normal(r, second, p); }, hit);
        case kKindSphere:
            return offer_pair(
                target, sphere_roots(r, o, d), [](real3 p) { return sphere_uv(p); },
                [](real3 p) { return sphere_normal(p); }, hit);
        default: { // torus
            const TorusRoots roots = torus_roots(r, second, o, d);
            for (const real t : {roots.t0, roots.t1, roots.t2, roots.t3})
                offer_root(
                    target, t, [=](real3 p) { return torus_uv(r, second, p); },
                    [=](real3 p) { return torus_normal(r, second, p); }, hit);
        }
        }
    }

    template <class Uv, class Normal>
    void offer_pair(const Target& target, RootPair roots, Uv uv, Normal normal, NearestHit& hit)
    {
        offer_root(target, roots.t0, uv, normal, hit);
        offer_root(target, roots.t1, uv, normal, hit);
    }

    /// uv and normal: of a point of the surface.
    template <class Uv, class Normal>
    void offer_root(const Target& target, real t, Uv uv, Normal normal, NearestHit& hit)
    {
        if (!in_range(target, t, hit))
            return;
        const real3 p = target.ray.origin + target.ray.direction * t;
        offer(
            target, t, uv(p), [&] { return normal(p); }, hit);
    }

    /// Takes a root that lies in the face's domain and inside its trims.
    template <class Normal>
    void offer(const Target& target, real t, real2 uv_patch, Normal normal, NearestHit& hit)
    {
        real2 uv = face_uv(target.patch, uv_patch);
        if ((target.patch.shape & 0xffu) == kKindTorus)
            uv = unwrapped(target.patch, uv);
        if (!in_slack_domain(uv))
            return;
        uv = clamp_to_domain(uv);
        // of two hits within rounding the one of the lower instance and leaf stays, whatever the order
        const real past = target.view.base_mm + target.view.mm_per_t * t, slack = target.view.slack_mm;
        const bool first =
            target.instance < hit.instance || (target.instance == hit.instance && target.leaf < hit.leaf);
        if (!(past < hit.past + (first ? slack : -slack)) || !inside_loops(target, uv))
            return;
        const real3 n = normal();
        const bool rim = (target.face.flags & kFaceRims) != 0 && job_.view.instances[target.instance].outside;
        const bool back = rim && meets_back(target, n);
        if (back && rims_cut && in_rim(target, uv))
            return;
        hit = {past, target.leaf, target.instance, uv, n, back};
    }

    bool inside_loops(const Target& target, real2 uv)
    {
        return (target.face.flags & kFaceNaturalBorder) != 0 ||
               inside_kd(job_.source, job_.source.kd->faces[target.patch.face], uv, work_.curve_tests);
    }

    bool meets_back(const Target& target, real3 normal) const
    {
        return dot(target.ray.direction, normal) * outward_turn(job_.scene, job_.opened.leaves[target.leaf].patch) > 0;
    }

    /// Of a hit inside of the face.
    bool in_rim(const Target& target, real2 uv)
    {
        for (int corner = 0; corner < kCornerCount; ++corner) {
            const real2 q = corner_around(uv, rim_width(target.face.flags), corner);
            if (!in_domain(q) || !inside_loops(target, clamp_to_domain(q)))
                return true;
        }
        return false;
    }

    const FrameJob& job_;
    SeenPatches& seen_;
    WorkCounts& work_;
    const PackImage& image_;
    const float begin_; // rays hit nothing up to there, as NearestHit::past
};

SHARED_CLOSE
