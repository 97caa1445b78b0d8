// The paper's own method on the CPU: plain Newton from one start, and hits that are kept from frame to frame. Included
// once per target by cpu_packet.h.
#if defined(TRIMRAY_CPU_STOCHASTIC_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_STOCHASTIC_H
#undef TRIMRAY_CPU_STOCHASTIC_H
#else
#define TRIMRAY_CPU_STOCHASTIC_H
#endif

#include "runtime/cpu_evaluate.h"
#include "runtime/cpu_write.h"
#include "runtime/stochastic_frames.h"
#include "shaders/shared/leaf_box.h"
#include "shaders/shared/patch_newton.h"

SHARED_OPEN

/// Where plain Newton ended.
struct PlainEnd {
    mask settled; // within `enough` of the ray, one step later
    real2 uv;
    SurfacePoint s; // at uv
};

/// Plain Newton from `uv` in the lanes `moving`: ends where a step began within `enough` (patch units) of its ray,
/// after kNewtonSteps, or at the bounds of its leaf's reach. `evaluate(uv)` is the patch's point; `count(lanes)` is
/// told of every step.
template <class EvaluateAt, class Count>
HWY_ATTR PlainEnd plain_newton(EvaluateAt evaluate, Count count, const RayPlanes& planes, const LeafBox& box,
                               scalar enough, real2 uv, mask moving)
{
    const scalar2 middle = leaf_middle(box), half_side = leaf_half_side(box);
    PlainEnd end;
    end.settled = mask(false);
    for (int step = 0; step < kNewtonSteps && any_lane(moving); ++step) {
        const NewtonStep next = newton_step(seen_point(evaluate(uv), planes), uv);
        count(moving);
        const real2 to =
            real2(kept_near(next.uv.x, middle.x, half_side.x), kept_near(next.uv.y, middle.y, half_side.y));
        const mask close = next.residual <= enough, stuck = newton_stuck(next, uv, to);
        uv = select(moving, to, uv);
        end.settled = end.settled || (moving && close);
        moving = moving && !close && !stuck;
    }
    end.uv = uv;
    if (!any_lane(end.settled))
        return end;
    end.s = evaluate(uv);
    end.settled = end.settled && length(seen_point(end.s, planes).r) <= enough;
    return end;
}

FN void load_kept(const KeptPacket& kept, mask alive, PacketHit& hit)
{
    hit.best = select(alive, load(kept.best), hit.best);
    hit.leaf = load(kept.leaf);
    hit.instance = load(kept.instance);
    hit.uv_face = real2(load(kept.u_face), load(kept.v_face));
    hit.normal = real3(load(kept.normal[0]), load(kept.normal[1]), load(kept.normal[2]));
}

/// A pixel changes only where its new hit is nearer than what was kept.
FN void keep_nearer(PacketHit& hit, mask alive, KeptPacket& kept)
{
    PacketHit before = hit;
    load_kept(kept, alive, before);
    const mask nearer = hit.best < before.best;
    hit.best = select(nearer, hit.best, before.best);
    hit.leaf = select(nearer, hit.leaf, before.leaf);
    hit.instance = select(nearer, hit.instance, before.instance);
    hit.uv_face = select(nearer, hit.uv_face, before.uv_face);
    hit.normal = select(nearer, hit.normal, before.normal);
    store(hit.best, kept.best);
    store(hit.leaf, kept.leaf);
    store(hit.instance, kept.instance);
    store(hit.uv_face.x, kept.u_face);
    store(hit.uv_face.y, kept.v_face);
    store(hit.normal.x, kept.normal[0]);
    store(hit.normal.y, kept.normal[1]);
    store(hit.normal.z, kept.normal[2]);
}

SHARED_CLOSE
#endif
