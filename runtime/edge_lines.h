// Lines along borders, half by half. A pixel's edge word (shaders/shared/edge.h) gives its own face's half of a line;
// the half beyond an outline is drawn over the pixels there, which learn of it from the pixel within: what reaches them
// is the strongest mark. A tracer may draw both a block at a time, while the block's pixels are in the caches.
#pragma once

#include "runtime/edge_map.h"
#include "runtime/face_colors.h"
#include "runtime/seen_pixels.h"
#include "runtime/tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace trimray {

/// An edge word's offset, pixels, and strength in [0, 1]. Layout: shaders/shared/edge.h.
struct Offset {
    float x, y, strength;
    float length() const { return std::sqrt(x * x + y * y); }
};
inline Offset offset_of(uint32_t word)
{
    constexpr float kStep = 1.0f / 256, kReach = 32;
    return {static_cast<float>(word & 0x3fffu) * kStep - kReach,
            static_cast<float>(word >> 14 & 0x3fffu) * kStep - kReach, static_cast<float>((word >> 28) - 1) / 14};
}

/// A border word's mark of a strip too thin to be drawn by itself: its strength reads 0.
inline bool is_thin_word(uint32_t word)
{
    return word >> 28 == 1;
}

/// How much of a pixel a line of `width` covers whose middle passes at `distance`, pixels: what is summed over the
/// pixels across a line is its width. The paper's smooth function (eq. 7).
inline float line_coverage(float distance, float width)
{
    return std::clamp(0.5f * width + 0.5f - distance, 0.0f, std::min(width, 1.0f));
}

/// Beyond this the coverage is 0.
inline float line_reach(float width)
{
    return 0.5f * width + 0.5f;
}

/// As far as lines of this width need to be known, pixels: one beyond an outline learns of the line from one within,
/// up to a pixel from the border.
inline float line_query_reach(float width)
{
    return std::max(line_reach(width), 1.0f);
}

/// The share of its own pixel that the line of an edge word (not 0) takes, in [0, 1].
inline float own_line_share(uint32_t word, float width_px)
{
    const Offset offset = offset_of(word);
    return line_coverage(offset.length(), width_px) * offset.strength;
}

/// Lines on light and on dark faces, where no colour is asked for. Linear light.
constexpr std::array<float, 3> kDarkLine = {0.012f, 0.012f, 0.015f}, kLightLine = {0.22f, 0.22f, 0.23f};
bool has_light_lines(const FaceColors& colors, uint32_t face, uint32_t instance);

/// The colour of the lines of what pixel i of `pixels` shows: the one asked for, or one that shows there.
std::array<float, 3> line_color_at(const FaceColors& colors, const RenderOptions& options, const SeenPixels& pixels,
                                   size_t i);

/// The share of (x, y) that its own line has in the pixels as they were traced.
inline float drawn_share(const EdgeMap& map, float width, int x, int y)
{
    const uint32_t word = map.own_halves_drawn ? map.line_at(x, y) : 0;
    return word != 0 ? own_line_share(word, width) : 0.0f;
}

/// `color` (straight alpha) under a share of another one: each counts by the alpha that it brings.
inline void mix(std::array<float, 4>& color, const std::array<float, 4>& other, float share)
{
    const float own = (1 - share) * color[3], added = share * other[3], alpha = own + added;
    for (size_t c = 0; c < 3; ++c)
        color[c] = alpha > 0 ? (own * color[c] + added * other[c]) / alpha : 0.0f;
    color[3] = alpha;
}

constexpr float kLeastLean = 0.4f; // a border is walked to along an axis that has so much of its normal's length
constexpr float kUnsure = 0.3f;    // pixels: so far within the border a pixel may show what lies beyond
/// The most steps that a walk takes.
int farthest_step(float width);

/// How far the line of a word, not 0, lies from its pixel's middle in the direction (dx, dy), along an axis.
inline float line_along(uint32_t word, int dx, int dy)
{
    const Offset line = offset_of(word);
    return line.x * static_cast<float>(dx) + line.y * static_cast<float>(dy);
}

/// Walks from (x, y) beyond the outline at `offset`, along each axis that the border's normal leans to, or steps of a
/// slanting line are missed; calls raise(tx, ty, share) where the line takes more of a pixel than the pixel's own line.
/// Nothing happens at borders behind which the surface goes on. Returns false where it would have to look at a pixel of
/// the picture that `pixels` has not.
template <class Raise>
bool walk_outer_half(const SeenPixels& pixels, const EdgeMap& map, float width, int x, int y, Offset offset,
                     Raise raise)
{
    // At most borders the other face's half begins at the next pixel. So near to the border a walk asks about that one
    // first: 1 * kLeastLean - distance >= -kUnsure
    constexpr float kNear = kLeastLean + kUnsure - 0.01f;
    bool walks_x = true, walks_y = true;
    const int next_x = offset.x < 0 ? -1 : 1, next_y = offset.y < 0 ? -1 : 1;
    if (offset.x * offset.x + offset.y * offset.y < kNear * kNear) {
        const auto ends = [&](int dx, int dy) {
            if (!pixels.has(x + dx, y + dy))
                return false;
            const uint32_t word = map.line_at(x + dx, y + dy);
            return word != 0 && line_along(word, dx, dy) < 0;
        };
        walks_x = !ends(next_x, 0);
        walks_y = !ends(0, next_y);
        if (!walks_x && !walks_y)
            return true;
    }
    const float distance = offset.length();
    if (!(distance > 0))
        return true;
    const auto walk = [&](float o, int dx, int dy) {
        const float per_step = std::abs(o) / distance; // towards the border
        if (per_step < kLeastLean)
            return true;
        bool hidden = false; // what is beyond
        for (int s = 1;; ++s) {
            const float past = static_cast<float>(s) * per_step - distance;
            if (past >= line_reach(width))
                return true;
            if (past < -kUnsure)
                continue;
            const int tx = x + s * dx, ty = y + s * dy;
            if (!pixels.has(tx, ty))
                return !pixels.rays.on_picture(tx, ty);
            if (!hidden) {
                const uint32_t word = map.line_at(tx, ty);
                if (word != 0 && line_along(word, dx, dy) < 0)
                    return true; // the other face's half
                if (!pixels.hides(x, y, tx, ty) && !is_thin_word(map.border_at(tx, ty))) {
                    if (past < 0)
                        continue;
                    return true;
                }
                hidden = true;
            }
            const float share = line_coverage(std::abs(past), width) * offset.strength;
            const float drawn = drawn_share(map, width, tx, ty);
            // of equal lines the first has the pixel, in the order of packets
            const auto place = [&map](int px, int py) {
                return map.word_of(static_cast<uint32_t>(px), static_cast<uint32_t>(py));
            };
            if (share > drawn || (share == drawn && share > 0 && place(x, y) < place(tx, ty)))
                raise(tx, ty, share);
        }
    };
    const bool x_done = !walks_x || walk(offset.x, next_x, 0);
    const bool y_done = !walks_y || walk(offset.y, 0, next_y);
    return x_done && y_done;
}

/// The colour that (x, y) would have without its own line; its own colour where the line covers all of it.
std::array<float, 4> color_below(const FaceColors& colors, const RenderOptions& options, const EdgeMap& map,
                                 const SeenPixels& pixels, int x, int y);

/// The marks of a block on its own pixels, reused from block to block.
struct BlockMarks {
    std::vector<uint32_t> near;    // the block's packets (of the map) that have lines
    std::vector<LineMark> marks;   // by pixel of the block, row by row; none between blocks
    std::vector<uint32_t> touched; // pixels with marks
};

/// Draws the outer halves of lines over a block in whose pixels their own halves are drawn already.
class BlockLineDrawer {
public:
    /// All must outlive it. Domain: map.own_halves_drawn.
    BlockLineDrawer(const FaceColors& colors, const RenderOptions& options, EdgeMap& map);

    const PictureRays& rays() const { return rays_; }

    /// Draws what the lines of the packets `scratch.near` have on pixels that no line of another block can reach, and
    /// leaves the rest in map.waiting. Domain: `pixels` are a block of kEdgeBlockSide or what the picture has of it,
    /// and the map has its words.
    void draw(const SeenPixels& pixels, BlockMarks& scratch) const;

private:
    bool is_out_of_reach(const SeenPixels& pixels, int x, int y) const;

    const FaceColors colors_;
    const RenderOptions& options_;
    EdgeMap& map_;
    const PictureRays rays_;
    const int farthest_; // steps that a walk takes at most
};

} // namespace trimray
