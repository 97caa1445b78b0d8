// The leaves that the rays of a block may meet: through the trees by the block's frustum, and where each leaf's box
// appears on the picture. Included once per target by cpu_packet.h.
#if defined(TRIMRAY_CPU_CANDIDATES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_CANDIDATES_H
#undef TRIMRAY_CPU_CANDIDATES_H
#else
#define TRIMRAY_CPU_CANDIDATES_H
#endif

#include "format/pack_layout.h"
#include "runtime/cpu_double.h"
#include "runtime/cpu_lanes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>

SHARED_OPEN

/// A frustum of a rectangle in one instance's part: points p with f . (p - eye) >= 0 for all f.
struct Frustum {
    static constexpr int kPlanes = 5; // tau > 0 and the rectangle's four sides
    double eye[3];
    double plane[kPlanes][3], reach[kPlanes][3]; // reach: |plane|

    Frustum(const InstanceView& view, const PixelRect& rect)
    {
        for (int i = 0; i < 3; ++i) {
            eye[i] = view.eye[i];
            plane[0][i] = view.row_tau[i];
            plane[1][i] = view.row_x[i] - rect.x0 * view.row_tau[i];
            plane[2][i] = rect.x1 * view.row_tau[i] - view.row_x[i];
            plane[3][i] = view.row_y[i] - rect.y0 * view.row_tau[i];
            plane[4][i] = rect.y1 * view.row_tau[i] - view.row_y[i];
        }
        for (int f = 0; f < kPlanes; ++f)
            for (int i = 0; i < 3; ++i)
                reach[f][i] = std::abs(plane[f][i]);
    }

    HWY_ATTR doubles_mask meets(const doubles3& center, const doubles3& half) const
    {
        doubles_mask met = dot(plane[0], center) + dot(reach[0], half) >= 0.0;
        for (int f = 1; f < kPlanes; ++f)
            met = met && dot(plane[f], center) + dot(reach[f], half) >= 0.0;
        return met;
    }
};

/// Half a step of a node's boxes: centre and half side are whole numbers of it.
inline double half_step(const BvhNode& node, int axis)
{
    constexpr uint64_t kBias = 1023 - 128; // of double, over that of half a float
    return std::bit_cast<double>((uint64_t(node.exponents >> 8 * axis & 0xffu) + kBias) << 52);
}

/// Which children of two nodes meet the frustum: bits 0 to 3 of a, 4 to 7 of b; some may be empty.
[[maybe_unused]] static HWY_ATTR uint met_children(const BvhNode& a, const BvhNode& b, const Frustum& frustum)
{
    doubles3 center, half;
    doubles* const centers[3] = {&center.x, &center.y, &center.z};
    doubles* const halves_of[3] = {&half.x, &half.y, &half.z};
    for (int c = 0; c < 3; ++c) {
        uint8_t lo[kDoubles], hi[kDoubles];
        std::memcpy(lo, &a.lo[c], 4);
        std::memcpy(lo + 4, &b.lo[c], 4);
        std::memcpy(hi, &a.hi[c], 4);
        std::memcpy(hi + 4, &b.hi[c], 4);
        const doubles first = load_bytes(lo), last = load_bytes(hi);
        const doubles step = halves(half_step(a, c), half_step(b, c));
        const doubles origin = halves(double(a.origin[c]) - frustum.eye[c], double(b.origin[c]) - frustum.eye[c]);
        *centers[c] = origin + step * (first + last);
        *halves_of[c] = step * (last - first);
    }
    return lane_bits(frustum.meets(center, half));
}

/// Calls leaf(index) for each leaf of the tree whose box meets the frustum.
template <class Leaf>
HWY_ATTR void walk(const BvhNode* nodes, const Frustum& frustum, std::vector<uint32_t>& stack, WorkCounts& work,
                   Leaf leaf)
{
    const size_t bottom = stack.size();
    stack.push_back(0);
    while (stack.size() > bottom) {
        const BvhNode* two[2];
        const size_t count = std::min<size_t>(stack.size() - bottom, 2);
        for (size_t i = 0; i < count; ++i) {
            two[i] = &nodes[stack.back()];
            stack.pop_back();
        }
        work.node_visits += count;
        uint met = met_children(*two[0], *two[count - 1], frustum);
        if (count == 1)
            met &= 15u;
        for (; met != 0; met &= met - 1) {
            const int at = __builtin_ctz(met);
            const uint child = two[at / 4]->child[at % 4];
            if (child == kBvhEmpty)
                continue;
            if ((child & kBvhLeaf) != 0)
                leaf(child & ~kBvhLeaf);
            else
                stack.push_back(child);
        }
    }
}

/// The eight corners middle +- a +- b +- c of boxes.
FN void corners_of(doubles middle, const doubles (&axis)[3], doubles (&out)[8])
{
    out[0] = middle;
    for (int a = 0; a < 3; ++a)
        for (int i = 0; i < 1 << a; ++i) {
            out[i + (1 << a)] = out[i] + axis[a];
            out[i] = out[i] - axis[a];
        }
}

struct Extent {
    doubles lo, hi;
};
FN Extent extent_of(const doubles (&values)[8])
{
    Extent extent{values[0], values[0]};
    for (int i = 1; i < 8; ++i) {
        extent.lo = min(extent.lo, values[i]);
        extent.hi = max(extent.hi, values[i]);
    }
    return extent;
}

struct PixelStrips {
    alignas(64) float nx[kDoubles], ny[kDoubles], lo[kDoubles], hi[kDoubles];
};

/// The strips along (dx, dy) that hold the corners; `pad` pixels wider, and what rounding asks for.
FN void strips_along(doubles dx, doubles dy, const doubles (&x)[8], const doubles (&y)[8], doubles pad,
                     PixelStrips& out)
{
    const doubles size = max(abs(dx), abs(dy));
    const doubles_mask some = size > 0.0;
    // a box without length there: a strip that holds everything
    const doubles per_size = select(some, 1.0 / select(some, size, 1.0), 0.0);
    const doubles nx = as_floats(0.0 - dy * per_size), ny = as_floats(dx * per_size);
    doubles at[8];
    for (int i = 0; i < 8; ++i)
        at[i] = nx * x[i] + ny * y[i];
    const Extent extent = extent_of(at);
    const doubles room = 2.0 * pad + 1e-6 * (extent.hi - extent.lo);
    store_floats(nx, out.nx);
    store_floats(ny, out.ny);
    store_floats(extent.lo - room, out.lo);
    store_floats(extent.hi + room, out.hi);
}

/// How many pixels of the rectangle what is 1 before the eye moves as its centre is rounded to 2^-24 of the part.
inline double center_blur(const InstanceView& view, const PixelRect& rect)
{
    const double x = std::max(std::abs(rect.x0), std::abs(rect.x1)), y = std::max(std::abs(rect.y0), std::abs(rect.y1));
    double pixels = 0;
    for (int i = 0; i < 3; ++i)
        pixels += std::abs(view.row_x[i]) + std::abs(view.row_y[i]) + (x + y) * std::abs(view.row_tau[i]);
    constexpr double kCenterRounding = 6e-8;
    return kCenterRounding * pixels;
}

/// Adds those of at most 8 leaves of one instance whose boxes appear within the rectangle.
[[maybe_unused]] static HWY_ATTR void project_leaves(const CpuScene& scene, std::span<const uint32_t> leaves,
                                                     uint32_t instance, const View& picture, const PixelRect& rect,
                                                     std::vector<Candidate>& out)
{
    const InstanceView& view = picture.instances[instance];
    alignas(64) float fields[12][kDoubles]; // of LeafBounds
    static_assert(sizeof(CpuScene::LeafBounds) == sizeof(float) * 12);
    for (size_t i = 0; i < size_t(kDoubles); ++i) {
        float bounds[12];
        std::memcpy(bounds, &scene.leaf_bounds[leaves[std::min(i, leaves.size() - 1)]], sizeof bounds);
        for (int f = 0; f < 12; ++f)
            fields[f][i] = bounds[f];
    }
    const doubles3 c{load_floats(fields[0]) - view.eye[0], load_floats(fields[1]) - view.eye[1],
                     load_floats(fields[2]) - view.eye[2]};
    const doubles tau = dot(view.row_tau, c), x = dot(view.row_x, c), y = dot(view.row_y, c);
    doubles tau_a[3], x_a[3], y_a[3], reach = 0.0;
    for (int i = 0; i < 3; ++i) {
        const doubles3 a{load_floats(fields[3 * i + 3]), load_floats(fields[3 * i + 4]),
                         load_floats(fields[3 * i + 5])};
        tau_a[i] = dot(view.row_tau, a);
        x_a[i] = dot(view.row_x, a);
        y_a[i] = dot(view.row_y, a);
        reach = reach + abs(tau_a[i]);
    }
    // the centre is rounded to 2^-24 of the part
    reach = reach * (1 + 1e-7) + 1e-7 + view.far_slack;
    uint ahead = lane_bits(tau + reach > 0.0) & ((1u << leaves.size()) - 1u);
    if (ahead == 0)
        return;
    alignas(64) float near_mm[kDoubles], x0[kDoubles], x1[kDoubles], y0[kDoubles], y1[kDoubles];
    store_floats((max(tau - reach, 0.0) / view.k - picture.tau_ref) - 1e-7 * (tau / view.k - picture.plane_mm),
                 near_mm);
    // a box around the eye's plane may be anywhere; one well before it is the hull of its corners
    const doubles before = tau - reach;
    const uint hulls = lane_bits(before > 1e-3 * reach);
    doubles corner_tau[8], corner_x[8], corner_y[8];
    corners_of(tau, tau_a, corner_tau);
    corners_of(x, x_a, corner_x);
    corners_of(y, y_a, corner_y);
    for (int i = 0; i < 8; ++i) {
        const doubles per_tau = 1.0 / corner_tau[i];
        corner_x[i] = corner_x[i] * per_tau;
        corner_y[i] = corner_y[i] * per_tau;
    }
    const Extent across = extent_of(corner_x), down = extent_of(corner_y);
    constexpr double kPad = 0.01; // pixels: rounding of the rectangle to float
    const doubles pad = kPad + 1e-6 * (across.hi - across.lo + down.hi - down.lo) + center_blur(view, rect) / before;
    store_floats(across.lo - pad, x0);
    store_floats(across.hi + pad, x1);
    store_floats(down.lo - pad, y0);
    store_floats(down.hi + pad, y1);
    // the box's sides on the picture, but for a factor, without the shortest
    doubles dx[3], dy[3], length[3];
    for (int i = 0; i < 3; ++i) {
        dx[i] = x_a[i] * tau - x * tau_a[i];
        dy[i] = y_a[i] * tau - y * tau_a[i];
        length[i] = abs(dx[i]) + abs(dy[i]);
    }
    const doubles_mask keeps_first = length[0] >= min(length[1], length[2]),
                       keeps_last = length[2] >= min(length[0], length[1]);
    PixelStrips strips[2];
    strips_along(select(keeps_first, dx[0], dx[1]), select(keeps_first, dy[0], dy[1]), corner_x, corner_y, pad,
                 strips[0]);
    strips_along(select(keeps_last, dx[2], dx[1]), select(keeps_last, dy[2], dy[1]), corner_x, corner_y, pad,
                 strips[1]);
    for (; ahead != 0; ahead &= ahead - 1) {
        const auto i = size_t(__builtin_ctz(ahead));
        Candidate candidate{rect, {kWholePicture, kWholePicture}, near_mm[i], leaves[i], instance};
        if ((hulls >> i & 1u) != 0) {
            if (!(x0[i] <= rect.x1 && x1[i] >= rect.x0 && y0[i] <= rect.y1 && y1[i] >= rect.y0))
                continue;
            candidate.rect = {x0[i], x1[i], y0[i], y1[i]};
            for (int s = 0; s < 2; ++s)
                candidate.strip[s] = {strips[s].nx[i], strips[s].ny[i], strips[s].lo[i], strips[s].hi[i]};
        }
        out.push_back(candidate);
    }
}

/// The leaves whose boxes meet the rectangle's rays, sorted by near_mm, as scratch.candidates.
[[maybe_unused]] static HWY_ATTR void collect_candidates(const CpuScene& scene, const View& view, const PixelRect& rect,
                                                         BlockScratch& scratch, WorkCounts& work)
{
    const PackImage& image = scene.image;
    std::vector<Candidate>& found = scratch.unsorted;
    found.clear();
    scratch.stack.clear();
    const auto enter = [&](uint32_t index) HWY_ATTR {
        const PartRecord& part = image.parts[image.instances[index].part];
        if (part.node_count == 0)
            return;
        uint32_t leaves[kDoubles];
        size_t count = 0;
        const Frustum frustum(view.instances[index], rect);
        walk(image.part_nodes.data() + part.first_node, frustum, scratch.stack, work, [&](uint leaf) HWY_ATTR {
            leaves[count++] = part.first_leaf + leaf;
            if (count == size_t(kDoubles)) {
                project_leaves(scene, leaves, index, view, rect, found);
                count = 0;
            }
        });
        if (count > 0)
            project_leaves(scene, std::span(leaves, count), index, view, rect, found);
    };
    if (view.alone) {
        enter(*view.alone);
    } else if (!view.placed.top_nodes.empty()) {
        walk(view.placed.top_nodes.data(), Frustum(world_view(view), rect), scratch.stack, work, enter);
    }
    std::vector<CandidateKey>& keys = scratch.keys;
    keys.clear();
    for (const Candidate& candidate : found)
        keys.push_back({candidate.near_mm, candidate.instance, candidate.leaf, uint32_t(keys.size())});
    std::sort(keys.begin(), keys.end(), [](const CandidateKey& a, const CandidateKey& b) {
        if (a.near_mm != b.near_mm)
            return a.near_mm < b.near_mm;
        return a.instance != b.instance ? a.instance < b.instance : a.leaf < b.leaf;
    });
    scratch.candidates.clear();
    for (const CandidateKey& key : keys)
        scratch.candidates.push_back(found[key.at]);
}

SHARED_CLOSE
#endif
