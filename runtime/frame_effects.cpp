#include "runtime/frame_effects.h"

#include "runtime/image_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace trimray {
namespace {

struct Vec {
    float x, y, z;
};
float dot(Vec a, Vec b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// An edge word's offset, pixels, and strength in [0, 1]. Layout: shaders/shared/edge.h.
struct Offset {
    float x, y, strength;
    float length() const { return std::sqrt(x * x + y * y); }
};
Offset offset_of(uint32_t word)
{
    constexpr float kStep = 1.0f / 256, kReach = 32;
    return {static_cast<float>(word & 0x3fffu) * kStep - kReach,
            static_cast<float>(word >> 14 & 0x3fffu) * kStep - kReach, static_cast<float>((word >> 28) - 1) / 14};
}
/// Full strength. As edge_word has it, a border through the pixel's centre keeps its direction.
uint32_t word_of(float x, float y)
{
    constexpr float kLeast = 2.0f / 256;
    const float scale = std::max(kLeast / std::max(std::hypot(x, y), 1e-20f), 1.0f);
    const auto coordinate = [scale](float c) { return static_cast<uint32_t>((scale * c + 32) * 256 + 0.5f); };
    return coordinate(x) | coordinate(y) << 14 | 15u << 28;
}

/// A border word's mark of a strip too thin to be drawn by itself; its offset is kept, its strength reads 0.
uint32_t thin_word(uint32_t word)
{
    return (word & 0x0fffffffu) | 1u << 28;
}
bool is_thin_word(uint32_t word)
{
    return word >> 28 == 1;
}

/// How much of a pixel a line of `width` covers whose middle passes at `distance`, pixels: what is summed over the
/// pixels across a line is its width. Eq. 7's smooth function.
float line_coverage(float distance, float width)
{
    return std::clamp(0.5f * width + 0.5f - distance, 0.0f, std::min(width, 1.0f));
}

/// Beyond this the coverage is 0.
float line_reach(float width)
{
    return 0.5f * width + 0.5f;
}

/// The share of a colour channel, sRGB byte to linear light.
const std::array<float, 256>& linear_of_byte()
{
    static const std::array<float, 256> table = [] {
        std::array<float, 256> t{};
        for (size_t i = 0; i < t.size(); ++i)
            t[i] = srgb_to_linear(static_cast<float>(i) / 255);
        return t;
    }();
    return table;
}

constexpr std::array<float, 3> kDarkLine = {0.012f, 0.012f, 0.015f}, kLightLine = {0.22f, 0.22f, 0.23f};

constexpr uint32_t kNone = ~0u;

/// What happens to one pixel.
struct Mark {
    float cover = 0;             // share of the pixel that another pixel's surface has
    uint32_t cover_from = kNone; // that pixel
    float line = 0;              // share that a line has
    uint32_t line_from = kNone;  // the pixel whose face the line belongs to
};

struct Painted {
    uint32_t pixel;
    std::array<float, 4> rgba;
};

constexpr uint32_t kBandRows = 64; // a multiple of a packet's 4

/// One band's marks, packet by packet where there are any.
struct BandMarks {
    std::vector<uint32_t> place; // in `packets`, by packet of the band; kNone: no marks
    std::vector<uint32_t> packets;
    std::vector<Mark> marks; // 16 a packet
};

class Effects {
public:
    Effects(const PackImage& image, const RenderOptions& options, EdgeMap& map, Frame& frame)
        : image_(image), options_(options), query_(edge_query(options)), map_(map), frame_(frame),
          width_(int(frame.width)), height_(int(frame.height)),
          rays_(camera_rays(options.camera, frame.width, frame.height))
    {
        for (size_t i = 0; i < 3; ++i) {
            corner_[i] = float(rays_.corner[i] + 0.5 * (rays_.step_x[i] + rays_.step_y[i]));
            step_x_[i] = float(rays_.step_x[i]);
            step_y_[i] = float(rays_.step_y[i]);
        }
        pixel_ = std::sqrt(step_x_[0] * step_x_[0] + step_x_[1] * step_x_[1] + step_x_[2] * step_x_[2]) /
                 length(direction(width_ / 2, height_ / 2));
    }

    uint32_t band_count() const { return (frame_.height + kBandRows - 1) / kBandRows; }

    void find_rims(uint32_t band);
    std::vector<Painted> paint(uint32_t band) const;
    void apply(uint32_t band, const std::vector<Painted>& painted) const;

private:
    static float length(Vec v) { return std::sqrt(dot(v, v)); }
    size_t at(int x, int y) const { return size_t(y) * size_t(width_) + size_t(x); }
    bool on_picture(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }
    bool is_hit(size_t i) const { return frame_.face[i] >= 0; }
    bool same_face(size_t a, size_t b) const
    {
        return frame_.face[a] == frame_.face[b] && frame_.instance[a] == frame_.instance[b];
    }
    Vec normal(size_t i) const { return {frame_.normal[3 * i], frame_.normal[3 * i + 1], frame_.normal[3 * i + 2]}; }
    Vec direction(int x, int y) const
    {
        const float fx = float(x), fy = float(y);
        return {corner_[0] + fx * step_x_[0] + fy * step_y_[0], corner_[1] + fx * step_x_[1] + fy * step_y_[1],
                corner_[2] + fx * step_x_[2] + fy * step_y_[2]};
    }
    Vec unit_direction(int x, int y) const
    {
        const Vec d = direction(x, y);
        const float scale = 1 / length(d);
        return {d.x * scale, d.y * scale, d.z * scale};
    }

    float plane_depth(int x, int y, int tx, int ty) const;
    bool hides(int x, int y, int tx, int ty) const;
    float facing_square(int x, int y) const;
    bool rim_of(int x, int y, float& offset_x, float& offset_y) const;
    bool is_rim(int x, int y, float& offset_x, float& offset_y) const;
    bool ends_here(int x, int y, float& offset_x, float& offset_y) const;
    std::array<int, 2> beyond(int x, int y, Offset offset) const;
    Mark* mark(BandMarks& band, int x, int y, int y0, int y1) const;
    void draw_line(BandMarks& band, int x, int y, Offset offset, int y0, int y1) const;
    void cover(BandMarks& band, int x, int y, Offset offset, int y0, int y1) const;
    bool is_outline(int x, int y, Offset offset) const;
    bool is_thin(int x, int y) const;
    bool ends_before(int x, int y, int tx, int ty) const;
    static bool stands_for(Offset line, Offset border);
    void fetch_early(uint32_t column, uint32_t row) const;
    bool has_line_towards(int x, int y, int dx, int dy) const;
    float drawn_share(int x, int y) const;
    std::array<float, 4> color_below(int x, int y) const;
    std::array<float, 4> color(size_t i) const;
    std::array<float, 3> line_color(size_t i) const;

    const PackImage& image_;
    const RenderOptions& options_;
    const EdgeQuery query_;
    EdgeMap& map_;
    Frame& frame_;
    const int width_, height_;
    const CameraRays rays_;
    float corner_[3], step_x_[3], step_y_[3];
    float pixel_; // a pixel's width at distance 1
};

/// The depth at which the pixel (tx, ty) would meet the tangent plane of what (x, y) shows; that pixel's own depth
/// where the plane is seen too flat to tell.
float Effects::plane_depth(int x, int y, int tx, int ty) const
{
    const size_t i = at(x, y);
    const Vec n = normal(i);
    const float here = dot(n, unit_direction(x, y)), there = dot(n, unit_direction(tx, ty));
    constexpr float kFlat = 0.2f; // of the other angle's sine: the plane passes the eye's rays at nothing like it
    return there * here > kFlat * here * here ? frame_.depth_mm[i] * here / there : frame_.depth_mm[i];
}

/// Whether the surface of (x, y) ends before that of (tx, ty), which lies farther back: neither tangent plane meets the
/// other within half a pixel.
bool Effects::hides(int x, int y, int tx, int ty) const
{
    const size_t i = at(x, y), t = at(tx, ty);
    if (!is_hit(t))
        return true;
    constexpr float kGap = 0.5f; // pixels: nearer surfaces are told apart by their borders
    const float gap = kGap * pixel_ * frame_.depth_mm[i];
    return frame_.depth_mm[t] > plane_depth(x, y, tx, ty) + gap && plane_depth(tx, ty, x, y) > frame_.depth_mm[i] + gap;
}

/// Square of the cosine between ray and normal: falls linearly towards a rim, where it is 0.
float Effects::facing_square(int x, int y) const
{
    const float facing = dot(normal(at(x, y)), unit_direction(x, y));
    return facing * facing;
}

/// The offset to where the surface of (x, y) turns away, if that is near: along the steepest fall of g = (n . v)^2, at
/// the distance g / |grad g|. On a sphere of radius R pixels, g = 1 - (s / R)^2 at s from its middle, so the distance
/// is (R^2 - s^2) / 2 s: right to (R - s)^2 / 2 R.
bool Effects::rim_of(int x, int y, float& offset_x, float& offset_y) const
{
    constexpr float kLargestSquare = 0.75f; // a rim within two pixels of a sphere of four
    const float g = facing_square(x, y);
    if (g > kLargestSquare)
        return false;
    const size_t i = at(x, y);
    const Vec n = normal(i);
    // differences with those neighbours that the surface goes on to
    const auto slope = [&](int dx, int dy) {
        float sum = 0, count = 0;
        for (const int side : {-1, 1}) {
            const int tx = x + side * dx, ty = y + side * dy;
            if (!on_picture(tx, ty) || !is_hit(at(tx, ty)) || frame_.instance[at(tx, ty)] != frame_.instance[i])
                continue;
            constexpr float kAlike = 0.3f; // cosine: a rim's normals turn quickly, a border's jump
            if (std::abs(frame_.depth_mm[at(tx, ty)] - frame_.depth_mm[i]) >
                    8 * pixel_ * frame_.depth_mm[i] / std::sqrt(std::max(g, 1e-4f)) ||
                dot(n, normal(at(tx, ty))) < kAlike)
                continue;
            sum += float(side) * (facing_square(tx, ty) - g);
            count += 1;
        }
        return count > 0 ? sum / count : 0.0f;
    };
    const float gx = slope(1, 0), gy = slope(0, 1);
    const float square = gx * gx + gy * gy;
    if (!(square > 1e-8f))
        return false;
    const float c = std::sqrt(1 - g), scale = 2 * c * (1 - c) / square;
    offset_x = -scale * gx;
    offset_y = -scale * gy;
    return true;
}

/// The offset to a rim within reach, beyond which something farther back is seen.
bool Effects::is_rim(int x, int y, float& offset_x, float& offset_y) const
{
    if (!rim_of(x, y, offset_x, offset_y))
        return false;
    const float square = offset_x * offset_x + offset_y * offset_y;
    if (square > query_.border_reach_px * query_.border_reach_px)
        return false;
    const auto [tx, ty] = beyond(x, y, {offset_x, offset_y, 1});
    if (!on_picture(tx, ty))
        return false;
    constexpr float kGap = 2; // pixels
    const size_t t = at(tx, ty);
    return !is_hit(t) || frame_.depth_mm[t] > frame_.depth_mm[at(x, y)] * (1 + kGap * pixel_);
}

/// Half a pixel towards neighbours that this surface hides: where a surface ends and neither a border nor a rim says
/// more exactly where, as on fillets of less than a pixel or two.
bool Effects::ends_here(int x, int y, float& offset_x, float& offset_y) const
{
    const float depth = frame_.depth_mm[at(x, y)];
    const auto ends = [&](int dx, int dy) {
        const int tx = x + dx, ty = y + dy;
        return on_picture(tx, ty) && frame_.depth_mm[at(tx, ty)] > depth * (1 + pixel_) && hides(x, y, tx, ty);
    };
    const int dx = int(ends(1, 0)) - int(ends(-1, 0)), dy = int(ends(0, 1)) - int(ends(0, -1));
    if (dx == 0 && dy == 0)
        return false;
    // both: the line through the middles of two sides
    const float half = dx != 0 && dy != 0 ? 0.25f : 0.5f;
    offset_x = half * float(dx);
    offset_y = half * float(dy);
    return true;
}

/// Notes rims and ends of surfaces among the borders, where no border is an outline already, or a rim is nearer, or the
/// border has its line anyway.
void Effects::find_rims(uint32_t band)
{
    const int y1 = std::min(int(band + 1) * int(kBandRows), height_);
    for (int y = int(band * kBandRows); y < y1; ++y)
        for (int x = 0; x < width_; ++x) {
            if (!is_hit(at(x, y)))
                continue;
            const size_t packet = map_.packet_of(uint32_t(x), uint32_t(y));
            uint32_t& word = map_.border[map_.word_of(uint32_t(x), uint32_t(y))];
            const bool near = (map_.near[packet] & kNearBorder) != 0;
            Offset border{0, 0, 0};
            if (near && word != 0)
                border = offset_of(word);
            const auto [bx, by] = beyond(x, y, border);
            const bool outlined = border.strength > 0 && on_picture(bx, by) && hides(x, y, bx, by);
            float ox = 0, oy = 0;
            const bool rim = is_rim(x, y, ox, oy);
            const bool has_line =
                (map_.near[packet] & kNearLine) != 0 && map_.line[map_.word_of(uint32_t(x), uint32_t(y))] != 0;
            if (outlined && (!rim || (!has_line && std::hypot(ox, oy) >= border.length())))
                continue;
            if (!rim && !ends_here(x, y, ox, oy))
                continue;
            // a strip of about a pixel between a border and a rim comes and goes along the rim: the border
            // stands for both
            constexpr float kThinnest = 1.3f;
            const bool thin = border.strength > 0 && border.x * ox + border.y * oy < 0 &&
                              border.length() + std::hypot(ox, oy) < kThinnest;
            if (thin) {
                word = thin_word(word);
                continue;
            }
            if (!near) {
                std::fill_n(&map_.border[16 * packet], 16, 0u);
                map_.near[packet] |= kNearBorder;
            }
            word = word_of(ox, oy);
        }
}

Mark* Effects::mark(BandMarks& band, int x, int y, int y0, int y1) const
{
    if (y < y0 || y >= y1)
        return nullptr;
    const size_t word = map_.word_of(uint32_t(x), uint32_t(y - y0));
    const size_t packet = word / 16;
    uint32_t& place = band.place[packet];
    if (place == kNone) {
        place = static_cast<uint32_t>(band.packets.size());
        band.packets.push_back(static_cast<uint32_t>(packet));
        band.marks.resize(band.marks.size() + 16);
    }
    return &band.marks[size_t{16} * place + word % 16];
}

/// The first pixel beyond the border at `offset` of (x, y), along the axis nearest to its normal.
std::array<int, 2> Effects::beyond(int x, int y, Offset offset) const
{
    const bool along_x = std::abs(offset.x) > std::abs(offset.y);
    const float o = along_x ? offset.x : offset.y;
    const float axis = (offset.x * offset.x + offset.y * offset.y) / std::max(std::abs(o), 1e-6f);
    const int s = (int(axis) + 1) * (o < 0 ? -1 : 1);
    return {along_x ? x + s : x, along_x ? y : y + s};
}

/// Whether beyond this border nothing borders on it, so that it hides what lies behind.
bool Effects::is_outline(int x, int y, Offset offset) const
{
    const auto [tx, ty] = beyond(x, y, offset);
    return on_picture(tx, ty) && ends_before(x, y, tx, ty);
}

bool Effects::is_thin(int x, int y) const
{
    return (map_.near[map_.packet_of(uint32_t(x), uint32_t(y))] & kNearBorder) != 0 &&
           is_thin_word(map_.border[map_.word_of(uint32_t(x), uint32_t(y))]);
}

/// As hides, or (tx, ty) is of a strip that lines at its border stand for.
bool Effects::ends_before(int x, int y, int tx, int ty) const
{
    return hides(x, y, tx, ty) || is_thin(tx, ty);
}

/// Whether a hit's own line lies on that side of its middle.
bool Effects::has_line_towards(int x, int y, int dx, int dy) const
{
    if ((map_.near[map_.packet_of(uint32_t(x), uint32_t(y))] & kNearLine) == 0)
        return false;
    const uint32_t word = map_.line[map_.word_of(uint32_t(x), uint32_t(y))];
    if (word == 0)
        return false;
    const Offset line = offset_of(word);
    return line.x * float(dx) + line.y * float(dy) > 0;
}

/// The share of (x, y) that its own line has in the frame as it was traced.
float Effects::drawn_share(int x, int y) const
{
    if (!map_.own_halves_drawn || (map_.near[map_.packet_of(uint32_t(x), uint32_t(y))] & kNearLine) == 0)
        return 0;
    const uint32_t word = map_.line[map_.word_of(uint32_t(x), uint32_t(y))];
    return word != 0 ? own_line_share(word, options_.edge_width_px) : 0.0f;
}

/// The colour that (x, y) would have without its own line; its own colour where the line covers all of it.
std::array<float, 4> Effects::color_below(int x, int y) const
{
    const size_t i = at(x, y);
    std::array<float, 4> rgba = color(i);
    const float share = drawn_share(x, y);
    if (share > 0 && share < 1) {
        const std::array<float, 3> line = line_color(i);
        for (size_t c = 0; c < 3; ++c)
            rgba[c] = (rgba[c] - share * line[c]) / (1 - share);
    }
    return rgba;
}

/// The line along the border at `offset` of (x, y): this pixel's share, and beyond an outline the other half.
void Effects::draw_line(BandMarks& band, int x, int y, Offset offset, int y0, int y1) const
{
    const size_t i = at(x, y);
    const float width = options_.edge_width_px, distance = offset.length();
    const auto raise = [&](int tx, int ty, float alpha) {
        const float drawn = drawn_share(tx, ty);
        // of equal lines the first has the pixel, in the order of packets
        const bool first = map_.word_of(uint32_t(x), uint32_t(y)) < map_.word_of(uint32_t(tx), uint32_t(ty));
        const bool stronger = alpha > drawn || (alpha == drawn && alpha > 0 && first);
        Mark* const m = stronger ? mark(band, tx, ty, y0, y1) : nullptr;
        if (m && alpha > m->line) {
            __builtin_prefetch(&frame_.rgba[4 * at(tx, ty)]);
            m->line = alpha;
            m->line_from = static_cast<uint32_t>(i);
        }
    };
    if (!map_.own_halves_drawn)
        raise(x, y, line_coverage(distance, width) * offset.strength);
    if (!(distance > 0))
        return;
    // beyond an outline: along each axis that the border's normal leans to, or steps of a slanting line are missed
    constexpr float kLean = 0.4f;
    constexpr float kUnsure = 0.3f; // pixels: so far within the border a pixel may show what lies beyond
    const auto walk = [&](float o, int dx, int dy) {
        const float per_step = std::abs(o) / distance; // towards the border
        if (per_step < kLean)
            return;
        bool hidden = false; // what is beyond
        for (int s = 1;; ++s) {
            const float past = float(s) * per_step - distance;
            if (past >= line_reach(width))
                return;
            if (past < -kUnsure)
                continue;
            const int tx = x + s * dx, ty = y + s * dy;
            if (!on_picture(tx, ty))
                return;
            if (!hidden && has_line_towards(tx, ty, -dx, -dy))
                return; // the other face's half
            if (!hidden && !ends_before(x, y, tx, ty)) {
                if (past < 0)
                    continue;
                return;
            }
            hidden = true;
            raise(tx, ty, line_coverage(std::abs(past), width) * offset.strength);
        }
    };
    walk(offset.x, offset.x < 0 ? -1 : 1, 0);
    walk(offset.y, 0, offset.y < 0 ? -1 : 1);
}

/// The shares of two neighbouring pixels' surfaces where a border passes between their middles. Source: Persson 2011,
/// geometry buffer anti-aliasing: along the axis nearest to the border's normal, a border d pixels from a pixel's
/// middle leaves it 1/2 + d, and takes d - 1/2 of the next.
void Effects::cover(BandMarks& band, int x, int y, Offset offset, int y0, int y1) const
{
    const bool along_x = std::abs(offset.x) > std::abs(offset.y);
    const float o = along_x ? offset.x : offset.y;
    if (o == 0)
        return;
    const float axis = (offset.x * offset.x + offset.y * offset.y) / std::abs(o);
    if (axis >= 1)
        return;
    const int k = o < 0 ? -1 : 1, tx = along_x ? x + k : x, ty = along_x ? y : y + k;
    if (!on_picture(tx, ty))
        return;
    const size_t i = at(x, y), t = at(tx, ty);
    const auto raise = [&](int mx, int my, float share, size_t from) {
        Mark* const m = mark(band, mx, my, y0, y1);
        if (m && share > m->cover) {
            m->cover = share;
            m->cover_from = static_cast<uint32_t>(from);
        }
    };
    if (axis < 0.5f) {
        if (!same_face(i, t) || hides(x, y, tx, ty))
            raise(x, y, 0.5f - axis, t);
    } else if (hides(x, y, tx, ty)) {
        raise(tx, ty, axis - 0.5f, i);
    }
}

std::array<float, 4> Effects::color(size_t i) const
{
    if (!options_.fill)
        return {0, 0, 0, 0};
    return {frame_.rgba[4 * i], frame_.rgba[4 * i + 1], frame_.rgba[4 * i + 2], frame_.rgba[4 * i + 3]};
}

/// The colour of the lines of pixel i's face.
std::array<float, 3> Effects::line_color(size_t i) const
{
    if (options_.edge_color)
        return *options_.edge_color;
    if (!options_.fill || !is_hit(i))
        return kDarkLine;
    return line_color_on(image_, options_, uint32_t(frame_.face[i]), uint32_t(frame_.instance[i]));
}

/// Whether a line within a pixel runs along the border, so that it is its outline too: a fillet's rim beside its
/// border.
bool Effects::stands_for(Offset line, Offset border)
{
    const float a = line.length(), b = border.length();
    constexpr float kAlong = 0.7f; // cosine
    return a < 1 && std::abs(line.x * border.x + line.y * border.y) > kAlong * a * b;
}

/// Asks the caches for what drawing a packet reads: the frame went past them to memory.
void Effects::fetch_early(uint32_t column, uint32_t row) const
{
    const size_t packet = size_t{row} * map_.columns + column;
    if (!map_.line.empty())
        __builtin_prefetch(&map_.line[16 * packet]);
    if (!map_.border.empty())
        __builtin_prefetch(&map_.border[16 * packet]);
    for (uint32_t y = 4 * row; y < std::min(4 * row + 4, frame_.height); ++y) {
        const size_t i = at(int(4 * column), int(y));
        __builtin_prefetch(&frame_.rgba[4 * i]);
        __builtin_prefetch(&frame_.face[i]);
        __builtin_prefetch(&frame_.instance[i]);
        __builtin_prefetch(&frame_.depth_mm[i]);
        __builtin_prefetch(&frame_.normal[3 * i]);
    }
}

/// The pixels of a band whose colours change, in the order of their packets.
std::vector<Painted> Effects::paint(uint32_t band_index) const
{
    const int y0 = int(band_index * kBandRows), y1 = std::min(y0 + int(kBandRows), height_);
    BandMarks band;
    band.place.assign(size_t{map_.columns} * (kBandRows / 4), kNone);
    // lines and covers reach into the band from beside it
    const int halo = int(line_reach(options_.edge_width_px) * 1.5f) + 2;
    const uint32_t first_row = uint32_t(std::max(y0 - halo, 0)) / 4,
                   last_row = uint32_t(std::min(y1 + halo, height_) - 1) / 4;
    for (uint32_t row = first_row; row <= last_row; ++row)
        for (uint32_t column = 0; column < map_.columns; ++column) {
            const size_t packet = size_t{row} * map_.columns + column;
            constexpr uint32_t kAhead = 6; // packets: memory takes as long as so many are worked on
            if (!map_.own_halves_drawn && column + kAhead < map_.columns && map_.near[packet + kAhead] != 0)
                fetch_early(column + kAhead, row);
            const uint8_t near = map_.near[packet];
            if (near == 0)
                continue;
            for (uint32_t i = 0; i < 16; ++i) {
                const int x = int(4 * column + i % 4), y = int(4 * row + i / 4);
                const uint32_t border = (near & kNearBorder) != 0 ? map_.border[16 * packet + i] : 0;
                const uint32_t line = (near & kNearLine) != 0 ? map_.line[16 * packet + i] : 0;
                if (line != 0)
                    draw_line(band, x, y, offset_of(line), y0, y1);
                if (border == 0 || is_thin_word(border))
                    continue;
                const Offset offset = offset_of(border);
                if (options_.silhouettes && !(line != 0 && stands_for(offset_of(line), offset)) &&
                    is_outline(x, y, offset))
                    draw_line(band, x, y, offset, y0, y1);
                if (options_.antialias_trims)
                    cover(band, x, y, offset, y0, y1);
            }
        }
    std::vector<Painted> painted;
    painted.reserve(band.marks.size() / 2);
    for (size_t place = 0; place < band.packets.size(); ++place)
        for (uint32_t i = 0; i < 16; ++i) {
            const Mark& m = band.marks[16 * place + i];
            const uint32_t packet = band.packets[place];
            if (m.cover_from == kNone && m.line_from == kNone)
                continue;
            const int x = int(4 * (packet % map_.columns) + i % 4), y = y0 + int(4 * (packet / map_.columns) + i / 4);
            // straight alpha: colours are mixed by the alpha that they bring
            std::array<float, 4> rgba = color_below(x, y);
            const auto mix = [&rgba](const std::array<float, 4>& other, float share) {
                const float own = (1 - share) * rgba[3], added = share * other[3], alpha = own + added;
                for (size_t c = 0; c < 3; ++c)
                    rgba[c] = alpha > 0 ? (own * rgba[c] + added * other[c]) / alpha : 0.0f;
                rgba[3] = alpha;
            };
            if (m.cover_from != kNone)
                mix(color(m.cover_from), m.cover);
            if (m.line_from != kNone) {
                const std::array<float, 3> drawn = line_color(m.line_from);
                mix({drawn[0], drawn[1], drawn[2], 1}, m.line);
            }
            painted.push_back({static_cast<uint32_t>(at(x, y)), rgba});
        }
    return painted;
}

void Effects::apply(uint32_t band, const std::vector<Painted>& painted) const
{
    if (!options_.fill) {
        const size_t first = size_t{band} * kBandRows * frame_.width;
        const size_t last = std::min(first + size_t{kBandRows} * frame_.width, frame_.face.size());
        std::fill(frame_.rgba.begin() + std::ptrdiff_t(4 * first), frame_.rgba.begin() + std::ptrdiff_t(4 * last),
                  0.0f);
    }
    for (const Painted& pixel : painted)
        std::copy(pixel.rgba.begin(), pixel.rgba.end(), &frame_.rgba[size_t{4} * pixel.pixel]);
}

} // namespace

EdgeQuery edge_query(const RenderOptions& options)
{
    EdgeQuery query;
    if (options.edges != EdgeLines::None) {
        query.line_classes = 1u << kEdgeSharp | 1u << kEdgeFree;
        if (options.edges == EdgeLines::All)
            query.line_classes |= 1u << kEdgeSmooth;
        query.line_width_px = options.edge_width_px;
        // a pixel beyond an outline learns of the line from one within, up to a pixel from the border
        query.line_reach_px = std::max(line_reach(options.edge_width_px), 1.0f);
    }
    if (options.silhouettes)
        query.border_reach_px = std::max(line_reach(options.edge_width_px), 1.0f);
    else if (options.antialias_trims)
        query.border_reach_px = 1;
    return query;
}

bool own_halves_alone(const RenderOptions& options)
{
    const EdgeQuery query = edge_query(options);
    return query.line_reach_px > 0 && query.border_reach_px == 0 && options.fill;
}

float own_line_share(uint32_t word, float width_px)
{
    const Offset offset = offset_of(word);
    return line_coverage(offset.length(), width_px) * offset.strength;
}

std::array<float, 3> line_color_on(const PackImage& image, const RenderOptions& options, uint32_t face,
                                   uint32_t instance)
{
    if (options.edge_color)
        return *options.edge_color;
    const FaceRecord& record = image.faces[face];
    uint32_t rgba = image.instances[instance].color_rgba;
    if ((record.flags & kFaceHasColor) != 0)
        rgba = record.color_rgba;
    else if (rgba >> 24 == 0)
        return kDarkLine; // the default grey is light
    const std::array<float, 256>& linear = linear_of_byte();
    const float luminance =
        0.2126f * linear[rgba & 0xffu] + 0.7152f * linear[rgba >> 8 & 0xffu] + 0.0722f * linear[rgba >> 16 & 0xffu];
    constexpr float kDarkFace = 0.045f; // sRGB 59 of 255
    return luminance < kDarkFace ? kLightLine : kDarkLine;
}

bool has_effects(const RenderOptions& options)
{
    return options.shade && (edge_query(options).any() || !options.fill);
}

Status check_effects(const RenderOptions& options)
{
    if (!(options.edge_width_px > 0 && options.edge_width_px <= kLargestEdgeWidthPx))
        return Error{ErrorCode::Usage, "--edge-width",
                     fmt::format("expected pixels in (0, {}], found {}", kLargestEdgeWidthPx, options.edge_width_px)};
    return Done{};
}

void EdgeMap::resize(uint32_t width, uint32_t height, const EdgeQuery& query)
{
    columns = (width + 3) / 4;
    rows = (height + 3) / 4;
    near.resize(size_t{columns} * rows);
    line.resize(query.line_reach_px > 0 ? 16 * near.size() : 0);
    border.resize(query.border_reach_px > 0 ? 16 * near.size() : 0);
}

void draw_effects(const PackImage& image, const RenderOptions& options, const RunEach& run_each, EdgeMap& map,
                  Frame& frame)
{
    Effects effects(image, options, map, frame);
    const uint32_t bands = effects.band_count();
    if (edge_query(options).border_reach_px > 0)
        run_each(bands, [&](uint32_t band) { effects.find_rims(band); });
    // colours are read beside a band as they were traced: all are worked out before the first is written
    std::vector<std::vector<Painted>> painted(bands);
    if (edge_query(options).any())
        run_each(bands, [&](uint32_t band) { painted[band] = effects.paint(band); });
    run_each(bands, [&](uint32_t band) { effects.apply(band, painted[band]); });
}

} // namespace trimray
