#include "runtime/edge_lines.h"

#include <utility>

namespace trimray {

void EdgeMap::resize(uint32_t width, uint32_t height, bool lines, bool borders)
{
    columns = (width + 3) / 4;
    rows = (height + 3) / 4;
    near.assign(size_t{columns} * rows, 0);
    line.resize(lines ? 16 * near.size() : 0);
    border.resize(borders ? 16 * near.size() : 0);
    block_columns = (width + kEdgeBlockSide - 1) / kEdgeBlockSide;
    waiting.resize(size_t{block_columns} * ((height + kEdgeBlockSide - 1) / kEdgeBlockSide));
    for (WaitingLines& block : waiting) {
        block.lines.clear();
        block.marks.clear();
    }
}

int farthest_step(float width)
{
    constexpr float kRounding = 0.02f; // pixels: of a word's offset
    return static_cast<int>((line_reach(width) + line_query_reach(width) + kRounding) / kLeastLean);
}

bool has_light_lines(const FaceColors& colors, uint32_t face, uint32_t instance)
{
    const float* color = colors.of(face, instance);
    const float luminance = 0.2126f * color[0] + 0.7152f * color[1] + 0.0722f * color[2];
    constexpr float kDarkFace = 0.045f; // sRGB 59 of 255
    return luminance < kDarkFace;
}

std::array<float, 3> line_color_at(const FaceColors& colors, const RenderOptions& options, const SeenPixels& pixels,
                                   size_t i)
{
    if (options.edge_color)
        return *options.edge_color;
    if (!options.fill || !pixels.is_hit(i))
        return kDarkLine;
    const bool light = has_light_lines(colors, uint32_t(pixels.face[i]), uint32_t(pixels.instance[i]));
    return light ? kLightLine : kDarkLine;
}

std::array<float, 4> color_below(const FaceColors& colors, const RenderOptions& options, const EdgeMap& map,
                                 const SeenPixels& pixels, int x, int y)
{
    const size_t i = pixels.at(x, y);
    std::array<float, 4> rgba{0, 0, 0, 0};
    if (options.fill)
        std::copy_n(&pixels.rgba[4 * i], 4, rgba.begin());
    const float share = drawn_share(map, options.edge_width_px, x, y);
    if (share > 0 && share < 1) {
        const std::array<float, 3> line = line_color_at(colors, options, pixels, i);
        for (size_t c = 0; c < 3; ++c)
            rgba[c] = (rgba[c] - share * line[c]) / (1 - share);
    }
    return rgba;
}

BlockLineDrawer::BlockLineDrawer(const FaceColors& colors, const RenderOptions& options, EdgeMap& map)
    : colors_(colors), options_(options), map_(map), rays_(options.camera, options.width, options.height),
      farthest_(farthest_step(options.edge_width_px))
{
}

/// Whether no line of another block reaches (x, y).
bool BlockLineDrawer::is_out_of_reach(const SeenPixels& pixels, int x, int y) const
{
    return (pixels.x0 == 0 || x - pixels.x0 >= farthest_) && (pixels.y0 == 0 || y - pixels.y0 >= farthest_) &&
           (pixels.x1 == rays_.width_px || pixels.x1 - x > farthest_) &&
           (pixels.y1 == rays_.height_px || pixels.y1 - y > farthest_);
}

void BlockLineDrawer::draw(const SeenPixels& pixels, BlockMarks& scratch) const
{
    WaitingLines& waiting = map_.waiting[map_.block_of(uint32_t(pixels.x0), uint32_t(pixels.y0))];
    scratch.marks.resize(size_t{kEdgeBlockSide} * kEdgeBlockSide);
    for (const uint32_t packet : scratch.near)
        for (uint32_t from = 16 * packet; from < 16 * (packet + 1); ++from) {
            if (map_.line[from] == 0)
                continue;
            const auto [x, y] = map_.pixel_of(from);
            const auto raise = [&](int tx, int ty, float share) {
                const auto t = uint32_t(ty - pixels.y0) * kEdgeBlockSide + uint32_t(tx - pixels.x0);
                if (scratch.marks[t].from == kNoWord)
                    scratch.touched.push_back(t);
                scratch.marks[t].raise(share, from);
            };
            if (!walk_outer_half(pixels, map_, options_.edge_width_px, x, y, offset_of(map_.line[from]), raise))
                waiting.lines.push_back(from);
        }
    for (const uint32_t t : scratch.touched) {
        const int x = pixels.x0 + int(t % kEdgeBlockSide), y = pixels.y0 + int(t / kEdgeBlockSide);
        const LineMark mark = std::exchange(scratch.marks[t], LineMark{});
        if (!is_out_of_reach(pixels, x, y)) {
            waiting.marks.push_back({uint32_t(map_.word_of(uint32_t(x), uint32_t(y))), mark});
            continue;
        }
        std::array<float, 4> rgba = color_below(colors_, options_, map_, pixels, x, y);
        const auto [fx, fy] = map_.pixel_of(mark.from);
        const std::array<float, 3> line = line_color_at(colors_, options_, pixels, pixels.at(fx, fy));
        mix(rgba, {line[0], line[1], line[2], 1}, mark.share);
        std::copy(rgba.begin(), rgba.end(), &pixels.rgba[4 * pixels.at(x, y)]);
    }
    scratch.touched.clear();
    scratch.near.clear();
}

} // namespace trimray
