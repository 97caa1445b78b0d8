#include "runtime/frame_size.h"

#include <fmt/format.h>

#ifdef __linux__
#include <sys/mman.h>
#include <unistd.h>
#endif

namespace trimray {
namespace {

/// Asks for large pages where the system has some to give; memory that nobody has written yet is then mapped 2 MiB at a
/// time. A picture's first frame may take longer to map page by page than to trace.
void prefer_large_pages([[maybe_unused]] void* memory, [[maybe_unused]] size_t bytes)
{
#ifdef MADV_HUGEPAGE
    const auto page = uintptr_t(sysconf(_SC_PAGESIZE));
    const uintptr_t first = (uintptr_t(memory) + page - 1) / page * page,
                    end = (uintptr_t(memory) + bytes) / page * page;
    if (first < end)
        madvise(reinterpret_cast<void*>(first), end - first, MADV_HUGEPAGE); // a hint: it may be refused
#endif
}

template <class T>
void resize_pixels(size_t count, std::vector<T>& values)
{
    if (values.capacity() < count) {
        values.clear(); // nobody asks for what a frame of another size held
        values.reserve(count);
        prefer_large_pages(values.data(), count * sizeof(T));
    }
    values.resize(count);
}

} // namespace

Status check_size(const RenderOptions& options)
{
    constexpr uint32_t kLargestSide = 65536; // pixels; and a picture of 2^30 in all
    if (options.width == 0 || options.height == 0 || options.width > kLargestSide || options.height > kLargestSide ||
        uint64_t(options.width) * options.height > 1u << 30)
        return Error{ErrorCode::Usage, "size",
                     fmt::format("{}x{} is not between 1x1 and {}x{} with at most 2^30 pixels", options.width,
                                 options.height, kLargestSide, kLargestSide)};
    return Done{};
}

void resize(Frame& frame, uint32_t width, uint32_t height)
{
    const size_t pixels = size_t(width) * height;
    frame.width = width;
    frame.height = height;
    resize_pixels(4 * pixels, frame.rgba);
    resize_pixels(pixels, frame.depth_mm);
    resize_pixels(3 * pixels, frame.normal);
    resize_pixels(2 * pixels, frame.uv);
    resize_pixels(pixels, frame.face);
    resize_pixels(pixels, frame.instance);
    resize_pixels(pixels, frame.certified);
}

} // namespace trimray
