#include "runtime/frame_effects.h"

#include "runtime/edge_lines.h"
#include "runtime/materials.h"
#include "runtime/seen_pixels.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace trimray {
namespace {

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

constexpr uint32_t kNone = ~0u;

/// What happens to one pixel.
struct Mark {
    float cover = 0;             // share of the pixel that another pixel's surface has
    uint32_t cover_from = kNone; // that pixel
    LineMark line;
};

struct Painted {
    uint32_t pixel;
    std::array<float, 4> rgba;
};

constexpr uint32_t kAhead = 6; // packets or lines: memory takes as long as so many are worked on

constexpr uint32_t kBandRows = kEdgeBlockSide; // rows that are drawn at once

/// One band's marks, packet by packet where there are any.
struct BandMarks {
    std::vector<uint32_t> place; // in `packets`, by packet of the band; kNone: no marks
    std::vector<uint32_t> packets;
    std::vector<Mark> marks; // 16 a packet
};

class Effects {
public:
    Effects(const FaceColors& colors, const RenderOptions& options, EdgeMap& map, Frame& frame)
        : colors_(colors), options_(options), query_(edge_query(options)), map_(map), frame_(frame),
          width_(int(frame.width)), height_(int(frame.height)),
          rays_(options.camera, frame.width, frame.height), seen_{rays_,
                                                                  0,
                                                                  0,
                                                                  width_,
                                                                  height_,
                                                                  frame.width,
                                                                  frame.rgba.data(),
                                                                  frame.depth_mm.data(),
                                                                  frame.normal.data(),
                                                                  frame.face.data(),
                                                                  frame.instance.data()}
    {
    }

    uint32_t band_count() const { return (frame_.height + kBandRows - 1) / kBandRows; }

    void find_rims(uint32_t band);
    std::vector<Painted> paint(uint32_t band) const;
    void apply(uint32_t band, const std::vector<Painted>& painted) const;

private:
    size_t at(int x, int y) const { return seen_.at(x, y); }
    bool on_picture(int x, int y) const { return seen_.has(x, y); }
    bool is_hit(size_t i) const { return seen_.is_hit(i); }
    bool hides(int x, int y, int tx, int ty) const { return seen_.hides(x, y, tx, ty); }
    Vec normal(size_t i) const { return seen_.normal(i); }

    float facing_square(int x, int y) const;
    bool rim_of(int x, int y, float& offset_x, float& offset_y) const;
    bool is_rim(int x, int y, float& offset_x, float& offset_y) const;
    bool ends_here(int x, int y, float& offset_x, float& offset_y) const;
    std::array<int, 2> beyond(int x, int y, Offset offset) const;
    Mark* mark(BandMarks& band, int x, int y, int y0, int y1) const;
    void draw_outer_half(BandMarks& band, int x, int y, Offset offset, int y0, int y1) const;
    void draw_line(BandMarks& band, int x, int y, Offset offset, int y0, int y1) const;
    void cover(BandMarks& band, int x, int y, Offset offset, int y0, int y1) const;
    bool is_outline(int x, int y, Offset offset) const;
    static bool stands_for(Offset line, Offset border);
    void fetch_early(uint32_t packet) const;
    void draw_all(BandMarks& band, int y0, int y1) const;
    void draw_waiting(BandMarks& band, int y0, int y1) const;
    std::array<float, 4> color(size_t i) const;

    const FaceColors colors_;
    const RenderOptions& options_;
    const EdgeQuery query_;
    EdgeMap& map_;
    Frame& frame_;
    const int width_, height_;
    const PictureRays rays_;
    const SeenPixels seen_;
};

/// Square of the cosine between ray and normal: falls linearly towards a rim, where it is 0.
float Effects::facing_square(int x, int y) const
{
    const float facing = dot(normal(at(x, y)), rays_.unit_direction(x, y));
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
                    8 * rays_.footprint(frame_.depth_mm[i]) / std::sqrt(std::max(g, 1e-4f)) ||
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
    return !is_hit(t) || frame_.depth_mm[t] > rays_.beyond(frame_.depth_mm[at(x, y)], kGap);
}

/// Half a pixel towards neighbours that this surface hides: where a surface ends and neither a border nor a rim says
/// more exactly where, as on fillets of less than a pixel or two.
bool Effects::ends_here(int x, int y, float& offset_x, float& offset_y) const
{
    const float depth = frame_.depth_mm[at(x, y)];
    const auto ends = [&](int dx, int dy) {
        const int tx = x + dx, ty = y + dy;
        return on_picture(tx, ty) && frame_.depth_mm[at(tx, ty)] > rays_.beyond(depth, 1) && hides(x, y, tx, ty);
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

/// Whether beyond this border nothing borders on it, so that it hides what lies behind; a strip that lines at its
/// border stand for is nothing.
bool Effects::is_outline(int x, int y, Offset offset) const
{
    const auto [tx, ty] = beyond(x, y, offset);
    return on_picture(tx, ty) && (hides(x, y, tx, ty) || is_thin_word(map_.border_at(tx, ty)));
}

/// The half of the line along the border at `offset` of (x, y) that lies beyond an outline.
void Effects::draw_outer_half(BandMarks& band, int x, int y, Offset offset, int y0, int y1) const
{
    const auto from = uint32_t(map_.word_of(uint32_t(x), uint32_t(y)));
    walk_outer_half(seen_, map_, options_.edge_width_px, x, y, offset, [&](int tx, int ty, float share) {
        if (Mark* const m = mark(band, tx, ty, y0, y1)) {
            __builtin_prefetch(&frame_.rgba[4 * at(tx, ty)]);
            m->line.raise(share, from);
        }
    });
}

/// This pixel's share of the line along the border at `offset` of (x, y), and beyond an outline the other half.
void Effects::draw_line(BandMarks& band, int x, int y, Offset offset, int y0, int y1) const
{
    const float share = line_coverage(offset.length(), options_.edge_width_px) * offset.strength;
    if (share > 0)
        if (Mark* const m = mark(band, x, y, y0, y1))
            m->line.raise(share, uint32_t(map_.word_of(uint32_t(x), uint32_t(y))));
    draw_outer_half(band, x, y, offset, y0, y1);
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
        if (!seen_.same_face(i, t) || hides(x, y, tx, ty))
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

/// Whether a line within a pixel runs along the border, so that it is its outline too: a fillet's rim beside its
/// border.
bool Effects::stands_for(Offset line, Offset border)
{
    const float a = line.length(), b = border.length();
    constexpr float kAlong = 0.7f; // cosine
    return a < 1 && std::abs(line.x * border.x + line.y * border.y) > kAlong * a * b;
}

/// Asks the caches for what drawing a packet reads: the frame went past them to memory.
void Effects::fetch_early(uint32_t packet) const
{
    if (!map_.line.empty())
        __builtin_prefetch(&map_.line[16 * packet]);
    if (!map_.border.empty())
        __builtin_prefetch(&map_.border[16 * packet]);
    const uint32_t column = packet % map_.columns, row = packet / map_.columns;
    for (uint32_t y = 4 * row; y < std::min(4 * row + 4, frame_.height); ++y) {
        const size_t i = at(int(4 * column), int(y));
        __builtin_prefetch(&frame_.rgba[4 * i]);
        __builtin_prefetch(&frame_.face[i]);
        __builtin_prefetch(&frame_.instance[i]);
        __builtin_prefetch(&frame_.depth_mm[i]);
        __builtin_prefetch(&frame_.normal[3 * i]);
    }
}

/// Marks what the words of the whole map have on pixels of rows [y0, y1).
void Effects::draw_all(BandMarks& band, int y0, int y1) const
{
    // lines and covers reach into the band from beside it
    const int halo = farthest_step(options_.edge_width_px) + 1;
    const uint32_t first_row = uint32_t(std::max(y0 - halo, 0)) / 4,
                   last_row = uint32_t(std::min(y1 + halo, height_) - 1) / 4;
    for (uint32_t packet = first_row * map_.columns; packet < (last_row + 1) * map_.columns; ++packet) {
        if (packet + kAhead < map_.near.size() && map_.near[packet + kAhead] != 0)
            fetch_early(packet + kAhead);
        const uint8_t near = map_.near[packet];
        if (near == 0)
            continue;
        for (uint32_t i = 16 * packet; i < 16 * (packet + 1); ++i) {
            const auto [x, y] = map_.pixel_of(i);
            const uint32_t border = (near & kNearBorder) != 0 ? map_.border[i] : 0;
            const uint32_t line = (near & kNearLine) != 0 ? map_.line[i] : 0;
            if (line != 0)
                draw_line(band, x, y, offset_of(line), y0, y1);
            if (border == 0 || is_thin_word(border))
                continue;
            const Offset offset = offset_of(border);
            if (options_.silhouettes && !(line != 0 && stands_for(offset_of(line), offset)) && is_outline(x, y, offset))
                draw_line(band, x, y, offset, y0, y1);
            if (options_.antialias_trims)
                cover(band, x, y, offset, y0, y1);
        }
    }
}

/// Marks what blocks left to do on pixels of rows [y0, y1).
void Effects::draw_waiting(BandMarks& band, int y0, int y1) const
{
    const int reach = farthest_step(options_.edge_width_px);
    const uint32_t first_row = uint32_t(std::max(y0 - reach, 0)) / kEdgeBlockSide,
                   last_row = uint32_t(std::min(y1 + reach, height_) - 1) / kEdgeBlockSide;
    for (uint32_t row = first_row; row <= last_row; ++row)
        for (uint32_t column = 0; column < map_.block_columns; ++column) {
            const WaitingLines& waiting = map_.waiting[size_t{row} * map_.block_columns + column];
            for (size_t i = 0; i < waiting.lines.size(); ++i) {
                if (i + kAhead < waiting.lines.size())
                    fetch_early(waiting.lines[i + kAhead] / 16);
                const uint32_t from = waiting.lines[i];
                const auto [x, y] = map_.pixel_of(from);
                if (y < y0 - reach || y >= y1 + reach)
                    continue;
                draw_outer_half(band, x, y, offset_of(map_.line[from]), y0, y1);
            }
            for (const WaitingLines::Mark& waits : waiting.marks) {
                const auto [x, y] = map_.pixel_of(waits.word);
                if (Mark* const m = mark(band, x, y, y0, y1))
                    m->line.raise(waits.mark.share, waits.mark.from);
            }
        }
}

/// The pixels of a band whose colours change, in the order of their packets.
std::vector<Painted> Effects::paint(uint32_t band_index) const
{
    const int y0 = int(band_index * kBandRows), y1 = std::min(y0 + int(kBandRows), height_);
    BandMarks band;
    band.place.assign(size_t{map_.columns} * (kBandRows / 4), kNone);
    if (map_.own_halves_drawn)
        draw_waiting(band, y0, y1);
    else
        draw_all(band, y0, y1);
    std::vector<Painted> painted;
    painted.reserve(band.marks.size() / 2);
    for (size_t place = 0; place < band.packets.size(); ++place)
        for (uint32_t i = 0; i < 16; ++i) {
            const Mark& m = band.marks[16 * place + i];
            if (m.cover_from == kNone && m.line.from == kNoWord)
                continue;
            const uint32_t packet = band.packets[place];
            const int x = int(4 * (packet % map_.columns) + i % 4), y = y0 + int(4 * (packet / map_.columns) + i / 4);
            std::array<float, 4> rgba = color_below(colors_, options_, map_, seen_, x, y);
            if (m.cover_from != kNone)
                mix(rgba, color(m.cover_from), m.cover);
            if (m.line.from != kNoWord) {
                const auto [fx, fy] = map_.pixel_of(m.line.from);
                const std::array<float, 3> drawn = line_color_at(colors_, options_, seen_, at(fx, fy));
                mix(rgba, {drawn[0], drawn[1], drawn[2], 1}, m.line.share);
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
        query.line_reach_px = line_query_reach(options.edge_width_px);
    }
    if (options.silhouettes)
        query.border_reach_px = line_query_reach(options.edge_width_px);
    else if (options.antialias_trims)
        query.border_reach_px = 1;
    return query;
}

bool own_halves_alone(const RenderOptions& options)
{
    const EdgeQuery query = edge_query(options);
    return query.line_reach_px > 0 && query.border_reach_px == 0 && options.fill && !has_transparency(options.look);
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

void draw_effects(const FaceColors& colors, const RenderOptions& options, const RunEach& run_each, EdgeMap& map,
                  Frame& frame)
{
    Effects effects(colors, options, map, frame);
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
