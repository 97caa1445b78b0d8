#include "preprocess/dump_trims.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <vector>

namespace trimray {
namespace {

constexpr int kLongerSide = 512;

struct Picture {
    int width = 0, height = 0;
    std::vector<std::array<unsigned char, 3>> pixels;

    void set(double u, double v, std::array<unsigned char, 3> color)
    {
        const int x = std::clamp(static_cast<int>(u * width), 0, width - 1);
        const int y = std::clamp(static_cast<int>((1 - v) * height), 0, height - 1); // v grows upwards
        pixels[static_cast<size_t>(y) * width + x] = color;
    }
};

/// Stored byte of the texel that holds (u, v); 128 is the border.
int texel(const PackImage& image, const FaceRecord& face, double u, double v)
{
    const int width = static_cast<int>(face.sdf_size & 0xffffu), height = static_cast<int>(face.sdf_size >> 16);
    const int i = std::clamp(static_cast<int>(u * width), 0, width - 1);
    const int j = std::clamp(static_cast<int>(v * height), 0, height - 1);
    const uint words_a_row = (static_cast<uint>(width) + 3) / 4;
    const uint word =
        image.sdf_words[face.sdf_first_word + static_cast<uint>(j) * words_a_row + static_cast<uint>(i) / 4];
    return static_cast<int>(word >> (8 * (i % 4)) & 0xffu);
}

void draw_distances(const PackImage& image, const FaceRecord& face, Picture& picture)
{
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x) {
            const double u = (x + 0.5) / picture.width, v = 1 - (y + 0.5) / picture.height;
            std::array<unsigned char, 3> color{225, 225, 225};
            if (face.sdf_size != 0) {
                const int stored = texel(image, face, u, v);
                const auto shade = static_cast<unsigned char>(255 - std::min(120, std::abs(stored - 128)));
                color = stored >= 128 ? std::array<unsigned char, 3>{90, 130, shade}
                                      : std::array<unsigned char, 3>{shade, shade, shade};
            }
            picture.pixels[static_cast<size_t>(y) * picture.width + x] = color;
        }
}

void draw_pieces(const PackImage& image, const FaceRecord& face, Picture& picture)
{
    for (uint k = 0; k < face.piece_count; ++k) {
        const uint word = image.trim_pieces[face.first_piece + k];
        const float* p = &image.trim_points[2 * (face.first_point + (word >> 2))];
        const bool cubic = (word & kPieceCubic) != 0;
        const int steps = 2 * kLongerSide;
        for (int i = 0; i <= steps; ++i) {
            const double t = static_cast<double>(i) / steps, s = 1 - t;
            const double b[4] = {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
            double uv[2];
            for (int axis = 0; axis < 2; ++axis)
                uv[axis] = cubic ? b[0] * p[axis] + b[1] * p[2 + axis] + b[2] * p[4 + axis] + b[3] * p[6 + axis]
                                 : s * p[axis] + t * p[2 + axis];
            picture.set(uv[0], uv[1], {200, 30, 30});
        }
    }
}

} // namespace

Status dump_trims(const PackImage& image, const std::string& folder)
{
    std::error_code failed;
    std::filesystem::create_directories(folder, failed);
    if (failed)
        return Error{ErrorCode::FileNotWritable, folder, failed.message()};
    for (size_t id = 0; id < image.faces.size(); ++id) {
        const FaceRecord& face = image.faces[id];
        if (face.piece_count == 0)
            continue;
        const double aspect = std::clamp<double>(face.extent_mm[1] / std::max(face.extent_mm[0], 1e-30f), 1.0 / 8, 8.0);
        Picture picture;
        picture.width = std::max(1, static_cast<int>(kLongerSide * std::min(1.0, 1 / aspect)));
        picture.height = std::max(1, static_cast<int>(kLongerSide * std::min(1.0, aspect)));
        picture.pixels.resize(static_cast<size_t>(picture.width) * picture.height);
        draw_distances(image, face, picture);
        draw_pieces(image, face, picture);
        const std::string path = (std::filesystem::path(folder) / fmt::format("face_{}.ppm", id)).string();
        std::ofstream file(path, std::ios::binary);
        file << "P6\n" << picture.width << ' ' << picture.height << "\n255\n";
        file.write(reinterpret_cast<const char*>(picture.pixels.data()),
                   static_cast<std::streamsize>(picture.pixels.size() * 3));
        file.close();
        if (!file)
            return Error{ErrorCode::FileNotWritable, path, std::strerror(errno)};
    }
    return Done{};
}

} // namespace trimray
