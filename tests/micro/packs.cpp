// Reading packs: decoding, validating, and all of load_scene. Arguments: faces, and whether sections are compressed.
// Bytes are those of the file.
#include "format/pack_reader.h"
#include "format/pack_writer.h"
#include "tests/traced_scenes.h"

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <filesystem>
#include <random>
#include <string>
#include <unistd.h>
#include <vector>

namespace trimray::micro {
namespace {

/// Trimmed waves and planes, on a grid.
PackImage image_of(int64_t faces)
{
    TracedScene scene;
    std::mt19937 random(5);
    std::uniform_real_distribution<double> uniform(-0.9, 0.9);
    for (int64_t i = 0; i < faces; ++i) {
        const std::array<double, 3> origin{uniform(random), uniform(random), uniform(random)};
        if (i % 2 == 0)
            scene.add_wave(3, origin, float(0.4 * uniform(random)), 0.05);
        else
            scene.add(kKindPlane, 0.05, origin, {0.9, 0.6});
        const double radius = 0.4 + 0.05 * uniform(random);
        scene.trim(size_t(i),
                   {shapes::circle(0.5, 0.5, radius, 0.45), shapes::star(0.5, 0.5, 0.3, 0.1, 5, uniform(random))});
    }
    return scene.finish()->pack.image;
}

std::vector<std::byte> pack_of(const benchmark::State& state)
{
    WriteOptions options;
    options.zstd_level = state.range(1) != 0 ? options.zstd_level : 0;
    return encode_pack(image_of(state.range(0)), options);
}

void count_bytes(benchmark::State& state, const std::vector<std::byte>& bytes)
{
    state.SetBytesProcessed(int64_t(state.iterations()) * int64_t(bytes.size()));
    state.counters["file_bytes"] = double(bytes.size());
}

/// With all of the reader's checks.
void pack_reading(benchmark::State& state)
{
    const std::vector<std::byte> bytes = pack_of(state);
    for (auto _ : state) {
        const Result<LoadedPack> pack = decode_pack(bytes, {});
        if (!pack.ok()) {
            state.SkipWithError(pack.error().detail.c_str());
            return;
        }
        benchmark::DoNotOptimize(pack->image.leaves.data());
    }
    count_bytes(state, bytes);
}

/// The checks on decoded arrays alone.
void pack_validating(benchmark::State& state)
{
    const std::vector<std::byte> bytes = pack_of(state);
    const Result<LoadedPack> pack = decode_pack(bytes, {});
    if (!pack.ok()) {
        state.SkipWithError(pack.error().detail.c_str());
        return;
    }
    for (auto _ : state)
        benchmark::DoNotOptimize(validate_image(pack->image).empty());
    count_bytes(state, bytes);
}

/// From the file, in the system's cache, to a scene that can be traced.
void scene_loading(benchmark::State& state)
{
    const std::vector<std::byte> bytes = pack_of(state);
    const std::string path =
        (std::filesystem::temp_directory_path() / fmt::format("trimray_micro_{}.tray", getpid())).string();
    if (!write_file_atomically(path, bytes).ok()) {
        state.SkipWithError("the temporary folder cannot be written");
        return;
    }
    for (auto _ : state) {
        const Result<std::shared_ptr<const Scene>> scene = load_scene(path);
        if (!scene.ok()) {
            state.SkipWithError(scene.error().detail.c_str());
            break;
        }
        benchmark::DoNotOptimize(scene->get());
    }
    std::filesystem::remove(path);
    count_bytes(state, bytes);
}

BENCHMARK(pack_reading)->ArgNames({"faces", "zstd"})->ArgsProduct({{10, 300}, {0, 1}})->UseRealTime();
BENCHMARK(pack_validating)->ArgNames({"faces", "zstd"})->ArgsProduct({{10, 300}, {0}})->UseRealTime();
BENCHMARK(scene_loading)->ArgNames({"faces", "zstd"})->ArgsProduct({{10, 300}, {0, 1}})->UseRealTime();

} // namespace
} // namespace trimray::micro
