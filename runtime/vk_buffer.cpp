#include "runtime/vk_buffer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace trimray {

namespace {

constexpr size_t kLeastBytes = 16;
constexpr size_t kStagingBytes = size_t{16} << 20; // large enough that a copy's fixed cost does not show

struct Use {
    VkBufferUsageFlags usage;
    VkMemoryPropertyFlags wanted;
    VkMemoryPropertyFlags preferred;
};

Use use_of(BufferUse use)
{
    switch (use) {
    case BufferUse::Upload:
        return {VK_BUFFER_USAGE_TRANSFER_SRC_BIT, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT,
                VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT};
    case BufferUse::Readback:
        return {VK_BUFFER_USAGE_TRANSFER_DST_BIT, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT,
                VK_MEMORY_PROPERTY_HOST_CACHED_BIT};
    case BufferUse::Storage:
        break;
    }
    return {VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT, 0,
            VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT};
}

} // namespace

VulkanBuffer::~VulkanBuffer()
{
    if (!device_)
        return;
    device_->vk().vkDestroyBuffer(device_->handle(), buffer_, nullptr);
    device_->vk().vkFreeMemory(device_->handle(), memory_, nullptr); // unmaps
}

VulkanBuffer::VulkanBuffer(VulkanBuffer&& other) noexcept
    : device_(std::exchange(other.device_, nullptr)), buffer_(other.buffer_), memory_(other.memory_),
      size_bytes_(other.size_bytes_), mapped_(other.mapped_)
{
}

VulkanBuffer& VulkanBuffer::operator=(VulkanBuffer&& other) noexcept
{
    std::swap(device_, other.device_);
    std::swap(buffer_, other.buffer_);
    std::swap(memory_, other.memory_);
    std::swap(size_bytes_, other.size_bytes_);
    std::swap(mapped_, other.mapped_);
    return *this;
}

Result<VulkanBuffer> VulkanBuffer::create(const VulkanDevice& device, BufferUse use, size_t size_bytes,
                                          const std::string& name)
{
    const size_t limit_bytes = device.properties().limits.maxStorageBufferRange;
    if (use == BufferUse::Storage && size_bytes > limit_bytes)
        return Error{ErrorCode::DeviceFailed, name,
                     fmt::format("takes {} bytes, but {} reads at most {} bytes from a buffer; use --device cpu",
                                 size_bytes, device.properties().deviceName, limit_bytes)};

    VulkanBuffer buffer;
    buffer.device_ = &device;
    buffer.size_bytes_ = std::max(size_bytes, kLeastBytes);
    const Use how = use_of(use);
    auto info = vk_struct<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
    info.size = buffer.size_bytes_;
    info.usage = how.usage;
    info.sharingMode = VK_SHARING_MODE_EXCLUSIVE;
    VkResult result = device.vk().vkCreateBuffer(device.handle(), &info, nullptr, &buffer.buffer_);
    if (result != VK_SUCCESS)
        return vk_failure(fmt::format("vkCreateBuffer for {}", name), result);

    VkMemoryRequirements needs{};
    device.vk().vkGetBufferMemoryRequirements(device.handle(), buffer.buffer_, &needs);
    auto allocate = vk_struct<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
    allocate.allocationSize = needs.size;
    allocate.memoryTypeIndex = device.memory_type(needs.memoryTypeBits, how.wanted, how.preferred);
    if (allocate.memoryTypeIndex == UINT32_MAX)
        return Error{ErrorCode::DeviceFailed, name, "the device has no memory of the kind it needs"};
    result = device.vk().vkAllocateMemory(device.handle(), &allocate, nullptr, &buffer.memory_);
    if (result != VK_SUCCESS)
        return vk_failure(fmt::format("vkAllocateMemory of {} bytes for {}", needs.size, name), result);
    result = device.vk().vkBindBufferMemory(device.handle(), buffer.buffer_, buffer.memory_, 0);
    if (result != VK_SUCCESS)
        return vk_failure(fmt::format("vkBindBufferMemory for {}", name), result);
    if (use != BufferUse::Storage) {
        void* mapped = nullptr;
        result = device.vk().vkMapMemory(device.handle(), buffer.memory_, 0, VK_WHOLE_SIZE, 0, &mapped);
        if (result != VK_SUCCESS)
            return vk_failure(fmt::format("vkMapMemory for {}", name), result);
        buffer.mapped_ = static_cast<std::byte*>(mapped);
    }
    return buffer;
}

Status VulkanBuffer::invalidate() const
{
    auto range = vk_struct<VkMappedMemoryRange>(VK_STRUCTURE_TYPE_MAPPED_MEMORY_RANGE);
    range.memory = memory_;
    range.size = VK_WHOLE_SIZE;
    const VkResult result = device_->vk().vkInvalidateMappedMemoryRanges(device_->handle(), 1, &range);
    return result == VK_SUCCESS ? Status(Done{}) : Status(vk_failure("vkInvalidateMappedMemoryRanges", result));
}

Status VulkanBuffer::flush() const
{
    auto range = vk_struct<VkMappedMemoryRange>(VK_STRUCTURE_TYPE_MAPPED_MEMORY_RANGE);
    range.memory = memory_;
    range.size = VK_WHOLE_SIZE;
    const VkResult result = device_->vk().vkFlushMappedMemoryRanges(device_->handle(), 1, &range);
    return result == VK_SUCCESS ? Status(Done{}) : Status(vk_failure("vkFlushMappedMemoryRanges", result));
}

Result<VulkanBuffer> upload_storage(VulkanDevice& device, std::span<const std::byte> bytes, const std::string& name)
{
    Result<VulkanBuffer> storage = VulkanBuffer::create(device, BufferUse::Storage, bytes.size(), name);
    if (!storage || bytes.empty())
        return storage;
    const Result<VulkanBuffer> staging =
        VulkanBuffer::create(device, BufferUse::Upload, std::min(bytes.size(), kStagingBytes), name + " (staging)");
    if (!staging)
        return staging.error();
    for (size_t done = 0; done < bytes.size(); done += kStagingBytes) {
        const size_t count = std::min(kStagingBytes, bytes.size() - done);
        std::memcpy(staging->mapped(), bytes.data() + done, count);
        if (const Status flushed = staging->flush(); !flushed)
            return flushed.error();
        // submitting makes the host's writes visible; waiting for the fence ends the copy before the next begins
        const Status copied = device.run([&](VkCommandBuffer commands) {
            const VkBufferCopy region{0, done, count};
            device.vk().vkCmdCopyBuffer(commands, staging->handle(), storage->handle(), 1, &region);
        });
        if (!copied)
            return copied.error();
    }
    return storage;
}

} // namespace trimray
