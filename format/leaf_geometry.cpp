#include "format/leaf_geometry.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

namespace trimray {
namespace {

constexpr double kQuatUnit = 32767;
// Axes are turned by up to 5e-4 rad to lose 5 bits of noise; a leaf's surface turns by 0.2 rad, so its box barely
// grows.
constexpr int kQuatStep = 32;

double signed_low(uint bits)
{
    return static_cast<std::int16_t>(bits & 0xffffu);
}
double signed_high(uint bits)
{
    return static_cast<std::int16_t>(bits >> 16);
}

/// x to the nearest integer in [lo, hi]; not a number counts as lo, so that no input is undefined.
int to_int(double x, int lo, int hi)
{
    return x >= hi ? hi : x > lo ? static_cast<int>(std::lround(x)) : lo;
}
uint low_bits(int x)
{
    return static_cast<uint>(x) & 0xffffu;
}

/// n rounded up to 7 significant bits: at most 1/64 more. 0 <= n <= 65535, and so is the result.
int seven_bits_up(int n)
{
    const int step = n < 128 ? 1 : 1 << (std::ilogb(double(n)) - 6);
    return std::min((n + step - 1) / step * step, 65535);
}

std::array<Point3, 3> axes_of(double x, double y, double z)
{
    const double w = std::sqrt(std::max(1 - x * x - y * y - z * z, 0.0));
    return {Point3{1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)},
            Point3{2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)},
            Point3{2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)}};
}

/// The rotation nearest to the identity among those that turn the unit axes into +-axes in any order.
std::array<Point3, 3> nearest_to_identity(const std::array<Point3, 3>& axes)
{
    constexpr int kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    std::array<Point3, 3> best = axes;
    double best_trace = -4;
    for (const auto& order : kOrders) {
        std::array<Point3, 3> turned;
        double trace = 0;
        int weakest = 0;
        for (int i = 0; i < 3; ++i) {
            turned[i] = axes[order[i]];
            if (turned[i][i] < 0)
                for (double& c : turned[i])
                    c = -c;
            trace += turned[i][i];
            if (turned[i][i] < turned[weakest][weakest])
                weakest = i;
        }
        if (dot3(cross3(turned[0], turned[1]), turned[2]) < 0) {
            trace -= 2 * turned[weakest][weakest];
            for (double& c : turned[weakest])
                c = -c;
        }
        if (trace > best_trace) {
            best_trace = trace;
            best = turned;
        }
    }
    return best;
}

/// max of a cos t + b sin t over [lo, hi].
double largest_on_arc(double a, double b, double lo, double hi)
{
    const double peak = std::atan2(b, a);
    const double nearest =
        peak + 2 * std::numbers::pi * std::ceil((lo - peak) / (2 * std::numbers::pi)); // first peak at or after lo
    if (nearest <= hi)
        return std::hypot(a, b);
    return std::max(a * std::cos(lo) + b * std::sin(lo), a * std::cos(hi) + b * std::sin(hi));
}

double bend_of_code(uint code)
{
    if (code == kBendNone)
        return std::numeric_limits<double>::infinity();
    return std::bit_cast<float>((code << 20) + kBendOneBits);
}

/// The least code whose value is not below.
uint code_of_bend(double bend)
{
    uint code = 0;
    if (!(bend <= bend_of_code(kBendNone - 1)))
        return kBendNone;
    if (bend > bend_of_code(0)) // the next code below, if not its own
        code = (std::bit_cast<uint>(float(bend)) - kBendOneBits) >> 20;
    while (bend_of_code(code) < bend)
        ++code;
    return code;
}

} // namespace

OrientedBox decode_leaf_box(const LeafRecord& leaf)
{
    OrientedBox box;
    box.center = {signed_low(leaf.center_xy) * kLeafQuantum, signed_high(leaf.center_xy) * kLeafQuantum,
                  signed_low(leaf.center_z_half_x) * kLeafQuantum};
    box.half = {(leaf.center_z_half_x >> 16) * double(kLeafQuantum), (leaf.half_yz & 0xffffu) * double(kLeafQuantum),
                (leaf.half_yz >> 16) * double(kLeafQuantum)};
    box.axis = axes_of(signed_low(leaf.quat_xy) / kQuatUnit, signed_high(leaf.quat_xy) / kQuatUnit,
                       signed_low(leaf.quat_z_bend) / kQuatUnit);
    return box;
}

std::array<Point3, 3> encode_leaf_axes(const std::array<Point3, 3>& axes, LeafRecord& leaf)
{
    const std::array<Point3, 3> r = nearest_to_identity(axes);
    // w = sqrt(1 + trace) / 2,  (x, y, z) = (R_zy - R_yz, R_xz - R_zx, R_yx - R_xy) / 4w; r[i] are columns
    const double w = 0.5 * std::sqrt(1 + r[0][0] + r[1][1] + r[2][2]);
    const auto rounded = [w](double four_w_q) {
        const double unit = kQuatUnit / kQuatStep; // times 32 stays within 32767: to_int rounds towards it at the ends
        return kQuatStep * to_int(four_w_q / (4 * w) * unit, -1023, 1023);
    };
    const int x = rounded(r[1][2] - r[2][1]), y = rounded(r[2][0] - r[0][2]), z = rounded(r[0][1] - r[1][0]);
    leaf.quat_xy = low_bits(x) | low_bits(y) << 16;
    leaf.quat_z_bend = (leaf.quat_z_bend & 0xffff0000u) | low_bits(z);
    return axes_of(x / kQuatUnit, y / kQuatUnit, z / kQuatUnit);
}

void encode_leaf_extent(const std::array<Point3, 3>& axes, const Point3& lo, const Point3& hi, double margin,
                        LeafRecord& leaf)
{
    constexpr double kPerUnit = 1.0 / kLeafQuantum;
    // The centre's last bits are noise: steps of 1/1024 of the box's longest side or less
    const double longest = std::max({hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]}) * kPerUnit;
    const int step = longest >= 2048 ? 1 << std::min(std::ilogb(longest) - 10, 6) : 1;
    int center[3], half[3];
    Point3 decoded{};
    for (int c = 0; c < 3; ++c) {
        double x = 0;
        for (int i = 0; i < 3; ++i)
            x += 0.5 * (lo[i] + hi[i]) * axes[i][c];
        center[c] = to_int(step * std::nearbyint(x * kPerUnit / step), -32768, 32767);
        decoded[c] = center[c] / kPerUnit;
    }
    for (int i = 0; i < 3; ++i) {
        // from the centre as it decodes to the farther side, rounded up
        const double at = dot3(decoded, axes[i]);
        const double reach = std::max(hi[i] - at, at - lo[i]) + margin;
        half[i] = seven_bits_up(to_int(std::ceil(reach * kPerUnit), 0, 65535));
    }
    leaf.center_xy = low_bits(center[0]) | low_bits(center[1]) << 16;
    leaf.center_z_half_x = low_bits(center[2]) | low_bits(half[0]) << 16;
    leaf.half_yz = low_bits(half[1]) | low_bits(half[2]) << 16;
}

LeafBend decode_leaf_bend(const LeafRecord& leaf)
{
    return {bend_of_code(leaf.quat_z_bend >> 16 & 0xffu), bend_of_code(leaf.quat_z_bend >> 24)};
}

void encode_leaf_bend(const LeafBend& bend, LeafRecord& leaf)
{
    leaf.quat_z_bend = (leaf.quat_z_bend & 0xffffu) | code_of_bend(bend.along) << 16 | code_of_bend(bend.across) << 24;
}

NativePiece native_piece(const PatchRecord& patch, const std::array<double, 2>& lo, const std::array<double, 2>& hi)
{
    NativePiece piece;
    piece.kind = patch.shape & 0xffu;
    for (int i = 0; i < 2; ++i) {
        piece.param[i] = patch.param[i];
        piece.lo[i] = (lo[i] - patch.uv_offset[i]) / patch.uv_scale[i];
        piece.hi[i] = (hi[i] - patch.uv_offset[i]) / patch.uv_scale[i];
    }
    return piece;
}

double largest_along(const NativePiece& piece, const Point3& d)
{
    const double u0 = piece.lo[0], u1 = piece.hi[0], v0 = piece.lo[1], v1 = piece.hi[1];
    if (piece.kind == kKindPlane)
        return std::max(d[0] * u0, d[0] * u1) + std::max(d[1] * v0, d[1] * v1);
    // S . d = rho(v) m(u) + h(v) d_z with m = d_x cos u + d_y sin u; for a given v the largest is at the largest m
    // where rho >= 0, at the smallest where rho < 0
    const double r = piece.param[0];
    double largest = -1e300;
    for (const double m : {largest_on_arc(d[0], d[1], u0, u1), -largest_on_arc(-d[0], -d[1], u0, u1)}) {
        double here = 0;
        switch (piece.kind) {
        case kKindCylinder:
            here = r * m + std::max(d[2] * v0, d[2] * v1);
            break;
        case kKindCone: {
            // rho = r + v sin a, h = v cos a: linear in v
            const double cos_a = 1 / std::sqrt(1 + piece.param[1] * piece.param[1]), sin_a = piece.param[1] * cos_a;
            here = std::max((r + v0 * sin_a) * m + v0 * cos_a * d[2], (r + v1 * sin_a) * m + v1 * cos_a * d[2]);
            break;
        }
        case kKindSphere:
            here = r * largest_on_arc(m, d[2], v0, v1);
            break;
        default: // torus
            here = r * m + piece.param[1] * largest_on_arc(m, d[2], v0, v1);
            break;
        }
        largest = std::max(largest, here);
    }
    return largest;
}

double largest_along(const PackImage& image, const InstanceRecord& instance, const Point3& d)
{
    const PartRecord& part = image.parts[instance.part];
    Point3 d_part{}; // the direction before the placement: M^T d
    double offset = 0;
    for (int row = 0; row < 3; ++row) {
        for (int c = 0; c < 3; ++c)
            d_part[c] += instance.transform[4 * row + c] * d[row];
        offset += instance.transform[4 * row + 3] * d[row];
    }
    double largest = -std::numeric_limits<double>::infinity();
    for (uint i = 0; i < part.leaf_count; ++i) {
        const LeafRecord& leaf = image.leaves[part.first_leaf + i];
        const PatchRecord& patch = image.patches[leaf.patch];
        const OrientedBox box = decode_leaf_box(leaf);
        Point3 d_patch{}; // p = origin + scale * (axis_x q_x + axis_y q_y + axis_z q_z)
        double origin = 0;
        for (int c = 0; c < 3; ++c) {
            d_patch[0] += patch.axis_x[c] * d_part[c];
            d_patch[1] += patch.axis_y[c] * d_part[c];
            d_patch[2] += patch.axis_z[c] * d_part[c];
            origin += (double(patch.origin_hi[c]) + double(patch.origin_lo[c])) * d_part[c];
        }
        double reach = dot3(box.center, d_patch);
        for (int k = 0; k < 3; ++k)
            reach += box.half[k] * std::abs(dot3(box.axis[k], d_patch));
        largest = std::max(largest, origin + patch.scale * reach);
    }
    const Point3 part_origin{part.origin_mm[0], part.origin_mm[1], part.origin_mm[2]};
    return offset + dot3(part_origin, d_part) + part.scale_mm * largest;
}

} // namespace trimray
