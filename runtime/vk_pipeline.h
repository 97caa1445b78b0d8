// A compute pipeline whose only resources are storage buffers (set 0, binding i = buffer i) and push constants.
#pragma once

#include "format/result.h"
#include "runtime/vk_buffer.h"
#include "runtime/vk_device.h"

#include <cstdint>
#include <span>
#include <string>

namespace trimray {

class ComputePipeline {
public:
    ComputePipeline() = default;
    ~ComputePipeline();
    ComputePipeline(ComputePipeline&& other) noexcept;
    ComputePipeline& operator=(ComputePipeline&& other) noexcept;

    /// Compiles `spirv` with specialisation constant i = constants[i]. The device must outlive it.
    /// Fails: DeviceFailed.
    static Result<ComputePipeline> create(const VulkanDevice& device, std::span<const uint32_t> spirv,
                                          uint32_t buffer_count, uint32_t push_bytes,
                                          std::span<const uint32_t> constants);

    /// Points binding i to buffers[i]; not while a submission that uses the pipeline runs.
    void set_buffers(std::span<const VulkanBuffer* const> buffers);

    /// Binds the pipeline and its buffers, sets the push constants and dispatches workgroups.
    void dispatch(VkCommandBuffer commands, std::span<const std::byte> push, uint32_t groups_x,
                  uint32_t groups_y) const;

    /// Of the driver's program, as a pipeline cache that holds it alone tells; 0: it tells nothing.
    uint64_t size_bytes() const { return size_bytes_; }

private:
    const VulkanDevice* device_ = nullptr;
    VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
    VkPipelineLayout layout_ = VK_NULL_HANDLE;
    VkPipeline pipeline_ = VK_NULL_HANDLE;
    VkDescriptorPool pool_ = VK_NULL_HANDLE;
    VkDescriptorSet set_ = VK_NULL_HANDLE;
    uint64_t size_bytes_ = 0;
};

} // namespace trimray
