// The dispatches of a band of rows: its first hits, caps, light, mirrors, and the layers behind what lets light
// through. The software driver ends long loops, so there pixels that need them are cast again, each alone.
#include "runtime/vk_tracer.h"
#include "shaders/material_layout.h"
#include "shaders/section_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>

namespace trimray {
namespace {

// Rays a pixel that one dispatch of light.comp casts: on the software driver a ray takes what the loop limit allows
constexpr uint32_t kSamplesADispatch = 16, kSoftwareSamplesADispatch = 1;

} // namespace

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

} // namespace trimray
