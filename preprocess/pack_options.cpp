#include "preprocess/pack_options.h"

#include "format/pack_file.h"
#include "preprocess/worker/machine_memory.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <utility>

namespace trimray {
namespace {

Status parse_trim_memory(const std::string& text, BuildOptions& build)
{
    if (text.ends_with('%')) {
        if (const auto percent = parse_bytes(text.substr(0, text.size() - 1)); percent && *percent <= 10000) {
            build.trim_memory_fraction = *percent / 100;
            return Done{};
        }
    } else if (const auto bytes = parse_bytes(text)) {
        build.trim_memory_bytes = *bytes;
        return Done{};
    }
    return Error{ErrorCode::Usage, "--trim-memory",
                 fmt::format("'{}' is neither a share like 50% nor a size like 8MiB", text)};
}

/// As words of an option. Fails: Usage.
Result<uint64_t> parse_limit(const std::string& option, const std::string& text)
{
    const std::optional<double> bytes = parse_bytes(text);
    if (!bytes || *bytes > 0x1p60)
        return Error{ErrorCode::Usage, option, fmt::format("'{}' is no size like 8GiB", text)};
    return static_cast<uint64_t>(*bytes);
}

/// Down to whole MiB.
uint64_t whole_mib(uint64_t bytes)
{
    return bytes >> 20 << 20;
}

} // namespace

std::optional<double> parse_bytes(const std::string& text)
{
    double value = 0;
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failure != std::errc() || !std::isfinite(value) || value < 0)
        return std::nullopt;
    const std::string unit(end, text.data() + text.size());
    constexpr std::pair<const char*, double> kUnits[] = {
        {"", 1},      {"B", 1},         {"kB", 1e3},      {"KB", 1e3},      {"MB", 1e6},     {"GB", 1e9},
        {"TB", 1e12}, {"KiB", 1 << 10}, {"MiB", 1 << 20}, {"GiB", 1 << 30}, {"TiB", 0x1p40},
    };
    for (const auto& [name, factor] : kUnits)
        if (unit == name)
            return value * factor;
    return std::nullopt;
}

std::vector<CLI::Option*> add_pack_options(CLI::App& app, PackWords& words)
{
    app.add_option("--surfaces", words.surfaces, "native: planes to tori keep their own form; bezier: all as splines")
        ->check(CLI::IsMember({"native", "bezier"}))
        ->capture_default_str();
    app.add_option("--trim-memory", words.trim_memory,
                   "Distance textures: a share of the kd-tree's size (50%), a size (8MiB), or 0 for none")
        ->capture_default_str();
    app.add_option("--trim-source", words.source,
                   "Distances to the trim curves themselves, or the paper's: to a mask's pixels")
        ->check(CLI::IsMember({"curve", "mask"}))
        ->capture_default_str();
    app.add_option("--trim-layout", words.layout,
                   "Texels with equal sides on the surface, or the paper's square textures")
        ->check(CLI::IsMember({"isotropic", "square"}))
        ->capture_default_str();
    app.add_option(
           "--leaf-slope", words.options.build.leaves.leaf_slope_deg,
           "Cut patches into leaves until rays steeper than this against a leaf, in degrees, are proved to meet "
           "it once; fewer degrees: more leaves, fewer searches for more hits")
        ->check(CLI::Range(1.0, 90.0))
        ->capture_default_str();
    app.add_option("--leaf-budget", words.options.build.leaves.max_leaves_per_patch,
                   "Leaves of a Bezier patch at most; 1 is the paper's setting")
        ->check(CLI::Range(1u, kMaxLeavesPerPatch))
        ->capture_default_str();
    app.add_flag("--compact", words.options.build.compact,
                 "Leave out what can be built again at load, the larger preview and the coarse triangles");
    app.add_flag("--no-previews", words.no_previews, "Leave out the preview pictures");
    app.add_flag("--heal", words.options.import.heal, "Run the CAD kernel's full shape healing (slow)");
    std::vector<CLI::Option*> added;
    for (const char* name : {"--surfaces", "--trim-memory", "--trim-source", "--trim-layout", "--leaf-slope",
                             "--leaf-budget", "--compact", "--no-previews", "--heal"})
        added.push_back(app.get_option(name));
    return added;
}

Result<PackOptions> understand(const PackWords& words)
{
    PackOptions options = words.options;
    if (const Status parsed = parse_trim_memory(words.trim_memory, options.build); !parsed)
        return parsed.error();
    options.import.native_surfaces = words.surfaces == "native";
    options.build.trim_textures.source = words.source == "mask" ? TrimSource::Mask : TrimSource::Curve;
    options.build.trim_textures.layout = words.layout == "square" ? TrimLayout::Square : TrimLayout::Isotropic;
    options.previews = !words.no_previews;
    return options;
}

std::vector<std::string> said_words(const std::vector<CLI::Option*>& options)
{
    std::vector<std::string> words;
    for (const CLI::Option* option : options) {
        if (option->count() == 0)
            continue;
        words.push_back(option->get_name());
        if (option->get_expected_min() > 0)
            words.push_back(option->results().back());
    }
    return words;
}

std::vector<std::string> overridden_words(const std::vector<std::string>& base, const std::vector<std::string>& over)
{
    std::vector<std::string> words;
    bool kept = true;
    for (const std::string& word : base) {
        if (word.starts_with("--"))
            kept = std::find(over.begin(), over.end(), word) == over.end();
        if (kept)
            words.push_back(word);
    }
    words.insert(words.end(), over.begin(), over.end());
    return words;
}

Result<PackOptions> understand_words(const std::vector<std::string>& words)
{
    CLI::App parser;
    PackWords understood;
    add_pack_options(parser, understood);
    try {
        parser.parse(std::vector<std::string>(words.rbegin(), words.rend())); // takes its arguments last first
    } catch (const CLI::ParseError& error) {
        return Error{ErrorCode::Usage, "", error.what()};
    }
    return understand(understood);
}

void add_limit_options(CLI::App& app, LimitWords& words)
{
    app.add_option("--timeout", words.timeout_seconds, "Seconds the conversion of a file may take; 0: no limit")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    app.add_option("--memory-limit", words.memory,
                   "Memory it may use, as 8GiB; auto: the machine's, shared among the files at work, but 2 to 8 GiB; "
                   "0: no limit")
        ->capture_default_str();
    app.add_option("--disk-limit", words.disk, "What it may write, temporary files too, as 64GiB; 0: no limit")
        ->capture_default_str();
}

Result<WorkerLimits> understand(const LimitWords& words, int jobs)
{
    constexpr uint64_t kLeast = 2ull << 30, kMost = 8ull << 30;
    const Result<uint64_t> memory =
        words.memory == "auto" ? std::clamp(whole_mib(machine_memory() / static_cast<uint64_t>(jobs)), kLeast, kMost)
                               : parse_limit("--memory-limit", words.memory);
    if (!memory)
        return memory.error();
    const Result<uint64_t> disk = parse_limit("--disk-limit", words.disk);
    if (!disk)
        return disk.error();
    WorkerLimits limits;
    limits.wall_seconds = words.timeout_seconds;
    limits.memory_bytes = *memory;
    limits.written_bytes = *disk;
    return limits;
}

std::string provenance_options(const PackOptions& options)
{
    nlohmann::ordered_json json;
    json["surfaces"] = options.import.native_surfaces ? "native" : "bezier";
    json["heal"] = options.import.heal;
    if (options.build.trim_memory_bytes >= 0)
        json["trim_memory_bytes"] = options.build.trim_memory_bytes;
    else
        json["trim_memory_fraction"] = options.build.trim_memory_fraction;
    json["trim_source"] = options.build.trim_textures.source == TrimSource::Mask ? "mask" : "curve";
    json["trim_layout"] = options.build.trim_textures.layout == TrimLayout::Square ? "square" : "isotropic";
    json["leaf_slope_deg"] = options.build.leaves.leaf_slope_deg;
    json["leaf_budget"] = options.build.leaves.max_leaves_per_patch;
    json["compact"] = options.build.compact;
    json["previews"] = options.previews;
    return json.dump();
}

} // namespace trimray
