// against_reference PACK...: pictures of the tracers against the reference for closest hits. One line of JSON a pack,
// view and device: faults a million rays, those that a hair decides apart, depth and normal errors, how honest
// `certified` is. A tool for corpora.
#include "tests/against_reference.h"

#include "format/leaf_geometry.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <chrono>

namespace {

using namespace trimray;
using Json = nlohmann::ordered_json;

struct Request {
    std::vector<std::string> packs, views{"iso", "front", "top"}, devices{"cpu"};
    uint32_t width = 320, height = 180;
    float error_px = RenderOptions{}.error_px;
    size_t listed = 5;
};

Json to_json(const FaultyPixel& p)
{
    return {{"pixel", {p.x, p.y}},
            {"fault", kFaultNames[size_t(p.fault)]},
            {"doubt", p.doubt == Doubt::Tangent ? "tangent"
                      : p.doubt == Doubt::Face  ? "face"
                                                : "none"},
            {"hair_px", p.hair_px},
            {"certified", p.certified},
            {"mm", {p.tracer_mm, p.reference_mm}},
            {"footprint_mm", p.footprint_mm},
            {"face", {p.tracer_face, p.reference_face}},
            {"uv_face", p.reference_uv_face},
            {"cosine", p.cosine}};
}

Json to_json(const AgainstReference& a, size_t listed)
{
    Json counts, doubtful, per_million;
    for (size_t k = 0; k < kFaultCount; ++k) {
        counts[kFaultNames[k]] = a.faults[k];
        doubtful[kFaultNames[k]] = a.doubtful[k];
        per_million[kFaultNames[k]] = 1e6 * double(a.faults[k]) / double(a.rays);
    }
    Json pixels = Json::array();
    const auto list = [&](bool sure) {
        for (const FaultyPixel& p : a.pixels)
            if ((p.doubt == Doubt::None) == sure && pixels.size() < listed)
                pixels.push_back(to_json(p));
    };
    list(true);
    list(false);
    return {{"rays", a.rays},
            {"both_hit", a.both_hit},
            {"faults", counts},
            {"faults_per_million", per_million},
            {"doubtful", doubtful},
            {"certified_wrong", a.certified_wrong},
            {"uncertified", a.uncertified},
            {"uncertified_right", a.uncertified_right},
            {"not_finite", a.not_finite},
            {"open", a.open},
            {"depth_px", {{"largest", a.largest_depth_px}, {"mean", a.mean_depth_px}}},
            {"normal_deg", {{"largest", a.largest_normal_deg}, {"mean", a.mean_normal_deg}, {"at", a.normal_pixel}}},
            {"pixels", pixels}};
}

int fail(const std::string& where, const std::string& detail)
{
    fmt::print(stderr, "against_reference: {}: {}\n", where, detail);
    return 1;
}

int measure(const std::string& path, const Request& request)
{
    const Result<std::shared_ptr<const Scene>> scene = load_scene(path);
    if (!scene.ok())
        return fail(path, scene.error().detail);
    const PackImage& image = (*scene)->pack.image;
    const ClosestReference closest(image);
    int failed = 0;
    const Reach reach = [&image](const std::array<double, 3>& direction) {
        double largest = -std::numeric_limits<double>::infinity();
        for (const InstanceRecord& instance : image.instances)
            largest = std::max(largest, largest_along(image, instance, direction));
        return largest;
    };
    for (const std::string& device : request.devices) {
        Result<std::unique_ptr<Tracer>> tracer =
            device == "vulkan" ? make_vulkan_tracer(*scene, true, false) : make_cpu_tracer(*scene);
        if (!tracer.ok())
            return fail(device, tracer.error().detail);
        for (const std::string& view : request.views) {
            RenderOptions options;
            options.width = request.width;
            options.height = request.height;
            options.error_px = request.error_px;
            if (!standard_view(view, reach, double(request.width) / request.height, 35, options.camera))
                return fail(view, "no such view");
            RenderStats stats;
            const Result<Frame> frame = (*tracer)->render(options, stats);
            if (!frame.ok()) {
                failed = fail(path + ", " + view, frame.error().detail);
                continue;
            }
            const auto start = std::chrono::steady_clock::now();
            const AgainstReference result = compare_with_reference(*frame, options.camera, closest);
            const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
            Json line{{"pack", path}, {"device", stats.device}, {"view", view}, {"seconds", spent.count()}};
            line["eye"] = options.camera.eye;
            line["target"] = options.camera.target;
            line["up"] = options.camera.up;
            line.update(to_json(result, request.listed));
            fmt::print("{}\n", line.dump());
            std::fflush(stdout);
        }
    }
    return failed;
}

} // namespace

int main(int argc, char** argv)
{
    CLI::App app("Pictures of the tracers against the reference for closest hits, one line of JSON each");
    Request request;
    app.add_option("PACK", request.packs, "Scene packs (.tray)")->required();
    app.add_option("--views", request.views, "Of the whole model: iso, front, ...")->delimiter(',');
    app.add_option("--devices", request.devices, "cpu, vulkan (software drivers too)")
        ->delimiter(',')
        ->check(CLI::IsMember({"cpu", "vulkan"}));
    app.add_option("--width", request.width)->check(CLI::Range(1u, 16384u));
    app.add_option("--height", request.height)->check(CLI::Range(1u, 16384u));
    app.add_option("--error-px", request.error_px, "The tracers' own dial");
    app.add_option("--listed", request.listed, "Pixels listed of each picture, sure faults first");
    CLI11_PARSE(app, argc, argv);
    int failed = 0;
    for (const std::string& pack : request.packs)
        failed |= measure(pack, request);
    return failed;
}
