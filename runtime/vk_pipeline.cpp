#include "runtime/vk_pipeline.h"

#include <utility>
#include <vector>

namespace trimray {
namespace {

uint64_t cache_bytes(const VulkanDevice& device, VkPipelineCache cache)
{
    size_t bytes = 0;
    const VkResult result = device.vk().vkGetPipelineCacheData(device.handle(), cache, &bytes, nullptr);
    return result == VK_SUCCESS ? bytes : 0;
}

} // namespace

ComputePipeline::~ComputePipeline()
{
    if (!device_)
        return;
    const VolkDeviceTable& vk = device_->vk();
    vk.vkDestroyDescriptorPool(device_->handle(), pool_, nullptr); // frees the set
    vk.vkDestroyPipeline(device_->handle(), pipeline_, nullptr);
    vk.vkDestroyPipelineLayout(device_->handle(), layout_, nullptr);
    vk.vkDestroyDescriptorSetLayout(device_->handle(), set_layout_, nullptr);
}

ComputePipeline::ComputePipeline(ComputePipeline&& other) noexcept
    : device_(std::exchange(other.device_, nullptr)), set_layout_(other.set_layout_), layout_(other.layout_),
      pipeline_(other.pipeline_), pool_(other.pool_), set_(other.set_), size_bytes_(other.size_bytes_)
{
}

ComputePipeline& ComputePipeline::operator=(ComputePipeline&& other) noexcept
{
    std::swap(device_, other.device_);
    std::swap(set_layout_, other.set_layout_);
    std::swap(layout_, other.layout_);
    std::swap(pipeline_, other.pipeline_);
    std::swap(pool_, other.pool_);
    std::swap(set_, other.set_);
    std::swap(size_bytes_, other.size_bytes_);
    return *this;
}

Result<ComputePipeline> ComputePipeline::create(const VulkanDevice& device, std::span<const uint32_t> spirv,
                                                uint32_t buffer_count, uint32_t push_bytes,
                                                std::span<const uint32_t> constants)
{
    const VolkDeviceTable& vk = device.vk();
    ComputePipeline made;
    made.device_ = &device;

    std::vector<VkDescriptorSetLayoutBinding> bindings(buffer_count);
    for (uint32_t i = 0; i < buffer_count; ++i)
        bindings[i] = {i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
    auto set_layout = vk_struct<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
    set_layout.bindingCount = buffer_count;
    set_layout.pBindings = bindings.data();
    VkResult result = vk.vkCreateDescriptorSetLayout(device.handle(), &set_layout, nullptr, &made.set_layout_);
    if (result != VK_SUCCESS)
        return vk_failure("vkCreateDescriptorSetLayout", result);

    const VkPushConstantRange push{VK_SHADER_STAGE_COMPUTE_BIT, 0, push_bytes};
    auto layout = vk_struct<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
    layout.setLayoutCount = 1;
    layout.pSetLayouts = &made.set_layout_;
    layout.pushConstantRangeCount = 1;
    layout.pPushConstantRanges = &push;
    result = vk.vkCreatePipelineLayout(device.handle(), &layout, nullptr, &made.layout_);
    if (result != VK_SUCCESS)
        return vk_failure("vkCreatePipelineLayout", result);

    const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, buffer_count};
    auto pool = vk_struct<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
    pool.maxSets = 1;
    pool.poolSizeCount = 1;
    pool.pPoolSizes = &size;
    result = vk.vkCreateDescriptorPool(device.handle(), &pool, nullptr, &made.pool_);
    if (result != VK_SUCCESS)
        return vk_failure("vkCreateDescriptorPool", result);
    auto allocate = vk_struct<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
    allocate.descriptorPool = made.pool_;
    allocate.descriptorSetCount = 1;
    allocate.pSetLayouts = &made.set_layout_;
    result = vk.vkAllocateDescriptorSets(device.handle(), &allocate, &made.set_);
    if (result != VK_SUCCESS)
        return vk_failure("vkAllocateDescriptorSets", result);

    auto module_info = vk_struct<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
    module_info.codeSize = spirv.size_bytes();
    module_info.pCode = spirv.data();
    VkShaderModule module = VK_NULL_HANDLE;
    result = vk.vkCreateShaderModule(device.handle(), &module_info, nullptr, &module);
    if (result != VK_SUCCESS)
        return vk_failure("vkCreateShaderModule", result);

    std::vector<VkSpecializationMapEntry> entries(constants.size());
    for (uint32_t i = 0; i < entries.size(); ++i)
        entries[i] = {i, i * uint32_t{sizeof(uint32_t)}, sizeof(uint32_t)};
    const VkSpecializationInfo specialisation{static_cast<uint32_t>(entries.size()), entries.data(),
                                              constants.size_bytes(), constants.data()};
    auto info = vk_struct<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
    info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    info.stage.module = module;
    info.stage.pName = "main";
    info.stage.pSpecializationInfo = &specialisation;
    info.layout = made.layout_;
    VkPipelineCache cache = VK_NULL_HANDLE;
    const auto cache_info = vk_struct<VkPipelineCacheCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO);
    result = vk.vkCreatePipelineCache(device.handle(), &cache_info, nullptr, &cache);
    if (result == VK_SUCCESS) {
        const uint64_t empty_bytes = cache_bytes(device, cache);
        result = vk.vkCreateComputePipelines(device.handle(), cache, 1, &info, nullptr, &made.pipeline_);
        made.size_bytes_ = cache_bytes(device, cache) - empty_bytes;
        vk.vkDestroyPipelineCache(device.handle(), cache, nullptr);
    }
    vk.vkDestroyShaderModule(device.handle(), module, nullptr);
    if (result != VK_SUCCESS)
        return vk_failure("vkCreateComputePipelines", result);
    return made;
}

void ComputePipeline::set_buffers(std::span<const VulkanBuffer* const> buffers)
{
    std::vector<VkDescriptorBufferInfo> infos(buffers.size());
    std::vector<VkWriteDescriptorSet> writes(buffers.size());
    for (uint32_t i = 0; i < buffers.size(); ++i) {
        infos[i] = {buffers[i]->handle(), 0, VK_WHOLE_SIZE};
        writes[i] = vk_struct<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
        writes[i].dstSet = set_;
        writes[i].dstBinding = i;
        writes[i].descriptorCount = 1;
        writes[i].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        writes[i].pBufferInfo = &infos[i];
    }
    device_->vk().vkUpdateDescriptorSets(device_->handle(), static_cast<uint32_t>(writes.size()), writes.data(), 0,
                                         nullptr);
}

void ComputePipeline::dispatch(VkCommandBuffer commands, std::span<const std::byte> push, uint32_t groups_x,
                               uint32_t groups_y) const
{
    const VolkDeviceTable& vk = device_->vk();
    vk.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline_);
    vk.vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout_, 0, 1, &set_, 0, nullptr);
    vk.vkCmdPushConstants(commands, layout_, VK_SHADER_STAGE_COMPUTE_BIT, 0, static_cast<uint32_t>(push.size()),
                          push.data());
    vk.vkCmdDispatch(commands, groups_x, groups_y, 1);
}

} // namespace trimray
