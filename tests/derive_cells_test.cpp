// Cells and their query: the same answer as an exact crossing count, wherever the loop is not within rounding.
#include "format/derive.h"
#include "format/derive_kd.h"
#include "format/trim_query.h"
#include "tests/trim_shapes.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

namespace trimray {
namespace {

using namespace shapes;

struct Disagreement {
    size_t wrong_far = 0; // farther than 1e-6 from the loops
    size_t wrong_near = 0;
    size_t asked = 0;
};

/// Random points, points at dyadic parameters, points beside the loops and on the borders of cells.
Disagreement compare(const PackImage& image, uint face, size_t count, uint seed)
{
    const std::vector<MonotonePiece> pieces = pieces_of(image, face);
    const uint columns = image.faces[face].grid & 0xffffu, rows = image.faces[face].grid >> 16;
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> uniform(0, 1);
    Disagreement out;
    for (size_t i = 0; i < count; ++i) {
        float u = uniform(rng), v = uniform(rng);
        switch (i % 6) {
        case 1:
        case 2:
        case 3: {
            const Uv p = telling_point(rng, pieces, i % 6);
            u = p.u;
            v = p.v;
            break;
        }
        case 4: // an ulp or none beside a cell's border
            u = static_cast<float>(rng() % (columns + 1)) / static_cast<float>(columns);
            u = rng() % 3 == 0 ? u : std::nextafter(u, rng() % 2 == 0 ? 0.0f : 1.0f);
            break;
        case 5:
            v = static_cast<float>(rng() % (rows + 1)) / static_cast<float>(rows);
            v = rng() % 3 == 0 ? v : std::nextafter(v, rng() % 2 == 0 ? 0.0f : 1.0f);
            break;
        default:
            break;
        }
        u = std::clamp(u, 0.0f, kUvBelowOne);
        v = std::clamp(v, 0.0f, kUvBelowOne);
        ++out.asked;
        if (trim_inside(image, face, u, v) == exact_inside(pieces, u, v))
            continue;
        (exact_distance(pieces, u, v) > 1e-6 ? out.wrong_far : out.wrong_near) += 1;
    }
    return out;
}

TEST(derive_cells, answers_as_an_exact_crossing_count_does)
{
    PackImage image;
    for (const std::vector<Loop>& loops : named_shapes())
        add_face(image, loops);
    add_random_faces(image, 60);
    derive_cells(image);
    size_t asked = 0, near = 0;
    for (uint f = 0; f < image.faces.size(); ++f) {
        const Disagreement d = compare(image, f, 18000, 100 + f);
        EXPECT_EQ(d.wrong_far, 0u) << "face " << f;
        asked += d.asked;
        near += d.wrong_near;
    }
    EXPECT_GE(asked, 1000000u);
    // a sixth of the points is drawn within 1e-5 of the loops: few of them within the rounding of a float
    EXPECT_LT(static_cast<double>(near), 0.02 * static_cast<double>(asked));
}

TEST(derive_cells, any_orientation_of_nested_loops_is_the_same_region)
{
    const std::vector<Loop> loops = {circle(0.5, 0.5, 0.5, 0.5), star(0.5, 0.5, 0.4, 0.2, 7),
                                     circle(0.5, 0.5, 0.1, 0.1), gear(0.2, 0.5, 0.08, 0.06, 9)};
    PackImage image;
    for (uint mask = 0; mask < 16; ++mask) {
        std::vector<Loop> turned;
        for (uint i = 0; i < 4; ++i)
            turned.push_back((mask >> i & 1u) != 0 ? reversed(loops[i]) : loops[i]);
        add_face(image, turned);
    }
    derive_cells(image);
    std::mt19937 rng(1);
    std::uniform_real_distribution<float> uniform(0, 1);
    const std::vector<MonotonePiece> pieces = pieces_of(image, 0);
    for (int i = 0; i < 20000; ++i) {
        const float u = uniform(rng), v = uniform(rng);
        if (exact_distance(pieces, u, v) < 1e-6)
            continue;
        for (uint f = 1; f < 16; ++f)
            ASSERT_EQ(trim_inside(image, f, u, v), trim_inside(image, 0, u, v)) << u << " " << v << " face " << f;
    }
}

static_assert(kUvBelowOne == 0x1.fffffep-1f);

TEST(derive_cells, points_on_the_domains_border_belong_to_the_face_inside_it)
{
    PackImage image;
    add_face(image, {polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}}), circle(0.5, 0.5, 0.25, 0.25)});
    derive_cells(image);
    for (int i = 0; i <= 1000; ++i) {
        const float s = static_cast<float>(i) / 1000;
        for (const Uv p : {Uv{s, 0}, Uv{s, 1}, Uv{0, s}, Uv{1, s}, Uv{s, -1e-7f}, Uv{1 + 1e-7f, s}})
            ASSERT_TRUE(trim_inside(image, 0, p.u, p.v)) << p.u << " " << p.v;
    }
}

TEST(derive_cells, a_border_that_is_the_domains_costs_no_entries)
{
    PackImage image;
    add_face(image, {polygon({{0, 0}, {1, 0}, {1, 1}})});
    derive_cells(image);
    EXPECT_EQ(image.cell_entries.size(), 1u);
    EXPECT_EQ(image.cells.size(), 1u);
}

TEST(derive_cells, cells_and_pieces_take_about_what_a_kd_tree_takes)
{
    PackImage image;
    for (const std::vector<Loop>& loops : named_shapes())
        add_face(image, loops);
    std::mt19937 rng(3);
    for (int i = 0; i < 20; ++i)
        add_face(image, {gear(0.5, 0.5, 0.5, 0.4, 10 + i * 10), circle(0.5, 0.5, 0.2, 0.2, 1 + i % 3)});
    derive_cells(image);
    const double exact =
        4.0 * static_cast<double>(image.trim_points.size() + image.trim_pieces.size() + image.cells.size()) +
        8.0 * static_cast<double>(image.cell_entries.size());
    EXPECT_LT(exact, 1.1 * kd_trim_bytes(image));
    size_t mixed = 0;
    for (const uint cell : image.cells)
        mixed += (cell & 3u) >= kCellMixedCornerOut;
    EXPECT_LT(static_cast<double>(image.cell_entries.size()), 5.0 * static_cast<double>(mixed)); // rings of small teeth
}

TEST(derive_cells, bytes_do_not_depend_on_the_number_of_threads)
{
    PackImage one;
    std::mt19937 rng(5);
    for (int i = 0; i < 100; ++i)
        add_face(one, {random_loop(rng, 20)});
    PackImage two = one;
    {
        const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
        derive_cells(one);
    }
    derive_cells(two);
    EXPECT_EQ(one.cells, two.cells);
    ASSERT_EQ(one.cell_entries.size(), two.cell_entries.size());
    for (size_t i = 0; i < one.cell_entries.size(); ++i) {
        EXPECT_EQ(one.cell_entries[i].word, two.cell_entries[i].word);
        EXPECT_EQ(one.cell_entries[i].eta, two.cell_entries[i].eta);
    }
}

} // namespace
} // namespace trimray
