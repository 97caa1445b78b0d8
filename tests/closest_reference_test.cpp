// The reference for closest hits against closed forms, against brute force on random rational patches, and against the
// CPU tracer.
#include "format/bezier_reference.h"
#include "format/closest_reference.h"
#include "format/native_reference.h"
#include "format/record_surface.h"
#include "tests/against_reference.h"
#include "tests/compare_frames.h"
#include "tests/traced_scenes.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace trimray {
namespace {

using reference::BezierReference;
using reference::cross;
using reference::dot;
using reference::length;
using reference::Ray;
using reference::Root;
using reference::Vec3;
using reference::operator+;
using reference::operator-;
using reference::operator*;

constexpr double kPi = std::numbers::pi;
const double kOffTangency[] = {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-10};

PatchRecord native(uint kind, float first, float second = 0)
{
    PatchRecord patch{};
    patch.shape = kind;
    patch.param[0] = first;
    patch.param[1] = second;
    return patch;
}

std::vector<double> distances(std::vector<Root> roots)
{
    std::vector<double> t;
    for (const Root& root : roots)
        t.push_back(root.t);
    std::sort(t.begin(), t.end());
    return t;
}

void expect_roots(const std::vector<Root>& roots, std::vector<double> expected, double error, const std::string& what)
{
    std::sort(expected.begin(), expected.end());
    const std::vector<double> found = distances(roots);
    ASSERT_EQ(found.size(), expected.size()) << what;
    for (size_t i = 0; i < found.size(); ++i)
        EXPECT_NEAR(found[i], expected[i], error) << what << ", root " << i;
}

/// Every root of a whole line, each once, in the order of t.
std::vector<Root> all_roots(const BezierReference& patch, const Ray& ray)
{
    std::vector<Root> roots;
    const auto end = patch.intersect(ray, -1e30, 1e30, [&roots](const Root& root) {
        roots.push_back(root);
        return 1e30;
    });
    EXPECT_TRUE(std::isinf(end.open_from)) << "the search was given up after " << end.boxes << " boxes";
    std::sort(roots.begin(), roots.end(), [](const Root& a, const Root& b) { return a.t < b.t; });
    std::vector<Root> each;
    for (const Root& root : roots) {
        const bool again = std::any_of(each.begin(), each.end(), [&](const Root& other) {
            // contacts of one touch lie as far apart as their square root of rounding
            const double same = root.contact || other.contact ? 1e-6 : 1e-11;
            return std::abs(root.u - other.u) < same && std::abs(root.v - other.v) < same;
        });
        if (!again)
            each.push_back(root);
    }
    return each;
}

/// Rays at a distance of radius (1 -+ off) from a circle's centre: half the chord, or nothing.
std::vector<double> chord(double radius, double distance, double middle)
{
    const double half2 = (radius - distance) * (radius + distance);
    return half2 < 0 ? std::vector<double>{}
                     : std::vector<double>{middle - std::sqrt(half2), middle + std::sqrt(half2)};
}

TEST(NativeReference, SphereNearItsRim)
{
    const PatchRecord sphere = native(kKindSphere, 0.75f);
    for (const double off : kOffTangency)
        for (const double side : {-1.0, 1.0}) {
            const double x = 0.75 * (1 + side * off);
            // the root's own sensitivity: rounding of x over the half chord
            expect_roots(
                reference::native_roots(sphere, {{x, 0, -5}, {0, 0, 2}}),
                [&] {
                    std::vector<double> t = chord(0.75, x, 5);
                    for (double& at : t)
                        at /= 2;
                    return t;
                }(),
                1e-15 / std::sqrt(off), fmt::format("off {} {}", side, off));
        }
    const auto touching = reference::native_roots(sphere, {{0.75, 0, -5}, {0, 0, 2}});
    ASSERT_EQ(touching.size(), 1u);
    EXPECT_TRUE(touching[0].contact);
    EXPECT_NEAR(touching[0].t, 2.5, 1e-15);
}

TEST(NativeReference, CylinderAndConeNearTheirRims)
{
    const PatchRecord cylinder = native(kKindCylinder, 0.75f);
    const PatchRecord cone = native(kKindCone, 0.75f, 0.5f); // radius 0.75 + z / 2
    for (const double off : kOffTangency)
        for (const double side : {-1.0, 1.0}) {
            const double x = 0.75 * (1 + side * off);
            const double error = 4e-15 / std::sqrt(off);
            expect_roots(reference::native_roots(cylinder, {{x, -5, 0.25}, {0, 1, 0}}), chord(0.75, x, 5), error,
                         fmt::format("cylinder off {} {}", side, off));
            expect_roots(reference::native_roots(cone, {{x, -5, 0}, {0, 1, 0}}), chord(0.75, x, 5), error,
                         fmt::format("cone off {} {}", side, off));
        }
    // both nappes, and the apex at z = -1.5
    expect_roots(reference::native_roots(cone, {{0, -1, -2.5}, {0, 1, 0}}), {0.5, 1.5}, 1e-15, "beyond the apex");
    expect_roots(reference::native_roots(cone, {{0.25, 0, -9}, {0, 0, 1}}), {7, 8}, 1e-14, "along the axis");
    // along a ruling's direction there is one root
    expect_roots(reference::native_roots(cone, {{0, 0, 0}, {0.5, 0, 1}}), {-0.75}, 1e-15, "along a ruling");
    EXPECT_TRUE(reference::native_roots(cylinder, {{0.1, 0, 0}, {0, 0, 1}}).empty());
}

TEST(NativeReference, TorusNearItsRims)
{
    const PatchRecord torus = native(kKindTorus, 1.0f, 0.25f);
    for (const double off : kOffTangency)
        for (const double side : {-1.0, 1.0}) {
            // at height h the torus is two circles with radii 1 -+ sqrt(r^2 - h^2)
            const double h = 0.25 * (1 + side * off);
            std::vector<double> expected;
            if (side < 0)
                for (const double sign : {-1.0, 1.0}) {
                    const double rho = 1 + sign * std::sqrt((0.25 - h) * (0.25 + h));
                    for (const double t : chord(rho, 0.5, 4))
                        expected.push_back(t);
                }
            expect_roots(reference::native_roots(torus, {{0.5, -4, h}, {0, 1, 0}}), expected, 1e-14 / std::sqrt(off),
                         fmt::format("top, {} {}", side, off));
            // parallel to the axis at the outer rim
            const double x = 1.25 * (1 + side * off), from_tube = x - 1;
            expect_roots(reference::native_roots(torus, {{x, 0, -3}, {0, 0, 1}}), chord(0.25, from_tube, 3),
                         1e-14 / std::sqrt(off), fmt::format("outer rim, {} {}", side, off));
            // in the equator's plane past the hole
            const double inner = 0.75 * (1 + side * off);
            std::vector<double> across = chord(1.25, inner, 4);
            for (const double t : chord(0.75, inner, 4))
                across.push_back(t);
            expect_roots(reference::native_roots(torus, {{inner, -4, 0}, {0, 1, 0}}), across, 1e-14 / std::sqrt(off),
                         fmt::format("hole, {} {}", side, off));
        }
}

TEST(NativeReference, FindsThePointsOfRandomSurfaces)
{
    std::mt19937 random(7);
    const auto uniform = [&random](double lo, double hi) {
        return std::uniform_real_distribution<double>(lo, hi)(random);
    };
    for (int i = 0; i < 20000; ++i) {
        const uint kind = static_cast<uint>(i % 5);
        const auto first = static_cast<float>(uniform(0.05, 1));
        const auto second = static_cast<float>(kind == kKindCone ? uniform(-4, 4) : uniform(0.01, 1.5) * first);
        const PatchRecord patch = native(kind, first, second);
        const double u = uniform(-kPi, kPi), v = kind == kKindSphere ? uniform(-kPi / 2, kPi / 2) : uniform(-3, 3);
        const Vec3 p = point_of(patch, nullptr, u, v);
        Ray ray{{uniform(-2, 2), uniform(-2, 2), uniform(-2, 2)}, {}};
        const double t = uniform(0.1, 3);
        ray.direction = (p - ray.origin) * (1 / t);
        const double cosine =
            std::abs(dot(reference::native_normal(patch, u, v), ray.direction)) / length(ray.direction);
        if (cosine < 1e-3)
            continue;
        double best = 1e9;
        for (const Root& root : reference::native_roots(patch, ray)) {
            if (std::abs(root.t - t) < std::abs(best))
                best = root.t - t;
            const Vec3 q = point_of(patch, nullptr, root.u, root.v);
            EXPECT_LT(length(q - ray.at(root.t)), 1e-12) << "kind " << kind << " at " << u << ", " << v;
        }
        EXPECT_LT(std::abs(best), 1e-11 / cosine)
            << "kind " << kind << " " << first << " " << second << " at " << u << ", " << v;
        const double d[2] = {1e-3, 1e-3};
        const double lo[2] = {u - d[0], v - d[1]}, hi[2] = {u + d[0], v + d[1]};
        const reference::Bounds box = reference::native_bounds(patch, lo, hi);
        for (size_t k = 0; k < 3; ++k) {
            EXPECT_LE(box.lo[k], p[k] + 1e-15);
            EXPECT_GE(box.hi[k], p[k] - 1e-15);
        }
    }
}

/// A patch and its control points.
struct Patch {
    PatchRecord record{};
    std::vector<float> points;

    Patch(int degree_u, int degree_v, bool rational)
    {
        record.shape = kKindBezier | static_cast<uint>(degree_u) << 8 | static_cast<uint>(degree_v) << 16 |
                       (rational ? kShapeRational : 0u);
    }
    BezierReference reference() const { return {record, points.data(), 0, 0}; }
    Vec3 at(double u, double v) const { return point_of(record, points.data(), u, v); }
};

/// The eighth of the unit sphere with x, y, z >= 0, exactly: a quarter circle is (1 - t^2, 2 t) / (1 + t^2).
/// v = 1 is the pole (0, 0, 1).
Patch sphere_octant()
{
    Patch patch(2, 2, true);
    const float arc[3][3] = {{1, 0, 1}, {1, 1, 1}, {0, 2, 2}}; // w cos, w sin, w
    for (const auto& [cu, su, wu] : arc)
        for (const auto& [cv, sv, wv] : arc)
            patch.points.insert(patch.points.end(), {cu * cv, su * cv, wu * sv, wu * wv});
    return patch;
}

TEST(BezierReference, SphereNearItsRim)
{
    const Patch octant = sphere_octant();
    const BezierReference patch = octant.reference();
    const double c = std::sqrt(1 / 3.0), s = std::sqrt(0.5);
    for (const double off : kOffTangency)
        for (const double side : {-1.0, 1.0}) {
            const Vec3 origin = Vec3{c, c, c} * (1 + side * off);
            const Ray ray{origin, {s, -s, 0}};
            const std::vector<Root> roots = all_roots(patch, ray);
            expect_roots(roots, chord(1, 1 + side * off, 0), 1e-15 / std::sqrt(off),
                         fmt::format("off {} {}", side, off));
            for (const Root& root : roots)
                EXPECT_EQ(root.contact, false) << off;
        }
    const std::vector<Root> touching = all_roots(patch, {{c, c, c}, {s, -s, 0}});
    ASSERT_GE(touching.size(), 1u);
    EXPECT_LT(std::abs(touching[0].t), 1e-6);
}

TEST(BezierReference, NormalsAtAPole)
{
    const Patch octant = sphere_octant();
    const BezierReference patch = octant.reference();
    for (const double from_pole : {0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3})
        for (const double u : {0.0, 0.3, 1.0}) {
            const Vec3 normal = patch.normal(u, 1 - from_pole), point = octant.at(u, 1 - from_pole);
            EXPECT_LT(length(normal - point), 2e-6) << from_pole << " from the pole at u = " << u;
        }
    // rays at the pole and beside it
    for (const double off : {0.0, 1e-15, 1e-12, 1e-9, 1e-6}) {
        const std::vector<Root> roots = all_roots(patch, {{off, off, 3}, {0, 0, -1}});
        ASSERT_GE(roots.size(), 1u) << off;
        EXPECT_NEAR(roots[0].t, 2, 1e-11) << off;
    }
}

TEST(BezierReference, EndsWhereTheLineLiesInTheSurface)
{
    Patch square(1, 1, false);
    square.points = {0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0};
    const BezierReference patch = square.reference();
    double nearest = 1e9;
    uint64_t boxes = 0;
    bool contact = false;
    const auto end = patch.intersect({{-1, 0.25, 0}, {1, 0, 0}}, 0, 1e9, [&](const Root& root) {
        nearest = std::min(nearest, root.t);
        contact = root.contact;
        return nearest;
    });
    boxes = end.boxes;
    EXPECT_NEAR(nearest, 1, 1e-9);
    EXPECT_TRUE(contact);
    EXPECT_LT(boxes, 1000u);
    EXPECT_TRUE(std::isinf(end.open_from));
}

/// A random patch of about unit size; `fold` makes it pass over itself.
Patch random_patch(std::mt19937& random, int most_degree)
{
    const auto uniform = [&random](double lo, double hi) {
        return std::uniform_real_distribution<double>(lo, hi)(random);
    };
    const auto degree = [&] { return std::uniform_int_distribution<int>(1, most_degree)(random); };
    Patch patch(degree(), degree(), uniform(0, 1) < 0.7);
    const bool rational = (patch.record.shape & kShapeRational) != 0;
    const int p = static_cast<int>(patch.record.shape >> 8 & 0xffu),
              q = static_cast<int>(patch.record.shape >> 16 & 0xffu);
    const double decades = uniform(0, 3), fold = uniform(0, 1.5);
    for (int i = 0; i <= p; ++i)
        for (int j = 0; j <= q; ++j) {
            const double w = rational ? std::pow(10, uniform(-decades, decades)) : 1;
            const double x = 2.0 * i / p - 1 + fold * uniform(-1, 1), y = 2.0 * j / q - 1 + fold * uniform(-1, 1);
            for (const double c : {x, y, uniform(-1, 1)})
                patch.points.push_back(static_cast<float>(w * c));
            if (rational)
                patch.points.push_back(static_cast<float>(w));
        }
    return patch;
}

/// Roots by Newton's iteration from the middles of cells x cells equal parts, each once.
std::vector<std::array<double, 2>> brute_force(const Patch& patch, const BezierReference& surface, const Ray& ray,
                                               int cells)
{
    const Vec3 along = ray.direction * (1 / length(ray.direction));
    Vec3 n1 = cross(along, std::abs(along[0]) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0});
    n1 = n1 * (1 / length(n1));
    const Vec3 n2 = cross(along, n1);
    std::vector<std::array<double, 2>> roots;
    for (int cell = 0; cell < cells * cells; ++cell) {
        double u = (cell % cells + 0.5) / cells, v = (cell / cells + 0.5) / cells;
        for (int step = 0; step < 30; ++step) {
            const auto s = surface.evaluate(u, v);
            const double a = dot(n1, s.p - ray.origin), b = dot(n2, s.p - ray.origin);
            const double au = dot(n1, s.du), av = dot(n1, s.dv), bu = dot(n2, s.du), bv = dot(n2, s.dv);
            const double det = au * bv - av * bu;
            const double du = (bv * a - av * b) / det, dv = (au * b - bu * a) / det;
            u -= du;
            v -= dv;
            if (!(std::abs(u - 0.5) < 1 && std::abs(v - 0.5) < 1))
                break;
            if (std::max(std::abs(du), std::abs(dv)) > 1e-13)
                continue;
            const Vec3 r = patch.at(u, v) - ray.origin; // by Bernstein sums
            const bool is_root = std::hypot(dot(n1, r), dot(n2, r)) < 1e-10;
            const bool inside = u >= 0 && u <= 1 && v >= 0 && v <= 1;
            const bool fresh = std::none_of(roots.begin(), roots.end(), [&](const auto& other) {
                return std::abs(other[0] - u) < 1e-7 && std::abs(other[1] - v) < 1e-7;
            });
            if (is_root && inside && fresh)
                roots.push_back({u, v});
            break;
        }
    }
    return roots;
}

TEST(BezierReference, LosesNoRootThatBruteForceFinds)
{
    std::mt19937 random(11);
    const auto uniform = [&random](double lo, double hi) {
        return std::uniform_real_distribution<double>(lo, hi)(random);
    };
    size_t by_brute_force = 0, found = 0, several = 0;
    for (int i = 0; i < 400; ++i) {
        const Patch patch = random_patch(random, i % 40 == 0 ? 25 : i % 4 == 0 ? 15 : 6);
        const BezierReference surface = patch.reference();
        for (int k = 0; k < 3; ++k) {
            // through a point of the patch, some at a small angle to it
            const double u = uniform(0, 1), v = uniform(0, 1);
            const auto s = surface.evaluate(u, v);
            Vec3 direction{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
            if (k > 0) {
                const double turn = uniform(-kPi, kPi), lift = std::pow(10, uniform(-5, 0));
                const Vec3 n = cross(s.du, s.dv);
                direction = s.du * (std::cos(turn) / length(s.du)) + s.dv * (std::sin(turn) / length(s.dv)) +
                            n * (lift / length(n));
            }
            const Ray ray{s.p - direction * 2, direction};
            const std::vector<Root> roots = all_roots(surface, ray);
            found += roots.size();
            several += roots.size() > 2;
            for (const Root& root : roots)
                EXPECT_LT(length(patch.at(root.u, root.v) - ray.at(root.t)), root.contact ? 1e-6 : 1e-11)
                    << "patch " << i << " ray " << k;
            const auto has = [&](double at_u, double at_v) {
                return std::any_of(roots.begin(), roots.end(), [&](const Root& root) {
                    return std::abs(root.u - at_u) < 1e-6 && std::abs(root.v - at_v) < 1e-6;
                });
            };
            EXPECT_TRUE(has(u, v)) << "patch " << i << " ray " << k << ": the point it was aimed at";
            for (const auto& [at_u, at_v] : brute_force(patch, surface, ray, 12)) {
                ++by_brute_force;
                EXPECT_TRUE(has(at_u, at_v)) << "patch " << i << " ray " << k << " at " << at_u << ", " << at_v;
            }
        }
    }
    EXPECT_GT(several, 100u) << "the patches are not folded enough to mean anything";
    EXPECT_GE(found, by_brute_force);
}

TEST(BezierReference, FindsTheNearestOfManyRoots)
{
    std::mt19937 random(12);
    for (int i = 0; i < 300; ++i) {
        const Patch patch = random_patch(random, 8);
        const BezierReference surface = patch.reference();
        const Vec3 p = patch.at(0.4, 0.6);
        const Ray ray{p - Vec3{0.3, 0.2, 2}, {0.3, 0.2, 2}};
        const std::vector<Root> roots = all_roots(surface, ray);
        ASSERT_FALSE(roots.empty());
        double nearest = 1e30;
        surface.intersect(ray, -1e30, 1e30,
                          [&nearest](const Root& root) { return nearest = std::min(nearest, root.t); });
        EXPECT_NEAR(nearest, roots[0].t, 1e-12) << "patch " << i;
    }
}

/// Two faces in one place, and a sphere around the eye.
TEST(ClosestReference, OfCoincidentFacesTheLowerOneIsTheClosest)
{
    TracedScene scene;
    scene.add(kKindPlane, 1, {0, 0, 0.25}, {0.5, 0.5});
    scene.add(kKindPlane, 1, {0, 0, 0.25}, {0.75, 0.75});
    scene.add(kKindSphere, 1, {0, 0, 0}, {kPi, kPi / 2});
    const auto finished = scene.finish();
    const ClosestReference closest(finished->pack.image);
    for (int i = 0; i < 100; ++i) {
        const double x = -7.4 + 0.148 * i;
        const ReferenceHit hit = closest.closest({{0, 0.1, 9}, {x, 0, -6.5}});
        ASSERT_TRUE(hit.hit);
        EXPECT_EQ(hit.face, std::abs(x) < 5 ? 0u : 1u) << x;
    }
    const ReferenceHit from_inside = closest.closest({{0, 0, 0}, {0, 0, -3}});
    ASSERT_TRUE(from_inside.hit);
    EXPECT_EQ(from_inside.face, 2u);
    EXPECT_NEAR(from_inside.distance_mm, 10, 1e-12);
    EXPECT_FALSE(closest.closest({{0, 0, 11}, {0, 0, 1}}).hit) << "the sphere lies behind";
}

TEST(ClosestReference, InstancesMirroredAndStretchedKeepDistancesAndNormals)
{
    TracedScene plain = all_kinds();
    const auto original = plain.finish();
    const ClosestReference here(original->pack.image);
    TracedScene moved = all_kinds();
    // mirrored, stretched and sheared, far away
    const std::array<double, 12> m{-2, 0.3, 0, 1e6, 0, 1, 0.2, -3e6, 0.1, 0, 0.5, 2e6};
    moved.place(m);
    const auto placed = moved.finish();
    const ClosestReference there(placed->pack.image);
    const auto to_world = [&m](const Vec3& a, double w) {
        Vec3 out;
        for (size_t row = 0; row < 3; ++row)
            out[row] = m[4 * row] * a[0] + m[4 * row + 1] * a[1] + m[4 * row + 2] * a[2] + w * m[4 * row + 3];
        return out;
    };
    size_t hits = 0;
    const CameraRays rays = camera_rays(kOverview, 64, 48);
    for (uint32_t y = 0; y < 48; ++y)
        for (uint32_t x = 0; x < 64; ++x) {
            const Ray ray{rays.eye, rays.corner + rays.step_x * (x + 0.5) + rays.step_y * (y + 0.5)};
            const Ray ray_there{to_world(ray.origin, 1), to_world(ray.direction, 0)};
            const ReferenceHit a = here.closest(ray), b = there.closest(ray_there);
            ASSERT_EQ(a.hit, b.hit) << x << ", " << y;
            if (!a.hit)
                continue;
            ++hits;
            EXPECT_EQ(a.face, b.face);
            const double t = a.distance_mm / length(ray.direction);
            // the world's own rounding: 2e-10 mm at 3e6 mm
            EXPECT_NEAR(b.distance_mm / length(ray_there.direction), t, 1e-7 * t);
            // M^-T n is at a right angle to M times every tangent, and on the same side as M n
            const Vec3 side = std::abs(a.normal[0]) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
            EXPECT_LT(std::abs(dot(to_world(cross(a.normal, side), 0), b.normal)), 1e-6);
            EXPECT_GT(dot(to_world(a.normal, 0), b.normal) * 1.0, 0) << "face " << a.face;
        }
    EXPECT_GT(hits, 500u);
}

TEST(ClosestReference, ADoubtfulRayIsOneWithinAThousandthOfAPixelOfARim)
{
    TracedScene scene;
    scene.add(kKindSphere, 1, {0, 0, 0}, {kPi, kPi / 2});
    const auto finished = scene.finish();
    const ClosestReference closest(finished->pack.image);
    // a pixel is 0.01 mm where the line of sight touches the sphere of 10 mm
    const Vec3 step_x{1e-4, 0, 0}, step_y{0, 1e-4, 0};
    const double sine = 10.0 / 100.0, rim = sine / std::sqrt(1 - sine * sine);
    for (const double off_px : {-1.0, -0.01, -2e-3, -9e-4, 9e-4, 2e-3, 0.01, 1.0}) {
        const Ray ray{{0, 0, 100}, {rim + off_px * 1e-4, 0, -1}};
        const ReferenceHit hit = closest.closest(ray);
        EXPECT_EQ(hit.hit, off_px < 0);
        EXPECT_EQ(closest.hair(ray, hit, step_x, step_y).doubt, std::abs(off_px) < 1e-3 ? Doubt::Tangent : Doubt::None)
            << off_px;
    }
}

TEST(ClosestReference, RimsAreASurfaceFromWithinAndShowNoBacksFromOutside)
{
    const auto with = slab(4u << kFaceRimBit | 5u << (kFaceRimBit + kFaceRimBits)), without = slab(0);
    const ClosestReference cut(with->pack.image), whole(without->pack.image);
    const auto differing_pixels = [&](const Camera& camera) {
        RenderOptions options = overview(120, 90);
        options.camera = camera;
        const AgainstReference result = compare_with_reference(draw(with, options).frame, camera, cut);
        for (const uint64_t count : result.faults)
            EXPECT_EQ(count, 0u);
        const AgainstReference other = compare_with_reference(draw(with, options).frame, camera, whole);
        return other.faults[size_t(Fault::FalseMiss)] + other.faults[size_t(Fault::WrongDepth)];
    };
    EXPECT_GT(differing_pixels({{0, -40, -12}, {0, 0, 0}, {0, 0, 1}, 35}), 50u) << "the upper disc's back, from below";
    EXPECT_EQ(differing_pixels({{0.3, -0.2, 0.1}, {0, 0, 2}, {0, 1, 0}, 160}), 0u) << "from within";
}

TEST(ClosestReference, AgreesWithTheCpuTracerOnEveryKind)
{
    const auto scene = all_kinds().finish();
    RenderOptions options = overview(240, 180);
    options.error_px = 1e-4f;
    const Drawn drawn = draw(scene, options);
    const ClosestReference closest(scene->pack.image);
    const AgainstReference result = compare_with_reference(drawn.frame, options.camera, closest);
    EXPECT_GT(result.both_hit, 10000u);
    for (const FaultyPixel& p : result.pixels)
        EXPECT_NE(p.doubt, Doubt::None) << p.x << ", " << p.y << ": " << kFaultNames[size_t(p.fault)] << ", faces "
                                        << p.tracer_face << " and " << p.reference_face;
    EXPECT_EQ(result.certified_wrong, 0u);
    EXPECT_EQ(result.not_finite, 0u);
    EXPECT_EQ(result.open, 0u);
    EXPECT_LT(result.largest_depth_px, 0.01);
    EXPECT_LT(result.mean_normal_deg(), 1e-3);
}

TEST(ReferenceTracer, PaintsWhatTheCpuTracerPaints)
{
    const auto scene = all_kinds().finish();
    RenderOptions options = overview(160, 120);
    const Drawn cpu = draw(scene, options);
    const auto tracer = make_reference_tracer(scene);
    std::vector<double> told;
    options.progress = [&told](double share) { told.push_back(share); };
    RenderStats stats;
    const Result<Frame> frame = tracer->render(options, stats);
    ASSERT_TRUE(frame.ok());
    expect_small(compare(cpu.frame, *frame, options), 160 * 120);
    EXPECT_EQ(stats.device, "reference");
    EXPECT_EQ(stats.trim, TrimMode::Reference);
    EXPECT_EQ(told.size(), 120u);
    EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
    EXPECT_EQ(told.back(), 1);

    options.threads = 1;
    const Result<Frame> again = tracer->render(options, stats);
    ASSERT_TRUE(again.ok());
    EXPECT_TRUE(same_bits(frame->rgba, again->rgba));
    EXPECT_TRUE(same_bits(frame->depth_mm, again->depth_mm));
    EXPECT_TRUE(same_bits(frame->uv, again->uv));
    EXPECT_TRUE(same_bits(frame->normal, again->normal));
}

TEST(ReferenceTracer, RefusesWhatItCannotDo)
{
    const auto scene = all_kinds().finish();
    const auto tracer = make_reference_tracer(scene);
    const auto refused = [&](auto change) {
        RenderOptions options = overview(8, 8);
        change(options);
        RenderStats stats;
        const Result<Frame> frame = tracer->render(options, stats);
        ASSERT_FALSE(frame.ok());
        EXPECT_EQ(frame.error().code, ErrorCode::Usage);
    };
    refused([](RenderOptions& o) { o.edges = EdgeLines::Sharp; });
    refused([](RenderOptions& o) { o.silhouettes = true; });
    refused([](RenderOptions& o) { o.antialias_trims = true; });
    refused([](RenderOptions& o) { o.trim = TrimMode::Sdf; });
    refused([](RenderOptions& o) { o.trim = TrimMode::Kd; });
    refused([](RenderOptions& o) { o.width = 0; });
}

} // namespace
} // namespace trimray
