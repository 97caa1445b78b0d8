// Compiled once for each target by foreach_target.h, as runtime/cpu_lanes.cpp is.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/measure/mesh_lanes.cpp"
#include <hwy/foreach_target.h>

#include "runtime/cpu_lanes.h"
#include "runtime/cpu_light.h"
#include "runtime/cpu_write.h"
#include "runtime/measure/mesh_lanes.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace trimray {
namespace HWY_NAMESPACE {

class MeshBlockTracer {
public:
    MeshBlockTracer(const MeshJob& job, Strip& strip, Frame& frame, WorkCounts& work)
        : job_(job), strip_(strip), frame_(frame), work_(work)
    {
    }

    HWY_ATTR void trace(const Block& block)
    {
        const float middle_x = 0.5f * float(job_.block.width), middle_y = 0.5f * float(job_.block.height);
        alignas(64) float offset_x[kLanes], offset_y[kLanes];
        for (int i = 0; i < kLanes; ++i) {
            offset_x[i] = float(i % 4) + 0.5f - middle_x;
            offset_y[i] = float(i / 4) + 0.5f - middle_y;
        }
        for (uint32_t ty = block.y0; ty < block.y1; ty += kTileSide) {
            const uint32_t tile_y1 = std::min(ty + kTileSide, block.y1);
            for (uint32_t tx = block.x0; tx < block.x1; tx += kTileSide) {
                const uint32_t tile_x1 = std::min(tx + kTileSide, block.x1);
                for (uint32_t y = ty; y < tile_y1; y += 4) {
                    for (uint32_t x = tx; x < tile_x1; x += 4) {
                        Packet packet;
                        packet.x = load(offset_x) + real(float(x));
                        packet.y = load(offset_y) + real(float(y));
                        packet.alive = packet.x < float(tile_x1) - middle_x && packet.y < float(tile_y1) - middle_y;
                        packet.begin = real(-job_.before_mm);
                        write(packet, closest(packet), x - block.x0, y - ty);
                    }
                }
            }
            write_strip(strip_, block.x0, ty, block.x1 - block.x0, tile_y1 - ty, frame_);
        }
        hwy::FlushStream();
        work_.rays += uint64_t(block.x1 - block.x0) * (block.y1 - block.y0);
    }

private:
    static scalar3 vector(const float (&v)[3]) { return scalar3(v[0], v[1], v[2]); }

    /// PacketHit::leaf is the triangle, uv_face its second and third vertex' weights.
    HWY_ATTR PacketHit closest(const Packet& packet) const
    {
        const View& view = job_.block.view;
        const real3 origin = vector(job_.start) + packet.x * vector(job_.start_x) + packet.y * vector(job_.start_y);
        const real3 along =
            scalar3_of(view.w0) + packet.x * scalar3_of(view.step_x) + packet.y * scalar3_of(view.step_y);
        RTCRayHit16 rays;
        store(origin.x, rays.ray.org_x);
        store(origin.y, rays.ray.org_y);
        store(origin.z, rays.ray.org_z);
        store(along.x, rays.ray.dir_x);
        store(along.y, rays.ray.dir_y);
        store(along.z, rays.ray.dir_z);
        store(real(0.0f), rays.ray.tnear);
        store(real(0.0f), rays.ray.time);
        store(real(std::numeric_limits<float>::infinity()), rays.ray.tfar);
        store(integer(~0u), rays.ray.mask);
        store(integer(0u), rays.ray.flags);
        store(integer(RTC_INVALID_GEOMETRY_ID), rays.hit.geomID);
        store(integer(RTC_INVALID_GEOMETRY_ID), rays.hit.instID[0]);
        alignas(64) uint valid[kLanes];
        store(select(packet.alive, integer(~0u), integer(0u)), valid);
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
        rtcIntersect16(reinterpret_cast<const int*>(valid), job_.scene, &context, &rays);

        PacketHit hit;
        const mask hits = load(rays.hit.geomID) != integer(RTC_INVALID_GEOMETRY_ID) && packet.alive;
        hit.best = select(hits, load(rays.ray.tfar) - job_.before_mm, real(kHuge));
        hit.instance = select(hits, load(rays.hit.instID[0]), integer(~0u));
        const integer first = gather(job_.first_triangle, select(hits, hit.instance, integer(0u)));
        hit.leaf = select(hits, first + load(rays.hit.primID), integer(~0u));
        hit.uv_face = select(hits, real2(load(rays.hit.u), load(rays.hit.v)), real2(real(0.0f), real(0.0f)));
        hit.normal = real3(real(0.0f), real(0.0f), real(1.0f));
        hit.back = mask(false);
        hit.doubt = real(kHuge);
        return hit;
    }

    HWY_ATTR real3 normal_at(integer vertex) const
    {
        const integer first = vertex * integer(3u);
        const float* normals = job_.mesh.normals.data();
        return real3(gather(normals, first), gather(normals, first + integer(1u)),
                     gather(normals, first + integer(2u)));
    }

    /// As shade_leaves, of triangles.
    HWY_ATTR PacketShading shade_triangles(const PacketHit& hit, mask hits) const
    {
        const TriangleMesh& mesh = job_.mesh;
        const integer triangle = select(hits, hit.leaf, integer(0u)), corner = triangle * integer(3u);
        const real3 a = normal_at(gather(mesh.triangles.data(), corner));
        const real3 b = normal_at(gather(mesh.triangles.data(), corner + integer(1u)));
        const real3 c = normal_at(gather(mesh.triangles.data(), corner + integer(2u)));
        const real3 in_part = a * (1.0f - hit.uv_face.x - hit.uv_face.y) + b * hit.uv_face.x + c * hit.uv_face.y;
        PacketShading out;
        out.normal = out.color = real3(real(0.0f), real(0.0f), real(0.0f));
        out.uv_file = real2(real(0.0f), real(0.0f));
        out.face = gather(mesh.triangle_face.data(), triangle);
        alignas(64) uint faces[kLanes], instances[kLanes];
        store(out.face, faces);
        store(hit.instance, instances);
        for (uint left = lane_bits(hits); left != 0;) {
            const int lane = __builtin_ctz(left);
            const uint face = faces[lane], instance = instances[lane];
            const mask here = hits && out.face == integer(face) && hit.instance == integer(instance);
            left &= ~lane_bits(here);
            out.normal = select(here, to_world(job_.block.view.instances[instance].normal, in_part), out.normal);
            const float* color = color_of<false>(job_.block, face, instance);
            out.color = select(here, real3(scalar3(color[0], color[1], color[2])), out.color);
        }
        return out;
    }

    /// Puts the packet's pixels at (x, y) of the strip.
    HWY_ATTR void write(const Packet& packet, const PacketHit& hit, uint32_t x, uint32_t y)
    {
        if (put_misses(job_.block, false, packet, hit, x, y, strip_, work_))
            return;
        SeenPacket seen;
        seen.hits = packet.alive && hit.best < kHuge;
        PacketLight* const no_light = nullptr;
        see_shading<false>(job_.block, packet, hit, shade_triangles(hit, seen.hits), lane_bits(seen.hits), no_light, x,
                           y, &strip_, seen);
        put_packet(seen, select(seen.hits, real(1.0f), real(0.0f)), packet.alive, x, y, strip_, work_);
    }

    const MeshJob& job_;
    Strip& strip_;
    Frame& frame_;
    WorkCounts& work_;
};

void trace_block_of_mesh(const MeshJob& job, const Block& block, Strip& strip, Frame& frame, WorkCounts& work)
{
    MeshBlockTracer(job, strip, frame, work).trace(block);
}

} // namespace HWY_NAMESPACE
} // namespace trimray
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace trimray {

HWY_EXPORT(trace_block_of_mesh);

void trace_mesh_block(const MeshJob& job, const Block& block, Strip& strip, Frame& frame, WorkCounts& work)
{
    HWY_DYNAMIC_DISPATCH(trace_block_of_mesh)(job, block, strip, frame, work);
}

} // namespace trimray

#endif
