// The hulls of a leaf's second derivatives, several columns of a net at a time. Compiled once for each target by
// foreach_target.h; the best one is chosen at run time. Nothing is fused or approximated, so all give the same bits.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "format/bend_hull.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "format/bend_hull.h"

#include <algorithm>
#include <cmath>

HWY_BEFORE_NAMESPACE();
namespace trimray {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int kMostLanes = 4;
using Lanes = hn::CappedTag<double, kMostLanes>;
using V = hn::Vec<Lanes>;
constexpr Lanes kTag;
constexpr int kLaneCount = int(hn::MaxLanes(kTag));

constexpr int kMostPoints = int(kMaxDegree) + 1; // along one direction
constexpr int kMostNumbers = (kMostPoints + 2) * (kMostPoints + kMostLanes + 1) + 1;

/// (y_1, y_2, z, w) as a polynomial over [0, 1]^2 in scaled Bernstein form: coefficients times both binomials. Then to
/// raise the degree and to multiply is to add shifted coefficients, and the binomials leave a quotient of two
/// coefficients. Columns lie side by side, and loops do several at once.
/// Source: Farouki & Rajan 1988.
struct Scaled {
    int count_u = 0, count_v = 0;
    int width = 0;              // of a row that loops write: room for one column more, in whole registers
    double at[4][kMostNumbers]; // zeros around the net: a row and a column before, the rest after

    double* row(int c, int i) { return at[c] + (i + 1) * (width + 1) + 1; }
    const double* row(int c, int i) const { return at[c] + (i + 1) * (width + 1) + 1; }
    /// Room for so many rows and columns, to be written, inside of zeros.
    void resize(int rows, int columns, int row_width)
    {
        count_u = rows;
        count_v = columns;
        width = row_width;
        for (int c = 0; c < 4; ++c) {
            std::fill_n(row(c, -1) - 1, width + 1, 0.0);
            for (int i = 0; i < rows; ++i)
                row(c, i)[-1] = 0;
            std::fill_n(row(c, rows) - 1, width + 2, 0.0);
        }
    }
    /// Zeros, so many.
    void clear(int rows, int columns, int row_width)
    {
        resize(rows, columns, row_width);
        for (int c = 0; c < 4; ++c)
            std::fill_n(row(c, 0), rows * (width + 1), 0.0);
    }
};

void binomials(int degree, double (&row)[kMostPoints])
{
    row[0] = 1;
    for (int i = 1; i <= degree; ++i)
        row[i] = row[i - 1] * (degree - i + 1) / i;
}

/// The surface over the reach, homogeneous, moved to the frame's middle and turned into it.
void turn(const Net& net, const BendFrame& f, Scaled& to)
{
    to.clear(net.count_u, net.count_v, (net.count_v + kLaneCount) / kLaneCount * kLaneCount);
    double share_u[kMostPoints], share_v[kMostPoints];
    binomials(net.count_u - 1, share_u);
    binomials(net.count_v - 1, share_v);
    for (int i = 0; i < net.count_u; ++i) {
        const Point4* from = &net.points[size_t(i) * net.count_v];
        for (int j = 0; j < net.count_v; ++j) {
            const double share = share_u[i] * share_v[j], w = from[j][3];
            const Point3 moved{from[j][0] - w * f.middle[0], from[j][1] - w * f.middle[1],
                               from[j][2] - w * f.middle[2]};
            for (int c = 0; c < 3; ++c)
                to.row(c, i)[j] = share * dot3(moved, f.axis[c]);
            to.row(3, i)[j] = share * w;
        }
    }
}

/// to = scale d/du or d/dv from. With C_i = binomial(n, i) c_i the derivative is (i + 1) C_(i+1) - (n - i) C_i.
/// Domain: degree 1 at least in that direction.
void derive(const Scaled& from, int direction, double scale, Scaled& to)
{
    to.resize(from.count_u - (direction == 0), from.count_v - (direction == 1), from.width);
    const int degree = direction == 0 ? to.count_u : to.count_v, width = to.width;
    const V by = hn::Set(kTag, scale);
    for (int c = 0; c < 4; ++c) {
        for (int i = 0; i < to.count_u; ++i) {
            const double *here = from.row(c, i), *next = direction == 0 ? from.row(c, i + 1) : here + 1;
            double* out = to.row(c, i);
            for (int j = 0; j < width; j += kLaneCount) {
                const V k = direction == 0 ? hn::Set(kTag, i) : hn::Iota(kTag, j);
                const V of_next = k + hn::Set(kTag, 1.0), of_here = hn::Set(kTag, degree) - k;
                hn::StoreU(by * (of_next * hn::LoadU(kTag, next + j) - of_here * hn::LoadU(kTag, here + j)), kTag,
                           out + j);
            }
        }
    }
}

/// to = from with its degree raised by one: multiplied by (1 - t) + t.
void raise(const Scaled& from, int direction, Scaled& to)
{
    to.resize(from.count_u + (direction == 0), from.count_v + (direction == 1), from.width);
    const int width = to.width;
    for (int c = 0; c < 4; ++c) {
        for (int i = 0; i < to.count_u; ++i) {
            const double *here = from.row(c, i), *before = direction == 0 ? from.row(c, i - 1) : here - 1;
            double* out = to.row(c, i);
            for (int j = 0; j < width; j += kLaneCount)
                hn::StoreU(hn::LoadU(kTag, here + j) + hn::LoadU(kTag, before + j), kTag, out + j);
        }
    }
}

/// Coefficients of a net in several columns of one row.
struct Columns {
    V y1, y2, z, w;
    V plane1, plane2; // w times the linear map R (u - c) of the reach; rational nets only
};

/// Of row i of the net, from column j on; of a rational net with both degrees raised by one.
template <bool kRational>
HWY_INLINE Columns columns_of(const Scaled& net, const BendFrame& f, int i, int j)
{
    Columns p;
    V* const out[4] = {&p.y1, &p.y2, &p.z, &p.w};
    for (int c = 0; c < 4; ++c) {
        const double* here = net.row(c, i) + j;
        if (!kRational) {
            *out[c] = hn::LoadU(kTag, here);
            continue;
        }
        const double* before = net.row(c, i - 1) + j;
        const V c00 = hn::LoadU(kTag, here), c10 = hn::LoadU(kTag, before), c01 = hn::LoadU(kTag, here - 1),
                c11 = hn::LoadU(kTag, before - 1);
        *out[c] = c00 + c10 + c01 + c11;
        if (c != 3)
            continue;
        const V u_w = hn::Set(kTag, f.begin[0]) * (c00 + c01) + hn::Set(kTag, f.end[0]) * (c10 + c11);
        const V v_w = hn::Set(kTag, f.begin[1]) * (c00 + c10) + hn::Set(kTag, f.end[1]) * (c01 + c11);
        p.plane1 = hn::Set(kTag, f.r11) * u_w + hn::Set(kTag, f.r12) * v_w;
        p.plane2 = hn::Set(kTag, f.r22) * v_w;
    }
    return p;
}

HWY_INLINE V square(V x, V y)
{
    return x * x + y * y;
}

/// The largest of some columns' values, 0 at least.
struct Largest {
    V of;

    HWY_INLINE Largest() : of(hn::Zero(kTag)) {}
    HWY_INLINE void keep(hn::Mask<Lanes> columns, V value)
    {
        of = hn::IfThenElse(hn::And(columns, value > of), value, of);
    }
    /// Of the squares of the largest singular values of [a b; c d].
    HWY_INLINE void keep_norm(hn::Mask<Lanes> columns, V a, V b, V c, V d)
    {
        const V sum = square(a, b) + square(c, d);
        if (hn::AllFalse(kTag, hn::And(columns, sum > of)))
            return; // the square is `sum` at most
        const V det = a * d - b * c;
        const V rest = sum * sum - hn::Set(kTag, 4.0) * det * det;
        keep(columns, hn::Set(kTag, 0.5) * (sum + hn::Sqrt(hn::IfThenElseZero(rest > hn::Zero(kTag), rest))));
    }
    HWY_INLINE double value() const { return hn::GetLane(hn::MaxOfLanes(kTag, of)); }
};

/// The polynomials of the homogeneous surface over the reach, moved to S_c and turned into the frame, in uv_patch.
struct SecondOrder {
    Scaled value, u, v, uu, uv, vv;
};

template <bool kRational>
HWY_INLINE std::array<LeafBend, 2> bounds(const SecondOrder& s, const BendFrame& f)
{
    // squares, but for off_across and grows_by
    Largest off, slope, off_across, slope_across; // |y - R (u - c)|, |D y - 1|, |z|, |D z|
    Largest grows, grows_by[2], turns[2];         // |D w| / w, |w_d| / w, |D^2 w[d, .]| / w
    Largest along[2], across[2];
    // steps d from the middle: along half a side, in R
    const double step[2][2] = {{f.half[0] * f.r11, 0}, {f.half[1] * f.r12, f.half[1] * f.r22}};
    const V shear = hn::Set(kTag, f.r12 / f.r11), r11 = hn::Set(kTag, f.r11), r22 = hn::Set(kTag, f.r22),
            one = hn::Set(kTag, 1.0);
    const int rows = s.value.count_u + kRational, columns = s.value.count_v + kRational;
    for (int i = 0; i < rows; ++i) {
        for (int j = 0; j < columns; j += kLaneCount) {
            const auto valid = hn::FirstN(kTag, size_t(std::min(columns - j, kLaneCount)));
            const Columns p = columns_of<kRational>(s.value, f, i, j);
            if (!hn::AllTrue(kTag, hn::Or(hn::Not(valid), p.w > hn::Zero(kTag))))
                return {};
            const Columns u = columns_of<kRational>(s.u, f, i, j), v = columns_of<kRational>(s.v, f, i, j);
            const Columns uu = columns_of<kRational>(s.uu, f, i, j), uv = columns_of<kRational>(s.uv, f, i, j),
                          vv = columns_of<kRational>(s.vv, f, i, j);
            const V per_w = one / p.w;
            // D by R's columns: D_1 = d_u / r11, D_2 = (d_v - r12 / r11 d_u) / r22
            const V first = per_w / r11, other = per_w / r22;
            const auto d1 = [&](V of_u) HWY_ATTR { return of_u * first; };
            const auto d2 = [&](V of_u, V of_v) HWY_ATTR { return (of_v - shear * of_u) * other; };
            V dw[2] = {};
            if (kRational) {
                dw[0] = d1(u.w);
                dw[1] = d2(u.w, v.w);
                grows.keep(valid, square(dw[0], dw[1]));
                off.keep(valid, per_w * per_w * square(p.y1 - p.plane1, p.y2 - p.plane2));
                off_across.keep(valid, per_w * hn::Abs(p.z));
                slope_across.keep(valid, square(d1(u.z), d2(u.z, v.z)));
                slope.keep_norm(valid, d1(u.y1) - one - d1(u.plane1), d2(u.y1, v.y1) - d2(u.plane1, v.plane1),
                                d1(u.y2) - d1(u.plane2), d2(u.y2, v.y2) - one - d2(u.plane2, v.plane2));
            }
            for (int d = 0; d < 2; ++d) {
                const Columns &of_u = d == 0 ? uu : uv, &of_v = d == 0 ? uv : vv;
                const V h = hn::Set(kTag, f.half[d]);
                V m11 = h * d1(of_u.y1), m12 = h * d2(of_u.y1, of_v.y1);
                V m21 = h * d1(of_u.y2), m22 = h * d2(of_u.y2, of_v.y2);
                if (kRational) {
                    const V w_d = h * per_w * (d == 0 ? u : v).w;
                    const V step1 = hn::Set(kTag, step[d][0]), step2 = hn::Set(kTag, step[d][1]);
                    m11 = m11 - (step1 * dw[0] + h * d1(of_u.plane1)) - w_d;
                    m12 = m12 - (step1 * dw[1] + h * d2(of_u.plane1, of_v.plane1));
                    m21 = m21 - (step2 * dw[0] + h * d1(of_u.plane2));
                    m22 = m22 - (step2 * dw[1] + h * d2(of_u.plane2, of_v.plane2)) - w_d;
                    grows_by[d].keep(valid, hn::Abs(w_d));
                    turns[d].keep(valid, h * h * square(d1(of_u.w), d2(of_u.w, of_v.w)));
                }
                along[d].keep_norm(valid, m11, m12, m21, m22);
                across[d].keep(valid, h * h * square(d1(of_u.z), d2(of_u.z, of_v.z)));
            }
        }
    }
    const auto root = [](const Largest& squared) { return std::sqrt(squared.value()); };
    const double of_off = root(off), of_growth = root(grows);
    const double most_slope = root(slope) + of_off * of_growth; // D y = (D p - y D w) / w
    const double most_across = root(slope_across) + off_across.value() * of_growth;
    std::array<LeafBend, 2> bend;
    for (int d = 0; d < 2; ++d) {
        const double of_slope = grows_by[d].value() + std::hypot(step[d][0], step[d][1]) * of_growth;
        bend[d].along = root(along[d]) + of_slope * most_slope + root(turns[d]) * of_off;
        bend[d].across = root(across[d]) + of_slope * most_across + root(turns[d]) * off_across.value();
    }
    return bend;
}

std::array<LeafBend, 2> bend_over_lanes(const Net& reach, const BendFrame& f)
{
    SecondOrder s;
    Scaled u, v, second, raised; // of the degrees that derivatives have
    turn(reach, f, s.value);
    derive(s.value, 0, f.per_side[0], u);
    raise(u, 0, s.u);
    derive(s.value, 1, f.per_side[1], v);
    raise(v, 1, s.v);
    const auto derive_again = [&](const Scaled& net, int first, int direction, Scaled& to) {
        if ((direction == 0 ? net.count_u : net.count_v) == 1) { // a straight line
            to.clear(s.value.count_u, s.value.count_v, s.value.width);
            return;
        }
        derive(net, direction, f.per_side[direction], second);
        raise(second, first, raised);
        raise(raised, direction, to);
    };
    derive_again(u, 0, 0, s.uu);
    derive_again(u, 0, 1, s.uv);
    derive_again(v, 1, 1, s.vv);
    return reach.rational() ? bounds<true>(s, f) : bounds<false>(s, f);
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace trimray
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace trimray {

namespace {
HWY_EXPORT(bend_over_lanes);
}

std::array<LeafBend, 2> bend_over(const Net& reach, const BendFrame& frame)
{
    return HWY_DYNAMIC_DISPATCH(bend_over_lanes)(reach, frame);
}

} // namespace trimray

#endif
