// Facts of picked places against closed forms, the reference for closest hits and slow sums of single patches.
#include "runtime/view/surface_facts.h"

#include "format/closest_reference.h"
#include "format/record_surface.h"
#include "runtime/reference_rays.h"
#include "tests/traced_file.h"
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

constexpr double kPi = std::numbers::pi;
constexpr double kPart_mm = 20; // the size of TracedScene's part

using Placement = std::array<double, 12>;

/// A turn by 0.7 about (1, 2, 2) / 3, scaled, perhaps mirrored, moved far off.
Placement turned_placement(double scale, bool mirrored)
{
    const Vec3 k{1.0 / 3, 2.0 / 3, 2.0 / 3};
    Placement m{};
    for (size_t c = 0; c < 3; ++c) {
        Vec3 e{};
        e[c] = mirrored && c == 0 ? -scale : scale;
        // Rodrigues
        const Vec3 turned = e * std::cos(0.7) + cross(k, e) * std::sin(0.7) + k * (dot(k, e) * (1 - std::cos(0.7)));
        for (size_t r = 0; r < 3; ++r)
            m[4 * r + c] = turned[r];
    }
    m[3] = 100, m[7] = -250, m[11] = 40;
    return m;
}

Vec3 turned(const Placement& m, const Vec3& d)
{
    return {m[0] * d[0] + m[1] * d[1] + m[2] * d[2], m[4] * d[0] + m[5] * d[1] + m[6] * d[2],
            m[8] * d[0] + m[9] * d[1] + m[10] * d[2]};
}
Vec3 placed(const Placement& m, const Vec3& p)
{
    return turned(m, p) + Vec3{m[3], m[7], m[11]};
}

/// Scenes of one face placed once, and the facts of a place on it.
SurfaceFacts facts_of(TracedScene& scene, const Placement& placement, const UvPoint& uv_file)
{
    scene.place(placement);
    const auto whole = scene.finish();
    return surface_facts(whole->pack.image, {0, 0, uv_file, {}});
}

void expect_near(const Vec3& a, const Vec3& b, double within)
{
    EXPECT_LE(length(a - b), within) << a[0] << " " << a[1] << " " << a[2] << " instead of " << b[0] << " " << b[1]
                                     << " " << b[2];
}

constexpr double kRounded = 3e-7; // relative, of what single precision keeps

class Placed : public testing::TestWithParam<std::tuple<double, bool>> {
protected:
    double scale() const { return std::get<0>(GetParam()); }
    Placement placement() const { return turned_placement(scale(), std::get<1>(GetParam())); }
    double tolerance() const { return kRounded * kPart_mm * scale(); }
};
INSTANTIATE_TEST_SUITE_P(surface_facts, Placed, testing::Combine(testing::Values(1.0, 2.5, 1e-3), testing::Bool()));

TEST_P(Placed, a_cylinder_has_its_radius_axis_and_normal)
{
    TracedScene scene;
    scene.add(kKindCylinder, 0.25, {0.1, 0.2, 0.3}, {kPi, 2}); // 2.5 mm, uv_file in patch units
    const SurfaceFacts facts = facts_of(scene, placement(), {0.5, 1.25});
    EXPECT_STREQ(facts.kind_name, "cylinder");
    ASSERT_TRUE(facts.radius_mm && facts.axis);
    EXPECT_NEAR(*facts.radius_mm, 2.5 * scale(), tolerance());
    const Vec3 out{std::cos(0.5), std::sin(0.5), 0}, foot{1, 2, 3 + 1.25 * 2.5};
    expect_near(facts.point_mm, placed(placement(), foot + out * 2.5), tolerance());
    expect_near(facts.axis->point, placed(placement(), foot), tolerance());
    expect_near(cross(facts.axis->direction, turned(placement(), {0, 0, 1 / scale()})), {}, 1e-6);
    expect_near(facts.normal, turned(placement(), out * (1 / scale())), 1e-6);
    ASSERT_TRUE(facts.curvatures);
    EXPECT_NEAR(facts.curvatures->larger * 2.5 * scale(), 1, 1e-6);
    EXPECT_NEAR(facts.curvatures->smaller * 2.5 * scale(), 0, 1e-6);
    EXPECT_FALSE(facts.half_angle_deg || facts.tube_radius_mm || facts.centre_mm);
}

TEST_P(Placed, a_cone_has_its_radius_at_the_point_and_its_half_angle)
{
    TracedScene scene;
    scene.add(kKindCone, 0.25, {0, 0, 0}, {kPi, 1.5}).param[1] = -0.5f;
    const SurfaceFacts facts = facts_of(scene, placement(), {-1, 0.75});
    const double half = std::atan(0.5);
    ASSERT_TRUE(facts.radius_mm && facts.axis && facts.half_angle_deg);
    EXPECT_NEAR(*facts.half_angle_deg, half * 180 / kPi, 1e-5);
    EXPECT_NEAR(*facts.radius_mm, 2.5 * (1 - 0.75 * std::sin(half)) * scale(), tolerance());
    expect_near(facts.axis->point, placed(placement(), {0, 0, 2.5 * 0.75 * std::cos(half)}), tolerance());
    EXPECT_NEAR(length(facts.point_mm - facts.axis->point), *facts.radius_mm, tolerance());
    const Vec3 out{std::cos(half) * std::cos(-1.0), std::cos(half) * std::sin(-1.0), std::sin(half)};
    expect_near(facts.normal, turned(placement(), out * (1 / scale())), 1e-6);
}

TEST_P(Placed, a_sphere_has_its_centre_and_a_normal_at_its_pole)
{
    TracedScene scene;
    scene.add(kKindSphere, 0.5, {0.1, 0, 0}, {kPi, kPi / 2});
    const SurfaceFacts facts = facts_of(scene, placement(), {0.3, kPi / 2});
    ASSERT_TRUE(facts.radius_mm && facts.centre_mm);
    EXPECT_FALSE(facts.axis);
    EXPECT_NEAR(*facts.radius_mm, 5 * scale(), tolerance());
    expect_near(*facts.centre_mm, placed(placement(), {1, 0, 0}), tolerance());
    expect_near(facts.normal, turned(placement(), {0, 0, 1 / scale()}), 1e-6);
    EXPECT_FALSE(facts.curvatures); // no two directions there
}

TEST_P(Placed, a_torus_has_both_radii)
{
    TracedScene scene;
    scene.add(kKindTorus, 0.5, {0, 0, 0}, {kPi, kPi}).param[1] = 0.25f;
    const SurfaceFacts facts = facts_of(scene, placement(), {1, 2});
    ASSERT_TRUE(facts.radius_mm && facts.tube_radius_mm && facts.axis && facts.centre_mm && facts.curvatures);
    EXPECT_NEAR(*facts.radius_mm, 5 * scale(), tolerance());
    EXPECT_NEAR(*facts.tube_radius_mm, 1.25 * scale(), tolerance());
    // curvatures of a torus: 1 / r and cos v / (R + r cos v)
    EXPECT_NEAR(facts.curvatures->larger * 1.25 * scale(), 1, 1e-6);
    EXPECT_NEAR(facts.curvatures->smaller * scale(), std::cos(2.0) / (5 + 1.25 * std::cos(2.0)), 1e-7);
}

TEST(surface_facts, a_reversed_face_in_left_handed_axes_points_outwards)
{
    TracedScene scene;
    PatchRecord& patch = scene.add(kKindCylinder, 0.25, {0, 0, 0}, {kPi, 2});
    patch.axis_y[1] = -1; // S_u x S_v now points inwards
    scene.image.faces[0].flags |= kFaceReversed;
    const SurfaceFacts facts = facts_of(scene, turned_placement(1, true), {0.5, 0});
    expect_near(facts.normal, turned(turned_placement(1, true), {std::cos(0.5), -std::sin(0.5), 0}), 1e-6);
    EXPECT_GT(facts.curvatures->larger, 0.1); // convex seen from outside
}

TEST(surface_facts, a_stretched_placement_has_no_radius_but_a_point_a_normal_and_curvatures)
{
    TracedScene scene;
    scene.add(kKindCylinder, 0.25, {0, 0, 0}, {kPi, 2});
    const SurfaceFacts facts = facts_of(scene, {2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, {0.5, 0});
    EXPECT_FALSE(facts.radius_mm || facts.axis);
    expect_near(facts.point_mm, {5 * std::cos(0.5), 2.5 * std::sin(0.5), 0}, 1e-6);
    const Vec3 normal{std::cos(0.5) / 2, std::sin(0.5), 0};
    expect_near(facts.normal, normal * (1 / length(normal)), 1e-6);
    // an ellipse: a b / (a^2 sin^2 + b^2 cos^2)^(3/2)
    const double a = 5, b = 2.5, s = std::sin(0.5), c = std::cos(0.5);
    EXPECT_NEAR(facts.curvatures->larger, a * b / std::pow(a * a * s * s + b * b * c * c, 1.5), 1e-6);
}

/// A quarter of a cylinder of radius 4 mm, 6.4 mm long, rational.
void add_quarter(TracedScene& scene)
{
    scene.add_bezier(2, 1, true, 0.4, {0.6, 0.5, 0.4});
    const float half = std::sqrt(0.5f);
    const float arc[3][3] = {{1, 0, 1}, {half, half, half}, {0, 1, 1}};
    for (const auto& [wx, wy, w] : arc)
        for (const float z : {-0.8f, 0.8f})
            scene.image.control_points.insert(scene.image.control_points.end(), {wx, wy, z * w, w});
}

TEST(surface_facts, a_rational_patch_has_the_curvatures_of_what_it_is)
{
    TracedScene scene;
    add_quarter(scene);
    const SurfaceFacts facts = facts_of(scene, turned_placement(2, true), {0.3, 0.6});
    EXPECT_STREQ(facts.kind_name, "bezier");
    EXPECT_FALSE(facts.radius_mm);
    ASSERT_TRUE(facts.curvatures);
    EXPECT_NEAR(facts.curvatures->larger * 8, 1, 1e-6);
    EXPECT_NEAR(facts.curvatures->smaller * 8, 0, 1e-6);
}

/// How far the facts' point is from the sum over control points of its face's patch, placed; world mm.
double off_surface_mm(const PackImage& image, const SurfaceFacts& facts)
{
    const FaceRecord& face = image.faces[facts.face];
    double least = 1e30;
    for (uint i = face.first_patch; i < face.first_patch + face.patch_count; ++i) {
        const PatchRecord& patch = image.patches[i];
        const auto q =
            point_of(patch, image.control_points.data(), (facts.uv_face[0] - patch.uv_offset[0]) / patch.uv_scale[0],
                     (facts.uv_face[1] - patch.uv_offset[1]) / patch.uv_scale[1]);
        const PartRecord& part = image.parts[face.part];
        Vec3 p;
        for (size_t k = 0; k < 3; ++k)
            p[k] = part.origin_mm[k] +
                   part.scale_mm * (double(patch.origin_hi[k]) + double(patch.origin_lo[k]) +
                                    double(patch.scale) *
                                        (patch.axis_x[k] * q[0] + patch.axis_y[k] * q[1] + patch.axis_z[k] * q[2]));
        Placement m;
        std::copy_n(image.instances[facts.instance].transform, 12, m.begin());
        least = std::min(least, length(placed(m, p) - facts.point_mm));
    }
    return least;
}

/// Facts of the pixels of a picture: on their rays and their surfaces, as far away and turned as the reference says.
void expect_picks_are_exact(const std::shared_ptr<const Scene>& scene, const RenderOptions& options, double size_mm)
{
    const Frame frame = draw(scene, options).frame;
    const PackImage& image = scene->pack.image;
    const ClosestReference closest(image);
    const ReferenceRays rays(options.camera, options.width, options.height);
    size_t exact = 0, hits = 0;
    for (size_t i = 0; i < frame.face.size(); ++i) {
        if (frame.face[i] < 0)
            continue;
        PickedPlace place;
        place.face = uint(frame.face[i]);
        place.instance = uint(frame.instance[i]);
        place.uv_file = {frame.uv[2 * i], frame.uv[2 * i + 1]};
        place.ray = rays.through(double(i % options.width) + 0.5, double(i / options.width) + 0.5);
        const SurfaceFacts facts = surface_facts(image, place);
        ++hits;
        EXPECT_LE(off_surface_mm(image, facts), 1e-9 * size_mm);
        const ReferenceHit hit = closest.closest_of(*place.ray, place.instance, place.face);
        const Vec3 d = place.ray->direction * (1 / length(place.ray->direction));
        const double slope = std::abs(dot(facts.normal, d));
        if (!hit.hit || hit.contact || slope < 0.05) // a hair away, another place is as right
            continue;
        ++exact;
        EXPECT_LE(facts.off_ray_mm, 1e-9 * size_mm);
        EXPECT_LE(length(cross(facts.point_mm - place.ray->origin, d)), 1e-9 * size_mm);
        EXPECT_NEAR(length(facts.point_mm - place.ray->origin), hit.distance_mm, 1e-9 * size_mm);
        EXPECT_LE(reference::angle_deg(facts.normal, hit.normal), 1e-5);
    }
    EXPECT_GT(hits, frame.face.size() / 20);
    EXPECT_GT(exact, hits * 4 / 5);
}

TEST(surface_facts, picked_places_of_all_kinds_lie_on_ray_and_surface)
{
    TracedScene scene = all_kinds();
    scene.place({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    scene.place({-0.5, 0, 0, 8, 0, 0.5, 0, 3, 0, 0, 0.5, 7});   // mirrored
    scene.place({0.4, 0.2, 0, -6, 0, 0.6, 0, 2, 0, 0, 0.3, 8}); // sheared
    expect_picks_are_exact(scene.finish(), overview(120, 90), kPart_mm);
}

TEST(surface_facts, picked_places_of_a_converted_model_as_splines_lie_on_ray_and_surface)
{
    ImportOptions options;
    options.proxy_deflection = 0;
    options.native_surfaces = false;
    const Result<CadModel> model = import_cad(TRIMRAY_TESTS_DIR "/models/red_cube_blue_cylinder.step", options, {});
    ASSERT_TRUE(model.ok()) << model.error().detail;
    const auto scene = scene_of_model(*model);
    ASSERT_TRUE(scene);
    const PackImage& image = scene->pack.image;
    const double size = length(Vec3{image.bounds_hi_mm[0], image.bounds_hi_mm[1], image.bounds_hi_mm[2]} -
                               Vec3{image.bounds_lo_mm[0], image.bounds_lo_mm[1], image.bounds_lo_mm[2]});
    expect_picks_are_exact(scene, from_iso(image, 80, 60), size);
}

TEST(surface_facts, a_ray_that_passes_by_finds_the_nearest_place)
{
    TracedScene scene;
    scene.add(kKindSphere, 0.5, {0, 0, 0}, {kPi, kPi / 2});
    const auto whole = scene.finish();
    PickedPlace place;
    place.uv_file = {0.1, 0.2};
    place.ray = reference::Ray{{5.01, 0, -20}, {0, 0, 1}};
    const SurfaceFacts facts = surface_facts(whole->pack.image, place);
    EXPECT_NEAR(facts.off_ray_mm, 0.01, 1e-6);
    expect_near(facts.point_mm, {5, 0, 0}, 1e-2);
}

TEST(surface_facts, names_and_numbers_are_those_of_the_file)
{
    TracedScene scene;
    scene.add(kKindPlane, 1, {0, 0, 0}, {1, 1});
    scene.add(kKindSphere, 0.5, {0, 0, 0}, {kPi, kPi / 2});
    PackImage& image = scene.image;
    image.parts[0].name = image.strings.add("bolt");
    image.faces[1].name = image.strings.add("tip");
    image.dropped = {{0, 2, 0, 0}, {0, 0, 0, 0}, {1, 1, 0, 0}}; // of this part the first and the third
    scene.place({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    image.instances[0].name = image.strings.add("bolt:7");
    const auto whole = scene.finish();
    const SurfaceFacts first = surface_facts(whole->pack.image, {0, 0, {0, 0}, {}});
    const SurfaceFacts second = surface_facts(whole->pack.image, {1, 0, {0, 0}, {}});
    EXPECT_EQ(second.part_name, "bolt");
    EXPECT_EQ(second.placement_name, "bolt:7");
    EXPECT_EQ(second.face_name, "tip");
    EXPECT_EQ(first.face_name, "");
    EXPECT_EQ(first.face_in_part, 1u);
    EXPECT_EQ(second.face_in_part, 3u);
    EXPECT_EQ(second.face, 1u);
}

} // namespace
} // namespace trimray
