// Where the nearest borders of a packet's faces are, in pixels: edge words for the frame's effects. Included once per
// target by cpu_packet.h; nothing here runs unless a picture asks for lines or anti-aliasing.
//
// Most packets lie within one face and far from its borders. For those the corners' uv_face say how large a pixel is,
// and a rectangle of the face that is known to be free of pieces is kept from packet to packet.
#if defined(TRIMRAY_CPU_EDGES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_EDGES_H
#undef TRIMRAY_CPU_EDGES_H
#else
#define TRIMRAY_CPU_EDGES_H
#endif

#include "format/pack_layout.h"
#include "runtime/cpu_evaluate.h"
#include "runtime/cpu_fetch.h"
#include "runtime/cpu_lanes.h"
#include "runtime/cpu_native.h"
#include "runtime/cpu_write.h"
#include "shaders/shared/edge.h"
#include "shaders/shared/trim_lookup.h"

#include <algorithm>
#include <array>
#include <cstring>

SHARED_OPEN

class EdgeFinder {
public:
    EdgeFinder(const BlockJob& job, BlockScratch& scratch, const FetchSource& source, WorkCounts& work)
        : job_(job), image_(job.scene.image), source_(source), views_(scratch.edge_views), marks_(scratch.edge_marks),
          work_(work)
    {
        if (job_.edges)
            views_.assign(kViews, {});
    }

    /// Whether borders that are asked for may be seen among these leaves. Where not, the map is as it should be.
    bool concerns(const std::vector<Candidate>& candidates) const
    {
        return std::any_of(candidates.begin(), candidates.end(),
                           [this](const Candidate& c) { return has_asked_borders(face_of(c.leaf)); });
    }

    /// Notes what is near the packet whose first pixel is (x, y) of the picture; its colours begin at `rgba`, in a
    /// strip.
    HWY_ATTR void find(const Packet& packet, const PacketHit& hit, uint32_t x, uint32_t y, float* rgba)
    {
        const size_t at = job_.edges->map.packet_of(x, y);
        uint8_t& near = job_.edges->map.near[at];
        const uint hit_lanes = lane_bits(packet.alive && hit.best < kHuge);
        if (hit_lanes == 0)
            return;
        alignas(64) uint leaves[kLanes], instances[kLanes];
        store(hit.leaf, leaves);
        store(hit.instance, instances);
        if (hit_lanes == 0xffffu && one_face(hit, leaves, instances[0]) &&
            far_from_borders(face_of(leaves[0]), hit.uv_face))
            return;
        const real2 here(real(0.0f), real(0.0f));
        Nearest line{here, real(kHuge), real(1.0f)}, border{here, real(kHuge), real(1.0f)};
        mask light(false); // lines are, there
        for (uint left = hit_lanes; left != 0;) {
            const int lane = __builtin_ctz(left);
            const mask same = hit.leaf == integer(leaves[lane]) && hit.instance == integer(instances[lane]);
            const uint lanes = lane_bits(same) & hit_lanes;
            left &= ~lanes;
            const uint face_id = face_of(leaves[lane]);
            if (!has_asked_borders(face_id))
                continue;
            find_in_leaf(packet, hit, leaves[lane], instances[lane], lanes, line, border);
            if (job_.edges->drawer && has_light_lines(FaceColors{job_.scene, job_.materials}, face_id, instances[lane]))
                light = light || same;
        }
        const EdgeQuery& query = job_.edges->query;
        EdgeMap& map = job_.edges->map;
        integer words;
        if (query.line_reach_px > 0 && keep(line, query.line_reach_px, words)) {
            near |= kNearLine;
            store(words, &map.line[16 * at]);
            if (job_.edges->drawer) {
                draw_own_halves(words, light, rgba);
                marks_.near.push_back(static_cast<uint32_t>(at));
            }
        }
        if (query.border_reach_px > 0 && keep(border, query.border_reach_px, words)) {
            near |= kNearBorder;
            store(words, &map.border[16 * at]);
        }
    }

    /// Draws what is left of the lines near the block's packets, all of which were asked about.
    void draw_lines(const Block& block, Strip& strip)
    {
        if (!marks_.near.empty())
            job_.edges->drawer->draw({job_.edges->drawer->rays(), int(block.x0), int(block.y0), int(block.x1),
                                      int(block.y1), kBlockSide, strip.rgba[0], strip.depth[0], strip.normal[0],
                                      strip.face[0], strip.instance[0]},
                                     marks_);
    }

private:
    struct Nearest {
        real2 offset;
        real square; // of its length; kHuge: none
        real strength;
    };

    /// A box of uv_face.
    struct UvBox {
        float u0, u1, v0, v1;
    };

    static bool contains(const UvBox& outer, const UvBox& inner)
    {
        return inner.u0 > outer.u0 && inner.u1 < outer.u1 && inner.v0 > outer.v0 && inner.v1 < outer.v1;
    }

    bool is_asked(uint edge_class) const { return (job_.edges->query.classes() >> edge_class & 1u) != 0; }
    bool has_asked_borders(uint face_id) const
    {
        return (job_.edges->query.classes() & job_.edges->cells.classes[face_id]) != 0;
    }

    uint face_of(uint leaf) const { return image_.patches[image_.leaves[leaf].patch].face; }

    /// Whether 16 hits are all of one face, of one leaf or of several.
    HWY_ATTR bool one_face(const PacketHit& hit, const uint (&leaves)[kLanes], uint instance) const
    {
        if (lane_bits(hit.instance == integer(instance)) != 0xffffu)
            return false;
        uint others = ~lane_bits(hit.leaf == integer(leaves[0])) & 0xffffu;
        for (const uint face = face_of(leaves[0]); others != 0;) {
            const uint leaf = leaves[__builtin_ctz(others)];
            if (face_of(leaf) != face)
                return false;
            others &= ~lane_bits(hit.leaf == integer(leaf));
        }
        return true;
    }

    /// The words of what lies within reach; false: nothing does.
    HWY_ATTR static bool keep(const Nearest& nearest, float reach_px, integer& words)
    {
        const mask within = nearest.square <= reach_px * reach_px;
        if (!any_lane(within))
            return false;
        const real2 offset = select(within, nearest.offset, real2(real(0.0f), real(0.0f)));
        words = select(within, edge_word(offset, nearest.strength), integer(0u));
        return true;
    }

    /// Draws lines over their own pixels while these are in the caches: edge_lines.h's own_line_share of each word.
    HWY_ATTR void draw_own_halves(integer words, mask light, float* rgba) const
    {
        const RenderOptions& options = job_.edges->options;
        const float width = options.edge_width_px;
        const real none(0.0f);
        const auto coordinate = [](integer steps)
                                    HWY_ATTR { return to_real(steps & integer(0x3fffu)) * (1.0f / 256) - 32.0f; };
        const real2 offset(coordinate(words), coordinate(words >> integer(14u)));
        const real strength = to_real((words >> integer(28u)) - integer(1u)) / 14.0f;
        const real covered = clamp(0.5f * width + 0.5f - length(offset), none, real(std::min(width, 1.0f)));
        const real share = select(words != integer(0u), covered * strength, none);
        const std::array<float, 3>& dark = options.edge_color ? *options.edge_color : kDarkLine;
        const std::array<float, 3>& pale = options.edge_color ? *options.edge_color : kLightLine;
        const auto color = [&](size_t c) HWY_ATTR { return select(light, real(pale[c]), real(dark[c])); };
        alignas(64) float shares[4 * kLanes], colors[4 * kLanes];
        store_interleaved(share, share, share, none, shares);
        store_interleaved(color(0), color(1), color(2), none, colors);
        for (uint row = 0; row < 4; ++row) {
            float* const pixels = rgba + row * (4 * kBlockSide);
            const real s = load(shares + 16 * row);
            store((1.0f - s) * load(pixels) + s * load(colors + 16 * row), pixels);
        }
    }

    /// True only if a packet of 16 hits of one face has no border within reach of any.
    HWY_ATTR bool far_from_borders(uint face_id, real2 uv)
    {
        if (!has_asked_borders(face_id))
            return true;
        // between neighbouring pixels uv steps by J_x and J_y; the packet's diagonals are 3 (J_x + J_y) and
        // 3 (J_x - J_y), so the longer component of them is at least 3 |J|. Half as much again for what bends.
        alignas(64) float u[kLanes], v[kLanes];
        store(uv.x, u);
        store(uv.y, v);
        const float pixels = 1.5f / 3 * job_.edges->query.reach_px();
        const float du = pixels * std::max(std::abs(u[15] - u[0]), std::abs(u[12] - u[3]));
        const float dv = pixels * std::max(std::abs(v[15] - v[0]), std::abs(v[12] - v[3]));
        const UvBox box{std::min({u[0], u[3], u[12], u[15]}) - du, std::max({u[0], u[3], u[12], u[15]}) + du,
                        std::min({v[0], v[3], v[12], v[15]}) - dv, std::max({v[0], v[3], v[12], v[15]}) + dv};
        if (face_id == free_face_ && contains(free_, box))
            return true;
        const FaceRecord& face = image_.faces[face_id];
        const bool natural = (face.flags & kFaceNaturalBorder) != 0;
        const bool free = natural ? free_of_sides(face) : free_of_pieces(face_id, box);
        free_face_ = free ? face_id : ~0u;
        return free ? contains(free_, box) : !natural && beside_pieces(face, face_id, box);
    }

    static uint side_class(const FaceRecord& face, uint side) { return face.border_classes >> 2 * side & 3u; }

    bool free_of_sides(const FaceRecord& face)
    {
        const auto bound = [&](uint side, float at, float far) { return is_asked(side_class(face, side)) ? at : far; };
        free_ = {bound(0, 0, -kHuge), bound(1, 1, kHuge), bound(2, 0, -kHuge), bound(3, 1, kHuge)};
        return true;
    }

    struct Grid {
        uint columns, rows;
        const uint* cells;
    };
    Grid grid_of(uint face_id) const
    {
        const uint* words = job_.edges->cells.words.data();
        const uint size = words[2 * face_id];
        return {size & 0xffffu, size >> 16, words + words[2 * face_id + 1]};
    }
    static uint index_of(float x, uint count)
    {
        return x > 0 ? std::min(static_cast<uint>(std::min(x, 1.0f) * static_cast<float>(count)), count - 1) : 0;
    }

    /// Looks for cells without pieces around the box; where there are, they are what is free.
    bool free_of_pieces(uint face_id, const UvBox& box)
    {
        const Grid grid = grid_of(face_id);
        if (grid.columns == 0) {
            free_ = {-kHuge, kHuge, -kHuge, kHuge};
            return true;
        }
        uint i0 = index_of(box.u0, grid.columns), i1 = index_of(box.u1, grid.columns);
        uint j0 = index_of(box.v0, grid.rows), j1 = index_of(box.v1, grid.rows);
        const auto empty = [&](uint a0, uint a1, uint b0, uint b1) { // columns a0..a1, rows b0..b1
            for (uint j = b0; j <= b1; ++j)
                if (grid.cells[j * grid.columns + a0] != grid.cells[j * grid.columns + a1 + 1])
                    return false;
            return true;
        };
        if (!empty(i0, i1, j0, j1))
            return false;
        constexpr int kGrowth = 4; // cells on each side: enough for a packet's neighbours
        for (int k = 0; k < kGrowth; ++k) {
            if (i0 > 0 && empty(i0 - 1, i0 - 1, j0, j1))
                --i0;
            if (i1 + 1 < grid.columns && empty(i1 + 1, i1 + 1, j0, j1))
                ++i1;
            if (j0 > 0 && empty(i0, i1, j0 - 1, j0 - 1))
                --j0;
            if (j1 + 1 < grid.rows && empty(i0, i1, j1 + 1, j1 + 1))
                ++j1;
        }
        // beyond the domain there is nothing
        const float per_column = 1 / static_cast<float>(grid.columns), per_row = 1 / static_cast<float>(grid.rows);
        free_ = {i0 == 0 ? -kHuge : static_cast<float>(i0) * per_column,
                 i1 + 1 == grid.columns ? kHuge : static_cast<float>(i1 + 1) * per_column,
                 j0 == 0 ? -kHuge : static_cast<float>(j0) * per_row,
                 j1 + 1 == grid.rows ? kHuge : static_cast<float>(j1 + 1) * per_row};
        return true;
    }

    /// True only if no piece that is asked for comes into the box.
    bool beside_pieces(const FaceRecord& face, uint face_id, const UvBox& box) const
    {
        const Grid grid = grid_of(face_id);
        const uint i0 = index_of(box.u0, grid.columns), i1 = index_of(box.u1, grid.columns);
        const uint j0 = index_of(box.v0, grid.rows), j1 = index_of(box.v1, grid.rows);
        const uint* words = job_.edges->cells.words.data();
        for (uint j = j0; j <= j1; ++j) {
            const uint* cells = grid.cells + j * grid.columns;
            for (uint at = cells[i0]; at < cells[i1 + 1]; ++at) {
                if (!is_asked(words[at] >> kPieceClassShift & 3u))
                    continue;
                const float* p =
                    image_.trim_points.data() + 2 * (size_t(face.first_point) + (words[at] >> kPiecePointShift));
                const uint last = (words[at] & kPieceCubic) != 0 ? 3 : 1;
                if (!outside(box, p, last) && !aside(box, p, last))
                    return false;
            }
        }
        return true;
    }

    /// Whether a piece's control points all lie on one side of the box, across the piece's chord.
    static bool aside(const UvBox& box, const float* p, uint last)
    {
        const float nu = p[1] - p[2 * last + 1], nv = p[2 * last] - p[0];
        const float u = 0.5f * (box.u0 + box.u1), v = 0.5f * (box.v0 + box.v1);
        const float half = 0.5f * (std::abs(nu) * (box.u1 - box.u0) + std::abs(nv) * (box.v1 - box.v0));
        float lo = kHuge, hi = -kHuge;
        for (uint i = 0; i <= last; ++i) {
            const float across = nu * (p[2 * i] - u) + nv * (p[2 * i + 1] - v);
            lo = std::min(lo, across);
            hi = std::max(hi, across);
        }
        return lo > half || hi < -half;
    }

    const PatchView& view_of(const PatchRecord& patch, uint patch_id, uint instance)
    {
        EdgeView& kept = views_[(patch_id + 7 * instance) % kViews];
        if (kept.patch != patch_id || kept.instance != instance)
            kept = {patch_id, instance, make_patch_view(patch, job_.view.instances[instance], job_.view.tau_ref)};
        return kept.view;
    }

    /// What a leaf's hits are measured with.
    struct Asked {
        explicit Asked(const PatchRecord& of) : patch(of) {} // the rest is not zeroed: it is 2 KB
        const PatchRecord& patch;
        mask here;
        uint lanes;
        real2 uv; // uv_face of the hits
        PixelRows rows;
        PixelMap map;
        Derivatives native; // of native kinds
        real3 p;            // the hits in patch space, of Bezier patches
        real line_strength;
        real2 reach; // in uv_face: nothing farther counts
    };

    HWY_ATTR SurfacePoint bezier_at(const PatchRecord& patch, real2 uv_face) const
    {
        const real2 uv((uv_face.x - patch.uv_offset[0]) * (1 / patch.uv_scale[0]),
                       (uv_face.y - patch.uv_offset[1]) * (1 / patch.uv_scale[1]));
        return find_evaluate(patch.shape)(source_, patch.first_control_point, int(patch.shape >> 8 & 0xffu),
                                          int(patch.shape >> 16 & 0xffu), uv);
    }

    static bool is_bezier(const PatchRecord& patch) { return (patch.shape & 0xffu) == kKindBezier; }

    HWY_ATTR HWY_NOINLINE Asked asked_of(const Packet& packet, const PacketHit& hit, uint leaf, uint instance,
                                         uint lanes)
    {
        const uint patch_id = image_.leaves[leaf].patch;
        const PatchRecord& patch = image_.patches[patch_id];
        const PatchView& view = view_of(patch, patch_id, instance);
        const scalar3 step_x(view.step_x[0], view.step_x[1], view.step_x[2]);
        const scalar3 step_y(view.step_y[0], view.step_y[1], view.step_y[2]);
        const scalar3 middle(view.origin[0], view.origin[1], view.origin[2]), w0(view.w0[0], view.w0[1], view.w0[2]);
        const real3 across = packet.x * step_x + packet.y * step_y;
        const real3 w = w0 + across;
        const real t = (hit.best - view.base_mm) * (1 / view.mm_per_t);
        const real3 p = middle + across * real(view.tau) + w * t;
        Asked asked(patch);
        asked.here = lanes_of(lanes);
        asked.lanes = lanes;
        asked.uv = hit.uv_face;
        asked.rows = pixel_rows(w, step_x, step_y, t + view.tau);
        asked.p = p;
        asked.line_strength = real(1.0f);
        const scalar2 uv_scale(patch.uv_scale[0], patch.uv_scale[1]);
        if (is_bezier(patch)) {
            const SurfacePoint s = bezier_at(patch, hit.uv_face);
            asked.map = pixel_map(asked.rows, s.du, s.dv, uv_scale);
        } else {
            asked.native = native_derivatives(patch, p);
            asked.map = pixel_map(asked.rows, asked.native.u, asked.native.v, uv_scale);
        }
        const float width_px = job_.edges->query.line_width_px;
        if (width_px > 0)
            asked.line_strength = line_strength(seen_thickness(asked.map), width_px);
        return asked;
    }

    HWY_ATTR void find_in_leaf(const Packet& packet, const PacketHit& hit, uint leaf, uint instance, uint lanes,
                               Nearest& line, Nearest& border)
    {
        const uint face_id = face_of(leaf);
        const FaceRecord& face = image_.faces[face_id];
        Asked asked = asked_of(packet, hit, leaf, instance, lanes);
        const Grid grid = grid_of(face_id);
        const bool natural = (face.flags & kFaceNaturalBorder) != 0;
        if (!natural && grid.columns == 0)
            return;
        real2 reach = reach_in_uv(asked.map, job_.edges->query.reach_px());
        if (!natural)
            reach = reach_in_cells(reach, scalar(grid.columns), scalar(grid.rows));
        asked.reach = reach;
        const real2 uv = hit.uv_face;
        const real none(-kHuge);
        const UvBox box{-largest_lane(select(asked.here, reach.x - uv.x, none)),
                        largest_lane(select(asked.here, uv.x + reach.x, none)),
                        -largest_lane(select(asked.here, reach.y - uv.y, none)),
                        largest_lane(select(asked.here, uv.y + reach.y, none))};
        if (natural)
            measure_sides(face, box, asked, line, border);
        else
            measure_pieces(grid, face, box, asked, line, border);
        if (job_.trim == TrimMode::Sdf && face.sdf_size != 0) {
            const real2 at = texture_border(face, asked);
            const mask known = asked.here && in_texture(uv, texel_of(face));
            move_to(at, known, line);
            move_to(at, known, border);
        }
    }

    static scalar2 texel_of(const FaceRecord& face)
    {
        const SdfFace sdf = sdf_face(face);
        return scalar2(1 / sdf.scale.x, 1 / sdf.scale.y);
    }

    /// Where the texture that trims the face has its border.
    HWY_ATTR HWY_NOINLINE real2 texture_border(const FaceRecord& face, const Asked& asked) const
    {
        const FetchSource& source = source_;
        const SdfFace sdf = sdf_face(face);
        const auto clamped = [](real x) HWY_ATTR { return clamp(x, real(0.0f), real(kUvBelowOne)); };
        const auto distance_at = [&](real u, real v)
                                     HWY_ATTR { return sdf_distance(FETCH_PASS sdf, real2(clamped(u), clamped(v))); };
        const float du = 0.5f * texel_of(face).x, dv = 0.5f * texel_of(face).y;
        const real2 uv = asked.uv;
        const real2 gradient((distance_at(uv.x + du, uv.y) - distance_at(uv.x - du, uv.y)) * (0.5f / du),
                             (distance_at(uv.x, uv.y + dv) - distance_at(uv.x, uv.y - dv)) * (0.5f / dv));
        return level_offset(asked.map, distance_at(uv.x, uv.y), gradient);
    }

    /// Moves what a piece said to where the texture has it.
    HWY_ATTR static void move_to(real2 offset, mask here, Nearest& nearest)
    {
        const mask known = here && nearest.square < kHuge && agrees(offset, nearest.offset);
        nearest.offset = select(known, offset, nearest.offset);
        nearest.square = select(known, dot(offset, offset), nearest.square);
    }

    HWY_ATTR static mask lanes_of(uint bits)
    {
        return ((integer(bits) >> lane_numbers()) & integer(1u)) != integer(0u);
    }

    HWY_ATTR void measure_sides(const FaceRecord& face, const UvBox& box, const Asked& asked, Nearest& line,
                                Nearest& border)
    {
        const bool reached[4] = {box.u0 <= 0, box.u1 >= 1, box.v0 <= 0, box.v1 >= 1};
        for (uint side = 0; side < 4; ++side) {
            const uint edge_class = side_class(face, side);
            if (!reached[side] || !is_asked(edge_class))
                continue;
            const float at = side % 2 == 0 ? 0.0f : 1.0f;
            const scalar2 a = side < 2 ? scalar2(at, 0) : scalar2(0, at);
            const scalar2 b = side < 2 ? scalar2(at, 1) : scalar2(1, at);
            measure_line(asked, edge_class, a, b, line, border);
        }
    }

    HWY_ATTR static real2 seen(const Asked& asked, scalar2 at)
    {
        return to_pixels(asked.map, real2(at.x - asked.uv.x, at.y - asked.uv.y));
    }

    HWY_ATTR void measure_line(const Asked& asked, uint edge_class, scalar2 a, scalar2 b, Nearest& line,
                               Nearest& border)
    {
        const real t = nearest_on_line(seen(asked, a), seen(asked, b));
        offer_border(asked, edge_class, real2(a.x + (b.x - a.x) * t, a.y + (b.y - a.y) * t), line, border);
    }

    HWY_ATTR void measure_cubic(const Asked& asked, uint edge_class, const float* p, Nearest& line, Nearest& border)
    {
        const scalar2 a(p[0], p[1]), b(p[2], p[3]), c(p[4], p[5]), d(p[6], p[7]);
        const real t = nearest_on_cubic(seen(asked, a), seen(asked, b), seen(asked, c), seen(asked, d));
        offer_border(asked, edge_class, cubic_at(a, b, c, d, t).p, line, border);
    }

    HWY_ATTR void measure_pieces(const Grid& grid, const FaceRecord& face, const UvBox& box, const Asked& asked,
                                 Nearest& line, Nearest& border)
    {
        const uint i0 = index_of(box.u0, grid.columns), i1 = index_of(box.u1, grid.columns);
        const uint j0 = index_of(box.v0, grid.rows), j1 = index_of(box.v1, grid.rows);
        const uint* words = job_.edges->cells.words.data();
        uint done[kMostPieces], done_count = 0;
        for (uint j = j0; j <= j1; ++j) {
            const uint* cells = grid.cells + j * grid.columns;
            for (uint at = cells[i0]; at < cells[i1 + 1]; ++at) {
                const uint word = words[at];
                if (!is_asked(word >> kPieceClassShift & 3u))
                    continue;
                if (std::find(done, done + done_count, word) != done + done_count)
                    continue;
                if (done_count == kMostPieces)
                    return;
                done[done_count++] = word;
                const float* p =
                    image_.trim_points.data() + 2 * (size_t(face.first_point) + (word >> kPiecePointShift));
                const uint last = (word & kPieceCubic) != 0 ? 3 : 1;
                if (outside(box, p, last) || aside(box, p, last))
                    continue;
                const uint edge_class = word >> kPieceClassShift & 3u;
                if (last == 1)
                    measure_line(asked, edge_class, scalar2(p[0], p[1]), scalar2(p[2], p[3]), line, border);
                else
                    measure_cubic(asked, edge_class, p, line, border);
            }
        }
    }

    /// A piece is monotone: it lies in its ends' box.
    static bool outside(const UvBox& box, const float* p, uint last)
    {
        const float ua = p[0], va = p[1], ub = p[2 * last], vb = p[2 * last + 1];
        return std::max(ua, ub) < box.u0 || std::min(ua, ub) > box.u1 || std::max(va, vb) < box.v0 ||
               std::min(va, vb) > box.v1;
    }

    /// Offers the border's point at uv_face, the nearest in the plane of the map.
    HWY_ATTR void offer_border(const Asked& asked, uint edge_class, real2 uv_face, Nearest& line, Nearest& border)
    {
        work_.edge_tests += uint64_t(__builtin_popcount(asked.lanes));
        const EdgeQuery& query = job_.edges->query;
        const bool as_line = (query.line_classes >> edge_class & 1u) != 0, as_border = query.border_reach_px > 0;
        const real2 step = uv_face - asked.uv;
        real2 offset = to_pixels(asked.map, step);
        const float reach = query.reach_px();
        const mask here = asked.here && abs(step.x) <= asked.reach.x && abs(step.y) <= asked.reach.y;
        if (!any_lane(here && dot(offset, offset) <= reach * reach))
            return;
        if (is_bezier(asked.patch)) {
            const SurfacePoint there = bezier_at(asked.patch, uv_face);
            offset = unless_turned(asked.rows, asked.map, there.du, there.dv, seen_step(asked.rows, there.p - asked.p));
        } else if ((asked.patch.shape & 0xffu) != kKindPlane) {
            offset = seen_bent(asked.rows, asked.map, asked.native,
                               real2(step.x * (1 / asked.patch.uv_scale[0]), step.y * (1 / asked.patch.uv_scale[1])));
        }
        const real square = dot(offset, offset);
        if (as_line) {
            const mask nearer = here && square < line.square;
            line.offset = select(nearer, offset, line.offset);
            line.square = select(nearer, square, line.square);
            line.strength = select(nearer, asked.line_strength, line.strength);
        }
        if (as_border) {
            const mask nearer = here && square < border.square;
            border.offset = select(nearer, offset, border.offset);
            border.square = select(nearer, square, border.square);
        }
    }

    static constexpr uint kViews = 64;
    static constexpr uint kMostPieces = 64;

    const BlockJob& job_;
    const PackImage& image_;
    const FetchSource& source_;
    std::vector<EdgeView>& views_; // by patch and instance
    BlockMarks& marks_;
    WorkCounts& work_;
    UvBox free_{};
    uint free_face_ = ~0u;
};

SHARED_CLOSE
#endif
