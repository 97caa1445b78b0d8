// Closed solids made with the CAD kernel, written as BREP.
#pragma once

#include <array>
#include <string>

namespace trimray::oracle {

enum class Solid {
    Box,
    RoundedBox,      // all edges filleted: spheres and cylinders that meet with one tangent plane
    DrilledCylinder, // a through hole across, two blind holes
    SphereAndTorus,  // fused
    RevolvedSpline,
    Loft, // splines through sections
};
inline constexpr Solid kSolids[] = {
    Solid::Box, Solid::RoundedBox, Solid::DrilledCylinder, Solid::SphereAndTorus, Solid::RevolvedSpline, Solid::Loft};
const char* solid_name(Solid solid);

/// One solid, about 100 mm in size, along no axis. False: not made, or not valid and closed by the kernel's own check.
bool write_closed_solid(Solid solid, const std::string& path);

/// Where a solid lies in a file, how large it is there, and how the file says so.
struct Layout {
    double scale = 1; // about the origin, before it is moved
    std::array<double, 3> shift_mm{};
    bool placed = false;     // moved by a placement of the solid, whose own coordinates stay as they were
    const char* unit = "MM"; // of a STEP file: "MM", "M", "INCH", "KM", "UM"
};

/// The solid of write_closed_solid, laid out so; as STEP where the path ends in .step, else as binary BREP, which keeps
/// every bit of a number. False: not made.
bool write_laid_out(Solid solid, const Layout& layout, const std::string& path);

/// A surface that closes on itself, as a face of its own about the origin, its axis z and its seam at +x: a sphere of
/// radius 20, a torus of radii 30 and 8, or a cylinder of radius 20 from z = -15 to 15.
enum class ClosedFace {
    Sphere, // a loop of its seam and two poles
    SphereSeamOnly,
    Torus,           // a loop of both its seams
    TorusSeamAlongV, // a loop of the seam at constant u; the other is in no loop
    TorusSeamAlongU, // the other way round
    Cylinder,        // a loop of its seam and two circles
};

/// False: not made.
bool write_closed_face(ClosedFace face, const std::string& path);

/// A cylinder of radius 20 and height 60 around z, with a hole of radius 8 drilled through its wall along x; its seam
/// is turned by `turn` radians from the hole. False: not made.
bool write_drilled_seam(double turn, const std::string& path);

/// A cylinder of radius 20 around z from 0 to 60, its seam 2 radians from +x, with a slot milled into its wall: a box
/// of 10 by 30 mm about (x, 0, 30), from x = 10 outwards, turned by kSlotTurn about x, the long side along z where that
/// is 0. False: not made.
inline constexpr double kSlotTurn = 0.5, kSlotSeam = 2;
bool write_slotted_cylinder(const std::string& path);

/// What is wrong with the orientation of a solid.
enum class Flip {
    None,
    OneFace, // the first face points inwards
    Faces,   // all faces do: the solid is inside out
    Solid,   // the faces point outwards, but the solid that holds them is reversed
};

/// A solid of write_closed_solid with its faces turned so, in the same order. False: not made.
bool write_flipped(Solid solid, Flip flip, const std::string& path);

} // namespace trimray::oracle
