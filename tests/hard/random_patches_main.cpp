// random_patches [--count N] [--first N] [--seed N] [--shrink N]: random patches against the reference for closest
// hits. Prints what is wrong by shape and aim and by weights, and patches that fail, made smaller.
#include "tests/hard/random_patches.h"

#include <CLI/CLI.hpp>

#include <chrono>
#include <unistd.h>

namespace {

using namespace trimray;
using namespace trimray::hard;

struct Request {
    uint32_t count = 100000, first = 0, seed = 1, shrink = 0;
};

void print_row(const std::string& name, const Tally& tally)
{
    fmt::print("{:24}{:>10}{:>10}", name, tally[Tally::Rays], tally[Tally::Hits]);
    for (size_t k = Tally::FalseMisses; k < Tally::kCount; ++k)
        fmt::print("{:>13.1f}", tally.per_million(Tally::Count(k)));
    fmt::print("{:>9.3f}\n", tally.largest_depth_px);
}

/// The first `most` pictures of each shape with this fault, made smaller.
void print_shrunk(const std::vector<PatchTallies>& tallies, const Request& request, Tally::Count count)
{
    std::array<uint32_t, kShapeCount> printed{};
    for (uint32_t k = 0; k < request.count; ++k)
        for (size_t aim = 0; aim < kAimCount; ++aim) {
            if (tallies[k][aim][count] == 0)
                continue;
            const RandomPatch patch = draw_patch(request.seed, request.first + k)[aim];
            if (printed[size_t(patch.shape)]++ >= request.shrink)
                continue;
            fmt::print("\n{} of {} in patch {}\n{}\n", tallies[k][aim][count], kCountNames[count], request.first + k,
                       literal_of(shrink(patch, count)));
            std::fflush(stdout);
        }
}

} // namespace

int main(int argc, char** argv)
{
    CLI::App app("Random patches against the reference for closest hits");
    Request request;
    app.add_option("--count", request.count, "Patches, three pictures each")->check(CLI::Range(1u, 100000000u));
    app.add_option("--first", request.first, "Number of the first patch of the run");
    app.add_option("--seed", request.seed);
    app.add_option("--shrink", request.shrink, "Patches of each shape and fault to make smaller and print");
    CLI11_PARSE(app, argc, argv);

    const auto start = std::chrono::steady_clock::now();
    std::vector<PatchTallies> tallies;
    constexpr uint32_t kAtOnce = 500;
    while (tallies.size() < request.count) {
        const auto done = uint32_t(tallies.size());
        const auto more = tally_patches(request.seed, request.first + done, std::min(kAtOnce, request.count - done));
        tallies.insert(tallies.end(), more.begin(), more.end());
        if (isatty(STDERR_FILENO))
            fmt::print(stderr, "\r{} of {} patches", tallies.size(), request.count);
    }
    std::array<std::array<Tally, kAimCount>, kShapeCount> by_shape;
    std::array<Tally, kWeightingCount> by_weighting;
    Tally all;
    for (uint32_t k = 0; k < request.count; ++k) {
        const RandomPatch patch = draw_patch(request.seed, request.first + k)[0];
        for (size_t aim = 0; aim < kAimCount; ++aim) {
            by_shape[size_t(patch.shape)][aim].add(tallies[k][aim]);
            by_weighting[size_t(patch.weighting)].add(tallies[k][aim]);
            all.add(tallies[k][aim]);
        }
    }
    fmt::print("{:24}{:>10}{:>10}", "a million rays", "rays", "hits");
    for (size_t k = Tally::FalseMisses; k < Tally::kCount; ++k)
        fmt::print("{:>13}", kCountNames[k]);
    fmt::print("{:>9}\n", "|dt| px");
    for (size_t shape = 0; shape < kShapeCount; ++shape)
        for (size_t aim = 0; aim < kAimCount; ++aim)
            print_row(fmt::format("{}, {}", kShapeNames[shape], kAimNames[aim]), by_shape[shape][aim]);
    for (size_t k = 0; k < kWeightingCount; ++k)
        print_row(fmt::format("weights: {}", kWeightingNames[k]), by_weighting[k]);
    print_row("all", all);
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    fmt::print("{} patches in {:.1f} s\n", request.count, spent.count());
    if (request.shrink > 0)
        for (const Tally::Count count : {Tally::NotFinite, Tally::CertifiedWrong, Tally::FalseMisses, Tally::FalseHits,
                                         Tally::DepthsOff, Tally::NormalsOff})
            print_shrunk(tallies, request, count);
    return 0;
}
