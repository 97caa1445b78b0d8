#include "runtime/view/selection.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace trimray {
namespace {

/// Says by the shorter list which placements are visible.
void say(Arrangement& arranged, const std::vector<uint8_t>& visible)
{
    const auto count = size_t(std::count_if(visible.begin(), visible.end(), [](uint8_t v) { return v != 0; }));
    arranged.only.clear();
    arranged.hide.clear();
    const bool by_those_shown = count > 0 && count < visible.size() - count;
    std::vector<std::string>& names = by_those_shown ? arranged.only : arranged.hide;
    for (size_t i = 0; i < visible.size(); ++i)
        if ((visible[i] != 0) == by_those_shown)
            names.push_back(fmt::format("@{}", i));
}

} // namespace

bool Selection::has(uint32_t placement) const
{
    return std::binary_search(placements.begin(), placements.end(), placement);
}

std::vector<uint32_t> toggled(const std::vector<uint32_t>& a, std::span<const uint32_t> b)
{
    std::vector<uint32_t> out;
    std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(out));
    return out;
}

void set_shown(Arrangement& arranged, std::span<const uint8_t> visible, size_t all,
               std::span<const uint32_t> placements, bool shown)
{
    std::vector<uint8_t> wanted(visible.begin(), visible.end());
    wanted.resize(all, 1);
    for (const uint32_t placement : placements)
        wanted[placement] = shown;
    say(arranged, wanted);
}

void show_alone(Arrangement& arranged, size_t all, std::span<const uint32_t> placements)
{
    std::vector<uint8_t> wanted(all);
    for (const uint32_t placement : placements)
        wanted[placement] = 1;
    say(arranged, wanted);
}

} // namespace trimray
