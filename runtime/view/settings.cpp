#include "runtime/view/settings.h"

#include "format/pack_writer.h"
#include "format/read_file.h"
#include "runtime/scene_write.h"
#include "runtime/view/bindings.h"
#include "runtime/view/state_json.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <span>
#include <system_error>
#include <utility>

namespace trimray {
namespace {
namespace fs = std::filesystem;

constexpr std::pair<LengthUnit, const char*> kUnits[] = {
    {LengthUnit::Millimetre, "mm"}, {LengthUnit::Centimetre, "cm"}, {LengthUnit::Metre, "m"}, {LengthUnit::Inch, "in"}};
constexpr std::pair<bool ViewerPanels::*, const char*> kPanels[] = {
    {&ViewerPanels::menu, "menu"},       {&ViewerPanels::status, "status"},  {&ViewerPanels::tree, "tree"},
    {&ViewerPanels::look, "look"},       {&ViewerPanels::costs, "costs"},    {&ViewerPanels::times, "times"},
    {&ViewerPanels::measure, "measure"}, {&ViewerPanels::handles, "handles"}};
constexpr uint32_t kLeastWindow = 200, kMostWindow = 16384;

std::string settings_file(const std::string& folder)
{
    return folder + "/settings.json";
}

std::string look_file(const std::string& folder)
{
    return folder + "/look.json";
}

Json to_json(const ViewerSettings& settings)
{
    Json json;
    json["navigation"] = settings.navigation;
    json["unit"] = std::find_if(std::begin(kUnits), std::end(kUnits), [&](const auto& unit) {
                       return unit.first == settings.unit;
                   })->second;
    for (const auto& [panel, name] : kPanels)
        json["panels"][name] = settings.panels.*panel;
    json["window"] = {settings.window.width, settings.window.height};
    return json;
}

/// Keys that are not there, or are not what they should be, leave what there is: a newer or older version wrote them.
void take(const Json& json, ViewerSettings& settings)
{
    if (const auto name = json.find("navigation");
        name != json.end() && name->is_string() && find_preset(name->get<std::string>()))
        settings.navigation = *name;
    if (const auto unit = json.find("unit"); unit != json.end() && unit->is_string())
        for (const auto& [value, name] : kUnits)
            if (*unit == name)
                settings.unit = value;
    if (const auto panels = json.find("panels"); panels != json.end() && panels->is_object())
        for (const auto& [panel, name] : kPanels)
            if (const auto shown = panels->find(name); shown != panels->end() && shown->is_boolean())
                settings.panels.*panel = *shown;
    if (const auto window = json.find("window"); window != json.end() && window->is_array() && window->size() == 2 &&
                                                 (*window)[0].is_number_unsigned() && (*window)[1].is_number_unsigned())
        settings.window = {std::clamp((*window)[0].get<uint32_t>(), kLeastWindow, kMostWindow),
                           std::clamp((*window)[1].get<uint32_t>(), kLeastWindow, kMostWindow)};
}

Status write_if_changed(const std::string& file, const std::string& text)
{
    const Result<std::vector<std::byte>> there = read_file(file);
    const auto bytes = std::as_bytes(std::span(text));
    if (there.ok() && std::equal(there->begin(), there->end(), bytes.begin(), bytes.end()))
        return Done{};
    return write_file_atomically(file, {bytes.begin(), bytes.end()}, Durability::Unsynced);
}

} // namespace

Result<ViewerSettings> read_settings(const std::string& folder)
{
    ViewerSettings settings;
    const Result<Json> json = read_state_json(settings_file(folder));
    if (!json.ok())
        return json.error();
    if (!json->is_null() && !json->is_object())
        return not_state(settings_file(folder), "expected an object");
    take(*json, settings);
    std::error_code unknown;
    if (fs::exists(look_file(folder), unknown)) {
        Result<SceneRequest> look = read_scene_file(look_file(folder));
        if (!look.ok())
            return look.error();
        settings.look = std::move(*look);
    }
    return settings;
}

void take_kept_look(const SceneRequest& kept, SceneRequest& look)
{
    look.samples = kept.samples;
    look.edges = kept.edges;
    look.silhouettes = kept.silhouettes;
    look.edge_width_px = kept.edge_width_px;
    look.antialias_trims = kept.antialias_trims;
    look.shadows = kept.shadows;
    look.look.occlusion.samples = kept.look.occlusion.samples;
}

Status write_settings(const std::string& folder, const ViewerSettings& settings)
{
    const Status written = write_if_changed(settings_file(folder), state_text(to_json(settings)));
    if (!written.ok() || !settings.look)
        return written;
    SceneRequest for_any_model;
    take_kept_look(*settings.look, for_any_model);
    return write_if_changed(look_file(folder), scene_text(for_any_model) + "\n");
}

} // namespace trimray
