// Splines to Bezier patches by knot insertion, as the converter does. Arguments: degree, and spans a direction.
#include "preprocess/bezier_patch.h"
#include "preprocess/spline.h"
#include "tests/random_surfaces.h"

#include <benchmark/benchmark.h>

#include <vector>

namespace trimray::micro {
namespace {

constexpr uint32_t kSeed = 7;

CadSurface random_spline(const benchmark::State& state, bool rational)
{
    const int degree = int(state.range(0)), spans = int(state.range(1));
    return test::RandomSurfaces(kSeed).spline(degree, degree, rational, spans, spans);
}

/// Items are spans.
void knot_insertion(benchmark::State& state)
{
    const int degree = int(state.range(0)), spans = int(state.range(1));
    const std::vector<double> knots = test::RandomSurfaces(kSeed).knots(degree, spans);
    const std::vector<SpanCut> cuts = cut_spans(knots, degree, 0, knots.front(), knots.back());
    std::vector<double> bezier(size_t(degree + 1) * size_t(degree + 1));
    for (auto _ : state)
        for (const SpanCut& cut : cuts) {
            bezier_operator(knots, degree, cut.k, cut.a, cut.b, bezier.data());
            benchmark::DoNotOptimize(bezier.data());
            benchmark::ClobberMemory();
        }
    state.SetItemsProcessed(int64_t(state.iterations()) * int64_t(cuts.size()));
}

/// Items are patches.
void decomposition(benchmark::State& state)
{
    const CadSurface surface = random_spline(state, true);
    size_t patches = 0;
    for (auto _ : state) {
        const std::vector<BezierPatch> cut = decompose(surface, surface.natural_bounds);
        patches = cut.size();
        benchmark::DoNotOptimize(cut.data());
    }
    state.SetItemsProcessed(int64_t(state.iterations()) * int64_t(patches));
}

/// From the spline to the pack's records. Items are patches.
void patch_records(benchmark::State& state)
{
    const CadSurface surface = random_spline(state, true);
    size_t count = 0;
    for (auto _ : state) {
        std::vector<PatchRecord> patches;
        std::vector<float> control_points;
        if (!append_patches(surface, surface.natural_bounds, {{0, 0, 0}, 10}, 0, patches, control_points).ok()) {
            state.SkipWithError("the spline was refused");
            return;
        }
        count = patches.size();
        benchmark::DoNotOptimize(control_points.data());
    }
    state.SetItemsProcessed(int64_t(state.iterations()) * int64_t(count));
}

BENCHMARK(knot_insertion)->ArgNames({"degree", "spans"})->ArgsProduct({{2, 3, 7}, {4, 64}});
BENCHMARK(decomposition)->ArgNames({"degree", "spans"})->ArgsProduct({{2, 3, 7}, {4, 32}});
BENCHMARK(patch_records)->ArgNames({"degree", "spans"})->ArgsProduct({{2, 3, 7}, {4, 32}});

} // namespace
} // namespace trimray::micro
