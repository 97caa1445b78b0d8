// Models of one spline face, for the converter.
#pragma once

#include "preprocess/build_pack.h"
#include "runtime/tracer.h"

#include <memory>

namespace trimray {

/// An untrimmed face over `domain`, whose degrees, knots and control points are still to be given.
inline CadFace spline_face(const Rect2d& domain)
{
    CadFace face;
    face.surface.kind = kKindBezier;
    face.surface.source_kind = "bspline";
    face.surface.natural_bounds = domain;
    return face;
}

/// The face alone, where it is.
inline CadModel model_of(const CadFace& face)
{
    CadModel model;
    model.parts.emplace_back().faces.push_back(face);
    model.instances.emplace_back();
    model.tree.emplace_back();
    return model;
}

inline std::shared_ptr<const Scene> converted(const CadModel& model, BuildReport& report)
{
    auto scene = std::make_shared<Scene>();
    scene->pack.image = build_pack(model, {}, report);
    return scene;
}

} // namespace trimray
