#include "runtime/arrangement.h"
#include "runtime/cpu_lanes.h"
#include "runtime/effect_plan.h"
#include "runtime/eye_side.h"
#include "runtime/frame_effects.h"
#include "runtime/frame_size.h"
#include "runtime/light_view.h"
#include "runtime/materials.h"
#include "runtime/section_view.h"
#include "runtime/surface_map.h"
#include "runtime/timed_frames.h"
#include "runtime/trace_one.h"
#include "runtime/tracer.h"
#include "runtime/trim_mode.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>

namespace trimray {
namespace {

constexpr uint32_t kLookDone = kLookLights | kLookShadows | kLookSoftShadows | kLookOcclusion | kLookMap |
                               kLookSection | kLookCaps | kLookMaterials | kLookTransparency | kLookMirrors |
                               kLookEnvironment | kLookOrthographic | kLookArrangement;

class CpuTracer final : public Tracer {
public:
    CpuTracer(std::shared_ptr<const Scene> scene, TraceBlock trace_block, const std::string& instruction_set)
        : scene_(std::move(scene)), cpu_scene_(prepared(*scene_)), trace_block_(trace_block),
          name_(fmt::format("CPU, {}", instruction_set))
    {
    }

    DeviceKind device_kind() const override { return DeviceKind::Cpu; }
    std::string device_name() const override { return name_; }

    Result<Frame> render(const RenderOptions& options, RenderStats& stats) override
    {
        if (const Status possible = check_size(options); !possible.ok())
            return possible.error();
        const Result<TrimMode> trim = choose_trim(scene_->pack.image, options.trim);
        if (!trim.ok())
            return trim.error();
        if (const Status done = check_look(options, kLookDone, "cpu"); !done.ok())
            return done.error();
        if (const Status drawable = check_effects(options); !drawable.ok())
            return drawable.error();
        if (const Status mapped = check_map(scene_->pack.image, options.look.map); !mapped.ok())
            return mapped.error();
        const bool asks_borders = edge_query(options).any() && has_effects(options);
        if (const Status lights = check_lights(options.look); !lights.ok())
            return lights.error();
        if (const Status section = check_section(options.look.section); !section.ok())
            return section.error();
        const Result<MaterialTable> materials = resolve_materials(scene_->pack.image, options.look);
        if (!materials.ok())
            return materials.error();
        const Result<bool> rearranged = arrangement_.change_to(scene_->pack.image, options.look.arrangement);
        if (!rearranged.ok())
            return rearranged.error();
        if (*rearranged)
            to_part_.clear();
        const bool asks_free_rays = (options.shade && (has_light_rays(options.look) || has_mirrors(options.look))) ||
                                    !options.look.section.planes.empty();
        if (asks_free_rays && to_part_.empty())
            to_part_ = world_to_part(arrangement_.view(scene_->pack.image));
        if (asks_borders && !border_cells_)
            border_cells_ = make_border_cells(scene_->pack.image);
        if (*trim == TrimMode::Kd && !cpu_scene_->kd_trims().ok())
            return cpu_scene_->kd_trims().error();
        stats.device = name_;
        stats.trim = *trim;
        stats.kd_bytes = *trim == TrimMode::Kd ? cpu_scene_->kd_trims()->size_bytes() : 0;
        stats.border_bytes = asks_borders ? border_cells_->size_bytes() : 0;
        stats.trim_queries.clear();
        if (*trim == TrimMode::Reference && reference_ == nullptr)
            reference_ = std::make_unique<const TrimReference>(scene_->pack.image);
        Frame frame;
        resize(frame, options.width, options.height);
        if (measures(options.look.map.map))
            frame.map_value.resize(frame.depth_mm.size());
        kept_ = keeps_hits(options) ? no_hits(options.width, options.height) : KeptHits{};
        time_frames(options, stats, [&](uint32_t number, const RunEach& run_each) {
            const WorkCounts work = render_once(options, *materials, stats.trim, number, run_each, frame);
            take_queries(stats.trim_queries);
            return work;
        });
        if (options.is_cancelled())
            return given_up();
        stats.buffer_bytes = stats.kd_bytes + stats.border_bytes + (has_effects(options) ? edge_map_.size_bytes() : 0) +
                             (asks_free_rays ? to_part_.size() * sizeof(WorldToPart) : 0) +
                             (options.shade && has_materials(options.look) ? materials->size_bytes() : 0) +
                             arrangement_.size_bytes() + kept_.packets.size() * sizeof(KeptPacket) +
                             frame.map_value.size() * sizeof(float);
        return frame;
    }

private:
    WorkCounts render_once(const RenderOptions& options, const MaterialTable& materials, TrimMode trim,
                           uint32_t frame_number, const RunEach& run_each, Frame& frame)
    {
        const CameraRays rays = camera_rays(options.camera, options.width, options.height);
        const PlacementView placed = arrangement_.view(scene_->pack.image);
        View view = make_view(placed, rays, options.width, options.height);
        const std::vector<uint8_t> outside = seen_from_outside(*cpu_scene_, placed, options.camera.eye);
        for (size_t i = 0; i < outside.size(); ++i)
            view.instances[i].outside = outside[i] != 0 && options.look.section.planes.empty(); // it shows the inside
        BlockJob job{*cpu_scene_, view, options.width, options.height, trim, options.shade, options.error_px};
        if (trim == TrimMode::Kd)
            job.kd = &*cpu_scene_->kd_trims();
        if (trim == TrimMode::Reference) {
            job.reference = reference_.get();
            job.record_trim_queries = options.record_trim_queries;
        }
        const StochasticJob stochastic{start_of_frame(frame_number), keeps_hits(options) ? &kept_ : nullptr};
        if (options.closest == ClosestPolicy::Stochastic)
            job.stochastic = &stochastic;
        const bool is_lit = options.shade && has_lights(options.look), is_cut = !options.look.section.planes.empty();
        const ViewRays picture{std::to_array(view.eye_mm), std::to_array(view.w0), std::to_array(view.step_x),
                               std::to_array(view.step_y), view.tau_ref};
        const PlaceView places = place_view(placed, picture);
        const FrameLights lights = is_lit ? frame_lights(placed, options) : FrameLights{};
        const SectionView section = is_cut ? section_view(placed, options.look.section, picture) : SectionView{};
        if (options.shade && has_materials(options.look))
            job.materials = &materials;
        if (options.shade)
            job.environment = options.look.environment.get();
        if (is_lit || is_cut || (job.materials && materials.transparent))
            job.places = &places;
        if (is_lit)
            job.light = &lights;
        if (is_cut)
            job.section = &section;
        job.to_part = to_part_;
        std::optional<MapJob> map;
        if (const SurfaceMapLook& look = options.look.map; has_map(options))
            map = MapJob{uint(look.map), map_view(cpu_scene_->image, look), measures(look.map)};
        job.map = map ? &*map : nullptr;
        const bool effects = has_effects(options);
        const FaceColors colors{*cpu_scene_, job.materials};
        std::optional<BlockLineDrawer> drawer;
        std::optional<EdgeJob> edges;
        if (effects) {
            const EdgeQuery query = edge_query(options);
            edge_map_.resize(options.width, options.height, query.line_reach_px > 0, query.border_reach_px > 0);
            edge_map_.own_halves_drawn = own_halves_alone(options);
            if (edge_map_.own_halves_drawn)
                drawer.emplace(colors, options, edge_map_);
            if (query.any())
                edges.emplace(EdgeJob{query, *border_cells_, edge_map_, options, drawer ? &*drawer : nullptr});
        }
        job.edges = edges ? &*edges : nullptr;
        job.specialise = options.specialise;
        const uint32_t columns = (options.width + kBlockSide - 1) / kBlockSide,
                       rows = (options.height + kBlockSide - 1) / kBlockSide;
        tbb::enumerable_thread_specific<WorkCounts> counts;
        const auto trace_one = [&](uint32_t i) {
            if (options.is_cancelled())
                return;
            const uint32_t x = i % columns * kBlockSide, y = i / columns * kBlockSide;
            const Block block{x, y, std::min(x + kBlockSide, options.width), std::min(y + kBlockSide, options.height)};
            trace_block_(job, block, scratch_.local(), frame, counts.local());
        };
        run_each(columns * rows, trace_one);
        if (effects)
            draw_effects(colors, options, run_each, edge_map_, frame);
        WorkCounts sum;
        for (const WorkCounts& some : counts)
            sum += some;
        return sum;
    }

    /// Replaces `queries` by the last frame's.
    void take_queries(std::vector<TrimQueries>& queries)
    {
        queries.clear();
        for (BlockScratch& scratch : scratch_) {
            queries.insert(queries.end(), scratch.trim_queries.begin(), scratch.trim_queries.end());
            scratch.trim_queries.clear();
        }
    }

    std::shared_ptr<const Scene> scene_;
    std::shared_ptr<const CpuScene> cpu_scene_;
    TraceBlock trace_block_;
    std::string name_;
    std::unique_ptr<const TrimReference> reference_; // made when first asked for
    tbb::enumerable_thread_specific<BlockScratch> scratch_;
    std::optional<BorderCells> border_cells_; // once a picture asks for borders
    EdgeMap edge_map_;
    KeptArrangement arrangement_;
    std::vector<WorldToPart> to_part_; // of the arrangement, once a picture needs rays from elsewhere than the eye
    KeptHits kept_; // of the picture at hand, where ClosestPolicy::Stochastic makes it in several frames
};

} // namespace

Result<std::unique_ptr<Tracer>> make_cpu_tracer(std::shared_ptr<const Scene> scene, const std::string& instruction_set)
{
    std::string found;
    const TraceBlock trace_block = find_trace_block(instruction_set, found);
    if (!trace_block)
        return Error{ErrorCode::UnsupportedPackFeature, "instruction set",
                     instruction_set.empty()
                         ? std::string("this processor has none of avx512, avx2 and sse4")
                         : fmt::format("{}: this processor does not have it, or the name is none of "
                                       "avx512, avx2 and sse4",
                                       instruction_set)};
    return std::unique_ptr<Tracer>(std::make_unique<CpuTracer>(std::move(scene), trace_block, found));
}

RayHit trace_ray(const Scene& scene, const std::array<double, 3>& origin_mm, const std::array<double, 3>& direction)
{
    const std::shared_ptr<const CpuScene> cpu_scene = prepared(scene);
    return trace_one(*cpu_scene, cpu_scene->image, origin_mm, direction);
}

RayHit trace_one(const CpuScene& scene, const PlacementView& placed, const std::array<double, 3>& origin_mm,
                 const std::array<double, 3>& direction, std::optional<uint32_t> instance)
{
    RayHit result;
    std::string found;
    const TraceBlock trace_block = find_trace_block("", found);
    const bool has_direction = direction[0] != 0 || direction[1] != 0 || direction[2] != 0;
    if (!trace_block || !has_direction)
        return result;
    View view = make_single_ray_view(placed, origin_mm, direction);
    if (instance)
        view.alone = instance;
    const BlockJob job{scene, view, 1, 1, TrimMode::Exact, false, 0.02f};
    Frame frame;
    resize(frame, 1, 1);
    const auto scratch = std::make_unique<BlockScratch>();
    WorkCounts work;
    trace_block(job, {0, 0, 1, 1}, *scratch, frame, work);
    if (frame.face[0] < 0)
        return result;
    result.hit = true;
    result.distance_mm = frame.depth_mm[0];
    for (size_t i = 0; i < 3; ++i)
        result.normal[i] = frame.normal[i];
    result.uv = {frame.uv[0], frame.uv[1]};
    result.face = frame.face[0];
    result.instance = frame.instance[0];
    return result;
}

} // namespace trimray
