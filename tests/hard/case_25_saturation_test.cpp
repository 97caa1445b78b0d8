// Hard case 25: texels of 8 bits that saturate, and bleeding at the domain's border and between textures.
#include "format/derive.h"
#include "format/trim_texture.h"
#include "tests/hard/trim_modes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <tuple>
#include <vector>

namespace trimray::hard {
namespace {

std::vector<std::vector<shapes::Loop>> trims()
{
    const shapes::Loop rim = shapes::polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
    return {{rim, shapes::circle(0.4, 0.45, 0.2, 0.2)},
            {shapes::circle(0.5, 0.5, 0.5, 0.5)},
            {shapes::star(0.5, 0.5, 0.5, 0.2, 7)},
            {rim, shapes::gear(0.5, 0.5, 0.45, 0.35, 15)}};
}

/// Distance and side in texels, cut to what a texel can say.
double true_distance(const FaceRecord& face, const std::vector<MonotonePiece>& pieces, double u, double v)
{
    const double d = shapes::exact_distance(pieces, u, v, face.extent_mm[0] / static_cast<double>(face.sdf_texel_mm),
                                            face.extent_mm[1] / static_cast<double>(face.sdf_texel_mm));
    return std::clamp<double>(shapes::exact_inside(pieces, u, v) ? d : -d, -128 * kSdfTexelQuantum,
                              127 * kSdfTexelQuantum);
}

TEST(case_25, the_bound_holds_at_every_texel_and_along_the_domains_border)
{
    PackImage image;
    for (const auto& loops : trims())
        for (const float extent_v : {10.0f, 3.0f})
            shapes::add_face(image, loops, 10, extent_v);
    // few texels, of which none saturates, and many, most of which do
    const std::tuple<double, TrimTextureOptions> kForms[] = {{4000, {}},
                                                             {40000, {}},
                                                             {4000, {TrimSource::Mask, TrimLayout::Square}},
                                                             {40000, {TrimSource::Mask, TrimLayout::Square}}};
    for (const auto& [bytes, options] : kForms) {
        allocate_trim_memory(image, bytes, options);
        derive_sdf(image);
        size_t saturated = 0;
        for (uint f = 0; f < image.faces.size(); ++f) {
            const FaceRecord& face = image.faces[f];
            const std::vector<MonotonePiece> pieces = shapes::pieces_of(image, f);
            const TextureShape shape = texture_shape(face);
            const SampleGrid grid = texel_grid(face);
            const double steps = std::hypot(face.extent_mm[0] * grid.du, face.extent_mm[1] * grid.dv);
            // at a texel nothing is interpolated
            const double sample_bound = face.sdf_band_texels - 0.5 * steps / face.sdf_texel_mm + 1e-3;
            const uint* words = image.sdf_words.data() + face.sdf_first_word;
            for (uint y = 0; y < shape.height; ++y)
                for (uint x = 0; x < shape.width; ++x) {
                    const uint level = texel_level(shape, words, x, y);
                    saturated += level == 0 || level == 255;
                    ASSERT_NEAR((level - 128.0) * kSdfTexelQuantum,
                                true_distance(face, pieces, grid.u0 + x * grid.du, grid.v0 + y * grid.dv), sample_bound)
                        << "face " << f << ", texel " << x << ", " << y;
                }
            for (int i = 0; i < 200; ++i) {
                const double along = (i + 0.5) / 200;
                for (const auto& [u, v] : {std::pair{along, 0.0},
                                           {along, static_cast<double>(kUvBelowOne)},
                                           {0.0, along},
                                           {static_cast<double>(kUvBelowOne), along}})
                    ASSERT_NEAR(texture_distance(image, face, u, v), true_distance(face, pieces, u, v),
                                face.sdf_band_texels)
                        << "face " << f << " at " << u << ", " << v;
            }
        }
        EXPECT_TRUE(bytes < 10000 || saturated > 10000) << saturated;
    }
}

TEST(case_25, tracers_read_their_own_texture_and_nothing_beside_it)
{
    for (const auto& loops : trims()) {
        TrimmedPlane plane = trimmed_plane(loops);
        auto surrounded = std::make_shared<Scene>(*plane.scene);
        plane.scene = surrounded;
        PackImage& image = surrounded->pack.image;
        image.sdf_words.insert(image.sdf_words.begin(), 100, 0xa53c5ac3u);
        image.sdf_words.insert(image.sdf_words.end(), 100, 0x5ac3a53cu);
        image.faces[0].sdf_first_word += 100;
        const PlaneView view{0.5, 0.5, 0.999, 200};
        const int tested = in_every_trim_mode(plane, {view}, [&](const TrimWay& way, size_t, const TrimErrors& errors) {
            if (way.mode != TrimMode::Sdf)
                return;
            for (uint32_t y = 0; y < view.pixels; ++y)
                for (uint32_t x = 0; x < view.pixels; ++x) {
                    const double u = view.u + ((x + 0.5) / view.pixels - 0.5) * view.size;
                    const double v = view.v + (0.5 - (y + 0.5) / view.pixels) * view.size;
                    const double b = texture_distance(image, image.faces[0], u, v);
                    if (std::abs(b) > 1e-3) {
                        ASSERT_EQ(errors.picture[y * view.pixels + x] != 0, b > 0)
                            << way.name << " at " << u << ", " << v << ": " << b;
                    }
                }
        });
        EXPECT_GE(tested, 3);
    }
}

} // namespace
} // namespace trimray::hard
