// The kd-tree baseline: monotone sets, the trees' structure, and the CPU tracer's answers against an exact crossing
// count.
#include "format/derive.h"
#include "format/derive_kd.h"
#include "format/monotone_set.h"
#include "runtime/cpu_lanes.h"
#include "tests/trim_shapes.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <bit>
#include <cstring>

namespace trimray {
namespace {

using namespace shapes;

PackImage many_faces(size_t count)
{
    PackImage image;
    for (const std::vector<Loop>& loops : named_shapes())
        add_face(image, loops);
    add_random_faces(image, count);
    return image;
}

struct Rectangle {
    float u_lo = 0, u_hi = 1, v_lo = 0, v_hi = 1; // half-open
};

/// Calls visit(node, rectangle, depth) for each node of a face's tree, and counts them.
template <class Visit>
size_t walk(const KdTrims& kd, uint face, Visit visit, uint node = 0, Rectangle at = {}, uint depth = 1)
{
    const KdNode& n = kd.nodes[kd.faces[face].first_node + node];
    visit(n, at, depth);
    if ((n.word & kKdLeaf) != 0)
        return 1;
    const uint child = n.word >> kKdNumberShift;
    EXPECT_GT(child, node);
    const float plane = std::bit_cast<float>(n.data);
    Rectangle low = at, high = at;
    const bool along_v = (n.word & kKdKindMask) == kKdSplitV;
    (along_v ? low.v_hi : low.u_hi) = plane;
    (along_v ? high.v_lo : high.u_lo) = plane;
    EXPECT_LT(low.u_lo, low.u_hi);
    EXPECT_LT(high.u_lo, high.u_hi);
    EXPECT_LT(low.v_lo, low.v_hi);
    EXPECT_LT(high.v_lo, high.v_hi);
    return 1 + walk(kd, face, visit, child, low, depth + 1) + walk(kd, face, visit, child + 1, high, depth + 1);
}

std::vector<KdRun> runs_of(const KdTrims& kd, uint face, const KdNode& leaf)
{
    const uint number = leaf.word >> kKdNumberShift;
    if ((leaf.word & kKdKindMask) == kKdLeafRun)
        return number == 0 ? std::vector<KdRun>() : std::vector<KdRun>{{leaf.data, number}};
    const auto first = kd.runs.begin() + kd.faces[face].first_run + leaf.data;
    return {first, first + number};
}

/// The face's leaf at a point.
KdNode leaf_at(const KdTrims& kd, uint face, double u, double v)
{
    const KdNode* nodes = &kd.nodes[kd.faces[face].first_node];
    KdNode node = nodes[0];
    while ((node.word & kKdLeaf) == 0)
        node = nodes[(node.word >> kKdNumberShift) +
                     (((node.word & kKdKindMask) == kKdSplitV ? v : u) >= double{std::bit_cast<float>(node.data)})];
    return node;
}

// ---- monotone sets
// ---------------------------------------------------------------------------------------------------

MonotoneSets sets_of(const std::vector<Loop>& loops)
{
    PackImage image;
    add_face(image, loops);
    return monotone_sets(image, image.faces[0]);
}

TEST(monotone_sets, a_circle_has_four_wherever_it_begins)
{
    for (const int parts : {1, 2, 7}) {
        Loop loop = circle(0.5, 0.5, 0.4, 0.3, parts);
        for (int turn = 0; turn < 4 * parts; ++turn) {
            const MonotoneSets found = sets_of({turn % 2 == 0 ? loop : reversed(loop)});
            EXPECT_EQ(found.sets.size(), 4u) << parts << " " << turn;
            EXPECT_EQ(found.points.size(), 2u * (4u * static_cast<uint>(parts) * 3u + 4u));
            loop.points.pop_back(); // the first again
            std::rotate(loop.points.begin(), loop.points.begin() + 3, loop.points.end());
            loop.points.push_back(loop.points.front());
        }
    }
}

TEST(monotone_sets, a_rectangle_has_two)
{
    EXPECT_EQ(sets_of({polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}})}).sets.size(), 2u);
    EXPECT_EQ(sets_of({polygon({{1, 0}, {1, 1}, {0, 1}, {0, 0}})}).sets.size(), 2u);
}

TEST(monotone_sets, hold_each_piece_once_and_never_turn)
{
    const PackImage image = many_faces(60);
    for (uint f = 0; f < image.faces.size(); ++f) {
        const MonotoneSets all = monotone_sets(image, image.faces[f]);
        size_t pieces = 0;
        for (const MonotoneSet& set : all.sets) {
            pieces += set.piece_count;
            int toward_u = 0;
            for (uint k = 0; k < set.piece_count; ++k) {
                const Joint a = joint(all, set, k), b = joint(all, set, k + 1);
                ASSERT_LE(a.v, b.v) << "face " << f;
                const int sign = (b.u > a.u) - (b.u < a.u);
                ASSERT_GE(sign * toward_u, 0) << "face " << f;
                toward_u = toward_u != 0 ? toward_u : sign;
            }
        }
        EXPECT_EQ(pieces, image.faces[f].piece_count) << "face " << f;
    }
}

// ---- structure
// -------------------------------------------------------------------------------------------------------

TEST(derive_kd, nodes_are_reached_once_and_leaves_name_runs_that_exist)
{
    const PackImage image = many_faces(60);
    const Result<KdTrims> built = derive_kd(image);
    ASSERT_TRUE(built.ok());
    const KdTrims& kd = *built;
    ASSERT_EQ(kd.faces.size(), image.faces.size());
    for (uint f = 0; f < image.faces.size(); ++f) {
        const bool last = f + 1 == image.faces.size();
        const size_t node_count = (last ? kd.nodes.size() : kd.faces[f + 1].first_node) - kd.faces[f].first_node;
        const size_t run_count = (last ? kd.runs.size() : kd.faces[f + 1].first_run) - kd.faces[f].first_run;
        const size_t point_count =
            (last ? kd.points.size() / 2 : kd.faces[f + 1].first_point) - kd.faces[f].first_point;
        size_t runs = 0;
        EXPECT_EQ(node_count, walk(kd, f, [&](const KdNode& node, const Rectangle&, uint depth) {
                      EXPECT_LE(depth, kMaxKdDepth);
                      if ((node.word & kKdLeaf) == 0)
                          return;
                      const std::vector<KdRun> own = runs_of(kd, f, node);
                      runs += (node.word & kKdKindMask) == kKdLeafRuns ? own.size() : 0;
                      for (const KdRun& run : own) {
                          const uint stride = (run.word & kKdRunCubic) != 0 ? 3 : 1;
                          EXPECT_GT(run.piece_count, 0u);
                          EXPECT_LT((run.word >> kKdPointShift) + run.piece_count * stride, point_count);
                      }
                  }));
        EXPECT_EQ(runs, run_count);
    }
}

TEST(derive_kd, each_piece_is_in_every_leaf_that_it_meets)
{
    const PackImage image = many_faces(60);
    const Result<KdTrims> kd = derive_kd(image);
    ASSERT_TRUE(kd.ok());
    std::mt19937 rng(2);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (uint f = 0; f < image.faces.size(); ++f) {
        const float* points = kd->points.data() + 2 * size_t{kd->faces[f].first_point};
        for (const MonotonePiece& piece : pieces_of(image, f))
            for (int i = 0; i < 20; ++i) {
                const double t = uniform(rng);
                const double u = bezier3(piece.u, t), v = bezier3(piece.v, t);
                // along a line of constant u or v the answer may be the same for a whole leaf
                if (u <= 0 || u >= 1 || v <= 0 || v >= 1 || piece.u[0] == piece.u[3] || piece.v[0] == piece.v[3])
                    continue;
                bool found = false;
                for (const KdRun& run : runs_of(*kd, f, leaf_at(*kd, f, u, v)))
                    for (uint k = 0; k < run.piece_count; ++k) {
                        const uint stride = (run.word & kKdRunCubic) != 0 ? 3 : 1;
                        const float* a = points + 2 * ((run.word >> kKdPointShift) + k * stride);
                        const float ends[2][2] = {{a[0], a[1]}, {a[2 * stride], a[2 * stride + 1]}};
                        const size_t low = piece.v[0] < piece.v[3] ? 0 : 3;
                        found = found || (ends[0][0] == static_cast<float>(piece.u[low]) &&
                                          ends[0][1] == static_cast<float>(piece.v[low]) &&
                                          ends[1][0] == static_cast<float>(piece.u[3 - low]) &&
                                          ends[1][1] == static_cast<float>(piece.v[3 - low]));
                    }
                EXPECT_TRUE(found) << "face " << f << " at " << u << ", " << v;
            }
    }
}

TEST(derive_kd, faces_without_trims_have_one_leaf)
{
    PackImage image;
    FaceRecord face{};
    face.flags = kFaceNaturalBorder;
    image.faces.push_back(face);
    face.flags = 0; // its trims are lost: no inside
    image.faces.push_back(face);
    const Result<KdTrims> kd = derive_kd(image);
    ASSERT_TRUE(kd.ok());
    ASSERT_EQ(kd->nodes.size(), 2u);
    EXPECT_EQ(kd->nodes[0].word, kKdLeafRun | kKdInside);
    EXPECT_EQ(kd->nodes[1].word, kKdLeafRun);
}

TEST(derive_kd, a_border_that_is_the_domains_costs_no_runs)
{
    PackImage image;
    add_face(image, {polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}})});
    add_face(image, {polygon({{0, 0}, {1, 0}, {1, 1}})});
    const Result<KdTrims> kd = derive_kd(image);
    ASSERT_TRUE(kd.ok());
    ASSERT_EQ(kd->faces[1].first_node, 1u);
    EXPECT_EQ(kd->nodes[0].word, kKdLeafRun | kKdInside);
    walk(*kd, 1, [&](const KdNode& node, const Rectangle&, uint) {
        if ((node.word & kKdLeaf) != 0) {
            EXPECT_LE(runs_of(*kd, 1, node).size(), 1u);
        }
    });
}

TEST(derive_kd, alike_faces_have_trees_of_their_own)
{
    PackImage image;
    for (int i = 0; i < 3; ++i)
        add_face(image, {circle(0.5, 0.5, 0.3, 0.3)});
    const Result<KdTrims> kd = derive_kd(image);
    ASSERT_TRUE(kd.ok());
    EXPECT_EQ(kd->faces[2].first_node, 2 * kd->faces[1].first_node);
    EXPECT_EQ(kd->nodes.size(), size_t{3} * kd->faces[1].first_node);
    EXPECT_EQ(kd_trim_bytes(image), static_cast<double>(kd->size_bytes()));
}

TEST(derive_kd, bytes_do_not_depend_on_the_number_of_threads)
{
    const PackImage image = many_faces(60);
    Result<KdTrims> one = Error{};
    {
        const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
        one = derive_kd(image);
    }
    const Result<KdTrims> two = derive_kd(image);
    ASSERT_TRUE(one.ok() && two.ok());
    ASSERT_EQ(one->nodes.size(), two->nodes.size());
    EXPECT_EQ(std::memcmp(one->nodes.data(), two->nodes.data(), one->nodes.size() * sizeof(KdNode)), 0);
    ASSERT_EQ(one->runs.size(), two->runs.size());
    EXPECT_EQ(std::memcmp(one->runs.data(), two->runs.data(), one->runs.size() * sizeof(KdRun)), 0);
    EXPECT_EQ(one->points, two->points);
}

TEST(derive_kd, refuses_faces_that_share_their_pieces)
{
    PackImage image;
    add_face(image, {circle(0.5, 0.5, 0.3, 0.3)});
    image.faces.push_back(image.faces[0]);
    const Result<KdTrims> kd = derive_kd(image);
    ASSERT_FALSE(kd.ok());
    EXPECT_EQ(kd.error().code, ErrorCode::InvalidPack);
}

// ---- answers
// ---------------------------------------------------------------------------------------------------------

/// What CpuScene needs of an image that has trims only.
PackImage traceable(PackImage image)
{
    image.patches.clear();
    return image;
}

/// Answers of the tracer's lanes, packet by packet.
std::vector<TrimQueries> answered(const CpuScene& scene, const char* set, std::vector<TrimQueries> queries)
{
    std::vector<uint16_t> inside(queries.size());
    find_answer_trims(set)(scene, TrimMode::Kd, queries, inside);
    for (size_t i = 0; i < queries.size(); ++i)
        queries[i].inside = inside[i] & queries[i].asked;
    return queries;
}

/// A plane of the face's tree, and a point on it or an ulp beside.
void move_to_a_plane(const KdTrims& kd, uint face, std::mt19937& rng, Uv& p)
{
    std::vector<KdNode> inner;
    walk(kd, face, [&](const KdNode& node, const Rectangle&, uint) {
        if ((node.word & kKdLeaf) == 0)
            inner.push_back(node);
    });
    if (inner.empty())
        return;
    const KdNode node = inner[rng() % inner.size()];
    const float plane = std::bit_cast<float>(node.data);
    ((node.word & kKdKindMask) == kKdSplitV ? p.v : p.u) =
        rng() % 3 == 0 ? plane : std::nextafter(plane, rng() % 2 == 0 ? 0.0f : 1.0f);
}

/// Packets of 16 telling points: scattered ones, and ones so close that they share most of their way.
std::vector<TrimQueries> telling_queries(const PackImage& image, const KdTrims& kd, uint face, size_t count, uint seed)
{
    const std::vector<MonotonePiece> pieces = pieces_of(image, face);
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> uniform(0, 1);
    std::vector<TrimQueries> queries(count);
    for (size_t i = 0; i < count; ++i) {
        TrimQueries& q = queries[i];
        q.face = face;
        q.asked = i % 5 == 0 ? static_cast<uint32_t>(rng()) & 0xffffu : 0xffffu;
        const Uv middle = telling_point(rng, pieces, rng() % 4);
        const float spread = std::pow(10.0f, -6 * uniform(rng));
        for (size_t lane = 0; lane < 16; ++lane) {
            Uv p = telling_point(rng, pieces, rng() % 4);
            if (i % 2 == 0)
                p = {middle.u + spread * (uniform(rng) - 0.5f), middle.v + spread * (uniform(rng) - 0.5f)};
            else if (lane == 7)
                move_to_a_plane(kd, face, rng, p);
            q.u[lane] = std::clamp(p.u, 0.0f, kUvBelowOne);
            q.v[lane] = std::clamp(p.v, 0.0f, kUvBelowOne);
        }
    }
    return queries;
}

TEST(derive_kd, answers_as_an_exact_crossing_count_does)
{
    const PackImage image = traceable(many_faces(60));
    const CpuScene scene(image);
    const Result<KdTrims>& kd = scene.kd_trims();
    ASSERT_TRUE(kd.ok());
    size_t asked = 0, near = 0;
    for (uint f = 0; f < image.faces.size(); ++f) {
        const std::vector<MonotonePiece> pieces = pieces_of(image, f);
        const std::vector<TrimQueries> queries = answered(scene, "", telling_queries(image, *kd, f, 500, 100 + f));
        size_t far = 0;
        for (const TrimQueries& q : queries)
            for (uint lanes = q.asked; lanes != 0; lanes &= lanes - 1) {
                const int lane = std::countr_zero(lanes);
                ++asked;
                if ((q.inside >> lane & 1u) == uint{exact_inside(pieces, q.u[lane], q.v[lane])})
                    continue;
                (exact_distance(pieces, q.u[lane], q.v[lane]) > 1e-6 ? far : near) += 1;
            }
        EXPECT_EQ(far, 0u) << "face " << f;
    }
    EXPECT_GE(asked, 400000u);
    EXPECT_LT(static_cast<double>(near), 0.02 * static_cast<double>(asked));
}

TEST(derive_kd, every_instruction_set_gives_the_same_answers)
{
    const PackImage image = traceable(many_faces(30));
    const CpuScene scene(image);
    std::string found;
    for (const char* set : {"avx512", "avx2", "sse4"}) {
        if (!find_trace_block(set, found))
            continue;
        for (uint f = 0; f < image.faces.size(); ++f) {
            const std::vector<TrimQueries> queries = telling_queries(image, *scene.kd_trims(), f, 50, f);
            const std::vector<TrimQueries> best = answered(scene, "", queries), own = answered(scene, set, queries);
            for (size_t i = 0; i < queries.size(); ++i)
                ASSERT_EQ(best[i].inside, own[i].inside) << set << " face " << f << " packet " << i;
        }
    }
}

TEST(derive_kd, points_on_the_domains_border_belong_to_the_face_inside_it)
{
    PackImage image;
    add_face(image, {polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}}), circle(0.5, 0.5, 0.25, 0.25)});
    image = traceable(image);
    const CpuScene scene(image);
    std::vector<TrimQueries> queries;
    for (int i = 0; i <= 1000; ++i) {
        const float s = std::min(static_cast<float>(i) / 1000, kUvBelowOne);
        TrimQueries q{};
        q.asked = 0xf;
        const Uv points[4] = {{s, 0}, {s, kUvBelowOne}, {0, s}, {kUvBelowOne, s}};
        for (size_t lane = 0; lane < 4; ++lane) {
            q.u[lane] = points[lane].u;
            q.v[lane] = points[lane].v;
        }
        queries.push_back(q);
    }
    for (const TrimQueries& q : answered(scene, "", queries))
        ASSERT_EQ(q.inside, 0xfu) << q.u[0];
}

// What a validated pack may hold: pieces that are not monotone, loops that do not close.
TEST(derive_kd, pieces_that_no_converter_writes_end_in_some_answer)
{
    std::mt19937 rng(11);
    std::uniform_real_distribution<float> inside(0, 1), control(-1, 2);
    PackImage image;
    for (int f = 0; f < 40; ++f) {
        Loop loop;
        for (int i = 0; i < 30; ++i) {
            loop.points.push_back({inside(rng), inside(rng)});
            loop.cubic.push_back(rng() % 2 == 0);
            if (loop.cubic.back())
                for (int k = 0; k < 2; ++k)
                    loop.points.push_back({control(rng), control(rng)});
        }
        loop.points.push_back({inside(rng), inside(rng)});
        add_face(image, {loop});
        for (uint& word : std::span(image.trim_pieces).last(30)) // pieces that do not follow one another
            if (rng() % 4 == 0)
                word =
                    (static_cast<uint>(rng()) % (image.faces.back().point_count - 3)) << kPiecePointShift | (word & 1u);
    }
    image = traceable(image);
    const CpuScene scene(image);
    ASSERT_TRUE(scene.kd_trims().ok());
    for (uint f = 0; f < image.faces.size(); ++f)
        EXPECT_EQ(answered(scene, "", telling_queries(image, *scene.kd_trims(), f, 100, f)).size(), 100u);
}

} // namespace
} // namespace trimray
