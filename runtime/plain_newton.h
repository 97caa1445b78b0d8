// Plain Newton from one start, the paper's own way into a patch: for packets of 16 rays and for one ray. Included once
// per target.
#if defined(TRIMRAY_PLAIN_NEWTON_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_PLAIN_NEWTON_H
#undef TRIMRAY_PLAIN_NEWTON_H
#else
#define TRIMRAY_PLAIN_NEWTON_H
#endif

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
FN PlainEnd plain_newton(EvaluateAt evaluate, Count count, const RayPlanes& planes, const LeafBox& box, scalar enough,
                         real2 uv, mask moving)
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

SHARED_CLOSE
#endif
