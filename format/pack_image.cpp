#include "format/pack_image.h"

namespace trimray {

uint StringTable::add(std::string_view s)
{
    for (; indexed_ < strings.size(); ++indexed_) // strings that were put in by hand, or read from a pack
        index_.try_emplace(strings[indexed_], static_cast<uint>(indexed_));
    const auto [found, is_new] = index_.try_emplace(std::string(s), static_cast<uint>(strings.size()));
    if (is_new) {
        strings.emplace_back(s);
        indexed_ = strings.size();
    }
    return found->second;
}

} // namespace trimray
