// What a picture needs on the device beside the scene: buffers that are made when they are first asked for, and none
// for what it has not.
#include "runtime/border_cells.h"
#include "runtime/frame_effects.h"
#include "runtime/section_view.h"
#include "runtime/surface_map.h"
#include "runtime/vk_tracer.h"
#include "shaders/look_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace trimray {
namespace {

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

} // namespace

// Puts placements where the scene wants them: another tree over them, and nothing left of what hung on the last one.
Status VulkanTracer::prepare_placements(const Arrangement& wanted)
{
    const PackImage& image = scene_->pack.image;
    const Result<bool> changed = arrangement_.change_to(image, wanted);
    if (!changed)
        return changed.error();
    top_tree_is_old_ = top_tree_is_old_ || *changed;
    if (!top_tree_is_old_)
        return Done{};
    const PlacementView placed = arrangement_.view(image);
    Result<VulkanBuffer> top_tree = upload_top_tree(*device_, placed.top_nodes);
    if (!top_tree)
        return top_tree.error();
    buffers_[kBindTopNodes] = std::move(*top_tree);
    buffers_[kBindToPart] = VulkanBuffer();
    next_hits_size_ = {}; // the last picture's hits may be of what is hidden now
    // never less than for the pack's own, so that pipelines seldom differ
    facts_.stack_size = std::max(own_stack_size_, stack_size(facts_.part_tree_depth, placed.top_nodes));
    top_tree_is_old_ = false;
    return Done{};
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

// Uploads the borders' cells when a picture first asks for them, and makes the buffers of a band's edge words.
Status VulkanTracer::prepare_edges(const RenderOptions& options, uint32_t rows_per_band)
{
    const EdgeQuery query = edge_query(options);
    edges_wanted_ = has_effects(options) && query.any();
    if (has_effects(options))
        edge_map_.resize(options.width, options.height, query.line_reach_px > 0, query.border_reach_px > 0);
    if (!edges_wanted_)
        return Done{};
    if (buffers_[kBindBorders].size_bytes() == 0) {
        const BorderCells cells = make_border_cells(scene_->pack.image);
        if (const Status uploaded = upload(kBindBorders, std::as_bytes(std::span(cells.words)), "the borders' cells");
            !uploaded)
            return uploaded;
    }
    const size_t band_bytes = size_t{rows_per_band} * options.width * 2 * sizeof(uint32_t);
    if (buffers_[kBindEdges].size_bytes() < band_bytes) {
        Result<VulkanBuffer> edges = VulkanBuffer::create(*device_, BufferUse::Storage, band_bytes, "the edges");
        if (!edges)
            return edges.error();
        buffers_[kBindEdges] = std::move(*edges);
    }
    if (edges_readback_.size_bytes() < band_bytes) {
        Result<VulkanBuffer> readback = VulkanBuffer::create(*device_, BufferUse::Readback, band_bytes, "the edges");
        if (!readback)
            return readback.error();
        edges_readback_ = std::move(*readback);
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
    const PlacementView placed = arrangement_.view(image);
    const SceneLook& scene_look = options.look;
    const ViewRays rays{setup.eye, setup.w0, setup.step_x, setup.step_y, setup.tau_ref};
    LookFrame look{};
    look.places = place_view(placed, rays);
    if (plan.cut)
        look.section = section_view(placed, scene_look.section, rays);
    if (mapped)
        look.map = map_view(image, scene_look.map);
    if (plan.lit) {
        lights_ = frame_lights(placed, options);
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
        const std::vector<WorldToPart> to_part = world_to_part(placed);
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
    materials_.reset();
    if (plan.materials) {
        Result<MaterialTable> table = resolve_materials(scene_->pack.image, options.look);
        if (!table)
            return table.error();
        materials_ = std::move(*table);
        const std::vector<uint32_t> words = material_words(*materials_);
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

// For pictures of many frames, not certified.
Status VulkanTracer::prepare_kept(const RenderOptions& options)
{
    if (!keeps_hits(options))
        return Done{};
    return prepare_hits({kBindKept}, size_t{options.width} * options.height, sizeof(KeptHit), "--frames");
}

// Makes what the last picture left what this one begins from. Returns whether there was one of this size. All frames of
// a picture begin from the same.
Result<bool> VulkanTracer::prepare_last_hits(const RenderOptions& options)
{
    if (!reuses_hits(options))
        return false;
    if (const Status ready = prepare_hits({kBindLastHits, kBindNextHits}, size_t{options.width} * options.height,
                                          sizeof(LastHit), "RenderOptions::reuse_last");
        !ready)
        return ready.error();
    const bool has_last = std::exchange(next_hits_size_, {}) == std::array{options.width, options.height};
    if (has_last) {
        std::swap(buffers_[kBindLastHits], buffers_[kBindNextHits]);
        return true;
    }
    if (const Status none = fill(kBindLastHits, kNoLeaf); !none)
        return none.error();
    return false;
}

} // namespace trimray
