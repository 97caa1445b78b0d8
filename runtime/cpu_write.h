// A packet's hits -> the frame: normals and colours per leaf that was hit, shading, and the pixels' places in memory.
// Included once per target by cpu_packet.h.
#if defined(TRIMRAY_CPU_WRITE_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_WRITE_H
#undef TRIMRAY_CPU_WRITE_H
#else
#define TRIMRAY_CPU_WRITE_H
#endif

#include "format/pack_layout.h"
#include "runtime/cpu_lanes.h"
#include "shaders/shared/language.h"
#include "shaders/shared/shading.h"

#include <algorithm>
#include <limits>

SHARED_OPEN

// The nearest hits so far of a packet's rays
struct PacketHit {
    real best;        // tau - tau_ref in mm; kHuge: none
    integer leaf;     // of the pack
    integer instance; // ~0: none
    real2 uv_face;
    real3 normal; // S_u x S_v in patch space, right-handed axes, any length
    mask doubt;   // a leaf's Newton did not settle
};

struct Packet {
    real x; // pixels from the picture's centre
    real y;
    mask alive;
};

/// What the hits look like in the world, lane by lane.
struct PacketShading {
    real3 normal; // outward, any length
    real3 color;  // linear
    real2 uv_file;
    integer face;
    mask certified;
};

FN real3 to_world(const float (&m)[3][3], real3 n)
{
    return real3(m[0][0] * n.x + m[0][1] * n.y + m[0][2] * n.z, m[1][0] * n.x + m[1][1] * n.y + m[1][2] * n.z,
                 m[2][0] * n.x + m[2][1] * n.y + m[2][2] * n.z);
}

/// One leaf at a time, in all the lanes that hit it.
[[maybe_unused]] static HWY_ATTR HWY_NOINLINE PacketShading shade_leaves(const BlockJob& job, const PacketHit& hit,
                                                                         uint hit_lanes)
{
    const PackImage& image = job.scene.image;
    alignas(64) uint leaves[kLanes], instances[kLanes];
    store(hit.leaf, leaves);
    store(hit.instance, instances);
    PacketShading out;
    out.normal = real3(real(0.0f), real(0.0f), real(0.0f));
    out.color = out.normal;
    out.uv_file = real2(real(0.0f), real(0.0f));
    out.face = integer(~0u);
    out.certified = mask(true);
    for (uint left = hit_lanes; left != 0;) {
        const int lane = __builtin_ctz(left);
        const uint leaf_id = leaves[lane], instance_id = instances[lane];
        const mask here = hit.leaf == integer(leaf_id) && hit.instance == integer(instance_id);
        left &= ~lane_bits(here);
        const LeafRecord& leaf = image.leaves[leaf_id];
        const PatchRecord& patch = image.patches[leaf.patch];
        const FaceRecord& face = image.faces[patch.face];
        const float turn =
            ((face.flags & kFaceReversed) != 0) != (job.scene.left_handed[leaf.patch] != 0) ? -1.0f : 1.0f;
        const scalar3 x(patch.axis_x[0], patch.axis_x[1], patch.axis_x[2]);
        const scalar3 y(patch.axis_y[0], patch.axis_y[1], patch.axis_y[2]);
        const scalar3 z(patch.axis_z[0], patch.axis_z[1], patch.axis_z[2]);
        const real3 in_part = combine(x, y, z, hit.normal * real(turn));
        out.normal = select(here, to_world(job.view.instances[instance_id].normal, in_part), out.normal);
        const float* color = (face.flags & kFaceHasColor) != 0 ? job.scene.face_color[patch.face].data()
                                                               : job.scene.instance_color[instance_id].data();
        out.color = select(here, real3(scalar3(color[0], color[1], color[2])), out.color);
        const float lo[2] = {float(face.domain_lo[0]), float(face.domain_lo[1])};
        const float size[2] = {float(face.domain_hi[0] - face.domain_lo[0]),
                               float(face.domain_hi[1] - face.domain_lo[1])};
        out.uv_file =
            select(here, real2(lo[0] + size[0] * hit.uv_face.x, lo[1] + size[1] * hit.uv_face.y), out.uv_file);
        out.face = select(here, integer(patch.face), out.face);
        if ((leaf.quat_z_flags >> 16 & kLeafFlagged) != 0)
            out.certified = out.certified && !here;
    }
    return out;
}

[[maybe_unused]] static HWY_ATTR void write_packet(const BlockJob& job, const Packet& packet, const PacketHit& hit,
                                                   uint32_t x, uint32_t y, const Block& tile, Frame& frame,
                                                   WorkCounts& work)
{
    const mask hits = packet.alive && hit.best < kHuge;
    const uint hit_lanes = lane_bits(hits);
    const PacketShading shading = shade_leaves(job, hit, hit_lanes);
    const View& view = job.view;
    const scalar3 w0(float(view.w0[0]), float(view.w0[1]), float(view.w0[2]));
    const scalar3 step_x(float(view.step_x[0]), float(view.step_x[1]), float(view.step_x[2]));
    const scalar3 step_y(float(view.step_y[0]), float(view.step_y[1]), float(view.step_y[2]));
    const real3 along = w0 + packet.x * step_x + packet.y * step_y;
    const real speed = length(along);
    const real depth =
        select(hits, (float(view.tau_ref) + hit.best) * speed, real(std::numeric_limits<float>::infinity()));
    const real size = length(shading.normal);
    const mask has_normal = size > 0.0f && hits;
    real3 normal = shading.normal * (1.0f / select(has_normal, size, real(1.0f)));
    // a surface without a normal faces the eye
    const real3 to_eye = along * (-1.0f / speed);
    normal = select(has_normal, normal, to_eye);
    const real3 color = shade(shading.color, normal, to_eye);
    const mask certified = shading.certified && !hit.doubt;

    alignas(64) float depths[kLanes], normals[3][kLanes], colors[3][kLanes], uvs[2][kLanes];
    alignas(64) uint faces[kLanes], instances[kLanes];
    const uint certified_lanes = lane_bits(certified);
    store(depth, depths);
    store(normal.x, normals[0]);
    store(normal.y, normals[1]);
    store(normal.z, normals[2]);
    store(color.x, colors[0]);
    store(color.y, colors[1]);
    store(color.z, colors[2]);
    store(shading.uv_file.x, uvs[0]);
    store(shading.uv_file.y, uvs[1]);
    store(shading.face, faces);
    store(hit.instance, instances);
    const uint32_t columns = std::min(4u, tile.x1 - x), rows = std::min(4u, tile.y1 - y);
    for (uint32_t row = 0; row < rows; ++row) {
        for (uint32_t column = 0; column < columns; ++column) {
            const uint32_t lane = row * 4 + column;
            const size_t pixel = size_t(y + row) * frame.width + x + column;
            const bool is_hit = (hit_lanes >> lane & 1u) != 0;
            const bool is_certified = (certified_lanes >> lane & 1u) != 0;
            frame.depth_mm[pixel] = depths[lane];
            frame.face[pixel] = int32_t(is_hit ? faces[lane] : ~0u);
            frame.instance[pixel] = int32_t(is_hit ? instances[lane] : ~0u);
            frame.certified[pixel] = is_certified;
            work.uncertified_pixels += !is_certified;
            for (size_t c = 0; c < 3; ++c) {
                frame.normal[3 * pixel + c] = is_hit ? normals[c][lane] : 0.0f;
                frame.rgba[4 * pixel + c] = is_hit && job.shade ? colors[c][lane] : 0.0f;
            }
            frame.rgba[4 * pixel + 3] = is_hit ? 1.0f : 0.0f;
            for (size_t c = 0; c < 2; ++c)
                frame.uv[2 * pixel + c] = is_hit ? uvs[c][lane] : 0.0f;
        }
    }
}

SHARED_CLOSE
#endif
