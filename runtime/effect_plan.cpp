#include "runtime/effect_plan.h"

#include "runtime/frame_effects.h"
#include "runtime/light_view.h"
#include "runtime/materials.h"
#include "runtime/stochastic_frames.h"
#include "runtime/surface_map.h"

#include <fmt/format.h>

#include <algorithm>

namespace trimray {
namespace {

// The software driver ends an invocation's loops in silence after 65,535 iterations. walk() looks at its count after
// each round, which takes at most 20,000 (kRoundIterations in leaf_hit.glsl); shading takes another 3,400. Edges, where
// they are wanted, take 12,000 (kEdgeIterations in border_edges.glsl) and a piece more, a map less than kMapIterations:
// two evaluations of 26 x 26 points and 6 x 350 steps of their polynomials.
constexpr uint32_t kSoftwareIterationLimit = 42000, kSoftwareIterationLimitWithEdges = 28000, kMapIterations = 6000;

// Two trees of kMaxBvhDepth that leave 3 waiting children a node
constexpr uint32_t kLargestStackSize = 290;

// Larger nets are read from the buffer on the software driver too: so many floats lie beside each invocation
constexpr uint32_t kMostLocalFloats = 1024;

std::string counted(size_t count, const char* one, const char* many)
{
    return fmt::format("{} {}", count, count == 1 ? one : many);
}

/// The degrees that most patches have: "; 3 x 3: 700, 3 x 1: 12".
std::string common_degrees(const PackFacts& facts, bool rational)
{
    constexpr int kMost = 3;
    std::string text;
    int told = 0;
    for (const DegreeCount& degree : facts.degrees)
        if (degree.rational == rational && told++ < kMost)
            text +=
                fmt::format("{} {} x {}: {}", told == 1 ? ';' : ',', degree.degree_u, degree.degree_v, degree.patches);
    return text;
}

/// The degree in one direction that all Bezier patches share; 0: none.
uint32_t common_degree(const PackFacts& facts, uint32_t DegreeCount::*direction)
{
    if (facts.degrees.empty())
        return 0;
    const uint32_t first = facts.degrees[0].*direction;
    const bool shared =
        std::ranges::all_of(facts.degrees, [&](const DegreeCount& degree) { return degree.*direction == first; });
    return shared ? first : 0;
}

std::string known_degree(uint32_t common, uint32_t largest)
{
    return common > 0 ? std::to_string(common) : fmt::format("up to {}", largest);
}

// What the tracer meets are patches; a file's cylinder may have been converted to Bezier patches.
void add_surfaces(const PackFacts& facts, std::vector<EffectItem>& items)
{
    for (uint kind = 0; kind < kKindBezier; ++kind)
        if (facts.patches[kind] > 0)
            items.push_back({surface_kind_name(kind),
                             counted(facts.patches[kind], "native patch, closed form", "native patches, closed form")});
    const size_t rational = facts.rational_patches(), polynomial = facts.bezier_patches() - rational;
    if (polynomial > 0)
        items.push_back({"bezier", fmt::format("{}, degree up to {}{}",
                                               counted(polynomial, "polynomial patch", "polynomial patches"),
                                               facts.largest_degree(), common_degrees(facts, false))});
    if (rational > 0)
        items.push_back({"bezier-rational",
                         fmt::format("{}, degree up to {}{}", counted(rational, "rational patch", "rational patches"),
                                     facts.largest_degree(), common_degrees(facts, true))});
}

const char* trim_effect(TrimMode mode)
{
    switch (mode) {
    case TrimMode::Sdf:
        return "trim-sdf";
    case TrimMode::Hybrid:
        return "trim-hybrid";
    case TrimMode::Kd:
        return "trim-kd";
    default:
        return "trim-exact";
    }
}

void add_faces(const PackFacts& facts, TrimMode trim, std::vector<EffectItem>& items)
{
    if (facts.trimmed_faces > 0)
        items.push_back({trim_effect(trim), fmt::format("{} of {} have trims that are not their natural border",
                                                        facts.trimmed_faces, counted(facts.faces, "face", "faces"))});
    if (facts.rim_faces > 0)
        items.push_back({"rims", counted(facts.rim_faces, "face reaches beyond its edges, where its back is no surface",
                                         "faces reach beyond their edges, where their backs are no surface")});
    if (facts.instances > 1)
        items.push_back({"instances", fmt::format("{} of {}", counted(facts.instances, "placement", "placements"),
                                                  counted(facts.parts, "part", "parts"))});
    if (facts.mirrored_instances > 0)
        items.push_back({"mirrored-instances", counted(facts.mirrored_instances, "placement is a mirror image",
                                                       "placements are mirror images")});
    if (facts.colored_faces > 0)
        items.push_back(
            {"face-colors", counted(facts.colored_faces, "face has its own colour", "faces have their own colours")});
    if (facts.colored_instances > 0)
        items.push_back(
            {"instance-colors", counted(facts.colored_instances, "placement has a colour", "placements have colours")});
}

void add_search(const PackFacts& facts, const EffectPlan& plan, std::vector<EffectItem>& items)
{
    if (plan.stochastic)
        items.push_back({"stochastic-starts", "asked for: one start a leaf and frame, the nearest hit of all frames"});
    else if (facts.flagged_leaves > 0)
        items.push_back(
            {"leaf-parts", fmt::format("{} flagged, of {}: no ray is proved to meet them once",
                                       counted(facts.flagged_leaves, "leaf is", "leaves are"), facts.bezier_leaves)});
    if (plan.reuses_hits)
        items.push_back({"reused-hits", "asked for: rays search first where the last picture suggests"});
}

// Lines and blended borders are passes over the frame: their names say what the pass reads.
void add_drawing(const PackFacts& facts, const RenderOptions& options, std::vector<EffectItem>& items)
{
    if (options.edges != EdgeLines::None)
        items.push_back(
            {"edges", fmt::format("asked for: {} where faces meet at an angle, {} where one ends",
                                  counted(facts.edges[kEdgeSharp], "piece", "pieces"), facts.edges[kEdgeFree])});
    if (options.edges == EdgeLines::All)
        items.push_back({"edges-smooth", fmt::format("asked for: {} where faces meet smoothly",
                                                     counted(facts.edges[kEdgeSmooth], "piece", "pieces"))});
    if (options.silhouettes)
        items.push_back({"silhouettes", "asked for: lines where surfaces turn away or hide what lies behind"});
    if (options.antialias_trims)
        items.push_back({"trim-antialiasing", "asked for: borders and rims blended at one sample a pixel"});
    if (!options.fill)
        items.push_back({"unfilled-faces", "asked for: faces show the background"});
}

bool is_soft(const Light& light)
{
    return light.shadows && (light.kind == LightKind::Point ? light.radius_mm : light.half_angle_deg) > 0;
}

template <class Range, class Predicate>
size_t count_if(const Range& range, Predicate predicate)
{
    return static_cast<size_t>(std::count_if(range.begin(), range.end(), predicate));
}

bool lets_light_through(const MaterialRule& rule)
{
    return rule.material.opacity.value_or(1) < 1;
}
bool mirrors(const MaterialRule& rule)
{
    return rule.material.mirror.value_or(0) > 0;
}

std::string open_parts_note(const PackFacts& facts)
{
    if (facts.open_parts == 0)
        return "";
    return fmt::format("; {} of {} not closed, and caps there are only where faces happen to enclose something",
                       facts.open_parts, counted(facts.parts, "part is", "parts are"));
}

std::string arrangement_note(const PackFacts& facts, const Arrangement& arrangement)
{
    return fmt::format(
        "asked for: {} of {}{}", facts.shown_instances,
        counted(facts.instances, "placement is shown", "placements are shown"),
        arrangement.explode > 0
            ? fmt::format(", farther from the model's middle by {} times its distance", arrangement.explode)
            : "");
}

void add_geometry(const PackFacts& facts, uint32_t look, const SceneLook& scene, std::vector<EffectItem>& items)
{
    if ((look & kLookArrangement) != 0)
        items.push_back({"arrangement", arrangement_note(facts, scene.arrangement)});
    if ((look & kLookOrthographic) != 0)
        items.push_back({"orthographic", "asked for: parallel rays"});
    if ((look & kLookSection) != 0)
        items.push_back({"section", fmt::format("asked for: {}", counted(scene.section.planes.size(),
                                                                         "plane cuts away what is before it",
                                                                         "planes cut away what is before them"))});
    if ((look & kLookCaps) != 0)
        items.push_back({"caps", fmt::format("asked for: cut solids are {}{}",
                                             scene.section.caps == CapStyle::Hatched ? "hatched" : "filled",
                                             open_parts_note(facts))});
}

void add_look(uint32_t look, const SceneLook& scene, std::vector<EffectItem>& items)
{
    if ((look & kLookLights) != 0)
        items.push_back(
            {"lights", fmt::format("asked for: {}{}", counted(scene.lights.size(), "light", "lights"),
                                   scene.sky ? fmt::format(", and a sky of strength {}", *scene.sky) : "")});
    if ((look & kLookShadows) != 0)
        items.push_back(
            {"shadows",
             fmt::format("asked for: {}", counted(count_if(scene.lights, [](const Light& l) { return l.shadows; }),
                                                  "light throws shadows", "lights throw shadows"))});
    if ((look & kLookSoftShadows) != 0)
        items.push_back(
            {"soft-shadows", fmt::format("{}, {} a pixel",
                                         counted(count_if(scene.lights, is_soft), "of these lights has a size",
                                                 "of these lights have sizes"),
                                         counted(scene.light_samples, "ray", "rays"))});
    if ((look & kLookOcclusion) != 0)
        items.push_back(
            {"occlusion", fmt::format("asked for: {} a pixel, as far as {} mm",
                                      counted(scene.occlusion.samples, "ray", "rays"), scene.occlusion.reach_mm)});
    if ((look & kLookMaterials) != 0)
        items.push_back({"materials", fmt::format("asked for: {}", counted(scene.materials.size(), "rule", "rules"))});
    if ((look & kLookTransparency) != 0)
        items.push_back({"transparency",
                         scene.xray.value_or(1) < 1
                             ? fmt::format("asked for: opacity {} of all that no rule names", *scene.xray)
                             : fmt::format("{} opacity below 1", counted(count_if(scene.materials, lets_light_through),
                                                                         "rule gives an", "rules give an"))});
    if ((look & kLookMirrors) != 0)
        items.push_back({"mirrors", fmt::format("{}; {} followed",
                                                counted(count_if(scene.materials, mirrors), "rule makes a mirror",
                                                        "rules make mirrors"),
                                                counted(scene.mirror_depth, "reflection is", "reflections are"))});
    if ((look & kLookEnvironment) != 0)
        items.push_back({"environment", fmt::format("asked for: a picture of {} x {}", scene.environment->width,
                                                    scene.environment->height)});
}

/// One item, the map's name.
void add_map(const RenderOptions& options, std::vector<EffectItem>& items)
{
    const SurfaceMap map = options.look.map.map;
    if (!has_map(options))
        return;
    const char* why = map == SurfaceMap::Zebra       ? "asked for: stripes mirrored in surfaces"
                      : map == SurfaceMap::Isophotes ? "asked for: bands of equal angle to a direction"
                      : map == SurfaceMap::Draft     ? "asked for: angles between surfaces and the pull"
                                                     : "asked for: curvatures from second derivatives";
    items.push_back({surface_map_name(map), why});
}

} // namespace

uint32_t look_bits(const RenderOptions& options)
{
    const SceneLook& look = options.look;
    uint32_t bits = 0;
    const auto add = [&bits](bool wanted, LookBit bit) { bits |= wanted ? bit : 0u; };
    add(options.camera.orthographic_mm > 0, kLookOrthographic);
    add(look.arrangement.any(), kLookArrangement);
    add(!look.section.planes.empty(), kLookSection);
    add(!look.section.planes.empty() && look.section.caps != CapStyle::None, kLookCaps);
    add(has_map(options), kLookMap);
    if (!options.shade)
        return bits;
    const auto any = [](const auto& range, auto predicate) {
        return std::any_of(range.begin(), range.end(), predicate);
    };
    add(!look.lights.empty() || look.sky, kLookLights);
    add(any(look.lights, [](const Light& light) { return light.shadows; }), kLookShadows);
    add(any(look.lights, is_soft), kLookSoftShadows);
    add(look.occlusion.samples > 0, kLookOcclusion);
    add(has_mirrors(look), kLookMirrors);
    add(has_transparency(look), kLookTransparency);
    add(any(look.materials, [](const MaterialRule& rule) { return rule.material.color || rule.material.specular; }),
        kLookMaterials);
    add(look.environment != nullptr, kLookEnvironment);
    return bits;
}

Status check_look(const RenderOptions& options, uint32_t done, const std::string& tracer)
{
    struct Item {
        LookBit bit;
        const char *option, *what;
    };
    const Arrangement& arrangement = options.look.arrangement;
    const Item items[kLookBits] = {
        {kLookLights, "--light", "lights"},
        {kLookShadows, "--shadows", "shadows"},
        {kLookSoftShadows, "--shadows", "soft shadows"},
        {kLookOcclusion, "--occlusion", "rays of ambient occlusion"},
        {kLookMirrors, "--material", "mirrors"},
        {kLookTransparency, "--xray", "transparent materials"},
        {kLookMaterials, "--material", "materials"},
        {kLookMap, "--map", "maps"},
        {kLookSection, "--section", "sections"},
        {kLookCaps, "--caps", "caps of sections"},
        {kLookEnvironment, "--environment", "environments"},
        {kLookOrthographic, "--ortho", "parallel rays"},
        {kLookArrangement,
         !arrangement.hide.empty()   ? "--hide"
         : !arrangement.only.empty() ? "--only"
                                     : "--explode",
         "arrangements of placements"},
    };
    const uint32_t missing = look_bits(options) & ~done;
    for (const Item& item : items)
        if ((missing & item.bit) != 0)
            return Error{ErrorCode::UnsupportedFormat, item.option,
                         fmt::format("{} are not in this version of the tracer {}", item.what, tracer)};
    return Done{};
}

EffectPlan effect_plan(const PackFacts& facts, const RenderOptions& options, DeviceKind device)
{
    EffectPlan plan;
    plan.kinds = facts.kinds();
    plan.rational = facts.rational_patches() > 0;
    plan.trims = facts.trimmed_faces > 0;
    plan.cut = !options.look.section.planes.empty();
    plan.rims = facts.rim_faces > 0 && !plan.cut; // a section shows the inside
    plan.trim = options.trim == TrimMode::Auto ? TrimMode::Exact : options.trim;
    plan.shade = options.shade;
    plan.edges = has_effects(options) && edge_query(options).any();
    plan.parallel = options.camera.orthographic_mm > 0;
    plan.lit = options.shade && has_lights(options.look);
    plan.stochastic = options.closest == ClosestPolicy::Stochastic;
    plan.keeps_hits = keeps_hits(options);
    const bool vulkan = device == DeviceKind::Vulkan || device == DeviceKind::SoftwareVulkan;
    plan.reuses_hits = vulkan && options.reuse_last && !plan.stochastic;
    plan.map = has_map(options) ? options.look.map.map : SurfaceMap::None;
    plan.look = look_bits(options);
    plan.materials = options.shade && has_materials(options.look);
    plan.layers = (plan.look & kLookTransparency) != 0;
    plan.mirrors = (plan.look & kLookMirrors) != 0;
    plan.environment = (plan.look & kLookEnvironment) != 0;
    plan.specialised = options.specialise;
    plan.stack_size = plan.specialised ? facts.stack_size : kLargestStackSize;
    if (vulkan && plan.specialised) {
        plan.degree_u = common_degree(facts, &DegreeCount::degree_u);
        plan.degree_v = common_degree(facts, &DegreeCount::degree_v);
        plan.largest_degree = facts.largest_degree();
    }
    if (device == DeviceKind::SoftwareVulkan) {
        const uint32_t net_floats = plan.specialised ? facts.largest_net_floats : kMostLocalFloats;
        plan.local_floats = facts.largest_net_floats <= kMostLocalFloats ? net_floats : 0;
        plan.iteration_limit =
            (plan.edges || !plan.specialised ? kSoftwareIterationLimitWithEdges : kSoftwareIterationLimit) -
            (plan.map != SurfaceMap::None || !plan.specialised ? kMapIterations : 0);
    }

    std::vector<EffectItem>& items = plan.items;
    add_surfaces(facts, items);
    add_faces(facts, plan.trim, items);
    add_search(facts, plan, items);
    add_geometry(facts, plan.look, options.look, items);
    add_map(options, items);
    if (plan.shade) {
        items.push_back({"shading", "the picture is asked for, not hits alone"});
        add_drawing(facts, options, items);
        add_look(plan.look, options.look, items);
    }
    if (vulkan && plan.specialised && facts.bezier_patches() > 0)
        items.push_back({"known-degrees", fmt::format("the driver can unroll the loops over control points: degree {} "
                                                      "in u, {} in v",
                                                      known_degree(plan.degree_u, plan.largest_degree),
                                                      known_degree(plan.degree_v, plan.largest_degree))});
    if (plan.local_floats > 0)
        items.push_back({"local-nets", fmt::format("a software driver: control points are copied beside each ray, {} "
                                                   "floats for the largest patch",
                                                   plan.local_floats)});
    if (plan.iteration_limit > 0)
        items.push_back({"iteration-limit", "a software driver: it ends long loops, so rays that need them are traced "
                                            "again by themselves"});
    return plan;
}

std::array<uint32_t, kSurfaceKindCount> faces_by_kind(const PackImage& image)
{
    std::array<uint32_t, kSurfaceKindCount> counts{};
    for (const FaceRecord& face : image.faces)
        ++counts[face.surface_kind];
    return counts;
}

const char* surface_kind_name(uint kind)
{
    constexpr std::array<const char*, kSurfaceKindCount> names = {"plane",  "cylinder", "cone",
                                                                  "sphere", "torus",    "bezier"};
    return kind < names.size() ? names[kind] : "unknown";
}

} // namespace trimray
