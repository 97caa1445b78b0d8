#include "runtime/view/model_tree.h"

#include "runtime/effect_plan.h"

#include <fmt/format.h>

#include <algorithm>

namespace trimray {
namespace {

/// Sorts items 0, 1, ... by the node each belongs to, their order kept. Those for which `belongs` says none are left
/// out. Source: counting sort.
template <class NodeOf>
void sort_by_node(uint node_count, uint item_count, NodeOf node_of, std::vector<uint>& items, std::vector<uint>& begin)
{
    begin.assign(node_count + 1, 0);
    for (uint i = 0; i < item_count; ++i)
        if (const std::optional<uint> node = node_of(i))
            ++begin[*node + 1];
    for (uint n = 0; n < node_count; ++n)
        begin[n + 1] += begin[n];
    items.resize(begin[node_count]);
    std::vector<uint> next(begin.begin(), begin.end() - 1);
    for (uint i = 0; i < item_count; ++i)
        if (const std::optional<uint> node = node_of(i))
            items[next[*node]++] = i;
}

std::optional<uint> color_if_any(uint rgba)
{
    return rgba >> 24 != 0 ? std::optional(rgba) : std::nullopt;
}

/// The small letter of a capital one; others as they are.
uint32_t small_letter(uint32_t c)
{
    const auto within = [c](uint32_t lo, uint32_t hi) { return c >= lo && c <= hi; };
    if (within('A', 'Z') || (within(0xc0, 0xde) && c != 0xd7)) // 0xd7: the sign of multiplication
        return c + 32;
    if (c == 0x178) // Y with diaeresis: its small letter is Latin-1's
        return 0xff;
    const bool even_capital = within(0x100, 0x12f) || within(0x132, 0x137) || within(0x14a, 0x177);
    const bool odd_capital = within(0x139, 0x148) || within(0x179, 0x17e);
    if ((even_capital && c % 2 == 0) || (odd_capital && c % 2 == 1))
        return c + 1;
    if (c == 0x386)
        return 0x3ac;
    if (within(0x388, 0x38a))
        return c + 37;
    if (c == 0x38c)
        return 0x3cc;
    if (within(0x38e, 0x38f))
        return c + 63;
    if (within(0x391, 0x3ab))
        return c + 32;
    if (within(0x400, 0x40f))
        return c + 80;
    if (within(0x410, 0x42f))
        return c + 32;
    return c;
}

} // namespace

std::string small_letters(std::string_view text)
{
    std::string out(text);
    for (size_t i = 0; i < out.size(); ++i) {
        const auto lead = static_cast<unsigned char>(out[i]);
        if (lead < 0x80) {
            out[i] = static_cast<char>(small_letter(lead));
            continue;
        }
        // of two bytes: all the letters above, and their small ones
        if (lead < 0xc2 || lead > 0xdf || i + 1 == out.size())
            continue;
        const uint32_t letter = small_letter((lead & 0x1fu) << 6 | (static_cast<unsigned char>(out[i + 1]) & 0x3fu));
        out[i] = static_cast<char>(0xc0u | letter >> 6);
        out[++i] = static_cast<char>(0x80u | (letter & 0x3fu));
    }
    return out;
}

ModelTree::ModelTree(const PackImage& image) : image_(image), nodes_(std::max<size_t>(image.tree.size(), 1))
{
    const auto count = uint(nodes_.size());
    for (uint n = 1; n < count; ++n) {
        nodes_[n].parent = image.tree[n].parent;
        nodes_[n].depth = nodes_[nodes_[n].parent].depth + 1;
    }
    sort_by_node(
        count, count, [&](uint n) { return n > 0 ? std::optional(nodes_[n].parent) : std::nullopt; }, children_,
        child_begin_);
    sort_by_node(
        count, uint(image.instances.size()), [&](uint i) { return std::optional(node_of(i)); }, placements_,
        placement_begin_);
    for (const InstanceRecord& instance : image.instances) {
        ModelTreeNode& node = nodes_[image.tree.empty() ? 0 : instance.tree_node];
        ++node.placements;
        node.faces += image.parts[instance.part].face_count;
    }
    for (uint n = count; n-- > 1;) { // children after their parents: each is whole when it is added
        nodes_[nodes_[n].parent].placements += nodes_[n].placements;
        nodes_[nodes_[n].parent].faces += nodes_[n].faces;
    }
    for (const PartRecord& part : image.parts) {
        const uint first = part.face_count > 0 ? face_color(part.first_face).value_or(0) : 0;
        bool alike = true;
        for (uint i = 1; i < part.face_count && alike; ++i)
            alike = face_color(part.first_face + i).value_or(0) == first;
        part_color_.push_back(alike ? first : 0);
    }
    for (uint n = 0; n < count; ++n) {
        nodes_[n].named = n < image.tree.size() && image.tree[n].name != 0;
        nodes_[n].color_rgba = n < image.tree.size() ? color_if_any(image.tree[n].color_rgba) : std::nullopt;
        nodes_[n].label = label_of(n);
    }
}

std::string ModelTree::label_of(uint node) const
{
    if (nodes_[node].named)
        return image_.strings.strings[image_.tree[node].name];
    if (node == 0 && !image_.provenance.source_name.empty())
        return image_.provenance.source_name;
    const std::span<const uint> own = placements(node);
    if (own.size() == 1 && children(node).empty())
        return placement_label(own[0]);
    return node == 0 ? "Model" : fmt::format("Assembly {}", node);
}

std::vector<uint> ModelTree::placements_below(uint node) const
{
    std::vector<uint> found, waiting{node};
    while (!waiting.empty()) {
        const uint at = waiting.back();
        waiting.pop_back();
        const auto own = placements(at), below = children(at);
        found.insert(found.end(), own.begin(), own.end());
        waiting.insert(waiting.end(), below.begin(), below.end());
    }
    std::sort(found.begin(), found.end());
    return found;
}

std::vector<uint64_t> ModelTree::count_below(std::span<const uint8_t> marked) const
{
    std::vector<uint64_t> counts(nodes_.size());
    for (uint i = 0; i < image_.instances.size(); ++i)
        counts[node_of(i)] += marked.empty() || marked[i] != 0;
    for (size_t n = nodes_.size(); n-- > 1;)
        counts[nodes_[n].parent] += counts[n];
    return counts;
}

uint ModelTree::node_of(uint instance) const
{
    return image_.tree.empty() ? 0 : image_.instances[instance].tree_node;
}

std::vector<uint> ModelTree::path_to(uint node) const
{
    std::vector<uint> path{node};
    while (path.back() != 0)
        path.push_back(nodes_[path.back()].parent);
    std::reverse(path.begin(), path.end());
    return path;
}

std::string ModelTree::placement_label(uint instance) const
{
    const InstanceRecord& record = image_.instances[instance];
    return record.name != 0 ? image_.strings.strings[record.name] : part_label(record.part);
}

std::string ModelTree::part_label(uint part) const
{
    const uint name = image_.parts[part].name;
    return name != 0 ? image_.strings.strings[name] : fmt::format("Part {}", part + 1);
}

std::string ModelTree::face_label(uint face) const
{
    const FaceRecord& record = image_.faces[face];
    return record.name != 0 ? image_.strings.strings[record.name]
                            : fmt::format("Face {} ({})", face, surface_kind_name(record.surface_kind));
}

std::optional<uint> ModelTree::face_color(uint face) const
{
    const FaceRecord& record = image_.faces[face];
    return (record.flags & kFaceHasColor) != 0 ? std::optional(record.color_rgba) : std::nullopt;
}

std::optional<uint> ModelTree::placement_color(uint instance) const
{
    const InstanceRecord& record = image_.instances[instance];
    const std::optional<uint> of_faces = color_if_any(part_color_[record.part]);
    return of_faces ? of_faces : color_if_any(record.color_rgba);
}

std::vector<uint> ModelTree::search(std::string_view text) const
{
    std::vector<uint> found;
    if (text.empty())
        return found;
    const std::string wanted = small_letters(text);
    const auto has = [&](std::string_view label) { return small_letters(label).find(wanted) != std::string::npos; };
    // each string and each part once, however often they are placed
    std::vector<bool> in_string, in_part;
    for (const std::string& s : image_.strings.strings)
        in_string.push_back(has(s));
    for (uint part = 0; part < image_.parts.size(); ++part)
        in_part.push_back(has(part_label(part)));
    for (uint n = 0; n < nodes_.size(); ++n) {
        const auto own = placements(n);
        const auto matches = [&](uint instance) {
            const InstanceRecord& record = image_.instances[instance];
            return in_string[record.name] || in_part[record.part];
        };
        if (has(nodes_[n].label) || std::any_of(own.begin(), own.end(), matches))
            found.push_back(n);
    }
    return found;
}

} // namespace trimray
