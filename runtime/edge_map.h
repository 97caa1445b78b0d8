// What a tracer notes about borders near the pixels of a frame, for the effects drawn over it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace trimray {

constexpr uint32_t kNoWord = ~0u;

/// A line that reaches a pixel of another surface.
struct LineMark {
    float share = 0;         // of the pixel, in (0, 1]; 0: none does
    uint32_t from = kNoWord; // the line: its place in EdgeMap::line

    /// Keeps the stronger of both; of equal ones the first in the map, whatever the order of calls.
    void raise(float other_share, uint32_t other)
    {
        if (other_share > share || (other_share == share && other < from)) {
            share = other_share;
            from = other;
        }
    }
};

/// Of a block whose lines were drawn as it was traced, what hangs on other blocks.
struct WaitingLines {
    struct Mark {
        uint32_t word; // the pixel's place in EdgeMap::line
        LineMark mark;
    };
    std::vector<uint32_t> lines; // places in EdgeMap::line of lines with an outer half beyond the block
    std::vector<Mark> marks;     // on pixels that lines of other blocks may reach
};

constexpr uint32_t kEdgeBlockSide = 64; // pixels, a multiple of a packet's 4

constexpr uint8_t kNearLine = 1, kNearBorder = 2;

/// Edge words (shaders/shared/edge.h) of a frame in packets of 4 x 4 pixels, row by row. Words of a packet mean
/// something only where `near` says so.
struct EdgeMap {
    uint32_t columns = 0, rows = 0; // packets
    std::vector<uint8_t> near;      // kNear... bits, by packet
    std::vector<uint32_t> line, border;
    // By the tracer: each line word's share of its own pixel is in the frame already, and outer halves but for those
    // that `waiting` names.
    bool own_halves_drawn = false;
    uint32_t block_columns = 0;
    std::vector<WaitingLines> waiting; // by block of kEdgeBlockSide, row by row; only where own_halves_drawn

    /// For a picture of this size; `lines` and `borders`: which words there are. Nothing is near anything then.
    void resize(uint32_t width, uint32_t height, bool lines, bool borders);
    size_t size_bytes() const { return near.size() + (line.size() + border.size()) * sizeof(uint32_t); }
    size_t packet_of(uint32_t x, uint32_t y) const { return size_t{y / 4} * columns + x / 4; }
    size_t word_of(uint32_t x, uint32_t y) const { return 16 * packet_of(x, y) + 4 * (y % 4) + x % 4; }
    size_t block_of(uint32_t x, uint32_t y) const
    {
        return size_t{y / kEdgeBlockSide} * block_columns + x / kEdgeBlockSide;
    }
    /// The pixel whose words have this place.
    std::array<int, 2> pixel_of(uint32_t word) const
    {
        const uint32_t packet = word / 16;
        return {static_cast<int>(4 * (packet % columns) + word % 4),
                static_cast<int>(4 * (packet / columns) + word / 4 % 4)};
    }
    /// The words of (x, y); 0 where nothing is near.
    uint32_t line_at(int x, int y) const { return at(line, kNearLine, x, y); }
    uint32_t border_at(int x, int y) const { return at(border, kNearBorder, x, y); }

private:
    uint32_t at(const std::vector<uint32_t>& words, uint8_t which, int x, int y) const
    {
        const auto column = static_cast<uint32_t>(x), row = static_cast<uint32_t>(y);
        return (near[packet_of(column, row)] & which) != 0 ? words[word_of(column, row)] : 0;
    }
};

} // namespace trimray
