// Pictures through Vulkan: uploads a scene once, then traces each frame in bands of rows (vk_passes.cpp) and reads the
// last frame's pixels back.
#include "runtime/vk_tracer.h"

#include "runtime/frame_effects.h"
#include "runtime/section_view.h"
#include "runtime/surface_map.h"
#include "runtime/trim_mode.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstring>
#include <deque>
#include <functional>
#include <initializer_list>
#include <limits>
#include <utility>

namespace trimray {

namespace {

const uint32_t kPrimarySpirv[] =
#include "primary.comp.inc"
    ;
const uint32_t kLightSpirv[] =
#include "light.comp.inc"
    ;
const uint32_t kCapsSpirv[] =
#include "caps.comp.inc"
    ;
const uint32_t kMirrorSpirv[] =
#include "mirror.comp.inc"
    ;
const uint32_t kBlendSpirv[] =
#include "blend.comp.inc"
    ;

// Bounds the memory of a band and the time of a dispatch, which some drivers end after a second or two
constexpr size_t kBandBytes = size_t{32} << 20;
// Between bands a picture may be given up: a software driver takes seconds for a band of the size above
constexpr uint32_t kSoftwareRowsToGiveUp = 32;

constexpr uint32_t kLookDone = kLookLights | kLookShadows | kLookSoftShadows | kLookOcclusion | kLookMap |
                               kLookSection | kLookCaps | kLookMaterials | kLookTransparency | kLookMirrors |
                               kLookEnvironment | kLookOrthographic | kLookArrangement;

const char* shader_name(const uint32_t* spirv)
{
    return spirv == kPrimarySpirv  ? "primary"
           : spirv == kCapsSpirv   ? "caps"
           : spirv == kLightSpirv  ? "light"
           : spirv == kMirrorSpirv ? "mirror"
                                   : "blend";
}

} // namespace

Status VulkanTracer::upload()
{
    Result<std::array<VulkanBuffer, kFrameBindings>> buffers = upload_scene(*device_, scene_->pack.image);
    if (!buffers)
        return buffers.error();
    buffers_ = std::move(*buffers);
    const size_t count_bytes = kFrameCounts * 2 * sizeof(uint32_t);
    Result<VulkanBuffer> counts = VulkanBuffer::create(*device_, BufferUse::Storage, count_bytes, "the work counts");
    if (!counts)
        return counts.error();
    buffers_[kBindCounts] = std::move(*counts);
    Result<VulkanBuffer> counts_readback =
        VulkanBuffer::create(*device_, BufferUse::Readback, count_bytes, "the work counts");
    if (!counts_readback)
        return counts_readback.error();
    counts_readback_ = std::move(*counts_readback);
    Result<VulkanBuffer> nothing = VulkanBuffer::create(*device_, BufferUse::Storage, 1, "nothing");
    if (!nothing)
        return nothing.error();
    nothing_ = std::move(*nothing);
    const size_t retry_bytes = kMostRetries * sizeof(uint32_t);
    Result<VulkanBuffer> retries = VulkanBuffer::create(*device_, BufferUse::Storage, retry_bytes, "pixels to retry");
    if (!retries)
        return retries.error();
    buffers_[kBindRetries] = std::move(*retries);
    Result<VulkanBuffer> retries_upload =
        VulkanBuffer::create(*device_, BufferUse::Upload, retry_bytes, "pixels to retry");
    if (!retries_upload)
        return retries_upload.error();
    retries_upload_ = std::move(*retries_upload);

    if (device_->timestamp_bits() > 0) {
        auto info = vk_struct<VkQueryPoolCreateInfo>(VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO);
        info.queryType = VK_QUERY_TYPE_TIMESTAMP;
        info.queryCount = 2;
        const VkResult result = device_->vk().vkCreateQueryPool(device_->handle(), &info, nullptr, &timestamps_.handle);
        if (result != VK_SUCCESS)
            return vk_failure("vkCreateQueryPool", result);
        timestamps_.device = device_.get();
    }
    return device_->validation_status();
}

std::array<const VulkanBuffer*, kFrameBindings> VulkanTracer::bound_buffers() const
{
    std::array<const VulkanBuffer*, kFrameBindings> bound{};
    for (uint32_t i = 0; i < kFrameBindings; ++i)
        bound[i] = buffers_[i].size_bytes() > 0 ? &buffers_[i] : &nothing_;
    return bound;
}

Status VulkanTracer::upload(uint32_t binding, std::span<const std::byte> bytes, const char* name)
{
    Result<VulkanBuffer> buffer = upload_storage(*device_, bytes, name);
    if (!buffer)
        return buffer.error();
    buffers_[binding] = std::move(*buffer);
    return Done{};
}

// Builds and uploads what a trim mode reads beside the pack, when it is first asked for.
Status VulkanTracer::upload_trims(TrimMode trim)
{
    if ((trim == TrimMode::Sdf || trim == TrimMode::Hybrid) && buffers_[kBindSdfWords].size_bytes() == 0)
        return upload(kBindSdfWords, std::as_bytes(std::span(scene_->pack.image.sdf_words)), "the distance textures");
    if (trim != TrimMode::Kd || kd_bytes_ > 0)
        return Done{};
    const Result<KdTrims> kd = derive_kd(scene_->pack.image);
    if (!kd)
        return kd.error();
    if (const Status uploaded = upload_kd(*device_, *kd, buffers_); !uploaded)
        return uploaded.error();
    kd_bytes_ = kd->size_bytes();
    return Done{};
}

Result<ComputePipeline*> VulkanTracer::pipeline(std::span<const uint32_t> spirv, TrimMode trim,
                                                const RenderOptions& options, bool count)
{
    RenderOptions traced = options;
    traced.trim = trim;
    if (spirv.data() != kPrimarySpirv) {
        traced.look.map.map = SurfaceMap::None;
        traced.specialise = true;
    }
    const Specialisation constants = specialisation(effect_plan(facts_, traced, device_kind()), count);
    for (MadePipeline& made : pipelines_)
        if (made.spirv == spirv.data() && made.constants == constants)
            return &made.pipeline;
    Result<ComputePipeline> made =
        ComputePipeline::create(*device_, spirv, kFrameBindings, sizeof(FrameView), constants);
    if (!made)
        return made.error();
    pipelines_.push_back({spirv.data(), constants, std::move(*made)});
    return &pipelines_.back().pipeline;
}

// Traces all bands; `frame` may be null, then nothing is read back. Returns milliseconds.
Result<double> VulkanTracer::trace_frame(const RenderOptions& options, FrameView view, uint32_t rows_per_band,
                                         Frame* frame)
{
    double ms = 0;
    for (view.first_row = 0; view.first_row < view.height; view.first_row += rows_per_band) {
        if (options.is_cancelled())
            return given_up();
        view.row_count = std::min(rows_per_band, view.height - view.first_row);
        const Result<double> band_ms = trace_band(view, frame != nullptr);
        if (!band_ms)
            return band_ms.error();
        ms += *band_ms;
        if (!frame)
            continue;
        take_pixels(view, *frame);
        if (!frame->map_value.empty())
            if (const Status read = read_values(view, *frame); !read)
                return read.error();
        if (!edges_wanted_)
            continue;
        if (const Status read = read_edges(view); !read)
            return read.error();
        take_edges(view);
    }
    return ms;
}

// Copies a band's pixels from the readback buffer to the frame's rows.
void VulkanTracer::take_pixels(const FrameView& view, Frame& frame) const
{
    const PackImage& image = scene_->pack.image;
    const size_t first = size_t{view.first_row} * view.width;
    const size_t count = size_t{view.row_count} * view.width;
    for (size_t i = 0; i < count; ++i) {
        FramePixel pixel;
        std::memcpy(&pixel, readback_.mapped() + i * sizeof pixel, sizeof pixel);
        const size_t at = first + i;
        std::copy_n(pixel.rgba, 4, &frame.rgba[4 * at]);
        frame.certified[at] = (pixel.status & kPixelCertified) != 0;
        if (!(pixel.status & kPixelHit))
            continue;
        frame.depth_mm[at] = pixel.depth_mm;
        std::copy_n(pixel.normal, 3, &frame.normal[3 * at]);
        frame.face[at] = static_cast<int32_t>(pixel.face);
        frame.instance[at] = static_cast<int32_t>(pixel.instance);
        if (frame.face[at] < 0) { // a cap
            std::copy_n(pixel.uv_face, 2, &frame.uv[2 * at]);
            continue;
        }
        const FaceRecord& face = image.faces[pixel.face];
        for (int k = 0; k < 2; ++k)
            frame.uv[2 * at + k] = static_cast<float>(face.domain_lo[k] + static_cast<double>(pixel.uv_face[k]) *
                                                                              (face.domain_hi[k] - face.domain_lo[k]));
    }
}

// Copies a band's edge words to the map, and marks the packets that have some.
void VulkanTracer::take_edges(const FrameView& view)
{
    for (uint32_t row = 0; row < view.row_count; ++row) {
        const uint32_t y = view.first_row + row;
        if (y % 4 == 0)
            std::fill_n(&edge_map_.near[edge_map_.packet_of(0, y)], edge_map_.columns, uint8_t{0});
        for (uint32_t x = 0; x < view.width; ++x) {
            uint32_t words[2];
            std::memcpy(words, edges_readback_.mapped() + (size_t{row} * view.width + x) * sizeof words, sizeof words);
            uint8_t& near = edge_map_.near[edge_map_.packet_of(x, y)];
            const size_t at = edge_map_.word_of(x, y);
            if (!edge_map_.line.empty())
                edge_map_.line[at] = words[0];
            if (!edge_map_.border.empty())
                edge_map_.border[at] = words[1];
            near = static_cast<uint8_t>(near | (words[0] != 0 ? kNearLine : 0) | (words[1] != 0 ? kNearBorder : 0));
        }
    }
}

// What the device holds and runs for the picture at hand.
void VulkanTracer::describe(RenderStats& stats) const
{
    const auto used = {use_.primary, use_.caps, use_.light, use_.mirror, use_.blend};
    stats.buffer_bytes = layer_pixels_.size_bytes();
    for (const VulkanBuffer& buffer : buffers_)
        stats.buffer_bytes += buffer.size_bytes();
    stats.dispatches = dispatches_;
    for (const MadePipeline& made : pipelines_)
        if (std::find(used.begin(), used.end(), &made.pipeline) != used.end())
            stats.pipelines.push_back(
                {shader_name(made.spirv), {made.constants.begin(), made.constants.end()}, made.pipeline.size_bytes()});
}

// The effects' pass over the frame, on the host. Returns milliseconds.
double VulkanTracer::draw(const RenderOptions& options, Frame& frame)
{
    const auto start = std::chrono::steady_clock::now();
    tbb::task_arena arena(options.threads > 0 ? static_cast<int>(std::min(options.threads, 1024u))
                                              : tbb::task_arena::automatic);
    const RunEach run_each = [&arena](uint32_t count, const std::function<void(uint32_t)>& body) {
        arena.execute([&] { tbb::parallel_for(0u, count, body); });
    };
    draw_effects({*cpu_scene_, materials_ ? &*materials_ : nullptr}, options, run_each, edge_map_, frame);
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

Result<Frame> VulkanTracer::render(const RenderOptions& options, RenderStats& stats)
{
    const Result<TrimMode> trim = choose_trim(scene_->pack.image, options.trim);
    if (!trim)
        return trim.error();
    if (*trim == TrimMode::Reference)
        return Error{ErrorCode::UnsupportedPackFeature, "--trim reference", "is the CPU tracer's; use --device cpu"};
    if (const Status done = check_look(options, kLookDone, "vulkan"); !done)
        return done.error();
    if (const Status drawable = check_effects(options); !drawable)
        return drawable.error();
    if (const Status lights = check_lights(options.look); !lights)
        return lights.error();
    if (const Status section = check_section(options.look.section); !section)
        return section.error();
    if (const Status mapped = check_map(scene_->pack.image, options.look.map); !mapped)
        return mapped.error();
    const VkPhysicalDeviceLimits& limits = device_->properties().limits;
    const size_t row_bytes = size_t{options.width} * sizeof(FramePixel);
    const size_t band_bytes = std::min<size_t>(kBandBytes, limits.maxStorageBufferRange);
    if (options.width == 0 || options.height == 0 || row_bytes > band_bytes)
        return Error{ErrorCode::Usage, "--size",
                     fmt::format("{}x{}: at least 1x1, and at most {} wide on this device", options.width,
                                 options.height, band_bytes / sizeof(FramePixel))};
    auto rows_per_band = static_cast<uint32_t>(std::min<size_t>(
        {options.height, band_bytes / row_bytes, size_t{limits.maxComputeWorkGroupCount[1]} * kGroupSide}));
    if (options.cancelled && device_->is_software())
        rows_per_band = std::min(rows_per_band, kSoftwareRowsToGiveUp);

    if (const Status ready = upload_trims(*trim); !ready)
        return ready.error();
    if (const Status ready = prepare_placements(options.look.arrangement); !ready)
        return ready.error();
    const Result<FrameSetup> setup = frame_setup(*cpu_scene_, arrangement_.view(scene_->pack.image), options);
    if (!setup)
        return setup.error();
    if (const Status ready = prepare_frame(*setup, rows_per_band); !ready)
        return ready.error();
    if (const Status ready = prepare_edges(options, rows_per_band); !ready)
        return ready.error();
    RenderOptions traced = options;
    traced.trim = *trim;
    const EffectPlan plan = effect_plan(facts_, traced, device_kind());
    if (const Status ready = prepare_look(options, plan, *setup, rows_per_band); !ready)
        return ready.error();
    if (const Status ready = prepare_materials(options, plan); !ready)
        return ready.error();
    if (const Status ready = prepare_kept(options); !ready)
        return ready.error();
    const Result<bool> reused_last = prepare_last_hits(options);
    if (!reused_last)
        return reused_last.error();

    // With one frame it counts its work itself; with more an untimed one before them does
    const uint32_t frames = std::max(options.frames, 1u);
    const bool count_apart = frames > 1;
    const auto make_pipelines = [&](bool count) -> Result<Pipelines> {
        Pipelines made;
        struct Use {
            bool wanted;
            std::span<const uint32_t> spirv;
            ComputePipeline*& made;
        };
        const bool light_rays = plan.lit && has_light_rays(options.look);
        for (const Use& use :
             {Use{true, kPrimarySpirv, made.primary}, Use{has_caps(options.look.section), kCapsSpirv, made.caps},
              Use{light_rays, kLightSpirv, made.light}, Use{plan.mirrors, kMirrorSpirv, made.mirror},
              Use{plan.layers, kBlendSpirv, made.blend}}) {
            if (!use.wanted)
                continue;
            const Result<ComputePipeline*> one = pipeline(use.spirv, *trim, options, count);
            if (!one)
                return one.error();
            (*one)->set_buffers(bound_buffers());
            // an empty band: drivers that compile at the first dispatch do it here
            if (const Result<double> warm = time_dispatch(**one, setup->view, 1, 1); !warm)
                return warm.error();
            use.made = *one;
        }
        return made;
    };
    const Result<Pipelines> counting = make_pipelines(true);
    if (!counting)
        return counting.error();
    const Result<Pipelines> timed = count_apart ? make_pipelines(false) : counting;
    if (!timed)
        return timed.error();

    if (const Status cleared = fill(kBindCounts, 0); !cleared)
        return cleared.error();
    FrameView view = setup->view;
    const auto choose_start = [&view](uint32_t frame) {
        const std::array<float, 2> start = start_of_frame(frame);
        std::copy(start.begin(), start.end(), view.start);
    };
    if (!plan.specialised)
        decide_late(plan, view);
    choose_start(0);
    if (const Status none = forget_kept(plan); !none)
        return none.error();
    use_ = *counting;
    if (count_apart) {
        if (const Result<double> ms = trace_frame(options, view, rows_per_band, nullptr); !ms)
            return ms.error();
        if (const Status none = forget_kept(plan); !none)
            return none.error();
    }
    use_ = *timed;
    Frame frame;
    const size_t pixels = size_t{options.width} * options.height;
    frame.width = options.width;
    frame.height = options.height;
    frame.rgba.assign(4 * pixels, 0.0f);
    frame.depth_mm.assign(pixels, std::numeric_limits<float>::infinity());
    frame.normal.assign(3 * pixels, 0.0f);
    frame.uv.assign(2 * pixels, 0.0f);
    frame.face.assign(pixels, -1);
    frame.instance.assign(pixels, -1);
    frame.certified.assign(pixels, 0);
    if (measures(options.look.map.map))
        frame.map_value.assign(pixels, 0.0f);
    stats = RenderStats{};
    stats.device = device_->name();
    stats.trim = *trim;
    stats.reused_last = *reused_last;
    stats.kd_bytes = *trim == TrimMode::Kd ? kd_bytes_ : 0;
    stats.border_bytes = edges_wanted_ ? buffers_[kBindBorders].size_bytes() : 0;
    for (uint32_t i = 0; i < frames; ++i) {
        // a software driver's frames are always read: only that shows what must be traced again
        const bool read = i + 1 == frames || device_->is_software() || has_effects(options);
        choose_start(i);
        dispatches_ = 0;
        const Result<double> ms = trace_frame(options, view, rows_per_band, read ? &frame : nullptr);
        if (!ms)
            return ms.error();
        // what the host draws counts as much as what the device traces
        stats.frame_ms.push_back(has_effects(options) ? *ms + draw(options, frame) : *ms);
    }

    describe(stats);
    const Result<std::array<uint64_t, kFrameCounts>> counts = read_counts();
    if (!counts)
        return counts.error();
    stats.work.rays = (*counts)[kCountRays];
    stats.work.node_visits = (*counts)[kCountNodes];
    stats.work.leaf_visits = (*counts)[kCountLeaves];
    stats.work.newton_steps = (*counts)[kCountNewton];
    stats.work.curve_tests = (*counts)[kCountCurves];
    stats.work.edge_tests = (*counts)[kCountEdges];
    stats.work.free_rays = (*counts)[kCountFreeRays];
    stats.work.free_leaf_visits = (*counts)[kCountFreeLeaves];
    stats.work.uncertified_pixels =
        static_cast<uint64_t>(std::count(frame.certified.begin(), frame.certified.end(), uint8_t{0}));
    if (const Status valid = device_->validation_status(); !valid)
        return valid.error();
    if (reuses_hits(options))
        next_hits_size_ = {options.width, options.height};
    return frame;
}

Result<std::unique_ptr<Tracer>> make_vulkan_tracer(std::shared_ptr<const Scene> scene, bool allow_software,
                                                   bool validation)
{
    Result<std::unique_ptr<VulkanDevice>> device = VulkanDevice::create(allow_software, validation);
    if (!device)
        return device.error();
    auto tracer = std::make_unique<VulkanTracer>(std::move(scene), std::move(*device));
    if (const Status ready = tracer->upload(); !ready)
        return ready.error();
    return std::unique_ptr<Tracer>(std::move(tracer));
}

} // namespace trimray
