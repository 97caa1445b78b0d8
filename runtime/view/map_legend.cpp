#define TRIMRAY_ONE_RAY // the shared formulas for one ray, not for packets
#include "runtime/view/map_legend.h"

#include "runtime/image_io.h"
#include "runtime/surface_map.h"
#include "shaders/shared/surface_map.h"

#include <fmt/format.h>

#include <cassert>
#include <cmath>
#include <numbers>

namespace trimray {
namespace {

constexpr size_t kCurvatureStops = 65; // a person sees no corner between them

/// A point at which a map has a value: of curvatures any that come to it; of angles to an axis, which is z here, one
/// whose normal has that angle and looks straight at the eye, so that the ray mirrored there is the normal too.
one_ray::MapPoint point_of_value(SurfaceMap map, double value)
{
    const one_ray::real3 none(0, 0, 0);
    one_ray::MapPoint point{};
    point.normal_steps = point.to_eye_steps = {none, none};
    if (is_curvature(map)) {
        point.curvatures.larger = float(value);
        point.curvatures.smaller = map == SurfaceMap::CurvatureGaussian ? 1.0f : float(value);
        return point;
    }
    const double angle = (map == SurfaceMap::Draft ? 90 - value : value) * std::numbers::pi / 180;
    point.normal = point.to_eye = one_ray::real3(float(std::sin(angle)), 0, float(std::cos(angle)));
    return point;
}

MapView view_along_z(const PackImage& image, const SurfaceMapLook& look)
{
    MapView view = map_view(image, look);
    view.direction[0] = view.direction[1] = 0;
    view.direction[2] = 1;
    return view;
}

std::array<uint8_t, 4> srgb_of(SurfaceMap map, const MapView& view, double value)
{
    const one_ray::real3 color = one_ray::map_color(uint(map), view, point_of_value(map, value)).color;
    Frame pixel; // rounded as pictures are
    pixel.width = pixel.height = 1;
    pixel.rgba = {color.x, color.y, color.z, 1};
    const Picture shown = to_picture(pixel);
    return {shown.rgba[0], shown.rgba[1], shown.rgba[2], shown.rgba[3]};
}

const char* title_of(SurfaceMap map)
{
    switch (map) {
    case SurfaceMap::None:
        break;
    case SurfaceMap::Zebra:
        return "mirrored ray to the stripes' axis";
    case SurfaceMap::Isophotes:
        return "normal to the direction";
    case SurfaceMap::CurvatureGaussian:
        return "Gaussian curvature";
    case SurfaceMap::CurvatureMean:
        return "mean curvature";
    case SurfaceMap::CurvatureMax:
        return "larger curvature";
    case SurfaceMap::CurvatureMin:
        return "smaller curvature";
    case SurfaceMap::Draft:
        return "draft";
    }
    return "";
}

/// As short as four digits can tell it; what is nothing but rounding beside the scale's length is 0.
std::string number(double value, double scale)
{
    constexpr double kRounding = 1e-9;
    return fmt::format("{:.4g}", std::abs(value) < kRounding * scale ? 0.0 : value);
}

void add_curvatures(const PackImage& image, const SurfaceMapLook& look, MapLegend& legend)
{
    const auto [lo, hi] = curvature_range(image, look);
    const MapView view = map_view(image, look);
    legend.unit = look.map == SurfaceMap::CurvatureGaussian ? "1/mm²" : "1/mm";
    if (!look.range)
        legend.note = "the range follows from the model's size";
    const auto value_at = [lo = lo, hi = hi](double position) { return lo * (1 - position) + hi * position; };
    for (size_t i = 0; i < kCurvatureStops; ++i) {
        const double position = double(i) / (kCurvatureStops - 1), value = value_at(position);
        legend.stops.push_back({position, value, srgb_of(look.map, view, value)});
    }
    constexpr int kTicks = 5; // the scale's five colours
    for (int i = 0; i < kTicks; ++i) {
        const double position = double(i) / (kTicks - 1);
        legend.ticks.push_back({position, number(value_at(position), hi - lo)});
    }
}

void add_draft(const PackImage& image, const SurfaceMapLook& look, MapLegend& legend)
{
    struct Stretch {
        double lo, hi; // degrees
        const char* name;
    };
    const double least = look.draft_deg;
    std::vector<Stretch> stretches{{-90, -least, "undercut"}, {least, 90, "enough"}};
    if (least > 0)
        stretches.insert(stretches.begin() + 1, {-least, least, "too little"});
    legend.unit = "°";
    const MapView view = view_along_z(image, look);
    const double length = 1 / double(stretches.size());
    for (size_t i = 0; i < stretches.size(); ++i) {
        const auto [lo, hi, name] = stretches[i];
        const double begin = double(i) * length, end = i + 1 == stretches.size() ? 1 : double(i + 1) * length;
        const std::array<uint8_t, 4> srgb = srgb_of(look.map, view, 0.5 * (lo + hi));
        legend.stops.push_back({begin, lo, srgb});
        legend.stops.push_back({end, hi, srgb});
        legend.names.push_back({0.5 * (begin + end), name});
        legend.ticks.push_back({begin, number(lo, 1)});
    }
    legend.ticks.push_back({1, "90"});
}

void add_bands(const PackImage& image, const SurfaceMapLook& look, MapLegend& legend)
{
    struct Stretch {
        double lo, hi; // shares of a period
    };
    const double period_deg = 180.0 / look.stripes;
    legend.unit = "°";
    legend.note = fmt::format("the same every {}°", number(period_deg, 1));
    const MapView view = view_along_z(image, look);
    for (const auto& [lo, hi] : {Stretch{0, 0.25}, Stretch{0.25, 0.75}, Stretch{0.75, 1}}) {
        const std::array<uint8_t, 4> srgb = srgb_of(look.map, view, 0.5 * (lo + hi) * period_deg);
        legend.stops.push_back({lo, lo * period_deg, srgb});
        legend.stops.push_back({hi, hi * period_deg, srgb});
    }
    for (const double share : {0.0, 0.25, 0.75, 1.0})
        legend.ticks.push_back({share, number(share * period_deg, 1)});
}

} // namespace

MapLegend map_legend(const PackImage& image, const SurfaceMapLook& look)
{
    assert(look.map != SurfaceMap::None && check_map(image, look).ok());
    MapLegend legend;
    legend.title = title_of(look.map);
    legend.lit = one_ray::is_lit_map(uint(look.map));
    if (is_curvature(look.map))
        add_curvatures(image, look, legend);
    else if (look.map == SurfaceMap::Draft)
        add_draft(image, look, legend);
    else
        add_bands(image, look, legend);
    return legend;
}

std::array<uint8_t, 4> map_color_srgb(const PackImage& image, const SurfaceMapLook& look, double value)
{
    return srgb_of(look.map, is_curvature(look.map) ? map_view(image, look) : view_along_z(image, look), value);
}

} // namespace trimray
