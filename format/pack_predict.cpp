#include "format/pack_predict.h"

#include "format/trim_texture.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>

namespace trimray {
namespace {

enum class Way { Predict, Restore };

uint zigzag(uint difference)
{
    return difference << 1 ^ (0u - (difference >> 31));
}
uint unzigzag(uint stored)
{
    return stored >> 1 ^ (0u - (stored & 1u));
}

/// The integer whose multiple of 2^-bits a float's word is; words that are none do not come back.
uint to_grid(uint word, int bits)
{
    const double k = std::ldexp(std::bit_cast<float>(word), bits);
    constexpr double kLargest = 1 << 30;
    return k >= -kLargest && k <= kLargest ? static_cast<uint>(static_cast<int>(k)) : 0u;
}
uint from_grid(uint k, int bits)
{
    return std::bit_cast<uint>(static_cast<float>(std::ldexp(static_cast<int>(k), -bits)));
}

// ---- control nets and trims ----------------------------------------------------------------------------------------

constexpr int kTrimBits = 22, kPolynomialBits = 22, kRationalBits = 24;

/// What the net's point (i, j) should be from those before it: the second differences along u go on as they were, and
/// differ from one column to the next as little. `at` is the net's numbers of one coordinate.
template <class At>
uint expected(const At& at, uint i, uint j)
{
    const auto along_v = [&](uint row) { return j < 2 ? at(row, j - 1) : 2u * at(row, j - 1) - at(row, j - 2); };
    const auto along_u = [&](uint column) {
        return i < 2 ? at(i - 1, column) : 2u * at(i - 1, column) - at(i - 2, column);
    };
    if (i == 0)
        return j == 0 ? 0u : along_v(0);
    return j == 0 ? along_u(0) : along_u(j) + at(i, j - 1) - along_u(j - 1);
}

/// One net in place, from floats to differences or back. `grid` has room for a net.
void code_net(uint* words, uint count_u, uint count_v, bool rational, Way way, std::vector<uint>& grid)
{
    const uint width = rational ? 4 : 3, size = count_u * count_v * width;
    const int bits = rational ? kRationalBits : kPolynomialBits;
    grid.assign(size, 0);
    if (way == Way::Predict)
        for (uint n = 0; n < size; ++n)
            grid[n] = n % width == 3 ? words[n] : to_grid(words[n], bits);
    for (uint i = 0; i < count_u; ++i)
        for (uint j = 0; j < count_v; ++j)
            for (uint c = 0; c < width; ++c) {
                const uint n = (i * count_v + j) * width + c;
                const uint guess = expected([&](uint a, uint b) { return grid[(a * count_v + b) * width + c]; }, i, j);
                if (way == Way::Restore)
                    grid[n] = guess + unzigzag(words[n]);
                else
                    words[n] = zigzag(grid[n] - guess);
            }
    if (way == Way::Restore)
        for (uint n = 0; n < size; ++n)
            words[n] = n % width == 3 ? grid[n] : from_grid(grid[n], bits);
}

/// Nets in the order of their patches; words that no net holds stay as they are, and so does a net that lies before the
/// end of another.
void code_nets(const std::vector<PatchRecord>& patches, std::span<uint> words, Way way)
{
    std::vector<uint> grid;
    size_t end = 0;
    for (const PatchRecord& patch : patches) {
        const uint count_u = (patch.shape >> 8 & 0xffu) + 1, count_v = (patch.shape >> 16 & 0xffu) + 1;
        const bool rational = (patch.shape & kShapeRational) != 0;
        const size_t first = patch.first_control_point, size = size_t{count_u} * count_v * (rational ? 4 : 3);
        if ((patch.shape & 0xffu) != kKindBezier || first < end || first > words.size() || size > words.size() - first)
            continue;
        code_net(&words[first], count_u, count_v, rational, way, grid);
        end = first + size;
    }
}

/// Points as steps from the point before.
void code_points(std::span<uint> words, Way way)
{
    uint before[2] = {0, 0};
    for (size_t n = 0; n < words.size(); ++n) {
        uint& last = before[n % 2];
        if (way == Way::Predict) {
            const uint k = to_grid(words[n], kTrimBits);
            words[n] = zigzag(k - last);
            last = k;
        } else {
            last += unzigzag(words[n]);
            words[n] = from_grid(last, kTrimBits);
        }
    }
}

/// Pieces beside the piece before, whose points, class and kind are taken to go on; a face's first piece has point 0.
void code_pieces(const std::vector<FaceRecord>& faces, std::span<uint> words, Way way)
{
    std::vector<bool> begins(words.size(), false);
    for (const FaceRecord& face : faces)
        if (face.first_piece < words.size())
            begins[face.first_piece] = true;
    uint before = 0; // the word of the piece before
    constexpr uint kClassMask = kEdgeClassCount - 1;
    for (size_t n = 0; n < words.size(); ++n) {
        const uint step = (before & kPieceCubic) != 0 ? 3u : 1u;
        const uint point = n == 0 || begins[n] ? 0u : (before >> kPiecePointShift) + step;
        const uint edge_class = before >> kPieceClassShift & kClassMask, cubic = before & kPieceCubic;
        const uint word = words[n];
        if (way == Way::Predict) {
            words[n] = zigzag((word >> kPiecePointShift) - point) << 3 |
                       (((word >> kPieceClassShift) - edge_class) & kClassMask) << 1 | ((word ^ cubic) & kPieceCubic);
            before = word;
        } else {
            before = (unzigzag(word >> 3) + point) << kPiecePointShift |
                     (((word >> 1) + edge_class) & kClassMask) << kPieceClassShift | ((word ^ cubic) & kPieceCubic);
            words[n] = before;
        }
    }
}

// ---- textures ------------------------------------------------------------------------------------------------------

/// One texture's bytes, from texels to differences or back, in the order of the bytes. Texels are expected at
/// left + upper - upper left, cut to 0 ... 255; those that a tile shares with the tile left of it or below at that
/// tile's. Tiles that are kept are numbered in their order, so all their entries become kFirstTile.
class TextureCoder {
public:
    /// `known`: the texture's bytes as they are (Predict), or `bytes` itself.
    TextureCoder(const TextureShape& shape, std::span<const std::byte> known, std::span<std::byte> bytes, Way way)
        : shape_(shape), known_(known), bytes_(bytes), way_(way), below_(shape.tiles_u)
    {
    }

    /// Returns how many bytes the texture takes, or nothing if a tile leaves the array. Domain: the rest does not.
    std::optional<size_t> code()
    {
        if (shape_.tile_shift == 0) {
            code_texels(0, shape_.height, [](uint, uint) { return std::optional<int>(); });
            return 4 * shape_.words(0);
        }
        for (uint ty = 0; ty < shape_.tiles_v; ++ty)
            for (uint tx = 0; tx < shape_.tiles_u; ++tx)
                if (!code_tile(tx, ty))
                    return std::nullopt;
        return 4 * shape_.words(kept_);
    }

private:
    struct Tile {
        int constant = 0;
        std::optional<size_t> first; // byte of a tile that is kept
    };

    bool code_tile(uint tx, uint ty)
    {
        const size_t at = 2 * (static_cast<size_t>(ty) * shape_.tiles_u + tx);
        const uint entry = static_cast<uint>(known_[at]) | static_cast<uint>(known_[at + 1]) << 8;
        Tile tile{entry == kTileIn ? 255 : 0, std::nullopt};
        if (entry >= kFirstTile) {
            if (4 * shape_.words(kept_ + 1) > bytes_.size())
                return false;
            tile.first = shape_.directory_bytes() + static_cast<size_t>(kept_) * shape_.tile_bytes();
            const uint coded = way_ == Way::Predict ? entry - kept_ : entry + kept_;
            bytes_[at] = std::byte(coded & 0xffu);
            bytes_[at + 1] = std::byte(coded >> 8 & 0xffu);
            ++kept_;
            const uint last = shape_.stride - 1;
            code_texels(*tile.first, shape_.stride, [&](uint x, uint y) -> std::optional<int> {
                if (x == 0 && tx > 0)
                    return texel(left_, last, y);
                if (y == 0 && ty > 0)
                    return texel(below_[tx], x, last);
                return std::nullopt;
            });
        }
        left_ = below_[tx] = tile;
        return true;
    }

    int texel(const Tile& tile, uint x, uint y) const
    {
        return tile.first ? int(known_[*tile.first + y * shape_.stride + x]) : tile.constant;
    }

    /// Rows of `stride` texels from byte `first` on; `shared` says what a texel must be, where that is known.
    template <class Shared>
    void code_texels(size_t first, uint rows, Shared&& shared)
    {
        const size_t width = shape_.stride;
        for (size_t n = 0; n < width * rows; ++n) {
            const size_t x = n % width, y = n / width;
            const std::byte* const at = &known_[first + n];
            const int left = x > 0 ? int(at[-1]) : 0, upper = y > 0 ? int(*(at - width)) : 0;
            int guess = left + upper; // of one that exists
            if (x > 0 && y > 0)
                guess = std::clamp(guess - int(*(at - width - 1)), 0, 255);
            guess = shared(static_cast<uint>(x), static_cast<uint>(y)).value_or(guess);
            std::byte& coded = bytes_[first + n];
            coded = std::byte(way_ == Way::Predict ? int(*at) - guess : int(coded) + guess);
        }
    }

    const TextureShape& shape_;
    const std::span<const std::byte> known_;
    const std::span<std::byte> bytes_;
    const Way way_;
    uint kept_ = 0;
    Tile left_;
    std::vector<Tile> below_;
};

/// Textures in the order of their faces; one that begins before the end of another is skipped, and where one leaves the
/// array the rest stays as it is.
void code_textures(const std::vector<FaceRecord>& faces, std::span<std::byte> bytes, Way way)
{
    size_t end = 0;
    const std::vector<std::byte> copy(way == Way::Predict ? bytes.begin() : bytes.end(), bytes.end());
    const std::span<const std::byte> known = way == Way::Predict ? std::span<const std::byte>(copy) : bytes;
    for (const FaceRecord& face : faces) {
        const TextureShape shape = texture_shape(face);
        const size_t first = size_t{4} * face.sdf_first_word;
        if (shape.width == 0 || shape.height == 0 || first < end || first > bytes.size() ||
            4 * shape.words(0) > bytes.size() - first)
            continue;
        const std::optional<size_t> size = TextureCoder(shape, known.subspan(first), bytes.subspan(first), way).code();
        if (!size)
            return;
        end = first + *size;
    }
}

// ---- trees ---------------------------------------------------------------------------------------------------------

constexpr uint kSlotEmpty = 0, kSlotLeaf = 1, kSlotNode = 2;

uint byte_of(uint word, uint k)
{
    return word >> 8 * k & 0xffu;
}

/// Bytes a - b or a + b, each modulo 256.
uint add_bytes(uint a, uint b, bool subtract)
{
    uint out = 0;
    for (uint k = 0; k < 4; ++k)
        out |= ((byte_of(a, k) + (subtract ? 256 - byte_of(b, k) : byte_of(b, k))) & 0xffu) << 8 * k;
    return out;
}

/// What a child's origin and exponents should be: the corner of its box in the parent, and the least step that spans
/// it.
void expect_from_parent(const BvhNode& parent, uint slot, BvhNode& guess)
{
    for (int c = 0; c < 3; ++c) {
        const uint biased = byte_of(parent.exponents, c), lo = byte_of(parent.lo[c], slot);
        guess.origin[c] = parent.origin[c] + std::ldexp(1.0f, int(biased) - 127) * float(lo);
        const uint extent = (byte_of(parent.hi[c], slot) - lo) & 0xffu;
        guess.exponents |= ((biased + uint(std::bit_width(extent)) - 8u) & 0xffu) << 8 * c;
    }
}

/// A node's own words, without its children. `empty` has 255 in the bytes of slots without a child.
void code_node(BvhNode& node, const BvhNode& guess, uint empty, Way way)
{
    const bool predict = way == Way::Predict;
    for (int c = 0; c < 3; ++c) {
        const uint origin = std::bit_cast<uint>(node.origin[c]), expected_origin = std::bit_cast<uint>(guess.origin[c]);
        node.origin[c] =
            std::bit_cast<float>(predict ? zigzag(origin - expected_origin) : expected_origin + unzigzag(origin));
        // an empty slot has lo = 255 and hi = 0: both become 0
        const uint lo = predict ? node.lo[c] : node.lo[c] ^ empty;
        node.hi[c] = add_bytes(node.hi[c], lo & ~empty, predict);
        node.lo[c] ^= empty;
    }
    node.exponents = add_bytes(node.exponents, guess.exponents, predict);
}

/// Children's words are kinds of slots here; their numbers follow from the order: nodes and leaves in the order of a
/// walk from the root that takes slots in turn.
void code_trees(std::span<BvhNode> nodes, Way way)
{
    struct Visit {
        uint node, slot;
    };
    std::vector<Visit> path;
    const std::vector<BvhNode> before(way == Way::Predict ? nodes.begin() : nodes.end(), nodes.end());
    const auto known = [&](uint n) -> const BvhNode& { return way == Way::Predict ? before[n] : nodes[n]; };
    uint root = 0, leaves = 0;
    for (uint n = 0; n < nodes.size(); ++n) {
        BvhNode guess{};
        if (path.empty()) {
            root = n;
            leaves = 0;
        } else {
            Visit& parent = path.back();
            expect_from_parent(known(parent.node), parent.slot, guess);
            if (way == Way::Restore)
                nodes[parent.node].child[parent.slot] = n - root;
            ++parent.slot;
        }
        uint kind[4], empty = 0;
        for (uint k = 0; k < 4; ++k) {
            const uint word = nodes[n].child[k];
            kind[k] = way == Way::Restore      ? word
                      : word == kBvhEmpty      ? kSlotEmpty
                      : (word & kBvhLeaf) != 0 ? kSlotLeaf
                                               : kSlotNode;
            nodes[n].child[k] = kind[k];
            empty |= kind[k] == kSlotEmpty ? 0xffu << 8 * k : 0u;
        }
        code_node(nodes[n], guess, empty, way);
        path.push_back({n, 0});
        while (!path.empty()) { // to the next slot that holds a node
            Visit& at = path.back();
            if (at.slot == 4) {
                path.pop_back();
                continue;
            }
            uint& word = nodes[at.node].child[at.slot];
            if (word == kSlotNode)
                break;
            if (way == Way::Restore)
                word = word == kSlotLeaf ? kBvhLeaf | leaves++ : kBvhEmpty;
            ++at.slot;
        }
    }
}

/// f(span of T) over a copy of the records that lies as T needs it.
template <class T, class F>
void on_array(std::span<std::byte> records, F&& f)
{
    std::vector<T> array(records.size() / sizeof(T));
    std::memcpy(array.data(), records.data(), array.size() * sizeof(T));
    f(std::span<T>(array));
    std::memcpy(records.data(), array.data(), array.size() * sizeof(T));
}

void code_records(std::string_view id, const PackImage& image, std::span<std::byte> records, Way way)
{
    assert(has_prediction(id) && "no other section has filter 2");
    if (id == "CTRL")
        on_array<uint>(records, [&](std::span<uint> words) { code_nets(image.patches, words, way); });
    else if (id == "TPNT")
        on_array<uint>(records, [&](std::span<uint> words) { code_points(words, way); });
    else if (id == "TPCE")
        on_array<uint>(records, [&](std::span<uint> words) { code_pieces(image.faces, words, way); });
    else if (id == "NODE")
        on_array<BvhNode>(records, [&](std::span<BvhNode> nodes) { code_trees(nodes, way); });
    else
        code_textures(image.faces, records, way);
}

} // namespace

bool has_prediction(std::string_view id)
{
    return id == "CTRL" || id == "TPNT" || id == "TPCE" || id == "NODE" || id == "SDFW";
}

std::vector<std::byte> predict_records(std::string_view id, const PackImage& image, std::span<const std::byte> records)
{
    std::vector<std::byte> coded(records.begin(), records.end());
    code_records(id, image, coded, Way::Predict);
    std::vector<std::byte> back = coded;
    code_records(id, image, back, Way::Restore);
    if (!std::equal(back.begin(), back.end(), records.begin(), records.end()))
        coded.clear();
    return coded;
}

void restore_records(std::string_view id, const PackImage& image, std::span<std::byte> records)
{
    code_records(id, image, records, Way::Restore);
}

} // namespace trimray
