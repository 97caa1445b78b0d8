#include "runtime/measure/mesh_tracer.h"

#include "format/pack_image.h"
#include "runtime/effect_plan.h"
#include "runtime/frame_effects.h"
#include "runtime/frame_size.h"
#include "runtime/measure/mesh_lanes.h"
#include "runtime/timed_frames.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#if defined(__SSE__)
#include <pmmintrin.h>
#include <xmmintrin.h>
#endif

namespace trimray {
namespace {

/// While it lives, this thread takes denormal numbers for zero: what Embree's manual advises ("MXCSR control and status
/// register"), so that triangles lose no time by our neglect.
class NoDenormals {
public:
#if defined(__SSE__)
    NoDenormals() : before_(_mm_getcsr())
    {
        _mm_setcsr(before_ | _MM_FLUSH_ZERO_ON | _MM_DENORMALS_ZERO_ON);
    }
    ~NoDenormals()
    {
        _mm_setcsr(before_);
    }
    NoDenormals(const NoDenormals&) = delete;
    NoDenormals& operator=(const NoDenormals&) = delete;

private:
    unsigned before_;
#else
    NoDenormals() {}
#endif
};

constexpr uint32_t kMeshLook = kLookOrthographic; // LookBit

struct ReleaseDevice {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct ReleaseScene {
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using DeviceHandle = std::unique_ptr<std::remove_pointer_t<RTCDevice>, ReleaseDevice>;
using SceneHandle = std::unique_ptr<std::remove_pointer_t<RTCScene>, ReleaseScene>;

/// A pack without surfaces: the mesh's placements, colours and bounds as the CPU tracer's view and colours ask for
/// them.
PackImage image_of(const TriangleMesh& mesh)
{
    constexpr double kInf = std::numeric_limits<double>::infinity();
    PackImage image;
    for (const MeshFace& face : mesh.faces) {
        FaceRecord record{};
        record.flags = face.has_color != 0 ? kFaceHasColor : 0;
        record.color_rgba = face.color_rgba;
        image.faces.push_back(record);
    }
    struct Box {
        std::array<double, 3> lo{kInf, kInf, kInf}, hi{-kInf, -kInf, -kInf};
        void add(const std::array<double, 3>& p)
        {
            for (size_t c = 0; c < 3; ++c) {
                lo[c] = std::min(lo[c], p[c]);
                hi[c] = std::max(hi[c], p[c]);
            }
        }
    };
    std::vector<Box> boxes; // part mm
    for (const MeshPart& part : mesh.parts) {
        PartRecord record{};
        std::copy(std::begin(part.origin_mm), std::end(part.origin_mm), record.origin_mm);
        record.scale_mm = 1;
        image.parts.push_back(record);
        Box& box = boxes.emplace_back();
        for (size_t i = 3 * size_t(part.first_triangle); i < 3 * (size_t(part.first_triangle) + part.triangle_count);
             ++i) {
            const float* p = &mesh.positions[3 * size_t(mesh.triangles[i])];
            box.add({part.origin_mm[0] + p[0], part.origin_mm[1] + p[1], part.origin_mm[2] + p[2]});
        }
    }
    Box world;
    for (const MeshInstance& instance : mesh.instances) {
        InstanceRecord record{};
        std::copy(std::begin(instance.transform), std::end(instance.transform), record.transform);
        record.part = instance.part;
        record.color_rgba = instance.color_rgba;
        image.instances.push_back(record);
        const Box& box = boxes[instance.part];
        for (unsigned corner = 0; mesh.parts[instance.part].triangle_count > 0 && corner < 8; ++corner) {
            std::array<double, 3> p;
            for (size_t row = 0; row < 3; ++row) {
                const double* m = instance.transform + 4 * row;
                p[row] = m[3];
                for (size_t c = 0; c < 3; ++c)
                    p[row] += m[c] * ((corner >> c & 1u) != 0 ? box.hi : box.lo)[c];
            }
            world.add(p);
        }
    }
    std::copy(world.lo.begin(), world.lo.end(), image.bounds_lo_mm);
    std::copy(world.hi.begin(), world.hi.end(), image.bounds_hi_mm);
    return image;
}

template <class T>
uint64_t bytes_of(const std::vector<T>& array)
{
    return array.size() * sizeof(T);
}

class MeshTracer final : public Tracer {
public:
    explicit MeshTracer(TriangleMesh mesh) : mesh_(std::move(mesh)), image_(image_of(mesh_)), colors_(image_)
    {
        for (const MeshInstance& instance : mesh_.instances)
            first_triangle_.push_back(mesh_.parts[instance.part].first_triangle);
        double diagonal2 = 0;
        for (size_t c = 0; c < 3; ++c) {
            middle_mm_[c] = (image_.bounds_lo_mm[c] + image_.bounds_hi_mm[c]) / 2;
            diagonal2 += std::pow(image_.bounds_hi_mm[c] - image_.bounds_lo_mm[c], 2);
        }
        diagonal_mm_ = std::sqrt(diagonal2);
    }

    /// Fails: DeviceFailed.
    Status build()
    {
        device_.reset(rtcNewDevice(nullptr));
        if (!device_)
            return failed(rtcGetDeviceError(nullptr));
        rtcSetDeviceMemoryMonitorFunction(
            device_.get(),
            [](void* bytes, ssize_t more, bool) {
                *static_cast<std::atomic<int64_t>*>(bytes) += more;
                return true;
            },
            &embree_bytes_);
        mesh_.positions.push_back(0); // Embree reads four numbers a vertex
        std::vector<SceneHandle> parts;
        for (const MeshPart& part : mesh_.parts)
            parts.push_back(part.triangle_count > 0 ? part_scene(part) : SceneHandle());
        scene_.reset(new_scene());
        for (size_t i = 0; i < mesh_.instances.size(); ++i)
            if (RTCScene part = parts[mesh_.instances[i].part].get())
                attach_instance(i, part);
        rtcCommitScene(scene_.get());
        name_ = fmt::format("Embree {}.{}.{}, 16 rays",
                            rtcGetDeviceProperty(device_.get(), RTC_DEVICE_PROPERTY_VERSION_MAJOR),
                            rtcGetDeviceProperty(device_.get(), RTC_DEVICE_PROPERTY_VERSION_MINOR),
                            rtcGetDeviceProperty(device_.get(), RTC_DEVICE_PROPERTY_VERSION_PATCH));
        const RTCError code = rtcGetDeviceError(device_.get());
        return code == RTC_ERROR_NONE ? Status(Done{}) : failed(code);
    }

    DeviceKind device_kind() const override { return DeviceKind::Cpu; }
    std::string device_name() const override { return name_; }

    Result<Frame> render(const RenderOptions& options, RenderStats& stats) override
    {
        if (const Status possible = check_size(options); !possible.ok())
            return possible.error();
        if (has_effects(options))
            return Error{ErrorCode::Usage, "mesh", "draws no lines and smooths no borders"};
        if (const Status done = check_look(options, kMeshLook, "mesh"); !done.ok())
            return done.error();
        if (options.closest == ClosestPolicy::Stochastic)
            return Error{ErrorCode::Usage, "mesh", "draws no starts; --closest must be certified"};
        if (options.trim != TrimMode::Auto && options.trim != TrimMode::Exact)
            return Error{ErrorCode::Usage, "mesh", "has no trims; --trim must be auto or exact"};
        stats = {};
        stats.device = name_;
        Frame frame;
        resize(frame, options.width, options.height);
        time_frames(options, stats, [&](uint32_t, const RunEach& run_each) { return trace(options, run_each, frame); });
        stats.buffer_bytes = uint64_t(embree_bytes_.load()) + bytes_of(mesh_.positions) + bytes_of(mesh_.normals) +
                             bytes_of(mesh_.triangles) + bytes_of(mesh_.triangle_face) + bytes_of(mesh_.faces) +
                             bytes_of(mesh_.instances) + bytes_of(mesh_.parts);
        return frame;
    }

private:
    static Error failed(RTCError code)
    {
        return {ErrorCode::DeviceFailed, "Embree",
                code == RTC_ERROR_OUT_OF_MEMORY ? std::string("out of memory") : fmt::format("error {}", int(code))};
    }

    RTCScene new_scene() const
    {
        const RTCScene scene = rtcNewScene(device_.get());
        rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
        return scene;
    }

    SceneHandle part_scene(const MeshPart& part) const
    {
        SceneHandle scene(new_scene());
        const RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh_.positions.data(), 0,
                                   3 * sizeof(float), mesh_.positions.size() / 3);
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh_.triangles.data(),
                                   3 * sizeof(uint32_t) * part.first_triangle, 3 * sizeof(uint32_t),
                                   part.triangle_count);
        rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(scene.get(), geometry, 0);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene.get());
        return scene;
    }

    /// The scene's axes are the world's, about the model's middle: single precision has most to give there.
    void attach_instance(size_t number, RTCScene part_scene)
    {
        const MeshInstance& instance = mesh_.instances[number];
        const MeshPart& part = mesh_.parts[instance.part];
        float transform[12];
        for (size_t row = 0; row < 3; ++row) {
            const double* m = instance.transform + 4 * row;
            for (size_t c = 0; c < 3; ++c)
                transform[4 * row + c] = float(m[c]);
            transform[4 * row + 3] = float(m[0] * part.origin_mm[0] + m[1] * part.origin_mm[1] +
                                           m[2] * part.origin_mm[2] + m[3] - middle_mm_[row]);
        }
        const RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(geometry, part_scene);
        rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, transform);
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(scene_.get(), geometry, uint32_t(number));
        rtcReleaseGeometry(geometry);
    }

    WorkCounts trace(const RenderOptions& options, const RunEach& run_each, Frame& frame)
    {
        const CameraRays rays = camera_rays(options.camera, options.width, options.height);
        const View view = make_view(image_, rays, options.width, options.height);
        const BlockJob block_job{colors_,         view,          options.width,   options.height,
                                 TrimMode::Exact, options.shade, options.error_px};
        MeshJob job{block_job, mesh_, scene_.get(), first_triangle_.data(), {}, {}, {}, 0};
        // before the nearest corner of the model's box, so that rounding leaves no hit behind the rays' beginnings
        const double before_mm = double(float(std::min(view.depth_ref, 1e-4 * diagonal_mm_)));
        const double start_tau = view.tau_ref - before_mm;
        job.before_mm = float(before_mm);
        for (size_t c = 0; c < 3; ++c) {
            job.start[c] = float(view.eye_mm[c] - middle_mm_[c] + start_tau * view.w0[c]);
            job.start_x[c] = float(start_tau * view.step_x[c]);
            job.start_y[c] = float(start_tau * view.step_y[c]);
        }
        const uint32_t columns = (options.width + kBlockSide - 1) / kBlockSide,
                       rows = (options.height + kBlockSide - 1) / kBlockSide;
        tbb::enumerable_thread_specific<WorkCounts> counts;
        run_each(columns * rows, [&](uint32_t i) {
            const NoDenormals none;
            const uint32_t x = i % columns * kBlockSide, y = i / columns * kBlockSide;
            const Block block{x, y, std::min(x + kBlockSide, options.width), std::min(y + kBlockSide, options.height)};
            trace_mesh_block(job, block, strips_.local(), frame, counts.local());
        });
        WorkCounts sum;
        for (const WorkCounts& some : counts)
            sum += some;
        return sum;
    }

    TriangleMesh mesh_;
    PackImage image_;
    CpuScene colors_;
    std::vector<uint32_t> first_triangle_; // by instance
    std::array<double, 3> middle_mm_;      // of the model's box
    double diagonal_mm_ = 0;
    std::atomic<int64_t> embree_bytes_{0}; // outlives what Embree frees
    DeviceHandle device_;
    SceneHandle scene_;
    std::string name_;
    tbb::enumerable_thread_specific<Strip> strips_;
};

} // namespace

Result<std::unique_ptr<Tracer>> make_mesh_tracer(TriangleMesh mesh)
{
    const bool seen = std::any_of(mesh.instances.begin(), mesh.instances.end(), [&](const MeshInstance& instance) {
        return mesh.parts[instance.part].triangle_count > 0;
    });
    if (!seen)
        return Error{ErrorCode::InvalidMesh, "mesh", "it shows no triangles"};
    auto tracer = std::make_unique<MeshTracer>(std::move(mesh));
    if (const Status built = tracer->build(); !built.ok())
        return built.error();
    return std::unique_ptr<Tracer>(std::move(tracer));
}

Result<std::unique_ptr<Tracer>> open_mesh(const std::string& path)
{
    Result<TriangleMesh> mesh = read_mesh(path);
    if (!mesh.ok())
        return mesh.error();
    return make_mesh_tracer(std::move(*mesh));
}

} // namespace trimray
