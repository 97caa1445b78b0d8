// The public face of the runtime: load a pack, trace it on the CPU or through Vulkan, get a frame of AOVs.
#pragma once

#include "format/pack_reader.h"
#include "format/result.h"
#include "runtime/camera.h"
#include "runtime/scene_look.h"

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace trimray {

struct CpuScene;

/// A loaded, validated pack, ready to trace.
struct Scene {
    LoadedPack pack;
    std::shared_ptr<const CpuScene> prepared; // what the CPU tracer adds; load_scene fills it, others make their own
    bool has_cells() const { return !pack.image.cells.empty(); }
};

Result<std::shared_ptr<const Scene>> load_scene(const std::string& path, bool previews_and_proxy = false);

/// How trims are answered (DESIGN's modes). Reference counts crossings in double over all pieces of a face, on the CPU
/// tracer only: slow, and what the others are measured against. All else is traced alike in every mode, so pictures in
/// two modes differ by trim decisions alone.
enum class TrimMode { Auto, Exact, Sdf, Hybrid, Kd, Reference };

/// How a leaf of a Bezier patch is searched for the nearest hit.
enum class ClosestPolicy {
    Certified, // many starts where it may hold several hits; the first frame is the picture, all others are the same
    // The paper's: plain Newton from one start a frame, the leaf's middle in the first and drawn anew in later ones;
    // each pixel keeps the nearest hit of all frames. No pixel is certified
    Stochastic,
};

/// Trim queries of a packet of 16 rays against one face: those in the lanes whose bits are set in `asked`.
struct TrimQueries {
    alignas(64) float u[16]; // uv_face
    alignas(64) float v[16];
    uint32_t face;
    uint32_t asked;
    uint32_t inside; // the reference's answers, in the lanes asked
};

/// Which borders of faces are drawn as lines. Seams and poles, where nothing ends, never are.
enum class EdgeLines {
    None,
    Sharp, // where faces meet at an angle, or a face ends
    All,   // where faces meet smoothly too
};
constexpr float kLargestEdgeWidthPx = 60;

struct RenderOptions {
    uint32_t width = 1280, height = 720;
    Camera camera;
    TrimMode trim = TrimMode::Auto;
    ClosestPolicy closest = ClosestPolicy::Certified;
    // Search each ray first where the last picture that was asked for with this, by the same tracer and at the same
    // size, suggests. The picture may be there sooner and stays the same bit for bit, but where two faces lie within
    // rounding of each other a hit may be the other's (one pixel of 4.1 million). Through Vulkan alone, and not with
    // Stochastic: the CPU tracer meets leaves in the order of their nearest points, so that no bound spares it one
    // (started from the very hits of the view: 2.778 leaf visits a ray of vsp, as without)
    bool reuse_last = false;
    uint32_t threads = 0;             // 0: all cores
    uint32_t frames = 1;              // timed frames; the picture is the last one's
    float error_px = 0.02f;           // each pixel shows what lies within so many of its middle (ACCURACY.md)
    bool shade = true;                // fill rgba
    bool record_trim_queries = false; // with TrimMode::Reference: fill RenderStats::trim_queries
    // Told the share of a frame that is done, by one thread at a time. By the reference alone: the others are done at
    // once
    std::function<void(double share)> progress;
    // Asked by any thread, many times a frame; once it says true, render gives up and fails: Interrupted. Not asked by
    // the reference
    std::function<bool()> cancelled;
    bool is_cancelled() const { return cancelled && cancelled(); }

    // What is drawn over the surfaces: rgba alone changes, and only where it is asked for. Needs shade.
    EdgeLines edges = EdgeLines::None;
    bool silhouettes = false;   // lines where a surface turns away, and where a border hides what lies behind it
    bool fill = true;           // false: faces hide what is behind them, but show the background
    float edge_width_px = 1.5f; // of lines, in (0, kLargestEdgeWidthPx], at every slant
    // linear light; none: nearly black on light faces, light on dark ones
    std::optional<std::array<float, 3>> edge_color;
    bool antialias_trims = false; // borders and rims of faces blended with what is beside them, from one sample a pixel

    // false: traced by a program for every scene, which finds out pixel by pixel what the effect plan knows beforehand:
    // a measuring device for what specialisation is worth. The picture is the same
    bool specialise = true;

    SceneLook look; // lights, materials, shadows, sections, maps
};

/// What render fails with where RenderOptions::cancelled says so.
inline Error given_up()
{
    return {ErrorCode::Interrupted, "", "the picture was no longer wanted"};
}

/// Per-pixel results, row 0 at the top. A miss has depth +inf, face -1, zeros elsewhere.
struct Frame {
    uint32_t width = 0, height = 0;
    std::vector<float> rgba;     // 4 a pixel, linear light, straight alpha; a miss is the background with alpha 0
    std::vector<float> depth_mm; // distance from the eye along the ray
    std::vector<float> normal;   // 3 a pixel, unit, world, outward as the face's orientation says
    std::vector<float> uv;       // 2 a pixel, uv_file
    std::vector<int32_t> face;   // index into the pack's faces
    std::vector<int32_t> instance;
    // 1: the hit is a root down to rounding, or there is none, and no leaf that begins before it was left open: one
    // flagged in the pack, one whose surface the ray grazes, one where Newton ended undecided. Trims are not part of
    // the claim: a ray may pass between two of them by rounding.
    std::vector<uint8_t> certified;
    // What a map of SceneLook measures, exactly, of every pixel: Gaussian curvature in 1/mm^2, others in 1/mm, draft in
    // degrees; a miss has 0. Empty without such a map
    std::vector<float> map_value;
};

/// Work done per frame, all rays together: a leaf visited by a packet of 16 rays counts 16 times. Counts do not wobble:
/// compare them before times.
struct WorkCounts {
    uint64_t rays = 0, node_visits = 0, leaf_visits = 0, newton_steps = 0, curve_tests = 0, uncertified_pixels = 0;
    uint64_t edge_tests = 0;                      // pieces of borders measured, a ray each
    uint64_t free_rays = 0, free_leaf_visits = 0; // rays from elsewhere than the eye, and the leaves that they met

    WorkCounts& operator+=(const WorkCounts& other)
    {
        rays += other.rays;
        node_visits += other.node_visits;
        leaf_visits += other.leaf_visits;
        newton_steps += other.newton_steps;
        curve_tests += other.curve_tests;
        uncertified_pixels += other.uncertified_pixels;
        edge_tests += other.edge_tests;
        free_rays += other.free_rays;
        free_leaf_visits += other.free_leaf_visits;
        return *this;
    }
};

/// A compute pipeline that a picture was made with.
struct PipelineStats {
    std::string shader;              // "primary", "light", "caps", "mirror", "blend"
    std::vector<uint32_t> constants; // what it is specialised to, by kSpec... (shaders/frame_layout.h)
    uint64_t bytes = 0;              // of what the driver made of it, as its pipeline cache tells; 0: it tells nothing
};

struct RenderStats {
    std::string device;
    std::vector<double> frame_ms; // tracing and shading, not loading or compiling
    // processor time of the same, on the CPU with one thread: what other programs take is not in it. Otherwise empty
    std::vector<double> frame_cpu_ms;
    WorkCounts work; // of one frame, the first
    TrimMode trim = TrimMode::Exact;
    bool reused_last = false;  // it began from another picture's hits (RenderOptions::reuse_last)
    uint64_t kd_bytes = 0;     // of the kd-trees, in the mode kd; otherwise there are none
    uint64_t border_bytes = 0; // of the borders' cells, where lines or smoothed trims ask for them; else 0
    // Of the arrays that the picture needs: on a device all that are there so far, the pack's among them, without those
    // in which bands come back; on the CPU those beside the pack's, without the threads' scratch and small records
    uint64_t buffer_bytes = 0;
    uint32_t dispatches = 0;               // of the last frame, on a device
    std::vector<PipelineStats> pipelines;  // of the timed frames, on a device
    std::vector<TrimQueries> trim_queries; // of one frame, if asked for; on one thread in the order in which they came
};

/// What traces, as far as it decides what is traced how.
enum class DeviceKind {
    Cpu,
    Reference,
    Vulkan,         // a GPU
    SoftwareVulkan, // a driver that runs shaders on the CPU
};

class Tracer {
public:
    virtual ~Tracer() = default;
    virtual DeviceKind device_kind() const = 0;
    virtual std::string device_name() const = 0;
    virtual Result<Frame> render(const RenderOptions& options, RenderStats& stats) = 0;
};

/// Fails: UnsupportedPackFeature. `instruction_set` is "", "avx512", "avx2" or "sse4"; empty: the best this machine
/// has. All give the same bits.
Result<std::unique_ptr<Tracer>> make_cpu_tracer(std::shared_ptr<const Scene> scene,
                                                const std::string& instruction_set = "");

/// Fails: NoDevice, DeviceFailed. `allow_software`: accept a software driver (`--device vulkan`; never for auto).
Result<std::unique_ptr<Tracer>> make_vulkan_tracer(std::shared_ptr<const Scene> scene, bool allow_software,
                                                   bool validation);

/// The reference for closest hits (format/closest_reference.h): in double, with trims counted likewise, about a hundred
/// thousand rays a second a thread. Its `certified` says that the ray touches nothing and no search was given up. Its
/// render fails for effects and for trim modes other than auto, exact and reference: Usage.
std::unique_ptr<Tracer> make_reference_tracer(std::shared_ptr<const Scene> scene);

/// One ray, in world mm; `direction` need not be unit, distance_mm is along the unit direction. It meets backs wherever
/// a face lies, in the rims of closed shells too, which a picture from outside does not show.
struct RayHit {
    bool hit = false;
    double distance_mm = 0;
    std::array<double, 3> normal{};
    std::array<double, 2> uv{};
    int32_t face = -1, instance = -1;
};
RayHit trace_ray(const Scene& scene, const std::array<double, 3>& origin_mm, const std::array<double, 3>& direction);

} // namespace trimray
