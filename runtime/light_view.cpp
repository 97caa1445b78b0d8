#include "runtime/light_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trimray {
namespace {

using Vec3 = std::array<double, 3>;

Vec3 scaled(const Vec3& v, double s)
{
    return {v[0] * s, v[1] * s, v[2] * s};
}

Vec3 unit(const Vec3& v)
{
    const double largest = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
    const Vec3 w = scaled(v, 1 / largest);
    return scaled(w, 1 / std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]));
}

void store(const Vec3& v, float (&out)[3])
{
    for (size_t i = 0; i < 3; ++i)
        out[i] = float(v[i]);
}

bool is_finite(const Vec3& v)
{
    return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

/// Points of the unit disc, every part of its area alike. Source: Vogel's spiral.
void add_disc(uint32_t count, std::vector<float>& samples)
{
    const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
    for (uint32_t i = 0; i < count; ++i) {
        const double r = std::sqrt((i + 0.5) / count), angle = golden_angle * i;
        samples.push_back(float(r * std::cos(angle)));
        samples.push_back(float(r * std::sin(angle)));
    }
}

bool is_soft(const Light& light)
{
    return light.shadows && (light.kind == LightKind::Directional ? light.half_angle_deg : light.radius_mm) > 0;
}

LightRecord light_record(const PlacementView& placed, const Light& light)
{
    LightRecord record{};
    std::copy(light.color.begin(), light.color.end(), record.color);
    switch (light.kind) {
    case LightKind::Eye:
        record.kind = kLightEye;
        return record;
    case LightKind::Directional:
        record.kind = kLightDirectional;
        store(scaled(unit(light.direction), -1), record.place);
        record.radius = float(std::tan(light.half_angle_deg * std::numbers::pi / 180));
        break;
    case LightKind::Point:
        record.kind = kLightPoint;
        for (size_t i = 0; i < 3; ++i)
            record.place[i] = float((light.position_mm[i] - placed.world_origin_mm[i]) / placed.world_scale_mm);
        record.radius = float(light.radius_mm / placed.world_scale_mm);
        break;
    }
    record.kind |= (light.shadows ? kLightShadows : 0) | (is_soft(light) ? kLightSoft : 0);
    return record;
}

Status check_light(const Light& light, size_t number)
{
    const auto wrong = [&](const char* what) { return Error{ErrorCode::Usage, fmt::format("light {}", number), what}; };
    if (light.kind == LightKind::Directional &&
        (!is_finite(light.direction) ||
         (light.direction[0] == 0 && light.direction[1] == 0 && light.direction[2] == 0)))
        return wrong("its direction must be three finite numbers, not all 0");
    if (light.kind == LightKind::Point && !is_finite(light.position_mm))
        return wrong("its position must be three finite numbers");
    if (!(light.half_angle_deg >= 0 && light.half_angle_deg <= 60))
        return wrong("half the angle that it is seen under must be in [0, 60] degrees");
    if (!(light.radius_mm >= 0 && std::isfinite(light.radius_mm)))
        return wrong("its radius must be finite and not below 0");
    for (const float channel : light.color)
        if (!(channel >= 0 && std::isfinite(channel)))
            return wrong("its colour must be finite and not below 0");
    return Done{};
}

/// Bands that a map mirrors in surfaces are seen whatever the lights are.
bool shows_light(const SceneLook& look)
{
    return look.map.map != SurfaceMap::Zebra && look.map.map != SurfaceMap::Isophotes;
}

} // namespace

bool has_mirrors(const SceneLook& look)
{
    return std::any_of(look.materials.begin(), look.materials.end(),
                       [](const MaterialRule& rule) { return rule.material.mirror.value_or(0) > 0; });
}

bool has_lights(const SceneLook& look)
{
    return shows_light(look) && (!look.lights.empty() || look.occlusion.samples > 0 || look.sky || has_mirrors(look));
}

bool has_light_rays(const SceneLook& look)
{
    const auto throws_shadows = [](const Light& light) { return light.shadows; };
    return shows_light(look) &&
           (look.occlusion.samples > 0 || std::any_of(look.lights.begin(), look.lights.end(), throws_shadows));
}

Status check_lights(const SceneLook& look)
{
    if (look.lights.size() > kMostLights)
        return Error{ErrorCode::Usage, "lights",
                     fmt::format("{} of them; at most {}", look.lights.size(), kMostLights)};
    for (size_t i = 0; i < look.lights.size(); ++i)
        if (const Status valid = check_light(look.lights[i], i); !valid.ok())
            return valid;
    if (look.light_samples == 0 || look.light_samples > kMostRaysAPixel)
        return Error{ErrorCode::Usage, "light samples",
                     fmt::format("expected 1 to {}, found {}", kMostRaysAPixel, look.light_samples)};
    if (look.occlusion.samples > kMostRaysAPixel)
        return Error{ErrorCode::Usage, "ambient occlusion",
                     fmt::format("at most {} rays a pixel, found {}", kMostRaysAPixel, look.occlusion.samples)};
    if (!(look.occlusion.reach_mm > 0))
        return Error{ErrorCode::Usage, "ambient occlusion",
                     fmt::format("its reach must be above 0 mm, found {}", look.occlusion.reach_mm)};
    if (look.sky && !(*look.sky >= 0 && double(*look.sky) <= kMostSky))
        return Error{ErrorCode::Usage, "sky",
                     fmt::format("its strength must be in [0, {}], found {}", kMostSky, *look.sky)};
    if (look.mirror_depth > kMostMirrorDepth)
        return Error{ErrorCode::Usage, "mirror depth",
                     fmt::format("expected at most {}, found {}", kMostMirrorDepth, look.mirror_depth)};
    return Done{};
}

PlaceView place_view(const PlacementView& placed, const ViewRays& rays)
{
    const double per_scale = 1 / placed.world_scale_mm;
    PlaceView view{};
    Vec3 place;
    for (size_t i = 0; i < 3; ++i)
        place[i] = (rays.eye_mm[i] + rays.tau_ref * rays.w0[i] - placed.world_origin_mm[i]) * per_scale;
    store(place, view.place);
    store(scaled(rays.step_x, rays.tau_ref * per_scale), view.place_x);
    store(scaled(rays.step_y, rays.tau_ref * per_scale), view.place_y);
    store(scaled(rays.w0, per_scale), view.along);
    store(scaled(rays.step_x, per_scale), view.along_x);
    store(scaled(rays.step_y, per_scale), view.along_y);
    view.tau_ref = float(rays.tau_ref);
    view.pixel = float(std::hypot(rays.step_x[0], rays.step_x[1], rays.step_x[2]) * per_scale);
    view.per_mm = float(per_scale);
    return view;
}

FrameLights frame_lights(const PlacementView& placed, const RenderOptions& options)
{
    const SceneLook& look = options.look;
    const double per_scale = 1 / placed.world_scale_mm;
    FrameLights out{};
    LightView& view = out.view;
    view.error_px = options.error_px;
    const std::array<float, 3> background = look.background.value_or(std::array<float, 3>{});
    std::copy(background.begin(), background.end(), view.background);
    for (uint32_t i = 0; i < kTurns; ++i) {
        // neighbours turned by unlike angles: a step of 7 goes through all 16
        const double angle = 2 * std::numbers::pi * (7 * i % kTurns) / kTurns;
        view.turn_cos[i] = float(std::cos(angle));
        view.turn_sin[i] = float(std::sin(angle));
    }
    for (const Light& light : look.lights)
        out.lights.push_back(light_record(placed, light));
    const bool hides = look.occlusion.samples > 0 && look.lights.empty();
    view.sky = look.sky.value_or(hides ? 3.0f : 1.0f);
    if (out.lights.empty()) {
        const float eye = hides ? 0.4f : 1.0f;
        out.lights.push_back(light_record(placed, {.kind = LightKind::Eye, .color = {eye, eye, eye}}));
    }
    view.light_count = uint32_t(out.lights.size());
    const bool soft = std::any_of(look.lights.begin(), look.lights.end(), is_soft);
    view.light_samples = soft ? look.light_samples : 0;
    view.occlusion_samples = look.occlusion.samples;
    const double reach = look.occlusion.reach_mm * per_scale;
    view.occlusion_reach = reach < 1e30 ? float(reach) : 1e30f;
    view.mirror_depth = look.mirror_depth;
    add_disc(view.light_samples, out.samples);
    add_disc(view.occlusion_samples, out.samples);
    return out;
}

std::vector<WorldToPart> world_to_part(const PlacementView& placed)
{
    std::vector<WorldToPart> out;
    out.reserve(placed.instances.size());
    for (const InstanceRecord& instance : placed.instances) {
        const PartRecord& part = placed.parts[instance.part];
        const double* m = instance.transform;
        // part mm -> world mm; rows of its inverse are cross products of its columns over the determinant
        const double a[3] = {m[0], m[4], m[8]}, b[3] = {m[1], m[5], m[9]}, c[3] = {m[2], m[6], m[10]};
        const auto cross = [](const double(&p)[3], const double(&q)[3]) -> Vec3 {
            return {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
        };
        const std::array<Vec3, 3> rows{cross(b, c), cross(c, a), cross(a, b)};
        const double determinant = a[0] * rows[0][0] + a[1] * rows[0][1] + a[2] * rows[0][2];
        WorldToPart to{};
        float* const row_out[3] = {to.row_x, to.row_y, to.row_z};
        for (size_t i = 0; i < 3; ++i) {
            const Vec3 row = scaled(rows[i], 1 / (determinant * part.scale_mm));
            double offset = -part.origin_mm[i] / part.scale_mm;
            for (size_t j = 0; j < 3; ++j) {
                offset += row[j] * (placed.world_origin_mm[j] - m[4 * j + 3]);
                row_out[i][j] = float(row[j] * placed.world_scale_mm);
            }
            to.offset[i] = float(offset);
        }
        to.scale = float(placed.world_scale_mm / (part.scale_mm * std::cbrt(std::abs(determinant))));
        out.push_back(to);
    }
    return out;
}

} // namespace trimray
