#include "runtime/view/placed_surface.h"

#include "format/affine.h"
#include "format/bezier_reference.h"
#include "format/native_reference.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace trimray {
namespace {

using reference::cross;
using reference::dot;
using reference::length;
using reference::Vec3;
using reference::operator+;
using reference::operator-;
using reference::operator*;

uint surface_kind(const PatchRecord& patch)
{
    return patch.shape & 0xffu;
}

/// A curve (rho, z) in v that turns about the z axis: its values and its first and second derivatives.
struct Meridian {
    double rho[3], z[3];
};
Meridian meridian(const PatchRecord& patch, double v)
{
    const double first = patch.param[0], second = patch.param[1], cv = std::cos(v), sv = std::sin(v);
    switch (surface_kind(patch)) {
    case kKindCylinder:
        return {{first, 0, 0}, {v, 1, 0}};
    case kKindCone: {
        const double cos_a = 1 / std::hypot(1, second), sin_a = second * cos_a;
        return {{first + v * sin_a, sin_a, 0}, {v * cos_a, cos_a, 0}};
    }
    case kKindSphere:
        return {{first * cv, -first * sv, -first * cv}, {first * sv, first * cv, -first * sv}};
    default: // torus
        return {{first + second * cv, -second * sv, -second * cv}, {second * sv, second * cv, -second * sv}};
    }
}

/// Of a native surface by uv_patch, patch units.
SurfaceJet native_jet(const PatchRecord& patch, double u, double v)
{
    if (surface_kind(patch) == kKindPlane)
        return {{u, v, 0}, {1, 0, 0}, {0, 1, 0}, {}, {}, {}};
    const auto& [rho, z] = meridian(patch, v);
    const double cu = std::cos(u), su = std::sin(u);
    SurfaceJet s;
    s.p = {rho[0] * cu, rho[0] * su, z[0]};
    s.du = {-rho[0] * su, rho[0] * cu, 0};
    s.dv = {rho[1] * cu, rho[1] * su, z[1]};
    s.duu = {-rho[0] * cu, -rho[0] * su, 0};
    s.duv = {-rho[1] * su, rho[1] * cu, 0};
    s.dvv = {rho[2] * cu, rho[2] * su, z[2]};
    return s;
}

/// Value and first two derivatives at t of the Bezier curve with `count` homogeneous points, which are used up.
/// Source: de Casteljau, Piegl & Tiller eq. 1.10 and A1.5.
std::array<Point4, 3> curve_jet(Point4* c, int count, double t)
{
    const int degree = count - 1;
    std::array<Point4, 3> out{};
    for (int points = count; points > 1; --points) {
        for (size_t k = 0; k < 4; ++k) {
            if (points == 3) // the last three: C'' = n (n - 1) (c2 - 2 c1 + c0)
                out[2][k] = degree * (degree - 1) * (c[2][k] - 2 * c[1][k] + c[0][k]);
            if (points == 2)
                out[1][k] = degree * (c[1][k] - c[0][k]);
        }
        for (int i = 0; i + 1 < points; ++i)
            for (size_t k = 0; k < 4; ++k)
                c[i][k] = (1 - t) * c[i][k] + t * c[i + 1][k];
    }
    out[0] = c[0];
    return out;
}

/// Of a Bezier patch by uv_patch, patch units.
SurfaceJet bezier_jet(const Net& net, double u, double v)
{
    Point4 row[kMaxDegree + 1], columns[3][kMaxDegree + 1]; // by derivatives along v
    for (int i = 0; i < net.count_u; ++i) {
        std::copy_n(&net.points[size_t(i) * size_t(net.count_v)], net.count_v, row);
        const std::array<Point4, 3> along_v = curve_jet(row, net.count_v, v);
        for (size_t k = 0; k < 3; ++k)
            columns[k][i] = along_v[k];
    }
    const auto [a, au, auu] = curve_jet(columns[0], net.count_u, u);
    const std::array<Point4, 3> of_v = curve_jet(columns[1], net.count_u, u);
    const Point4 avv = curve_jet(columns[2], net.count_u, u)[0];
    const Point4 &av = of_v[0], &auv = of_v[1];
    // S = A / w and its derivatives: Piegl & Tiller eq. 4.20
    const double w = a[3];
    SurfaceJet s;
    for (size_t k = 0; k < 3; ++k) {
        s.p[k] = a[k] / w;
        s.du[k] = (au[k] - au[3] * s.p[k]) / w;
        s.dv[k] = (av[k] - av[3] * s.p[k]) / w;
        s.duu[k] = (auu[k] - 2 * au[3] * s.du[k] - auu[3] * s.p[k]) / w;
        s.duv[k] = (auv[k] - au[3] * s.dv[k] - av[3] * s.du[k] - auv[3] * s.p[k]) / w;
        s.dvv[k] = (avv[k] - 2 * av[3] * s.dv[k] - avv[3] * s.p[k]) / w;
    }
    return s;
}

UvPoint uv_patch_of(const PatchRecord& patch, const UvPoint& uv_face)
{
    return {(uv_face[0] - patch.uv_offset[0]) / patch.uv_scale[0],
            (uv_face[1] - patch.uv_offset[1]) / patch.uv_scale[1]};
}

/// In part units, of patch units.
Vec3 in_part_axes(const PatchRecord& patch, const Vec3& d)
{
    Vec3 out;
    for (size_t i = 0; i < 3; ++i)
        out[i] = double(patch.scale) * (patch.axis_x[i] * d[0] + patch.axis_y[i] * d[1] + patch.axis_z[i] * d[2]);
    return out;
}

bool is_left_handed(const PatchRecord& patch)
{
    const auto vec = [](const float(&a)[3]) { return Vec3{a[0], a[1], a[2]}; };
    return dot(cross(vec(patch.axis_x), vec(patch.axis_y)), vec(patch.axis_z)) < 0;
}

/// M^-T n, of any length: outward stays outward in a mirror image.
Vec3 covector_in_world(const double (&m)[12], const Vec3& n)
{
    const Vec3 x{m[0], m[4], m[8]}, y{m[1], m[5], m[9]}, z{m[2], m[6], m[10]};
    return (cross(y, z) * n[0] + cross(z, x) * n[1] + cross(x, y) * n[2]) * (determinant(m) < 0 ? -1.0 : 1.0);
}

} // namespace

PlacedSurface::PlacedSurface(const PackImage& image, uint instance, uint face)
    : image_(image), instance_(image.instances[instance]), face_(image.faces[face]), part_(image.parts[face_.part]),
      patches_(std::span(image.patches).subspan(face_.first_patch, face_.patch_count)), nets_(face_.patch_count)
{
    assert(instance_.part == face_.part && "an instance of the face's part");
    assert(face_.patch_count > 0 && "a face that was hit has a surface");
}

size_t PlacedSurface::patch_index(const UvPoint& uv_face) const
{
    // how far outside of a patch's rectangle, in uv_face
    const auto outside = [&](const PatchRecord& patch) {
        double most = 0;
        for (size_t k = 0; k < 2; ++k) {
            const double a = patch.uv_offset[k], b = a + patch.uv_scale[k];
            most = std::max({most, std::min(a, b) - uv_face[k], uv_face[k] - std::max(a, b)});
        }
        return most;
    };
    if (patches_.size() == 1 || outside(patches_[last_patch_]) == 0)
        return last_patch_;
    double least = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < patches_.size() && least > 0; ++i)
        if (const double distance = outside(patches_[i]); distance < least) {
            least = distance;
            last_patch_ = i;
        }
    return last_patch_;
}

const Net& PlacedSurface::net(size_t patch) const
{
    if (!nets_[patch])
        nets_[patch] = load_net(image_, patches_[patch]);
    return *nets_[patch];
}

Vec3 PlacedSurface::turned(const Vec3& in_part) const
{
    const double* m = instance_.transform;
    Vec3 out;
    for (size_t i = 0; i < 3; ++i, m += 4)
        out[i] = m[0] * in_part[0] + m[1] * in_part[1] + m[2] * in_part[2];
    return out;
}

Vec3 PlacedSurface::direction_of_patch(const PatchRecord& patch, const Vec3& d) const
{
    return turned(in_part_axes(patch, d) * part_.scale_mm);
}

Vec3 PlacedSurface::point_of_patch(const PatchRecord& patch, const Vec3& p) const
{
    const Vec3 own = in_part_axes(patch, p);
    Vec3 in_part, moved;
    for (size_t i = 0; i < 3; ++i) {
        in_part[i] =
            part_.origin_mm[i] + part_.scale_mm * (double(patch.origin_hi[i]) + double(patch.origin_lo[i]) + own[i]);
        moved[i] = instance_.transform[4 * i + 3];
    }
    return turned(in_part) + moved;
}

SurfaceJet PlacedSurface::at(const UvPoint& uv_face) const
{
    const size_t index = patch_index(uv_face);
    const PatchRecord& patch = patches_[index];
    const auto [u, v] = uv_patch_of(patch, uv_face);
    const SurfaceJet own = surface_kind(patch) == kKindBezier ? bezier_jet(net(index), u, v) : native_jet(patch, u, v);
    const double by_u = 1 / double(patch.uv_scale[0]), by_v = 1 / double(patch.uv_scale[1]);
    SurfaceJet out;
    out.p = point_of_patch(patch, own.p);
    out.du = direction_of_patch(patch, own.du * by_u);
    out.dv = direction_of_patch(patch, own.dv * by_v);
    out.duu = direction_of_patch(patch, own.duu * (by_u * by_u));
    out.duv = direction_of_patch(patch, own.duv * (by_u * by_v));
    out.dvv = direction_of_patch(patch, own.dvv * (by_v * by_v));
    return out;
}

Vec3 PlacedSurface::outward(const UvPoint& uv_face) const
{
    const PatchRecord& patch = patch_at(uv_face);
    const auto [u, v] = uv_patch_of(patch, uv_face);
    const Vec3 own = surface_kind(patch) == kKindBezier
                         ? reference::BezierReference(patch, image_.control_points.data(), 0, 0)
                               .normal(std::clamp(u, 0.0, 1.0), std::clamp(v, 0.0, 1.0))
                         : reference::native_normal(patch, u, v);
    const bool turn = is_left_handed(patch) != ((face_.flags & kFaceReversed) != 0);
    const Vec3 normal = covector_in_world(instance_.transform, in_part_axes(patch, own)) * (turn ? -1.0 : 1.0);
    const double size = length(normal);
    return size > 0 ? normal * (1 / size) : Vec3{};
}

std::optional<PrincipalCurvatures> PlacedSurface::curvatures(const UvPoint& uv_face) const
{
    // of one derivative beside the other, or of their angle: single precision makes no zeros
    constexpr double kVanishing = 1e-6;
    const SurfaceJet s = at(uv_face);
    const Vec3 n = outward(uv_face);
    const double lu = length(s.du), lv = length(s.dv);
    const double height = lu > 0 ? length(cross(s.du, s.dv)) / lu : 0; // of dv over du
    if (!(std::min(lu, lv) > kVanishing * std::max(lu, lv)) || !(height > kVanishing * lv) || dot(n, n) == 0)
        return std::nullopt;
    // the second fundamental form in an orthonormal basis: along du, and d/dv - slant d/du over its height
    const double slant = dot(s.du, s.dv) / (lu * lu), l = dot(n, s.duu), m = dot(n, s.duv), nn = dot(n, s.dvv);
    const double a = l / (lu * lu), b = (m - slant * l) / (lu * height),
                 c = (nn - 2 * slant * m + slant * slant * l) / (height * height);
    const double mean = -(a + c) / 2, apart = std::hypot((a - c) / 2, b); // n points out of what is convex
    return PrincipalCurvatures{mean + apart, mean - apart};
}

RayFoot PlacedSurface::meet(const reference::Ray& ray, const UvPoint& start) const
{
    constexpr int kMostSteps = 60;
    constexpr double kReach = 1e-3, kMostDamping = 1e6;
    // the ray is where two planes meet (Kajiya 1982)
    const Vec3 d = ray.direction * (1 / length(ray.direction));
    const size_t least = size_t(
        std::min_element(d.begin(), d.end(), [](double a, double b) { return std::abs(a) < std::abs(b); }) - d.begin());
    Vec3 axis{};
    axis[least] = 1;
    Vec3 n1 = cross(d, axis);
    n1 = n1 * (1 / length(n1));
    const Vec3 n2 = cross(d, n1);
    const auto off = [&](const Vec3& p) { return std::array{dot(n1, p - ray.origin), dot(n2, p - ray.origin)}; };

    UvPoint uv = start;
    SurfaceJet s = at(uv);
    std::array<double, 2> r = off(s.p);
    double damping = 0; // Levenberg's, as a share of the trace; 0 is Newton's step
    for (int i = 0; i < kMostSteps && damping <= kMostDamping && std::hypot(r[0], r[1]) > 0; ++i) {
        const double ju[2] = {dot(n1, s.du), dot(n2, s.du)}, jv[2] = {dot(n1, s.dv), dot(n2, s.dv)};
        const double uu = ju[0] * ju[0] + ju[1] * ju[1], uv_ = ju[0] * jv[0] + ju[1] * jv[1],
                     vv = jv[0] * jv[0] + jv[1] * jv[1], add = damping * (uu + vv);
        const double gu = ju[0] * r[0] + ju[1] * r[1], gv = jv[0] * r[0] + jv[1] * r[1];
        const double det = (uu + add) * (vv + add) - uv_ * uv_;
        UvPoint next = uv;
        if (det > 0) {
            next[0] -= ((vv + add) * gu - uv_ * gv) / det;
            next[1] -= ((uu + add) * gv - uv_ * gu) / det;
        }
        for (double& x : next)
            x = std::clamp(x, -kReach, 1 + kReach);
        const SurfaceJet there = at(next);
        const std::array<double, 2> left = off(there.p);
        if (std::hypot(left[0], left[1]) < std::hypot(r[0], r[1])) {
            uv = next, s = there, r = left;
            damping = damping < 1e-6 ? 0 : damping / 10;
        } else if (next == uv) {
            break;
        } else {
            damping = std::max(10 * damping, 1e-6);
        }
    }
    return {uv, std::hypot(r[0], r[1])};
}

UvPoint PlacedSurface::uv_file(const UvPoint& uv_face) const
{
    UvPoint out;
    for (size_t k = 0; k < 2; ++k)
        out[k] = face_.domain_lo[k] + (face_.domain_hi[k] - face_.domain_lo[k]) * uv_face[k];
    return out;
}

UvPoint PlacedSurface::uv_face(const UvPoint& uv_file) const
{
    UvPoint out;
    for (size_t k = 0; k < 2; ++k)
        out[k] = (uv_file[k] - face_.domain_lo[k]) / (face_.domain_hi[k] - face_.domain_lo[k]);
    return out;
}

std::optional<double> PlacedSurface::patch_unit_mm(const PatchRecord& patch) const
{
    const std::optional<double> scale = similarity_scale(instance_.transform);
    return scale ? std::optional(*scale * part_.scale_mm * double(patch.scale)) : std::nullopt;
}

double PlacedSurface::stretch() const
{
    const double* m = instance_.transform;
    return std::max({std::hypot(m[0], m[4], m[8]), std::hypot(m[1], m[5], m[9]), std::hypot(m[2], m[6], m[10])});
}

} // namespace trimray
