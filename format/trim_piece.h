// One monotone piece of a trim loop, in double: its points as stored and where it meets a line of constant u or v.
// Shared by what is derived from the pieces (cells, distance textures, their sizes).
#pragma once

#include "format/pack_image.h"

#include <algorithm>
#include <cmath>

namespace trimray {

/// A line (points 0 and 3; 1 and 2 lie at its thirds) or a polynomial cubic Bezier; u and v each monotone along it.
struct MonotonePiece {
    double u[4], v[4];
    bool cubic = false;

    double u_lo() const { return std::min(u[0], u[3]); }
    double u_hi() const { return std::max(u[0], u[3]); }
    double v_lo() const { return std::min(v[0], v[3]); }
    double v_hi() const { return std::max(v[0], v[3]); }
    /// Whether u grows with v along the piece (so that the piece rises to the right).
    bool u_grows_with_v() const { return (u[3] > u[0]) == (v[3] > v[0]); }
};

/// Puts a line's inner points at its thirds.
inline void set_thirds(MonotonePiece& line)
{
    for (const int i : {1, 2}) {
        line.u[i] = line.u[0] + i / 3.0 * (line.u[3] - line.u[0]);
        line.v[i] = line.v[0] + i / 3.0 * (line.v[3] - line.v[0]);
    }
}

/// The piece that `word` of `face` stands for. Domain: a validated image.
inline MonotonePiece load_piece(const float* points, uint first_point, uint word)
{
    const float* p = points + 2 * (static_cast<size_t>(first_point) + (word >> kPiecePointShift));
    MonotonePiece piece;
    piece.cubic = (word & kPieceCubic) != 0;
    if (piece.cubic) {
        for (int i = 0; i < 4; ++i) {
            piece.u[i] = p[2 * i];
            piece.v[i] = p[2 * i + 1];
        }
        return piece;
    }
    piece.u[0] = p[0], piece.v[0] = p[1], piece.u[3] = p[2], piece.v[3] = p[3];
    set_thirds(piece);
    return piece;
}

/// B(t) of a cubic Bezier with coordinates c. Source: de Casteljau.
inline double bezier3(const double c[4], double t)
{
    const double s = 1 - t;
    return s * s * s * c[0] + 3 * s * s * t * c[1] + 3 * s * t * t * c[2] + t * t * t * c[3];
}

/// Parameter t in [0,1] with c(t) = x, for c monotone; the ends where x is outside. Bisection keeps the bracket, Newton
/// steps shorten it.
inline double solve_monotone(const double c[4], double x)
{
    const double sign = c[3] >= c[0] ? 1.0 : -1.0;
    if (sign * (x - c[0]) <= 0)
        return 0;
    if (sign * (x - c[3]) >= 0)
        return 1;
    double lo = 0, hi = 1;
    double t = (x - c[0]) / (c[3] - c[0]);
    for (int i = 0; i < 64 && hi - lo > 1e-16; ++i) {
        const double error = sign * (bezier3(c, t) - x);
        (error < 0 ? lo : hi) = t;
        const double s = 1 - t;
        const double slope = sign * 3 * (s * s * (c[1] - c[0]) + 2 * s * t * (c[2] - c[1]) + t * t * (c[3] - c[2]));
        const double newton = t - error / slope;
        const double next = slope > 0 && newton > lo && newton < hi ? newton : 0.5 * (lo + hi);
        if (std::abs(next - t) < 1e-16)
            break;
        t = next;
    }
    return t;
}

/// u of the piece at v, clamped to its ends. Domain: not horizontal where it matters; a horizontal piece gives u[0] or
/// u[3].
inline double u_at_v(const MonotonePiece& piece, double v)
{
    if (!piece.cubic) {
        const double t = std::clamp((v - piece.v[0]) / (piece.v[3] - piece.v[0]), 0.0, 1.0);
        return t < 1 ? piece.u[0] + t * (piece.u[3] - piece.u[0]) : piece.u[3];
    }
    return bezier3(piece.u, solve_monotone(piece.v, v));
}

/// v of the piece at u, clamped to its ends.
inline double v_at_u(const MonotonePiece& piece, double u)
{
    if (!piece.cubic) {
        const double t = std::clamp((u - piece.u[0]) / (piece.u[3] - piece.u[0]), 0.0, 1.0);
        return t < 1 ? piece.v[0] + t * (piece.v[3] - piece.v[0]) : piece.v[3];
    }
    return bezier3(piece.v, solve_monotone(piece.u, u));
}

} // namespace trimray
