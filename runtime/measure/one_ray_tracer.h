// The paper's shape of tracer, to measure ours against: one ray at a time in scalar code, Newton from the middle of
// each leaf, trims by kd-trees. Nodes and leaves are unpacked at load, and loops over control points compiled for the
// degrees that models are made of. It is compiled for the same processors as all that is not in lanes; for the one that
// it ran on (-march=native) it was 5 to 7 % faster.
// Source: Kunts et al., the base method; Sloup & Havran, "Optimizing Ray Tracing of Trimmed NURBS Surfaces on the GPU",
// CGF 2021.
#pragma once

#include "runtime/tracer.h"

#include <memory>

namespace trimray {

/// Its pictures are those of the CPU tracer with ClosestPolicy::Stochastic and TrimMode::Kd, but for rounding; the
/// paper's own setting is a pack of Bezier patches with one leaf each. Its render fails: Usage, for
/// ClosestPolicy::Certified, for trim modes other than auto (here kd) and kd, and for lines and smoothed borders;
/// UnsupportedFormat, for lights, materials, maps, sections and environments; as derive_kd.
std::unique_ptr<Tracer> make_one_ray_tracer(std::shared_ptr<const Scene> scene);

} // namespace trimray
