// A ray's hit -> the frame: what runtime/cpu_write.h does for packets.
#pragma once

#include "runtime/face_colors.h"
#include "runtime/measure/one_ray_hits.h"
#include "shaders/shared/shading.h"

#include <algorithm>
#include <limits>

SHARED_OPEN

FN void write_miss(size_t pixel, Frame& frame)
{
    frame.depth_mm[pixel] = std::numeric_limits<float>::infinity();
    frame.face[pixel] = frame.instance[pixel] = -1;
    frame.certified[pixel] = 0;
    for (size_t i = 0; i < 4; ++i)
        frame.rgba[4 * pixel + i] = 0;
    for (size_t i = 0; i < 3; ++i)
        frame.normal[3 * pixel + i] = 0;
    frame.uv[2 * pixel] = frame.uv[2 * pixel + 1] = 0;
}

FN void write_hit(const FrameJob& job, Pixel at, const NearestHit& hit, bool shaded, size_t pixel, Frame& frame)
{
    const auto vector = [](const auto& v) { return real3(float(v[0]), float(v[1]), float(v[2])); };
    const PackImage& image = job.scene.image;
    const uint patch_id = job.opened.leaves[hit.leaf].patch;
    const PatchRecord& patch = image.patches[patch_id];
    const FaceRecord& face = image.faces[patch.face];
    const real3 in_part = combine(vector(patch.axis_x), vector(patch.axis_y), vector(patch.axis_z),
                                  hit.normal * outward_turn(job.scene, patch_id));
    const real3 outward = to_world(job.view.instances[hit.instance].normal, in_part);
    const real3 along = vector(job.view.w0) + at.x * vector(job.view.step_x) + at.y * vector(job.view.step_y);
    const real speed = length(along), size = length(outward);
    const real3 to_eye = along * (-1.0f / speed);
    // a surface without a normal faces the eye
    const real3 normal = size > 0.0f ? outward * (1.0f / size) : to_eye;
    const float* own = FaceColors{job.scene}.of(patch.face, hit.instance);
    const real3 color = shaded ? shade(vector(own), normal, to_eye) : real3(0, 0, 0);
    frame.depth_mm[pixel] = (float(job.view.depth_ref) + hit.past) * speed;
    frame.face[pixel] = int32_t(patch.face);
    frame.instance[pixel] = int32_t(hit.instance);
    frame.certified[pixel] = 0; // plain Newton claims nothing
    const float rgba[4] = {color.x, color.y, color.z, 1};
    std::copy_n(rgba, 4, &frame.rgba[4 * pixel]);
    const float n[3] = {normal.x, normal.y, normal.z};
    std::copy_n(n, 3, &frame.normal[3 * pixel]);
    const auto file = [&](size_t i, float uv_face) {
        return float(face.domain_lo[i]) + float(face.domain_hi[i] - face.domain_lo[i]) * uv_face;
    };
    frame.uv[2 * pixel] = file(0, hit.uv_face.x);
    frame.uv[2 * pixel + 1] = file(1, hit.uv_face.y);
}

SHARED_CLOSE
