#include "format/pack_image.h"

#include <algorithm>

namespace trimray {

uint StringTable::add(std::string_view s)
{
    // names repeat in runs, and the table is small: the newest entries are the likeliest match
    const auto found = std::find(strings.rbegin(), strings.rend(), s);
    if (found != strings.rend())
        return static_cast<uint>(std::distance(found, strings.rend()) - 1);
    strings.emplace_back(s);
    return static_cast<uint>(strings.size() - 1);
}

} // namespace trimray
