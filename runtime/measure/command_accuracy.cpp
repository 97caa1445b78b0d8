// What each digit costs on given models, as a report.
#include "format/command_report.h"
#include "format/pack_writer.h"
#include "runtime/command_trace.h"
#include "runtime/measure/commands.h"
#include "runtime/measure/report.h"

#include <CLI/CLI.hpp>
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <vector>

namespace trimray {
namespace {
namespace fs = std::filesystem;

struct AccuracyArguments {
    std::vector<std::string> models;
    std::string folder, size = "640x360";
    uint32_t views = 3;
    AccuracyOptions options;
    bool json = false;
};

constexpr const char* kAccuracyFooter =
    "Each dial of the tracer is swept alone, then several together, from the same views; every picture is held "
    "against\n"
    "the reference in double. Pictures are timed in turns, on one thread by its processor time, so other programs\n"
    "disturb little; the report says when times wobbled. A CAD file has peers: the paper's shape of tracer, and "
    "triangles\n"
    "of OpenCASCADE's mesher traced by Embree, 16 rays wide, shaded by the same code.\n"
    "\nExamples:\n"
    "  trimray bench accuracy model.step -o report\n"
    "  trimray bench accuracy part.tray board.tray -o report --quick --size 320x180\n"
    "\nWrites report.html, report.json and report.csv.";

/// `model`: a pack, or a CAD file, which has peers.
Result<ModelReport> measure_model(const std::string& model, const AccuracyOptions& options, std::string& device)
{
    ModelReport report;
    report.name = fs::path(model).filename().string();
    const auto progress = [&](const std::string& text) { report_progress(report.name + ": " + text); };
    const Result<ScratchFolder> scratch = ScratchFolder::make();
    if (!scratch.ok())
        return scratch.error();
    std::string pack = model;
    std::optional<Preparation> preparation;
    if (is_cad_file(model)) {
        pack = scratch->file("own.tray");
        progress("converting");
        const Result<Preparation> made = make_own_pack(model, pack, options, report.notes);
        if (!made.ok())
            return made.error();
        preparation = *made;
    } else
        report.notes.push_back("No peers: they are made from the CAD file, and this is a pack");
    const Result<std::shared_ptr<const Scene>> scene = load_scene(pack);
    if (!scene.ok())
        return scene.error();
    report.faces = uint32_t((*scene)->pack.image.faces.size());
    report.pack_options = (*scene)->pack.image.provenance.options_json;
    report.instances = uint32_t((*scene)->pack.image.instances.size());
    progress("cutting leaves, making textures");
    std::string note;
    Result<std::vector<Contender>> contenders = make_contenders(*scene, options, note);
    if (!contenders.ok())
        return contenders.error();
    if (!note.empty())
        report.notes.push_back(note);
    device = contenders->front().tracer->device_name();
    for (const Contender& contender : *contenders)
        report.contenders.push_back({contender.dial, contender.name, contender.paper, contender.smooth, {}});
    report.contenders.front().preparation = preparation;
    if (preparation) {
        if (contenders->front().tracer->device_kind() != DeviceKind::Cpu)
            report.notes.push_back("Peers, and all first pictures, are traced on the CPU");
        Result<Peers> peers = make_peers(model, *scene, *scratch, options, progress);
        if (!peers.ok())
            return peers.error();
        for (size_t i = 0; i < peers->contenders.size(); ++i) {
            Contender& peer = peers->contenders[i];
            report.contenders.push_back({peer.dial, peer.name, peer.paper, peer.smooth, peers->preparations[i]});
            contenders->push_back(std::move(peer));
        }
        report.paper = peers->paper;
        report.notes.insert(report.notes.end(), peers->notes.begin(), peers->notes.end());
    }
    for (const std::string& name : options.views) {
        Result<AccuracyView> view = measure_view(name, *scene, *contenders, options, progress);
        if (!view.ok())
            return view.error();
        report.views.push_back(std::move(*view));
    }
    return report;
}

Status write_report(const AccuracyReport& report, const std::string& folder)
{
    const std::string json = report_json(report).dump(1, ' ', false, Json::error_handler_t::replace) + '\n';
    for (const auto& [name, text] : {std::pair{"report.json", json}, std::pair{"report.csv", report_csv(report)},
                                     std::pair{"report.html", report_html(report)}}) {
        const auto bytes = std::as_bytes(std::span(text));
        if (const Status written =
                write_file_atomically((fs::path(folder) / name).string(), {bytes.begin(), bytes.end()});
            !written.ok())
            return written;
    }
    return Done{};
}

int run(AccuracyArguments arguments, const std::string& command)
{
    AccuracyOptions& options = arguments.options;
    const Result<PictureSize> size = parse_size(arguments.size, 1);
    if (!size.ok())
        return report_error(size.error());
    if (const Status known = check_choice(device_choice(), options.device); !known.ok())
        return report_error(known.error());
    options.width = size->width;
    options.height = size->height;
    if (options.quick)
        options.rounds = std::min(options.rounds, 3u);
    const std::vector<std::string> views{"iso", "top", "close-up", "front", "right", "back", "left", "bottom"};
    options.views.assign(views.begin(), views.begin() + arguments.views);
    std::error_code failed;
    fs::create_directories(arguments.folder, failed);
    if (failed)
        return report_error({ErrorCode::FileNotWritable, arguments.folder,
                             fmt::format("cannot be made: {}; choose another folder with -o", failed.message())});

    AccuracyReport report{
        command, fmt::format("{:%FT%TZ}", fmt::gmtime(std::chrono::system_clock::now())), "", options, {}};
    int exit_code = kExitOk; // of the first that fails; the others are measured
    for (const std::string& file : arguments.models) {
        Result<ModelReport> model = measure_model(file, options, report.device);
        report_progress("");
        if (!model.ok()) {
            const int failed_code = report_error(model.error());
            exit_code = exit_code == kExitOk ? failed_code : exit_code;
            continue;
        }
        report.models.push_back(std::move(*model));
        // after every model: what is measured is kept, whatever comes
        if (const Status written = write_report(report, arguments.folder); !written.ok())
            return report_error(written.error());
    }
    if (report.models.empty())
        return exit_code;
    if (times_spread(report) > kBusySpread)
        report_note(fmt::format("the machine was busy: times wobbled by {:.0f} %; measure again when it is idle",
                                100 * times_spread(report)));
    if (arguments.json)
        print_json(report_json(report));
    else
        fmt::print("{}\n", (fs::path(arguments.folder) / "report.html").string());
    return exit_code;
}

} // namespace

void register_accuracy(CLI::App& app, const std::string& command_line, int& exit_code)
{
    CLI::App* command =
        app.add_subcommand("accuracy", "What accuracy costs in time and memory, measured on given models");
    const auto a = std::make_shared<AccuracyArguments>();
    command->add_option("MODEL", a->models, "CAD files, which have peers, or scene packs (.tray), which have none")
        ->required();
    command->add_option("-o,--output", a->folder, "The report's folder; made where it is missing")->required();
    command->add_flag("--quick", a->options.quick, "Fewer values a dial, three rounds at most");
    command->add_option("--device", a->options.device, "cpu, vulkan or auto")->capture_default_str();
    command->add_option("--views", a->views, "How many: iso, top, a close-up, front, right, back, left, bottom")
        ->check(CLI::Range(1, 8))
        ->capture_default_str();
    command->add_option("--size", a->size, "WIDTHxHEIGHT in pixels")->capture_default_str();
    command->add_option("--rounds", a->options.rounds, "How often each picture is timed")
        ->check(CLI::Range(1u, 1000u))
        ->capture_default_str();
    command->add_option("--threads", a->options.threads, "CPU threads; 0: all cores")
        ->check(CLI::Range(0u, 1024u))
        ->capture_default_str();
    command->add_flag("--json", a->json, "Print the report as one JSON object");
    command->footer(kAccuracyFooter);
    command->callback([a, command_line, &exit_code] { exit_code = run(*a, command_line); });
}

} // namespace trimray
