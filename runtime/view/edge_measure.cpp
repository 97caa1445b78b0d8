#include "runtime/view/edge_measure.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trimray {
namespace {

using reference::cross;
using reference::dot;
using reference::length;
using reference::Vec3;
using reference::operator+;
using reference::operator-;
using reference::operator*;

struct Integral {
    double value = 0, error = 0;
};

/// Gauss's rule of 7 points and Kronrod's of 15 on [lo, hi]; the error is what they differ by. Source: QUADPACK, qk15.
template <class F>
Integral gauss_kronrod(F f, double lo, double hi)
{
    constexpr double kNodes[8] = {0.991455371120812639206854697526329, 0.949107912342758524526189684047851,
                                  0.864864423359769072789712788640926, 0.741531185599394439863864773280788,
                                  0.586087235467691130294144838258730, 0.405845151377397166906606412076961,
                                  0.207784955007898467600689403773245, 0};
    constexpr double kKronrod[8] = {0.022935322010529224963732008058970, 0.063092092629978553290700663189204,
                                    0.104790010322250183839876322541518, 0.140653259715525918745189590510238,
                                    0.169004726639267902826583426598550, 0.190350578064785409913256402421014,
                                    0.204432940075298892414161999234649, 0.209482141084727828012999174891714};
    constexpr double kGauss[4] = {0.129484966168869693270611432679082, 0.279705391489276667901467771423780,
                                  0.381830050505118944950369775488975, 0.417959183673469387755102040816327};
    const double middle = (lo + hi) / 2, half = (hi - lo) / 2;
    double kronrod = 0, gauss = 0;
    for (int i = 0; i < 8; ++i) {
        const double sum = i < 7 ? f(middle - half * kNodes[i]) + f(middle + half * kNodes[i]) : f(middle);
        kronrod += kKronrod[i] * sum;
        if (i % 2 == 1)
            gauss += kGauss[i / 2] * sum;
    }
    return {half * kronrod, half * std::abs(kronrod - gauss)};
}

/// The length of a piece: intervals are halved until the two rules agree within 1e-10 of the piece, or there are many.
Integral piece_length(const PlacedSurface& surface, const MonotonePiece& piece)
{
    constexpr double kAgree = 1e-10;
    constexpr int kMostIntervals = 2000;
    const auto speed = [&](double t) { return length(border_at(surface, piece, t).d); };
    struct Interval {
        double lo, hi;
        Integral found;
    };
    std::vector<Interval> open{{0, 1, gauss_kronrod(speed, 0, 1)}};
    const double allowed = kAgree * open.front().found.value;
    Integral sum;
    for (int used = 1; !open.empty();) {
        const Interval at = open.back();
        open.pop_back();
        if (used >= kMostIntervals || at.found.error <= allowed * (at.hi - at.lo)) {
            sum.value += at.found.value;
            sum.error += at.found.error;
            continue;
        }
        const double middle = (at.lo + at.hi) / 2;
        open.push_back({middle, at.hi, gauss_kronrod(speed, middle, at.hi)});
        open.push_back({at.lo, middle, gauss_kronrod(speed, at.lo, middle)});
        used += 2;
    }
    return sum;
}

std::vector<Vec3> points_along(const PlacedSurface& surface, const BorderEdge& edge)
{
    constexpr size_t kPoints = 128, kLeastInPiece = 4;
    const size_t steps = std::max(kLeastInPiece, kPoints / edge.pieces.size());
    std::vector<Vec3> points{border_at(surface, edge.pieces.front(), 0).p};
    for (const MonotonePiece& piece : edge.pieces)
        for (size_t i = 1; i <= steps; ++i)
            points.push_back(border_at(surface, piece, double(i) / double(steps)).p);
    return points;
}

double off_line(std::span<const Vec3> points)
{
    const Vec3 from = points.front(), along = points.back() - from;
    const Vec3 d = along * (1 / length(along));
    double most = 0;
    for (const Vec3& p : points)
        most = std::max(most, length(cross(p - from, d)));
    return most;
}

/// The angle that a polyline turns by, all turns added up, rad.
double turning(std::span<const Vec3> points)
{
    double sum = 0;
    for (size_t i = 2; i < points.size(); ++i) {
        const Vec3 before = points[i - 1] - points[i - 2], after = points[i] - points[i - 1];
        sum += std::atan2(length(cross(before, after)), dot(before, after));
    }
    return sum;
}

struct Circle {
    Vec3 centre{}, axis{};
    double radius = 0;
    double off = 0; // of the farthest point
};

/// The circle of least squares (Kasa 1976) in the plane of the points' area vector. Nothing where they span no area.
std::optional<Circle> fit_circle(std::span<const Vec3> points)
{
    const double count = double(points.size());
    Vec3 middle{}, area{};
    for (const Vec3& p : points)
        middle = middle + p * (1 / count);
    for (size_t i = 0; i < points.size(); ++i)
        area = area + cross(points[i] - middle, points[(i + 1) % points.size()] - middle);
    if (!(length(area) > 0))
        return std::nullopt;
    Circle circle;
    circle.axis = area * (1 / length(area));
    Vec3 x = cross(circle.axis, std::abs(circle.axis[0]) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0});
    x = x * (1 / length(x));
    const Vec3 y = cross(circle.axis, x);
    // a x + b y + c = x^2 + y^2 with sums about the middle, so that sum x = sum y = 0 and c stands alone
    double xx = 0, xy = 0, yy = 0, xr = 0, yr = 0, r = 0;
    for (const Vec3& p : points) {
        const double px = dot(p - middle, x), py = dot(p - middle, y), square = px * px + py * py;
        xx += px * px, xy += px * py, yy += py * py;
        xr += px * square, yr += py * square, r += square;
    }
    const double det = xx * yy - xy * xy;
    if (!(det > 0))
        return std::nullopt;
    const double a = (xr * yy - yr * xy) / det, b = (yr * xx - xr * xy) / det;
    circle.centre = middle + x * (a / 2) + y * (b / 2);
    circle.radius = std::sqrt(r / count + (a * a + b * b) / 4);
    for (const Vec3& p : points) {
        const double height = dot(p - circle.centre, circle.axis);
        const double from_axis = length(p - circle.centre - circle.axis * height);
        circle.off = std::max(circle.off, std::hypot(height, from_axis - circle.radius));
    }
    return circle;
}

/// Tells lines and circles from the rest: all points within what the border may be off, and never more than a
/// thousandth of the edge's length.
void find_shape(std::span<const Vec3> points, EdgeFacts& facts)
{
    constexpr double kMostOff = 1e-3;
    const double allowed = std::min(facts.border_tolerance_mm, kMostOff * facts.length_mm);
    if (!facts.closed) {
        facts.off_shape_mm = off_line(points);
        if (facts.off_shape_mm <= allowed && facts.length_mm - length(facts.to_mm - facts.from_mm) <= 2 * allowed) {
            facts.shape = EdgeShape::Straight;
            return;
        }
    }
    const std::optional<Circle> circle = fit_circle(points);
    if (!circle || circle->off > allowed) {
        facts.off_shape_mm = 0;
        return;
    }
    // the height of half of the arc over its chord: of a flat arc, what is off there moves the radius by far more
    const double half = std::min(facts.length_mm / (2 * circle->radius), std::numbers::pi);
    const double height = circle->radius * (1 - std::cos(half));
    constexpr double kMostRadiusError = 0.01; // of the radius: more, and it says nothing
    if (circle->off > kMostRadiusError * height) {
        facts.off_shape_mm = 0;
        return;
    }
    facts.shape = EdgeShape::Circle;
    facts.off_shape_mm = circle->off;
    facts.radius_mm = circle->radius;
    facts.radius_error_mm = circle->off * std::max(circle->radius / height, 1.0);
    facts.centre_mm = circle->centre;
    facts.axis = circle->axis;
}

} // namespace

EdgeFacts measure_edge(const PlacedSurface& surface, const BorderEdge& edge)
{
    EdgeFacts facts;
    facts.edge_class = edge.edge_class;
    for (const MonotonePiece& piece : edge.pieces) {
        const Integral part = piece_length(surface, piece);
        facts.length_mm += part.value;
        facts.length_error_mm += part.error;
    }
    facts.border_tolerance_mm = border_tolerance_mm(surface);
    facts.line_mm = points_along(surface, edge);
    facts.from_mm = facts.line_mm.front();
    facts.to_mm = facts.line_mm.back();
    facts.closed = length(facts.to_mm - facts.from_mm) <= std::min(facts.border_tolerance_mm, facts.length_mm / 2);
    const double ends = facts.closed ? 0 : 2;
    facts.beside_error_mm = facts.border_tolerance_mm * (ends + turning(facts.line_mm));
    find_shape(facts.line_mm, facts);
    return facts;
}

std::optional<PickedEdge> picked_edge(const PackImage& image, const SurfaceFacts& picked)
{
    const PlacedSurface surface(image, picked.instance, picked.face);
    const std::vector<BorderEdge> edges = border_edges(image, surface);
    const std::optional<NearestEdge> nearest = nearest_edge(surface, edges, picked.point_mm);
    if (!nearest)
        return std::nullopt;
    return PickedEdge{measure_edge(surface, edges[nearest->edge]), nearest->foot_mm, nearest->distance_mm};
}

} // namespace trimray
