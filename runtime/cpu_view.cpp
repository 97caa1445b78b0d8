#include "runtime/cpu_view.h"

#include "format/leaf_geometry.h"
#include "runtime/image_io.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trimray {
namespace {

constexpr uint kDefaultColor = 0xffb4b0acu; // as in shaders/shared/shading.h

std::array<float, 3> linear_color(uint rgba)
{
    return {srgb_to_linear(float(rgba & 0xffu) / 255), srgb_to_linear(float(rgba >> 8 & 0xffu) / 255),
            srgb_to_linear(float(rgba >> 16 & 0xffu) / 255)};
}

void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}
double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Rows of the inverse of the matrix with columns a, b, c.
void invert_columns(const double a[3], const double b[3], const double c[3], double rows[3][3])
{
    cross(b, c, rows[0]);
    cross(c, a, rows[1]);
    cross(a, b, rows[2]);
    const double det = dot(a, rows[0]);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            rows[i][j] /= det;
}

InstanceView view_from(const InstanceRecord& instance, const PartRecord& part, const View& view)
{
    // p_world = M (origin + scale p) + m
    double columns[3][3], translation[3];
    for (int row = 0; row < 3; ++row) {
        const double* m = instance.transform + 4 * row;
        for (int c = 0; c < 3; ++c)
            columns[c][row] = m[c] * part.scale_mm;
        translation[row] = m[0] * part.origin_mm[0] + m[1] * part.origin_mm[1] + m[2] * part.origin_mm[2] + m[3];
    }
    double inverse[3][3];
    invert_columns(columns[0], columns[1], columns[2], inverse);
    const double offset[3] = {view.eye_mm[0] - translation[0], view.eye_mm[1] - translation[1],
                              view.eye_mm[2] - translation[2]};
    InstanceView out;
    double w0[3];
    for (int i = 0; i < 3; ++i) {
        out.eye[i] = dot(inverse[i], offset);
        w0[i] = dot(inverse[i], view.w0);
    }
    out.k = std::sqrt(dot(w0, w0));
    constexpr double kFarRounding = 1e-15; // a few roundings of numbers as large as the distance
    out.far_slack = kFarRounding * view.plane_mm * out.k;
    for (int i = 0; i < 3; ++i) {
        out.w0[i] = w0[i] / out.k;
        out.step_x[i] = dot(inverse[i], view.step_x) / out.k;
        out.step_y[i] = dot(inverse[i], view.step_y) / out.k;
    }
    double rows[3][3];
    invert_columns(out.w0, out.step_x, out.step_y, rows);
    for (int i = 0; i < 3; ++i) {
        out.row_tau[i] = rows[0][i];
        out.row_x[i] = rows[1][i];
        out.row_y[i] = rows[2][i];
        // n_world = M^-T n: world component i = sum_j inverse[j][i] n_j
        for (int j = 0; j < 3; ++j)
            out.normal[i][j] = float(inverse[j][i] * part.scale_mm);
    }
    return out;
}

/// Fills what follows from eye, w0, steps and plane.
void finish_view(const PlacementView& placed, View& view)
{
    // tau of the model's nearest corner, or of the eye or its plane where that is behind it
    double nearest = std::numeric_limits<double>::infinity();
    for (int corner = 0; corner < 8; ++corner) {
        double p[3];
        for (int i = 0; i < 3; ++i)
            p[i] = (corner >> i & 1 ? placed.bounds_hi_mm[i] : placed.bounds_lo_mm[i]) - view.eye_mm[i];
        nearest = std::min(nearest, dot(p, view.w0));
    }
    nearest -= view.plane_mm;
    view.depth_ref = nearest > 0 && nearest < 1e30 ? double(float(nearest)) : 0;
    view.tau_ref = view.plane_mm + view.depth_ref;
    view.placed = placed;
    view.alone = placed.alone;
    view.instances.reserve(placed.instances.size());
    for (const InstanceRecord& instance : placed.instances)
        view.instances.push_back(view_from(instance, placed.parts[instance.part], view));
}

/// The box that the children of the part's root fill.
CpuScene::PartBox part_box(const PackImage& image, const PartRecord& part)
{
    CpuScene::PartBox box{{1, 1, 1}, {-1, -1, -1}, false}; // empty
    if (part.node_count == 0)
        return box;
    const BvhNode& root = image.part_nodes[part.first_node];
    for (int c = 0; c < 3; ++c) {
        const double step = std::ldexp(1.0, int(root.exponents >> 8 * c & 0xffu) - 127);
        uint lo = 255, hi = 0;
        for (int i = 0; i < 4; ++i)
            if (root.child[i] != kBvhEmpty) {
                lo = std::min(lo, root.lo[c] >> 8 * i & 0xffu);
                hi = std::max(hi, root.hi[c] >> 8 * i & 0xffu);
            }
        box.lo[c] = double(root.origin[c]) + step * lo;
        box.hi[c] = double(root.origin[c]) + step * hi;
    }
    for (uint f = part.first_face; f < part.first_face + part.face_count; ++f)
        box.has_rims = box.has_rims || (image.faces[f].flags & kFaceRims) != 0;
    return box;
}

} // namespace

CpuScene::CpuScene(const PackImage& pack) : image(pack)
{
    left_handed.resize(pack.patches.size());
    shared_patch.resize(pack.patches.size());
    for (size_t p = 0; p < pack.patches.size(); ++p) {
        const PatchRecord& patch = pack.patches[p];
        const double x[3] = {patch.axis_x[0], patch.axis_x[1], patch.axis_x[2]};
        const double y[3] = {patch.axis_y[0], patch.axis_y[1], patch.axis_y[2]};
        const double z[3] = {patch.axis_z[0], patch.axis_z[1], patch.axis_z[2]};
        double across[3];
        cross(x, y, across);
        left_handed[p] = dot(across, z) < 0;
    }
    std::vector<uint8_t> seen(pack.patches.size());
    leaf_bounds.resize(pack.leaves.size());
    for (size_t i = 0; i < pack.leaves.size(); ++i) {
        const LeafRecord& leaf = pack.leaves[i];
        const PatchRecord& patch = pack.patches[leaf.patch];
        const OrientedBox box = decode_leaf_box(leaf);
        const auto to_part = [&](const Point3& q, int c) {
            return patch.scale * (patch.axis_x[c] * q[0] + patch.axis_y[c] * q[1] + patch.axis_z[c] * q[2]);
        };
        for (int c = 0; c < 3; ++c) {
            const double origin = double(patch.origin_hi[c]) + double(patch.origin_lo[c]);
            leaf_bounds[i].center[c] = float(origin + to_part(box.center, c));
            for (int a = 0; a < 3; ++a)
                leaf_bounds[i].half_axis[a][c] = float(box.half[a] * to_part(box.axis[a], c));
        }
        if (seen[leaf.patch] && (patch.shape & 0xffu) != kKindBezier)
            shared_patch[leaf.patch] = 1;
        seen[leaf.patch] = 1;
    }
    for (const PartRecord& part : pack.parts)
        part_boxes.push_back(part_box(pack, part));
    for (const FaceRecord& face : pack.faces)
        face_color.push_back(linear_color(face.color_rgba));
    for (const InstanceRecord& instance : pack.instances)
        instance_color.push_back(linear_color(instance.color_rgba >> 24 != 0 ? instance.color_rgba : kDefaultColor));
}

std::shared_ptr<const CpuScene> prepared(const Scene& scene)
{
    return scene.prepared ? scene.prepared : std::make_shared<CpuScene>(scene.pack.image);
}

size_t CpuScene::bytes() const
{
    return leaf_bounds.size() * sizeof(LeafBounds) +
           (face_color.size() + instance_color.size()) * sizeof(face_color[0]) + left_handed.size() +
           shared_patch.size() + part_boxes.size() * sizeof(PartBox);
}

const Result<KdTrims>& CpuScene::kd_trims() const
{
    std::call_once(kd_once_, [this] { kd_.emplace(derive_kd(image)); });
    return *kd_;
}

View make_view(const PlacementView& placed, const CameraRays& rays, uint32_t width, uint32_t height)
{
    View view;
    view.plane_mm = rays.plane_mm;
    double w0[3];
    for (size_t i = 0; i < 3; ++i) {
        view.eye_mm[i] = rays.eye[i];
        w0[i] = rays.corner[i] + 0.5 * width * rays.step_x[i] + 0.5 * height * rays.step_y[i];
    }
    const double length = std::sqrt(dot(w0, w0));
    for (size_t i = 0; i < 3; ++i) {
        view.w0[i] = w0[i] / length;
        view.step_x[i] = rays.step_x[i] / length;
        view.step_y[i] = rays.step_y[i] / length;
    }
    finish_view(placed, view);
    return view;
}

View make_single_ray_view(const PlacementView& placed, const std::array<double, 3>& origin_mm,
                          const std::array<double, 3>& direction)
{
    constexpr double kPixel = 1e-4;
    View view;
    double d[3] = {direction[0], direction[1], direction[2]};
    const double largest = std::max({std::abs(d[0]), std::abs(d[1]), std::abs(d[2])});
    for (double& x : d)
        x /= largest;
    const double length = std::sqrt(dot(d, d));
    int least = 0;
    for (int i = 0; i < 3; ++i) {
        view.eye_mm[i] = origin_mm[size_t(i)];
        view.w0[i] = d[i] / length;
        if (std::abs(view.w0[i]) < std::abs(view.w0[least]))
            least = i;
    }
    double axis[3] = {0, 0, 0};
    axis[least] = 1;
    cross(view.w0, axis, view.step_x);
    const double across = std::sqrt(dot(view.step_x, view.step_x));
    for (double& x : view.step_x)
        x *= kPixel / across;
    cross(view.w0, view.step_x, view.step_y);
    finish_view(placed, view);
    return view;
}

InstanceView world_view(const View& view)
{
    InstanceRecord world{};
    world.transform[0] = world.transform[5] = world.transform[10] = 1;
    PartRecord unit{};
    for (int i = 0; i < 3; ++i)
        unit.origin_mm[i] = view.placed.world_origin_mm[size_t(i)];
    unit.scale_mm = view.placed.world_scale_mm;
    return view_from(world, unit, view);
}

PatchView make_patch_view(const PatchRecord& patch, const InstanceView& instance, double tau_ref)
{
    double origin[3], middle[3];
    for (int i = 0; i < 3; ++i)
        origin[i] = double(patch.origin_hi[i]) + double(patch.origin_lo[i]) - instance.eye[i];
    const double tau = dot(instance.row_tau, origin);
    const double per_scale = 1 / double(patch.scale);
    for (int i = 0; i < 3; ++i)
        middle[i] = (tau * instance.w0[i] - origin[i]) * per_scale;
    const float* axes[3] = {patch.axis_x, patch.axis_y, patch.axis_z};
    PatchView out;
    double largest = 0;
    for (int a = 0; a < 3; ++a) {
        const double axis[3] = {axes[a][0], axes[a][1], axes[a][2]};
        out.origin[a] = float(dot(axis, middle));
        out.w0[a] = float(dot(axis, instance.w0));
        out.step_x[a] = float(dot(axis, instance.step_x));
        out.step_y[a] = float(dot(axis, instance.step_y));
        largest = std::max(largest, std::abs(double(out.origin[a])));
    }
    out.tau = float(tau * per_scale);
    out.base_mm = float(tau / instance.k - tau_ref);
    out.mm_per_t = float(patch.scale / instance.k);
    // the patch's own arithmetic, |q| about 1, and one rounding of base_mm
    out.slack_mm =
        float(4e-7 * (1 + largest) * out.mm_per_t + 1.2e-7 * std::abs(out.base_mm) + instance.far_slack / instance.k);
    out.pixel = float(std::sqrt(dot(instance.step_x, instance.step_x)));
    return out;
}

} // namespace trimray
