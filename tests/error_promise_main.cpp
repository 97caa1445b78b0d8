// error_promise PACK...: whether pictures keep what --error-px promises (runtime/error_promise.h), one line of JSON for
// each pack, device and error: pixels of all views, those kept at their middle, those kept within the error, those
// broken, and the worst of these. A tool for corpora.
#include "runtime/command_trace.h"
#include "runtime/error_promise.h"
#include "tests/pack_request.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <optional>

namespace {

using namespace trimray;
using Json = nlohmann::ordered_json;

struct Request : PackRequest {
    std::vector<double> errors_px{0.02};
    std::optional<float> traced_with; // the tracers' dial, where it is not the error that is promised
    std::string trim = "auto", closest = "certified", size = "160x90";
};

/// A distance, or how far away a pixel's answer is shown; JSON has no infinity.
Json finite_or_null(double value)
{
    return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json to_json(const BrokenPixel& p, const std::string& view)
{
    return {{"view", view},
            {"pixel", {p.x, p.y}},
            {"shown_within_px", finite_or_null(p.shown_within_px)},
            {"traced_mm", finite_or_null(p.traced_mm)},
            {"right_mm", finite_or_null(p.right_mm)},
            {"footprint_mm", p.footprint_mm},
            {"face", {p.traced_face, p.right_face}},
            {"certified", p.certified},
            {"sure", p.sure}};
}

/// Of all views of one pack, device and error.
struct Sum {
    uint64_t pixels = 0, hits = 0, at_centre = 0, within = 0, broken = 0;
    double worst_px = 0;
    Json listed = Json::array();

    void add(const PromiseKept& kept, const std::string& view, size_t most_listed)
    {
        pixels += kept.pixels;
        hits += kept.hits;
        at_centre += kept.at_centre;
        within += kept.within;
        broken += kept.broken.size();
        if (const BrokenPixel* worst = kept.worst())
            worst_px = std::max(worst_px, worst->shown_within_px);
        for (const BrokenPixel& pixel : kept.broken)
            if (listed.size() < most_listed)
                listed.push_back(to_json(pixel, view));
    }
};

/// One view, as asked for and as the reference has it.
struct View {
    std::string name;
    RenderOptions options;
    Frame right;
};

Result<std::vector<View>> make_views(const std::shared_ptr<const Scene>& scene, const Request& request)
{
    const std::unique_ptr<Tracer> reference = make_reference_tracer(scene);
    const Result<PictureSize> size = parse_size(request.size, 1);
    if (!size.ok())
        return size.error();
    std::vector<View> views;
    for (const std::string& name : request.views) {
        SceneCamera asked;
        asked.view = name;
        const Result<Camera> camera = camera_of(asked, scene->pack.image, size->width, size->height);
        if (!camera.ok())
            return camera.error();
        View view{name, {}, {}};
        view.options.width = size->width;
        view.options.height = size->height;
        view.options.camera = *camera;
        RenderStats stats;
        Result<Frame> right = reference->render(view.options, stats);
        if (!right.ok())
            return right.error();
        view.right = std::move(*right);
        view.options.trim = trim_mode(request.trim);
        view.options.closest = closest_policy(request.closest);
        views.push_back(std::move(view));
    }
    return views;
}

/// Prints a line for each device and error. Fails: as load_scene, make_tracer, Tracer::render; Usage.
Status measure(const std::string& path, const Request& request, uint64_t& broken)
{
    const Result<std::shared_ptr<const Scene>> scene = load_scene(path);
    if (!scene.ok())
        return scene.error();
    Result<std::vector<View>> views = make_views(*scene, request);
    if (!views.ok())
        return views.error();
    const ClosestReference closest((*scene)->pack.image);
    for (const std::string& device : request.devices) {
        std::string note;
        const Result<std::unique_ptr<Tracer>> tracer = make_tracer(*scene, device, note);
        if (!tracer.ok())
            return tracer.error();
        for (const double error_px : request.errors_px) {
            Sum sum;
            for (View& view : *views) {
                view.options.error_px = request.traced_with.value_or(float(error_px));
                RenderStats stats;
                const Result<Frame> traced = (*tracer)->render(view.options, stats);
                if (!traced.ok())
                    return traced.error();
                sum.add(hold_to_promise(*traced, view.right, view.options.camera, closest, error_px), view.name,
                        request.listed);
            }
            broken += sum.broken;
            fmt::print("{}\n", Json{{"pack", path},
                                    {"device", device},
                                    {"error_px", error_px},
                                    {"pixels", sum.pixels},
                                    {"hits", sum.hits},
                                    {"at_centre", sum.at_centre},
                                    {"within", sum.within},
                                    {"broken", sum.broken},
                                    {"worst_px", finite_or_null(sum.worst_px)},
                                    {"worst", sum.listed}}
                                   .dump());
            std::fflush(stdout);
        }
    }
    return Done{};
}

} // namespace

int main(int argc, char** argv)
{
    CLI::App app("Whether pictures keep what --error-px promises: one line of JSON a pack, device and error.\n"
                 "Exit code: 0 kept, 1 broken, 2 a pack that could not be measured");
    Request request;
    request.add_options(app, "Broken pixels listed in each line");
    app.add_option("--error-px", request.errors_px, "Errors, in pixels, that are promised [0.02]")
        ->delimiter(',')
        ->check(CLI::Range(1e-6, 4.0));
    app.add_option("--traced-with", request.traced_with, "The tracers' dial, where it is not the promised error");
    app.add_option("--size", request.size, "WIDTHxHEIGHT")->capture_default_str();
    app.add_option("--trim", request.trim)->check(CLI::IsMember(trim_choice().available));
    app.add_option("--closest", request.closest)->check(CLI::IsMember(closest_choice().available));
    CLI11_PARSE(app, argc, argv);
    uint64_t broken = 0;
    bool failed = false;
    for (const std::string& pack : request.packs)
        if (const Status measured = measure(pack, request, broken); !measured.ok()) {
            fmt::print(stderr, "error_promise: {}: {}: {}\n", pack, measured.error().where, measured.error().detail);
            failed = true;
        }
    return failed ? 2 : broken > 0 ? 1 : 0;
}
