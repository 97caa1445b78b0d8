// Hard case 9: where rays begin that leave a surface. Too near, and the surface shadows itself; too far, and light
// leaks through walls and corners. What is near and far must not hang on the unit or on the place in the world.
#include "tests/closed_forms.h"
#include "tests/occt_solids.h"
#include "tests/traced_file.h"

#include <array>
#include <cmath>

namespace trimray::hard {
namespace {

using reference::cross;
using reference::dot;
using reference::length;
using reference::operator+;
using reference::operator-;
using reference::operator*;

constexpr double kSize_mm = 100;

struct Place {
    const char* name;
    double scale;
    double sizes; // from the origin, in sizes of the part
    bool placed;  // by an instance's transform; else by its own coordinates
};
constexpr Place kHere{"at the origin", 1, 0, false};
constexpr Place kPlaces[] = {{"1000 times as large", 1000, 0, false},
                             {"a thousandth as large", 1e-3, 0, false},
                             {"25.4 times as large", 25.4, 0, false},
                             {"25.4 times as small", 1 / 25.4, 0, false},
                             {"10^6 sizes away", 1, 1e6, false},
                             {"10^6 sizes away by its placement", 1, 1e6, true},
                             {"1000 times as large, 10^6 sizes away", 1000, 1e6, false}};

/// Where a tracer is asked: everywhere, on the software driver at three places.
std::vector<Place> places_of(bool vulkan)
{
    if (vulkan)
        return {kPlaces[0], kPlaces[3], kPlaces[4]};
    return {std::begin(kPlaces), std::end(kPlaces)};
}

/// A solid somewhere, and points of it where they are there.
struct There {
    std::shared_ptr<const Scene> scene;
    double scale = 1;
    Vec3 shift{};
    Vec3 at(const Vec3& here) const { return here * scale + shift; }
};
There there(oracle::Solid solid, const Place& place)
{
    There out;
    out.scale = place.scale;
    out.shift = Vec3{0.64, -0.48, 0.6} * (place.sizes * kSize_mm * place.scale);
    oracle::Layout layout;
    layout.scale = place.scale;
    layout.placed = place.placed;
    layout.shift_mm = out.shift;
    const TemporaryFile file("starts.brep");
    EXPECT_TRUE(oracle::write_laid_out(solid, layout, file.path));
    out.scene = scene_of_file(file.path);
    return out;
}

/// Shadows of a sun and of a lamp, and occlusion, some within reach alone.
RenderOptions lit(const There& there, bool vulkan)
{
    RenderOptions options;
    options.width = options.height = vulkan ? 48 : 96;
    options.camera = {there.at({90, -140, 125}), there.at({6, 2, 18}), {0, 0, 1}, 24};
    options.look.lights = {{.direction = {1, 2, -3}, .shadows = true},
                           {.kind = LightKind::Point,
                            .position_mm = there.at({80, -60, 90}),
                            .color = {0.5f, 0.5f, 0.5f},
                            .radius_mm = 8 * there.scale,
                            .shadows = true}};
    options.look.light_samples = vulkan ? 8 : 16;
    options.look.occlusion = {vulkan ? 8u : 32u, 20 * there.scale};
    return options;
}

double mean_radiance(const Frame& frame)
{
    double sum = 0;
    for (size_t i = 0; i < frame.face.size(); ++i)
        for (size_t c = 0; c < 3; ++c)
            sum += double(frame.rgba[4 * i + c]);
    return sum / double(3 * frame.face.size());
}

class RayStarts9 : public testing::TestWithParam<bool> {
protected:
    bool vulkan() const { return GetParam(); }
    Frame drawn(const There& there, const RenderOptions& options) const
    {
        const auto tracer = there.scene ? tracer_of(there.scene, vulkan()) : nullptr;
        return tracer ? picture(*tracer, options) : Frame{};
    }
};
INSTANTIATE_TEST_SUITE_P(case_09, RayStarts9, testing::Bool(), tracer_name);

TEST_P(RayStarts9, TheMeanRadianceIsTheSameInEveryUnitAndEverywhere)
{
    for (const oracle::Solid solid : {oracle::Solid::DrilledCylinder, oracle::Solid::Loft}) {
        if (vulkan() && solid == oracle::Solid::Loft)
            continue; // the software driver takes a second a picture
        const There here = there(solid, kHere);
        const Frame first = drawn(here, lit(here, vulkan()));
        if (first.face.empty())
            return;
        EXPECT_GT(mean_radiance(first), 0.02);
        for (const Place& place : places_of(vulkan())) {
            const There away = there(solid, place);
            const Frame frame = drawn(away, lit(away, vulkan()));
            ASSERT_FALSE(frame.face.empty());
            const double off = mean_radiance(frame) / mean_radiance(first) - 1;
            int differ = 0;
            for (size_t i = 0; i < frame.face.size(); ++i)
                differ += std::abs(frame.rgba[4 * i] - first.rgba[4 * i]) > 1e-3f;
            std::cout << fmt::format("{}, {}: mean radiance off by {:.2g}, {} of {} pixels by more than 1e-3\n",
                                     oracle::solid_name(solid), place.name, off, differ, frame.face.size());
            EXPECT_LE(std::abs(off), 1e-4) << place.name;
        }
    }
}

TEST_P(RayStarts9, ARoundedBoxDoesNotShadowItself)
{
    for (const Place& place : places_of(vulkan())) {
        const There box = there(oracle::Solid::RoundedBox, place);
        RenderOptions options = lit(box, vulkan());
        options.look.lights[1].radius_mm = 0;           // lit from its middle without shadows too
        options.look.occlusion = {vulkan() ? 8u : 64u}; // a power of two, so that all of them make exactly 1
        options.look.sky = 1.0f;
        const Frame hidden = drawn(box, options);
        if (hidden.face.empty())
            return;
        options.look.occlusion.samples = 0;
        for (Light& light : options.look.lights)
            light.shadows = false;
        const Frame open = drawn(box, options);
        int seen = 0, darker = 0;
        for (size_t i = 0; i < open.face.size(); ++i) {
            seen += open.face[i] >= 0;
            darker += std::abs(open.rgba[4 * i + 1] - hidden.rgba[4 * i + 1]) > 1e-6f;
        }
        std::cout << fmt::format("{}: {} of {} pixels darker\n", place.name, darker, seen);
        EXPECT_GT(seen, vulkan() ? 300 : 1200);
        EXPECT_EQ(darker, 0) << place.name;
    }
}

/// A point of Solid::Box, of which 0 and kBox are corners, as write_laid_out turns it; and back.
constexpr Vec3 kBox{60, 40, 30};
Vec3 turned(const Vec3& p, double angle)
{
    // Rodrigues
    const Vec3 centre{3, 1, 2}, axis = Vec3{1, 2, 3} * (1 / std::sqrt(14.0)), r = p - centre;
    const double c = std::cos(angle), s = std::sin(angle);
    return centre + r * c + cross(axis, r) * s + axis * (dot(axis, r) * (1 - c));
}
Vec3 in_box(const Vec3& p)
{
    return turned(p, 0.7);
}

/// How far a point of the box's surface is from the nearest edge.
double edge_distance(const Vec3& p)
{
    std::array<double, 3> from{};
    for (size_t i = 0; i < 3; ++i)
        from[i] = std::min(std::abs(p[i]), std::abs(kBox[i] - p[i]));
    std::sort(from.begin(), from.end());
    return from[1];
}

TEST_P(RayStarts9, NoLightLeaksIntoAClosedRoom)
{
    for (const Place& place : places_of(vulkan())) {
        const There room = there(oracle::Solid::Box, place);
        struct View {
            Vec3 eye, target;
            double fov_deg;
        };
        // all of it, and corners from 1 mm and 0.01 mm, where pixels are 1e-4 mm
        for (const View& view : {View{{30, 20, 15}, {0, 0, 0}, 110}, View{{1, 1, 1}, {0, 0, 0}, 80},
                                 View{{59.99, 39.99, 0.01}, {60, 40, 0}, 80}}) {
            if (vulkan() && view.eye[0] > 50)
                continue;
            RenderOptions options = lit(room, vulkan());
            options.camera = {room.at(in_box(view.eye)), room.at(in_box(view.target)), {0, 0, 1}, view.fov_deg};
            options.look.occlusion = {vulkan() ? 8u : 64u};
            options.look.sky = 1.0f;
            const Frame frame = drawn(room, options);
            if (frame.face.empty())
                return;
            // a point that lies within rounding of two walls may be beyond the other one: some dozen times 2^-24 of
            // half the room's diagonal
            constexpr double kRounding_mm = 3e-5;
            const PixelRays rays(options);
            int leaks = 0, at_edges = 0, holes = 0;
            double farthest = 0;
            for (size_t i = 0; i < frame.face.size(); ++i) {
                holes += frame.face[i] < 0;
                if (frame.rgba[4 * i] == 0 && frame.rgba[4 * i + 1] == 0 && frame.rgba[4 * i + 2] == 0)
                    continue;
                const Vec3 p = (rays.hit(frame, i) - room.shift) * (1 / room.scale);
                const double away = edge_distance(turned(p, -0.7));
                farthest = std::max(farthest, away);
                ++(away < kRounding_mm ? at_edges : leaks);
            }
            if (at_edges + leaks > 0)
                std::cout << fmt::format("{}: {} pixels leak, up to {:.2g} mm of {} from an edge\n", place.name,
                                         at_edges + leaks, farthest, kSize_mm);
            EXPECT_EQ(holes, 0) << place.name;
            EXPECT_EQ(leaks, 0) << place.name << " from " << view.eye[0];
            EXPECT_LE(at_edges, view.eye[0] > 50 ? 10 : 0) << place.name;
        }
    }
}

TEST_P(RayStarts9, NoLightLeaksIntoARoomThatASectionOpens)
{
    // the half z > 15 is cut away; all light comes from below, where the walls still are
    for (const Place& place : places_of(vulkan())) {
        const There room = there(oracle::Solid::Box, place);
        const Vec3 up = in_box({0, 0, 1}) - in_box({0, 0, 0});
        RenderOptions options = lit(room, vulkan());
        options.camera = {room.at(in_box({50, 30, 120})), room.at(in_box({30, 20, 15})), {0, 0, 1}, 30};
        options.look.section.planes = {{room.at(in_box({30, 20, 15})), up}};
        options.look.section.caps = CapStyle::None;
        options.look.occlusion = {};
        options.look.sky = 0.0f;
        options.look.lights = {{.direction = up + (in_box({1, 0.4, 0}) - in_box({0, 0, 0})) * 0.4, .shadows = true},
                               {.direction = up, .half_angle_deg = 10, .shadows = true}};
        const Frame frame = drawn(room, options);
        if (frame.face.empty())
            return;
        int inside = 0, leaks = 0;
        for (size_t i = 0; i < frame.face.size(); ++i) {
            inside += frame.face[i] >= 0;
            leaks += frame.rgba[4 * i] > 0;
        }
        EXPECT_GT(inside, vulkan() ? 200 : 800);
        EXPECT_EQ(leaks, 0) << place.name;
    }
}

} // namespace
} // namespace trimray::hard
