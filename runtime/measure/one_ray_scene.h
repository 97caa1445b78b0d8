// What one ray meets: nodes and leaves unpacked when the tracer is made, patches and trees as the rays of a view see
// them.
#pragma once

#ifndef TRIMRAY_ONE_RAY
#error "the shared formulas must be those for one ray: define TRIMRAY_ONE_RAY before all includes"
#endif

#include "format/pack_image.h"
#include "runtime/common_degrees.h"
#include "runtime/cpu_fetch.h"
#include "runtime/cpu_view.h"
#include "runtime/plain_newton.h"
#include "shaders/shared/bvh_node.h"

#include <span>
#include <vector>

SHARED_OPEN

/// A tree's node with its children's boxes side by side, the tree's units. Holes have boxes that no ray meets.
struct OpenedNode {
    float lo[3][4], hi[3][4];
    uint child[4]; // BvhNode
};

static inline std::vector<OpenedNode> open_nodes(std::span<const BvhNode> packed)
{
    constexpr float kMargin = 2e-7f; // the rays' rounding, and the sum's that gives a side
    std::vector<OpenedNode> nodes(packed.size());
    for (size_t i = 0; i < packed.size(); ++i) {
        for (int k = 0; k < 4; ++k) {
            ChildBox box{scalar3(kHuge, kHuge, kHuge), scalar3(-kHuge, -kHuge, -kHuge)};
            if (packed[i].child[k] != kBvhEmpty)
                box = decode_child(packed[i], k);
            const float lo[3] = {box.lo.x, box.lo.y, box.lo.z}, hi[3] = {box.hi.x, box.hi.y, box.hi.z};
            for (int axis = 0; axis < 3; ++axis) {
                nodes[i].lo[axis][k] = lo[axis] - kMargin;
                nodes[i].hi[axis][k] = hi[axis] + kMargin;
            }
            nodes[i].child[k] = packed[i].child[k];
        }
    }
    return nodes;
}

/// Plain Newton from `start` in a Bezier patch; `enough` in patch units.
using SearchPatch = PlainEnd (*)(const FetchSource& source, const PatchRecord& patch, const LeafBox& box,
                                 const RayPlanes& planes, scalar enough, real2 start, uint64_t& steps);

/// Degrees 0: those of the patch.
template <int fixed_degree_u, int fixed_degree_v, bool rational>
FN_LARGE PlainEnd search_patch(const FetchSource& source, const PatchRecord& patch, const LeafBox& box,
                               const RayPlanes& planes, scalar enough, real2 start, uint64_t& steps)
{
    const int degree_u = fixed_degree_u > 0 ? fixed_degree_u : int(patch.shape >> 8 & 0xffu);
    const int degree_v = fixed_degree_v > 0 ? fixed_degree_v : int(patch.shape >> 16 & 0xffu);
    // into both of its calls: a call and its result in memory cost 6 to 9 % of a frame
    const auto evaluate = [&](real2 uv) __attribute__((always_inline))
    {
        return bezier_point(FETCH_PASS patch.first_control_point, degree_u, degree_v, rational, uv);
    };
    return plain_newton(
        evaluate, [&](mask) { ++steps; }, planes, box, enough, start, true);
}

struct OpenedLeaf {
    LeafBox box;
    uint patch;
    // of Bezier patches
    SearchPatch search;
    scalar rounding; // patch_rounding
    scalar2 slack;   // patch_slack
};

static inline std::vector<OpenedLeaf> open_leaves(const PackImage& image)
{
    std::vector<OpenedLeaf> leaves;
    leaves.reserve(image.leaves.size());
    for (const LeafRecord& leaf : image.leaves) {
        const PatchRecord& patch = image.patches[leaf.patch];
        const SearchPatch search =
            by_common_degrees(patch.shape, []<int degree_u, int degree_v, bool rational>() -> SearchPatch {
                return &search_patch<degree_u, degree_v, rational>;
            });
        const int degree_u = int(patch.shape >> 8 & 0xffu), degree_v = int(patch.shape >> 16 & 0xffu);
        leaves.push_back({decode_leaf(leaf), leaf.patch, search, patch_rounding(degree_u, degree_v),
                          patch_slack(scalar2(patch.uv_scale[0], patch.uv_scale[1]))});
    }
    return leaves;
}

/// A pack, opened.
struct OpenedScene {
    explicit OpenedScene(const PackImage& image)
        : top_nodes(open_nodes(image.top_nodes)), part_nodes(open_nodes(image.part_nodes)), leaves(open_leaves(image))
    {
    }
    std::vector<OpenedNode> top_nodes, part_nodes;
    std::vector<OpenedLeaf> leaves;
    size_t size_bytes() const
    {
        return (top_nodes.size() + part_nodes.size()) * sizeof(OpenedNode) + leaves.size() * sizeof(OpenedLeaf);
    }
};

/// A tree's units as the rays of a view see them: as a patch whose axes are the tree's.
static inline PatchView tree_view(const InstanceView& instance, double tau_ref)
{
    PatchRecord whole{};
    whole.scale = 1;
    whole.axis_x[0] = whole.axis_y[1] = whole.axis_z[2] = 1;
    return make_patch_view(whole, instance, tau_ref);
}

/// The patches that a thread's rays met last, as these see them: what is the same for all rays of a view is computed in
/// double, and not again for each of them.
class SeenPatches {
public:
    SeenPatches() : slots_(kSlots) {}
    void clear()
    {
        for (Slot& slot : slots_)
            slot.patch = ~0u;
    }
    const PatchView& of(const PackImage& image, const View& view, uint instance, uint patch)
    {
        Slot& slot = slots_[(patch + instance * 0x9e3779b1u) % kSlots];
        if (slot.patch != patch || slot.instance != instance)
            slot = {patch, instance, make_patch_view(image.patches[patch], view.instances[instance], view.tau_ref)};
        return slot.view;
    }

private:
    struct Slot {
        uint patch = ~0u, instance = ~0u;
        PatchView view{};
    };
    static constexpr size_t kSlots = 2048;
    std::vector<Slot> slots_;
};

SHARED_CLOSE
