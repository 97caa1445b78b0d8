// One ray in the kd-tree over a face's trims (format/kd_layout.h).
#pragma once

#include "runtime/cpu_fetch.h"
#include "shaders/shared/trim_kd.h"

SHARED_OPEN

/// crossed(run) of kd_layout.h. `first_point` is the run's.
FN bool kd_crossed(const FetchSource& source, uint first_point, KdRun run, real2 uv)
{
    const uint stride = kd_stride(run);
    const scalar2 a = fetch_kd_point(FETCH_PASS first_point);
    const scalar2 b = fetch_kd_point(FETCH_PASS first_point + run.piece_count * stride);
    if (!kd_in_box(a, b, uv))
        return kd_crossed_beside(run, a, b, uv);
    const uint piece = kd_piece_at(FETCH_PASS first_point, stride, run.piece_count, uv.y);
    return kd_left_of_piece(FETCH_PASS first_point + piece * stride, stride == 3, uv, true);
}

/// Whether uv lies inside the face's trims. Domain: uv in [0, kUvBelowOne]^2
FN_LARGE bool inside_kd(const FetchSource& source, const KdFace& face, real2 uv, uint64_t& curve_tests)
{
    const KdNode* nodes = source.kd->nodes.data() + face.first_node;
    KdNode node = nodes[0];
    while (!kd_is_leaf(node)) {
        const bool beyond = (kd_splits_v(node) ? uv.y : uv.x) >= bits_to_scalar(node.data);
        node = nodes[kd_number(node) + beyond];
    }
    bool inside = (node.word & kKdInside) != 0;
    const bool single = (node.word & kKdKindMask) == kKdLeafRun;
    const uint run_count = kd_run_count(node);
    for (uint i = 0; i < run_count; ++i) {
        const KdRun run =
            single ? KdRun{node.data, kd_number(node)} : source.kd->runs[size_t(face.first_run) + node.data + i];
        inside = inside != kd_crossed(source, face.first_point + (run.word >> kKdPointShift), run, uv);
    }
    curve_tests += run_count;
    return inside;
}

SHARED_CLOSE
