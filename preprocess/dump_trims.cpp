#include "preprocess/dump_trims.h"

#include "format/distance_field.h"
#include "format/trim_texture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <vector>

namespace trimray {
namespace {

constexpr int kLongSide = 320; // pixels of a panel
constexpr int kShortSideMin = 40;
constexpr int kMargin = 6;

struct Rgb {
    uint8_t r = 255, g = 255, b = 255;
};

/// A picture with row 0 at the bottom until it is written.
class Picture {
public:
    Picture(int width, int height) : width_(width), height_(height), pixels_(static_cast<size_t>(width) * height) {}

    void set(int x, int y, Rgb color)
    {
        if (x >= 0 && y >= 0 && x < width_ && y < height_)
            pixels_[static_cast<size_t>(y) * width_ + x] = color;
    }

    bool write(const std::filesystem::path& path) const
    {
        std::ofstream file(path, std::ios::binary);
        file << "P6\n" << width_ << " " << height_ << "\n255\n";
        for (int y = height_ - 1; y >= 0; --y)
            file.write(reinterpret_cast<const char*>(pixels_.data() + static_cast<size_t>(y) * width_),
                       3 * static_cast<std::streamsize>(width_));
        return file.good();
    }

private:
    int width_, height_;
    std::vector<Rgb> pixels_;
};

struct DrawnPiece {
    MonotonePiece curve;
    Rgb color;
};

Rgb class_color(uint edge_class)
{
    constexpr Rgb kColors[kEdgeClassCount] = {{0, 0, 0}, {30, 80, 255}, {255, 140, 0}, {200, 0, 200}};
    return kColors[edge_class];
}

/// One panel's place in the picture.
struct Panel {
    Picture& picture;
    int x0, width, height;

    template <class Color>
    void fill(Color color) const
    {
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                picture.set(x0 + x, kMargin + y, color((x + 0.5) / width, (y + 0.5) / height));
    }

    void draw(const std::vector<DrawnPiece>& pieces) const
    {
        for (const auto& [piece, color] : pieces) {
            const double length = std::hypot((piece.u[3] - piece.u[0]) * width, (piece.v[3] - piece.v[0]) * height);
            const int steps = 2 + static_cast<int>(4 * length);
            for (int i = 0; i <= steps; ++i) {
                const double t = static_cast<double>(i) / steps;
                picture.set(x0 + static_cast<int>(std::lround(bezier3(piece.u, t) * (width - 1))),
                            kMargin + static_cast<int>(std::lround(bezier3(piece.v, t) * (height - 1))), color);
            }
            for (const int end : {0, 3}) // where pieces meet
                for (int d = -1; d <= 1; ++d) {
                    const int x = x0 + static_cast<int>(std::lround(piece.u[end] * (width - 1)));
                    const int y = kMargin + static_cast<int>(std::lround(piece.v[end] * (height - 1)));
                    picture.set(x + d, y, {200, 0, 0});
                    picture.set(x, y + d, {200, 0, 0});
                }
        }
    }
};

Rgb cell_color(const PackImage& image, const FaceRecord& face, double u, double v)
{
    const uint columns = face.grid & 0xffffu, rows = face.grid >> 16;
    const uint column = std::min(static_cast<uint>(u * columns), columns - 1);
    const uint row = std::min(static_cast<uint>(v * rows), rows - 1);
    const uint cell = image.cells[face.first_cell + row * columns + column];
    if ((cell & 3u) == kCellIn)
        return {250, 250, 250};
    if ((cell & 3u) == kCellOut)
        return {170, 170, 170};
    uint entries = 1;
    for (const CellEntry* e = image.cell_entries.data() + face.first_entry + (cell >> 2); (e->word & kEntryLast) == 0;
         ++e)
        ++entries;
    const uint8_t shade = static_cast<uint8_t>(230 - std::min(entries, 8u) * 20);
    return (row + column) % 2 == 0 ? Rgb{shade, 240, shade} : Rgb{shade, 225, shade};
}

Rgb distance_color(const PackImage& image, const FaceRecord& face, double u, double v)
{
    const double d = texture_distance(image, face, u, v);
    const double dim = std::abs(d) <= face.sdf_band_texels ? 0.75 : 1.0;
    const double level = dim * (255 - 80 * std::min(std::abs(d), 2.0)), base = dim * 255;
    const auto byte = [](double value) { return static_cast<uint8_t>(std::clamp(value, 0.0, 255.0)); };
    return d >= 0 ? Rgb{byte(base), byte(level), byte(0.5 * level)} : Rgb{byte(0.5 * level), byte(level), byte(base)};
}

bool dump_face(const PackImage& image, const FaceRecord& face, const std::filesystem::path& path)
{
    std::vector<MonotonePiece> pieces;
    std::vector<DrawnPiece> drawn;
    for (uint i = 0; i < face.piece_count; ++i) {
        const uint word = image.trim_pieces[face.first_piece + i];
        pieces.push_back(load_piece(image.trim_points.data(), face.first_point, word));
        drawn.push_back({pieces.back(), class_color(word >> kPieceClassShift & (kEdgeClassCount - 1))});
    }
    const double u_mm = std::max(face.extent_mm[0], 1e-30f), v_mm = std::max(face.extent_mm[1], 1e-30f);
    const double scale = kLongSide / std::max(u_mm, v_mm);
    const int width = std::max(kShortSideMin, static_cast<int>(std::lround(scale * u_mm)));
    const int height = std::max(kShortSideMin, static_cast<int>(std::lround(scale * v_mm)));
    const int panels = 1 + 1 + (face.sdf_size != 0 ? 1 : 0);
    Picture picture(panels * (width + kMargin) + kMargin, height + 2 * kMargin);

    const Panel cells{picture, kMargin, width, height};
    if (face.grid != 0)
        cells.fill([&](double u, double v) { return cell_color(image, face, u, v); });
    cells.draw(drawn);

    const TrimMask inside = scan_convert(pieces, pixel_centres(static_cast<uint>(width), static_cast<uint>(height)));
    const Panel mask{picture, 2 * kMargin + width, width, height};
    mask.fill([&](double u, double v) {
        const bool in = inside.inside[static_cast<size_t>(v * height) * width + static_cast<size_t>(u * width)] != 0;
        return in ? Rgb{255, 255, 255} : Rgb{60, 60, 60};
    });
    if (face.sdf_size != 0) {
        const Panel distance{picture, 3 * kMargin + 2 * width, width, height};
        distance.fill([&](double u, double v) { return distance_color(image, face, u, v); });
        distance.draw(drawn);
    }
    return picture.write(path);
}

} // namespace

Status dump_trims(const PackImage& image, const std::string& directory)
{
    const std::filesystem::path folder(directory);
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    std::ofstream index(folder / "index.txt");
    index
        << "face part name pieces loops grid_columns grid_rows entries sdf_width sdf_height band_texels natural open\n";
    for (size_t f = 0; f < image.faces.size(); ++f) {
        const FaceRecord& face = image.faces[f];
        index << fmt::format("{} {} \"{}\" {} {} {} {} {} {} {} {:.3f} {} {}\n", f, face.part,
                             image.strings.strings[face.name], face.piece_count, face.loop_count, face.grid & 0xffffu,
                             face.grid >> 16, face.entry_count, face.sdf_size & 0xffffu, face.sdf_size >> 16,
                             face.sdf_band_texels, (face.flags & kFaceNaturalBorder) != 0 ? 1 : 0,
                             (face.flags & kFaceOpenLoop) != 0 ? 1 : 0);
        const std::filesystem::path path = folder / fmt::format("face_{:06}.ppm", f);
        if (face.piece_count != 0 && !dump_face(image, face, path))
            return Error{ErrorCode::FileNotWritable, path.string(), "the picture could not be written"};
    }
    index.flush();
    if (!index.good())
        return Error{ErrorCode::FileNotWritable, (folder / "index.txt").string(),
                     "the list of faces could not be written"};
    return Done{};
}

} // namespace trimray
