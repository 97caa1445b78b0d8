// against_reference PACK...: pictures of the tracers against the reference for closest hits, as lines of JSON: faults a
// million rays, those that a hair decides apart, depth and normal errors, how honest `certified` is. One line for each
// pack, view and device; with --rays for each pack and device, over pictures from around and inside of the model, and
// one over all packs at the end. A tool for corpora.
#include "tests/against_reference.h"
#include "tests/pack_request.h"
#include "tests/views_around.h"

#include "format/leaf_geometry.h"
#include "runtime/effect_plan.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <unistd.h>

#include <chrono>
#include <map>

namespace {

using namespace trimray;
using Json = nlohmann::ordered_json;

struct Request : PackRequest {
    bool ortho = false; // parallel rays
    uint32_t width = 320, height = 180;
    float error_px = RenderOptions{}.error_px;
    uint64_t rays = 0; // a pack; 0: the views
};

/// Of one device's pictures.
struct Outcome {
    AgainstReference result; // without pixels
    Json listed = Json::array();
    double seconds_traced = 0, seconds_compared = 0; // by the clock
};

Json to_json(const FaultyPixel& p, const Camera& camera)
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
            {"cosine", p.cosine},
            {"eye", camera.eye},
            {"target", camera.target},
            {"up", camera.up},
            {"fov_deg", camera.fov_deg}};
}

Json to_json(const AgainstReference& a)
{
    const auto per_million = [&a](uint64_t count) {
        return 1e6 * double(count) / double(std::max<uint64_t>(a.rays, 1));
    };
    Json counts, doubtful, rates, normals;
    for (size_t k = 0; k < kFaultCount; ++k) {
        counts[kFaultNames[k]] = a.faults[k];
        doubtful[kFaultNames[k]] = a.doubtful[k];
        rates[kFaultNames[k]] = per_million(a.faults[k]);
    }
    for (uint kind = 0; kind < kSurfaceKindCount; ++kind)
        if (a.agree_by_kind[kind] > 0)
            normals[surface_kind_name(kind)] = {{"hits", a.agree_by_kind[kind]}, {"off", a.normals_off[kind]}};
    return {
        {"rays", a.rays},
        {"both_hit", a.both_hit},
        {"faults", counts},
        {"faults_per_million", rates},
        {"doubtful", doubtful},
        {"certified_wrong", a.certified_wrong},
        {"uncertified", a.uncertified},
        {"uncertified_right", a.uncertified_right},
        {"not_finite", a.not_finite},
        {"open", a.open},
        {"depth_px", {{"largest", a.largest_depth_px}, {"mean", a.mean_depth_px()}, {"off", a.depths_off}}},
        {"normal_deg", {{"largest", a.largest_normal_deg}, {"mean", a.mean_normal_deg()}, {"off_by_kind", normals}}}};
}

Json to_json(const Outcome& outcome)
{
    Json line{{"seconds", outcome.seconds_compared},
              {"rays_per_second", double(outcome.result.rays) / (outcome.seconds_traced + outcome.seconds_compared)}};
    line.update(to_json(outcome.result));
    line["pixels"] = outcome.listed;
    return line;
}

int fail(const std::string& where, const std::string& detail)
{
    fmt::print(stderr, "against_reference: {}: {}\n", where, detail);
    return 1;
}

/// Traces a picture, compares it and adds what came out; the frame for those who look for more views in it.
Result<Frame> compare(Tracer& tracer, const ClosestReference& closest, const Request& request, const Camera& camera,
                      Outcome& outcome)
{
    using Seconds = std::chrono::duration<double>;
    RenderOptions options;
    options.width = request.width;
    options.height = request.height;
    options.error_px = request.error_px;
    options.camera = camera;
    const auto start = std::chrono::steady_clock::now();
    RenderStats stats;
    Result<Frame> frame = tracer.render(options, stats);
    if (!frame.ok())
        return frame;
    const auto traced = std::chrono::steady_clock::now();
    AgainstReference result = compare_with_reference(*frame, camera, closest);
    outcome.seconds_traced += Seconds(traced - start).count();
    outcome.seconds_compared += Seconds(std::chrono::steady_clock::now() - traced).count();
    for (const bool sure : {true, false})
        for (const FaultyPixel& p : result.pixels)
            if ((p.doubt == Doubt::None) == sure && outcome.listed.size() < request.listed)
                outcome.listed.push_back(to_json(p, camera));
    result.pixels.clear();
    outcome.result.add(result);
    return frame;
}

/// Pictures of the whole model, close-ups and views from within in turn, until there are `rays`.
Status cast_rays(Tracer& tracer, const ClosestReference& closest, const PackImage& image, const Request& request,
                 Outcome& outcome)
{
    ViewsAround views(image);
    while (outcome.result.rays < request.rays) {
        const Camera whole = views.whole();
        const Result<Frame> frame = compare(tracer, closest, request, whole, outcome);
        if (!frame.ok())
            return frame.error();
        for (const std::optional<Camera>& camera : {views.close_up(*frame, whole), views.within(*frame, whole)}) {
            if (!camera || outcome.result.rays >= request.rays)
                continue;
            const Result<Frame> nearer = compare(tracer, closest, request, *camera, outcome);
            if (!nearer.ok())
                return nearer.error();
        }
    }
    return Done{};
}

void print(const Json& line)
{
    fmt::print("{}\n", line.dump());
    std::fflush(stdout);
}

/// Prints what comes out of a pack and adds it to the sums by device.
int measure(const std::string& path, const Request& request, std::map<std::string, Outcome>& sums)
{
    const Result<std::shared_ptr<const Scene>> scene = load_scene(path);
    if (!scene.ok())
        return fail(path, scene.error().detail);
    const PackImage& image = (*scene)->pack.image;
    const ClosestReference closest(image);
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
        if (request.rays > 0) {
            Outcome outcome;
            if (const Status status = cast_rays(**tracer, closest, image, request, outcome); !status.ok())
                return fail(path, status.error().detail);
            Json line{{"pack", path}, {"device", device}};
            line.update(to_json(outcome));
            print(line);
            Outcome& sum = sums[device];
            sum.result.add(outcome.result);
            sum.seconds_traced += outcome.seconds_traced;
            sum.seconds_compared += outcome.seconds_compared;
            continue;
        }
        for (const std::string& view : request.views) {
            Camera camera;
            const double aspect = double(request.width) / request.height;
            if (!(request.ortho ? standard_orthographic_view(view, reach, aspect, 0, camera)
                                : standard_view(view, reach, aspect, 35, camera)))
                return fail(view, "no such view");
            Outcome outcome;
            const Result<Frame> frame = compare(**tracer, closest, request, camera, outcome);
            if (!frame.ok())
                return fail(path + ", " + view, frame.error().detail);
            Json line{{"pack", path},      {"device", device},        {"view", view},
                      {"eye", camera.eye}, {"target", camera.target}, {"up", camera.up}};
            line.update(to_json(outcome));
            print(line);
        }
    }
    return 0;
}

} // namespace

int main(int argc, char** argv)
{
    CLI::App app("Pictures of the tracers against the reference for closest hits, one line of JSON each");
    Request request;
    request.add_options(app, "Pixels listed in each line, sure faults of a picture first");
    app.add_option("--width", request.width)->check(CLI::Range(1u, 16384u));
    app.add_option("--height", request.height)->check(CLI::Range(1u, 16384u));
    app.add_option("--error-px", request.error_px, "The tracers' own dial");
    app.add_flag("--ortho", request.ortho, "By parallel rays");
    app.add_option("--rays", request.rays, "Rays a pack, from around and inside of it, in place of the views");
    CLI11_PARSE(app, argc, argv);
    size_t failed = 0;
    std::map<std::string, Outcome> sums;
    for (size_t i = 0; i < request.packs.size(); ++i) {
        failed += measure(request.packs[i], request, sums) != 0;
        if (isatty(STDERR_FILENO))
            fmt::print(stderr, "\r{} of {} packs", i + 1, request.packs.size());
    }
    for (const auto& [device, sum] : sums) {
        Json line{{"packs", request.packs.size() - failed}, {"device", device}};
        line.update(to_json(sum));
        print(line);
    }
    return failed > 0 ? 1 : 0;
}
