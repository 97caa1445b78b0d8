// Hard case 3: rays that graze a surface, where two roots become one and Newton's matrix singular. At the rims of a
// sphere and a torus, native and as Bezier patches, each pixel is compared with the closed form.
#include "tests/hard/closest_hits.h"
#include "tests/hard/nets.h"

#include <cmath>
#include <numbers>
#include <tuple>

namespace trimray::hard {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kUnit_mm = 10; // a part unit of TracedScene
constexpr double kMinor = 0.25; // of a torus with R = 0.75; a sphere's radius is 1

enum class Shape { Sphere, Torus };

/// The quarter of a circle from angle quarter * pi / 2 on as control points (w cos, w sin, w), all of them floats:
/// (1 - t^2, 2 t) / (1 + t^2), t in [0, 1].
std::array<std::array<double, 3>, 3> arc(int quarter)
{
    std::array<std::array<double, 3>, 3> points{{{1, 0, 1}, {1, 1, 1}, {0, 2, 2}}};
    for (int turn = 0; turn < quarter; ++turn)
        for (auto& [x, y, w] : points)
            std::tie(x, y) = std::pair(-y, x);
    return points;
}

/// The whole surface, around z. Bezier: biquadratic patches that are it exactly, as their coordinates are floats.
std::shared_ptr<const Scene> scene_of(Shape shape, bool bezier)
{
    TracedScene scene;
    if (!bezier && shape == Shape::Sphere) {
        scene.add(kKindSphere, 1, {0, 0, 0}, {kPi, kPi / 2});
    } else if (!bezier) {
        PatchRecord& torus = scene.add(kKindTorus, 1, {0, 0, 0}, {kPi, kPi});
        torus.param[0] = 0.75;
        torus.param[1] = static_cast<float>(kMinor);
    } else {
        for (int turn = 0; turn < 4; ++turn)
            for (const int up : {-1, 0, 1, 2}) {
                if (shape == Shape::Sphere && (up == 1 || up == 2))
                    continue;
                const auto around = arc(turn), tube = arc((up + 4) % 4);
                add_net(scene, 2, 2, true, [&](int i, int j) {
                    const auto [cu, su, wu] = around[size_t(i)];
                    const auto [cv, sv, wv] = tube[size_t(j)];
                    const double rho = shape == Shape::Sphere ? cv : 0.75 * wv + kMinor * cv;
                    const double z = shape == Shape::Sphere ? sv : kMinor * sv;
                    return NetPoint{cu * rho / (wu * wv), su * rho / (wu * wv), z / wv, wu * wv};
                });
            }
    }
    return scene.finish();
}

/// How far inside of the surface the line comes, part units: below 0 it misses. The eye is far from the surface.
double depth_within(Shape shape, const reference::Ray& ray)
{
    using reference::Vec3;
    using reference::operator+;
    using reference::operator*;
    // the surface's function along the line: golden section around the largest of samples
    const double speed = reference::length(ray.direction);
    const auto within = [&](double t) {
        const Vec3 p = (ray.origin + ray.direction * (t / speed)) * (1 / kUnit_mm);
        if (shape == Shape::Sphere)
            return 1 - reference::length(p);
        return kMinor - std::hypot(std::hypot(p[0], p[1]) - 0.75, p[2]);
    };
    const double from = reference::length(ray.origin) - 1.5 * kUnit_mm, step = 3 * kUnit_mm / 300;
    double best = from;
    for (int k = 0; k <= 300; ++k)
        if (within(from + k * step) > within(best))
            best = from + k * step;
    double lo = best - step, hi = best + step;
    const double golden = 0.5 * (std::sqrt(5) - 1);
    for (int k = 0; k < 70; ++k) {
        const double a = hi - golden * (hi - lo), b = lo + golden * (hi - lo);
        (within(a) < within(b) ? lo : hi) = within(a) < within(b) ? a : b;
    }
    return within(0.5 * (lo + hi));
}

struct Rim {
    Shape shape;
    reference::Vec3 point, outward; // part units
};

/// A picture with pixels of `pixel` part units around a point of a rim, and how far inside of the surface its rays
/// come.
struct RimView {
    RenderOptions options;
    std::vector<double> within;
};

RimView view_of(const Rim& rim, double pixel)
{
    using reference::operator+;
    using reference::operator*;
    constexpr double kDistance_mm = 40;
    const uint32_t side = 32 / (shrinking(false) == 1 ? 1 : 2);
    RimView view;
    RenderOptions& options = view.options;
    options.width = options.height = side;
    options.shade = false;
    // seen across the outward direction: along the tangent that is not the rim itself
    const reference::Vec3 along = std::abs(rim.outward[2]) > 0.5 ? reference::Vec3{1, 0, 0}
                                  : rim.shape == Shape::Sphere   ? reference::Vec3{0, 0.6, 0.8}
                                                                 : reference::Vec3{0, 0, 1};
    options.camera.target = rim.point * kUnit_mm;
    options.camera.eye = rim.point * kUnit_mm + along * kDistance_mm;
    options.camera.up = rim.outward;
    options.camera.fov_deg = 360 / kPi * std::atan(0.5 * side * pixel * kUnit_mm / kDistance_mm);
    const CameraRays c = camera_rays(options.camera, side, side);
    for (uint32_t y = 0; y < side; ++y)
        for (uint32_t x = 0; x < side; ++x)
            view.within.push_back(
                depth_within(rim.shape, {c.eye, c.corner + c.step_x * (x + 0.5) + c.step_y * (y + 0.5)}));
    return view;
}

/// How far from the rim the wrong pixels lie, in pixels.
double farthest_wrong_px(Tracer& tracer, const RimView& view, double pixel, size_t& hits, size_t& rays)
{
    RenderStats stats;
    const Result<Frame> frame = tracer.render(view.options, stats);
    if (!frame.ok()) {
        ADD_FAILURE() << frame.error().detail;
        return 0;
    }
    double farthest = 0;
    for (size_t i = 0; i < view.within.size(); ++i) {
        const bool hit = frame->face[i] >= 0;
        hits += hit;
        ++rays;
        if (hit != (view.within[i] >= 0))
            farthest = std::max(farthest, std::abs(view.within[i]) / pixel);
    }
    return farthest;
}

/// Places on the rims that a shape has.
std::vector<Rim> rims_of(Shape shape)
{
    const double c = std::sqrt(0.5);
    if (shape == Shape::Sphere)
        return {{shape, {c, 0.8 * c, -0.6 * c}, {c, 0.8 * c, -0.6 * c}}};
    return {{shape, {0.6, 0.8, 0}, {0.6, 0.8, 0}},
            {shape, {0.3, 0.4, 0}, {-0.6, -0.8, 0}},
            {shape, {0, 0.75, 0.25}, {0, 0, 1}}};
}

TEST(case_03, rims_lie_where_they_are_within_half_a_pixel)
{
    constexpr std::array<double, 5> kPixels{1e-3, 1e-4, 1e-5, 1e-6, 1e-7};
    for (const Shape shape : {Shape::Sphere, Shape::Torus}) {
        std::array<std::vector<RimView>, kPixels.size()> views; // the same for all four tracings
        for (size_t k = 0; k < kPixels.size(); ++k)
            for (const Rim& rim : rims_of(shape))
                views[k].push_back(view_of(rim, kPixels[k]));
        for (const bool bezier : {false, true}) {
            for (const auto& [name, tracer] : tracers_of(scene_of(shape, bezier))) {
                for (size_t k = 0; k < kPixels.size(); ++k) {
                    const double pixel = kPixels[k];
                    double farthest = 0;
                    size_t hits = 0, rays = 0;
                    for (const RimView& view : views[k])
                        farthest = std::max(farthest, farthest_wrong_px(*tracer, view, pixel, hits, rays));
                    std::cout << (shape == Shape::Sphere ? "sphere" : "torus") << (bezier ? ", Bezier, " : ", native, ")
                              << name << ", pixels of " << pixel << ": " << hits << " hits of " << rays
                              << ", wrong ones at most " << farthest << " px from the rim\n";
                    if (name == "plain")
                        continue;
                    // Newton on a Bezier patch takes what it meets within rounding of the ray
                    constexpr double kAccepted = 1e-6;
                    EXPECT_LE(farthest, bezier && pixel < 5e-7 ? kAccepted / pixel : 0.51);
                    if (!bezier || pixel > 1e-7) {
                        EXPECT_GT(hits, rays / 4);
                        EXPECT_LT(hits, rays * 3 / 4);
                    }
                }
            }
        }
    }
}

} // namespace
} // namespace trimray::hard
