#include "runtime/surface_map.h"

#include "format/affine.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace trimray {
namespace {

static_assert(uint(SurfaceMap::None) == kMapNone && uint(SurfaceMap::Zebra) == kMapZebra &&
              uint(SurfaceMap::Isophotes) == kMapIsophotes && uint(SurfaceMap::CurvatureGaussian) == kMapGaussian &&
              uint(SurfaceMap::CurvatureMean) == kMapMean && uint(SurfaceMap::CurvatureMax) == kMapLarger &&
              uint(SurfaceMap::CurvatureMin) == kMapSmaller && uint(SurfaceMap::Draft) == kMapDraft);

double length_of(const std::array<double, 3>& v)
{
    return std::hypot(v[0], v[1], v[2]);
}

} // namespace

bool is_curvature(SurfaceMap map)
{
    return map >= SurfaceMap::CurvatureGaussian && map <= SurfaceMap::CurvatureMin;
}

std::array<double, 2> curvature_range(const PackImage& image, const SurfaceMapLook& look)
{
    if (look.range)
        return *look.range;
    double square = 0;
    for (int i = 0; i < 3; ++i)
        square += std::pow(image.bounds_hi_mm[i] - image.bounds_lo_mm[i], 2);
    double end = kCurvatureRange / std::sqrt(square > 0 ? square : 1);
    if (look.map == SurfaceMap::CurvatureGaussian)
        end *= end;
    return {-end, end};
}

const char* surface_map_name(SurfaceMap map)
{
    switch (map) {
    case SurfaceMap::None:
        return "none";
    case SurfaceMap::Zebra:
        return "zebra";
    case SurfaceMap::Isophotes:
        return "isophotes";
    case SurfaceMap::CurvatureGaussian:
        return "curvature-gaussian";
    case SurfaceMap::CurvatureMean:
        return "curvature-mean";
    case SurfaceMap::CurvatureMax:
        return "curvature-max";
    case SurfaceMap::CurvatureMin:
        return "curvature-min";
    case SurfaceMap::Draft:
        return "draft";
    }
    return "unknown";
}

bool measures(SurfaceMap map)
{
    return is_curvature(map) || map == SurfaceMap::Draft;
}

bool has_map(const RenderOptions& options)
{
    return options.look.map.map != SurfaceMap::None && (options.shade || measures(options.look.map.map));
}

Status check_map(const PackImage& image, const SurfaceMapLook& look)
{
    if (look.map == SurfaceMap::None)
        return Done{};
    if (is_curvature(look.map)) {
        if (look.range) {
            const auto [lo, hi] = *look.range;
            if (!(std::isfinite(lo) && std::isfinite(hi) && lo < hi))
                return Error{ErrorCode::Usage, "the map's range",
                             fmt::format("expected two numbers, the lower first; found {}, {}", lo, hi)};
        }
        for (size_t i = 0; i < image.instances.size(); ++i)
            if (!similarity_scale(image.instances[i].transform))
                return Error{ErrorCode::UnsupportedPackFeature, fmt::format("instance {}", i),
                             "it is stretched along an axis; curvatures are measured on parts that are turned, "
                             "mirrored or scaled evenly"};
        return Done{};
    }
    const double length = length_of(look.direction);
    if (!(length > 0 && std::isfinite(length)))
        return Error{ErrorCode::Usage, "the map's direction",
                     fmt::format("expected a direction; found {}, {}, {}", look.direction[0], look.direction[1],
                                 look.direction[2])};
    if (look.map == SurfaceMap::Draft && !(look.draft_deg >= 0 && look.draft_deg < 90))
        return Error{ErrorCode::Usage, "the map's draft",
                     fmt::format("expected degrees in [0, 90); found {}", look.draft_deg)};
    if (look.map != SurfaceMap::Draft && !(look.stripes >= 1 && look.stripes <= kMostStripes))
        return Error{ErrorCode::Usage, "the map's stripes",
                     fmt::format("expected 1 to {}; found {}", kMostStripes, look.stripes)};
    return Done{};
}

MapView map_view(const PackImage& image, const SurfaceMapLook& look)
{
    MapView view{};
    const double length = length_of(look.direction);
    for (size_t i = 0; i < 3; ++i)
        view.direction[i] = float(length > 0 ? look.direction[i] / length : 0);
    view.stripes = float(look.stripes);
    if (is_curvature(look.map)) {
        const auto [lo, hi] = curvature_range(image, look);
        view.per_range = float(2 / (hi - lo));
        view.range_middle = float((hi + lo) / (hi - lo));
    }
    view.draft = float(look.draft_deg * std::numbers::pi / 180);
    return view;
}

} // namespace trimray
