#include "runtime/command_json.h"

#include <fmt/format.h>

namespace trimray {
namespace {

template <class T>
uint64_t bytes_of(const std::vector<T>& array)
{
    return array.size() * sizeof(T);
}

} // namespace

void print_json(const Json& object)
{
    fmt::print("{}\n", object.dump(-1, ' ', false, Json::error_handler_t::replace));
}

void print_plan(const EffectPlan& plan)
{
    fmt::print("{:<20}{}\n", "effect", "why");
    for (const EffectItem& item : plan.items)
        fmt::print("{:<20}{}\n", item.name, item.why);
}

Json plan_json(const EffectPlan& plan)
{
    Json items = Json::array();
    for (const EffectItem& item : plan.items)
        items.push_back({{"name", item.name}, {"why", item.why}});
    return items;
}

MemoryBytes memory_bytes(const PackImage& image)
{
    MemoryBytes bytes;
    bytes.geometry = bytes_of(image.parts) + bytes_of(image.instances) + bytes_of(image.faces) +
                     bytes_of(image.patches) + bytes_of(image.control_points);
    bytes.bvh = bytes_of(image.leaves) + bytes_of(image.top_nodes) + bytes_of(image.part_nodes);
    bytes.trim_exact = bytes_of(image.trim_points) + bytes_of(image.trim_pieces) + bytes_of(image.cells) +
                       bytes_of(image.cell_entries);
    bytes.trim_sdf = bytes_of(image.sdf_words);
    return bytes;
}

Json to_json(const MemoryBytes& bytes)
{
    Json json = {{"geometry", bytes.geometry},
                 {"bvh", bytes.bvh},
                 {"trim_exact", bytes.trim_exact},
                 {"trim_sdf", bytes.trim_sdf},
                 {"trim_kd", bytes.trim_kd}};
    if (bytes.borders > 0)
        json["borders"] = bytes.borders;
    json["total"] = bytes.total();
    return json;
}

} // namespace trimray
