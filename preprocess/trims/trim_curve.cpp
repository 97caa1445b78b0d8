#include "preprocess/trims/trim_curve.h"

#include "preprocess/vec2d.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace trimray {
namespace {

// Shares of the tolerance: what samples may miss between them, what may turn back unnoticed, the fit itself.
constexpr double kSamplingShare = 0.1;
constexpr double kTurnShare = 0.2;
constexpr double kFitShare = 0.9;
// Control points of a piece nearer than this, in uv, give no direction.
constexpr double kOnePoint = 1e-12;
// What a piece costs in the pack: its points beyond the shared one, and its word.
constexpr double kLineBytes = 12, kCubicBytes = 28;

struct PointAndSlope {
    Vec2d p, d;
};

/// knots[k] <= t < knots[k+1], or the last span that is not empty.
int find_span(const SplineCurve2d& c, double t)
{
    const int n = static_cast<int>(c.control_points.size());
    const auto begin = c.knots.begin() + c.degree, end = c.knots.begin() + n;
    int k = static_cast<int>(std::upper_bound(begin, end, t) - c.knots.begin()) - 1;
    k = std::clamp(k, c.degree, n - 1);
    while (k > c.degree && c.knots[k] >= c.knots[k + 1])
        --k;
    return k;
}

/// Point and derivative in span k. Source: de Boor; the last step's difference gives the derivative.
PointAndSlope evaluate_span(const SplineCurve2d& c, int k, double t)
{
    const int p = c.degree;
    std::array<std::array<double, 3>, kMaxDegree + 1> d;
    for (int j = 0; j <= p; ++j)
        d[j] = c.control_points[k - p + j];
    std::array<double, 3> slope{0, 0, 0};
    for (int r = 1; r <= p; ++r) {
        if (r == p)
            for (int i = 0; i < 3; ++i)
                slope[i] = p * (d[p][i] - d[p - 1][i]) / (c.knots[k + 1] - c.knots[k]);
        for (int j = p; j >= r; --j) {
            const double lo = c.knots[j + k - p], hi = c.knots[j + 1 + k - r];
            const double a = (t - lo) / (hi - lo);
            for (int i = 0; i < 3; ++i)
                d[j][i] = (1 - a) * d[j - 1][i] + a * d[j][i];
        }
    }
    const double w = d[p][2];
    const Vec2d point{d[p][0] / w, d[p][1] / w};
    // (A / w)' = (A' - w' A / w) / w
    return {point, {(slope[0] - slope[2] * point.x) / w, (slope[1] - slope[2] * point.y) / w}};
}

/// A sample. The curve may have a corner here: derivatives before and after, per unit of t; `t` to the next sample.
struct Node {
    Vec2d p, d_before, d_after;
    double t = 0;
};

/// The cubic Hermite interpolant between two neighbouring samples at fraction s.
Vec2d between(const Node& a, const Node& b, double s)
{
    const double h = b.t - a.t, r = 1 - s;
    return (r * r * (1 + 2 * s)) * a.p + (s * s * (1 + 2 * r)) * b.p + (h * s * r * r) * a.d_after +
           (-h * s * s * r) * b.d_before;
}

/// Samples of the curve in metric space such that the Hermite interpolant between neighbours is within `tolerance`.
class Sampler {
public:
    Sampler(const SplineCurve2d& curve, Vec2d metric, double tolerance)
        : curve_(curve), metric_(metric), tolerance_(tolerance)
    {
    }

    std::vector<Node> run(double first, double last)
    {
        std::vector<double> breaks{first};
        for (size_t k = curve_.degree; k <= curve_.control_points.size(); ++k)
            if (curve_.knots[k] > breaks.back() && curve_.knots[k] < last)
                breaks.push_back(curve_.knots[k]);
        breaks.push_back(last);
        const size_t spans = breaks.size() - 1;
        const int steps = curve_.degree == 1 ? 1 : static_cast<int>(std::clamp<size_t>(96 / spans, 1, 32));
        for (size_t i = 0; i < spans; ++i) {
            const int k = find_span(curve_, 0.5 * (breaks[i] + breaks[i + 1]));
            Node a = node(k, breaks[i]);
            if (nodes_.empty())
                nodes_.push_back(a);
            else
                nodes_.back().d_after = a.d_after;
            for (int s = 1; s <= steps; ++s) {
                const double t = s == steps ? breaks[i + 1] : breaks[i] + (breaks[i + 1] - breaks[i]) * s / steps;
                const Node b = node(k, t);
                refine(k, a, b, curve_.degree == 1 ? 0 : 10);
                nodes_.push_back(b);
                a = b;
            }
        }
        return std::move(nodes_);
    }

private:
    Node node(int k, double t) const
    {
        const PointAndSlope e = evaluate_span(curve_, k, t);
        const Vec2d d{e.d.x * metric_.x, e.d.y * metric_.y};
        return {{e.p.x * metric_.x, e.p.y * metric_.y}, d, d, t};
    }

    /// Appends what lies strictly between a and b.
    void refine(int k, const Node& a, const Node& b, int depth)
    {
        if (depth == 0)
            return;
        const Node middle = node(k, 0.5 * (a.t + b.t));
        if (!(middle.t > a.t && middle.t < b.t))
            return;
        const bool close = length(between(a, b, 0.5) - middle.p) <= tolerance_;
        // an extremum between samples becomes a sample, or a piece would turn inside
        const double turn = extremum(a, b);
        if (close && turn <= 0)
            return;
        const Node m = close ? node(k, a.t + turn * (b.t - a.t)) : middle;
        if (!(m.t > a.t && m.t < b.t))
            return;
        refine(k, a, m, close ? std::min(depth - 1, 2) : depth - 1);
        nodes_.push_back(m);
        refine(k, m, b, close ? std::min(depth - 1, 2) : depth - 1);
    }

    /// Fraction in (0, 1) where the interpolant turns in x or y by more than the tolerance, or 0.
    double extremum(const Node& a, const Node& b) const
    {
        const double h = b.t - a.t;
        for (const bool y : {false, true}) {
            const double d0 = h * (y ? a.d_after.y : a.d_after.x), d1 = h * (y ? b.d_before.y : b.d_before.x);
            if (d0 * d1 >= 0)
                continue;
            // slope over s: d0 + (6 D - 4 d0 - 2 d1) s + (3 d0 + 3 d1 - 6 D) s^2
            const double rise = y ? b.p.y - a.p.y : b.p.x - a.p.x;
            double lo = 0, hi = 1;
            for (int i = 0; i < 40; ++i) {
                const double s = 0.5 * (lo + hi);
                const double slope = d0 + s * (6 * rise - 4 * d0 - 2 * d1 + s * (3 * d0 + 3 * d1 - 6 * rise));
                ((slope < 0) == (d0 < 0) ? lo : hi) = s;
            }
            const Vec2d p = between(a, b, lo);
            const double excursion = y ? std::min(std::abs(p.y - a.p.y), std::abs(p.y - b.p.y))
                                       : std::min(std::abs(p.x - a.p.x), std::abs(p.x - b.p.x));
            if (excursion > tolerance_)
                return lo;
        }
        return 0;
    }

    const SplineCurve2d& curve_;
    Vec2d metric_;
    double tolerance_;
    std::vector<Node> nodes_;
};

/// Appends the indices of samples where the coordinate turns by more than `threshold`.
template <class Coordinate>
void find_turns(const std::vector<Node>& nodes, Coordinate coordinate, double threshold, std::vector<size_t>& turns)
{
    size_t lo = 0, hi = 0; // of the lowest and highest since the last turn
    int direction = 0;
    for (size_t i = 1; i < nodes.size(); ++i) {
        const double x = coordinate(nodes[i].p);
        if (x > coordinate(nodes[hi].p))
            hi = i;
        if (x < coordinate(nodes[lo].p))
            lo = i;
        const bool risen = x - coordinate(nodes[lo].p) > threshold, fallen = coordinate(nodes[hi].p) - x > threshold;
        if (direction >= 0 && fallen && hi < i) {
            if (direction > 0)
                turns.push_back(hi);
            direction = -1;
            lo = hi = i;
        } else if (direction <= 0 && risen && lo < i) {
            if (direction < 0)
                turns.push_back(lo);
            direction = 1;
            lo = hi = i;
        }
    }
}

Vec2d cubic_at(const Vec2d p[4], double t)
{
    const double s = 1 - t;
    return (s * s * s) * p[0] + (3 * s * s * t) * p[1] + (3 * s * t * t) * p[2] + (t * t * t) * p[3];
}

/// A cubic in powers of t, for evaluating at many parameters: C(t) = ((a t + b) t + c) t + p0.
struct PowerCubic {
    Vec2d a, b, c, p0;

    explicit PowerCubic(const Vec2d p[4])
        : a(p[3] - p[0] + 3.0 * (p[1] - p[2])), b(3.0 * (p[0] - 2.0 * p[1] + p[2])), c(3.0 * (p[1] - p[0])), p0(p[0])
    {
    }
    Vec2d at(double t) const { return t * (t * (t * a + b) + c) + p0; }
    Vec2d slope(double t) const { return t * ((3 * t) * a + 2.0 * b) + c; }
};

/// Solves the symmetric 4x4 system a x = b in place by elimination; a is positive definite.
void solve4(double a[4][4], double b[4])
{
    for (int i = 0; i < 4; ++i)
        for (int j = i + 1; j < 4; ++j) {
            const double f = a[j][i] / a[i][i];
            for (int k = i; k < 4; ++k)
                a[j][k] -= f * a[i][k];
            b[j] -= f * b[i];
        }
    for (int i = 3; i >= 0; --i) {
        for (int k = i + 1; k < 4; ++k)
            b[i] -= a[i][k] * b[k];
        b[i] /= a[i][i];
    }
}

/// Fits pieces to the samples i..j.
class Fitter {
public:
    Fitter(const std::vector<Node>& nodes, bool polyline, double tolerance)
        : nodes_(nodes), polyline_(polyline), tolerance_(tolerance)
    {
        way_.push_back(0);
        for (size_t i = 1; i < nodes.size(); ++i)
            way_.push_back(way_.back() + length(nodes[i].p - nodes[i - 1].p));
    }

    double deviation() const { return deviation_; }

    /// Appends the pieces of a stretch on which both coordinates are monotone.
    void run(size_t first, size_t last, std::vector<CurvePiece>& pieces)
    {
        while (first < last) {
            const size_t line_end = furthest(first, last, line_guess_, [&](size_t j) { return line(first, j); });
            size_t cubic_end = first;
            if (line_end < last)
                cubic_end = furthest(first, last, cubic_guess_, [&](size_t j) { return cubic(first, j); });
            const double line_way = way_[line_end] - way_[first], cubic_way = way_[cubic_end] - way_[first];
            if (line_end == last || (line_end > first && line_way * kCubicBytes >= cubic_way * kLineBytes)) {
                line(first, line_end);
                first = line_end;
            } else if (cubic_end > first) {
                cubic(first, cubic_end);
                first = cubic_end;
            } else {
                // a single step between samples, which turns by less than a run's threshold or more than a fit follows
                interval(first);
                if (candidate_deviation_ > tolerance_)
                    chords(first, pieces);
                first += 1;
            }
            pieces.push_back(candidate_);
            deviation_ = std::max(deviation_, candidate_deviation_);
        }
    }

private:
    /// Largest j found in (first, last] that `fits`, or first. Doubles or halves from the last stretch's length, then
    /// closes in to a sixteenth.
    template <class Fits>
    size_t furthest(size_t first, size_t last, size_t& guess, Fits fits)
    {
        if (fits(last))
            return last;
        size_t good = first, bad = last;
        size_t step = std::clamp<size_t>(guess, 1, last - first);
        while (bad - good > std::max<size_t>(1, (good - first) / 16)) {
            size_t j = good == first ? first + std::min(step, bad - first - 1)
                       : bad == last ? std::min(good + step, (good + bad) / 2)
                                     : (good + bad) / 2;
            j = std::clamp(j, good + 1, bad - 1);
            if (fits(j)) {
                good = j;
                step *= 2;
            } else {
                bad = j;
                step = std::max<size_t>(1, (j - first) / 2);
            }
        }
        guess = std::max<size_t>(1, good - first);
        return good;
    }

    /// Calls visit(point, share of the way) for about `count` points strictly inside first..last, or for all samples.
    template <class Visit>
    void visit_points(size_t first, size_t last, size_t count, Visit visit) const
    {
        const size_t steps = last - first;
        const double way = way_[last] - way_[first];
        const auto share = [&](double w) { return way > 0 ? (w - way_[first]) / way : 0.5; };
        if (steps >= count || polyline_) {
            const size_t stride = std::max<size_t>(1, steps / count);
            for (size_t i = first + stride; i < last; i += stride)
                if (!visit(nodes_[i].p, share(way_[i])))
                    return;
            return;
        }
        const size_t parts = (count + steps - 1) / steps;
        for (size_t i = first; i < last; ++i)
            for (size_t k = i == first ? 1 : 0; k < parts; ++k) {
                const double s = static_cast<double>(k) / parts;
                if (!visit(between(nodes_[i], nodes_[i + 1], s), share((1 - s) * way_[i] + s * way_[i + 1])))
                    return;
            }
    }

    bool line(size_t first, size_t last)
    {
        const Vec2d a = nodes_[first].p, chord = nodes_[last].p - a;
        const double chord2 = dot(chord, chord);
        double worst = 0;
        visit_points(first, last, std::max<size_t>(last - first, 8), [&](Vec2d q, double) {
            const double t = chord2 > 0 ? std::clamp(dot(q - a, chord) / chord2, 0.0, 1.0) : 0;
            worst = std::max(worst, length(q - a - t * chord));
            return worst <= tolerance_;
        });
        candidate_ = {{a, a + (1 / 3.0) * chord, a + (2 / 3.0) * chord, nodes_[last].p}, false};
        candidate_deviation_ = worst;
        return worst <= tolerance_;
    }

    /// The Hermite cubic of one step between samples.
    void interval(size_t i)
    {
        const Node &a = nodes_[i], &b = nodes_[i + 1];
        const double h = (b.t - a.t) / 3;
        candidate_ = {{a.p, a.p + h * a.d_after, b.p - h * b.d_before, b.p}, true};
        order_points(candidate_);
        candidate_deviation_ = 0;
        const PowerCubic fitted(candidate_.p);
        visit_points(i, i + 1, 8, [&](Vec2d q, double s) {
            candidate_deviation_ = std::max(candidate_deviation_, distance(fitted, q, s));
            return true;
        });
    }

    /// The same step as short lines: all but the last are appended, the last is the candidate.
    void chords(size_t i, std::vector<CurvePiece>& pieces)
    {
        const Node &a = nodes_[i], &b = nodes_[i + 1];
        for (int count = 2; count <= 64; count *= 2) {
            std::vector<CurvePiece> lines;
            double worst = 0;
            for (int k = 0; k < count; ++k) {
                const double s = static_cast<double>(k) / count, e = static_cast<double>(k + 1) / count;
                const Vec2d p = k == 0 ? a.p : between(a, b, s), q = k + 1 == count ? b.p : between(a, b, e);
                lines.push_back({{p, p + (1 / 3.0) * (q - p), p + (2 / 3.0) * (q - p), q}, false});
                worst = std::max(worst, length(between(a, b, 0.5 * (s + e)) - 0.5 * (p + q)));
            }
            candidate_ = lines.back();
            candidate_deviation_ = worst;
            if (worst <= tolerance_ || count == 64) {
                pieces.insert(pieces.end(), lines.begin(), lines.end() - 1);
                return;
            }
        }
    }

    /// Distance of q from the cubic; t: where to start, and where the foot was found.
    static double distance(const PowerCubic& cubic, Vec2d q, double& t)
    {
        // f(t) = (C - q) . C'; the second derivative is left out of the slope while far, so the step never runs away
        for (int i = 0; i < 4; ++i) {
            const Vec2d e = cubic.at(t) - q, d = cubic.slope(t);
            const double slope = dot(d, d);
            if (!(slope > 0))
                break;
            const double next = std::clamp(t - dot(e, d) / slope, 0.0, 1.0);
            const double step = std::abs(next - t);
            t = next;
            if (step < 1e-6)
                break;
        }
        return length(cubic.at(t) - q);
    }

    static bool same_points(const Vec2d a[4], const Vec2d b[4])
    {
        return std::equal(a, a + 4, b, [](Vec2d x, Vec2d y) { return x.x == y.x && x.y == y.y; });
    }

    bool cubic(size_t first, size_t last)
    {
        constexpr size_t kFitPoints = 20;
        std::array<Vec2d, 2 * kFitPoints + 2> q;
        std::array<double, 2 * kFitPoints + 2> t;
        size_t count = 0;
        visit_points(first, last, kFitPoints, [&](Vec2d p, double share) {
            q[count] = p;
            t[count] = share;
            return ++count < q.size();
        });
        candidate_.cubic = true;
        Vec2d p[4] = {nodes_[first].p, {}, {}, nodes_[last].p};
        if (count < 2) {
            interval(first);
            return last == first + 1 && candidate_deviation_ <= tolerance_;
        }
        fit_by_chords(q.data(), t.data(), count, p);
        for (int round = 0; round < 5; ++round) {
            std::copy(p, p + 4, candidate_.p);
            order_points(candidate_);
            candidate_deviation_ = 0;
            const bool in_order = same_points(candidate_.p, p);
            const PowerCubic ordered(candidate_.p), free(p);
            for (size_t k = 0; k < count; ++k) {
                double foot = t[k];
                candidate_deviation_ = std::max(candidate_deviation_, distance(ordered, q[k], foot));
                if (in_order)
                    t[k] = foot;
                else
                    distance(free, q[k], t[k]);
            }
            if (candidate_deviation_ <= tolerance_)
                return verify(first, last);
            // with one parameter a point fitted, error shrinks by orders a round or not at all
            if (round >= 1 && candidate_deviation_ > (round == 1 ? 1000 : 30) * tolerance_)
                return false;
            fit_by_normals(q.data(), t.data(), count, p);
        }
        return false;
    }

    /// All samples of the stretch within tolerance of the candidate.
    bool verify(size_t first, size_t last)
    {
        double t = 0;
        const PowerCubic fitted(candidate_.p);
        visit_points(first, last, std::max<size_t>(last - first, 40), [&](Vec2d q, double share) {
            // the foot moves on with the samples; the share of the way guards against a stuck one
            double foot = std::abs(t - share) < 0.1 ? t : share;
            candidate_deviation_ = std::max(candidate_deviation_, distance(fitted, q, foot));
            t = foot;
            return candidate_deviation_ <= tolerance_;
        });
        return candidate_deviation_ <= tolerance_;
    }

    /// Least squares for p1, p2 with parameters given; ends fixed. Source: Schneider 1990, tangents left free.
    static void fit_by_chords(const Vec2d* q, const double* t, size_t count, Vec2d p[4])
    {
        double a11 = 0, a12 = 0, a22 = 0;
        Vec2d r1{}, r2{};
        for (size_t k = 0; k < count; ++k) {
            const double s = 1 - t[k], b1 = 3 * s * s * t[k], b2 = 3 * s * t[k] * t[k];
            const Vec2d rest = q[k] - (s * s * s) * p[0] - (t[k] * t[k] * t[k]) * p[3];
            a11 += b1 * b1;
            a12 += b1 * b2;
            a22 += b2 * b2;
            r1 = r1 + b1 * rest;
            r2 = r2 + b2 * rest;
        }
        const double det = a11 * a22 - a12 * a12;
        if (!(det > 1e-12 * a11 * a22)) {
            p[1] = p[0] + (1 / 3.0) * (p[3] - p[0]);
            p[2] = p[0] + (2 / 3.0) * (p[3] - p[0]);
            return;
        }
        p[1] = (1 / det) * (a22 * r1 - a12 * r2);
        p[2] = (1 / det) * (a11 * r2 - a12 * r1);
    }

    /// One Gauss-Newton step for p1, p2 on the distances along the curve's normals, which leaves the parameters free.
    static void fit_by_normals(const Vec2d* q, const double* t, size_t count, Vec2d p[4])
    {
        double a[4][4] = {}, b[4] = {};
        for (size_t k = 0; k < count; ++k) {
            const double s = 1 - t[k], b1 = 3 * s * s * t[k], b2 = 3 * s * t[k] * t[k];
            const Vec2d d = (s * s) * (p[1] - p[0]) + (2 * s * t[k]) * (p[2] - p[1]) + (t[k] * t[k]) * (p[3] - p[2]);
            const double l = length(d);
            if (!(l > 0))
                continue;
            const Vec2d n{-d.y / l, d.x / l};
            const double error = dot(n, q[k] - cubic_at(p, t[k]));
            const double w[4] = {b1 * n.x, b1 * n.y, b2 * n.x, b2 * n.y};
            for (int i = 0; i < 4; ++i) {
                for (int j = 0; j < 4; ++j)
                    a[i][j] += w[i] * w[j];
                b[i] += w[i] * error;
            }
        }
        // sliding along the curve changes nothing it can see: hold it by a little
        const double trace = a[0][0] + a[1][1] + a[2][2] + a[3][3];
        for (int i = 0; i < 4; ++i)
            a[i][i] += 1e-7 * trace + 1e-300;
        solve4(a, b);
        p[1] = p[1] + Vec2d{b[0], b[1]};
        p[2] = p[2] + Vec2d{b[2], b[3]};
    }

    const std::vector<Node>& nodes_;
    bool polyline_;
    double tolerance_;
    std::vector<double> way_; // along the samples
    size_t line_guess_ = 16, cubic_guess_ = 16;
    CurvePiece candidate_;
    double candidate_deviation_ = 0, deviation_ = 0;
};

bool is_finite(const std::vector<Node>& nodes)
{
    return std::all_of(nodes.begin(), nodes.end(),
                       [](const Node& n) { return std::isfinite(n.p.x) && std::isfinite(n.p.y); });
}

} // namespace

MonotonePiece monotone(const CurvePiece& piece)
{
    MonotonePiece m;
    m.cubic = piece.cubic;
    for (int i = 0; i < 4; ++i) {
        m.u[i] = piece.p[i].x;
        m.v[i] = piece.p[i].y;
    }
    return m;
}

CurvePiece line_piece(Vec2d a, Vec2d b)
{
    return {{a, a + (1 / 3.0) * (b - a), a + (2 / 3.0) * (b - a), b}, false};
}

void reverse_pieces(std::vector<CurvePiece>& pieces)
{
    std::reverse(pieces.begin(), pieces.end());
    for (CurvePiece& piece : pieces) {
        std::swap(piece.p[0], piece.p[3]);
        std::swap(piece.p[1], piece.p[2]);
    }
}

Vec2d start_direction(const CurvePiece& piece)
{
    for (const int i : {1, 2, 3})
        if (const Vec2d d = piece.p[i] - piece.p[0]; piece.cubic ? length(d) > kOnePoint : i == 3)
            return d;
    return {};
}

Vec2d end_direction(const CurvePiece& piece)
{
    for (const int i : {2, 1, 0})
        if (const Vec2d d = piece.p[3] - piece.p[i]; piece.cubic ? length(d) > kOnePoint : i == 0)
            return d;
    return {};
}

namespace {

void move_by(CurvePiece& piece, int end, int beside, Vec2d by, Vec2d mm_per_uv)
{
    piece.p[end] = piece.p[end] + by;
    piece.p[beside] = piece.p[beside] + by;
    if (piece.grow_mm != kHeld)
        piece.grow_mm += length({by.x * mm_per_uv.x, by.y * mm_per_uv.y});
    order_points(piece);
}

} // namespace

void move_start(CurvePiece& piece, Vec2d to, Vec2d mm_per_uv)
{
    move_by(piece, 0, 1, to - piece.p[0], mm_per_uv);
    piece.p[0] = to;
}

void move_end(CurvePiece& piece, Vec2d to, Vec2d mm_per_uv)
{
    move_by(piece, 3, 2, to - piece.p[3], mm_per_uv);
    piece.p[3] = to;
}

double parameter_at(const CurvePiece& piece, bool v, double x)
{
    const MonotonePiece m = monotone(piece);
    const double* c = v ? m.v : m.u;
    return piece.cubic ? solve_monotone(c, x) : (x - c[0]) / (c[3] - c[0]);
}

void order_points(CurvePiece& piece)
{
    if (!piece.cubic)
        return;
    const auto order = [](double a, double& b, double& c, double d) {
        const auto [lo, hi] = std::minmax(a, d);
        b = std::clamp(b, lo, hi);
        c = a <= d ? std::clamp(c, b, hi) : std::clamp(c, lo, b);
    };
    order(piece.p[0].x, piece.p[1].x, piece.p[2].x, piece.p[3].x);
    order(piece.p[0].y, piece.p[1].y, piece.p[2].y, piece.p[3].y);
}

void split_piece(const CurvePiece& piece, double t, CurvePiece& before, CurvePiece& after)
{
    const auto mix = [t](Vec2d a, Vec2d b) { return (1 - t) * a + t * b; };
    const Vec2d a = mix(piece.p[0], piece.p[1]), b = mix(piece.p[1], piece.p[2]), c = mix(piece.p[2], piece.p[3]);
    const Vec2d ab = mix(a, b), bc = mix(b, c), middle = mix(ab, bc);
    before = {{piece.p[0], a, ab, middle}, piece.cubic, piece.use, piece.grow_mm};
    after = {{middle, bc, c, piece.p[3]}, piece.cubic, piece.use, piece.grow_mm};
}

bool is_straight(const SplineCurve2d& curve)
{
    return curve.degree == 1 && curve.control_points.size() == 2;
}

Vec2d curve_point(const SplineCurve2d& curve, double t)
{
    return evaluate_span(curve, find_span(curve, t), t).p;
}

CurveFit fit_curve(const SplineCurve2d& curve, double first, double last, Vec2d metric, double tolerance)
{
    assert(first < last && curve.degree >= 1 && curve.degree <= static_cast<int>(kMaxDegree));
    CurveFit fit;
    if (is_straight(curve)) { // most pcurves
        const Vec2d a = curve_point(curve, first), b = curve_point(curve, last);
        fit.finite = std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(b.x) && std::isfinite(b.y);
        if (fit.finite)
            fit.pieces.push_back(line_piece(a, b));
        return fit;
    }
    const std::vector<Node> nodes = Sampler(curve, metric, kSamplingShare * tolerance).run(first, last);
    if (!is_finite(nodes)) {
        fit.finite = false;
        return fit;
    }
    std::vector<size_t> cuts{0, nodes.size() - 1};
    find_turns(
        nodes, [](Vec2d p) { return p.x; }, kTurnShare * tolerance, cuts);
    find_turns(
        nodes, [](Vec2d p) { return p.y; }, kTurnShare * tolerance, cuts);
    std::sort(cuts.begin(), cuts.end());
    cuts.erase(std::unique(cuts.begin(), cuts.end()), cuts.end());

    Fitter fitter(nodes, curve.degree == 1, kFitShare * tolerance);
    for (size_t i = 0; i + 1 < cuts.size(); ++i)
        fitter.run(cuts[i], cuts[i + 1], fit.pieces);
    fit.deviation = fitter.deviation();

    for (CurvePiece& piece : fit.pieces)
        for (Vec2d& p : piece.p)
            p = {p.x / metric.x, p.y / metric.y};
    const Vec2d ends[2] = {curve_point(curve, first), curve_point(curve, last)};
    fit.pieces.front().p[0] = ends[0];
    fit.pieces.back().p[3] = ends[1];
    for (size_t i = 0; i + 1 < fit.pieces.size(); ++i)
        fit.pieces[i + 1].p[0] = fit.pieces[i].p[3];
    for (CurvePiece& piece : fit.pieces)
        order_points(piece);
    return fit;
}

} // namespace trimray
