#include "format/pack_filter.h"

#include <cassert>
#include <cstring>

namespace trimray {

void filter_columns(std::span<const std::byte> records, uint32_t stride, const ColumnFilter& filter,
                    std::span<std::byte> columns)
{
    assert(stride % 4 == 0 && stride <= 4 * kMaxFilterColumns && "one bit a column");
    assert(records.size() % stride == 0 && columns.size() == records.size() && "whole records");
    const size_t n = records.size() / stride;
    std::byte* out = columns.data();
    for (uint32_t c = 0; c < stride / 4; ++c, out += 4 * n) {
        const bool delta = filter.delta_columns >> c & 1, planes = filter.plane_columns >> c & 1;
        uint32_t before = 0;
        for (size_t i = 0; i < n; ++i) {
            uint32_t word;
            std::memcpy(&word, &records[i * stride + 4 * c], 4);
            const uint32_t stored = delta ? word - before : word;
            before = word;
            if (!planes)
                std::memcpy(out + 4 * i, &stored, 4);
            else
                for (int plane = 0; plane < 4; ++plane)
                    out[plane * n + i] = static_cast<std::byte>(stored >> 8 * plane);
        }
    }
}

void unfilter_columns(std::span<const std::byte> columns, uint32_t stride, const ColumnFilter& filter,
                      std::span<std::byte> records)
{
    assert(stride % 4 == 0 && stride <= 4 * kMaxFilterColumns && "one bit a column");
    assert(records.size() % stride == 0 && columns.size() == records.size() && "whole records");
    const size_t n = records.size() / stride;
    const std::byte* in = columns.data();
    for (uint32_t c = 0; c < stride / 4; ++c, in += 4 * n) {
        const bool delta = filter.delta_columns >> c & 1, planes = filter.plane_columns >> c & 1;
        uint32_t before = 0;
        for (size_t i = 0; i < n; ++i) {
            uint32_t stored = 0;
            if (!planes)
                std::memcpy(&stored, in + 4 * i, 4);
            else
                for (int plane = 0; plane < 4; ++plane)
                    stored |= static_cast<uint32_t>(in[plane * n + i]) << 8 * plane;
            const uint32_t word = delta ? stored + before : stored;
            before = word;
            std::memcpy(&records[i * stride + 4 * c], &word, 4);
        }
    }
}

} // namespace trimray
