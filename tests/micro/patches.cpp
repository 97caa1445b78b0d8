// Evaluation of Bezier patches and Newton's iteration, in packets of 16 rays. Arguments: degree_u, degree_v, and
// whether the patch is rational; items are points or rays.
#include "tests/hard/nets.h"
#include "tests/micro/lanes.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace trimray::micro {
namespace {

constexpr size_t kPackets = 256; // their rays and a net stay in the first caches
constexpr uint32_t kMostLeaves = 32;

/// Packets that are made for one leaf.
struct LeafPackets {
    uint32_t leaf = 0;
    std::vector<PacketUv> at; // in the leaf's rectangle
    std::vector<PacketRays> rays;
};

/// A hilly patch over about [-0.6, 0.6]^2, and rays that meet it in its leaves.
struct HillyPatch {
    PackImage image;
    std::vector<LeafPackets> packets;
    size_t packet_count = 0;

    LanePatch patch() const { return {image, 0}; }

    HillyPatch(const benchmark::State& state, uint32_t most_leaves)
    {
        const int degree_u = int(state.range(0)), degree_v = int(state.range(1));
        TracedScene scene;
        scene.with_textures = false;
        scene.leaf_options.max_leaves_per_patch = most_leaves;
        hard::add_net(scene, degree_u, degree_v, state.range(2) != 0, [&](int i, int j) {
            return hard::NetPoint{1.2 * (i + uniform(-0.2, 0.2)) / degree_u - 0.6,
                                  1.2 * (j + uniform(-0.2, 0.2)) / degree_v - 0.6, 0.15 * uniform(-1, 1),
                                  std::exp(uniform(-0.5, 0.5))};
        });
        image = scene.finish()->pack.image;
        const auto leaves = std::min(uint32_t(image.leaves.size()), kMostLeaves);
        for (uint32_t i = 0; i < leaves; ++i)
            packets.push_back(packets_of(uint32_t(uint64_t{i} * image.leaves.size() / leaves), kPackets / leaves));
        packet_count = leaves * (kPackets / leaves);
    }

private:
    std::mt19937 random_{1};

    double uniform(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random_); }

    /// Of 4 x 4 neighbouring points each, as of a picture in which the leaf is some 30 pixels wide.
    LeafPackets packets_of(uint32_t leaf, size_t count)
    {
        LeafPackets made{leaf, std::vector<PacketUv>(count), std::vector<PacketRays>(count)};
        const LeafRecord& record = image.leaves[leaf];
        const auto corner = [](uint word, int axis) { return float(word >> 16 * axis & 0xffffu) * kLeafUvQuantum; };
        for (PacketUv& packet : made.at) {
            const double share_u = uniform(0, 0.9), share_v = uniform(0, 0.9);
            for (int i = 0; i < kPacket; ++i) {
                const auto between = [&](int axis, double share) {
                    const float lo = corner(record.uv_lo, axis), hi = corner(record.uv_hi, axis);
                    return lo + float(share) * (hi - lo);
                };
                packet.u[i] = between(0, share_u + 0.03 * (i % 4));
                packet.v[i] = between(1, share_v + 0.03 * (i / 4));
            }
        }
        std::vector<PacketPoints> points(count);
        surface_points(patch(), made.at, points);
        constexpr float kAlong[3] = {0.4f, -0.3f, -2};
        for (size_t k = 0; k < count; ++k)
            for (int c = 0; c < 3; ++c)
                for (int i = 0; i < kPacket; ++i) {
                    made.rays[k].origin[c][i] = points[k].p[c][i] - kAlong[c];
                    made.rays[k].direction[c][i] = kAlong[c];
                }
        return made;
    }
};

void count_rays(benchmark::State& state, const HillyPatch& hills)
{
    state.SetItemsProcessed(int64_t(state.iterations()) * int64_t(hills.packet_count) * kPacket);
}

void bezier_point(benchmark::State& state)
{
    const HillyPatch hills(state, 1);
    for (auto _ : state)
        benchmark::DoNotOptimize(evaluate_points(hills.patch(), hills.packets[0].at));
    count_rays(state, hills);
}

void newton_step(benchmark::State& state)
{
    const HillyPatch hills(state, 1);
    for (auto _ : state)
        benchmark::DoNotOptimize(newton_steps(hills.patch(), hills.packets[0].rays));
    count_rays(state, hills);
}

/// Reports the share of rays that find a root, and steps a ray.
template <auto solve>
void time_solving(benchmark::State& state, const HillyPatch& hills)
{
    Solved all;
    for (auto _ : state) {
        all = {};
        for (const LeafPackets& packets : hills.packets) {
            const Solved solved = solve(hills.patch(), packets.leaf, packets.rays);
            all.found += solved.found;
            all.steps += solved.steps;
        }
        benchmark::DoNotOptimize(all);
    }
    count_rays(state, hills);
    const auto rays = double(hills.packet_count * kPacket);
    state.counters["found"] = double(all.found) / rays;
    state.counters["steps"] = double(all.steps) / rays;
    state.counters["leaves"] = double(hills.image.leaves.size());
}

/// The paper's: one leaf, the whole patch.
void newton_solve_plain(benchmark::State& state)
{
    time_solving<newton_plain>(state, HillyPatch(state, 1));
}

/// With the leaves of a pack.
void newton_solve_proved(benchmark::State& state)
{
    time_solving<newton_proved>(state, HillyPatch(state, LeafOptions{}.max_leaves_per_patch));
}

void degrees(benchmark::internal::Benchmark* bench)
{
    bench->ArgNames({"u", "v", "rational"});
    for (const int rational : {0, 1})
        for (const int degree : {1, 2, 3, 5, 9})
            bench->Args({degree, degree, rational});
    bench->Args({3, 1, 0});
}

BENCHMARK(bezier_point)->Apply(degrees);
BENCHMARK(newton_step)->Args({3, 3, 0})->ArgNames({"u", "v", "rational"});
BENCHMARK(newton_solve_plain)->Apply(degrees);
BENCHMARK(newton_solve_proved)->Apply(degrees);

} // namespace
} // namespace trimray::micro
