#include "runtime/effect_plan.h"

#include "runtime/leaf_slopes.h"
#include "runtime/surface_map.h"

#include <fmt/format.h>

#include <algorithm>

namespace trimray {
namespace {

std::string counted(size_t count, const char* one, const char* many)
{
    return fmt::format("{} {}", count, count == 1 ? one : many);
}

template <class Range, class Predicate>
size_t count_if(const Range& range, Predicate predicate)
{
    return static_cast<size_t>(std::count_if(range.begin(), range.end(), predicate));
}

// What the tracer meets are patches; a file's cylinder may have been converted to Bezier patches.
void add_surfaces(const PackImage& image, std::vector<EffectItem>& plan)
{
    std::array<size_t, kSurfaceKindCount> native{};
    size_t rational = 0, polynomial = 0;
    uint max_degree = 0;
    for (const PatchRecord& patch : image.patches) {
        const uint kind = patch.shape & 0xffu;
        if (kind != kKindBezier) {
            ++native[kind];
            continue;
        }
        ++((patch.shape & kShapeRational) != 0 ? rational : polynomial);
        max_degree = std::max({max_degree, (patch.shape >> 8) & 0xffu, (patch.shape >> 16) & 0xffu});
    }
    for (uint kind = 0; kind < kKindBezier; ++kind)
        if (native[kind] > 0)
            plan.push_back({surface_kind_name(kind),
                            counted(native[kind], "native patch, closed form", "native patches, closed form")});
    if (polynomial > 0)
        plan.push_back(
            {"bezier", fmt::format("{}, degree up to {}", counted(polynomial, "polynomial patch", "polynomial patches"),
                                   max_degree)});
    if (rational > 0)
        plan.push_back(
            {"bezier-rational",
             fmt::format("{}, degree up to {}", counted(rational, "rational patch", "rational patches"), max_degree)});
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
    default: // auto is exact
        return "trim-exact";
    }
}

void add_trims(const PackImage& image, const RenderOptions& options, std::vector<EffectItem>& plan)
{
    const size_t trimmed =
        count_if(image.faces, [](const FaceRecord& face) { return (face.flags & kFaceNaturalBorder) == 0; });
    if (trimmed == 0)
        return;
    const std::string why = fmt::format("{} of {} have trims that are not their natural border", trimmed,
                                        counted(image.faces.size(), "face", "faces"));
    plan.push_back({trim_effect(options.trim), why});
}

void add_placements(const PackImage& image, std::vector<EffectItem>& plan)
{
    const size_t mirrored = count_if(image.instances, [](const InstanceRecord& instance) {
        const double* t = instance.transform; // row-major 3x4
        const double determinant = t[0] * (t[5] * t[10] - t[6] * t[9]) - t[1] * (t[4] * t[10] - t[6] * t[8]) +
                                   t[2] * (t[4] * t[9] - t[5] * t[8]);
        return determinant < 0;
    });
    if (image.instances.size() > 1)
        plan.push_back({"instances", fmt::format("{} of {}", counted(image.instances.size(), "placement", "placements"),
                                                 counted(image.parts.size(), "part", "parts"))});
    if (mirrored > 0)
        plan.push_back(
            {"mirrored-instances", counted(mirrored, "placement is a mirror image", "placements are mirror images")});
}

void add_colors(const PackImage& image, std::vector<EffectItem>& plan)
{
    const size_t faces =
        count_if(image.faces, [](const FaceRecord& face) { return (face.flags & kFaceHasColor) != 0; });
    const size_t placements =
        count_if(image.instances, [](const InstanceRecord& instance) { return (instance.color_rgba >> 24) != 0; });
    if (faces > 0)
        plan.push_back({"face-colors", counted(faces, "face has its own colour", "faces have their own colours")});
    if (placements > 0)
        plan.push_back({"instance-colors", counted(placements, "placement has a colour", "placements have colours")});
}

/// Pieces of trims and sides of natural borders, by class.
std::array<size_t, kEdgeClassCount> edges_by_class(const PackImage& image)
{
    std::array<size_t, kEdgeClassCount> counts{};
    for (const uint word : image.trim_pieces)
        ++counts[word >> kPieceClassShift & 3u];
    for (const FaceRecord& face : image.faces)
        if ((face.flags & kFaceNaturalBorder) != 0)
            for (uint side = 0; side < 4; ++side)
                ++counts[face.border_classes >> 2 * side & 3u];
    return counts;
}

// Lines and blended borders are passes over the frame: their names say what the pass reads.
void add_drawing(const PackImage& image, const RenderOptions& options, std::vector<EffectItem>& plan)
{
    const std::array<size_t, kEdgeClassCount> edges = edges_by_class(image);
    if (options.edges != EdgeLines::None)
        plan.push_back({"edges", fmt::format("asked for: {} where faces meet at an angle, {} where one ends",
                                             counted(edges[kEdgeSharp], "piece", "pieces"), edges[kEdgeFree])});
    if (options.edges == EdgeLines::All)
        plan.push_back({"edges-smooth", fmt::format("asked for: {} where faces meet smoothly",
                                                    counted(edges[kEdgeSmooth], "piece", "pieces"))});
    if (options.silhouettes)
        plan.push_back({"silhouettes", "asked for: lines where surfaces turn away or hide what lies behind"});
    if (options.antialias_trims)
        plan.push_back({"trim-antialiasing", "asked for: borders and rims blended at one sample a pixel"});
    if (!options.fill)
        plan.push_back({"unfilled-faces", "asked for: faces show the background"});
}

/// One item, the map's name.
void add_map(const RenderOptions& options, std::vector<EffectItem>& plan)
{
    const SurfaceMap map = options.look.map.map;
    if (!has_map(options))
        return;
    const char* why = map == SurfaceMap::Zebra       ? "asked for: stripes mirrored in surfaces"
                      : map == SurfaceMap::Isophotes ? "asked for: bands of equal angle to a direction"
                      : map == SurfaceMap::Draft     ? "asked for: angles between surfaces and the pull"
                                                     : "asked for: curvatures from second derivatives";
    plan.push_back({surface_map_name(map), why});
}

} // namespace

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

std::vector<EffectItem> effect_plan(const PackImage& image, const RenderOptions& options)
{
    std::vector<EffectItem> plan;
    add_surfaces(image, plan);
    add_trims(image, options, plan);
    add_placements(image, plan);
    add_colors(image, plan);
    const LeafSlopes slopes = leaf_slopes(image);
    if (options.closest == ClosestPolicy::Stochastic)
        plan.push_back({"stochastic-starts", "asked for: one start a leaf and frame, the nearest hit of all frames"});
    else if (slopes.flagged > 0)
        plan.push_back({"leaf-parts", fmt::format("{} flagged, of {}: no ray is proved to meet them once",
                                                  counted(slopes.flagged, "leaf is", "leaves are"), slopes.leaves)});
    if (options.reuse_last && options.closest == ClosestPolicy::Certified)
        plan.push_back({"reused-hits", "asked for: rays search first where the last picture suggests, through Vulkan"});
    add_map(options, plan);
    if (options.shade) {
        plan.push_back({"shading", "the picture is asked for, not hits alone"});
        add_drawing(image, options, plan);
    }
    return plan;
}

} // namespace trimray
