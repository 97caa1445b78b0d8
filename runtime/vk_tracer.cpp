// The Vulkan tracer: uploads a scene once, then traces each frame in bands of rows, one dispatch of primary.comp a
// band, and reads the last frame's pixels back.
#include "runtime/border_cells.h"
#include "runtime/effect_plan.h"
#include "runtime/frame_effects.h"
#include "runtime/light_view.h"
#include "runtime/materials.h"
#include "runtime/section_view.h"
#include "runtime/stochastic_frames.h"
#include "runtime/surface_map.h"
#include "runtime/tracer.h"
#include "runtime/trim_mode.h"
#include "runtime/vk_buffer.h"
#include "runtime/vk_device.h"
#include "runtime/vk_pipeline.h"
#include "runtime/vk_scene.h"
#include "shaders/look_layout.h"

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

constexpr uint32_t kLookDone = kLookLights | kLookShadows | kLookSoftShadows | kLookOcclusion | kLookMap |
                               kLookSection | kLookCaps | kLookMaterials | kLookTransparency | kLookMirrors |
                               kLookEnvironment | kLookOrthographic;

// Pixels whose subgroup reached that limit are traced again, one by one, in dispatches of so many
constexpr uint32_t kMostRetries = 4096;

// Rays a pixel that one dispatch of light.comp casts: on the software driver a ray takes what the loop limit allows
constexpr uint32_t kSamplesADispatch = 16, kSoftwareSamplesADispatch = 1;

const char* shader_name(const uint32_t* spirv)
{
    return spirv == kPrimarySpirv  ? "primary"
           : spirv == kCapsSpirv   ? "caps"
           : spirv == kLightSpirv  ? "light"
           : spirv == kMirrorSpirv ? "mirror"
                                   : "blend";
}

// Whether any ray begins elsewhere than at the eye
bool needs_free_rays(const RenderOptions& options, const EffectPlan& plan)
{
    return has_caps(options.look.section) || plan.mirrors || (plan.lit && has_light_rays(options.look));
}

// What kBindMaterials holds
std::vector<uint32_t> material_words(const MaterialTable& table)
{
    const auto head_words = uint32_t{sizeof(MaterialHead) / sizeof(uint32_t)};
    const auto count = static_cast<uint32_t>(table.materials.size() * sizeof(MaterialRecord) / sizeof(uint32_t));
    MaterialHead head{};
    head.face_classes = table.face_classes;
    head.of_classes = head_words + count;
    head.instance_class = head.of_classes + static_cast<uint32_t>(table.of_classes.size());
    head.face_class = head.instance_class + static_cast<uint32_t>(table.instance_class.size());
    std::vector<uint32_t> words(head_words + count);
    std::memcpy(words.data(), &head, sizeof head);
    std::memcpy(words.data() + head_words, table.materials.data(), count * sizeof(uint32_t));
    for (const std::vector<uint32_t>* array : {&table.of_classes, &table.instance_class, &table.face_class})
        words.insert(words.end(), array->begin(), array->end());
    return words;
}

bool reuses_hits(const RenderOptions& options)
{
    return options.reuse_last && options.closest == ClosestPolicy::Certified;
}

struct QueryPool {
    const VulkanDevice* device = nullptr;
    VkQueryPool handle = VK_NULL_HANDLE;
    ~QueryPool()
    {
        if (device)
            device->vk().vkDestroyQueryPool(device->handle(), handle, nullptr);
    }
};

class VulkanTracer : public Tracer {
public:
    VulkanTracer(std::shared_ptr<const Scene> scene, std::unique_ptr<VulkanDevice> device)
        : device_(std::move(device)), scene_(std::move(scene)), cpu_scene_(prepared(*scene_)),
          facts_(pack_facts(scene_->pack.image))
    {
    }

    Status upload();
    DeviceKind device_kind() const override
    {
        return device_->is_software() ? DeviceKind::SoftwareVulkan : DeviceKind::Vulkan;
    }
    std::string device_name() const override { return device_->name(); }
    Result<Frame> render(const RenderOptions& options, RenderStats& stats) override;

private:
    Status upload_trims(TrimMode trim);
    Result<ComputePipeline*> pipeline(std::span<const uint32_t> spirv, TrimMode trim, const RenderOptions& options,
                                      bool count);
    Status prepare_frame(const FrameSetup& setup, uint32_t rows_per_band);
    Status prepare_edges(const RenderOptions& options, uint32_t rows_per_band);
    Status prepare_hits(std::initializer_list<uint32_t> bindings, size_t pixels, size_t pixel_bytes,
                        const char* option);
    Status upload(uint32_t binding, std::span<const std::byte> bytes, const char* name);
    Status prepare_look(const RenderOptions& options, const EffectPlan& plan, const FrameSetup& setup,
                        uint32_t rows_per_band);
    Status prepare_materials(const RenderOptions& options, const EffectPlan& plan);
    Status prepare_kept(const RenderOptions& options);
    Result<bool> prepare_last_hits(const RenderOptions& options);
    Status fill(uint32_t binding, uint32_t word);
    Status forget_kept() { return fill(kBindKept, std::bit_cast<uint32_t>(kNothingKept)); }
    Result<std::array<uint64_t, kFrameCounts>> read_counts();
    Result<double> time_dispatch(const ComputePipeline& pipeline, const FrameView& view, uint32_t groups_x,
                                 uint32_t groups_y);
    Status read_band(const FrameView& view);
    Status read_edges(const FrameView& view);
    Status read_values(const FrameView& view, Frame& frame);
    std::vector<uint32_t> stopped_pixels(const FrameView& view) const;
    Result<double> retrace_stopped(const ComputePipeline& pipeline, FrameView view);
    Status set_retries(std::span<const uint32_t> pixels);
    Result<uint32_t> read_stopped_count();
    Result<double> cast_free_rays(const ComputePipeline& pipeline, FrameView view);
    Result<double> gather_light(FrameView view);
    Result<double> find_caps(FrameView view);
    Result<double> follow_mirrors(FrameView view);
    Result<double> trace_layer(FrameView view, uint32_t layer, bool read_back);
    Result<std::pair<double, uint32_t>> blend(FrameView view, uint32_t layer);
    Result<double> trace_layers_behind(const FrameView& view, bool read_back);
    std::array<const VulkanBuffer*, kFrameBindings> bound_buffers() const;
    void swap_layers();
    Result<double> trace_band(const FrameView& view, bool read_back);
    Result<double> trace_frame(FrameView view, uint32_t rows_per_band, Frame* frame);
    void take_pixels(const FrameView& view, Frame& frame) const;
    void take_edges(const FrameView& view);
    void describe(RenderStats& stats) const;
    double draw(const RenderOptions& options, Frame& frame);

    std::unique_ptr<VulkanDevice> device_; // first: everything below must be gone before it
    std::shared_ptr<const Scene> scene_;
    std::shared_ptr<const CpuScene> cpu_scene_; // which side of shells the eye is on is found on the CPU
    PackFacts facts_;
    size_t kd_bytes_ = 0; // of the kd-trees on the device; 0: none yet
    std::array<VulkanBuffer, kFrameBindings> buffers_;
    VulkanBuffer readback_;        // of a band's pixels
    VulkanBuffer edges_readback_;  // of a band's edge words
    VulkanBuffer values_readback_; // of what a map measures in a band
    bool edges_wanted_ = false;
    bool has_border_cells_ = false; // on the device, once a picture asked for borders
    EdgeMap edge_map_;
    std::array<uint32_t, 2> next_hits_size_{}; // of the picture whose hits kBindNextHits holds; 0 x 0: of none
    VulkanBuffer retries_upload_;              // of kMostRetries indices
    VulkanBuffer counts_readback_;
    FrameLights lights_; // of the picture at hand
    // The pipelines that the picture at hand needs; null: it does not
    struct Pipelines {
        ComputePipeline* primary = nullptr;
        ComputePipeline* caps = nullptr;
        ComputePipeline* light = nullptr;
        ComputePipeline* mirror = nullptr;
        ComputePipeline* blend = nullptr;
    };
    bool behind_first_ = false; // kBindPixels is layer_pixels_
    Pipelines use_;
    VulkanBuffer layer_pixels_; // of layers behind the first
    VulkanBuffer nothing_;      // stands for what the picture does not need
    QueryPool timestamps_;
    struct MadePipeline {
        const uint32_t* spirv;
        Specialisation constants;
        ComputePipeline pipeline;
    };
    std::deque<MadePipeline> pipelines_; // pointers handed out stay good
    uint32_t dispatches_ = 0;            // of the frame at hand
};

Status VulkanTracer::upload()
{
    Result<std::array<VulkanBuffer, kFrameBindings>> buffers = upload_scene(*device_, scene_->pack.image);
    if (!buffers)
        return buffers.error();
    buffers_ = std::move(*buffers);
    if (const Status bound = upload_kd(*device_, KdTrims{}, buffers_); !bound)
        return bound.error();
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

// Uploads the instances as the frame sees them and makes the buffers of a band's pixels, if those there are too small.
Status VulkanTracer::prepare_frame(const FrameSetup& setup, uint32_t rows_per_band)
{
    Result<VulkanBuffer> instances =
        upload_storage(*device_, std::as_bytes(std::span(setup.instances)), "the instances");
    if (!instances)
        return instances.error();
    buffers_[kBindInstances] = std::move(*instances);
    const size_t band_bytes = size_t{rows_per_band} * setup.view.width * sizeof(FramePixel);
    if (buffers_[kBindPixels].size_bytes() < band_bytes) {
        Result<VulkanBuffer> pixels = VulkanBuffer::create(*device_, BufferUse::Storage, band_bytes, "the picture");
        if (!pixels)
            return pixels.error();
        buffers_[kBindPixels] = std::move(*pixels);
        Result<VulkanBuffer> readback = VulkanBuffer::create(*device_, BufferUse::Readback, band_bytes, "the picture");
        if (!readback)
            return readback.error();
        readback_ = std::move(*readback);
    }
    return Done{};
}

// Uploads the borders' cells when a picture first asks for them, and makes the buffers of a band's edge words. A
// picture that does not ask has a word in place of each.
Status VulkanTracer::prepare_edges(const RenderOptions& options, uint32_t rows_per_band)
{
    edges_wanted_ = has_effects(options) && edge_query(options).any();
    if (!has_border_cells_ && (edges_wanted_ || buffers_[kBindBorders].size_bytes() == 0)) {
        const BorderCells cells = edges_wanted_ ? make_border_cells(scene_->pack.image) : BorderCells{{0}, {}};
        Result<VulkanBuffer> borders =
            upload_storage(*device_, std::as_bytes(std::span(cells.words)), "the borders' cells");
        if (!borders)
            return borders.error();
        buffers_[kBindBorders] = std::move(*borders);
        has_border_cells_ = edges_wanted_;
    }
    constexpr size_t kPixelBytes = 2 * sizeof(uint32_t);
    const size_t band_bytes = edges_wanted_ ? size_t{rows_per_band} * options.width * kPixelBytes : kPixelBytes;
    if (buffers_[kBindEdges].size_bytes() < band_bytes) {
        Result<VulkanBuffer> edges = VulkanBuffer::create(*device_, BufferUse::Storage, band_bytes, "the edges");
        if (!edges)
            return edges.error();
        buffers_[kBindEdges] = std::move(*edges);
    }
    if (edges_wanted_ && edges_readback_.size_bytes() < band_bytes) {
        Result<VulkanBuffer> readback = VulkanBuffer::create(*device_, BufferUse::Readback, band_bytes, "the edges");
        if (!readback)
            return readback.error();
        edges_readback_ = std::move(*readback);
    }
    if (has_effects(options)) {
        const EdgeQuery query = edge_query(options);
        edge_map_.resize(options.width, options.height, query.line_reach_px > 0, query.border_reach_px > 0);
    }
    return Done{};
}

// Uploads what a scene's look comes to, and makes room for what is kept of a pixel between dispatches. Nothing is made
// for what the picture has not.
Status VulkanTracer::prepare_look(const RenderOptions& options, const EffectPlan& plan, const FrameSetup& setup,
                                  uint32_t rows_per_band)
{
    lights_ = {};
    const bool mapped = plan.map != SurfaceMap::None;
    if (!plan.lit && !plan.cut && !plan.layers && !plan.environment && !mapped)
        return Done{};
    const PackImage& image = scene_->pack.image;
    const SceneLook& scene_look = options.look;
    const ViewRays rays{setup.eye, setup.w0, setup.step_x, setup.step_y, setup.tau_ref};
    LookFrame look{};
    look.places = place_view(image, rays);
    if (plan.cut)
        look.section = section_view(image, scene_look.section, rays);
    if (mapped)
        look.map = map_view(image, scene_look.map);
    if (plan.lit) {
        lights_ = frame_lights(image, options);
        look.light = lights_.view;
        std::copy(lights_.lights.begin(), lights_.lights.end(), look.lights);
    }
    std::vector<std::byte> bytes;
    for (const std::span<const std::byte> part :
         {std::as_bytes(std::span(&look, 1)), std::as_bytes(std::span(lights_.samples))})
        bytes.insert(bytes.end(), part.begin(), part.end());
    if (const Status uploaded = upload(kBindLook, bytes, "the look"); !uploaded)
        return uploaded;
    const size_t band_pixels = size_t{rows_per_band} * options.width;
    const bool free_rays = needs_free_rays(options, plan);
    struct PixelArray {
        bool wanted;
        uint32_t binding;
        size_t bytes;
    };
    for (const PixelArray& array : {PixelArray{plan.lit, kBindLitPixels, sizeof(LitPixel)},
                                    PixelArray{has_caps(scene_look.section), kBindCaps, sizeof(CapState)},
                                    PixelArray{measures(plan.map), kBindMapValues, sizeof(float)},
                                    PixelArray{plan.layers || plan.mirrors, kBindPaths, sizeof(PathState)}})
        if (array.wanted)
            if (const Status ready = prepare_hits({array.binding}, band_pixels, array.bytes, "the look"); !ready)
                return ready;
    if (measures(plan.map) && values_readback_.size_bytes() < band_pixels * sizeof(float)) {
        Result<VulkanBuffer> readback =
            VulkanBuffer::create(*device_, BufferUse::Readback, band_pixels * sizeof(float), "the map's values");
        if (!readback)
            return readback.error();
        values_readback_ = std::move(*readback);
    }
    if (plan.layers && layer_pixels_.size_bytes() < band_pixels * sizeof(FramePixel)) {
        Result<VulkanBuffer> layer =
            VulkanBuffer::create(*device_, BufferUse::Storage, band_pixels * sizeof(FramePixel), "the layers");
        if (!layer)
            return layer.error();
        layer_pixels_ = std::move(*layer);
    }
    if (free_rays && buffers_[kBindToPart].size_bytes() == 0) {
        const std::vector<WorldToPart> to_part = world_to_part(image);
        if (const Status uploaded = upload(kBindToPart, std::as_bytes(std::span(to_part)), "the placements"); !uploaded)
            return uploaded;
    }
    if (free_rays && device_->is_software())
        return prepare_hits({kBindStopped}, band_pixels + 1, sizeof(uint32_t), "free rays");
    return plan.layers ? prepare_hits({kBindStopped}, 1, sizeof(uint32_t), "the layers") : Status(Done{});
}

// Uploads what faces are made of and what is around the model, where the scene says so.
Status VulkanTracer::prepare_materials(const RenderOptions& options, const EffectPlan& plan)
{
    if (plan.materials) {
        const Result<MaterialTable> table = resolve_materials(scene_->pack.image, options.look);
        if (!table)
            return table.error();
        const std::vector<uint32_t> words = material_words(*table);
        if (const Status uploaded = upload(kBindMaterials, std::as_bytes(std::span(words)), "the materials"); !uploaded)
            return uploaded;
    }
    if (!plan.environment)
        return Done{};
    const Environment& environment = *options.look.environment;
    const std::array<uint32_t, 2> size{environment.width, environment.height};
    std::vector<std::byte> bytes;
    for (const std::span<const std::byte> part :
         {std::as_bytes(std::span<const uint32_t>(size)), std::as_bytes(std::span<const float>(environment.rgb))})
        bytes.insert(bytes.end(), part.begin(), part.end());
    return upload(kBindEnvironment, bytes, "the environment");
}

// Makes buffers of one record a pixel, if those there are too small. `option`: what asks for them.
Status VulkanTracer::prepare_hits(std::initializer_list<uint32_t> bindings, size_t pixels, size_t pixel_bytes,
                                  const char* option)
{
    const size_t bytes = pixels * pixel_bytes;
    if (const uint32_t most = device_->properties().limits.maxStorageBufferRange; bytes > most)
        return Error{
            ErrorCode::Usage, option,
            fmt::format("the hits of {} pixels are kept; this device holds those of {}", pixels, most / pixel_bytes)};
    for (const uint32_t binding : bindings) {
        if (buffers_[binding].size_bytes() >= bytes)
            continue;
        Result<VulkanBuffer> hits = VulkanBuffer::create(*device_, BufferUse::Storage, bytes, "the hits kept");
        if (!hits)
            return hits.error();
        buffers_[binding] = std::move(*hits);
    }
    return Done{};
}

// A picture of one frame, or certified, keeps one element.
Status VulkanTracer::prepare_kept(const RenderOptions& options)
{
    const size_t pixels = keeps_hits(options) ? size_t{options.width} * options.height : 1;
    return prepare_hits({kBindKept}, pixels, sizeof(KeptHit), "--frames");
}

// Makes what the last picture left what this one begins from. Returns whether there was one of this size. All frames of
// a picture begin from the same.
Result<bool> VulkanTracer::prepare_last_hits(const RenderOptions& options)
{
    const bool reuse = reuses_hits(options);
    const size_t pixels = reuse ? size_t{options.width} * options.height : 1;
    if (const Status ready =
            prepare_hits({kBindLastHits, kBindNextHits}, pixels, sizeof(LastHit), "RenderOptions::reuse_last");
        !ready)
        return ready.error();
    if (!reuse)
        return false;
    const bool has_last = std::exchange(next_hits_size_, {}) == std::array{options.width, options.height};
    if (has_last) {
        std::swap(buffers_[kBindLastHits], buffers_[kBindNextHits]);
        return true;
    }
    if (const Status none = fill(kBindLastHits, kNoLeaf); !none)
        return none.error();
    return false;
}

Status VulkanTracer::fill(uint32_t binding, uint32_t word)
{
    return device_->run([&](VkCommandBuffer commands) {
        device_->vk().vkCmdFillBuffer(commands, buffers_[binding].handle(), 0, VK_WHOLE_SIZE, word);
    });
}

Result<std::array<uint64_t, kFrameCounts>> VulkanTracer::read_counts()
{
    const Status copied = device_->run([&](VkCommandBuffer commands) {
        const VkBufferCopy region{0, 0, counts_readback_.size_bytes()};
        device_->vk().vkCmdCopyBuffer(commands, buffers_[kBindCounts].handle(), counts_readback_.handle(), 1, &region);
    });
    if (!copied)
        return copied.error();
    if (const Status seen = counts_readback_.invalidate(); !seen)
        return seen.error();
    std::array<uint64_t, kFrameCounts> counts{};
    for (uint32_t i = 0; i < kFrameCounts; ++i) {
        uint32_t words[2];
        std::memcpy(words, counts_readback_.mapped() + i * sizeof words, sizeof words);
        counts[i] = words[0] | uint64_t{words[1]} << 32;
    }
    return counts;
}

// Dispatches and returns the milliseconds on the device, or on the host's clock where the queue has no timestamps.
Result<double> VulkanTracer::time_dispatch(const ComputePipeline& pipeline, const FrameView& view, uint32_t groups_x,
                                           uint32_t groups_y)
{
    ++dispatches_;
    const VolkDeviceTable& vk = device_->vk();
    const auto start = std::chrono::steady_clock::now();
    const Status traced = device_->run([&](VkCommandBuffer commands) {
        if (timestamps_.device) {
            vk.vkCmdResetQueryPool(commands, timestamps_.handle, 0, 2);
            vk.vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, timestamps_.handle, 0);
        }
        pipeline.dispatch(commands, std::as_bytes(std::span(&view, 1)), groups_x, groups_y);
        if (timestamps_.device)
            vk.vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, timestamps_.handle, 1);
    });
    if (!traced)
        return traced.error();
    if (!timestamps_.device)
        return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    uint64_t ticks[2] = {0, 0};
    const VkResult result =
        vk.vkGetQueryPoolResults(device_->handle(), timestamps_.handle, 0, 2, sizeof ticks, ticks, sizeof ticks[0],
                                 VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT);
    if (result != VK_SUCCESS)
        return vk_failure("vkGetQueryPoolResults", result);
    const uint32_t bits = device_->timestamp_bits();
    const uint64_t mask = bits >= 64 ? ~uint64_t{0} : (uint64_t{1} << bits) - 1;
    const double nanoseconds_per_tick = static_cast<double>(device_->properties().limits.timestampPeriod);
    return static_cast<double>((ticks[1] - ticks[0]) & mask) * nanoseconds_per_tick * 1e-6;
}

Status VulkanTracer::read_band(const FrameView& view)
{
    const Status copied = device_->run([&](VkCommandBuffer commands) {
        const VkBufferCopy region{0, 0, size_t{view.width} * view.row_count * sizeof(FramePixel)};
        device_->vk().vkCmdCopyBuffer(commands, buffers_[kBindPixels].handle(), readback_.handle(), 1, &region);
    });
    return copied.ok() ? readback_.invalidate() : copied;
}

Status VulkanTracer::read_edges(const FrameView& view)
{
    const Status copied = device_->run([&](VkCommandBuffer commands) {
        const VkBufferCopy region{0, 0, size_t{view.width} * view.row_count * 2 * sizeof(uint32_t)};
        device_->vk().vkCmdCopyBuffer(commands, buffers_[kBindEdges].handle(), edges_readback_.handle(), 1, &region);
    });
    return copied.ok() ? edges_readback_.invalidate() : copied;
}

// Copies a band's values of the map to the frame's rows.
Status VulkanTracer::read_values(const FrameView& view, Frame& frame)
{
    const size_t bytes = size_t{view.width} * view.row_count * sizeof(float);
    const Status copied = device_->run([&](VkCommandBuffer commands) {
        const VkBufferCopy region{0, 0, bytes};
        device_->vk().vkCmdCopyBuffer(commands, buffers_[kBindMapValues].handle(), values_readback_.handle(), 1,
                                      &region);
    });
    if (!copied)
        return copied;
    if (const Status seen = values_readback_.invalidate(); !seen)
        return seen;
    const size_t first = size_t{view.first_row} * view.width, count = bytes / sizeof(float);
    std::memcpy(&frame.map_value[first], values_readback_.mapped(), bytes);
    for (size_t i = first; i < first + count; ++i)
        if (frame.face[i] < 0) // a cap
            frame.map_value[i] = 0;
    return Done{};
}

// Indices in the band of those whose walk was ended by the iteration limit.
std::vector<uint32_t> VulkanTracer::stopped_pixels(const FrameView& view) const
{
    std::vector<uint32_t> stopped;
    for (uint32_t i = 0; i < view.width * view.row_count; ++i) {
        FramePixel pixel;
        std::memcpy(&pixel, readback_.mapped() + size_t{i} * sizeof pixel, sizeof pixel);
        if (pixel.status & kPixelStopped)
            stopped.push_back(i);
    }
    return stopped;
}

// What the next dispatch with FrameView::alone traces; at most kMostRetries.
Status VulkanTracer::set_retries(std::span<const uint32_t> pixels)
{
    std::memcpy(retries_upload_.mapped(), pixels.data(), pixels.size_bytes());
    if (const Status ready = retries_upload_.flush(); !ready)
        return ready;
    return device_->run([&](VkCommandBuffer commands) {
        const VkBufferCopy region{0, 0, pixels.size_bytes()};
        device_->vk().vkCmdCopyBuffer(commands, retries_upload_.handle(), buffers_[kBindRetries].handle(), 1, &region);
    });
}

// A subgroup's lanes share the driver's limit; a pixel traced by itself has all of it. Returns milliseconds.
// Fails: DeviceFailed, if one needs more even so.
Result<double> VulkanTracer::retrace_stopped(const ComputePipeline& pipeline, FrameView view)
{
    const std::vector<uint32_t> stopped = stopped_pixels(view);
    double ms = 0;
    view.alone = 1;
    for (size_t first = 0; first < stopped.size(); first += kMostRetries) {
        const auto count = static_cast<uint32_t>(std::min<size_t>(kMostRetries, stopped.size() - first));
        if (const Status ready = set_retries(std::span(stopped).subspan(first, count)); !ready)
            return ready.error();
        const Result<double> retry_ms = time_dispatch(pipeline, view, count, 1);
        if (!retry_ms)
            return retry_ms.error();
        ms += *retry_ms;
    }
    if (stopped.empty())
        return ms;
    if (const Status read = read_band(view); !read)
        return read.error();
    if (const std::vector<uint32_t> left = stopped_pixels(view); !left.empty())
        return Error{ErrorCode::DeviceFailed, device_->name(),
                     fmt::format("the rays of {} pixels need more loop iterations than this software driver runs; use "
                                 "--device cpu",
                                 left.size())};
    return ms;
}

// How many pixels' free rays the last dispatch could not follow to their ends.
Result<uint32_t> VulkanTracer::read_stopped_count()
{
    const Status copied = device_->run([&](VkCommandBuffer commands) {
        const VkBufferCopy region{0, 0, sizeof(uint32_t)};
        device_->vk().vkCmdCopyBuffer(commands, buffers_[kBindStopped].handle(), counts_readback_.handle(), 1, &region);
    });
    if (!copied)
        return copied.error();
    if (const Status seen = counts_readback_.invalidate(); !seen)
        return seen.error();
    uint32_t count = 0;
    std::memcpy(&count, counts_readback_.mapped(), sizeof count);
    return count;
}

// One dispatch of light.comp or caps.comp over the band, and again for the pixels that the driver's loop limit stopped,
// each alone. Returns milliseconds. Fails: DeviceFailed, if one needs more even so.
Result<double> VulkanTracer::cast_free_rays(const ComputePipeline& pipeline, FrameView view)
{
    const bool limited = device_->is_software();
    const auto cast = [&](uint32_t groups_x, uint32_t groups_y) -> Result<double> {
        if (limited)
            if (const Status none = fill(kBindStopped, 0); !none)
                return none.error();
        return time_dispatch(pipeline, view, groups_x, groups_y);
    };
    Result<double> ms =
        cast((view.width + kGroupSide - 1) / kGroupSide, (view.row_count + kGroupSide - 1) / kGroupSide);
    if (!ms || !limited)
        return ms;
    const Result<uint32_t> count = read_stopped_count();
    if (!count)
        return count.error();
    if (*count == 0)
        return ms;
    Result<VulkanBuffer> list =
        VulkanBuffer::create(*device_, BufferUse::Readback, (*count + size_t{1}) * sizeof(uint32_t), "pixels to retry");
    if (!list)
        return list.error();
    const Status copied = device_->run([&](VkCommandBuffer commands) {
        const VkBufferCopy region{0, 0, (*count + size_t{1}) * sizeof(uint32_t)};
        device_->vk().vkCmdCopyBuffer(commands, buffers_[kBindStopped].handle(), list->handle(), 1, &region);
    });
    if (!copied)
        return copied.error();
    if (const Status seen = list->invalidate(); !seen)
        return seen.error();
    std::vector<uint32_t> pixels(*count);
    std::memcpy(pixels.data(), list->mapped() + sizeof(uint32_t), pixels.size() * sizeof(uint32_t));
    view.alone = 1;
    for (size_t first = 0; first < pixels.size(); first += kMostRetries) {
        const auto here = std::span(pixels).subspan(first, std::min<size_t>(kMostRetries, pixels.size() - first));
        if (const Status ready = set_retries(here); !ready)
            return ready.error();
        const Result<double> alone_ms = cast(static_cast<uint32_t>(here.size()), 1);
        if (!alone_ms)
            return alone_ms;
        const Result<uint32_t> left = read_stopped_count();
        if (!left)
            return left.error();
        if (*left > 0)
            return Error{ErrorCode::DeviceFailed, device_->name(),
                         fmt::format("rays from the hits of {} pixels need more loop iterations than this software "
                                     "driver runs; use --device cpu",
                                     *left)};
        *ms += *alone_ms;
    }
    return ms;
}

// Adds to the band's pixels the light that rays must be asked for. Returns milliseconds.
Result<double> VulkanTracer::gather_light(FrameView view)
{
    double ms = 0;
    const uint32_t at_once = device_->is_software() ? kSoftwareSamplesADispatch : kSamplesADispatch;
    const auto gather = [&](uint32_t light, uint32_t sample_count) -> Status {
        view.gathered = light;
        for (view.first_sample = 0; view.first_sample < sample_count; view.first_sample += at_once) {
            view.end_sample = std::min(view.first_sample + at_once, sample_count);
            const Result<double> some_ms = cast_free_rays(*use_.light, view);
            if (!some_ms)
                return some_ms.error();
            ms += *some_ms;
        }
        return Done{};
    };
    if (const Status sky = gather(kGatherSky, lights_.view.occlusion_samples); !sky)
        return sky.error();
    for (uint32_t i = 0; i < lights_.lights.size(); ++i) {
        const uint32_t kind = lights_.lights[i].kind;
        if ((kind & kLightShadows) == 0)
            continue;
        if (const Status lit = gather(i, (kind & kLightSoft) != 0 ? lights_.view.light_samples : 1); !lit)
            return lit.error();
    }
    return ms;
}

// Closes what section planes cut open in the band's pixels. Returns milliseconds.
Result<double> VulkanTracer::find_caps(FrameView view)
{
    double ms = 0;
    for (view.gathered = 0; view.gathered < kInsideQuestions; ++view.gathered) {
        const Result<double> some_ms = cast_free_rays(*use_.caps, view);
        if (!some_ms)
            return some_ms;
        ms += *some_ms;
    }
    return ms;
}

// Follows what mirrors in the band show. Returns milliseconds.
Result<double> VulkanTracer::follow_mirrors(FrameView view)
{
    double ms = 0;
    for (uint32_t i = 0; i <= lights_.view.mirror_depth; ++i) {
        view.gathered = i;
        const Result<double> mirror_ms = cast_free_rays(*use_.mirror, view);
        if (!mirror_ms)
            return mirror_ms;
        ms += *mirror_ms;
        if (i == lights_.view.mirror_depth)
            break;
        const Result<double> light_ms = gather_light(view);
        if (!light_ms)
            return light_ms;
        ms += *light_ms;
    }
    return ms;
}

// What the band's pixels see first, or behind the layers before. Returns milliseconds.
Result<double> VulkanTracer::trace_layer(FrameView view, uint32_t layer, bool read_back)
{
    view.gathered = layer;
    Result<double> ms = time_dispatch(*use_.primary, view, (view.width + kGroupSide - 1) / kGroupSide,
                                      (view.row_count + kGroupSide - 1) / kGroupSide);
    const auto add = [&ms](const Result<double>& more) { ms = more.ok() ? Result<double>(*ms + *more) : more; };
    if (ms.ok() && read_back && device_->is_software()) {
        if (const Status read = read_band(view); !read)
            return read.error();
        add(retrace_stopped(*use_.primary, view));
    }
    if (ms.ok() && use_.caps && layer == 0)
        add(find_caps(view));
    if (ms.ok() && use_.light)
        add(gather_light(view));
    if (ms.ok() && use_.mirror)
        add(follow_mirrors(view));
    return ms;
}

// Makes what dispatches call the pixels the first layer's, or those of the layers behind it.
void VulkanTracer::swap_layers()
{
    std::swap(buffers_[kBindPixels], layer_pixels_);
    behind_first_ = !behind_first_;
    for (ComputePipeline* pipeline : {use_.primary, use_.caps, use_.light, use_.mirror, use_.blend})
        if (pipeline)
            pipeline->set_buffers(bound_buffers());
}

// Adds a layer to what is seen, or finishes (kBlendAll). Returns milliseconds, and how many pixels show what is behind.
Result<std::pair<double, uint32_t>> VulkanTracer::blend(FrameView view, uint32_t layer)
{
    view.gathered = layer;
    if (const Status none = fill(kBindStopped, 0); !none)
        return none.error();
    const Result<double> ms = time_dispatch(*use_.blend, view, (view.width + kGroupSide - 1) / kGroupSide,
                                            (view.row_count + kGroupSide - 1) / kGroupSide);
    if (!ms)
        return ms.error();
    const Result<uint32_t> count = read_stopped_count();
    if (!count)
        return count.error();
    return std::pair{*ms, *count};
}

// Traces the layers of the band behind the first, and blends them. Returns milliseconds.
Result<double> VulkanTracer::trace_layers_behind(const FrameView& view, bool read_back)
{
    double ms = 0;
    Result<std::pair<double, uint32_t>> blended = blend(view, 0);
    for (uint32_t layer = 1; blended.ok() && blended->second > 0 && layer < kMostLayers; ++layer) {
        ms += blended->first;
        if (layer == 1)
            swap_layers();
        const Result<double> layer_ms = trace_layer(view, layer, read_back);
        if (layer_ms.ok()) {
            ms += *layer_ms;
            blended = blend(view, layer);
        } else
            blended = layer_ms.error();
    }
    if (behind_first_)
        swap_layers();
    if (!blended)
        return blended.error();
    const auto finished = blend(view, kBlendAll);
    return finished.ok() ? Result<double>(ms + finished->first) : Result<double>(finished.error());
}

Result<double> VulkanTracer::trace_band(const FrameView& view, bool read_back)
{
    Result<double> ms = trace_layer(view, 0, read_back);
    if (ms.ok() && use_.blend) {
        const Result<double> behind_ms = trace_layers_behind(view, read_back);
        if (!behind_ms)
            return behind_ms;
        *ms += *behind_ms;
    }
    const bool is_read = device_->is_software() && !use_.caps && !use_.light && !use_.mirror && !use_.blend;
    if (!ms || !read_back || is_read)
        return ms;
    const Status read = read_band(view);
    return read.ok() ? ms : Result<double>(read.error());
}

// Traces all bands; `frame` may be null, then nothing is read back. Returns milliseconds.
Result<double> VulkanTracer::trace_frame(FrameView view, uint32_t rows_per_band, Frame* frame)
{
    double ms = 0;
    for (view.first_row = 0; view.first_row < view.height; view.first_row += rows_per_band) {
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
    draw_effects(scene_->pack.image, options, run_each, edge_map_, frame);
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
    const auto rows_per_band = static_cast<uint32_t>(std::min<size_t>(
        {options.height, band_bytes / row_bytes, size_t{limits.maxComputeWorkGroupCount[1]} * kGroupSide}));

    if (const Status ready = upload_trims(*trim); !ready)
        return ready.error();
    const Result<FrameSetup> setup = frame_setup(*cpu_scene_, options);
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
    if (const Status none = forget_kept(); !none)
        return none.error();
    use_ = *counting;
    if (count_apart) {
        if (const Result<double> ms = trace_frame(view, rows_per_band, nullptr); !ms)
            return ms.error();
        if (const Status none = forget_kept(); !none)
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
        const Result<double> ms = trace_frame(view, rows_per_band, read ? &frame : nullptr);
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

} // namespace

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
