// The CPU tracer's trim decisions, in lanes, against crossing counts in double.
#include "format/derive.h"
#include "runtime/cpu_trim.h"
#include "tests/trim_shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

HWY_BEFORE_NAMESPACE();
namespace trimray {
namespace HWY_NAMESPACE {
namespace {

using namespace shapes;

struct Queries {
    alignas(64) float u[kLanes], v[kLanes];

    real2 uv() const { return real2(load(u), load(v)); }
};

/// Faces of lines and monotone cubics of all slopes and sizes, with cells and textures.
PackImage random_faces(size_t count)
{
    PackImage image;
    const Loop border = polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
    add_face(image, {border, circle(0.5, 0.5, 0.25, 0.25), gear(0.2, 0.2, 0.15, 0.1, 11)});
    add_face(image, {circle(0.5, 0.5, 0.5, 0.5), circle(0.5, 0.5, 0.01, 0.4), star(0.3, 0.5, 0.1, 0.02, 9)});
    add_face(image, {border, circle(0.5, 0.5, 1e-3, 1e-3), circle(0.5, 0.502, 1e-4, 3e-4)});
    add_random_faces(image, count);
    derive_cells(image);
    allocate_trim_memory(image, 40000, {});
    derive_sdf(image);
    return image;
}

/// A packet of points: all over the domain, as close together as a packet's rays, or close to one of the pieces.
Queries random_queries(const std::vector<MonotonePiece>& pieces, std::mt19937& random, int kind)
{
    std::uniform_real_distribution<float> uniform(0, 1);
    Queries q;
    const float u = uniform(random), v = uniform(random), step = std::ldexp(0.1f, -int(random() % 10));
    for (int i = 0; i < kLanes; ++i) {
        q.u[i] = uniform(random);
        q.v[i] = uniform(random);
        if (kind == 1) {
            q.u[i] = u + step * float(i % 4);
            q.v[i] = v + step * float(i / 4);
        } else if (kind == 2) {
            const MonotonePiece& p = pieces[random() % pieces.size()];
            const double t = double(uniform(random));
            q.u[i] = float(bezier3(p.u, t)) + step * 1e-3f * (uniform(random) - 0.5f);
            q.v[i] = float(bezier3(p.v, t)) + step * 1e-3f * (uniform(random) - 0.5f);
        }
        q.u[i] = std::clamp(q.u[i], 0.0f, kUvBelowOne);
        q.v[i] = std::clamp(q.v[i], 0.0f, kUvBelowOne);
    }
    return q;
}

uint inside_bits(const PackImage& image, const KdTrims* kd, TrimMode mode, uint face, const Queries& q, uint asked)
{
    const FetchSource source = fetch_source(image, kd);
    uint64_t curve_tests = 0;
    const mask open = ((integer(asked) >> lane_numbers()) & integer(1u)) != integer(0u);
    return lane_bits(inside_trims(source, mode, face, image.faces[face], q.uv(), open, curve_tests)) & asked;
}

TEST(cpu_trim, decides_as_a_crossing_count_in_double)
{
    const PackImage image = random_faces(40);
    const Result<KdTrims> kd = derive_kd(image);
    ASSERT_TRUE(kd.ok());
    std::mt19937 random(11);
    size_t asked = 0, near = 0;
    for (uint f = 0; f < image.faces.size(); ++f) {
        const std::vector<MonotonePiece> pieces = pieces_of(image, f);
        for (int i = 0; i < 300; ++i) {
            const Queries q = random_queries(pieces, random, i % 3);
            const uint exact = inside_bits(image, &*kd, TrimMode::Exact, f, q, 0xffffu);
            EXPECT_EQ(exact, inside_bits(image, &*kd, TrimMode::Hybrid, f, q, 0xffffu)) << "face " << f;
            const uint by_kd = inside_bits(image, &*kd, TrimMode::Kd, f, q, 0xffffu);
            for (int k = 0; k < kLanes; ++k) {
                const double u = double(q.u[k]), v = double(q.v[k]);
                ++asked;
                const uint expected = uint(exact_inside(pieces, u, v));
                if ((exact >> k & 1u) == expected && (by_kd >> k & 1u) == expected)
                    continue;
                ++near;
                // ulps of uv, and of a piece's extent
                EXPECT_LT(exact_distance(pieces, u, v), 3e-7) << "face " << f << " at " << u << ", " << v;
            }
        }
    }
    EXPECT_GE(asked, 190000u);
    // a third of the points is drawn within 5e-5 to 1e-7 of a piece
    EXPECT_LT(double(near), 0.01 * double(asked));
}

TEST(cpu_trim, a_ray_gets_the_same_answer_in_any_packet)
{
    const PackImage image = random_faces(12);
    const Result<KdTrims> kd = derive_kd(image);
    ASSERT_TRUE(kd.ok());
    std::mt19937 random(5);
    for (uint f = 0; f < image.faces.size(); ++f) {
        const std::vector<MonotonePiece> pieces = pieces_of(image, f);
        for (int i = 0; i < 300; ++i) {
            const Queries q = random_queries(pieces, random, i % 3);
            for (const TrimMode mode : {TrimMode::Exact, TrimMode::Hybrid, TrimMode::Kd}) {
                const uint together = inside_bits(image, &*kd, mode, f, q, 0xffffu);
                uint alone = 0;
                for (int k = 0; k < kLanes; ++k)
                    alone |= inside_bits(image, &*kd, mode, f, q, 1u << k);
                ASSERT_EQ(together, alone) << "face " << f;
            }
        }
    }
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace trimray
HWY_AFTER_NAMESPACE();
