// A scene's arrays on a Vulkan device, and the constants to which the shader is specialised.
#pragma once

#include "format/derive_kd.h"
#include "format/result.h"
#include "runtime/camera.h"
#include "runtime/cpu_view.h"
#include "runtime/effect_plan.h"
#include "runtime/tracer.h"
#include "runtime/vk_buffer.h"
#include "runtime/vk_device.h"
#include "shaders/frame_layout.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace trimray {

/// The constants of primary.comp, by kSpec.... `count`: work counts are wanted.
using Specialisation = std::array<uint32_t, kFrameSpecs>;
Specialisation specialisation(const EffectPlan& plan, bool count);

/// Tells the view what a pipeline that is not specialised to it must know.
void decide_late(const EffectPlan& plan, FrameView& view);

/// The pack's arrays by binding (shaders/frame_layout.h); the bindings of a frame's own buffers stay empty.
/// Fails: DeviceFailed.
Result<std::array<VulkanBuffer, kFrameBindings>> upload_scene(VulkanDevice& device, const PackImage& image);

/// The top tree; one node without children where there is none. Fails: DeviceFailed.
Result<VulkanBuffer> upload_top_tree(VulkanDevice& device, std::span<const BvhNode> nodes);

/// The kd-trees' arrays by binding, beside those: all of one element if there are no trees. Fails: DeviceFailed.
Status upload_kd(VulkanDevice& device, const KdTrims& kd, std::array<VulkanBuffer, kFrameBindings>& buffers);

/// The view of a frame and its instances as the shader wants them, computed in double.
struct FrameSetup {
    FrameView view{};
    std::vector<FrameInstance> instances; // never empty: a scene without any gets one that nothing refers to
    // As camera_rays has them, and the tau there that hits are kept relative to; mm
    std::array<double, 3> eye{}, w0{}, step_x{}, step_y{};
    double tau_ref = 0;
};
/// Fails: InvalidPack (an instance whose transform has no inverse).
Result<FrameSetup> frame_setup(const CpuScene& scene, const PlacementView& placed, const RenderOptions& options);

} // namespace trimray
