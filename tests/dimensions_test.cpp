// Measurements of and between picked places against closed forms, and how they read.
#include "runtime/view/dimensions.h"

#include "tests/dimension_checks.h"
#include "tests/traced_scenes.h"

#include <gtest/gtest.h>

namespace trimray {
namespace {

using reference::cross;
using reference::dot;
using reference::length;
using reference::Vec3;
using reference::operator+;
using reference::operator-;
using reference::operator*;

/// Turns a native patch: its z axis along `z`, its x axis along `x`. Unit, at right angles.
void turn(PatchRecord& patch, const Vec3& x, const Vec3& z)
{
    const Vec3 y = cross(z, x);
    for (size_t i = 0; i < 3; ++i) {
        patch.axis_x[i] = float(x[i]);
        patch.axis_y[i] = float(y[i]);
        patch.axis_z[i] = float(z[i]);
    }
}

// ---- between two places --------------------------------------------------------------------------------------------

/// Two faces of a scene, placed once, picked at uv_file a and b.
std::vector<Dimension> between(TracedScene& scene, const UvPoint& a, const UvPoint& b)
{
    const auto whole = scene.finish();
    const PackImage& image = whole->pack.image;
    return dimensions_between(surface_facts(image, {0, 0, a, {}}), surface_facts(image, {1, 0, b, {}}));
}

TEST(dimensions, parallel_planes_have_a_distance_wherever_they_are_picked)
{
    TracedScene scene;
    scene.add(kKindPlane, 1, {0, 0, 0.2}, {1, 1});
    scene.add(kKindPlane, 1, {0.3, 0, -0.2}, {1, 1});
    scene.image.faces[1].flags |= kFaceReversed;
    const auto found = between(scene, {0.5, 0.25}, {-0.5, 0});
    EXPECT_DIMENSION(found, PlaneDistance, 4, kRounded_mm);
    EXPECT_DIMENSION(found, PlaneAngle, 0, 1e-5);
    EXPECT_DIMENSION(found, DistanceX, -7, kRounded_mm); // 3 - 5 - 5
    EXPECT_DIMENSION(found, DistanceY, -2.5, kRounded_mm);
    EXPECT_DIMENSION(found, DistanceZ, -4, kRounded_mm);
    EXPECT_DIMENSION(found, Distance, std::sqrt(49 + 6.25 + 16), kRounded_mm);
    EXPECT_EQ(found.front().kind, DimensionKind::Distance);
    EXPECT_NO_DIMENSION(found, PlanePointDistance);
    for (const auto kind : {DimensionKind::Distance, DimensionKind::DistanceX, DimensionKind::DistanceY,
                            DimensionKind::DistanceZ, DimensionKind::PlaneDistance})
        expect_anchored(find(found, kind));
}

TEST(dimensions, the_parts_of_a_distance_are_drawn_one_after_another)
{
    TracedScene scene;
    scene.add(kKindPlane, 1, {0, 0, 0.2}, {1, 1});
    scene.add(kKindPlane, 1, {0.3, 0, -0.2}, {1, 1});
    const auto found = between(scene, {0.5, 0.25}, {-0.5, 0});
    Vec3 at = found[0].anchors_mm[0];
    for (size_t i = 1; i < 4; ++i) {
        EXPECT_EQ(found[i].anchors_mm[0], at);
        at = found[i].anchors_mm[1];
    }
    EXPECT_EQ(at, found[0].anchors_mm[1]);
}

TEST(dimensions, planes_at_an_angle_have_no_distance)
{
    for (const double degrees : {0.01, 30.0, 90.0, 150.0}) {
        TracedScene scene;
        const double a = degrees * kPi / 180;
        scene.add(kKindPlane, 1, {0, 0, 0}, {1, 1});
        turn(scene.add(kKindPlane, 1, {0, 0, 0.5}, {1, 1}), {1, 0, 0}, {0, -std::sin(a), std::cos(a)});
        const auto found = between(scene, {0, 0}, {0, 0});
        EXPECT_DIMENSION(found, PlaneAngle, std::min(degrees, 180 - degrees), 1e-5);
        EXPECT_NO_DIMENSION(found, PlaneDistance);
    }
}

TEST(dimensions, a_plane_and_an_axis_along_it_have_a_distance)
{
    TracedScene scene;
    turn(scene.add(kKindPlane, 1, {0.7, 0, 0}, {1, 1}), {0, 1, 0}, {1, 0, 0});
    scene.add(kKindCylinder, 0.2, {0.1, 0.3, 0}, {kPi, 2});
    const auto found = between(scene, {0, 0}, {1, 0.5});
    EXPECT_DIMENSION(found, PlaneAxisAngle, 0, 1e-5);
    EXPECT_DIMENSION(found, PlaneAxisDistance, 6, kRounded_mm);
    EXPECT_DIMENSION(found, PlanePointDistance, 6 - 2 * std::cos(1.0), kRounded_mm);
    expect_anchored(find(found, DimensionKind::PlaneAxisDistance));
    expect_anchored(find(found, DimensionKind::PlanePointDistance));
    // and asked the other way round
    const auto whole = scene.finish();
    const PackImage& image = whole->pack.image;
    const auto turned =
        dimensions_between(surface_facts(image, {1, 0, {1, 0.5}, {}}), surface_facts(image, {0, 0, {}, {}}));
    EXPECT_DIMENSION(turned, PlaneAxisDistance, 6, kRounded_mm);
}

TEST(dimensions, a_plane_across_an_axis_has_the_angle_alone)
{
    TracedScene scene;
    scene.add(kKindPlane, 1, {0, 0, 0}, {1, 1});
    turn(scene.add(kKindCylinder, 0.2, {0, 0, 0}, {kPi, 2}), {0, 1, 0}, {0.6, 0, 0.8});
    const auto found = between(scene, {0, 0}, {0, 0});
    EXPECT_DIMENSION(found, PlaneAxisAngle, std::asin(0.8) * 180 / kPi, 1e-5);
    EXPECT_NO_DIMENSION(found, PlaneAxisDistance);
}

TEST(dimensions, parallel_and_skew_axes_have_their_shortest_distance)
{
    TracedScene parallel;
    parallel.add(kKindCylinder, 0.1, {0, 0, 0}, {kPi, 2});
    parallel.add(kKindCylinder, 0.2, {0.3, 0.4, 0.2}, {kPi, 2});
    const auto beside = between(parallel, {0, 0}, {2, 1});
    EXPECT_DIMENSION(beside, AxisAngle, 0, 1e-5);
    EXPECT_DIMENSION(beside, AxisDistance, 5, kRounded_mm);
    expect_anchored(find(beside, DimensionKind::AxisDistance));
    EXPECT_NO_DIMENSION(beside, EqualDiameter);

    TracedScene skew;
    skew.add(kKindCylinder, 0.1, {0, 0, 0}, {kPi, 2});
    turn(skew.add(kKindCone, 0.2, {0.2, 0.5, 0.3}, {kPi, 1}), {0, 1, 0}, {0.8, 0, 0.6});
    const auto across = between(skew, {0, 0}, {2, 1});
    EXPECT_DIMENSION(across, AxisAngle, std::acos(0.6) * 180 / kPi, 1e-5);
    EXPECT_DIMENSION(across, AxisDistance, 5, kRounded_mm);
    const auto feet = find(across, DimensionKind::AxisDistance);
    expect_anchored(feet);
    // (0, 0, z) and (2, 5, 3) + t (0.8, 0, 0.6) with x = 0: t = -2.5, z = 1.5
    EXPECT_LE(length(feet->anchors_mm[0] - Vec3{0, 0, 1.5}), kRounded_mm);
    EXPECT_LE(length(feet->anchors_mm[1] - Vec3{0, 5, 1.5}), kRounded_mm);
}

TEST(dimensions, a_point_is_measured_from_an_axis_and_centres_from_each_other)
{
    TracedScene scene;
    scene.add(kKindCylinder, 0.1, {0, 0, 0}, {kPi, 2});
    scene.add(kKindSphere, 0.2, {0.3, 0.4, 0.2}, {kPi, kPi / 2});
    const auto found = between(scene, {0, 0}, {0, 0}); // the ball's point (5, 4, 2)
    EXPECT_DIMENSION(found, AxisPointDistance, std::sqrt(41.0), kRounded_mm);
    EXPECT_NO_DIMENSION(found, AxisDistance);
    EXPECT_NO_DIMENSION(found, CentreDistance);

    TracedScene balls;
    balls.add(kKindTorus, 0.2, {0, 0, 0}, {kPi, kPi}).param[1] = 0.25f;
    balls.add(kKindSphere, 0.2, {0.3, 0.4, 1.2}, {kPi, kPi / 2});
    EXPECT_DIMENSION(between(balls, {1, 1}, {2, 1}), CentreDistance, 13, kRounded_mm);
}

TEST(dimensions, equal_diameters_are_told_through_mirrors_and_scales)
{
    TracedScene scene;
    scene.add(kKindCylinder, 0.2, {0, 0, 0}, {kPi, 2});
    scene.add(kKindSphere, 0.4, {0, 0, 0}, {kPi, kPi / 2});
    scene.place(kWhereItIs);
    scene.place({-1, 0, 0, 9, 0, 1, 0, 0, 0, 0, 1, 0});
    scene.place({0, -2, 0, 30, 2, 0, 0, 0, 0, 0, 2, 0});
    scene.place({2, 0, 0, 30, 0, 1, 0, 0, 0, 0, 2, 0});
    const auto whole = scene.finish();
    const auto facts = [&](uint face, uint instance) {
        return surface_facts(whole->pack.image, {face, instance, {0.5, 0.5}, {}});
    };
    EXPECT_DIMENSION(dimensions_between(facts(0, 0), facts(0, 1)), EqualDiameter, 4, kRounded_mm);
    EXPECT_DIMENSION(dimensions_between(facts(1, 1), facts(0, 2)), EqualDiameter, 8, kRounded_mm);
    EXPECT_NO_DIMENSION(dimensions_between(facts(0, 0), facts(0, 2)), EqualDiameter);
    EXPECT_NO_DIMENSION(dimensions_between(facts(0, 0), facts(0, 3)), EqualDiameter);
    EXPECT_DIMENSION(dimensions_of(facts(0, 2)), Diameter, 8, kRounded_mm);
    EXPECT_DIMENSION(dimensions_of(facts(0, 2)), Radius, 4, kRounded_mm);
    expect_anchored(find(dimensions_of(facts(0, 2)), DimensionKind::Diameter));
    EXPECT_NO_DIMENSION(dimensions_of(facts(0, 3)), Radius);
    // an ellipse of half axes 4 and 2 mm where u = 0.5
    const double bent = std::pow(std::hypot(4 * std::sin(0.5), 2 * std::cos(0.5)), 3) / 8;
    EXPECT_DIMENSION(dimensions_of(facts(0, 3)), SmallestRadius, bent, 10 * kRounded_mm);
    EXPECT_NO_DIMENSION(dimensions_of(facts(0, 3)), LargestRadius);
}

TEST(dimensions, a_torus_and_a_cone_have_what_is_theirs)
{
    TracedScene scene;
    scene.add(kKindTorus, 0.5, {0, 0, 0}, {kPi, kPi}).param[1] = 0.25f;
    scene.add(kKindCone, 0.2, {0, 0, 0}, {kPi, 1}).param[1] = -0.5f;
    const auto whole = scene.finish();
    const auto ring = dimensions_of(surface_facts(whole->pack.image, {0, 0, {1, 2}, {}}));
    EXPECT_DIMENSION(ring, Radius, 5, kRounded_mm);
    EXPECT_DIMENSION(ring, TubeRadius, 1.25, kRounded_mm);
    expect_anchored(find(ring, DimensionKind::TubeRadius));
    const Vec3 middle = find(ring, DimensionKind::TubeRadius)->anchors_mm[0];
    EXPECT_NEAR(std::hypot(middle[0], middle[1]), 5, 1e-5);
    EXPECT_NEAR(middle[2], 0, 1e-5);
    const auto cone = dimensions_of(surface_facts(whole->pack.image, {1, 0, {1, 0.5}, {}}));
    EXPECT_DIMENSION(cone, HalfAngle, std::atan(0.5) * 180 / kPi, 1e-5);
    EXPECT_DIMENSION(cone, Diameter, 4 * (1 - 0.5 * std::sin(std::atan(0.5))), kRounded_mm);
}

// ---- text ----------------------------------------------------------------------------------------------------------

TEST(dimension_text, lengths_read_well_in_every_unit)
{
    EXPECT_EQ(length_text(12.5, LengthUnit::Millimetre), "12.5 mm");
    EXPECT_EQ(length_text(12.500000031, LengthUnit::Millimetre), "12.5 mm");
    EXPECT_EQ(length_text(12.5, LengthUnit::Centimetre), "1.25 cm");
    EXPECT_EQ(length_text(12.5, LengthUnit::Metre), "0.0125 m");
    EXPECT_EQ(length_text(12.5, LengthUnit::Inch), "0.492126 in");
    EXPECT_EQ(length_text(25.4, LengthUnit::Inch), "1 in");
    EXPECT_EQ(length_text(0, LengthUnit::Millimetre), "0 mm");
    EXPECT_EQ(length_text(-1e-9, LengthUnit::Millimetre), "0 mm");
    EXPECT_EQ(length_text(-7, LengthUnit::Millimetre), "-7 mm");
    EXPECT_EQ(length_text(1234.56789, LengthUnit::Millimetre), "1234.568 mm");
    EXPECT_EQ(length_text(123456789.0, LengthUnit::Millimetre), "123456789 mm");
    EXPECT_EQ(length_text(100, LengthUnit::Millimetre), "100 mm");
    EXPECT_EQ(length_text(0.00123456, LengthUnit::Millimetre), "0.0012 mm");
}

TEST(dimension_text, digits_that_are_not_known_are_not_shown)
{
    EXPECT_EQ(length_text(10.00031, LengthUnit::Millimetre, 4e-4), "10 mm");
    EXPECT_EQ(length_text(10.00731, LengthUnit::Millimetre, 4e-4), "10.007 mm");
    EXPECT_EQ(length_text(10.00731, LengthUnit::Millimetre, 2e-3), "10.01 mm");
    EXPECT_EQ(length_text(10.00731, LengthUnit::Metre, 4e-4), "0.010007 m");
    EXPECT_EQ(length_text(1234, LengthUnit::Millimetre, 30), "1234 mm"); // whole numbers stay
    EXPECT_EQ(
        to_text({DimensionKind::EdgeLength, DimensionUnit::Millimetre, 10.00031, 4e-4, {}}, LengthUnit::Millimetre),
        "10 mm");
    EXPECT_EQ(angle_text(29.27323, 0.002), "29.27°");
}

TEST(dimension_text, angles_are_in_degrees_whatever_the_unit_of_lengths)
{
    EXPECT_EQ(angle_text(45), "45°");
    EXPECT_EQ(angle_text(26.565051177), "26.5651°");
    EXPECT_EQ(to_text({DimensionKind::PlaneAngle, DimensionUnit::Degree, 30, 0, {}}, LengthUnit::Inch), "30°");
    EXPECT_EQ(to_text({DimensionKind::Radius, DimensionUnit::Millimetre, 25.4, 0, {}}, LengthUnit::Inch), "1 in");
}

} // namespace
} // namespace trimray
