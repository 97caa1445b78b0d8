// Hard case 4: poles and sides of a patch that are one point, where S_u = 0 and S_u x S_v is no normal.
#include "tests/hard/closest_hits.h"
#include "tests/hard/nets.h"

#include <cmath>
#include <numbers>

namespace trimray::hard {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kUnit_mm = 10; // a part unit of TracedScene

/// Four patches around z of a profile (rho, z) from the axis on: control points of a polynomial curve, part units.
std::shared_ptr<const Scene> revolved(const std::vector<std::array<double, 2>>& profile)
{
    constexpr double kArc[3][3] = {{1, 0, 1}, {1, 1, 1}, {0, 2, 2}}; // w cos, w sin, w
    TracedScene scene;
    for (int turn = 0; turn < 4; ++turn)
        add_net(scene, 2, int(profile.size()) - 1, true, [&](int i, int j) {
            const auto [c, s, w] = kArc[i];
            const auto [rho, z] = profile[size_t(j)];
            const double x[4] = {c, -s, -c, s}, y[4] = {s, c, -s, -c};
            return NetPoint{x[turn] / w * rho, y[turn] / w * rho, z, w};
        });
    return scene.finish();
}

std::shared_ptr<const Scene> native(uint kind)
{
    TracedScene scene;
    PatchRecord& patch = scene.add(kind, 1, {0, 0, 0}, {kPi, kind == kKindSphere ? kPi / 2 : 1});
    if (kind == kKindCone) {
        patch.param[0] = 0.5; // the apex at z = -0.5 cos 45 deg / sin 45 deg
        patch.param[1] = 1;
    }
    return scene.finish();
}

struct Model {
    const char* name;
    std::shared_ptr<const Scene> scene;
    double pole_z;                    // part units
    std::array<double, 3> within_deg; // of the normal's direction, in each of kHalves; 90: no claim
    std::array<bool, 3> may_turn;     // normals may point the other way
};

// From the pole in a picture's middle to the picture's sides, part units; the nearest pixels are 1/48 of that away
constexpr std::array<double, 3> kHalves{1e-2, 1e-4, 1e-6};

std::vector<Model> models()
{
    return {{"native sphere", native(kKindSphere), 1, {1e-5, 1e-5, 1e-5}, {false, false, false}},
            {"revolved spline",
             revolved({{0, 0.5}, {0.4, 0.5}, {0.8, 0.3}, {0.9, -0.2}}),
             0.5,
             {0.1, 0.2, 0.1},
             {false, false, false}},
            {"native cone", native(kKindCone), -0.5, {0.1, 0.3, 90}, {false, false, true}},
            {"Bezier cone", revolved({{0, 0.5}, {0.8, -0.3}}), 0.5, {0.3, 90, 90}, {false, false, true}}};
}

struct Found {
    uint64_t rays = 0, false_misses = 0, not_finite = 0;
    uint64_t turned = 0;   // normals that point the other way
    double normal_deg = 0; // largest error of the direction, either way
};

/// What the reference says of pictures of 48 x 48 pixels, `half` part units from their middle, the pole, to their
/// sides.
struct PoleView {
    RenderOptions options;
    std::vector<ReferenceHit> hits; // of each pixel
};

std::vector<PoleView> views_of_pole(const Model& model, const ClosestReference& closest, double half)
{
    constexpr uint32_t kSide = 48;
    const double up = model.pole_z < 0 ? -1 : 1, distance = 30;
    std::vector<PoleView> views;
    for (const double slant : {0.0, 0.4}) {
        PoleView& view = views.emplace_back();
        RenderOptions& options = view.options;
        options.width = options.height = kSide / shrinking(false);
        options.camera.target = {0, 0, model.pole_z * kUnit_mm};
        options.camera.eye = {distance * std::sin(slant) * 0.8, distance * std::sin(slant) * 0.6,
                              model.pole_z * kUnit_mm + up * distance * std::cos(slant)};
        options.camera.up = {0, 1, 0};
        options.camera.fov_deg = 360 / kPi * std::atan(half * kUnit_mm / distance);
        options.shade = false;
        const CameraRays rays = camera_rays(options.camera, options.width, options.height);
        using reference::operator+;
        using reference::operator*;
        for (uint32_t y = 0; y < options.height; ++y)
            for (uint32_t x = 0; x < options.width; ++x)
                view.hits.push_back(
                    closest.closest({rays.eye, rays.corner + rays.step_x * (x + 0.5) + rays.step_y * (y + 0.5)}));
    }
    return views;
}

Found look_at_pole(Tracer& tracer, const std::vector<PoleView>& views)
{
    Found found;
    for (const PoleView& view : views) {
        RenderStats stats;
        const Result<Frame> frame = tracer.render(view.options, stats);
        if (!frame.ok()) {
            ADD_FAILURE() << frame.error().detail;
            return found;
        }
        for (size_t i = 0; i < view.hits.size(); ++i) {
            const ReferenceHit& hit = view.hits[i];
            ++found.rays;
            found.false_misses += hit.hit && frame->face[i] < 0;
            if (!hit.hit || frame->face[i] < 0)
                continue;
            found.not_finite += !std::isfinite(frame->depth_mm[i]);
            const reference::Vec3 n{frame->normal[3 * i], frame->normal[3 * i + 1], frame->normal[3 * i + 2]};
            found.not_finite += !std::isfinite(reference::dot(n, n));
            const double along = reference::dot(n, hit.normal);
            found.turned += along < 0;
            found.normal_deg =
                std::max(found.normal_deg,
                         180 / kPi * std::atan2(reference::length(reference::cross(n, hit.normal)), std::abs(along)));
        }
    }
    return found;
}

TEST(case_04, poles_are_hit_and_smooth_ones_keep_their_normal)
{
    for (const Model& model : models()) {
        const ClosestReference closest(model.scene->pack.image);
        std::array<std::vector<PoleView>, kHalves.size()> views;
        for (size_t k = 0; k < kHalves.size(); ++k)
            views[k] = views_of_pole(model, closest, kHalves[k]);
        for (const auto& [name, tracer] : tracers_of(model.scene)) {
            for (size_t k = 0; k < kHalves.size(); ++k) {
                const Found found = look_at_pole(*tracer, views[k]);
                std::cout << model.name << ", " << name << ", " << kHalves[k] << " from the pole: normals within "
                          << found.normal_deg << " deg, " << found.turned << " turned, " << found.false_misses
                          << " false misses, " << found.not_finite << " not finite of " << found.rays << " rays\n";
                if (name == "plain")
                    continue;
                EXPECT_EQ(found.not_finite, 0u);
                EXPECT_EQ(found.false_misses, 0u);
                EXPECT_LE(found.normal_deg, model.within_deg[k]);
                if (!model.may_turn[k]) {
                    EXPECT_EQ(found.turned, 0u);
                }
            }
        }
    }
}

} // namespace
} // namespace trimray::hard
