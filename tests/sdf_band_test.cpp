// The band of distance textures over real models: outside it no sign is wrong, and distances keep within it.
#include "format/derive.h"
#include "format/derive_kd.h"
#include "format/trim_reference.h"
#include "format/trim_texture.h"
#include "preprocess/build_pack.h"
#include "preprocess/import/cad_import.h"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <random>
#include <string>

namespace trimray {
namespace {

struct Count {
    std::atomic<uint64_t> asked = 0, decided = 0, wrong = 0, measured = 0, off = 0;
};

/// A point of a face: half of them anywhere, half within two texels of a piece.
struct Point {
    float u, v;
};
Point random_point(const PackImage& image, const FaceRecord& face, std::mt19937& rng)
{
    std::uniform_real_distribution<double> uniform(0, 1);
    double u = uniform(rng), v = uniform(rng);
    if (rng() % 2 == 0) {
        const uint word = image.trim_pieces[face.first_piece + rng() % face.piece_count];
        const MonotonePiece piece = load_piece(image.trim_points.data(), face.first_point, word);
        const SampleGrid grid = texel_grid(face);
        u = bezier3(piece.u, u) + (4 * uniform(rng) - 2) * grid.du;
        v = bezier3(piece.v, v) + (4 * uniform(rng) - 2) * grid.dv;
    }
    return {std::clamp(static_cast<float>(u), 0.0f, kUvBelowOne), std::clamp(static_cast<float>(v), 0.0f, kUvBelowOne)};
}

/// Signs at `points` points over the trimmed faces, the same number on each; distances at every three hundredth.
void ask(const PackImage& image, const TrimReference& reference, uint64_t points, Count& count)
{
    std::vector<uint> trimmed;
    for (uint f = 0; f < image.faces.size(); ++f)
        if (image.faces[f].sdf_size != 0)
            trimmed.push_back(f);
    ASSERT_FALSE(trimmed.empty());
    const uint64_t each = points / trimmed.size() + 1;
    tbb::parallel_for(size_t{0}, trimmed.size(), [&](size_t n) {
        const uint f = trimmed[n];
        const FaceRecord& face = image.faces[f];
        const bool measured = face.extent_mm[0] > 0 && face.extent_mm[1] > 0;
        const double texel = face.sdf_texel_mm;
        const UvMap to_texels{(measured ? static_cast<double>(face.extent_mm[0]) : 1) / texel, 0, 0,
                              (measured ? static_cast<double>(face.extent_mm[1]) : 1) / texel};
        std::mt19937 rng(f + 1);
        for (uint64_t i = 0; i < each; ++i) {
            const Point p = random_point(image, face, rng);
            const double b = texture_distance(image, face, p.u, p.v);
            const bool decided = std::abs(b) > face.sdf_band_texels;
            ++count.asked;
            count.decided += decided;
            const bool measures = i % 300 == 0;
            if (!decided && !measures)
                continue;
            const bool inside = reference.inside(f, p.u, p.v);
            count.wrong += decided && inside != (b >= 0);
            if (!measures)
                continue;
            const double d = reference.distance(f, p.u, p.v, to_texels) * (inside ? 1 : -1);
            // B is cut to what a texel can say
            const double cut = std::clamp<double>(d, -128 * kSdfTexelQuantum, 127 * kSdfTexelQuantum);
            ++count.measured;
            count.off += std::abs(b - cut) > face.sdf_band_texels;
        }
    });
}

TEST(sdf_band, holds_at_ten_million_points_of_real_faces)
{
    const char* const kModels[] = {"NIST_MBE_PMI_3.stp", "abc_00000050.step",       "io1-cm-214.stp",
                                   "mayo_332_file.stp",  "D150WithGuides_wing.igs", "M6-1x12-countersunk-screw.step"};
    constexpr uint64_t kPoints = 10'000'000;
    Count all;
    for (const char* name : kModels) {
        const Result<CadModel> model = import_cad(std::string(TRIMRAY_TESTS_DIR) + "/models/" + name, {}, {});
        ASSERT_TRUE(model.ok()) << name << ": " << model.error().detail;
        BuildReport report;
        PackImage image = build_pack(*model, {}, report);
        const TrimReference reference(image);
        const double bytes = kd_trim_bytes(image);
        // the default, tiles everywhere, and the paper's
        const std::tuple<double, TrimTextureOptions, double> kForms[] = {
            {1, {}, 0.5}, {8, {}, 0.3}, {1, {TrimSource::Mask, TrimLayout::Square}, 0.2}};
        for (const auto& [share, options, part] : kForms) {
            allocate_trim_memory(image, share * bytes, options);
            derive_sdf(image);
            Count count;
            ask(image, reference, static_cast<uint64_t>(part * kPoints / std::size(kModels)), count);
            EXPECT_EQ(count.wrong, 0u) << name;
            EXPECT_EQ(count.off, 0u) << name << " of " << count.measured;
            if (options.source == TrimSource::Curve) { // a mask leaves thin faces undecided
                EXPECT_GT(count.decided, count.asked / 5) << name << ": the band decides nothing";
            }
            all.asked += count.asked;
            all.measured += count.measured;
        }
    }
    EXPECT_GE(all.asked, kPoints);
    EXPECT_GE(all.measured, kPoints / 300);
}

} // namespace
} // namespace trimray
