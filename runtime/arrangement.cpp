#include "runtime/arrangement.h"

#include "format/leaf_geometry.h"
#include "runtime/pack_names.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>

namespace trimray {
namespace {

/// The number after the first letter of `name`, below `count`.
std::optional<uint32_t> number_in(const std::string& name, size_t count)
{
    uint32_t number = 0;
    const char* const end = name.data() + name.size();
    const auto read = std::from_chars(name.data() + 1, end, number);
    if (read.ec != std::errc() || read.ptr != end || number >= count)
        return std::nullopt;
    return number;
}

/// What a number after # or @ means, where it is one of the pack's.
struct Numbered {
    std::optional<uint32_t> part, placement;
    bool any() const { return part || placement; }
};
Numbered numbered(const PackImage& image, const std::string& name)
{
    Numbered out;
    if (name.starts_with('#'))
        out.part = number_in(name, image.parts.size());
    if (name.starts_with('@'))
        out.placement = number_in(name, image.instances.size());
    return out;
}

Error no_such_number(const PackImage& image, const std::string& name)
{
    const bool part = name.starts_with('#');
    return {ErrorCode::InvalidScene, "placements",
            fmt::format("'{}': after {} the number of a {} is expected, below {}", name, name.front(),
                        part ? "part" : "placement", part ? image.parts.size() : image.instances.size())};
}

/// What `names` mean, 1 each. Adds those that mean nothing to `unmatched`. One walk over the placements, however many
/// names there are. Fails: InvalidScene.
Result<std::vector<uint8_t>> meant_by(const PackImage& image, const std::vector<std::string>& names,
                                      std::vector<std::string>& unmatched)
{
    std::vector<uint8_t> meant(image.instances.size()), parts(image.parts.size());
    if (names.empty())
        return meant;
    std::unordered_map<std::string_view, bool> met; // by name: whether something has it
    for (const std::string& name : names) {
        met.emplace(name, false);
        const Numbered number = numbered(image, name);
        if (number.part)
            parts[*number.part] = 1;
        if (number.placement)
            meant[*number.placement] = 1;
    }
    const auto meets = [&](uint text) {
        const auto found = met.find(string_at(image, text));
        if (found != met.end())
            found->second = true;
        return found != met.end();
    };
    for (size_t i = 0; i < image.instances.size(); ++i) {
        const InstanceRecord& instance = image.instances[i];
        const bool own = meets(instance.name), of_part = meets(image.parts[instance.part].name);
        if (own || of_part || parts[instance.part] != 0)
            meant[i] = 1;
    }
    for (const std::string& name : names) {
        if (met[name] || numbered(image, name).any())
            continue;
        if (name.starts_with('#') || name.starts_with('@'))
            return no_such_number(image, name);
        unmatched.push_back(name);
    }
    return meant;
}

/// The middle of a part's box, mm, in its own axes.
Point3 part_middle(const PackImage& image, uint32_t part)
{
    InstanceRecord as_it_is{};
    as_it_is.part = part;
    as_it_is.transform[0] = as_it_is.transform[5] = as_it_is.transform[10] = 1;
    Point3 middle{};
    for (size_t c = 0; c < 3; ++c) {
        Point3 along{};
        along[c] = 1;
        const double hi = largest_along(image, as_it_is, along);
        along[c] = -1;
        middle[c] = 0.5 * (hi - largest_along(image, as_it_is, along));
    }
    return middle;
}

/// Moves the placements that are visible away from the model's middle.
void explode(const PackImage& image, double by, ArrangedPlacements& arranged)
{
    std::vector<uint8_t> placed(image.parts.size());
    for (size_t i = 0; i < arranged.instances.size(); ++i)
        if (arranged.visible[i] != 0)
            placed[arranged.instances[i].part] = image.parts[arranged.instances[i].part].leaf_count > 0;
    std::vector<Point3> middles(image.parts.size());
    tbb::parallel_for(size_t{0}, image.parts.size(), [&](size_t part) {
        if (placed[part] != 0)
            middles[part] = part_middle(image, uint32_t(part));
    });
    for (size_t i = 0; i < arranged.instances.size(); ++i) {
        InstanceRecord& instance = arranged.instances[i];
        if (arranged.visible[i] == 0 || placed[instance.part] == 0)
            continue;
        for (size_t row = 0; row < 3; ++row) {
            // m - c, and the placement moves by so many times of it
            double away = instance.transform[4 * row + 3] - 0.5 * (image.bounds_lo_mm[row] + image.bounds_hi_mm[row]);
            for (size_t c = 0; c < 3; ++c)
                away += instance.transform[4 * row + c] * middles[instance.part][c];
            instance.transform[4 * row + 3] += by * away;
        }
    }
}

bool same(const Arrangement& a, const Arrangement& b)
{
    return std::tie(a.only, a.hide, a.explode) == std::tie(b.only, b.hide, b.explode);
}

} // namespace

PlacementView ArrangedPlacements::view() const
{
    PlacementView out;
    out.parts = parts;
    out.instances = instances;
    out.visible = visible;
    out.top_nodes = tree.nodes;
    if (out.visible_count() == 1)
        out.alone = uint32_t(std::find(visible.begin(), visible.end(), 1) - visible.begin());
    out.bounds_lo_mm = std::to_array(tree.bounds_lo_mm);
    out.bounds_hi_mm = std::to_array(tree.bounds_hi_mm);
    out.world_origin_mm = std::to_array(tree.origin_mm);
    out.world_scale_mm = tree.scale_mm;
    return out;
}

size_t ArrangedPlacements::size_bytes() const
{
    return instances.size() * sizeof(InstanceRecord) + visible.size() + tree.nodes.size() * sizeof(BvhNode);
}

Result<ArrangedPlacements> arrange(const PackImage& image, const Arrangement& wanted)
{
    if (!(wanted.explode >= 0 && std::isfinite(wanted.explode)))
        return Error{ErrorCode::Usage, "--explode",
                     fmt::format("expected a finite number of at least 0, found {}", wanted.explode)};
    ArrangedPlacements arranged;
    arranged.parts = image.parts;
    arranged.instances = image.instances;
    const Result<std::vector<uint8_t>> only = meant_by(image, wanted.only, arranged.unmatched);
    if (!only.ok())
        return only.error();
    const Result<std::vector<uint8_t>> hidden = meant_by(image, wanted.hide, arranged.unmatched);
    if (!hidden.ok())
        return hidden.error();
    for (size_t i = 0; i < image.instances.size(); ++i)
        arranged.visible.push_back((wanted.only.empty() || (*only)[i] != 0) && (*hidden)[i] == 0);
    if (wanted.explode > 0)
        explode(image, wanted.explode, arranged);
    arranged.tree = derive_top_tree(image, arranged.instances, arranged.visible);
    return arranged;
}

Result<bool> KeptArrangement::change_to(const PackImage& image, const Arrangement& wanted)
{
    if (same(wanted, wanted_))
        return false;
    if (wanted.any()) {
        Result<ArrangedPlacements> arranged = arrange(image, wanted);
        if (!arranged.ok())
            return arranged.error();
        arranged_ = std::move(*arranged);
    } else {
        arranged_.reset();
    }
    wanted_ = wanted;
    return true;
}

} // namespace trimray
