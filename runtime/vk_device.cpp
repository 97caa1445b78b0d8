#include "runtime/vk_device.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace trimray {

namespace {

constexpr uint32_t kApiVersion = VK_API_VERSION_1_2;
constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";
constexpr const char* kUseTheCpu = "install a Vulkan driver, or use --device cpu";

// One compute shader reads the pack through this many storage buffers and writes its results through the rest.
constexpr uint32_t kStorageBuffersNeeded = 16;

std::atomic<uint64_t> message_count{0};

// volk keeps the instance functions in globals; loading them and calling those that make or end an instance is
// serialised here. Recursive: what create() gives up ends inside it.
std::recursive_mutex& loader_mutex()
{
    static std::recursive_mutex mutex;
    return mutex;
}

VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                          const VkDebugUtilsMessengerCallbackDataEXT* data, void* user)
{
    message_count.fetch_add(1);
    auto* log = static_cast<ValidationLog*>(user);
    const std::scoped_lock lock(log->mutex);
    log->messages.emplace_back(data->pMessage ? data->pMessage : "(no text)");
    return VK_FALSE;
}

VkDebugUtilsMessengerCreateInfoEXT messenger_info(ValidationLog* log)
{
    auto info = vk_struct<VkDebugUtilsMessengerCreateInfoEXT>(VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT);
    info.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    // "general" messages are the loader's (drivers of other vendors that do not load): not ours to answer for
    info.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
    info.pfnUserCallback = on_message;
    info.pUserData = log;
    return info;
}

bool layer_present(const char* name)
{
    uint32_t count = 0;
    vkEnumerateInstanceLayerProperties(&count, nullptr);
    std::vector<VkLayerProperties> layers(count);
    vkEnumerateInstanceLayerProperties(&count, layers.data());
    return std::any_of(layers.begin(), layers.end(),
                       [&](const VkLayerProperties& layer) { return std::strcmp(layer.layerName, name) == 0; });
}

Error no_device(const std::string& detail)
{
    return Error{ErrorCode::NoDevice, "Vulkan", detail};
}

constexpr uint32_t kNoFamily = UINT32_MAX;

// A family with compute, preferring one without graphics (asynchronous compute does not stall a desktop).
uint32_t compute_family(VkPhysicalDevice device, uint32_t& timestamp_bits)
{
    uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
    uint32_t best = kNoFamily;
    for (uint32_t i = 0; i < count; ++i) {
        if (!(families[i].queueFlags & VK_QUEUE_COMPUTE_BIT))
            continue;
        if (best == kNoFamily ||
            ((families[best].queueFlags & VK_QUEUE_GRAPHICS_BIT) && !(families[i].queueFlags & VK_QUEUE_GRAPHICS_BIT)))
            best = i;
    }
    timestamp_bits = best == kNoFamily ? 0 : families[best].timestampValidBits;
    return best;
}

// Empty: the device can trace. Else what it lacks.
std::string missing_abilities(VkPhysicalDevice device)
{
    auto subgroup =
        vk_struct<VkPhysicalDeviceSubgroupProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES);
    auto properties = vk_struct<VkPhysicalDeviceProperties2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2);
    vkGetPhysicalDeviceProperties(device, &properties.properties);
    if (properties.properties.apiVersion < kApiVersion)
        return fmt::format("has Vulkan {}.{}, needs 1.2", VK_API_VERSION_MAJOR(properties.properties.apiVersion),
                           VK_API_VERSION_MINOR(properties.properties.apiVersion));
    properties.pNext = &subgroup;
    vkGetPhysicalDeviceProperties2(device, &properties);
    auto features12 =
        vk_struct<VkPhysicalDeviceVulkan12Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES);
    auto features = vk_struct<VkPhysicalDeviceFeatures2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2);
    features.pNext = &features12;
    vkGetPhysicalDeviceFeatures2(device, &features);
    if (!features12.scalarBlockLayout)
        return "lacks scalarBlockLayout";
    if (!(subgroup.supportedOperations & VK_SUBGROUP_FEATURE_ARITHMETIC_BIT) ||
        !(subgroup.supportedStages & VK_SHADER_STAGE_COMPUTE_BIT))
        return "lacks subgroup arithmetic in compute shaders";
    if (properties.properties.limits.maxPerStageDescriptorStorageBuffers < kStorageBuffersNeeded)
        return fmt::format("has {} storage buffers a stage, needs {}",
                           properties.properties.limits.maxPerStageDescriptorStorageBuffers, kStorageBuffersNeeded);
    uint32_t bits = 0;
    if (compute_family(device, bits) == kNoFamily)
        return "has no compute queue";
    return {};
}

// Order of choice; larger is better, 0: not without leave.
int preference(VkPhysicalDeviceType type)
{
    switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
        return 4;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
        return 3;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
        return 2;
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
        return 0;
    default:
        return 1;
    }
}

} // namespace

std::string vk_result_name(VkResult result)
{
    switch (result) {
    case VK_SUCCESS:
        return "VK_SUCCESS";
    case VK_NOT_READY:
        return "VK_NOT_READY";
    case VK_TIMEOUT:
        return "VK_TIMEOUT";
    case VK_INCOMPLETE:
        return "VK_INCOMPLETE";
    case VK_ERROR_OUT_OF_HOST_MEMORY:
        return "VK_ERROR_OUT_OF_HOST_MEMORY";
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
        return "VK_ERROR_OUT_OF_DEVICE_MEMORY";
    case VK_ERROR_INITIALIZATION_FAILED:
        return "VK_ERROR_INITIALIZATION_FAILED";
    case VK_ERROR_DEVICE_LOST:
        return "VK_ERROR_DEVICE_LOST";
    case VK_ERROR_MEMORY_MAP_FAILED:
        return "VK_ERROR_MEMORY_MAP_FAILED";
    case VK_ERROR_LAYER_NOT_PRESENT:
        return "VK_ERROR_LAYER_NOT_PRESENT";
    case VK_ERROR_EXTENSION_NOT_PRESENT:
        return "VK_ERROR_EXTENSION_NOT_PRESENT";
    case VK_ERROR_FEATURE_NOT_PRESENT:
        return "VK_ERROR_FEATURE_NOT_PRESENT";
    case VK_ERROR_INCOMPATIBLE_DRIVER:
        return "VK_ERROR_INCOMPATIBLE_DRIVER";
    case VK_ERROR_TOO_MANY_OBJECTS:
        return "VK_ERROR_TOO_MANY_OBJECTS";
    case VK_ERROR_OUT_OF_POOL_MEMORY:
        return "VK_ERROR_OUT_OF_POOL_MEMORY";
    case VK_ERROR_FRAGMENTATION:
        return "VK_ERROR_FRAGMENTATION";
    case VK_ERROR_INVALID_SHADER_NV:
        return "VK_ERROR_INVALID_SHADER_NV";
    default:
        return fmt::format("VkResult {}", static_cast<int>(result));
    }
}

Error vk_failure(const std::string& call, VkResult result)
{
    std::string detail = vk_result_name(result);
    if (result == VK_ERROR_DEVICE_LOST)
        detail += ": the driver gave the device up, often a frame that took too long; a smaller picture may pass";
    if (result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY)
        detail += ": the scene or the picture is too large for this device; use --device cpu or a smaller --size";
    return Error{ErrorCode::DeviceFailed, call, detail};
}

uint64_t vk_validation_message_count()
{
    return message_count.load();
}

Status VulkanDevice::create_instance(bool validation)
{
    if (volkInitialize() != VK_SUCCESS)
        return no_device(fmt::format("no Vulkan loader (libvulkan.so.1) on this machine; {}", kUseTheCpu));
    if (volkGetInstanceVersion() < kApiVersion)
        return no_device(fmt::format("the Vulkan loader is {}.{}, needs 1.2; {}",
                                     VK_API_VERSION_MAJOR(volkGetInstanceVersion()),
                                     VK_API_VERSION_MINOR(volkGetInstanceVersion()), kUseTheCpu));

    auto application = vk_struct<VkApplicationInfo>(VK_STRUCTURE_TYPE_APPLICATION_INFO);
    application.pApplicationName = "trimray";
    application.apiVersion = kApiVersion;
    auto info = vk_struct<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
    info.pApplicationInfo = &application;

    log_ = std::make_unique<ValidationLog>();
    VkDebugUtilsMessengerCreateInfoEXT messenger = messenger_info(log_.get());
    const VkValidationFeatureEnableEXT enabled[] = {VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
    auto features = vk_struct<VkValidationFeaturesEXT>(VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT);
    const char* extensions[] = {VK_EXT_DEBUG_UTILS_EXTENSION_NAME};
    if (validation) {
        if (!layer_present(kValidationLayer))
            return no_device(fmt::format("validation was asked for, but the layer {} is not installed "
                                         "(package vulkan-validationlayers)",
                                         kValidationLayer));
        features.enabledValidationFeatureCount = 1;
        features.pEnabledValidationFeatures = enabled;
        messenger.pNext = &features; // also watches vkCreateInstance and vkDestroyInstance
        info.pNext = &messenger;
        info.enabledLayerCount = 1;
        info.ppEnabledLayerNames = &kValidationLayer;
        info.enabledExtensionCount = 1;
        info.ppEnabledExtensionNames = extensions;
    }
    const VkResult created = vkCreateInstance(&info, nullptr, &instance_);
    if (created == VK_ERROR_INCOMPATIBLE_DRIVER)
        return no_device(fmt::format("the Vulkan loader found no driver; {}", kUseTheCpu));
    if (created != VK_SUCCESS)
        return vk_failure("vkCreateInstance", created);
    volkLoadInstanceOnly(instance_);
    if (validation) {
        messenger.pNext = nullptr;
        const VkResult result = vkCreateDebugUtilsMessengerEXT(instance_, &messenger, nullptr, &messenger_);
        if (result != VK_SUCCESS)
            return vk_failure("vkCreateDebugUtilsMessengerEXT", result);
    }
    return Done{};
}

Status VulkanDevice::choose_physical_device(bool allow_software)
{
    uint32_t count = 0;
    VkResult result = vkEnumeratePhysicalDevices(instance_, &count, nullptr);
    std::vector<VkPhysicalDevice> devices(count);
    if (result == VK_SUCCESS && count > 0)
        result = vkEnumeratePhysicalDevices(instance_, &count, devices.data());
    // drivers that find no hardware may fail instead of reporting nothing
    if (result == VK_ERROR_INITIALIZATION_FAILED || count == 0)
        return no_device(fmt::format("the Vulkan drivers found no device; {}", kUseTheCpu));
    if (result != VK_SUCCESS && result != VK_INCOMPLETE)
        return vk_failure("vkEnumeratePhysicalDevices", result);

    std::string found;
    int best = -1;
    for (const VkPhysicalDevice device : devices) {
        VkPhysicalDeviceProperties properties{};
        vkGetPhysicalDeviceProperties(device, &properties);
        std::string refusal = missing_abilities(device);
        if (refusal.empty() && properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU && !allow_software)
            refusal = "is a software driver, which is slower than --device cpu";
        if (!refusal.empty())
            found += fmt::format("{}{} {}", found.empty() ? "" : "; ", properties.deviceName, refusal);
        else if (preference(properties.deviceType) > best) {
            best = preference(properties.deviceType);
            physical_ = device;
            properties_ = properties;
        }
    }
    if (best < 0)
        return no_device(fmt::format("no Vulkan device can trace: {}. Use --device cpu", found));
    queue_family_ = compute_family(physical_, timestamp_bits_);
    vkGetPhysicalDeviceMemoryProperties(physical_, &memory_);
    return Done{};
}

Status VulkanDevice::create_device()
{
    const float priority = 1.0f;
    auto queue = vk_struct<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
    queue.queueFamilyIndex = queue_family_;
    queue.queueCount = 1;
    queue.pQueuePriorities = &priority;
    auto features12 =
        vk_struct<VkPhysicalDeviceVulkan12Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES);
    features12.scalarBlockLayout = VK_TRUE;
    auto info = vk_struct<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO);
    info.pNext = &features12;
    info.queueCreateInfoCount = 1;
    info.pQueueCreateInfos = &queue;
    VkResult result = vkCreateDevice(physical_, &info, nullptr, &device_);
    if (result != VK_SUCCESS)
        return vk_failure("vkCreateDevice", result);
    volkLoadDeviceTable(&vk_, device_);
    vk_.vkGetDeviceQueue(device_, queue_family_, 0, &queue_);

    auto pool = vk_struct<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
    pool.flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT;
    pool.queueFamilyIndex = queue_family_;
    result = vk_.vkCreateCommandPool(device_, &pool, nullptr, &pool_);
    if (result != VK_SUCCESS)
        return vk_failure("vkCreateCommandPool", result);
    const VkFenceCreateInfo fence{VK_STRUCTURE_TYPE_FENCE_CREATE_INFO, nullptr, 0};
    result = vk_.vkCreateFence(device_, &fence, nullptr, &fence_);
    if (result != VK_SUCCESS)
        return vk_failure("vkCreateFence", result);
    return Done{};
}

Result<std::unique_ptr<VulkanDevice>> VulkanDevice::create(bool allow_software, bool validation)
{
    const std::scoped_lock lock(loader_mutex());
    std::unique_ptr<VulkanDevice> device(new VulkanDevice);
    Status status = device->create_instance(validation);
    if (status.ok())
        status = device->choose_physical_device(allow_software);
    if (status.ok())
        status = device->create_device();
    if (!status.ok())
        return status.error();
    return device;
}

VulkanDevice::~VulkanDevice()
{
    const std::scoped_lock lock(loader_mutex());
    if (device_) {
        vk_.vkDeviceWaitIdle(device_);
        vk_.vkDestroyFence(device_, fence_, nullptr);
        vk_.vkDestroyCommandPool(device_, pool_, nullptr);
        vk_.vkDestroyDevice(device_, nullptr);
    }
    if (messenger_)
        vkDestroyDebugUtilsMessengerEXT(instance_, messenger_, nullptr);
    if (instance_)
        vkDestroyInstance(instance_, nullptr);
}

std::string VulkanDevice::name() const
{
    return fmt::format("{}, Vulkan {}.{}.{}", properties_.deviceName, VK_API_VERSION_MAJOR(properties_.apiVersion),
                       VK_API_VERSION_MINOR(properties_.apiVersion), VK_API_VERSION_PATCH(properties_.apiVersion));
}

uint32_t VulkanDevice::memory_type(uint32_t allowed_bits, VkMemoryPropertyFlags wanted,
                                   VkMemoryPropertyFlags preferred) const
{
    uint32_t best = UINT32_MAX;
    for (uint32_t i = 0; i < memory_.memoryTypeCount; ++i) {
        const VkMemoryPropertyFlags flags = memory_.memoryTypes[i].propertyFlags;
        if (!(allowed_bits & (1u << i)) || (flags & wanted) != wanted)
            continue;
        if ((flags & preferred) == preferred)
            return i;
        if (best == UINT32_MAX)
            best = i;
    }
    return best;
}

Status VulkanDevice::run(const std::function<void(VkCommandBuffer)>& record)
{
    auto allocate = vk_struct<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
    allocate.commandPool = pool_;
    allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    allocate.commandBufferCount = 1;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    VkResult result = vk_.vkAllocateCommandBuffers(device_, &allocate, &commands);
    if (result != VK_SUCCESS)
        return vk_failure("vkAllocateCommandBuffers", result);

    const char* call = "vkBeginCommandBuffer";
    auto begin = vk_struct<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    result = vk_.vkBeginCommandBuffer(commands, &begin);
    if (result == VK_SUCCESS) {
        // whatever earlier submissions wrote can be read from here on, and what this one writes by the host
        auto barrier = vk_struct<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
        barrier.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
        barrier.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
        vk_.vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 1,
                                 &barrier, 0, nullptr, 0, nullptr);
        record(commands);
        barrier.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
        vk_.vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1,
                                 &barrier, 0, nullptr, 0, nullptr);
        call = "vkEndCommandBuffer";
        result = vk_.vkEndCommandBuffer(commands);
    }
    if (result == VK_SUCCESS) {
        call = "vkQueueSubmit";
        auto submit = vk_struct<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
        submit.commandBufferCount = 1;
        submit.pCommandBuffers = &commands;
        result = vk_.vkQueueSubmit(queue_, 1, &submit, fence_);
    }
    if (result == VK_SUCCESS) {
        call = "vkWaitForFences";
        result = vk_.vkWaitForFences(device_, 1, &fence_, VK_TRUE, UINT64_MAX);
    }
    if (result == VK_SUCCESS) {
        call = "vkResetFences";
        result = vk_.vkResetFences(device_, 1, &fence_);
    }
    // a lost device counts as idle, so the buffer can be freed either way
    vk_.vkFreeCommandBuffers(device_, pool_, 1, &commands);
    return result == VK_SUCCESS ? Status(Done{}) : Status(vk_failure(call, result));
}

Status VulkanDevice::validation_status() const
{
    const std::scoped_lock lock(log_->mutex);
    if (log_->messages.empty())
        return Done{};
    return Error{ErrorCode::DeviceFailed, fmt::format("{} validation message(s)", log_->messages.size()),
                 log_->messages.front()};
}

} // namespace trimray
