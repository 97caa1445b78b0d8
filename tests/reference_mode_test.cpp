// TrimMode::Reference, and the trim queries it records: what the other modes are measured with.
#include "runtime/cpu_lanes.h"
#include "runtime/trim_mode.h"
#include "tests/traced_scenes.h"

#include <gtest/gtest.h>

#include <bit>

namespace trimray {
namespace {

const Camera kClose{{2, -6, 8}, {2, -1, 0}, {0, 0, 1}, 30};

Drawn render(const std::shared_ptr<const Scene>& scene, TrimMode trim, uint32_t threads, bool record = false)
{
    RenderOptions options;
    options.width = 320;
    options.height = 240;
    options.camera = kClose;
    options.trim = trim;
    options.threads = threads;
    options.frames = 2;
    options.record_trim_queries = record;
    return draw(scene, options);
}

size_t asked_lanes(const std::vector<TrimQueries>& queries)
{
    size_t asked = 0;
    for (const TrimQueries& q : queries)
        asked += static_cast<size_t>(std::popcount(q.asked));
    return asked;
}

TEST(reference_mode, gives_the_picture_that_exact_gives)
{
    const auto scene = all_kinds().finish();
    const Drawn reference = render(scene, TrimMode::Reference, 2), exact = render(scene, TrimMode::Exact, 2);
    EXPECT_EQ(reference.stats.trim, TrimMode::Reference);
    EXPECT_TRUE(reference.stats.trim_queries.empty()); // nobody asked
    EXPECT_EQ(reference.frame.face, exact.frame.face);
    EXPECT_EQ(reference.frame.depth_mm, exact.frame.depth_mm);
    EXPECT_EQ(reference.frame.rgba, exact.frame.rgba);
}

TEST(reference_mode, needs_neither_cells_nor_textures)
{
    TracedScene model = all_kinds();
    model.with_textures = false;
    const auto whole = model.finish();
    Scene bare;
    bare.pack.image = whole->pack.image;
    for (FaceRecord& face : bare.pack.image.faces)
        face.grid = 0;
    bare.pack.image.cells.clear();
    bare.pack.image.cell_entries.clear();
    const Drawn with = render(whole, TrimMode::Reference, 2),
                without = render(std::make_shared<const Scene>(bare), TrimMode::Reference, 2);
    EXPECT_EQ(with.frame.face, without.frame.face);
}

TEST(reference_mode, records_the_queries_of_one_frame)
{
    const auto scene = all_kinds().finish();
    const Drawn one = render(scene, TrimMode::Reference, 1, true), two = render(scene, TrimMode::Reference, 2, true);
    EXPECT_EQ(one.stats.trim_queries.size(), two.stats.trim_queries.size());
    const size_t asked = asked_lanes(one.stats.trim_queries);
    EXPECT_EQ(asked, asked_lanes(two.stats.trim_queries));
    EXPECT_GT(asked, 10000u);
    EXPECT_LT(asked, size_t{4} * 320 * 240);
    for (const TrimQueries& q : one.stats.trim_queries) {
        ASSERT_NE(q.asked, 0u);
        ASSERT_EQ(q.inside & ~q.asked, 0u);
        ASSERT_EQ(scene->pack.image.faces[q.face].flags & kFaceNaturalBorder, 0u);
    }
}

TEST(reference_mode, the_lanes_answer_recorded_queries_as_they_do_while_tracing)
{
    const auto scene = all_kinds().finish();
    const std::vector<TrimQueries> queries = render(scene, TrimMode::Reference, 1, true).stats.trim_queries;
    const CpuScene cpu_scene(scene->pack.image);
    std::vector<uint16_t> inside(queries.size());
    for (const char* set : {"avx512", "avx2", "sse4"}) {
        const AnswerTrims answer = find_answer_trims(set);
        if (!answer)
            continue;
        for (const TrimMode mode : {TrimMode::Exact, TrimMode::Hybrid, TrimMode::Kd, TrimMode::Sdf}) {
            answer(cpu_scene, mode, queries, inside);
            size_t wrong = 0;
            for (size_t i = 0; i < queries.size(); ++i)
                wrong += static_cast<size_t>(std::popcount((inside[i] ^ queries[i].inside) & queries[i].asked));
            if (mode == TrimMode::Sdf)
                EXPECT_GT(wrong, 0u) << set; // the texture is not the pieces
            else
                EXPECT_EQ(wrong, 0u) << set << " " << trim_name(mode);
        }
    }
}

} // namespace
} // namespace trimray
