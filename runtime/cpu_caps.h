// Section planes on the CPU: where the eye's rays begin and end, and the caps that close what is cut open. A point of a
// plane is inside of a solid where more surfaces leave than enter on the way from it to infinity. Included once per
// target by cpu_packet.h; nothing here runs without section planes.
#if defined(TRIMRAY_CPU_CAPS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_CAPS_H
#undef TRIMRAY_CPU_CAPS_H
#else
#define TRIMRAY_CPU_CAPS_H
#endif

#include "runtime/cpu_free_rays.h"
#include "runtime/cpu_lanes.h"
#include "runtime/cpu_write.h"
#include "shaders/shared/light.h"
#include "shaders/shared/section.h"

#include <algorithm>

SHARED_OPEN

class CapFinder {
public:
    CapFinder(const BlockJob& job, BlockScratch& scratch, const FetchSource& source, WorkCounts& work)
        : job_(job), section_(*job.section), places_(*job.places), walk_(job, scratch, source, work)
    {
    }

    /// What the planes leave of the pixels' rays.
    HWY_ATTR CutSpan span(const Packet& packet) const
    {
        CutSpan span{real(-float(job_.view.depth_ref)), real(kHuge), integer(kNoPlane)};
        for (uint i = 0; i < section_.count; ++i) {
            const SectionPlaneView& plane = section_.planes[i];
            span = cut_by(span, plane.at + packet.x * plane.at_x + packet.y * plane.at_y,
                          plane.rise + packet.x * plane.rise_x + packet.y * plane.rise_y, i);
        }
        return span;
    }

    /// Makes the caps of rays that begin at planes hits without a leaf, and tells what they look like.
    HWY_ATTR HWY_NOINLINE PacketCaps find(const Packet& packet, const CutSpan& span, PacketHit& hit)
    {
        PacketCaps caps;
        caps.normal = caps.color = real3(real(0.0f), real(0.0f), real(0.0f));
        caps.uv = real2(real(0.0f), real(0.0f));
        const mask asked = packet.alive && span.plane != integer(kNoPlane) && span.begin < span.end;
        caps.past = select(asked, span.begin, real(0.0f));
        caps.plane = span.plane;
        caps.here = caps.doubtful = mask(false);
        caps.instance = integer(~0u);
        if (section_.caps == kCapsNone || !any_lane(asked))
            return caps;
        FreePacket rays;
        rays.origin = places_.at(packet, caps.past);
        rays.footprint = -largest_lane(select(asked, -places_.footprint(caps.past), real(-kHuge)));
        rays.reach = real(kHuge);
        const real3 along = places_.along(packet);
        const real3 ahead = along * (1.0f / length(along));
        alignas(64) uint instances[kLanes], leaves[kLanes];
        std::fill_n(leaves, kLanes, ~0u);
        // the eye's direction first: what it meets next has the cap's colour. A second one must agree, or a third
        // decides
        uint yes[kInsideQuestions] = {};
        uint open = lane_bits(asked), lost = 0;
        const uint all = open;
        for (uint question = 0; question < kInsideQuestions && open != 0; ++question) {
            rays.alive = lanes_of(open);
            rays.direction = question == 0 ? ahead : real3(inside_direction(question));
            yes[question] = ask(rays, open, instances, leaves);
            lost |= crossings_.lost;
            if (question == 1)
                open &= yes[0] ^ yes[1];
        }
        const uint disagree = (yes[0] ^ yes[1]) & all;
        const uint inside = (yes[0] & yes[1]) | (disagree & yes[2]);
        caps.here = lanes_of(inside);
        caps.doubtful = lanes_of(disagree | lost);
        describe(caps, inside, rays, ahead, instances, leaves);
        const real certain(job_.stochastic ? -kHuge : kHuge); // plain Newton claims nothing
        hit.best = select(caps.here, caps.past, hit.best);
        hit.leaf = select(caps.here, integer(~0u), hit.leaf);
        hit.instance = select(caps.here, caps.instance, hit.instance);
        hit.doubt = select(caps.doubtful, real(-kHuge), select(caps.here, certain, hit.doubt));
        return caps;
    }

private:
    /// Lanes of `asked` that are inside. Those without a leaf get the one that is left next, and its instance.
    HWY_ATTR uint ask(const FreePacket& rays, uint asked, uint* instances, uint* leaves)
    {
        Crossings& crossings = crossings_;
        std::fill_n(crossings.count, kLanes, 0u);
        crossings.lost = 0;
        crossings.per_mm = job_.places->per_mm;
        walk_.trace(rays, false, &crossings);
        uint inside = 0;
        for (uint left = asked; left != 0; left &= left - 1) {
            const int lane = __builtin_ctz(left);
            int depth = 0;
            for (uint i = 0; i < crossings.count[lane]; ++i)
                depth += (crossings.what[lane][i] & kCrossingLeaves) != 0 ? 1 : -1;
            if (depth <= 0)
                continue;
            inside |= 1u << lane;
            if (leaves[lane] == ~0u)
                next_left(crossings, lane, instances[lane], leaves[lane]);
        }
        return inside;
    }

    /// The nearest crossing out of an instance that is left more often than it is entered.
    static void next_left(const Crossings& crossings, int lane, uint& instance, uint& leaf)
    {
        float nearest = kHuge;
        for (uint i = 0; i < crossings.count[lane]; ++i) {
            const uint what = crossings.what[lane][i];
            if ((what & kCrossingLeaves) == 0 || crossings.at[lane][i] >= nearest)
                continue;
            int depth = 0;
            for (uint j = 0; j < crossings.count[lane]; ++j)
                if (crossings.what[lane][j] >> 1 == what >> 1)
                    depth += (crossings.what[lane][j] & kCrossingLeaves) != 0 ? 1 : -1;
            if (depth <= 0)
                continue;
            nearest = crossings.at[lane][i];
            instance = what >> 1;
            leaf = crossings.leaf[lane][i];
        }
    }

    /// What the caps `inside` look like.
    HWY_ATTR void describe(PacketCaps& caps, uint inside, const FreePacket& rays, real3 to_eye, const uint* instances,
                           const uint* leaves) const
    {
        alignas(64) float red[kLanes] = {}, green[kLanes] = {}, blue[kLanes] = {};
        for (uint left = inside; left != 0; left &= left - 1) {
            const int lane = __builtin_ctz(left);
            const uint face = job_.scene.image.patches[job_.scene.image.leaves[leaves[lane]].patch].face;
            const float* color = section_.has_color != 0 ? section_.color : color_of<true>(job_, face, instances[lane]);
            red[lane] = color[0];
            green[lane] = color[1];
            blue[lane] = color[2];
        }
        caps.color = real3(load(red), load(green), load(blue));
        caps.instance = select(lanes_of(inside), load(instances), integer(~0u));
        const real width = places_.footprint(caps.past);
        const mask odd = (caps.instance & integer(1u)) != integer(0u);
        for (uint i = 0; i < section_.count; ++i) {
            const SectionPlaneView& plane = section_.planes[i];
            const mask here = lanes_of(inside) && caps.plane == integer(i);
            if (!any_lane(here))
                continue;
            const real3 normal(vector(plane.normal));
            const real u = dot(real3(vector(plane.across)), rays.origin),
                       v = dot(real3(vector(plane.along)), rays.origin);
            caps.normal = select(here, normal, caps.normal);
            const float mm = 1 / job_.places->per_mm;
            caps.uv = select(here, real2(u * mm, v * mm), caps.uv);
            if (section_.caps != kCapsHatched)
                continue;
            const real slant = max(abs(dot(normal, to_eye)), real(0.05f));
            const real hatch =
                hatch_at(u * (1 / section_.hatch), v * (1 / section_.hatch), odd, width * (1 / section_.hatch) / slant);
            caps.color = select(here, caps.color * (1.0f - kHatchDarkens * hatch), caps.color);
        }
    }

    static scalar3 vector(const float (&v)[3]) { return scalar3(v[0], v[1], v[2]); }

    const BlockJob& job_;
    const SectionView& section_;
    const PixelPlaces places_;
    FreeWalk walk_;
    Crossings crossings_;
};

SHARED_CLOSE
#endif
