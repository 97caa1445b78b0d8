#include "runtime/view/dimensions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trimray {
namespace {

using reference::angle_deg;
using reference::cross;
using reference::dot;
using reference::length;
using reference::Vec3;
using reference::operator+;
using reference::operator-;
using reference::operator*;

Dimension length_of(DimensionKind kind, double mm, std::vector<Vec3> anchors, double error = 0)
{
    return {kind, DimensionUnit::Millimetre, mm, error, std::move(anchors)};
}
Dimension angle_of(DimensionKind kind, double degrees, std::vector<Vec3> anchors, double error = 0)
{
    return {kind, DimensionUnit::Degree, degrees, error, std::move(anchors)};
}

/// Between two lines' directions, 0 to 90.
double acute_deg(const Vec3& a, const Vec3& b)
{
    const double angle = angle_deg(a, b);
    return std::min(angle, 180 - angle);
}

bool is_plane(const SurfaceFacts& facts)
{
    return facts.kind == kKindPlane && dot(facts.normal, facts.normal) > 0;
}

Vec3 foot_on_plane(const SurfaceFacts& plane, const Vec3& p)
{
    return p - plane.normal * dot(p - plane.point_mm, plane.normal);
}
Vec3 foot_on_axis(const AxisLine& axis, const Vec3& p)
{
    return axis.point + axis.direction * dot(p - axis.point, axis.direction);
}

void add_planes(const SurfaceFacts& a, const SurfaceFacts& b, std::vector<Dimension>& found)
{
    const double angle = acute_deg(a.normal, b.normal);
    found.push_back(angle_of(DimensionKind::PlaneAngle, angle, {a.point_mm, b.point_mm}));
    if (angle <= kParallel_deg) {
        const Vec3 foot = foot_on_plane(b, a.point_mm);
        found.push_back(length_of(DimensionKind::PlaneDistance, length(foot - a.point_mm), {a.point_mm, foot}));
    }
}

void add_plane_and_axis(const SurfaceFacts& plane, const AxisLine& axis, std::vector<Dimension>& found)
{
    const double angle = 90 - acute_deg(plane.normal, axis.direction);
    found.push_back(angle_of(DimensionKind::PlaneAxisAngle, angle, {plane.point_mm, axis.point}));
    if (angle <= kParallel_deg) {
        const Vec3 foot = foot_on_plane(plane, axis.point);
        found.push_back(length_of(DimensionKind::PlaneAxisDistance, length(foot - axis.point), {axis.point, foot}));
    }
}

void add_axes(const AxisLine& a, const AxisLine& b, std::vector<Dimension>& found)
{
    const double angle = acute_deg(a.direction, b.direction);
    found.push_back(angle_of(DimensionKind::AxisAngle, angle, {a.point, b.point}));
    Vec3 from = a.point, to = foot_on_axis(b, a.point);
    if (angle > kParallel_deg) {
        // the feet of the common perpendicular: (b - a + t db - s da) at right angles to both
        const Vec3 between = b.point - a.point, n = cross(a.direction, b.direction);
        const double square = dot(n, n);
        from = a.point + a.direction * (dot(cross(between, b.direction), n) / square);
        to = b.point + b.direction * (dot(cross(between, a.direction), n) / square);
    }
    found.push_back(length_of(DimensionKind::AxisDistance, length(to - from), {from, to}));
}

/// What only one of both has, against the other's picked point.
void add_to_point(const SurfaceFacts& a, const SurfaceFacts& b, std::vector<Dimension>& found)
{
    const Vec3& p = b.point_mm;
    if (is_plane(a) && !is_plane(b)) {
        const Vec3 foot = foot_on_plane(a, p);
        found.push_back(length_of(DimensionKind::PlanePointDistance, length(p - foot), {p, foot}));
    }
    if (a.axis && !b.axis) {
        const Vec3 foot = foot_on_axis(*a.axis, p);
        found.push_back(length_of(DimensionKind::AxisPointDistance, length(p - foot), {p, foot}));
    }
}

std::string trimmed(std::string digits)
{
    if (digits.find('.') != std::string::npos) {
        digits.erase(digits.find_last_not_of('0') + 1);
        if (digits.back() == '.')
            digits.pop_back();
    }
    return digits == "-0" ? "0" : digits;
}

/// Seven digits, at most `most_decimals` of them after the point.
std::string number_text(double x, int most_decimals)
{
    constexpr int kDigits = 7; // what single precision holds
    if (!std::isfinite(x))
        return fmt::format("{}", x);
    const double size = std::abs(x);
    const int before_point = size >= 1 ? int(std::floor(std::log10(size))) + 1 : size >= 0.1 ? 0 : -most_decimals;
    return trimmed(fmt::format("{:.{}f}", x, std::clamp(kDigits - before_point, 0, most_decimals)));
}

/// As many of them as show no more than one step of the last digit of what is off.
int known_decimals(int most, double error)
{
    return error > 0 ? std::clamp(int(std::floor(-std::log10(error))), 0, most) : most;
}

} // namespace

std::vector<Dimension> dimensions_of(const SurfaceFacts& facts)
{
    std::vector<Dimension> found;
    const Vec3 centre = facts.centre_mm.value_or(facts.axis ? facts.axis->point : Vec3{});
    if (facts.tube_radius_mm) { // a torus: the picked point is off the middle circle
        found.push_back(length_of(DimensionKind::Radius, *facts.radius_mm, {}));
        const Vec3 inwards = facts.point_mm - facts.normal * *facts.tube_radius_mm;
        const Vec3 outwards = facts.point_mm + facts.normal * *facts.tube_radius_mm;
        const auto off_circle = [&](const Vec3& p) { return std::abs(length(p - centre) - *facts.radius_mm); };
        found.push_back(length_of(DimensionKind::TubeRadius, *facts.tube_radius_mm,
                                  {off_circle(inwards) < off_circle(outwards) ? inwards : outwards, facts.point_mm}));
    } else if (facts.radius_mm) {
        found.push_back(length_of(DimensionKind::Radius, *facts.radius_mm, {centre, facts.point_mm}));
        found.push_back(
            length_of(DimensionKind::Diameter, 2 * *facts.radius_mm, {centre * 2 - facts.point_mm, facts.point_mm}));
    }
    if (facts.half_angle_deg)
        found.push_back(angle_of(DimensionKind::HalfAngle, *facts.half_angle_deg, {}));
    if (!facts.radius_mm && facts.curvatures) {
        const auto [larger, smaller] = *facts.curvatures;
        const bool first = std::abs(larger) >= std::abs(smaller);
        const double most = first ? larger : smaller, least = first ? smaller : larger;
        constexpr double kFlat = 1e-6; // of the other curvature: single precision makes no less
        if (most != 0)
            found.push_back(length_of(DimensionKind::SmallestRadius, 1 / std::abs(most),
                                      {facts.point_mm - facts.normal * (1 / most), facts.point_mm}));
        if (std::abs(least) > kFlat * std::abs(most))
            found.push_back(length_of(DimensionKind::LargestRadius, 1 / std::abs(least),
                                      {facts.point_mm - facts.normal * (1 / least), facts.point_mm}));
    }
    return found;
}

std::vector<Dimension> dimensions_between(const SurfaceFacts& a, const SurfaceFacts& b)
{
    std::vector<Dimension> found;
    const Vec3 way = b.point_mm - a.point_mm;
    found.push_back(length_of(DimensionKind::Distance, length(way), {a.point_mm, b.point_mm}));
    constexpr DimensionKind kParts[] = {DimensionKind::DistanceX, DimensionKind::DistanceY, DimensionKind::DistanceZ};
    Vec3 corner = a.point_mm; // x, then y, then z: the parts are drawn one after another
    for (size_t i = 0; i < 3; ++i) {
        const Vec3 from = corner;
        corner[i] = b.point_mm[i];
        found.push_back(length_of(kParts[i], way[i], {from, corner}));
    }
    if (is_plane(a) && is_plane(b))
        add_planes(a, b, found);
    if (is_plane(a) && b.axis)
        add_plane_and_axis(a, *b.axis, found);
    if (is_plane(b) && a.axis)
        add_plane_and_axis(b, *a.axis, found);
    if (a.axis && b.axis)
        add_axes(*a.axis, *b.axis, found);
    if (a.centre_mm && b.centre_mm)
        found.push_back(length_of(DimensionKind::CentreDistance, length(*b.centre_mm - *a.centre_mm),
                                  {*a.centre_mm, *b.centre_mm}));
    add_to_point(a, b, found);
    add_to_point(b, a, found);
    if (a.radius_mm && b.radius_mm &&
        std::abs(*a.radius_mm - *b.radius_mm) <= kEqualRadius * std::max(*a.radius_mm, *b.radius_mm))
        found.push_back(length_of(DimensionKind::EqualDiameter, *a.radius_mm + *b.radius_mm, {a.point_mm, b.point_mm}));
    return found;
}

std::vector<Dimension> dimensions_of(const EdgeFacts& edge)
{
    std::vector<Dimension> found;
    found.push_back(length_of(DimensionKind::EdgeLength, edge.length_mm, {edge.from_mm, edge.to_mm},
                              edge.length_error_mm + edge.beside_error_mm));
    if (edge.shape != EdgeShape::Circle)
        return found;
    const double error = edge.radius_error_mm + edge.border_tolerance_mm;
    const Vec3 opposite = edge.centre_mm * 2 - edge.from_mm;
    found.push_back(length_of(DimensionKind::EdgeRadius, edge.radius_mm, {edge.centre_mm, edge.from_mm}, error));
    found.push_back(length_of(DimensionKind::EdgeDiameter, 2 * edge.radius_mm, {opposite, edge.from_mm}, 2 * error));
    if (!edge.closed) {
        constexpr double kDegrees = 180 / std::numbers::pi;
        const double sweep = edge.length_mm / edge.radius_mm; // a border moved outwards has the same
        const double sweep_error = (2 * edge.border_tolerance_mm + sweep * edge.radius_error_mm) / edge.radius_mm;
        found.push_back(angle_of(DimensionKind::EdgeSweep, sweep * kDegrees, {edge.from_mm, edge.centre_mm, edge.to_mm},
                                 sweep_error * kDegrees));
    }
    return found;
}

const char* name_of(DimensionKind kind)
{
    switch (kind) {
    case DimensionKind::Distance:
        return "distance";
    case DimensionKind::DistanceX:
        return "along x";
    case DimensionKind::DistanceY:
        return "along y";
    case DimensionKind::DistanceZ:
        return "along z";
    case DimensionKind::PlaneAngle:
        return "angle between planes";
    case DimensionKind::PlaneDistance:
        return "distance of parallel planes";
    case DimensionKind::PlaneAxisAngle:
        return "angle of axis and plane";
    case DimensionKind::PlaneAxisDistance:
        return "distance of axis and plane";
    case DimensionKind::AxisAngle:
        return "angle between axes";
    case DimensionKind::AxisDistance:
        return "distance of axes";
    case DimensionKind::CentreDistance:
        return "distance of centres";
    case DimensionKind::PlanePointDistance:
        return "distance of point and plane";
    case DimensionKind::AxisPointDistance:
        return "distance of point and axis";
    case DimensionKind::EqualDiameter:
        return "equal diameters";
    case DimensionKind::Radius:
        return "radius";
    case DimensionKind::Diameter:
        return "diameter";
    case DimensionKind::TubeRadius:
        return "radius of the tube";
    case DimensionKind::HalfAngle:
        return "half angle";
    case DimensionKind::SmallestRadius:
        return "smallest radius of curvature";
    case DimensionKind::LargestRadius:
        return "largest radius of curvature";
    case DimensionKind::EdgeLength:
        return "length of the edge";
    case DimensionKind::EdgeRadius:
        return "radius of the edge";
    case DimensionKind::EdgeDiameter:
        return "diameter of the edge";
    case DimensionKind::EdgeSweep:
        return "angle of the arc";
    }
    return "unknown";
}

std::string length_text(double mm, LengthUnit unit, double error_mm)
{
    struct Named {
        const char* name;
        double mm;
        int decimals; // a tenth of a micrometre
    };
    constexpr Named kUnits[] = {{"mm", 1, 4}, {"cm", 10, 5}, {"m", 1000, 7}, {"in", 25.4, 6}};
    const Named& named = kUnits[size_t(unit)];
    return fmt::format("{} {}", number_text(mm / named.mm, known_decimals(named.decimals, error_mm / named.mm)),
                       named.name);
}

std::string angle_text(double degrees, double error_deg)
{
    constexpr int kDecimals = 4;
    return number_text(degrees, known_decimals(kDecimals, error_deg)) + "°";
}

std::string to_text(const Dimension& dimension, LengthUnit unit)
{
    return dimension.unit == DimensionUnit::Degree ? angle_text(dimension.value, dimension.error)
                                                   : length_text(dimension.value, unit, dimension.error);
}

} // namespace trimray
