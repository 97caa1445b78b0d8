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
#include "runtime/cpu_maps.h"
#include "runtime/face_colors.h"
#include "shaders/shared/environment.h"
#include "shaders/shared/language.h"
#include "shaders/shared/leaf_box.h"
#include "shaders/shared/shading.h"

#include <algorithm>
#include <cstring>
#include <limits>

SHARED_OPEN

// The nearest hits so far of a packet's rays
struct PacketHit {
    real best;        // tau - tau_ref in mm; kHuge: none
    integer leaf;     // of the pack
    integer instance; // ~0: none
    real2 uv_face;
    real3 normal; // S_u x S_v in patch space, right-handed axes, any length
    mask back;    // it may be a rim's
    real doubt;   // from where on a leaf may hold hits that were not found, as `best`; kHuge: there is none
};

struct Packet {
    real x; // pixels from the picture's centre
    real y;
    mask alive;
    real begin; // rays hit nothing up to there, as PacketHit::best: the eye, or its plane where they are parallel, or
                // the section plane or surface that they begin at
};

/// Where points of the pixels' rays are in the top tree's units.
class PixelPlaces {
public:
    explicit PixelPlaces(const PlaceView& view) : view_(view) {}

    HWY_ATTR real3 at(const Packet& packet, real past) const
    {
        return vector(view_.place) + packet.x * vector(view_.place_x) + packet.y * vector(view_.place_y) +
               along(packet) * past;
    }
    /// The rays' direction: units a mm of tau.
    HWY_ATTR real3 along(const Packet& packet) const
    {
        return vector(view_.along) + packet.x * vector(view_.along_x) + packet.y * vector(view_.along_y);
    }
    /// A pixel's width.
    HWY_ATTR real footprint(real past) const { return abs(past + view_.tau_ref) * view_.pixel; }

private:
    static scalar3 vector(const float (&v)[3]) { return scalar3(v[0], v[1], v[2]); }

    const PlaceView& view_;
};

/// A face's colour, linear light. kLook: by the job's materials, where it has some.
template <bool kLook>
const float* color_of(const BlockJob& job, uint face, uint instance)
{
    return FaceColors{job.scene, kLook ? job.materials : nullptr}.of(face, instance);
}

/// What the hits look like in the world, lane by lane.
struct PacketShading {
    real3 normal; // outward, any length
    real3 color;  // linear
    real2 uv_file;
    integer face;
    real specular, mirror, opacity; // where kLook
};

/// One leaf at a time, in all the lanes that hit it. kLook: the job may have materials.
template <bool kLook>
HWY_ATTR HWY_NOINLINE PacketShading shade_leaves(const BlockJob& job, const PacketHit& hit, uint hit_lanes)
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
    if constexpr (kLook) { // caps are plain, and what has no materials
        out.specular = real(kSpecular);
        out.mirror = real(0.0f);
        out.opacity = real(1.0f);
    }
    for (uint left = hit_lanes; left != 0;) {
        const int lane = __builtin_ctz(left);
        const uint leaf_id = leaves[lane], instance_id = instances[lane];
        const mask here = hit.leaf == integer(leaf_id) && hit.instance == integer(instance_id);
        left &= ~lane_bits(here);
        const LeafRecord& leaf = image.leaves[leaf_id];
        const PatchRecord& patch = image.patches[leaf.patch];
        const FaceRecord& face = image.faces[patch.face];
        const float turn = outward_turn(job.scene, leaf.patch);
        const scalar3 x(patch.axis_x[0], patch.axis_x[1], patch.axis_x[2]);
        const scalar3 y(patch.axis_y[0], patch.axis_y[1], patch.axis_y[2]);
        const scalar3 z(patch.axis_z[0], patch.axis_z[1], patch.axis_z[2]);
        const real3 in_part = combine(x, y, z, hit.normal * real(turn));
        out.normal = select(here, to_world(job.view.instances[instance_id].normal, in_part), out.normal);
        const float* color = color_of<kLook>(job, patch.face, instance_id);
        out.color = select(here, real3(scalar3(color[0], color[1], color[2])), out.color);
        const float lo[2] = {float(face.domain_lo[0]), float(face.domain_lo[1])};
        const float size[2] = {float(face.domain_hi[0] - face.domain_lo[0]),
                               float(face.domain_hi[1] - face.domain_lo[1])};
        out.uv_file =
            select(here, real2(lo[0] + size[0] * hit.uv_face.x, lo[1] + size[1] * hit.uv_face.y), out.uv_file);
        out.face = select(here, integer(patch.face), out.face);
        if constexpr (kLook)
            if (job.materials) {
                const MaterialRecord& material = job.materials->of(patch.face, instance_id);
                out.specular = select(here, real(material.specular), out.specular);
                out.mirror = select(here, real(material.mirror), out.mirror);
                out.opacity = select(here, real(material.opacity), out.opacity);
            }
    }
    return out;
}

/// What closes the cut solids in a packet's pixels (runtime/cpu_caps.h).
struct PacketCaps {
    mask here;
    mask doubtful; // it is not certain whether there is one
    real past;     // PacketHit::best
    real3 normal;  // unit, out of the solid
    real3 color;
    real2 uv; // mm along the plane
    integer plane, instance;
};

[[maybe_unused]] static HWY_ATTR void show_caps(const PacketCaps& caps, PacketShading& shading)
{
    shading.normal = select(caps.here, caps.normal, shading.normal);
    shading.color = select(caps.here, caps.color, shading.color);
    shading.uv_file = select(caps.here, caps.uv, shading.uv_file);
    shading.face = select(caps.here, integer(kCapFace) - caps.plane, shading.face);
}

/// A packet's pixels as they lie in a frame, 4 a row.
struct PacketPixels {
    alignas(64) float rgba[4 * kLanes];
    alignas(64) float normal[3 * kLanes];
    alignas(64) float uv[2 * kLanes];
    alignas(64) float depth[kLanes];
    alignas(64) uint face[kLanes];
    alignas(64) uint instance[kLanes];
    alignas(16) uint8_t certified[kLanes];
};

/// A packet's hits as lights find them.
struct LitPoints {
    real past;    // PacketHit::best
    real3 normal; // unit, outward
    real3 to_eye; // unit
    real3 color;
    real specular;
    real mirror;
    mask alive;
};

/// What a packet's pixels show.
struct SeenPacket {
    mask hits;
    real depth; // along the ray, mm
    real3 normal;
    real2 uv;
    integer face, instance;
    real3 color;
    real opacity; // of what was hit; where kLook
    mask certified;
};

constexpr PacketPixels missed_pixels(bool certified)
{
    PacketPixels pixels{};
    for (int i = 0; i < kLanes; ++i) {
        pixels.depth[i] = std::numeric_limits<float>::infinity();
        pixels.face[i] = pixels.instance[i] = ~0u;
        pixels.certified[i] = certified;
    }
    return pixels;
}
// a constant, for code that runs before main must not need this instruction set
constexpr PacketPixels kMissedPixels = missed_pixels(true), kDoubtfulMisses = missed_pixels(false);

HWY_INLINE void copy_to_strip(const PacketPixels& pixels, uint32_t x, uint32_t y, Strip& strip)
{
    for (uint32_t row = 0; row < 4; ++row) {
        std::memcpy(&strip.rgba[y + row][4 * x], pixels.rgba + 16 * row, 64);
        std::memcpy(&strip.normal[y + row][3 * x], pixels.normal + 12 * row, 48);
        std::memcpy(&strip.uv[y + row][2 * x], pixels.uv + 8 * row, 32);
        std::memcpy(&strip.depth[y + row][x], pixels.depth + 4 * row, 16);
        std::memcpy(&strip.face[y + row][x], pixels.face + 4 * row, 16);
        std::memcpy(&strip.instance[y + row][x], pixels.instance + 4 * row, 16);
        std::memcpy(&strip.certified[y + row][x], pixels.certified + 4 * row, 4);
    }
}

[[maybe_unused]] static HWY_ATTR void write_values(real value, uint32_t x, uint32_t y, Strip& strip)
{
    alignas(64) float values[kLanes];
    store(value, values);
    for (uint32_t row = 0; row < 4; ++row)
        std::memcpy(&strip.map_value[(y + row) * kBlockSide + x], values + 4 * row, 16);
}

/// memcpy past the caches: a frame is larger than they are, and reading its lines before writing them is half the cost.
[[maybe_unused]] static HWY_ATTR HWY_INLINE void stream(const void* from, size_t bytes, void* to)
{
    using Bytes = hn::CappedTag<uint8_t, 64>;
    constexpr size_t kLine = 64;
    constexpr size_t kStep = hn::MaxLanes(Bytes());
    const auto* in = static_cast<const uint8_t*>(from);
    auto* out = static_cast<uint8_t*>(to);
    const size_t head = std::min(bytes, (kLine - reinterpret_cast<uintptr_t>(out) % kLine) % kLine);
    std::memcpy(out, in, head);
    size_t at = head;
    for (; at + kLine <= bytes; at += kLine)
        for (size_t i = 0; i < kLine; i += kStep)
            hn::Stream(hn::LoadU(Bytes(), in + at + i), Bytes(), out + at + i);
    std::memcpy(out + at, in + at, bytes - at);
}

/// The map's values of a strip to their places, and zeros in their place: packets that miss write none.
[[maybe_unused]] static void write_strip_values(Strip& strip, uint32_t x, uint32_t y, uint32_t columns, uint32_t rows,
                                                Frame& frame)
{
    for (uint32_t row = 0; row < rows; ++row)
        std::copy_n(&strip.map_value[size_t(row) * kBlockSide], columns,
                    &frame.map_value[size_t(y + row) * frame.width + x]);
    std::fill(strip.map_value.begin(), strip.map_value.end(), 0.0f);
}

/// The strip's rows to their places: pixels [x, x + columns) of rows [y, y + rows).
[[maybe_unused]] static HWY_ATTR void write_strip(Strip& strip, uint32_t x, uint32_t y, uint32_t columns, uint32_t rows,
                                                  Frame& frame)
{
    for (uint32_t row = 0; row < rows; ++row) {
        const size_t pixel = size_t(y + row) * frame.width + x;
        stream(strip.rgba[row], columns * 16, &frame.rgba[4 * pixel]);
        stream(strip.normal[row], columns * 12, &frame.normal[3 * pixel]);
        stream(strip.uv[row], columns * 8, &frame.uv[2 * pixel]);
        stream(strip.depth[row], columns * 4, &frame.depth_mm[pixel]);
        stream(strip.face[row], columns * 4, &frame.face[pixel]);
        stream(strip.instance[row], columns * 4, &frame.instance[pixel]);
        std::memcpy(&frame.certified[pixel], strip.certified[row], columns);
    }
    if (!frame.map_value.empty())
        write_strip_values(strip, x, y, columns, rows, frame);
}

/// What the environment shows along the rays; `along` any length.
[[maybe_unused]] static HWY_ATTR HWY_NOINLINE real3 environment_along(const Environment& environment, real3 along)
{
    const EnvironmentTexels at = environment_texels(along, environment.width, environment.height);
    const auto channel = [&](uint c) HWY_ATTR {
        const float* rgb = environment.rgb.data() + c;
        const auto texel = [&](integer index) HWY_ATTR { return gather(rgb, index * integer(3u)); };
        const real above = texel(at.a) + (texel(at.b) - texel(at.a)) * at.across;
        const real below = texel(at.c) + (texel(at.d) - texel(at.c)) * at.across;
        return above + (below - above) * at.down;
    };
    return real3(channel(0), channel(1), channel(2));
}

/// The colours of hits whose materials, map or lights the job may have: see_packet has the arguments.
template <class Light>
HWY_ATTR HWY_INLINE real3 look_at(const BlockJob& job, const Packet& packet, const PacketHit& hit,
                                  const PacketShading& shading, const SeenPacket& seen, real3 to_eye,
                                  uint surface_lanes, Light* light, uint32_t x, uint32_t y, Strip* strip)
{
    real3 surface = shading.color;
    mask glows(false); // pixels whose map is seen as it is
    if (job.map != nullptr) {
        const MapHits on_map{packet.x, packet.y, hit.best, hit.leaf, hit.instance, hit.uv_face, seen.normal, to_eye};
        const MapColor map = map_hits(job, on_map, surface_lanes);
        const mask mapped = lanes_of(surface_lanes);
        surface = select(mapped, map.color, surface);
        if (!is_lit_map(job.map->map))
            glows = mapped;
        if (strip && job.map->measures)
            write_values(select(mapped, map.value, real(0.0f)), x, y, *strip);
    }
    const mask lit = seen.hits && !glows;
    if (!any_lane(lit))
        return surface;
    const real3 color =
        light ? light->lit(packet, {hit.best, seen.normal, to_eye, surface, shading.specular, shading.mirror, lit})
              : shade(surface, seen.normal, to_eye);
    return select(glows, surface, color);
}

/// Fills what `seen`, which has its hits, shows of hits whose look in the world is known. surface_lanes: those that are
/// no caps. Other arguments: see_packet's.
template <bool kLook, class Light>
HWY_ATTR HWY_INLINE void see_shading(const BlockJob& job, const Packet& packet, const PacketHit& hit,
                                     const PacketShading& shading, uint surface_lanes, Light* light, uint32_t x,
                                     uint32_t y, Strip* strip, SeenPacket& seen)
{
    const View& view = job.view;
    const scalar3 w0(float(view.w0[0]), float(view.w0[1]), float(view.w0[2]));
    const scalar3 step_x(float(view.step_x[0]), float(view.step_x[1]), float(view.step_x[2]));
    const scalar3 step_y(float(view.step_y[0]), float(view.step_y[1]), float(view.step_y[2]));
    const real3 along = w0 + packet.x * step_x + packet.y * step_y;
    const real speed = length(along);
    seen.depth =
        select(seen.hits, (float(view.depth_ref) + hit.best) * speed, real(std::numeric_limits<float>::infinity()));
    const real size = length(shading.normal);
    const mask has_normal = size > 0.0f && seen.hits;
    // a surface without a normal faces the eye
    const real3 to_eye = along * (-1.0f / speed);
    seen.normal = select(has_normal, shading.normal * (1.0f / select(has_normal, size, real(1.0f))), to_eye);
    if constexpr (kLook) {
        seen.color = look_at(job, packet, hit, shading, seen, to_eye, surface_lanes, light, x, y, strip);
        seen.opacity = shading.opacity;
    } else {
        seen.color = shade(shading.color, seen.normal, to_eye);
    }
    if (!job.shade)
        seen.color = real3(real(0.0f), real(0.0f), real(0.0f));
    seen.uv = shading.uv_file;
    seen.face = shading.face;
    seen.instance = hit.instance;
    seen.certified = hit.doubt >= kHuge || hit.doubt > hit.best;
}

/// The pixels of hits. kLook: the job may have materials or a map. Light: PacketLight (runtime/cpu_light.h); null where
/// there is the light at the eye alone. Caps are hits without a leaf; null where there are none. Values of maps that
/// measure go to (x, y) of the strip, if there is one.
template <bool kLook, class Light>
HWY_ATTR HWY_INLINE SeenPacket see_packet(const BlockJob& job, const Packet& packet, const PacketHit& hit,
                                          const PacketCaps* caps, Light* light, uint32_t x, uint32_t y, Strip* strip)
{
    SeenPacket seen;
    seen.hits = packet.alive && hit.best < kHuge;
    const uint hit_lanes = lane_bits(seen.hits);
    const uint surface_lanes = caps ? hit_lanes & ~lane_bits(caps->here) : hit_lanes;
    PacketShading shading = shade_leaves<kLook>(job, hit, surface_lanes);
    if (caps)
        show_caps(*caps, shading);
    see_shading<kLook>(job, packet, hit, shading, surface_lanes, light, x, y, strip, seen);
    return seen;
}

/// `alpha`: of the pixels, whose colours are straight.
[[maybe_unused]] static HWY_ATTR HWY_INLINE void put_packet(const SeenPacket& seen, real alpha, mask alive, uint32_t x,
                                                            uint32_t y, Strip& strip, WorkCounts& work)
{
    const mask hits = seen.hits, shown = alpha > 0.0f;
    const real none = real(0.0f);
    PacketPixels pixels;
    store_interleaved(select(shown, seen.color.x, none), select(shown, seen.color.y, none),
                      select(shown, seen.color.z, none), alpha, pixels.rgba);
    store_interleaved(select(hits, seen.normal.x, none), select(hits, seen.normal.y, none),
                      select(hits, seen.normal.z, none), pixels.normal);
    store_interleaved(select(hits, seen.uv.x, none), select(hits, seen.uv.y, none), pixels.uv);
    store(seen.depth, pixels.depth);
    store(select(hits, seen.face, integer(~0u)), pixels.face);
    store(select(hits, seen.instance, integer(~0u)), pixels.instance);
    const uint certified_lanes = lane_bits(seen.certified), alive_lanes = lane_bits(alive);
    work.uncertified_pixels += uint64_t(__builtin_popcount(alive_lanes & ~certified_lanes));
    for (uint lane = 0; lane < kLanes; ++lane)
        pixels.certified[lane] = certified_lanes >> lane & 1u;
    copy_to_strip(pixels, x, y, strip);
}

/// Whether no pixel of the packet needs more than what all misses show; then it is put there. `seen`: misses see
/// something.
[[maybe_unused]] static HWY_ATTR HWY_INLINE bool put_misses(const BlockJob& job, bool seen, const Packet& packet,
                                                            const PacketHit& hit, uint32_t x, uint32_t y, Strip& strip,
                                                            WorkCounts& work)
{
    if (seen || any_lane(packet.alive && hit.best < kHuge))
        return false;
    if (job.stochastic) {
        copy_to_strip(kDoubtfulMisses, x, y, strip);
        work.uncertified_pixels += uint64_t(__builtin_popcount(lane_bits(packet.alive)));
        return true;
    }
    if (any_lane(packet.alive && hit.doubt < kHuge))
        return false;
    copy_to_strip(kMissedPixels, x, y, strip);
    return true;
}

SHARED_CLOSE
#endif
