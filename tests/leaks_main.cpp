// leaks [--pixels N] [--around N] [--close-ups N] FILE...: leak pixels of closed models, with borders as the file's
// curves say and moved outwards, in `exact` and `hybrid`. A tool for corpora.
#include "format/pack_reader.h"
#include "format/pack_writer.h"
#include "preprocess/build_pack.h"
#include "preprocess/import/cad_import.h"
#include "runtime/tracer.h"
#include "tests/hard/leaks.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cmath>

namespace {

using namespace trimray;

struct Request {
    uint32_t pixels = 512;
    int around = 4, close_ups = 8;
    double rim = 1e-5; // of the diagonal, beside four times the file's tolerance
};

/// A tracer of a scene and what it counts by; null: refused, which is printed.
struct Counted {
    std::unique_ptr<Tracer> tracer;
    hard::ClosedModel closed;
};

std::unique_ptr<Counted> counted(const std::string& path, std::shared_ptr<const Scene> scene, double rim_mm)
{
    auto tracer = make_cpu_tracer(scene);
    if (tracer.ok())
        return std::make_unique<Counted>(Counted{std::move(*tracer), hard::ClosedModel(scene, rim_mm)});
    fmt::print("{}: {}\n", path, tracer.error().detail);
    return nullptr;
}

int measure(const std::string& path, const Request& request)
{
    const Result<CadModel> model = import_cad(path, {}, {});
    if (!model.ok()) {
        fmt::print("{}: {}\n", path, model.error().detail);
        return 1;
    }
    double gap_mm = 0, tolerance_mm = 0;
    for (const CadPart& part : model->parts)
        for (const CadFace& face : part.faces) {
            tolerance_mm = std::max(tolerance_mm, face.tolerance_mm);
            for (const CadLoop& loop : face.loops)
                for (const CadEdgeUse& use : loop)
                    gap_mm = std::max(gap_mm, use.gap_mm);
        }
    std::vector<hard::LeakView> views;
    for (const bool grow : {false, true}) {
        BuildOptions options;
        options.trims.grow = grow;
        BuildReport report;
        const PackImage image = build_pack(*model, options, report);
        const std::vector<std::byte> bytes = encode_pack(image, {});
        Result<LoadedPack> pack = decode_pack(bytes, {});
        if (!pack.ok()) {
            fmt::print("{}: {}\n", path, pack.error().detail);
            return 1;
        }
        auto scene = std::make_shared<Scene>();
        scene->pack = std::move(pack).value();
        const hard::Bounds bounds = hard::bounds_of(scene->pack.image);
        const double rim_mm = 4 * tolerance_mm + request.rim * bounds.diagonal();
        const auto whole = counted(path, scene, rim_mm);
        if (!whole)
            return 1;
        if (views.empty())
            views = hard::leak_views(*scene, bounds, request.around, request.close_ups, request.pixels);
        std::unique_ptr<Counted> within; // what the views from inside are in: all of them in one
        for (const hard::LeakView& view : views)
            if (view.inside && !within && !(within = counted(path, hard::alone(*scene, view.within), rim_mm)))
                return 1;
        for (const TrimMode mode : {TrimMode::Exact, TrimMode::Hybrid}) {
            hard::LeakCount wide, close, inside;
            bool refused = false;
            for (const hard::LeakView& view : views) {
                RenderOptions render;
                render.width = render.height = request.pixels;
                render.camera = view.camera;
                render.trim = mode;
                render.shade = false;
                RenderStats stats;
                const Counted& from = view.inside ? *within : *whole;
                const auto frame = from.tracer->render(render, stats);
                if (!frame.ok()) {
                    refused = true;
                    break;
                }
                const hard::LeakCount count = from.closed.count(render, *frame, view.inside, nullptr);
                (view.inside ? inside : view.camera.fov_deg < 29 ? close : wide) += count;
            }
            fmt::print("{:<40} {:<6} {:<5} gap {:.1e} tol {:.1e} mm | wide {:>5} + {:<5} of {:<9} close {:>5} + {:<6} "
                       "of {:<9} "
                       "inside {:>5} + {:<5} of {:<9} bytes {}{}\n",
                       path.substr(path.rfind('/') + 1), mode == TrimMode::Exact ? "exact" : "hybrid",
                       grow ? "grown" : "as is", gap_mm, tolerance_mm, wide.leaks, wide.rims, wide.rays, close.leaks,
                       close.rims, close.rays, inside.leaks, inside.rims, inside.rays, bytes.size(),
                       refused ? " refused" : "");
        }
        std::fflush(stdout);
    }
    return 0;
}

} // namespace

int main(int argc, char** argv)
{
    Request request;
    std::vector<std::string> files;
    CLI::App app{"Leak pixels of closed models"};
    app.add_option("--pixels", request.pixels, "side of each square picture");
    app.add_option("--around", request.around, "views of the whole");
    app.add_option("--close-ups", request.close_ups, "close-ups for each of them");
    app.add_option("--rim", request.rim, "share of the diagonal within which a hit is at its face's border");
    app.add_option("files", files, "models")->required();
    CLI11_PARSE(app, argc, argv);
    int failed = 0;
    for (const std::string& file : files)
        failed |= measure(file, request);
    return failed;
}
