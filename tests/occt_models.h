// Models that real files rarely bring in a small and free one: made with the CAD kernel when a test runs, written as
// BREP, which keeps left-handed axis systems and mirrored placements that STEP cannot hold.
#pragma once

#include <string>
#include <vector>

namespace trimray::oracle {

/// Extrusion of a spline, revolution of a spline, offset of a spline surface, each trimmed by a hole. False: not
/// written.
bool write_swept_model(const std::string& path);

/// One face of every kind of surface that a BREP file can hold, with the kind its report should say; faces stand 30 mm
/// apart, kKindsPerRow in a row along x, rows along y, each within 14 mm of its place.
inline constexpr int kKindsPerRow = 8;
inline constexpr double kKindStep_mm = 30;
struct KindOfFace {
    const char* name; // of the surface, or of the curve that is swept, and offset where that is the kind
    const char* source_kind;
};
std::vector<KindOfFace> kinds_of_faces();

/// False: not written.
bool write_every_kind(const std::string& path);

/// A frustum so flat that its two nappes lie within single precision of each other. False: not written.
bool write_flat_cone(const std::string& path);

/// The faces of a file, copied as their mirror image in the plane x = 0: quadrics get left-handed axis systems.
bool write_left_handed_copy(const std::string& from, const std::string& path);

/// One shape of a file, placed three times: as it is, turned and moved, and mirrored.
bool write_placed_copies(const std::string& from, const std::string& path);

/// Six faces, each a piece of a surface that has no end: a plane, a cylinder, a cone, an extrusion, and the offsets of
/// a plane and of an extrusion. They lie between (-15, -15, 0) and (115, 15, 20). False: not written.
bool write_pieces_of_endless_surfaces(const std::string& path);

/// A square face, a whole plane, a whole cylinder, a whole extrusion, half a plane, and the plane that bounds half of
/// space: none but the first has an end, so nothing can show them.
bool write_endless_faces(const std::string& path);

/// One shape of a file in a compound, at its own place and a second file's worth away at `scale` times its size.
bool write_scaled_neighbour(const std::string& from, const std::string& other, double scale, const std::string& path);

/// One of the shapes below by its name, some 10 mm large, as IGES with loose faces where the path
/// ends in .igs, else as BREP. False: no such shape, or not written.
///   "box", "rounded box" (all edges), "cylinder", "cone", "sphere"
///   "tube"            a cylinder's side alone
///   "creased tube"    the side of a drop-shaped cylinder, whose surface closes at the drop's tip
///   "half tubes"      two halves of a tube with common edges
///   "three sheets"    three squares at one common edge
///   "touching boxes"  two boxes side by side in a compound, with nothing in common
bool write_solid(const std::string& name, const std::string& path);

/// A cylinder of radius 5 about z, from z = 0 up to the plane z = 5 + x / 2, whose rim (5 cos s, 5 sin s, 5 + 2.5 cos
/// s) has been tampered with: its pcurve on the cylinder is moved by `shift_u` radians, and its curve in space is the
/// ellipse with both half axes longer by `growth_mm`. False: not written.
bool write_slanted_cylinder(double shift_u, double growth_mm, const std::string& path);

} // namespace trimray::oracle
