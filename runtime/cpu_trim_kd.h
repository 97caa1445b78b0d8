// A packet's rays in the kd-tree baseline. They go down the tree together and part where a plane divides them; few
// packets do, so nodes, runs and points are read once for all lanes that need them. Included once per target.
#if defined(TRIMRAY_CPU_TRIM_KD_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_TRIM_KD_H
#undef TRIMRAY_CPU_TRIM_KD_H
#else
#define TRIMRAY_CPU_TRIM_KD_H
#endif

#include "runtime/cpu_fetch.h"
#include "shaders/shared/trim_kd.h"

SHARED_OPEN

/// crossed(run) of kd_layout.h in the lanes `asked`. `first_point` is the run's.
FN mask kd_crossed(const FetchSource& source, uint first_point, KdRun run, real2 uv, mask asked)
{
    const uint stride = kd_stride(run);
    const bool cubic = stride == 3;
    const scalar2 a = fetch_kd_point(FETCH_PASS first_point);
    const scalar2 b = fetch_kd_point(FETCH_PASS first_point + run.piece_count * stride);
    mask crossed = kd_crossed_beside(run, a, b, uv);
    mask open = asked && kd_in_box(a, b, uv);
    if (!any_lane(open))
        return crossed;
    if (run.piece_count == 1)
        return crossed || (open && kd_left_of_piece(FETCH_PASS first_point, cubic, uv, open));
    // one piece at a time, for all lanes beside it
    alignas(64) float v[kLanes];
    store(uv.y, v);
    for (uint left = lane_bits(open); left != 0;) {
        const uint piece = kd_piece_at(FETCH_PASS first_point, stride, run.piece_count, v[__builtin_ctz(left)]);
        const uint first = first_point + piece * stride;
        const mask here =
            open && fetch_kd_point(FETCH_PASS first).y <= uv.y && uv.y < fetch_kd_point(FETCH_PASS first + stride).y;
        crossed = crossed || (here && kd_left_of_piece(FETCH_PASS first, cubic, uv, here));
        left &= ~lane_bits(here);
    }
    return crossed;
}

/// What a leaf says of the lanes `here`.
FN mask inside_kd_leaf(const FetchSource& source, const KdFace& face, KdNode leaf, real2 uv, mask here)
{
    mask inside((leaf.word & kKdInside) != 0);
    const bool single = (leaf.word & kKdKindMask) == kKdLeafRun;
    for (uint i = 0; i < kd_run_count(leaf); ++i) {
        const KdRun run =
            single ? KdRun{leaf.data, kd_number(leaf)} : source.kd->runs[size_t(face.first_run) + leaf.data + i];
        const uint first_point = face.first_point + (run.word >> kKdPointShift);
        inside = differ(inside, kd_crossed(source, first_point, run, uv, here));
    }
    return inside;
}
/// Lanes of `asked` that lie inside the face's trims; the answer of other lanes means nothing. uv in [0, kUvBelowOne]
/// in those lanes.
FN_LARGE mask inside_kd(const FetchSource& source, const KdFace& face, real2 uv, mask asked, uint64_t& curve_tests)
{
    struct Waiting {
        uint node, lanes;
    };
    Waiting waiting[kMaxKdDepth];
    uint waiting_count = 0;
    const KdNode* nodes = source.kd->nodes.data() + face.first_node;
    const uint all = lane_bits(asked);
    mask inside(false);
    uint at = 0, lanes = all;
    for (;;) {
        const KdNode node = nodes[at];
        if (!kd_is_leaf(node)) {
            const uint beyond = lane_bits((kd_splits_v(node) ? uv.y : uv.x) >= bits_to_scalar(node.data)) & lanes;
            at = kd_number(node) + (beyond != 0);
            if (beyond != 0 && beyond != lanes)
                waiting[waiting_count++] = {kd_number(node), lanes & ~beyond};
            lanes = beyond != 0 ? beyond : lanes;
            continue;
        }
        const mask here = lanes == all ? asked : (integer(lanes) >> lane_numbers() & integer(1u)) != integer(0u);
        curve_tests += uint64_t(__builtin_popcount(lanes)) * kd_run_count(node);
        inside = inside || (here && inside_kd_leaf(source, face, node, uv, here));
        if (waiting_count == 0)
            return inside;
        at = waiting[--waiting_count].node;
        lanes = waiting[waiting_count].lanes;
    }
}

SHARED_CLOSE
#endif
