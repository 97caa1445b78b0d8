// Shapes for the tests of trims: loops of lines and cubics in uv_face, images that hold them, and the slow, exact
// answers to compare with.
#pragma once

#include "format/trim_piece.h"

#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace trimray::shapes {

struct Uv {
    float u = 0, v = 0;
};

/// A loop as a chain of points; cubic[i] says whether piece i takes 3 further points or 1. Closed.
struct Loop {
    std::vector<Uv> points;
    std::vector<bool> cubic;
};

inline Loop polygon(const std::vector<Uv>& corners)
{
    Loop loop;
    loop.points = corners;
    loop.points.push_back(corners.front());
    loop.cubic.assign(corners.size(), false);
    return loop;
}

/// A circle (or ellipse) of 4 `parts` cubics, each monotone, as the converter would store it.
inline Loop circle(double u, double v, double radius_u, double radius_v, int parts = 2)
{
    Loop loop;
    const int count = 4 * parts;
    const double step = 2 * M_PI / count, arm = 4.0 / 3.0 * std::tan(step / 4);
    const auto at = [&](double a, double along) {
        // exact zeros at the axes, so that neighbouring quadrants are monotone
        const auto clean = [](double x) { return std::abs(x) < 1e-12 ? 0.0 : x; };
        const double c = clean(std::cos(a)), s = clean(std::sin(a));
        return Uv{static_cast<float>(u + radius_u * (c - along * s)),
                  static_cast<float>(v + radius_v * (s + along * c))};
    };
    for (int i = 0; i < count; ++i) {
        loop.points.push_back(at(i * step, 0));
        loop.points.push_back(at(i * step, arm));
        loop.points.push_back(at((i + 1) * step, -arm));
        loop.cubic.push_back(true);
    }
    loop.points.push_back(loop.points.front());
    return loop;
}

/// A star or, with equal radii, a regular polygon.
inline Loop star(double u, double v, double outer, double inner, int tips, double turn = 0)
{
    std::vector<Uv> corners;
    for (int i = 0; i < 2 * tips; ++i) {
        const double r = i % 2 == 0 ? outer : inner, a = turn + M_PI * i / tips;
        corners.push_back({static_cast<float>(u + r * std::cos(a)), static_cast<float>(v + r * std::sin(a))});
    }
    return polygon(corners);
}

inline Loop gear(double u, double v, double outer, double inner, int teeth)
{
    std::vector<Uv> corners;
    for (int i = 0; i < 4 * teeth; ++i) {
        const double r = i % 4 < 2 ? outer : inner, a = M_PI * (i + 0.25) / (2 * teeth);
        corners.push_back({static_cast<float>(u + r * std::cos(a)), static_cast<float>(v + r * std::sin(a))});
    }
    return polygon(corners);
}

inline Loop reversed(const Loop& loop)
{
    Loop out = loop;
    std::reverse(out.points.begin(), out.points.end());
    std::reverse(out.cubic.begin(), out.cubic.end());
    return out;
}

/// A closed loop of random lines and monotone cubics through points of which many lie on a grid of 1/8.
inline Loop random_loop(std::mt19937& rng, int pieces)
{
    std::uniform_real_distribution<float> uniform(0, 1);
    Loop loop;
    const auto random_point = [&] {
        Uv p{uniform(rng), uniform(rng)};
        if (rng() % 3 == 0)
            p.u = std::round(p.u * 8) / 8;
        if (rng() % 3 == 0)
            p.v = std::round(p.v * 8) / 8;
        return p;
    };
    const Uv start = random_point();
    loop.points.push_back(start);
    for (int i = 0; i < pieces; ++i) {
        const Uv a = loop.points.back();
        Uv b = i + 1 == pieces ? start : random_point();
        if (i + 1 < pieces && rng() % 4 == 0)
            (rng() % 2 == 0 ? b.u = a.u : b.v = a.v); // vertical or horizontal
        if (a.u == b.u && a.v == b.v)
            continue;
        const bool cubic = rng() % 2 == 0;
        loop.cubic.push_back(cubic);
        if (cubic) {
            float s[2] = {uniform(rng), uniform(rng)}, t[2] = {uniform(rng), uniform(rng)};
            if (s[0] > s[1])
                std::swap(s[0], s[1]);
            if (t[0] > t[1])
                std::swap(t[0], t[1]);
            const auto inner = [](float x, float y, float f) {
                return std::clamp(x + f * (y - x), std::min(x, y), std::max(x, y));
            };
            loop.points.push_back({inner(a.u, b.u, s[0]), inner(a.v, b.v, t[0])});
            loop.points.push_back({inner(a.u, b.u, s[1]), inner(a.v, b.v, t[1])});
        }
        loop.points.push_back(b);
    }
    return loop;
}

/// Faces' loops that have been, or might be, answered wrongly.
inline std::vector<std::vector<Loop>> named_shapes()
{
    const Loop border = polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
    return {
        {border, circle(0.5, 0.5, 0.25, 0.25)},
        {circle(0.5, 0.5, 0.5, 0.5, 3)},
        {circle(0.5, 0.5, 0.5, 0.5), circle(0.5, 0.5, 0.4, 0.4), circle(0.5, 0.5, 0.3, 0.3),
         circle(0.5, 0.5, 0.01, 0.2)},
        {star(0.5, 0.5, 0.5, 0.1, 9)},
        {gear(0.5, 0.5, 0.49, 0.4, 40)},
        {border, gear(0.5, 0.5, 0.3, 0.25, 17), star(0.1, 0.1, 0.09, 0.02, 5)},
        {polygon({{0, 0}, {1, 0}, {1, 1}})},
        {polygon({{0, 0}, {1, 1}, {1, 0}, {0, 1}})},                                       // figure eight
        {circle(0.25, 0.5, 0.25, 0.25), circle(0.75, 0.5, 0.25, 0.25)},                    // touching
        {border, polygon({{0.25f, 0.25f}, {0.5f, 0.25f}, {0.5f, 0.75f}, {0.25f, 0.75f}})}, // on cell borders
        {polygon({{0, 0}, {1, 0}, {1, 1e-4f}, {0, 3e-5f}}), border},                       // slivers
        {polygon({{0, 0}, {0.5f, 0}, {0.5f, 0.5f}, {1, 0.5f}, {1, 1}, {0.5f, 1}, {0.5f, 0.5f}, {0, 0.5f}})},
    };
}

/// Appends a face with these loops. extent in mm.
inline void add_face(PackImage& image, const std::vector<Loop>& loops, float extent_u = 1, float extent_v = 1)
{
    FaceRecord face{};
    face.first_point = static_cast<uint>(image.trim_points.size() / 2);
    face.first_piece = static_cast<uint>(image.trim_pieces.size());
    face.loop_count = static_cast<uint>(loops.size());
    face.extent_mm[0] = extent_u;
    face.extent_mm[1] = extent_v;
    face.area_mm2 = extent_u * extent_v;
    for (const Loop& loop : loops) {
        uint at = static_cast<uint>(image.trim_points.size() / 2) - face.first_point;
        for (const Uv& p : loop.points)
            image.trim_points.insert(image.trim_points.end(), {p.u, p.v});
        for (const bool cubic : loop.cubic) {
            image.trim_pieces.push_back(at << kPiecePointShift | (cubic ? kPieceCubic : 0));
            at += cubic ? 3 : 1;
        }
    }
    face.point_count = static_cast<uint>(image.trim_points.size() / 2) - face.first_point;
    face.piece_count = static_cast<uint>(image.trim_pieces.size()) - face.first_piece;
    image.faces.push_back(face);
}

inline std::vector<MonotonePiece> pieces_of(const PackImage& image, uint face)
{
    const FaceRecord& f = image.faces[face];
    std::vector<MonotonePiece> pieces;
    for (uint i = 0; i < f.piece_count; ++i)
        pieces.push_back(load_piece(image.trim_points.data(), f.first_point, image.trim_pieces[f.first_piece + i]));
    return pieces;
}

/// u of the piece at v by plain bisection: shares nothing with the code under test.
inline double exact_u_at_v(const MonotonePiece& p, double v)
{
    const auto at = [](const double c[4], double t) {
        double d[4] = {c[0], c[1], c[2], c[3]};
        for (int n = 3; n > 0; --n)
            for (int i = 0; i < n; ++i)
                d[i] = (1 - t) * d[i] + t * d[i + 1];
        return d[0];
    };
    double lo = 0, hi = 1;
    const bool up = p.v[3] > p.v[0];
    for (int i = 0; i < 60; ++i) {
        const double t = 0.5 * (lo + hi);
        ((at(p.v, t) < v) == up ? lo : hi) = t;
    }
    return at(p.u, lo);
}

/// Adds random faces of lines and monotone cubics of all slopes and sizes until there are `count`: always the same.
inline void add_random_faces(PackImage& image, size_t count)
{
    std::mt19937 rng(7);
    while (image.faces.size() < count)
        add_face(image, {random_loop(rng, 3 + static_cast<int>(rng() % 40)), random_loop(rng, 5)}, 1,
                 rng() % 2 == 0 ? 1.0f : 7.0f);
}

/// Even-odd count of crossings to the right, in double; half-open in v.
inline bool exact_inside(const std::vector<MonotonePiece>& pieces, double u, double v)
{
    bool inside = false;
    for (const MonotonePiece& p : pieces) {
        if (!(p.v_lo() <= v && v < p.v_hi()) || u >= p.u_hi())
            continue;
        inside ^= u < p.u_lo() || u < exact_u_at_v(p, v);
    }
    return inside;
}

/// A random point: 1: at a dyadic place; 2: at a height that a piece's end has; 3: beside a piece; otherwise anywhere.
inline Uv telling_point(std::mt19937& rng, const std::vector<MonotonePiece>& pieces, size_t kind)
{
    std::uniform_real_distribution<float> uniform(0, 1);
    Uv p{uniform(rng), uniform(rng)};
    const MonotonePiece& piece = pieces[rng() % pieces.size()];
    if (kind == 1)
        p = {std::round(p.u * 64) / 64, std::round(p.v * 64) / 64};
    if (kind == 2)
        p.v = static_cast<float>(piece.v[rng() % 2 == 0 ? 0 : 3]);
    if (kind == 3) {
        const double t = uniform(rng);
        p = {static_cast<float>(bezier3(piece.u, t)) + 1e-5f * (uniform(rng) - 0.5f),
             static_cast<float>(bezier3(piece.v, t)) + 1e-5f * (uniform(rng) - 0.5f)};
    }
    return p;
}

/// Distance from a point to the pieces, in uv scaled by (su, sv). Fine samples, then golden section.
inline double exact_distance(const std::vector<MonotonePiece>& pieces, double u, double v, double su = 1, double sv = 1)
{
    double best = 1e300;
    for (const MonotonePiece& p : pieces) {
        const double du = std::max({p.u_lo() - u, 0.0, u - p.u_hi()}) * su;
        const double dv = std::max({p.v_lo() - v, 0.0, v - p.v_hi()}) * sv;
        if (std::hypot(du, dv) >= best)
            continue;
        const auto distance = [&](double t) {
            return std::hypot((bezier3(p.u, t) - u) * su, (bezier3(p.v, t) - v) * sv);
        };
        const int samples = p.cubic ? 64 : 1;
        int nearest = 0;
        for (int i = 0; i <= samples; ++i)
            if (distance(static_cast<double>(i) / samples) < distance(static_cast<double>(nearest) / samples))
                nearest = i;
        double lo = std::max(0.0, (nearest - 1.0) / samples), hi = std::min(1.0, (nearest + 1.0) / samples);
        for (int i = 0; i < 60; ++i) {
            const double a = lo + 0.381966 * (hi - lo), b = hi - 0.381966 * (hi - lo);
            (distance(a) < distance(b) ? hi : lo) = distance(a) < distance(b) ? b : a;
        }
        best = std::min({best, distance(lo), distance(0), distance(1)});
    }
    return best;
}

} // namespace trimray::shapes
