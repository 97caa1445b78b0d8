// A storage buffer in device memory and the ways into and out of it, through staging memory the host can see.
#pragma once

#include "format/result.h"
#include "runtime/vk_device.h"

#include <cstddef>
#include <span>
#include <string>

namespace trimray {

enum class BufferUse {
    Storage,  // device memory: filled by upload or by shaders
    Upload,   // host memory, written by the host
    Readback, // host memory, read by the host, cached where possible
};

class VulkanBuffer {
public:
    VulkanBuffer() = default;
    ~VulkanBuffer();
    VulkanBuffer(VulkanBuffer&& other) noexcept;
    VulkanBuffer& operator=(VulkanBuffer&& other) noexcept;

    /// A buffer of `size_bytes` (at least 16, so that empty arrays can be bound). Its contents are undefined. `name`
    /// is the array's, for messages. Host buffers stay mapped. The device must outlive it.
    /// Fails: DeviceFailed (storage larger than the device's maxStorageBufferRange, or memory at an end).
    static Result<VulkanBuffer> create(const VulkanDevice& device, BufferUse use, size_t size_bytes,
                                       const std::string& name);

    VkBuffer handle() const { return buffer_; }
    size_t size_bytes() const { return size_bytes_; }
    std::byte* mapped() const { return mapped_; }

    /// Makes what the device wrote visible to the host. Fails: DeviceFailed.
    Status invalidate() const;
    /// Makes what the host wrote visible to the device. Fails: DeviceFailed.
    Status flush() const;

private:
    const VulkanDevice* device_ = nullptr;
    VkBuffer buffer_ = VK_NULL_HANDLE;
    VkDeviceMemory memory_ = VK_NULL_HANDLE;
    size_t size_bytes_ = 0;
    std::byte* mapped_ = nullptr;
};

/// A storage buffer that holds `bytes`, copied through staging memory in pieces. Fails: DeviceFailed.
Result<VulkanBuffer> upload_storage(VulkanDevice& device, std::span<const std::byte> bytes, const std::string& name);

} // namespace trimray
