#include "format/box_tree.h"

#include <numeric>
#include <utility>

namespace trimray::reference {
namespace {

constexpr uint32_t kMostInLeaf = 2;

/// Where the ray enters the box, at least 0; infinity where it does not meet it before t_hi.
double entry(const Bounds& box, const Ray& ray, double t_hi)
{
    double near = 0, far = t_hi;
    for (size_t i = 0; i < 3; ++i) {
        const double a = box.lo[i] - ray.origin[i], b = box.hi[i] - ray.origin[i], d = ray.direction[i];
        if (d == 0) {
            if (a > 0 || b < 0)
                return std::numeric_limits<double>::infinity();
            continue;
        }
        near = std::max(near, std::min(a / d, b / d));
        far = std::min(far, std::max(a / d, b / d));
    }
    return near <= far ? near : std::numeric_limits<double>::infinity();
}

} // namespace

BoxTree::BoxTree(std::vector<Bounds> boxes) : boxes_(std::move(boxes))
{
    constexpr double kGrowth = 1e-9; // of the box and of its distance from the origin
    constexpr double kFar = 1e100;   // a box that is not finite is everywhere
    for (Bounds& box : boxes_) {
        if (box.empty())
            continue;
        for (size_t i = 0; i < 3; ++i) {
            const bool finite = std::isfinite(box.lo[i]) && std::isfinite(box.hi[i]);
            box.lo[i] = finite ? box.lo[i] : -kFar;
            box.hi[i] = finite ? box.hi[i] : kFar;
        }
        double reach = 0;
        for (size_t i = 0; i < 3; ++i)
            reach = std::max({reach, std::abs(box.lo[i]), std::abs(box.hi[i])});
        for (size_t i = 0; i < 3; ++i) {
            box.lo[i] -= kGrowth * reach;
            box.hi[i] += kGrowth * reach;
        }
    }
    for (uint32_t i = 0; i < boxes_.size(); ++i)
        if (!boxes_[i].empty())
            order_.push_back(i);
    if (order_.empty())
        return;
    nodes_.emplace_back();
    split(0, 0, static_cast<uint32_t>(order_.size()));
}

void BoxTree::split(uint32_t node, uint32_t first, uint32_t count)
{
    Bounds box, middles;
    for (uint32_t i = first; i < first + count; ++i) {
        const Bounds& b = boxes_[order_[i]];
        box.add(b.lo);
        box.add(b.hi);
        middles.add((b.lo + b.hi) * 0.5);
    }
    nodes_[node].box = box;
    if (count <= kMostInLeaf) {
        nodes_[node].first = first;
        nodes_[node].count = count;
        return;
    }
    const Vec3 extent = middles.hi - middles.lo;
    const auto axis = static_cast<size_t>(std::max_element(extent.begin(), extent.end()) - extent.begin());
    const auto begin = order_.begin() + first;
    std::nth_element(begin, begin + count / 2, begin + count, [&](uint32_t a, uint32_t b) {
        const double at_a = boxes_[a].lo[axis] + boxes_[a].hi[axis], at_b = boxes_[b].lo[axis] + boxes_[b].hi[axis];
        return at_a != at_b ? at_a < at_b : a < b;
    });
    const auto children = static_cast<uint32_t>(nodes_.size());
    nodes_[node].first = children;
    nodes_.resize(nodes_.size() + 2);
    split(children, first, count / 2);
    split(children + 1, first + count / 2, count - count / 2);
}

void BoxTree::walk(const Ray& ray, double t_hi, const std::function<double(uint32_t index)>& visit) const
{
    if (nodes_.empty())
        return;
    std::vector<std::pair<double, uint32_t>> stack{{entry(nodes_[0].box, ray, t_hi), 0}};
    while (!stack.empty()) {
        const auto [at, index] = stack.back();
        stack.pop_back();
        if (!(at <= t_hi) || at == std::numeric_limits<double>::infinity())
            continue;
        const Node& node = nodes_[index];
        for (uint32_t i = node.first; i < node.first + node.count; ++i)
            if (entry(boxes_[order_[i]], ray, t_hi) < std::numeric_limits<double>::infinity())
                t_hi = visit(order_[i]);
        if (node.count > 0)
            continue;
        std::pair<double, uint32_t> near{entry(nodes_[node.first].box, ray, t_hi), node.first};
        std::pair<double, uint32_t> far{entry(nodes_[node.first + 1].box, ray, t_hi), node.first + 1};
        if (far < near)
            std::swap(near, far);
        stack.push_back(far);
        stack.push_back(near);
    }
}

} // namespace trimray::reference
