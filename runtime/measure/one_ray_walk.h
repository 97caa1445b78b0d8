// One ray through the top tree and the parts' trees, nearest child first.
#pragma once

#include "runtime/measure/one_ray_hits.h"
#include "shaders/shared/leaf_box.h"

SHARED_OPEN

/// A ray for one tree; t as in SeenRay.
struct TreeRay {
    real3 origin;
    real3 inverse;
    float base_mm, mm_per_t, t_per_mm, slack_mm; // `past` of t = base_mm + mm_per_t t
    float t_begin;                               // of the eye, or before it
};
FN TreeRay tree_ray(const PatchView& view, Pixel pixel, float begin_mm)
{
    const SeenRay ray = seen_ray(view, pixel);
    const real3 d = ray.direction;
    const float t_per_mm = 1 / view.mm_per_t;
    return {ray.origin,
            real3(safe_inverse(d.x), safe_inverse(d.y), safe_inverse(d.z)),
            view.base_mm,
            view.mm_per_t,
            t_per_mm,
            view.slack_mm,
            (begin_mm - view.slack_mm - view.base_mm) * t_per_mm};
}

/// Where the ray enters and leaves the children's boxes; near > far: it passes by.
struct NodeHits {
    float near[4], far[4];
};
FN NodeHits node_hits(const OpenedNode& node, const TreeRay& ray, float t_end)
{
    const auto& x0 = ray.inverse.x < 0 ? node.hi[0] : node.lo[0];
    const auto& x1 = ray.inverse.x < 0 ? node.lo[0] : node.hi[0];
    const auto& y0 = ray.inverse.y < 0 ? node.hi[1] : node.lo[1];
    const auto& y1 = ray.inverse.y < 0 ? node.lo[1] : node.hi[1];
    const auto& z0 = ray.inverse.z < 0 ? node.hi[2] : node.lo[2];
    const auto& z1 = ray.inverse.z < 0 ? node.lo[2] : node.hi[2];
    NodeHits hits;
    for (int k = 0; k < 4; ++k) {
        hits.near[k] = max(max((x0[k] - ray.origin.x) * ray.inverse.x, (y0[k] - ray.origin.y) * ray.inverse.y),
                           max((z0[k] - ray.origin.z) * ray.inverse.z, ray.t_begin));
        const float far = min(min((x1[k] - ray.origin.x) * ray.inverse.x, (y1[k] - ray.origin.y) * ray.inverse.y),
                              min((z1[k] - ray.origin.z) * ray.inverse.z, t_end));
        // the products above round (Ize 2013, Robust BVH ray traversal)
        hits.far[k] = far + abs(far) * (8.0f * kRounding);
    }
    return hits;
}

/// Calls on_leaf(index) for the leaves whose boxes in the tree the ray meets before the nearest hit, nearest first.
template <class OnLeaf>
FN void walk(const OpenedNode* nodes, const TreeRay& ray, const NearestHit& hit, uint64_t& node_visits, OnLeaf on_leaf)
{
    constexpr size_t kMostWaiting = 3 * kMaxBvhDepth + 1;
    // two arrays: what is stored as two numbers and read as one makes the processor wait
    float past[kMostWaiting]; // where its box begins
    uint item[kMostWaiting];
    past[0] = -kHuge;
    item[0] = 0;
    int waiting = 1;
    while (waiting > 0) {
        --waiting;
        const float farthest = hit.past + ray.slack_mm;
        if (past[waiting] > farthest)
            continue;
        const uint next = item[waiting];
        if ((next & kBvhLeaf) != 0) {
            on_leaf(next & ~kBvhLeaf);
            continue;
        }
        ++node_visits;
        const OpenedNode& node = nodes[next];
        const NodeHits boxes = node_hits(node, ray, (farthest - ray.base_mm) * ray.t_per_mm);
        const int floor = waiting;
        for (int child = 0; child < 4; ++child) {
            if (!(boxes.near[child] <= boxes.far[child]))
                continue;
            const float near = ray.base_mm + ray.mm_per_t * boxes.near[child];
            int at = waiting++; // nearer ones are above it
            for (; at > floor && past[at - 1] < near; --at) {
                past[at] = past[at - 1];
                item[at] = item[at - 1];
            }
            past[at] = near;
            item[at] = node.child[child];
        }
    }
}

/// Traces pixels' rays.
class RayTracer {
public:
    RayTracer(const FrameJob& job, SeenPatches& seen, WorkCounts& work)
        : job_(job), work_(work), leaf_hits_(job, seen, work)
    {
    }

    /// The nearest hit, or `kept` where none is nearer; null: nothing is kept. A rim's back counts as a surface first,
    /// for few rays meet one: where it is what they see they are traced again.
    NearestHit trace(Pixel pixel, const NearestHit* kept)
    {
        ++work_.rays;
        NearestHit hit;
        for (const bool cut : {false, true}) {
            leaf_hits_.rims_cut = cut;
            hit = NearestHit{};
            if (kept)
                hit = *kept;
            trace_through(pixel, hit);
            if (!hit.back)
                break;
        }
        return kept && !(hit.past < kept->past) ? *kept : hit;
    }

private:
    void trace_through(Pixel pixel, NearestHit& hit)
    {
        const PackImage& image = job_.scene.image;
        if (image.instances.size() == 1)
            return enter(pixel, 0, hit);
        if (image.top_nodes.empty())
            return;
        const TreeRay ray = tree_ray(job_.top_view, pixel, -float(job_.view.depth_ref));
        walk(job_.opened.top_nodes.data(), ray, hit, work_.node_visits,
             [&](uint instance) { enter(pixel, instance, hit); });
    }

    __attribute__((noinline)) void enter(Pixel pixel, uint instance, NearestHit& hit)
    {
        const PackImage& image = job_.scene.image;
        const PartRecord& part = image.parts[image.instances[instance].part];
        if (part.node_count == 0)
            return;
        const TreeRay ray = tree_ray(job_.part_views[instance], pixel, -float(job_.view.depth_ref));
        walk(job_.opened.part_nodes.data() + part.first_node, ray, hit, work_.node_visits,
             [&](uint leaf) { leaf_hits_.intersect(pixel, part.first_leaf + leaf, instance, hit); });
    }

    const FrameJob& job_;
    WorkCounts& work_;
    LeafHits leaf_hits_;
};

SHARED_CLOSE
