// Is a point inside its face's trims? By the cells, the distance texture, both, and the kd-tree; and what it takes to
// make them. Arguments: pieces of the face's loops. Items are queries, faces' pieces, or texels.
#include "format/derive.h"
#include "format/derive_kd.h"
#include "runtime/cpu_lanes.h"
#include "tests/trim_shapes.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <random>
#include <vector>

namespace trimray::micro {
namespace {

constexpr size_t kPackets = 1024;
constexpr double kTextureBytes = 1 << 16;

/// A face with a gear, a star and round holes that have about so many pieces together, lines and cubics; without cells
/// and textures.
PackImage trimmed_face(const benchmark::State& state)
{
    const int pieces = int(state.range(0));
    PackImage image;
    std::vector<shapes::Loop> loops{shapes::gear(0.5, 0.5, 0.49, 0.4, std::max(1, pieces / 12)),
                                    shapes::star(0.5, 0.5, 0.15, 0.05, std::max(3, pieces / 6))};
    const int holes = std::max(1, pieces / 24); // of 8 cubics each
    for (int i = 0; i < holes; ++i) {
        const double turn = 2 * M_PI * i / holes, radius = std::min(0.05, 0.7 / holes);
        loops.push_back(shapes::circle(0.5 + 0.28 * std::cos(turn), 0.5 + 0.28 * std::sin(turn), radius, radius));
    }
    shapes::add_face(image, loops, 10, 10);
    return image;
}

/// Packets of 4 x 4 neighbouring points, as of a picture in which the face is some 300 pixels wide.
std::vector<TrimQueries> near_points()
{
    std::mt19937 random(3);
    std::uniform_real_distribution<float> uniform(0, 0.985f);
    std::vector<TrimQueries> queries(kPackets);
    for (TrimQueries& q : queries) {
        const float u = uniform(random), v = uniform(random);
        for (int i = 0; i < 16; ++i) {
            q.u[i] = u + 0.003f * float(i % 4);
            q.v[i] = v + 0.003f * float(i / 4);
        }
        q.face = 0;
        q.asked = 0xffff;
    }
    return queries;
}

template <TrimMode mode>
void look_up(benchmark::State& state)
{
    PackImage image = trimmed_face(state);
    derive_cells(image);
    allocate_trim_memory(image, kTextureBytes, {});
    derive_sdf(image);
    const CpuScene scene(image);
    if (mode == TrimMode::Kd && !scene.kd_trims().ok()) {
        state.SkipWithError("no kd-trees");
        return;
    }
    const AnswerTrims answer = find_answer_trims("");
    const std::vector<TrimQueries> queries = near_points();
    std::vector<uint16_t> inside(queries.size());
    for (auto _ : state) {
        answer(scene, mode, queries, inside);
        benchmark::DoNotOptimize(inside.data());
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(int64_t(state.iterations()) * int64_t(kPackets) * 16);
    state.counters["pieces"] = double(image.trim_pieces.size());
}

void cell_look_up(benchmark::State& state)
{
    look_up<TrimMode::Exact>(state);
}
void texture_look_up(benchmark::State& state)
{
    look_up<TrimMode::Sdf>(state);
}
void hybrid_look_up(benchmark::State& state)
{
    look_up<TrimMode::Hybrid>(state);
}
void kd_look_up(benchmark::State& state)
{
    look_up<TrimMode::Kd>(state);
}

void count_pieces(benchmark::State& state, const PackImage& image)
{
    state.SetItemsProcessed(int64_t(state.iterations()) * int64_t(image.trim_pieces.size()));
}

void cells_of_a_face(benchmark::State& state)
{
    PackImage image = trimmed_face(state);
    for (auto _ : state) {
        derive_cells(image);
        benchmark::DoNotOptimize(image.cells.data());
    }
    count_pieces(state, image);
}

void kd_tree_of_a_face(benchmark::State& state)
{
    const PackImage image = trimmed_face(state);
    for (auto _ : state)
        benchmark::DoNotOptimize(derive_kd(image).ok());
    count_pieces(state, image);
}

/// Arguments: pieces, KiB of texels.
template <TrimSource source>
void distance_field(benchmark::State& state)
{
    PackImage image = trimmed_face(state);
    TrimTextureOptions options;
    options.source = source;
    allocate_trim_memory(image, 1024.0 * double(state.range(1)), options);
    for (auto _ : state) {
        derive_sdf(image);
        benchmark::DoNotOptimize(image.sdf_words.data());
    }
    state.SetItemsProcessed(int64_t(state.iterations()) * int64_t(image.sdf_words.size()) * 4);
}

void distance_field_of_curves(benchmark::State& state)
{
    distance_field<TrimSource::Curve>(state);
}
void distance_field_of_a_mask(benchmark::State& state)
{
    distance_field<TrimSource::Mask>(state);
}

void pieces(benchmark::internal::Benchmark* bench)
{
    bench->ArgName("pieces")->Arg(24)->Arg(240)->Arg(2400);
}

BENCHMARK(cell_look_up)->Apply(pieces);
BENCHMARK(texture_look_up)->Apply(pieces);
BENCHMARK(hybrid_look_up)->Apply(pieces);
BENCHMARK(kd_look_up)->Apply(pieces);
// on all cores: times are of the clock
BENCHMARK(cells_of_a_face)->Apply(pieces)->UseRealTime();
BENCHMARK(kd_tree_of_a_face)->Apply(pieces)->UseRealTime();
BENCHMARK(distance_field_of_curves)
    ->ArgNames({"pieces", "KiB"})
    ->ArgsProduct({{24, 240}, {4, 64, 1024}})
    ->UseRealTime();
BENCHMARK(distance_field_of_a_mask)->ArgNames({"pieces", "KiB"})->ArgsProduct({{24, 240}, {4, 64}})->UseRealTime();

} // namespace
} // namespace trimray::micro
