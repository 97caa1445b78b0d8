// A plain binary tree over boxes, in double, for the reference's rays: what it finds is what a loop over all boxes
// would find.
#pragma once

#include "format/reference_math.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace trimray::reference {

class BoxTree {
public:
    BoxTree() = default;
    /// Boxes are grown by far more than a ray's rounding; empty ones are never met.
    explicit BoxTree(std::vector<Bounds> boxes);

    /// Calls visit(index) for each box that the ray meets between t = 0 and the t_hi of then, nearer subtrees first;
    /// what it returns is the new t_hi.
    void walk(const Ray& ray, double t_hi, const std::function<double(uint32_t index)>& visit) const;

    Bounds bounds() const { return nodes_.empty() ? Bounds{} : nodes_[0].box; }

private:
    struct Node {
        Bounds box;
        uint32_t first = 0, count = 0; // a leaf's indices; an inner node (count 0): children first and first + 1
    };
    void split(uint32_t node, uint32_t first, uint32_t count);

    std::vector<Bounds> boxes_;
    std::vector<uint32_t> order_;
    std::vector<Node> nodes_;
};

} // namespace trimray::reference
