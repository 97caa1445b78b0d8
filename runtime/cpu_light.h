// The light at a packet's hits: lights and their shadows, occlusion. Included once per target by cpu_packet.h; nothing
// here runs for a picture under the light at the eye alone.
#if defined(TRIMRAY_CPU_LIGHT_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_LIGHT_H
#undef TRIMRAY_CPU_LIGHT_H
#else
#define TRIMRAY_CPU_LIGHT_H
#endif

#include "runtime/cpu_free_rays.h"
#include "runtime/cpu_lanes.h"
#include "runtime/cpu_write.h"
#include "shaders/light_layout.h"
#include "shaders/shared/light.h"

SHARED_OPEN

class PacketLight {
public:
    PacketLight(const BlockJob& job, BlockScratch& scratch, const FetchSource& source, WorkCounts& work)
        : job_(job), view_(job.light->view), places_(*job.places), rays_(job, scratch, source, work)
    {
    }

    /// The colours that leave the hits of the eye's rays.
    HWY_ATTR HWY_NOINLINE real3 lit(const Packet& packet, const LitPoints& points)
    {
        const real past = select(points.alive, points.past, real(0.0f));
        return lit_at(places_.at(packet, past), places_.footprint(past), points, view_.mirror_depth);
    }

private:
    /// place: the top tree's units; pixel: its width there; reflections: how many are followed.
    HWY_ATTR HWY_NOINLINE real3 lit_at(real3 place, real pixel, const LitPoints& points, uint reflections)
    {
        const mask turned = dot(points.normal, points.to_eye) < 0.0f;
        const real3 normal = select(turned, -points.normal, points.normal);
        FreePacket rays;
        rays.origin = place + normal * start_distance(place, pixel * view_.error_px);
        rays.footprint = -largest_lane(select(points.alive, -pixel, real(-kHuge)));
        real3 sum =
            points.color * (sky_light(points.normal, points.to_eye) * view_.sky * open_sky(points, normal, rays));
        for (const LightRecord& light : job_.light->lights)
            sum = sum + from_light(light, points, normal, rays);
        if (reflections == 0 || !any_lane(points.alive && points.mirror > 0.0f))
            return sum;
        rays.alive = points.alive && points.mirror > 0.0f;
        rays.direction = normal * (2.0f * dot(normal, points.to_eye)) - points.to_eye;
        const real3 reflected = seen_along(rays, pixel, reflections - 1);
        return select(rays.alive, sum * (1.0f - points.mirror) + reflected * points.mirror, sum);
    }

    /// What rays that leave a mirror see. Surfaces are opaque there, and sections have no caps.
    HWY_ATTR real3 seen_along(FreePacket& rays, real pixel, uint reflections)
    {
        rays.reach = real(kHuge);
        const PacketHit hit = rays_.closest(rays);
        const mask hits = rays.alive && hit.leaf != integer(~0u);
        real3 seen(vector(view_.background));
        if (job_.environment && any_lane(rays.alive && !hits))
            seen = environment_along(*job_.environment, rays.direction);
        if (!any_lane(hits))
            return seen;
        const PacketShading shading = shade_leaves<true>(job_, hit, lane_bits(hits));
        const real size = length(shading.normal);
        const mask has_normal = size > 0.0f && hits;
        LitPoints points;
        points.past = real(0.0f);
        points.to_eye = -rays.direction;
        points.normal =
            select(has_normal, shading.normal * (1.0f / select(has_normal, size, real(1.0f))), points.to_eye);
        points.color = shading.color;
        points.specular = shading.specular;
        points.mirror = shading.mirror;
        points.alive = hits;
        const real3 place = rays.origin + rays.direction * select(hits, hit.best, real(0.0f));
        return select(hits, lit_at(place, pixel, points, reflections), seen);
    }

    static scalar3 vector(const float (&v)[3]) { return scalar3(v[0], v[1], v[2]); }

    /// The share of the sky that nothing within reach hides.
    HWY_ATTR real open_sky(const LitPoints& points, real3 normal, FreePacket& rays)
    {
        const uint count = view_.occlusion_samples;
        if (count == 0)
            return real(1.0f);
        rays.alive = points.alive;
        rays.reach = real(view_.occlusion_reach);
        const float* disc = job_.light->samples.data() + 2 * view_.light_samples;
        real open(0.0f);
        for (uint i = 0; i < count; ++i) {
            const real2 at = turned(disc[2 * i], disc[2 * i + 1]);
            rays.direction = cosine_direction(normal, at.x, at.y);
            open = open + select(rays_.stopped(rays), real(0.0f), real(1.0f));
        }
        return open * real(1.0f / float(count));
    }

    HWY_ATTR real3 from_light(const LightRecord& light, const LitPoints& points, real3 normal, FreePacket& rays)
    {
        const scalar3 strength = vector(light.color);
        const uint kind = light.kind & 3u;
        if (kind == kLightEye)
            return scaled(lit_by(points.color, points.specular, normal, points.to_eye, points.to_eye), strength);
        const uint count = (light.kind & kLightSoft) != 0 ? view_.light_samples : 1;
        const real3 middle = kind == kLightPoint ? vector(light.place) - rays.origin : real3(vector(light.place));
        real3 sum(real(0.0f), real(0.0f), real(0.0f));
        for (uint i = 0; i < count; ++i) {
            real3 way = middle;
            if ((light.kind & kLightSoft) != 0) {
                const float* disc = job_.light->samples.data() + 2 * i;
                way = way_to_disc(middle, light.radius, turned(disc[0], disc[1]));
            }
            const real far = length(way);
            rays.direction = way * (1.0f / max(far, real(1e-20f)));
            const real3 lit = lit_by(points.color, points.specular, normal, points.to_eye, rays.direction);
            const mask faces = points.alive && dot(normal, rays.direction) > 0.0f;
            mask dark = !faces;
            if ((light.kind & kLightShadows) != 0 && any_lane(faces)) {
                rays.alive = faces;
                rays.reach = kind == kLightPoint ? far : real(kHuge);
                dark = dark || rays_.stopped(rays);
            }
            const real none(0.0f);
            sum = sum + select(dark, real3(none, none, none), lit);
        }
        return scaled(sum, strength * (1.0f / float(count)));
    }

    /// A sample's point of the disc, turned by the pixel: lanes are 4 x 4 of them.
    HWY_ATTR real2 turned(float x, float y) const
    {
        return turned_sample(real2(scalar2(x, y)), load(view_.turn_cos), load(view_.turn_sin));
    }

    static HWY_ATTR real3 scaled(real3 v, scalar3 by) { return real3(v.x * by.x, v.y * by.y, v.z * by.z); }

    const BlockJob& job_;
    const LightView& view_;
    const PixelPlaces places_;
    FreeTracer rays_;
};

SHARED_CLOSE
#endif
