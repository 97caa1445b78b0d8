#include "runtime/vk_scene.h"

#include "runtime/eye_side.h"
#include "runtime/frame_effects.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>

namespace trimray {

namespace {

using Vec3 = std::array<double, 3>;

Vec3 operator+(const Vec3& a, const Vec3& b)
{
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
Vec3 operator-(const Vec3& a, const Vec3& b)
{
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Vec3 operator*(const Vec3& a, double s)
{
    return {a[0] * s, a[1] * s, a[2] * s};
}
double dot(const Vec3& a, const Vec3& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Vec3 cross(const Vec3& a, const Vec3& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double length(const Vec3& a)
{
    return std::sqrt(dot(a, a));
}

void store(const Vec3& v, float (&out)[3])
{
    for (int i = 0; i < 3; ++i)
        out[i] = static_cast<float>(v[i]);
}
void store_pair(const Vec3& v, float (&hi)[3], float (&lo)[3])
{
    for (int i = 0; i < 3; ++i) {
        hi[i] = static_cast<float>(v[i]);
        lo[i] = static_cast<float>(v[i] - static_cast<double>(hi[i]));
    }
}

// A node without children: the tree of a part or scene that holds nothing.
BvhNode empty_node()
{
    BvhNode node{};
    std::fill(std::begin(node.child), std::end(node.child), kBvhEmpty);
    return node;
}

template <class T>
std::span<const std::byte> bytes_of(const std::vector<T>& values)
{
    return std::as_bytes(std::span(values));
}

// tau of the model's nearest corner, or of the eye where that is behind it.
float nearest_tau(const PlacementView& placed, const Vec3& eye, const Vec3& w0)
{
    double nearest = std::numeric_limits<double>::infinity();
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 p;
        for (size_t i = 0; i < 3; ++i)
            p[i] = (corner >> i & 1 ? placed.bounds_hi_mm[i] : placed.bounds_lo_mm[i]) - eye[i];
        nearest = std::min(nearest, dot(p, w0));
    }
    return nearest > 0 && nearest < 1e30 ? static_cast<float>(nearest) : 0.0f;
}

// Part mm to world mm and back, without the translation.
struct Linear {
    Vec3 row[3];
    Vec3 operator()(const Vec3& v) const { return {dot(row[0], v), dot(row[1], v), dot(row[2], v)}; }
};

// An array of the pack, or made from it, on its way to the device.
struct Array {
    uint32_t binding;
    std::span<const std::byte> bytes;
    const char* name;
};

Status upload_arrays(VulkanDevice& device, std::span<const Array> arrays,
                     std::array<VulkanBuffer, kFrameBindings>& buffers)
{
    for (const Array& array : arrays) {
        if (array.bytes.empty())
            continue;
        Result<VulkanBuffer> buffer = upload_storage(device, array.bytes, array.name);
        if (!buffer)
            return buffer.error();
        buffers[array.binding] = std::move(*buffer);
    }
    return Done{};
}

// kFeature bits, but for kFeatureCount and kFeatureLate
uint32_t plan_features(const EffectPlan& plan)
{
    uint32_t features = 0;
    for (const auto& [wanted, feature] :
         {std::pair{plan.trims, kFeatureTrims}, std::pair{plan.rational, kFeatureRational},
          std::pair{plan.rims, kFeatureRims}, std::pair{plan.shade, kFeatureShade},
          std::pair{plan.edges, kFeatureEdges}, std::pair{plan.stochastic, kFeatureStochastic},
          std::pair{plan.keeps_hits, kFeatureKept}, std::pair{plan.reuses_hits, kFeatureReuse},
          std::pair{plan.lit, kFeatureLights}, std::pair{plan.cut, kFeatureCut},
          std::pair{plan.parallel, kFeatureParallel}, std::pair{plan.materials, kFeatureMaterials},
          std::pair{plan.layers, kFeatureLayers}, std::pair{plan.mirrors, kFeatureMirrors},
          std::pair{plan.environment, kFeatureEnvironment}})
        features |= wanted ? feature : 0u;
    return features;
}

uint32_t plan_trims(const EffectPlan& plan)
{
    switch (plan.trim) {
    case TrimMode::Sdf:
        return kTrimByTexture;
    case TrimMode::Hybrid:
        return kTrimByBoth;
    case TrimMode::Kd:
        return kTrimByKd;
    default:
        return kTrimByCells;
    }
}

} // namespace

Specialisation specialisation(const EffectPlan& plan, bool count)
{
    const bool known = plan.specialised;
    Specialisation constants{};
    constants[kSpecTrimMode] = known ? plan_trims(plan) : uint32_t{kTrimByCells};
    constants[kSpecKinds] = known ? plan.kinds : ~0u;
    constants[kSpecFeatures] = (known ? plan_features(plan) : uint32_t{kFeatureLate}) | (count ? kFeatureCount : 0u);
    constants[kSpecStackSize] = plan.stack_size;
    constants[kSpecLocalFloats] = plan.local_floats;
    constants[kSpecIterationLimit] = plan.iteration_limit;
    constants[kSpecDegreeU] = plan.degree_u;
    constants[kSpecDegreeV] = plan.degree_v;
    constants[kSpecLargestDegree] = plan.largest_degree;
    constants[kSpecMap] = known ? static_cast<uint32_t>(plan.map) : uint32_t{kMapNone};
    return constants;
}

void decide_late(const EffectPlan& plan, FrameView& view)
{
    view.first_sample = plan_features(plan);
    view.end_sample = static_cast<uint32_t>(plan.map) | plan_trims(plan) << 8;
}

Result<std::array<VulkanBuffer, kFrameBindings>> upload_scene(VulkanDevice& device, const PackImage& image)
{
    std::vector<BvhNode> part_nodes = image.part_nodes;
    part_nodes.push_back(empty_node()); // for parts without any, see frame_setup

    const Array arrays[] = {
        {kBindPartNodes, bytes_of(part_nodes), "the parts' trees"},
        {kBindLeaves, bytes_of(image.leaves), "the leaves"},
        {kBindPatches, bytes_of(image.patches), "the patches"},
        {kBindControlPoints, bytes_of(image.control_points), "the control points"},
        {kBindFaces, bytes_of(image.faces), "the faces"},
        {kBindCells, bytes_of(image.cells), "the trim cells"},
        {kBindCellEntries, bytes_of(image.cell_entries), "the trim cells' entries"},
        {kBindTrimPoints, bytes_of(image.trim_points), "the trim points"},
    };
    std::array<VulkanBuffer, kFrameBindings> buffers;
    if (const Status uploaded = upload_arrays(device, arrays, buffers); !uploaded)
        return uploaded.error();
    Result<VulkanBuffer> top_tree = upload_top_tree(device, image.top_nodes);
    if (!top_tree)
        return top_tree.error();
    buffers[kBindTopNodes] = std::move(*top_tree);
    return buffers;
}

Result<VulkanBuffer> upload_top_tree(VulkanDevice& device, std::span<const BvhNode> nodes)
{
    const BvhNode none = empty_node();
    return upload_storage(device, std::as_bytes(nodes.empty() ? std::span(&none, 1) : nodes), "the top tree");
}

Status upload_kd(VulkanDevice& device, const KdTrims& kd, std::array<VulkanBuffer, kFrameBindings>& buffers)
{
    const Array arrays[] = {
        {kBindKdNodes, bytes_of(kd.nodes), "the kd-trees' nodes"},
        {kBindKdRuns, bytes_of(kd.runs), "the kd-trees' runs"},
        {kBindKdPoints, bytes_of(kd.points), "the kd-trees' points"},
        {kBindKdFaces, bytes_of(kd.faces), "the faces' kd-trees"},
    };
    return upload_arrays(device, arrays, buffers);
}

Result<FrameSetup> frame_setup(const CpuScene& scene, const PlacementView& placed, const RenderOptions& options)
{
    const PackImage& image = scene.image;
    const CameraRays rays = camera_rays(options.camera, options.width, options.height);
    const double middle[2] = {0.5 * options.width, 0.5 * options.height};
    const Vec3 through_middle = rays.corner + rays.step_x * middle[0] + rays.step_y * middle[1];
    const double per_length = 1.0 / length(through_middle);

    FrameSetup setup;
    setup.eye = rays.eye;
    setup.w0 = through_middle * per_length;
    setup.step_x = rays.step_x * per_length;
    setup.step_y = rays.step_y * per_length;
    // what the device takes: of parallel rays the steps between them, from their own plane
    const bool parallel = options.camera.orthographic_mm > 0;
    const Vec3 eye_mm = options.camera.eye;
    const Vec3 view_x = setup.step_x * (parallel ? rays.plane_mm : 1.0);
    const Vec3 view_y = setup.step_y * (parallel ? rays.plane_mm : 1.0);

    FrameView& view = setup.view;
    const Vec3 world_origin = placed.world_origin_mm;
    const double top_tau = dot(world_origin - eye_mm, setup.w0);
    store((eye_mm + setup.w0 * top_tau - world_origin) * (1.0 / placed.world_scale_mm), view.top_origin);
    view.top_tau = static_cast<float>(top_tau);
    view.per_world_scale = static_cast<float>(1.0 / placed.world_scale_mm);
    store(setup.w0, view.w0);
    store(view_x, view.step_x);
    store(view_y, view.step_y);
    view.middle[0] = static_cast<float>(middle[0]);
    view.middle[1] = static_cast<float>(middle[1]);
    view.width = options.width;
    view.height = options.height;
    view.error_px = options.error_px;
    const EdgeQuery query = edge_query(options);
    view.line_width_px = query.line_width_px;
    view.line_reach_px = query.line_reach_px;
    view.border_reach_px = query.border_reach_px;
    view.line_classes = query.line_classes;
    view.tau_ref = nearest_tau(placed, eye_mm, setup.w0);
    setup.tau_ref = rays.plane_mm + static_cast<double>(view.tau_ref);

    const std::vector<uint8_t> outside = seen_from_outside(scene, placed, eye_mm);
    setup.instances.resize(std::max<size_t>(placed.instances.size(), 1));
    for (size_t i = 0; i < placed.instances.size(); ++i) {
        const InstanceRecord& record = placed.instances[i];
        const PartRecord& part = placed.parts[record.part];
        const double* m = record.transform;
        const Vec3 column[3] = {{m[0], m[4], m[8]}, {m[1], m[5], m[9]}, {m[2], m[6], m[10]}};
        const Vec3 translation = {m[3], m[7], m[11]};
        // rows of the inverse = cofactors over the determinant; they are also the columns of the inverse transpose
        const double determinant = dot(column[0], cross(column[1], column[2]));
        if (determinant == 0 || !std::isfinite(1.0 / determinant))
            return Error{ErrorCode::InvalidPack, fmt::format("instance {}", i), "its transform has no inverse"};
        const Linear inverse{{cross(column[1], column[2]) * (1.0 / determinant),
                              cross(column[2], column[0]) * (1.0 / determinant),
                              cross(column[0], column[1]) * (1.0 / determinant)}};
        const double per_scale = 1.0 / part.scale_mm;
        const Vec3 eye = (inverse(eye_mm - translation) - std::to_array(part.origin_mm)) * per_scale;
        const Vec3 w0 = inverse(setup.w0) * per_scale;
        const Vec3 step_x = inverse(view_x) * per_scale;
        const Vec3 step_y = inverse(view_y) * per_scale;

        FrameInstance& instance = setup.instances[i];
        store_pair(eye, instance.eye_hi, instance.eye_lo);
        store_pair(w0, instance.w0_hi, instance.w0_lo);
        store(step_x, instance.step_x);
        store(step_y, instance.step_y);
        instance.node_tau = static_cast<float>(-dot(eye, w0) / dot(w0, w0)); // nearest to the part's origin
        store(eye + w0 * static_cast<double>(instance.node_tau), instance.node_origin);
        // only directions of normals matter: scaled to about 1
        const double size = std::max({length(inverse.row[0]), length(inverse.row[1]), length(inverse.row[2])});
        store(inverse.row[0] * (1.0 / size), instance.normal_x);
        store(inverse.row[1] * (1.0 / size), instance.normal_y);
        store(inverse.row[2] * (1.0 / size), instance.normal_z);
        instance.footprint = static_cast<float>(std::min(length(step_x), length(step_y)));
        instance.first_node = part.node_count > 0 ? part.first_node : static_cast<uint32_t>(image.part_nodes.size());
        instance.first_leaf = part.first_leaf;
        instance.color_rgba = record.color_rgba;
        instance.outside = outside[i] != 0 && options.look.section.planes.empty(); // a section shows the inside
    }
    return setup;
}

} // namespace trimray
