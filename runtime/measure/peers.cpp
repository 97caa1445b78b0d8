#include "runtime/measure/peers.h"

#include "runtime/bench_view.h"
#include "runtime/cpu_view.h"
#include "runtime/measure/mesh_tracer.h"
#include "runtime/measure/one_ray_tracer.h"
#include "runtime/median.h"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <system_error>
#include <utility>

namespace trimray {
namespace {
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr const char* kDial = "peers";

uint64_t size_of_file(const std::string& path)
{
    std::error_code failed;
    const uintmax_t bytes = fs::file_size(path, failed);
    return failed ? 0 : bytes;
}

/// Of a report of trimray-pack: all phases but the previews, which no mesh has.
double seconds_of(const Json& report)
{
    double sum = 0;
    for (const auto& [phase, seconds] : report["seconds"].items())
        if (phase != "total" && phase != "preview")
            sum += seconds.get<double>();
    return sum;
}

using MakeTracer = std::function<Result<std::unique_ptr<Tracer>>(const std::shared_ptr<const Scene>&)>;
using Ask = std::function<void(RenderOptions&)>; // as Contender's

/// Milliseconds from opening a file to a picture of it, from where `camera` is.
Result<double> first_picture_ms(const std::function<Result<std::unique_ptr<Tracer>>()>& open, const Ask& ask,
                                const Camera& camera, const AccuracyOptions& options)
{
    constexpr int kTimed = 3;
    std::vector<double> ms;
    for (int i = 0; i <= kTimed; ++i) { // the first brings the file into the cache
        const Clock::time_point start = Clock::now();
        Result<std::unique_ptr<Tracer>> tracer = open();
        if (!tracer.ok())
            return tracer.error();
        RenderOptions render = picture_options(options, camera);
        render.threads = 0; // all cores, as a viewer has them
        ask(render);
        RenderStats stats;
        if (const Result<Frame> frame = (*tracer)->render(render, stats); !frame.ok())
            return frame.error();
        if (i > 0)
            ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - start).count());
    }
    return median(std::move(ms));
}

Result<std::unique_ptr<Tracer>> open_pack(const std::string& path, const MakeTracer& make)
{
    const Result<std::shared_ptr<const Scene>> scene = load_scene(path);
    if (!scene.ok())
        return scene.error();
    return make(*scene);
}

Result<std::unique_ptr<Tracer>> make_wide(const std::shared_ptr<const Scene>& scene)
{
    return make_cpu_tracer(scene);
}

/// What is asked of a mesh: nothing, for it has neither trims nor leaves.
void ask_nothing(RenderOptions&) {}

class PeerMaker {
public:
    PeerMaker(const std::string& model, const ScratchFolder& scratch, const Camera& camera,
              const AccuracyOptions& options)
        : model_(model), scratch_(scratch), camera_(camera), options_(options)
    {
    }

    void add_paper(Peers& peers) const
    {
        const Converted pack = convert("paper.tray", {"--trim-memory", "0"});
        if (!pack.scene.ok()) {
            peers.notes.push_back("the paper's shape of tracer: " + pack.scene.error().detail);
            return;
        }
        note_losses("the paper's shape of tracer", *pack.report, peers);
        const MakeTracer one_ray = [](const auto& scene) { return make_one_ray_tracer(scene); };
        add_framed({"the paper's shape: Bézier, one leaf a patch, kd-trees, one ray", "one-ray", TrimMode::Kd, 1},
                   one_ray, pack, peers);
        add_framed({"the same, 16 rays wide", "wide", TrimMode::Kd, 1}, make_wide, pack, peers);
        add_framed({"the same, 16 rays wide, 10 frames", "wide-10-frames", TrimMode::Kd, 10}, make_wide, pack, peers);
        if (const Result<KdTrims>& kd = (*pack.scene)->prepared->kd_trims(); kd.ok()) {
            const Json& report = *pack.report;
            peers.paper = PaperCounts{report["converted"].get<uint64_t>(), report["pcurves"].get<uint64_t>(),
                                      report["patches"].get<uint64_t>(), report["trim_pieces"].get<uint64_t>(),
                                      bytes_read(**pack.scene, TrimMode::Kd) + kd->size_bytes()};
        }
        const char* textured_name = "the same, 16 rays wide, the paper's textures (100 %)";
        const Converted textured =
            convert("textured.tray", {"--trim-memory", "100%", "--trim-source", "mask", "--trim-layout", "square"});
        if (textured.scene.ok())
            add_framed({textured_name, "wide-textures", TrimMode::Sdf, 1}, make_wide, textured, peers);
        else
            peers.notes.push_back(fmt::format("{}: {}", textured_name, textured.scene.error().detail));
    }

    void add_mesh(double deflection, Peers& peers) const
    {
        const std::string name = fmt::format("triangles, deflection {:g}", deflection);
        const std::string file = scratch_.file(fmt::format("{:g}.trimesh", deflection));
        const Result<Json> report = run_converter(model_, file, {"--mesh", fmt::format("{:g}", deflection)});
        const auto opened = report.ok() ? open_mesh(file) : Result<std::unique_ptr<Tracer>>(report.error());
        const Result<double> first =
            opened.ok() ? first_picture_ms([&] { return open_mesh(file); }, ask_nothing, camera_, options_)
                        : Result<double>(opened.error());
        if (!first.ok()) {
            peers.notes.push_back(name + ": " + first.error().detail);
            return;
        }
        note_losses(name, *report, peers);
        Result<std::unique_ptr<Tracer>> tracer = open_mesh(file);
        const Preparation preparation{seconds_of(*report), size_of_file(file), *first,
                                      (*report)["triangles"].get<uint64_t>()};
        std::error_code ignored;
        fs::remove(file, ignored); // fine meshes are large
        if (tracer.ok())
            add(peers, {kDial, name, std::move(*tracer), ask_nothing}, preparation);
    }

private:
    /// The model as the paper has it: all Bezier patches, one leaf each.
    struct Converted {
        std::string file;
        Result<Json> report;
        Result<std::shared_ptr<const Scene>> scene;
    };
    Converted convert(const std::string& name, const std::vector<std::string>& trims) const
    {
        std::vector<std::string> options{"--no-previews", "--surfaces", "bezier", "--leaf-budget", "1"};
        options.insert(options.end(), trims.begin(), trims.end());
        const std::string file = scratch_.file(name);
        Result<Json> report = run_converter(model_, file, options);
        auto scene = report.ok() ? load_scene(file) : Result<std::shared_ptr<const Scene>>(report.error());
        return {file, std::move(report), std::move(scene)};
    }

    /// The paper's frames, by one of several tracers.
    struct Framed {
        const char *name, *paper; // as Contender's
        TrimMode trim;
        uint32_t frames;
    };
    void add_framed(const Framed& framed, const MakeTracer& make, const Converted& pack, Peers& peers) const
    {
        const Ask ask = [framed](RenderOptions& render) {
            render.closest = ClosestPolicy::Stochastic;
            render.trim = framed.trim;
            render.frames = framed.frames;
        };
        Result<std::unique_ptr<Tracer>> tracer = make(*pack.scene);
        const Result<double> first =
            tracer.ok() ? first_picture_ms([&] { return open_pack(pack.file, make); }, ask, camera_, options_)
                        : Result<double>(tracer.error());
        if (!first.ok()) {
            peers.notes.push_back(fmt::format("{}: {}", framed.name, first.error().detail));
            return;
        }
        add(peers, {kDial, framed.name, std::move(*tracer), ask, bytes_read(**pack.scene, framed.trim), framed.paper},
            {seconds_of(*pack.report), size_of_file(pack.file), *first, {}});
    }

    /// Faces that are missing; warnings are the own pack's too, which has noted them.
    static void note_losses(const std::string& name, Json report, Peers& peers)
    {
        report["warnings"].clear();
        for (const std::string& loss : losses(report))
            peers.notes.push_back(name + ": " + loss);
    }

    static void add(Peers& peers, Contender contender, const Preparation& preparation)
    {
        peers.contenders.push_back(std::move(contender));
        peers.preparations.push_back(preparation);
    }

    const std::string& model_;
    const ScratchFolder& scratch_;
    const Camera& camera_;
    const AccuracyOptions& options_;
};

} // namespace

std::vector<double> mesh_deflections(bool quick)
{
    return quick ? std::vector{1e-2, 1e-3, 1e-4} : std::vector{1e-2, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5};
}

Result<Preparation> make_own_pack(const std::string& model, const std::string& pack, const AccuracyOptions& options,
                                  std::vector<std::string>& notes)
{
    const Result<Json> report = run_converter(model, pack, {"--no-previews"});
    if (!report.ok())
        return report.error();
    for (const std::string& loss : losses(*report))
        notes.push_back("the pack: " + loss);
    const Result<std::shared_ptr<const Scene>> scene = load_scene(pack);
    if (!scene.ok())
        return scene.error();
    const Result<Camera> camera = bench_view("iso", *scene, options.width, options.height, options.magnification);
    if (!camera.ok())
        return camera.error();
    const Result<double> first =
        first_picture_ms([&] { return open_pack(pack, make_wide); }, [](RenderOptions&) {}, *camera, options);
    if (!first.ok())
        return first.error();
    return Preparation{seconds_of(*report), size_of_file(pack), *first, {}};
}

Result<Peers> make_peers(const std::string& model, const std::shared_ptr<const Scene>& scene,
                         const ScratchFolder& scratch, const AccuracyOptions& options,
                         const std::function<void(const std::string&)>& progress)
{
    const Result<Camera> camera = bench_view("iso", scene, options.width, options.height, options.magnification);
    if (!camera.ok())
        return camera.error();
    const PeerMaker maker(model, scratch, *camera, options);
    Peers peers;
    progress("the paper's shape of tracer");
    maker.add_paper(peers);
    for (const double deflection : mesh_deflections(options.quick)) {
        progress(fmt::format("triangles, deflection {:g}", deflection));
        maker.add_mesh(deflection, peers);
    }
    return peers;
}

} // namespace trimray
