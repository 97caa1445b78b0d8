// random_patches [--count N] [--first N] [--seed N] [--weights KIND] [--pixels N] [--leaf-budget N] [--shrink N]:
// random patches against the reference for closest hits. Prints what is wrong by shape and aim and by weights, the
// patches that fail, and some of them made smaller.
#include "tests/hard/random_patches.h"

#include <CLI/CLI.hpp>

#include <chrono>
#include <map>
#include <unistd.h>

namespace {

using namespace trimray;
using namespace trimray::hard;

struct Request {
    uint32_t count = 100000, first = 0, seed = 1, pixels = kPixels, shrink = 0;
    std::vector<Weighting> weights; // none: all
    LeafOptions leaf_options;
};

/// Numbers of the patches that are asked for.
std::vector<uint32_t> numbers_of(const Request& request)
{
    std::vector<uint32_t> numbers;
    for (uint32_t k = request.first; k < request.first + request.count; ++k)
        if (request.weights.empty() || std::count(request.weights.begin(), request.weights.end(), weighting_of(k)) > 0)
            numbers.push_back(k);
    return numbers;
}

constexpr Tally::Count kFaults[] = {Tally::NotFinite,  Tally::CertifiedWrong, Tally::FalseMisses, Tally::FalseHits,
                                    Tally::WrongFaces, Tally::DepthsOff,      Tally::NormalsOff};

void print_row(const std::string& name, const Tally& tally)
{
    fmt::print("{:24}", name);
    for (const uint64_t count : tally.counts)
        fmt::print("{:>13}", count);
    fmt::print("{:>9.3f}\n", tally.largest_depth_px);
}

/// Every picture with this fault; the first of each shape, as many as are asked for, made smaller.
void print_faulty(const std::vector<uint32_t>& numbers, const std::vector<PatchTallies>& tallies,
                  const Request& request, Tally::Count count)
{
    std::array<uint32_t, kShapeCount> shrunk{};
    for (size_t k = 0; k < numbers.size(); ++k)
        for (size_t aim = 0; aim < kAimCount; ++aim) {
            if (tallies[k][aim][count] == 0)
                continue;
            const RandomPatch patch = draw_patch(request.seed, numbers[k], request.pixels)[aim];
            fmt::print("{} {} in patch {}, {}, {}, weights {}, degrees {} and {}\n", tallies[k][aim][count],
                       kCountNames[count], numbers[k], kShapeNames[size_t(patch.shape)], kAimNames[aim],
                       kWeightingNames[size_t(patch.weighting)], patch.degree_u, patch.degree_v);
            if (shrunk[size_t(patch.shape)]++ < request.shrink)
                fmt::print("{}\n", literal_of(shrink(patch, count, request.leaf_options)));
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
    app.add_option("--weights", request.weights, "Patches with these weights alone: None, Mild, Wide")
        ->transform(CLI::CheckedTransformer(std::map<std::string, Weighting>{
            {"None", Weighting::None}, {"Mild", Weighting::Mild}, {"Wide", Weighting::Wide}}));
    app.add_option("--pixels", request.pixels, "A side of a picture")->check(CLI::Range(1u, 1024u));
    app.add_option("--leaf-budget", request.leaf_options.max_leaves_per_patch, "Most leaves of a Bezier patch");
    app.add_option("--shrink", request.shrink, "Patches of each shape and fault to make smaller and print");
    CLI11_PARSE(app, argc, argv);

    const auto start = std::chrono::steady_clock::now();
    const std::vector<uint32_t> numbers = numbers_of(request);
    std::vector<PatchTallies> tallies;
    constexpr size_t kAtOnce = 500;
    while (tallies.size() < numbers.size()) {
        const auto next = std::span(numbers).subspan(tallies.size());
        const auto more = tally_patches(request.seed, next.first(std::min(kAtOnce, next.size())), request.leaf_options,
                                        request.pixels);
        tallies.insert(tallies.end(), more.begin(), more.end());
        if (isatty(STDERR_FILENO))
            fmt::print(stderr, "\r{} of {} patches", tallies.size(), numbers.size());
    }
    std::array<std::array<Tally, kAimCount>, kShapeCount> by_shape;
    std::array<Tally, kWeightingCount> by_weighting;
    Tally all;
    for (size_t k = 0; k < numbers.size(); ++k)
        for (size_t aim = 0; aim < kAimCount; ++aim) {
            by_shape[size_t(shape_of(numbers[k]))][aim].add(tallies[k][aim]);
            by_weighting[size_t(weighting_of(numbers[k]))].add(tallies[k][aim]);
            all.add(tallies[k][aim]);
        }
    fmt::print("{:24}", "");
    for (const char* name : kCountNames)
        fmt::print("{:>13}", name);
    fmt::print("{:>9}\n", "|dt| px");
    for (size_t shape = 0; shape < kShapeCount; ++shape)
        for (size_t aim = 0; aim < kAimCount; ++aim)
            print_row(fmt::format("{}, {}", kShapeNames[shape], kAimNames[aim]), by_shape[shape][aim]);
    for (size_t k = 0; k < kWeightingCount; ++k)
        print_row(fmt::format("weights: {}", kWeightingNames[k]), by_weighting[k]);
    print_row("all", all);
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    fmt::print("{} patches in {:.1f} s\n", numbers.size(), spent.count());
    for (const Tally::Count count : kFaults)
        print_faulty(numbers, tallies, request, count);
    return 0;
}
