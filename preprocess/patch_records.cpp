// CadSurface over a domain -> PatchRecord: frames re-centred on the domain, numbers near 1, single precision.
#include "preprocess/bezier_patch.h"
#include "preprocess/patch_cut.h"
#include "preprocess/vec3d.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace trimray {
namespace {

Error invalid(const CadSurface& surface, std::string detail)
{
    return {ErrorCode::InvalidSurface, surface.source_kind, std::move(detail)};
}

// A native surface's origin lies on a grid of this part of its scale: 3e-8 of the face off, as single precision is at
// 1, and few bits are left in origin_lo.
constexpr int kNativeOriginBits = 24;
// A Bezier patch's control points are taken from its origin, so any grid is exact; one far finer than theirs lets equal
// patches in different places have equal control points.
constexpr int kBezierOriginBits = 28;

/// Places the patch's origin (part units, hi + lo) on the grid of scale / 2^origin_bits, with the least power of two as
/// scale that holds scale_mm; returns the scale in mm as the record holds it.
double place(const Vec3d& origin_mm, double scale_mm, const PartFrame& frame, int origin_bits, PatchRecord& patch)
{
    int exponent = 0; // scale_mm / frame.scale_mm <= 2^exponent
    if (std::frexp(scale_mm / frame.scale_mm, &exponent) == 0.5)
        --exponent;
    const Vec3d p = (1 / frame.scale_mm) * (origin_mm - frame.origin_mm);
    const double xyz[3] = {p.x, p.y, p.z};
    for (int c = 0; c < 3; ++c) {
        const double on_grid =
            std::ldexp(std::nearbyint(std::ldexp(xyz[c], origin_bits - exponent)), exponent - origin_bits);
        patch.origin_hi[c] = static_cast<float>(on_grid) + 0.0f; // no negative zero
        patch.origin_lo[c] = static_cast<float>(on_grid - patch.origin_hi[c]) + 0.0f;
    }
    patch.scale = static_cast<float>(std::ldexp(1, exponent));
    return double(patch.scale) * frame.scale_mm;
}

/// Where the record's origin really is, in mm.
Vec3d placed_origin_mm(const PatchRecord& patch, const PartFrame& frame)
{
    double p[3];
    for (int c = 0; c < 3; ++c)
        p[c] = double(patch.origin_hi[c]) + double(patch.origin_lo[c]);
    return frame.origin_mm + frame.scale_mm * Vec3d{p[0], p[1], p[2]};
}

/// x as a multiple of 2^-bits. What is off, 2^-bits / 2, is of a number that is compared with 1.
float fixed_point(double x, int bits)
{
    return static_cast<float>(std::ldexp(std::nearbyint(std::ldexp(x, bits)), -bits)) + 0.0f; // no negative zero
}

/// An axis, |from| = 1, to 2^-25 = 3e-8: as near as single precision at 1, and what should be zero is.
void store_axis(float (&to)[3], const Vec3d& from)
{
    constexpr int kAxisBits = 24;
    to[0] = fixed_point(from.x, kAxisBits);
    to[1] = fixed_point(from.y, kAxisBits);
    to[2] = fixed_point(from.z, kAxisBits);
}

bool finite(const Vec3d& p)
{
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

/// uv_face = offset + scale * uv_patch, with uv_patch = (uv_file - zero) / unit.
void map_parameter(PatchRecord& patch, int direction, double lo, double hi, double zero, double unit)
{
    patch.uv_scale[direction] = static_cast<float>(unit / (hi - lo));
    patch.uv_offset[direction] = static_cast<float>((zero - lo) / (hi - lo));
}

/// The part of a native surface over its domain, in its own frame: the largest distance from the axis, and the frame's
/// origin moved along the axis to the middle of the domain.
struct NativeSize {
    double radius = 0; // of the surface at the middle of the domain (sphere, torus: its own)
    double origin_along_z = 0;
    double v_zero = 0; // uv_file v where the record's v is 0
    double bound = 0;  // all points are this near to the moved origin
    double half_angle = 0;
    bool turned = false; // the axes are turned by pi: the domain lies on the cone's other nappe
};

NativeSize native_size(const CadSurface& s, const Rect2d& d)
{
    const double v_middle = 0.5 * (d.lo.y + d.hi.y), v_half = 0.5 * (d.hi.y - d.lo.y);
    NativeSize n;
    switch (s.kind) {
    case kKindCylinder:
        n = {s.radius, v_middle, v_middle, std::hypot(s.radius, v_half), 0, false};
        break;
    case kKindCone: {
        const double sin_a = std::sin(s.half_angle), cos_a = std::cos(s.half_angle);
        const double radius = s.radius + v_middle * sin_a;
        n = {std::abs(radius),
             v_middle * cos_a,
             v_middle,
             std::hypot(std::abs(radius) + v_half * std::abs(sin_a), v_half * cos_a),
             radius < 0 ? -s.half_angle : s.half_angle,
             radius < 0};
        break;
    }
    case kKindSphere:
        n = {s.radius, 0, 0, s.radius, 0, false};
        break;
    default: // torus
        n = {s.radius, 0, 0, s.radius + s.minor_radius, 0, false};
        break;
    }
    return n;
}

Result<AppendedPatches> append_plane(const CadSurface& s, const Rect2d& d, const PartFrame& frame, PatchRecord patch,
                                     std::vector<PatchRecord>& patches)
{
    const double u = 0.5 * (d.lo.x + d.hi.x), v = 0.5 * (d.lo.y + d.hi.y);
    const double half_diagonal = 0.5 * std::hypot(d.hi.x - d.lo.x, d.hi.y - d.lo.y);
    const double unit =
        place(s.frame.origin + u * s.frame.x + v * s.frame.y, half_diagonal, frame, kNativeOriginBits, patch);
    store_axis(patch.axis_x, s.frame.x);
    store_axis(patch.axis_y, s.frame.y);
    store_axis(patch.axis_z, s.frame.z);
    map_parameter(patch, 0, d.lo.x, d.hi.x, u, unit);
    map_parameter(patch, 1, d.lo.y, d.hi.y, v, unit);
    patches.push_back(patch);
    return AppendedPatches{};
}

Result<AppendedPatches> append_quadric_or_torus(const CadSurface& s, const Rect2d& d, const PartFrame& frame,
                                                PatchRecord patch, std::vector<PatchRecord>& patches)
{
    const NativeSize size = native_size(s, d);
    if (!(size.bound > 0))
        return invalid(s, "its radii are zero");
    const double unit =
        place(s.frame.origin + size.origin_along_z * s.frame.z, size.bound, frame, kNativeOriginBits, patch);
    const double u = 0.5 * (d.lo.x + d.hi.x), side = size.turned ? -1 : 1;
    const double c = side * std::cos(u), si = side * std::sin(u);
    store_axis(patch.axis_x, c * s.frame.x + si * s.frame.y);
    store_axis(patch.axis_y, c * s.frame.y - si * s.frame.x);
    store_axis(patch.axis_z, s.frame.z);
    patch.param[0] = static_cast<float>(size.radius / unit);
    if (s.kind == kKindCone)
        patch.param[1] = static_cast<float>(std::tan(size.half_angle));
    if (s.kind == kKindTorus)
        patch.param[1] = static_cast<float>(s.minor_radius / unit);
    map_parameter(patch, 0, d.lo.x, d.hi.x, u, 1);
    const bool v_is_length = s.kind == kKindCylinder || s.kind == kKindCone;
    double lo = d.lo.y, hi = d.hi.y;
    if (s.kind == kKindTorus) {
        // the middle of the domain in [0, 2 pi): then an angle in (-pi, pi] needs one turn more or none
        constexpr double kTurn = 2 * M_PI;
        const double turns = std::floor(0.5 * (lo + hi) / kTurn);
        lo -= turns * kTurn;
        hi -= turns * kTurn;
    }
    map_parameter(patch, 1, lo, hi, v_is_length ? size.v_zero : 0, v_is_length ? unit : 1);
    patches.push_back(patch);
    return AppendedPatches{};
}

/// Done if the patch can be stored: finite numbers, positive weights within a float's range of each other.
Status check_numbers(const CadSurface& surface, const BezierPatch& bezier)
{
    constexpr double kLargestWeightRatio = 1e30;
    double heaviest = 0;
    for (const auto& [x, y, z, w] : bezier.control_points) {
        if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z) || !std::isfinite(w))
            return invalid(surface, "a control point is not finite");
        heaviest = std::max(heaviest, w);
    }
    for (const auto& p : bezier.control_points)
        if (!(p[3] > 0) || p[3] * kLargestWeightRatio < heaviest)
            return Error{ErrorCode::UnsupportedSurface, surface.source_kind,
                         fmt::format("weight {} beside {}: not positive, or too far apart", p[3], heaviest)};
    return Done{};
}

/// A control point's coordinate, times its weight w, in patch units, on a grid that leaves no noise in the low bits:
/// multiples of 2^-22 at w = 1, off by 1.2e-7 of the patch at most; finer by halves down to 2^-24 as w falls, off by
/// 4.8e-7 at w = 1/16. Beside smaller weights the float stays.
float control_coordinate(double wx, double w)
{
    constexpr double kLeastWeight = 1.0 / 16;
    if (w < kLeastWeight)
        return static_cast<float>(wx) + 0.0f;
    return fixed_point(wx, w > 0.5 ? 22 : w > 0.25 ? 23 : 24);
}

void append_bezier(const BezierPatch& bezier, const Rect2d& d, const PartFrame& frame, PatchRecord patch,
                   std::vector<PatchRecord>& patches, std::vector<float>& control_points)
{
    const ControlBox box = control_box(bezier.control_points);
    const double half_diagonal = box.half_diagonal();
    if (!(half_diagonal > 0))
        return; // all control points are one: no area
    patch.shape =
        kKindBezier | uint(bezier.degree_u) << 8 | uint(bezier.degree_v) << 16 | (bezier.rational ? kShapeRational : 0);
    patch.first_control_point = static_cast<uint>(control_points.size());
    constexpr double kRoomForGrid = 1.0 + 1.0 / (1 << 20); // the rounded origin and points stay within |q| <= 1
    const double unit = place(box.centre(), half_diagonal * kRoomForGrid, frame, kBezierOriginBits, patch);
    const Vec3d origin = placed_origin_mm(patch, frame);
    patch.axis_x[0] = patch.axis_y[1] = patch.axis_z[2] = 1;
    const double u_length = bezier.domain.hi.x - bezier.domain.lo.x, v_length = bezier.domain.hi.y - bezier.domain.lo.y;
    map_parameter(patch, 0, d.lo.x, d.hi.x, bezier.domain.lo.x, u_length);
    map_parameter(patch, 1, d.lo.y, d.hi.y, bezier.domain.lo.y, v_length);
    double heaviest = 0;
    for (const auto& p : bezier.control_points)
        heaviest = std::max(heaviest, p[3]);
    int exponent = 0;
    std::frexp(heaviest, &exponent);
    const double weight_unit = bezier.rational ? std::ldexp(1, exponent) : 1; // a power of two: exact
    for (const auto& [x, y, z, w] : bezier.control_points) {
        control_points.push_back(control_coordinate((x - w * origin.x) / (unit * weight_unit), w / weight_unit));
        control_points.push_back(control_coordinate((y - w * origin.y) / (unit * weight_unit), w / weight_unit));
        control_points.push_back(control_coordinate((z - w * origin.z) / (unit * weight_unit), w / weight_unit));
        if (bezier.rational)
            control_points.push_back(static_cast<float>(w / weight_unit));
    }
    patches.push_back(patch);
}

// ---- native surfaces that are nearly flat over their domain --------------------------------------------------------

constexpr int kFlatDegree = 4;
using FlatCurve = std::array<double, kFlatDegree + 1>; // a polynomial's Bezier values on [-half, half]

/// Bezier values of sum_k a_k t^k on [-half, half], by its blossom (Piegl & Tiller 6.4).
FlatCurve bezier_values(const FlatCurve& a, double half)
{
    constexpr double kChoose[kFlatDegree + 1] = {1, 4, 6, 4, 1};
    FlatCurve out{};
    for (int j = 0; j <= kFlatDegree; ++j) {
        // elementary symmetric polynomials of j times +half and 4 - j times -half
        FlatCurve symmetric{1, 0, 0, 0, 0};
        for (int i = 0; i < kFlatDegree; ++i)
            for (int k = kFlatDegree; k > 0; --k)
                symmetric[k] += symmetric[k - 1] * (i < j ? half : -half);
        for (int k = 0; k <= kFlatDegree; ++k)
            out[j] += a[k] * symmetric[k] / kChoose[k];
    }
    return out;
}

/// cos t - 1 and sin t as polynomials: off by half^5 / 120, 1e-11 for the widest arc that asks for them.
FlatCurve cosine_less_one(double half)
{
    return bezier_values({0, 0, -0.5, 0, 1.0 / 24}, half);
}
FlatCurve sine(double half)
{
    return bezier_values({0, 1, 0, -1.0 / 6, 0}, half);
}

/// a x + b y
FlatCurve blend(double a, const FlatCurve& x, double b, const FlatCurve& y)
{
    FlatCurve out;
    for (int i = 0; i <= kFlatDegree; ++i)
        out[i] = a * x[i] + b * y[i];
    return out;
}

/// Whether the domain is so small beside the radii that single precision around the axis would lose it: 1/32 of them
/// leaves 2e-6 of the face. Arcs are then short enough for polynomials in the same parameters.
bool nearly_flat(const CadSurface& s, const Rect2d& d)
{
    constexpr double kSmallShare = 1.0 / 32;
    const NativeSize size = native_size(s, d);
    const double du = d.hi.x - d.lo.x, dv = d.hi.y - d.lo.y;
    const bool v_is_angle = s.kind == kKindSphere || s.kind == kKindTorus;
    if (du > kSmallShare || (v_is_angle && dv > kSmallShare))
        return false;
    const SurfaceExtent extent = surface_extent(s, d);
    return std::hypot(extent.length_u_mm, extent.length_v_mm) < kSmallShare * size.bound;
}

/// The surface over its domain as one polynomial patch in its own parameters, exact to rounding in single precision:
///   S - P = C(u) rho_0 X + S(u) rho_0 Y + delta(v) (1 + C(u)) X + delta(v) S(u) Y + eta(v) Z
/// with C = cos - 1, S = sin from the middle, rho = rho_0 + delta the distance from the axis, eta the height.
BezierPatch nearly_flat_patch(const CadSurface& s, const Rect2d& d)
{
    const double u = 0.5 * (d.lo.x + d.hi.x), v = 0.5 * (d.lo.y + d.hi.y);
    const double half_u = 0.5 * (d.hi.x - d.lo.x), half_v = 0.5 * (d.hi.y - d.lo.y);
    const CadFrame& f = s.frame;
    const Vec3d x = std::cos(u) * f.x + std::sin(u) * f.y, y = std::cos(u) * f.y - std::sin(u) * f.x;
    const Vec3d middle = evaluate(s, u, v).p;
    const FlatCurve cos_u = cosine_less_one(half_u), sin_u = sine(half_u);
    const FlatCurve line = bezier_values({0, 1, 0, 0, 0}, half_v);
    double rho = s.radius;
    FlatCurve delta{}, eta = line;
    if (s.kind == kKindCone) {
        rho += v * std::sin(s.half_angle);
        delta = blend(std::sin(s.half_angle), line, 0, line);
        eta = blend(std::cos(s.half_angle), line, 0, line);
    } else if (s.kind != kKindCylinder) {
        const double r = s.kind == kKindTorus ? s.minor_radius : s.radius;
        const FlatCurve cos_v = cosine_less_one(half_v), sin_v = sine(half_v);
        rho = (s.kind == kKindTorus ? s.radius : 0) + r * std::cos(v);
        delta = blend(r * std::cos(v), cos_v, -r * std::sin(v), sin_v);
        eta = blend(r * std::sin(v), cos_v, r * std::cos(v), sin_v);
    }
    BezierPatch patch;
    patch.degree_u = patch.degree_v = kFlatDegree;
    patch.domain = d;
    for (int i = 0; i <= kFlatDegree; ++i) {
        for (int j = 0; j <= kFlatDegree; ++j) {
            const double along_x = cos_u[i] * rho + delta[j] * (1 + cos_u[i]), along_y = sin_u[i] * (rho + delta[j]);
            const Vec3d p = middle + along_x * x + along_y * y + eta[j] * f.z;
            patch.control_points.push_back({p.x, p.y, p.z, 1});
        }
    }
    return patch;
}

/// How far apart points may be whose uv_face, along one direction, differs by the rounding of 1.
double rounding_mm(double speed_mm, double patch_length, double domain_length)
{
    return 0x1p-24 * speed_mm * domain_length / patch_length;
}

Result<AppendedPatches> append_splines(const CadSurface& s, const Rect2d& d, const PartFrame& frame,
                                       const PatchRecord& patch, std::vector<PatchRecord>& patches,
                                       std::vector<float>& control_points)
{
    const int degree_u = s.spline.degree_u, degree_v = s.spline.degree_v;
    if (degree_u < 1 || degree_v < 1 || degree_u > int(kMaxDegree) || degree_v > int(kMaxDegree))
        return Error{ErrorCode::UnsupportedSurface, s.source_kind,
                     fmt::format("degree {} x {}; 1 to {} are supported", degree_u, degree_v, kMaxDegree)};
    const std::vector<BezierPatch> beziers = decompose(s, d);
    if (beziers.empty())
        return invalid(s, "the domain lies outside the surface");
    for (const BezierPatch& bezier : beziers)
        if (Status checked = check_numbers(s, bezier); !checked.ok())
            return checked.error();
    const size_t before = patches.size();
    AppendedPatches appended;
    for (const BezierPatch& bezier : beziers) {
        const CutPatch cut = cut_by_weights(bezier);
        for (const BezierPatch& piece : cut.pieces)
            append_bezier(piece, d, frame, patch, patches, control_points);
        if (cut.pieces.size() == 1)
            continue;
        const Rect2d& own = bezier.domain;
        appended.cut += 1;
        appended.too_fast += cut.too_fast;
        appended.uv_face_mm =
            std::max(appended.uv_face_mm, rounding_mm(cut.speed_mm.u, own.hi.x - own.lo.x, d.hi.x - d.lo.x) +
                                              rounding_mm(cut.speed_mm.v, own.hi.y - own.lo.y, d.hi.y - d.lo.y));
    }
    if (patches.size() == before)
        return invalid(s, "all control points coincide: the surface has no area");
    return appended;
}

} // namespace

Result<AppendedPatches> append_patches(const CadSurface& surface, const Rect2d& domain, const PartFrame& frame,
                                       uint32_t face, std::vector<PatchRecord>& patches,
                                       std::vector<float>& control_points)
{
    const Rect2d& d = domain;
    if (!(d.hi.x > d.lo.x) || !(d.hi.y > d.lo.y) || !std::isfinite(d.hi.x - d.lo.x) || !std::isfinite(d.hi.y - d.lo.y))
        return invalid(surface,
                       fmt::format("domain [{}, {}] x [{}, {}] has no finite area", d.lo.x, d.hi.x, d.lo.y, d.hi.y));
    const CadFrame& f = surface.frame;
    if (surface.kind != kKindBezier && (!finite(f.origin) || !finite(f.x) || !finite(f.y) || !finite(f.z) ||
                                        !std::isfinite(surface.radius) || !std::isfinite(surface.minor_radius)))
        return invalid(surface, "its axes or radii are not finite");
    if (surface.kind != kKindBezier && (surface.radius < 0 || surface.minor_radius < 0))
        return invalid(surface, fmt::format("radius {} (minor {}) is negative", surface.radius, surface.minor_radius));
    PatchRecord patch{};
    patch.face = face;
    patch.shape = surface.kind;
    if (surface.kind == kKindPlane)
        return append_plane(surface, d, frame, patch, patches);
    if (surface.kind != kKindBezier && nearly_flat(surface, d)) {
        append_bezier(nearly_flat_patch(surface, d), d, frame, patch, patches, control_points);
        return AppendedPatches{};
    }
    if (surface.kind != kKindBezier)
        return append_quadric_or_torus(surface, d, frame, patch, patches);
    return append_splines(surface, d, frame, patch, patches, control_points);
}

} // namespace trimray
