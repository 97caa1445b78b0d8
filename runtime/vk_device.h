// One Vulkan device with one compute queue, without windows: choosing it, submitting work to it and naming what went
// wrong. Functions of the device are called through its own table, so several devices can live side by side.
#pragma once

#include "format/result.h"

#include <volk.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace trimray {

/// A Vulkan structure of zeros with its type set.
template <class T>
T vk_struct(VkStructureType type)
{
    T made{};
    made.sType = type;
    return made;
}

/// The result's name in the API, as "VK_ERROR_DEVICE_LOST".
std::string vk_result_name(VkResult result);

/// DeviceFailed naming the call and its result.
Error vk_failure(const std::string& call, VkResult result);

/// What the layers said, gathered from any thread. Every message is an error: the tracer causes none.
struct ValidationLog {
    std::mutex mutex;
    std::vector<std::string> messages;
};

/// Messages of the validation layers in this process so far, those at destruction included.
uint64_t vk_validation_message_count();

class VulkanDevice {
public:
    /// Picks a discrete GPU, else an integrated or virtual one, else (only if `allow_software`) a software driver; the
    /// first of equals. `validation`: the Khronos validation layer with its synchronisation checks.
    /// Fails: NoDevice, whose detail says what was found and what each device lacks; DeviceFailed.
    static Result<std::unique_ptr<VulkanDevice>> create(bool allow_software, bool validation);
    ~VulkanDevice();
    VulkanDevice(const VulkanDevice&) = delete;
    VulkanDevice& operator=(const VulkanDevice&) = delete;

    const VolkDeviceTable& vk() const { return vk_; }
    VkDevice handle() const { return device_; }
    const VkPhysicalDeviceProperties& properties() const { return properties_; }
    std::string name() const; // "llvmpipe (LLVM 15.0.6, 256 bits), Vulkan 1.3.230"
    bool is_software() const { return properties_.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU; }

    /// Timestamps tick every `nanoseconds` on this queue and keep `bits` bits; 0 bits: none.
    uint32_t timestamp_bits() const { return timestamp_bits_; }

    /// Index of a memory type among `allowed_bits` with all of `wanted`, preferring those with `preferred` too.
    /// Returns UINT32_MAX where there is none.
    uint32_t memory_type(uint32_t allowed_bits, VkMemoryPropertyFlags wanted, VkMemoryPropertyFlags preferred) const;

    /// Records commands, submits them and waits until they are done. Fails: DeviceFailed.
    Status run(const std::function<void(VkCommandBuffer)>& record);

    /// The first message of the validation layers as an error, or success. Messages already returned stay.
    Status validation_status() const;

private:
    VulkanDevice() = default;
    Status create_instance(bool validation);
    Status choose_physical_device(bool allow_software);
    Status create_device();

    VkInstance instance_ = VK_NULL_HANDLE;
    VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
    VkPhysicalDevice physical_ = VK_NULL_HANDLE;
    VkPhysicalDeviceProperties properties_{};
    VkPhysicalDeviceMemoryProperties memory_{};
    uint32_t queue_family_ = 0;
    uint32_t timestamp_bits_ = 0;
    VkDevice device_ = VK_NULL_HANDLE;
    VkQueue queue_ = VK_NULL_HANDLE;
    VkCommandPool pool_ = VK_NULL_HANDLE;
    VkFence fence_ = VK_NULL_HANDLE;
    VolkDeviceTable vk_{};
    std::unique_ptr<ValidationLog> log_;
};

} // namespace trimray
