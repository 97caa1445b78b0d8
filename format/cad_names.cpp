#include "format/cad_names.h"

#include <algorithm>

namespace trimray {
namespace {

/// Whether something comes before `ending`, which is in small letters.
bool has_ending(std::string_view name, std::string_view ending)
{
    const auto small = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
    return name.size() > ending.size() &&
           std::equal(ending.rbegin(), ending.rend(), name.rbegin(), [&](char e, char c) { return e == small(c); });
}

} // namespace

std::optional<CadFamily> cad_family(std::string_view name)
{
    struct Known {
        std::string_view ending;
        CadFamily family;
    };
    constexpr Known kKnown[] = {
        {".step", CadFamily::Step}, {".stp", CadFamily::Step},  {".p21", CadFamily::Step}, {".iges", CadFamily::Iges},
        {".igs", CadFamily::Iges},  {".brep", CadFamily::Brep}, {".brp", CadFamily::Brep}, {".rle", CadFamily::Brep},
    };
    const std::string_view file = without_folder(name);
    for (const Known& known : kKnown)
        if (has_ending(file, known.ending))
            return known.family;
    return std::nullopt;
}

std::string_view without_compression(std::string_view name)
{
    for (const std::string_view ending : {".zst", ".gz"})
        if (has_ending(name, ending))
            return name.substr(0, name.size() - ending.size());
    return name;
}

bool is_cad_name(std::string_view name)
{
    return cad_family(without_compression(name)).has_value();
}

std::string_view without_folder(std::string_view path)
{
    return path.substr(path.rfind('/') + 1); // npos + 1 is 0
}

} // namespace trimray
