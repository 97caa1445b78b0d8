#include "format/command_report.h"
#include "format/pack_reader.h"
#include "format/pack_writer.h"
#include "runtime/command_trace.h"
#include "runtime/commands.h"
#include "runtime/image_io.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <memory>

namespace trimray {
namespace {

constexpr uint32_t kSmallPreview = 256, kLargePreview = 512; // what a pack stores, square
constexpr uint32_t kPreviewSamples = 2;                      // a pixel each way: edges look smooth

struct ThumbnailArguments {
    std::string pack, output;
    uint32_t size = kSmallPreview;
};

struct PreviewArguments {
    std::string pack, prefix;
};

/// The model framed whole, square, transparent around it.
Result<Picture> render_square(const std::string& pack, uint32_t size)
{
    const Result<std::shared_ptr<const Scene>> scene = load_scene(pack);
    if (!scene.ok())
        return scene.error();
    const Result<std::unique_ptr<Tracer>> tracer = make_cpu_tracer(*scene);
    if (!tracer.ok())
        return tracer.error();
    RenderOptions options;
    options.width = options.height = size;
    const Result<Camera> camera = camera_of({}, (*scene)->pack.image, size, size);
    if (!camera.ok())
        return camera.error();
    options.camera = *camera;
    RenderStats stats;
    const Result<Frame> frame = trace_picture(**tracer, options, kPreviewSamples, stats);
    if (!frame.ok())
        return frame.error();
    return to_picture(*frame);
}

Status write_png(const std::string& path, const Picture& picture, PngForm form = PngForm::Rgba)
{
    const Result<std::vector<std::byte>> bytes = encode_png(picture, form);
    if (!bytes.ok())
        return bytes.error();
    return write_file_atomically(path, *bytes, Durability::Unsynced); // the pack has it still
}

/// The smallest stored preview that is no smaller than `size`, else the largest; empty where the pack has none.
const std::vector<std::byte>& nearest_preview(const StoredPreviews& stored, uint32_t size)
{
    const bool small_is_enough = size <= kSmallPreview && !stored.png_256.empty();
    return small_is_enough || stored.png_512.empty() ? stored.png_256 : stored.png_512;
}

Status write_thumbnail(const ThumbnailArguments& arguments)
{
    const Result<StoredPreviews> previews = read_previews(arguments.pack);
    if (!previews.ok())
        return previews.error();
    const std::vector<std::byte>& stored = nearest_preview(*previews, arguments.size);
    if (stored.empty()) {
        report_note("the pack has no preview: tracing one");
        const Result<Picture> traced = render_square(arguments.pack, arguments.size);
        return traced.ok() ? write_png(arguments.output, *traced) : Status(traced.error());
    }
    const Result<Picture> preview = decode_png(stored);
    if (!preview.ok())
        return preview.error();
    if (preview->width == arguments.size && preview->height == arguments.size)
        return write_file_atomically(arguments.output, stored); // byte for byte
    return write_png(arguments.output, box_filter(*preview, arguments.size, arguments.size));
}

/// The picture in fewer colours, so that its PNG is small: 32 levels a channel of the faces' own shading, 8 of coverage
/// at the edges, black where nothing is covered.
Picture with_fewer_colours(Picture picture)
{
    const auto in_steps = [](uint8_t x, int levels) {
        return static_cast<uint8_t>((x * (levels - 1) + 127) / 255 * 255 / (levels - 1));
    };
    constexpr int kColourLevels = 32, kCoverageLevels = 8;
    for (size_t i = 0; i < picture.rgba.size(); i += 4) {
        uint8_t* const pixel = &picture.rgba[i];
        pixel[3] = in_steps(pixel[3], kCoverageLevels);
        for (int c = 0; c < 3; ++c)
            pixel[c] = pixel[3] == 0 ? uint8_t{0} : in_steps(pixel[c], kColourLevels);
    }
    return picture;
}

Status write_previews(const PreviewArguments& arguments)
{
    const Result<Picture> large = render_square(arguments.pack, kLargePreview);
    if (!large.ok())
        return large.error();
    const Status written = write_png(arguments.prefix + "-512.png", with_fewer_colours(*large), PngForm::Fewest);
    if (!written.ok())
        return written;
    return write_png(arguments.prefix + "-256.png",
                     with_fewer_colours(box_filter(*large, kSmallPreview, kSmallPreview)), PngForm::Fewest);
}

int exit_code_of(const Status& status)
{
    return status.ok() ? static_cast<int>(kExitOk) : report_error(status.error());
}

} // namespace

void register_thumbnail(CLI::App& app, int& exit_code)
{
    CLI::App* command = app.add_subcommand("thumbnail", "Copy a pack's preview picture out, at a size");
    const auto arguments = std::make_shared<ThumbnailArguments>();
    command->add_option("-s,--size", arguments->size, "Width and height in pixels")
        ->capture_default_str()
        ->check(CLI::Range(1u, 4096u));
    command->add_option("PACK", arguments->pack, "The scene pack (.tray)")->required();
    command->add_option("OUT", arguments->output, "The picture (.png)")->required();
    command->footer("Sizes 256 and 512 are stored; others are scaled from them. A pack without previews is traced.\n\n"
                    "Example:\n  trimray thumbnail -s 128 model.tray model.png");
    command->callback([arguments, &exit_code] { exit_code = exit_code_of(write_thumbnail(*arguments)); });
}

void register_preview(CLI::App& app, int& exit_code)
{
    CLI::App* command =
        app.add_subcommand("preview", "Trace the preview pictures that `trimray pack` stores in a pack");
    const auto arguments = std::make_shared<PreviewArguments>();
    command->add_option("PACK", arguments->pack, "The scene pack (.tray)")->required();
    command->add_option("-o,--output", arguments->prefix, "PREFIX-256.png and PREFIX-512.png are written")->required();
    command->footer("Example:\n  trimray preview model.tray -o model");
    command->callback([arguments, &exit_code] { exit_code = exit_code_of(write_previews(*arguments)); });
}

} // namespace trimray
