#include "format/bezier_reference.h"

#include <cassert>
#include <optional>
#include <utility>

namespace trimray::reference {
namespace {

using Point = std::array<double, 4>;
constexpr double kUnit = 1.1102230246251565e-16; // unit roundoff of double

Point lerp(const Point& a, const Point& b, double s)
{
    Point c;
    for (size_t i = 0; i < 4; ++i)
        c[i] = (1 - s) * a[i] + s * b[i];
    return c;
}

/// A net of (degree[0] + 1) (degree[1] + 1) points, the second parameter runs fastest.
struct Net {
    int degree[2];
    std::vector<Point> points;

    int stride(int axis) const { return axis == 0 ? degree[1] + 1 : 1; }
    int lines(int axis) const { return axis == 0 ? degree[1] + 1 : degree[0] + 1; }
    size_t line_start(int axis, int line) const { return static_cast<size_t>(line) * (axis == 0 ? 1 : degree[1] + 1); }
};

/// The net over [0, s] along an axis. Source: de Casteljau.
void keep_left(Net& net, int axis, double s)
{
    const int n = net.degree[axis], step = net.stride(axis);
    for (int line = 0; line < net.lines(axis); ++line) {
        Point* c = &net.points[net.line_start(axis, line)];
        for (int k = 1; k <= n; ++k)
            for (int i = n; i >= k; --i)
                c[i * step] = lerp(c[(i - 1) * step], c[i * step], s);
    }
}

/// The net over [s, 1] along an axis.
void keep_right(Net& net, int axis, double s)
{
    const int n = net.degree[axis], step = net.stride(axis);
    for (int line = 0; line < net.lines(axis); ++line) {
        Point* c = &net.points[net.line_start(axis, line)];
        for (int k = 1; k <= n; ++k)
            for (int i = 0; i <= n - k; ++i)
                c[i * step] = lerp(c[i * step], c[(i + 1) * step], s);
    }
}

/// An interval of [0, 1]; lo > hi: empty.
struct Interval {
    double lo = 1, hi = 0;
    bool empty() const { return lo > hi; }
    double size() const { return hi - lo; }
};

Interval common(const Interval& a, const Interval& b)
{
    return {std::max(a.lo, b.lo), std::min(a.hi, b.hi)};
}

/// Where the convex hull of the points (i / n, lo[i]) and (i / n, hi[i]) meets the axis: no graph in it is zero
/// elsewhere.
Interval zero_interval(const double* lo, const double* hi, int n)
{
    constexpr double kGrowth = 4e-15; // of the rounding here
    Interval found;
    const auto add = [&found](double at) {
        found.lo = std::min(found.lo, at - kGrowth);
        found.hi = std::max(found.hi, at + kGrowth);
    };
    for (int i = 0; i <= n; ++i) {
        const double here = static_cast<double>(i) / n;
        if (lo[i] <= 0 && hi[i] >= 0)
            add(here);
        // segments from a point below the axis to one above it; the ends of two columns are enough
        for (const double below : {lo[i], hi[i]})
            for (int j = 0; j <= n && below < 0; ++j)
                for (const double above : {lo[j], hi[j]})
                    if (above > 0)
                        add(here + (j - i) * (-below / (above - below)) / n);
    }
    return {std::max(found.lo, 0.0), std::min(found.hi, 1.0)};
}

/// c0 * a + c1 * b of a net's two distances, with a bound on each value's error.
struct Combined {
    double c0, c1, error_per_w;
    double at(const Point& p) const { return c0 * p[0] + c1 * p[1]; }
};

/// Where along an axis the combination may be zero.
Interval clip(const Net& net, int axis, const Combined& f)
{
    double lo[kMaxDegree + 1], hi[kMaxDegree + 1];
    const int n = net.degree[axis], step = net.stride(axis);
    for (int i = 0; i <= n; ++i) {
        lo[i] = std::numeric_limits<double>::infinity();
        hi[i] = -lo[i];
    }
    for (int line = 0; line < net.lines(axis); ++line) {
        const Point* c = &net.points[net.line_start(axis, line)];
        for (int i = 0; i <= n; ++i) {
            const Point& p = c[i * step];
            const double value = f.at(p), error = f.error_per_w * p[3];
            lo[i] = std::min(lo[i], value - error);
            hi[i] = std::max(hi[i], value + error);
        }
    }
    return zero_interval(lo, hi, n);
}

/// Bounds on the derivative of the combination along an axis, over the whole net.
Interval slope(const Net& net, int axis, const Combined& f)
{
    const int n = net.degree[axis], step = net.stride(axis);
    Interval range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    for (int line = 0; line < net.lines(axis); ++line) {
        const Point* c = &net.points[net.line_start(axis, line)];
        for (int i = 0; i < n; ++i) {
            const Point &p = c[i * step], &q = c[(i + 1) * step];
            const double rise = n * (f.at(q) - f.at(p)), error = 1.01 * n * f.error_per_w * (p[3] + q[3]);
            range.lo = std::min(range.lo, rise - error);
            range.hi = std::max(range.hi, rise + error);
        }
    }
    return range;
}

} // namespace

/// One line against one patch. Net points are (a, b, c, w): w times the distances from two planes through the line, w
/// times the way along the line, and the weight.
///
/// Rounding: a point's a, b and c are w times numbers of at most `reach`, so what they lose at first, with the planes'
/// own rounding, is at most 16 kUnit reach w, and each step of de Casteljau's adds at most 3 kUnit reach w of the new
/// point. So |error| <= rounding * w, with `rounding` counted along for each box, in patch units.
class PatchSearch {
public:
    PatchSearch(const BezierReference& patch, const Ray& ray, double t_lo, double t_hi, const TakeRoot& take)
        : patch_(patch), ray_(ray), t_lo_(t_lo), t_hi_(t_hi), take_(take)
    {
        speed_ = length(ray.direction);
        along_ = ray.direction * (1 / speed_);
        size_t least = 0;
        for (size_t i = 1; i < 3; ++i)
            if (std::abs(along_[i]) < std::abs(along_[least]))
                least = i;
        Vec3 axis{};
        axis[least] = 1;
        n1_ = cross(along_, axis);
        n1_ = n1_ * (1 / length(n1_));
        n2_ = cross(along_, n1_);
    }

    SearchEnd run()
    {
        constexpr uint64_t kMostBoxes = 50000; // some tenths of a second
        Box whole;
        whole.net.degree[0] = patch_.degree_[0];
        whole.net.degree[1] = patch_.degree_[1];
        for (const Point& p : patch_.net_) {
            const Vec3 wp{p[0], p[1], p[2]};
            const Vec3 relative = wp - ray_.origin * p[3];
            whole.net.points.push_back({dot(n1_, relative), dot(n2_, relative), dot(along_, relative), p[3]});
        }
        reach_ = patch_.reach_ + length(ray_.origin);
        whole.rounding = 16 * kUnit * reach_;
        whole.near = nearest(whole);
        stack_.push_back(std::move(whole));
        while (!stack_.empty()) {
            Box box = std::move(stack_.back());
            stack_.pop_back();
            if (box.near > t_hi_)
                continue;
            if (end_.boxes >= kMostBoxes)
                end_.open_from = std::min(end_.open_from, std::max(box.near, t_lo_));
            else
                search(std::move(box));
        }
        return end_;
    }

private:
    struct Box {
        Net net;
        double lo[2] = {0, 0}, size[2] = {1, 1}; // of the whole net's parameters
        double rounding = 0;
        double near = 0;       // the least t of its control points
        bool one_root = false; // proved to hold at most one
    };

    double nearest(const Box& box) const
    {
        double least = std::numeric_limits<double>::infinity();
        for (const Point& p : box.net.points)
            least = std::min(least, p[2] / p[3]);
        return (least - box.rounding) / speed_;
    }
    double farthest(const Box& box) const
    {
        double most = -std::numeric_limits<double>::infinity();
        for (const Point& p : box.net.points)
            most = std::max(most, p[2] / p[3]);
        return (most + box.rounding) / speed_;
    }

    void restrict_to(Box& box, int axis, const Interval& kept) const
    {
        if (kept.hi < 1)
            keep_left(box.net, axis, kept.hi);
        if (kept.lo > 0)
            keep_right(box.net, axis, kept.lo / kept.hi);
        box.rounding += ((kept.hi < 1) + (kept.lo > 0)) * 3 * box.net.degree[axis] * kUnit * reach_;
        box.lo[axis] += kept.lo * box.size[axis];
        box.size[axis] *= kept.size();
    }

    /// Whether a plane through the line has the whole box on one side.
    static bool misses(const Box& box)
    {
        double mean[2] = {0, 0};
        for (const Point& p : box.net.points)
            for (size_t i = 0; i < 2; ++i)
                mean[i] += p[i] / p[3];
        const double size = std::hypot(mean[0], mean[1]);
        if (!(size > 0))
            return false;
        const double c0 = mean[0] / size, c1 = mean[1] / size;
        for (const Point& p : box.net.points)
            if (!(c0 * p[0] + c1 * p[1] > 2 * box.rounding * p[3]))
                return false;
        return true;
    }

    /// How long the box is along each axis: the longest line of its net in space, patch units.
    static std::array<double, 2> lengths(const Box& box)
    {
        std::array<double, 2> longest{0, 0};
        for (int axis = 0; axis < 2; ++axis) {
            const int step = box.net.stride(axis);
            for (int line = 0; line < box.net.lines(axis); ++line) {
                const Point* c = &box.net.points[box.net.line_start(axis, line)];
                double sum = 0;
                for (int i = 0; i < box.net.degree[axis]; ++i) {
                    const Point &p = c[i * step], &q = c[(i + 1) * step];
                    for (size_t k = 0; k < 3; ++k)
                        sum += std::abs(q[k] / q[3] - p[k] / p[3]);
                }
                double& most = longest[static_cast<size_t>(axis)];
                most = std::max(most, sum);
            }
        }
        return longest;
    }

    /// Whether all of the box lies on the line as far as rounding can tell, and is short along it; or it may hold two
    /// roots and is so small that a surface bending within the patch's size leaves its tangent plane there by no more
    /// than rounding.
    static bool within_rounding(const Box& box, const std::array<double, 2>& length)
    {
        constexpr double kShort = 1e-3; // patch units
        const double longest = std::max(length[0], length[1]);
        if (!box.one_root && longest <= 2 * std::sqrt(box.rounding))
            return true;
        return longest <= kShort && std::all_of(box.net.points.begin(), box.net.points.end(), [&](const Point& p) {
                   return std::max(std::abs(p[0]), std::abs(p[1])) <= 4 * box.rounding * p[3];
               });
    }

    /// The combinations of both distances that change along one axis only, as far as the box is flat: rows of the
    /// adjugate of the net's mean Jacobian.
    static std::array<Combined, 2> straightened(const Box& box, double reach)
    {
        const Net& net = box.net;
        double j[2][2] = {{0, 0}, {0, 0}}; // [axis][distance]
        for (int axis = 0; axis < 2; ++axis)
            for (int line = 0; line < net.lines(axis); ++line) {
                const Point* c = &net.points[net.line_start(axis, line)];
                for (size_t i = 0; i < 2; ++i)
                    j[axis][i] += (c[net.degree[axis] * net.stride(axis)][i] - c[0][i]) / net.lines(axis);
            }
        const auto combined = [&](double c0, double c1) {
            return Combined{c0, c1, (box.rounding + 4 * kUnit * reach) * (std::abs(c0) + std::abs(c1))};
        };
        return {combined(j[1][1], -j[1][0]), combined(-j[0][1], j[0][0])};
    }

    /// At most one root, by a Jacobian that is regular with any mixture of its rows' values over the box: between two
    /// roots the mean value theorem would make it singular.
    static bool holds_one_root(const Net& net, const std::array<Combined, 2>& f)
    {
        const Interval uu = slope(net, 0, f[0]), vv = slope(net, 1, f[1]);
        const bool same_sign = (uu.lo > 0 && vv.lo > 0) || (uu.hi < 0 && vv.hi < 0);
        if (!same_sign)
            return false;
        const Interval uv = slope(net, 1, f[0]), vu = slope(net, 0, f[1]);
        const double diagonal = std::min(std::abs(uu.lo), std::abs(uu.hi)) * std::min(std::abs(vv.lo), std::abs(vv.hi));
        const double other = std::max(std::abs(uv.lo), std::abs(uv.hi)) * std::max(std::abs(vu.lo), std::abs(vu.hi));
        return diagonal > 1.0001 * other;
    }

    /// Newton's iteration on the whole patch; nothing if it does not settle inside the box, or `beyond` its border (a
    /// share of its sides).
    std::optional<Root> newton(const Box& box, double beyond) const
    {
        constexpr int kSteps = 16;
        constexpr double kSettled = 4e-16, kRim = 1e-14; // of the patch's parameters
        double at[2] = {box.lo[0] + 0.5 * box.size[0], box.lo[1] + 0.5 * box.size[1]};
        double last = std::numeric_limits<double>::infinity();
        for (int step = 0; step < kSteps; ++step) {
            const SurfacePoint s =
                patch_.evaluate(patch_.lo_[0] + patch_.size_[0] * at[0], patch_.lo_[1] + patch_.size_[1] * at[1]);
            const Vec3 r = s.p - ray_.origin;
            const double a = dot(n1_, r), b = dot(n2_, r);
            const double au = dot(n1_, s.du) * patch_.size_[0], av = dot(n1_, s.dv) * patch_.size_[1];
            const double bu = dot(n2_, s.du) * patch_.size_[0], bv = dot(n2_, s.dv) * patch_.size_[1];
            const double det = au * bv - av * bu;
            if (det == 0)
                return std::nullopt;
            const double du = (bv * a - av * b) / det, dv = (au * b - bu * a) / det;
            at[0] -= du;
            at[1] -= dv;
            const double size = std::max(std::abs(du), std::abs(dv));
            for (size_t i = 0; i < 2; ++i)
                if (!(std::abs(at[i] - box.lo[i] - 0.5 * box.size[i]) <= (1 + 2 * beyond) * box.size[i] + kRim))
                    return std::nullopt; // far outside of the box
            // rounding stops it, not the number of steps
            if (size <= kSettled || (size >= 0.5 * last && size <= 1e-9))
                return inside(box, at, beyond, kRim) ? std::optional(root_at(at, !box.one_root)) : std::nullopt;
            last = size;
        }
        return std::nullopt;
    }

    static bool inside(const Box& box, const double at[2], double beyond, double rim)
    {
        for (size_t i = 0; i < 2; ++i) {
            const double margin = std::min(beyond * box.size[i], 1e-6) + rim;
            if (!(at[i] >= std::max(box.lo[i] - margin, -rim) &&
                  at[i] <= std::min(box.lo[i] + box.size[i] + margin, 1 + rim)))
                return false;
        }
        return true;
    }

    /// at: parameters of the whole net.
    Root root_at(const double at[2], bool contact) const
    {
        Root root;
        root.u = patch_.lo_[0] + patch_.size_[0] * std::clamp(at[0], 0.0, 1.0);
        root.v = patch_.lo_[1] + patch_.size_[1] * std::clamp(at[1], 0.0, 1.0);
        root.t = dot(along_, patch_.evaluate(root.u, root.v).p - ray_.origin) / speed_;
        root.contact = contact;
        return root;
    }

    void offer(const Root& root)
    {
        if (root.t >= t_lo_ && root.t <= t_hi_)
            t_hi_ = std::min(t_hi_, take_(root));
    }

    /// A root in the box or beside it, if Newton's iteration finds one; else the corner that comes first along the
    /// line, or the middle of a box with one root.
    void offer_contact(const Box& box)
    {
        if (const std::optional<Root> root = newton(box, 1)) {
            offer(*root);
            return;
        }
        const double middle[2] = {box.lo[0] + 0.5 * box.size[0], box.lo[1] + 0.5 * box.size[1]};
        Root root = root_at(middle, !box.one_root);
        for (int corner = 0; corner < 4 && !box.one_root; ++corner) {
            const double at[2] = {box.lo[0] + (corner & 1) * box.size[0], box.lo[1] + (corner >> 1) * box.size[1]};
            const Root other = root_at(at, true);
            if (other.t < root.t)
                root = other;
        }
        offer(root);
    }

    /// `kept`, or more of a box that may hold two roots: they lie on a curve that bends by the square of its length, so
    /// a box much thinner than that shows nothing new, and rounding would hide its slopes.
    static Interval not_too_thin(const Interval& kept, double length, double across)
    {
        const double least = std::min(across * across / 16, length) / length;
        if (!(kept.size() < least))
            return kept;
        const double lo = std::clamp(0.5 * (kept.lo + kept.hi - least), 0.0, 1 - least);
        return {lo, lo + least};
    }

    void halve(const Box& box)
    {
        constexpr double kLeast = 4e-16; // of the patch's parameters: a box cannot be halved any more
        const std::array<double, 2> length = lengths(box);
        int axis = length[0] >= length[1] ? 0 : 1;
        if (box.size[axis] <= kLeast)
            axis = 1 - axis;
        if (box.size[axis] <= kLeast) {
            offer_contact(box);
            return;
        }
        Box first = box, second = box;
        restrict_to(first, axis, {0, 0.5});
        restrict_to(second, axis, {0.5, 1});
        first.near = nearest(first);
        second.near = nearest(second);
        // the nearer one comes off the stack first
        if (first.near < second.near)
            std::swap(first, second);
        stack_.push_back(std::move(first));
        stack_.push_back(std::move(second));
    }

    void search(Box box)
    {
        // Share of a side that clipping leaves, above which the box is halved: of both sides, or, while it may hold two
        // roots that have to be told apart, of either.
        constexpr double kWorthClipping = 0.6;
        while (true) {
            ++end_.boxes;
            if (misses(box) || nearest(box) > t_hi_ || farthest(box) < t_lo_)
                return;
            const std::array<Combined, 2> straight = straightened(box, reach_);
            box.one_root = box.one_root || holds_one_root(box.net, straight);
            if (box.one_root) {
                if (const std::optional<Root> root = newton(box, 0)) {
                    offer(*root);
                    return;
                }
            }
            const std::array<double, 2> length = lengths(box);
            if (within_rounding(box, length)) {
                offer_contact(box);
                return;
            }
            Interval kept[2];
            for (int axis = 0; axis < 2; ++axis) {
                kept[axis] = clip(box.net, axis, straight[static_cast<size_t>(axis)]);
                for (const Combined& plane : {Combined{1, 0, box.rounding}, Combined{0, 1, box.rounding}})
                    kept[axis] = common(kept[axis], clip(box.net, axis, plane));
                if (kept[axis].empty())
                    return;
            }
            if (!box.one_root) {
                kept[0] = not_too_thin(kept[0], length[0], length[1]);
                kept[1] = not_too_thin(kept[1], length[1], length[0]);
            }
            const double less = std::min(kept[0].size(), kept[1].size());
            const double more = std::max(kept[0].size(), kept[1].size());
            for (int axis = 0; axis < 2; ++axis)
                if (kept[axis].size() < 0.99 && kept[axis].size() > 0)
                    restrict_to(box, axis, kept[axis]);
            if ((box.one_root ? less : more) > kWorthClipping) {
                halve(box);
                return;
            }
        }
    }

    const BezierReference& patch_;
    const Ray ray_;
    double t_lo_, t_hi_, speed_ = 1, reach_ = 0;
    const TakeRoot& take_;
    Vec3 along_, n1_, n2_; // orthonormal
    std::vector<Box> stack_;
    SearchEnd end_;
};

BezierReference::BezierReference(const PatchRecord& patch, const float* control_points, double overlap_u,
                                 double overlap_v)
    : degree_{static_cast<int>(patch.shape >> 8 & 0xffu), static_cast<int>(patch.shape >> 16 & 0xffu)}
{
    assert(overlap_u >= 0 && overlap_u <= kMostPatchSlack && overlap_v >= 0 && overlap_v <= kMostPatchSlack);
    const bool rational = (patch.shape & kShapeRational) != 0;
    const size_t count = static_cast<size_t>(degree_[0] + 1) * static_cast<size_t>(degree_[1] + 1);
    const float* c = control_points + patch.first_control_point;
    Net net{{degree_[0], degree_[1]}, {}};
    for (size_t i = 0; i < count; ++i) {
        net.points.push_back({c[0], c[1], c[2], rational ? double(c[3]) : 1.0});
        c += rational ? 4 : 3;
    }
    net_ = net.points;
    const double overlap[2] = {overlap_u, overlap_v};
    for (int axis = 0; axis < 2; ++axis) {
        keep_left(net, axis, 1 + overlap[axis]);
        keep_right(net, axis, -overlap[axis] / (1 + overlap[axis]));
    }
    if (std::all_of(net.points.begin(), net.points.end(), [](const Point& p) { return p[3] > 0; })) {
        net_ = std::move(net.points);
        for (int axis = 0; axis < 2; ++axis) {
            lo_[axis] = -overlap[axis];
            size_[axis] = 1 + 2 * overlap[axis];
        }
    }
    for (const Point& p : net_)
        reach_ = std::max(reach_, length(Vec3{p[0], p[1], p[2]}) / p[3]);
}

SearchEnd BezierReference::intersect(const Ray& ray, double t_lo, double t_hi, const TakeRoot& take) const
{
    return PatchSearch(*this, ray, t_lo, t_hi, take).run();
}

SurfacePoint BezierReference::evaluate(double u, double v) const
{
    // de Casteljau along v and then along u, each down to the last two points: value and derivative
    const double s[2] = {(u - lo_[0]) / size_[0], (v - lo_[1]) / size_[1]};
    const auto last_two = [](Point* c, int n, double at) {
        for (int k = 1; k < n; ++k)
            for (int i = 0; i <= n - k; ++i)
                c[i] = lerp(c[i], c[i + 1], at);
    };
    Point row[kMaxDegree + 1], value[kMaxDegree + 1], slope_v[kMaxDegree + 1];
    const int p = degree_[0], q = degree_[1];
    for (int i = 0; i <= p; ++i) {
        std::copy_n(&net_[static_cast<size_t>(i) * static_cast<size_t>(q + 1)], q + 1, row);
        last_two(row, q, s[1]);
        value[i] = lerp(row[0], row[1], s[1]);
        for (size_t k = 0; k < 4; ++k)
            slope_v[i][k] = q * (row[1][k] - row[0][k]);
    }
    last_two(value, p, s[0]);
    last_two(slope_v, p, s[0]);
    const Point at = lerp(value[0], value[1], s[0]), along_v = lerp(slope_v[0], slope_v[1], s[0]);
    Point along_u;
    for (size_t k = 0; k < 4; ++k)
        along_u[k] = p * (value[1][k] - value[0][k]);
    // S = N / w, S' = (N' - w' S) / w
    SurfacePoint out;
    for (size_t k = 0; k < 3; ++k) {
        out.p[k] = at[k] / at[3];
        out.du[k] = (along_u[k] - along_u[3] * out.p[k]) / at[3] / size_[0];
        out.dv[k] = (along_v[k] - along_v[3] * out.p[k]) / at[3] / size_[1];
    }
    return out;
}

Vec3 BezierReference::normal(double u, double v) const
{
    // Below this share of the net's size a derivative, and below this sine the angle between both, loses more than
    // 1e-8 of its direction to rounding. So far inside, the normal of a surface whose curvature is within the patch's
    // size differs from the limit by no more than kInwards.
    constexpr double kVanishing = 1e-8, kInwards = 1e-6;
    const Bounds box = bounds();
    const double size = length(box.hi - box.lo);
    for (const double inwards : {0.0, kInwards, 1e-3}) {
        const SurfacePoint s = evaluate(u + inwards * (0.5 - u), v + inwards * (0.5 - v));
        const Vec3 n = cross(s.du, s.dv);
        const double lu = length(s.du), lv = length(s.dv), ln = length(n);
        if (std::min(lu, lv) > kVanishing * size && ln > kVanishing * lu * lv)
            return n * (1 / ln);
    }
    return {};
}

Bounds BezierReference::bounds() const
{
    Bounds box;
    for (const Point& p : net_)
        box.add(Vec3{p[0], p[1], p[2]} * (1 / p[3]));
    return box;
}

} // namespace trimray::reference
