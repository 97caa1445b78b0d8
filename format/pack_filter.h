// The reversible filter in front of zstd: the 4-byte words of a block of records, column by column. Fields of one kind
// lie together, counters become small steps, and the bytes that repeat (signs, exponents) get runs of their own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace trimray {

struct ColumnFilter {
    uint64_t delta_columns = 0; // bit c: words of column c are differences to the record before, modulo 2^32
    uint64_t plane_columns = 0; // bit c: column c as four planes, lowest bytes first
};
inline constexpr uint32_t kMaxFilterColumns = 64;

/// A block of whole records in columns. Shapes: both spans have the same size, a multiple of stride; stride is a
/// multiple of 4 and at most 4 * kMaxFilterColumns.
void filter_columns(std::span<const std::byte> records, uint32_t stride, const ColumnFilter& filter,
                    std::span<std::byte> columns);

/// The inverse of filter_columns.
void unfilter_columns(std::span<const std::byte> columns, uint32_t stride, const ColumnFilter& filter,
                      std::span<std::byte> records);

} // namespace trimray
