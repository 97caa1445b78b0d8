// The oracle's insides, shared by its casting and its explaining halves. Only occt_oracle*.cpp include it.
#pragma once

#include "tests/occt_oracle.h"

#include <IntCurvesFace_Intersector.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shape.hxx>
#include <gp_Trsf.hxx>
#include <tbb/enumerable_thread_specific.h>

#include <functional>

namespace trimray::oracle {

/// A padded box in world mm.
struct Box {
    Point lo{1e300, 1e300, 1e300}, hi{-1e300, -1e300, -1e300};
};

/// A face as it stands in the world: one of the unique faces under a location.
struct PlacedFace {
    uint32_t unique = 0;
    gp_Trsf to_world, to_local;
    double local_scale = 1; // local length of a world millimetre
    Box box;
};

/// Box tree: inner nodes have two children one after the other, leaves a range of `order`.
struct TreeNode {
    Box box;
    uint32_t first = 0, count = 0; // count 0: inner, children at first and first + 1
};

struct Oracle::Impl {
    OracleOptions options;
    std::vector<TopoDS_Face> unique; // without locations
    std::vector<PlacedFace> placed;
    std::vector<uint32_t> order;
    std::vector<TreeNode> nodes;
    Box bounds;

    // The kernel's intersectors keep state: each thread has its own, made when first needed.
    using Intersectors = std::vector<std::unique_ptr<IntCurvesFace_Intersector>>;
    mutable tbb::enumerable_thread_specific<Intersectors> intersectors;

    void gather_faces(const TopoDS_Shape& shape);
    void build_tree();
    OracleHit closest(const Ray& ray) const;
    /// Placed faces whose padded boxes come within `margin` of the point.
    std::vector<uint32_t> faces_around(const Point& p, double margin) const;
};

double diagonal(const Box& box);

/// STEP, IGES or BREP by the file's name, in mm. Null and a reason in `error` where the kernel cannot.
TopoDS_Shape read_shape(const std::string& path, std::string& error);

} // namespace trimray::oracle
