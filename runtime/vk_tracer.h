// The Vulkan tracer: what it holds between pictures. It uploads a scene once; what a picture needs beside that is made
// by vk_prepare.cpp, the dispatches of a band are in vk_passes.cpp, pictures as a whole in vk_tracer.cpp.
#pragma once

#include "runtime/arrangement.h"
#include "runtime/edge_map.h"
#include "runtime/effect_plan.h"
#include "runtime/light_view.h"
#include "runtime/materials.h"
#include "runtime/stochastic_frames.h"
#include "runtime/tracer.h"
#include "runtime/vk_buffer.h"
#include "runtime/vk_device.h"
#include "runtime/vk_pipeline.h"
#include "runtime/vk_scene.h"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace trimray {

// Pixels whose subgroup reached that limit are traced again, one by one, in dispatches of so many
constexpr uint32_t kMostRetries = 4096;

inline bool reuses_hits(const RenderOptions& options)
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
          facts_(pack_facts(scene_->pack.image)), own_stack_size_(facts_.stack_size)
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
    Status prepare_placements(const Arrangement& wanted);
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
    Status forget_kept(const EffectPlan& plan)
    {
        return plan.keeps_hits ? fill(kBindKept, std::bit_cast<uint32_t>(kNothingKept)) : Status(Done{});
    }
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
    Result<double> trace_frame(const RenderOptions& options, FrameView view, uint32_t rows_per_band, Frame* frame);
    void take_pixels(const FrameView& view, Frame& frame) const;
    void take_edges(const FrameView& view);
    void describe(RenderStats& stats) const;
    double draw(const RenderOptions& options, Frame& frame);

    std::unique_ptr<VulkanDevice> device_; // first: everything below must be gone before it
    std::shared_ptr<const Scene> scene_;
    std::shared_ptr<const CpuScene> cpu_scene_; // which side of shells the eye is on is found on the CPU
    PackFacts facts_;
    uint32_t own_stack_size_; // of the pack's own placements
    KeptArrangement arrangement_;
    bool top_tree_is_old_ = false; // that on the device is not the arrangement's
    size_t kd_bytes_ = 0;          // of the kd-trees on the device; 0: none yet
    std::array<VulkanBuffer, kFrameBindings> buffers_;
    VulkanBuffer readback_;        // of a band's pixels
    VulkanBuffer edges_readback_;  // of a band's edge words
    VulkanBuffer values_readback_; // of what a map measures in a band
    bool edges_wanted_ = false;
    EdgeMap edge_map_;
    std::array<uint32_t, 2> next_hits_size_{}; // of the picture whose hits kBindNextHits holds; 0 x 0: of none
    VulkanBuffer retries_upload_;              // of kMostRetries indices
    VulkanBuffer counts_readback_;
    FrameLights lights_; // of the picture at hand, and what its faces are made of; none: what the pack says
    std::optional<MaterialTable> materials_;
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

} // namespace trimray
