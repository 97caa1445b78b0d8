#include "runtime/view/effect_costs.h"

#include "runtime/arrangement.h"
#include "runtime/effect_plan.h"
#include "runtime/median.h"
#include "runtime/navigation.h"
#include "runtime/surface_map.h"

#include <algorithm>
#include <cassert>

namespace trimray {
namespace {

struct Removable {
    std::string name;
    void (*remove)(RenderOptions& options);
};

/// Makes all rules say nothing of what `fields` are, and drops those that then say nothing.
template <class... Fields>
void forget(SceneLook& look, Fields... fields)
{
    for (MaterialRule& rule : look.materials)
        ((rule.material.*fields).reset(), ...);
    std::erase_if(look.materials, [](const MaterialRule& rule) {
        const Material& m = rule.material;
        return !m.color && !m.opacity && !m.mirror && !m.specular;
    });
}

void remove_map(RenderOptions& options)
{
    options.look.map.map = SurfaceMap::None;
}

std::vector<Removable> table()
{
    std::vector<Removable> effects{
        {"arrangement", [](RenderOptions& o) { o.look.arrangement = {}; }},
        {"orthographic", [](RenderOptions& o) { o.camera = with_perspective(o.camera); }},
        {"section", [](RenderOptions& o) { o.look.section.planes.clear(); }},
        {"caps", [](RenderOptions& o) { o.look.section.caps = CapStyle::None; }},
    };
    for (const SurfaceMap map :
         {SurfaceMap::Zebra, SurfaceMap::Isophotes, SurfaceMap::CurvatureGaussian, SurfaceMap::CurvatureMean,
          SurfaceMap::CurvatureMax, SurfaceMap::CurvatureMin, SurfaceMap::Draft})
        effects.push_back({surface_map_name(map), remove_map});
    const Removable drawn[] = {
        {"edges", [](RenderOptions& o) { o.edges = EdgeLines::None; }},
        {"edges-smooth",
         [](RenderOptions& o) {
             if (o.edges == EdgeLines::All)
                 o.edges = EdgeLines::Sharp;
         }},
        {"silhouettes", [](RenderOptions& o) { o.silhouettes = false; }},
        {"trim-antialiasing", [](RenderOptions& o) { o.antialias_trims = false; }},
        {"unfilled-faces", [](RenderOptions& o) { o.fill = true; }},
        {"lights",
         [](RenderOptions& o) {
             o.look.lights.clear();
             o.look.sky.reset();
         }},
        {"shadows",
         [](RenderOptions& o) {
             for (Light& light : o.look.lights)
                 light.shadows = false;
         }},
        {"soft-shadows",
         [](RenderOptions& o) {
             for (Light& light : o.look.lights)
                 light.half_angle_deg = light.radius_mm = 0;
         }},
        {"occlusion", [](RenderOptions& o) { o.look.occlusion.samples = 0; }},
        {"materials", [](RenderOptions& o) { forget(o.look, &Material::color, &Material::specular); }},
        {"transparency",
         [](RenderOptions& o) {
             forget(o.look, &Material::opacity);
             o.look.xray.reset();
         }},
        {"mirrors", [](RenderOptions& o) { forget(o.look, &Material::mirror); }},
        {"environment", [](RenderOptions& o) { o.look.environment.reset(); }},
    };
    effects.insert(effects.end(), std::begin(drawn), std::end(drawn));
    return effects;
}

const Removable* find(const std::vector<Removable>& effects, const std::string& name)
{
    const auto found =
        std::find_if(effects.begin(), effects.end(), [&](const Removable& effect) { return effect.name == name; });
    return found == effects.end() ? nullptr : &*found;
}

/// The items of `all` that `left` has not, but for `name`.
std::vector<std::string> gone(const std::vector<EffectItem>& all, const std::vector<EffectItem>& left,
                              const std::string& name)
{
    std::vector<std::string> names;
    for (const EffectItem& item : all)
        if (item.name != name &&
            std::none_of(left.begin(), left.end(), [&](const EffectItem& other) { return other.name == item.name; }))
            names.push_back(item.name);
    return names;
}

/// No error of a measured effect is then less than the median of them all.
void raise_to_median(std::vector<EffectCost>& effects)
{
    std::vector<double> errors;
    for (const EffectCost& effect : effects)
        if (effect.ms)
            errors.push_back(effect.error_ms);
    for (EffectCost& effect : effects)
        if (effect.ms)
            effect.error_ms = std::max(effect.error_ms, median(errors));
}

} // namespace

std::vector<std::string> removable_effects()
{
    std::vector<std::string> names;
    for (const Removable& effect : table())
        names.push_back(effect.name);
    return names;
}

RenderOptions without_effect(const std::string& name, RenderOptions options)
{
    const std::vector<Removable> effects = table();
    const Removable* effect = find(effects, name);
    assert(effect && "one of removable_effects()");
    effect->remove(options);
    return options;
}

Result<EffectCosts> measure_effect_costs(Tracer& tracer, const PackImage& image, const RenderOptions& options,
                                         const TurnOptions& turns)
{
    KeptArrangement arrangement;
    if (const Result<bool> arranged = arrangement.change_to(image, options.look.arrangement); !arranged.ok())
        return arranged.error();
    PackFacts facts = pack_facts(image);
    facts.shown_instances = arrangement.view(image).visible_count();
    const auto items_of = [&](const RenderOptions& asked) {
        return effect_plan(facts, asked, tracer.device_kind()).items;
    };
    const std::vector<EffectItem> items = items_of(options);
    const std::vector<Removable> effects = table();

    EffectCosts costs;
    std::vector<RenderOptions> pictures{options};
    std::vector<size_t> picture_of; // by effect; 0: it cannot be turned off
    for (const EffectItem& item : items) {
        EffectCost& cost = costs.effects.emplace_back();
        cost.name = item.name;
        cost.why = item.why;
        picture_of.push_back(0);
        const Removable* effect = find(effects, item.name);
        if (!effect)
            continue;
        picture_of.back() = pictures.size();
        effect->remove(pictures.emplace_back(options));
        cost.takes_along = gone(items, items_of(pictures.back()), item.name);
    }
    const auto first = [&](size_t, const Frame&, const RenderStats& stats) -> Status {
        costs.device = stats.device;
        return Done{};
    };
    const Result<std::vector<PictureTimes>> times = time_pictures(tracer, pictures, turns, first, {});
    if (!times.ok())
        return times.error();
    const std::vector<double>& whole = times->front().ms;
    costs.picture_ms = median(whole);
    costs.error_ms = median_error(whole);
    costs.work = times->front().work;
    costs.rounds = uint32_t(whole.size());
    for (size_t i = 0; i < costs.effects.size(); ++i) {
        if (picture_of[i] == 0)
            continue;
        const PictureTimes& without = (*times)[picture_of[i]];
        std::vector<double> differences;
        for (size_t round = 0; round < whole.size(); ++round)
            differences.push_back(whole[round] - without.ms[round]);
        costs.effects[i].ms = median(differences);
        costs.effects[i].error_ms = median_error(differences);
        costs.effects[i].work_without = without.work;
    }
    raise_to_median(costs.effects);
    return costs;
}

} // namespace trimray
