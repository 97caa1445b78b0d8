// Random rational patches, folded, cusped, narrow, flat, degenerate and doubled, seen along tangents and at borders:
// how often the CPU tracer is wrong by the reference. The tool `random_patches` draws as many as one likes and makes
// those that fail smaller.
#include "tests/hard/random_patches.h"

#include <utility>

namespace trimray::hard {
namespace {

constexpr uint32_t kSeed = 1, kPatchesPerShape = 216; // three pictures of 64 rays each

/// What falls short, in rays a million: at most so many.
struct Bounds {
    double false_misses, false_hits, certified_wrong, depths_off, normals_off;
};

struct Share {
    Shape shape;
    Bounds weights_alike, weights_apart; // within a factor of 4 or all 1; 1e-3 to 1e3
};

std::ostream& operator<<(std::ostream& out, const Share& share)
{
    return out << kShapeNames[size_t(share.shape)];
}

class random_patches : public testing::TestWithParam<Share> {};

TEST_P(random_patches, are_traced_wrong_as_seldom_as_stated)
{
    std::vector<uint32_t> numbers;
    for (uint32_t k = 0; k < kPatchesPerShape; ++k)
        numbers.push_back(uint32_t(GetParam().shape) + k * kShapeCount);
    const auto tallies = tally_patches(kSeed, numbers);
    bool shown = false; // an example: one alone, for making it smaller takes a while
    for (const bool apart : {false, true}) {
        Tally all;
        std::vector<uint32_t> counted;
        for (uint32_t k = 0; k < kPatchesPerShape; ++k) {
            if ((weighting_of(numbers[k]) == Weighting::Wide) != apart)
                continue;
            counted.push_back(k);
            for (const Tally& tally : tallies[k])
                all.add(tally);
        }
        const auto example = [&](Tally::Count count) -> std::string {
            for (const uint32_t k : counted)
                for (size_t aim = 0; aim < kAimCount; ++aim)
                    if (tallies[k][aim][count] > 0)
                        return std::exchange(shown, true)
                                   ? ""
                                   : literal_of(shrink(draw_patch(kSeed, numbers[k])[aim], count));
            return "";
        };
        std::cout << (apart ? "weights apart:" : "weights alike:");
        const auto expect_at_most = [&](Tally::Count count, double bound) {
            std::cout << " " << kCountNames[count] << " " << all.per_million(count);
            EXPECT_LE(all.per_million(count), bound) << kCountNames[count] << "\n" << example(count);
        };
        const Bounds& bounds = apart ? GetParam().weights_apart : GetParam().weights_alike;
        EXPECT_GT(all[Tally::Hits], all[Tally::Rays] / 3);
        expect_at_most(Tally::NotFinite, 0);
        expect_at_most(Tally::Open, 0);
        expect_at_most(Tally::WrongFaces, 0);
        expect_at_most(Tally::FalseMisses, bounds.false_misses);
        expect_at_most(Tally::FalseHits, bounds.false_hits);
        expect_at_most(Tally::CertifiedWrong, bounds.certified_wrong);
        expect_at_most(Tally::DepthsOff, bounds.depths_off);
        expect_at_most(Tally::NormalsOff, bounds.normals_off);
        std::cout << "\n";
    }
}

// as measured, and two rays more but for false misses and what is certified, of which there is none
INSTANTIATE_TEST_SUITE_P(shapes, random_patches,
                         testing::Values(Share{Shape::Hills, {0, 110, 0, 75, 75}, {0, 150, 0, 150, 580}},
                                         Share{Shape::Folded, {0, 75, 0, 75, 75}, {0, 220, 0, 150, 150}},
                                         Share{Shape::Cusped, {0, 75, 0, 75, 75}, {0, 150, 0, 150, 150}},
                                         Share{Shape::Needle, {0, 110, 0, 75, 110}, {0, 150, 0, 150, 550}},
                                         Share{Shape::Flat, {0, 75, 0, 75, 75}, {0, 150, 0, 150, 150}},
                                         Share{Shape::Degenerate, {0, 75, 0, 75, 220}, {0, 150, 0, 150, 150}},
                                         Share{Shape::Coincident, {0, 75, 0, 75, 75}, {0, 150, 0, 150, 150}}));

TEST(shrink, comes_to_the_simplest_patch_that_is_still_hit)
{
    for (uint32_t number = 0; number < kShapeCount; ++number) {
        const RandomPatch patch = shrink(draw_patch(kSeed, number)[size_t(Aim::Inside)], Tally::Hits);
        EXPECT_EQ(patch.degree_u, 1) << literal_of(patch);
        EXPECT_EQ(patch.degree_v, 1) << literal_of(patch);
        EXPECT_EQ(patch.weighting, Weighting::None) << literal_of(patch);
        EXPECT_NE(patch.shape, Shape::Coincident) << literal_of(patch);
        EXPECT_EQ(patch.sight.pixels, 1u) << literal_of(patch);
    }
}

} // namespace
} // namespace trimray::hard
