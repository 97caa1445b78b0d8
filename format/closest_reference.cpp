#include "format/closest_reference.h"

#include "format/native_reference.h"

#include <cassert>
#include <numbers>

namespace trimray {
namespace {

using reference::Bounds;
using reference::Ray;
using reference::Root;
using reference::Vec3;
using Real = long double;
using Real3 = std::array<Real, 3>;
using Matrix = std::array<Real, 9>; // row-major

constexpr double kTie = 1e-12; // of the distance

Real3 times(const Matrix& m, const Real3& a)
{
    Real3 out;
    for (size_t row = 0; row < 3; ++row)
        out[row] = m[3 * row] * a[0] + m[3 * row + 1] * a[1] + m[3 * row + 2] * a[2];
    return out;
}

Matrix inverse(const Matrix& m)
{
    Matrix out;
    for (size_t i = 0; i < 3; ++i)
        for (size_t j = 0; j < 3; ++j) {
            const size_t i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            out[3 * j + i] = m[3 * i1 + j1] * m[3 * i2 + j2] - m[3 * i1 + j2] * m[3 * i2 + j1]; // of the transposed
        }
    const Real det = m[0] * out[0] + m[1] * out[3] + m[2] * out[6];
    for (Real& x : out)
        x /= det;
    return out;
}

Real3 widen(const Vec3& a)
{
    return {a[0], a[1], a[2]};
}

uint kind_of(const PatchRecord& patch)
{
    return patch.shape & 0xffu;
}

double patch_origin(const PatchRecord& patch, size_t axis)
{
    return double(patch.origin_hi[axis]) + double(patch.origin_lo[axis]);
}

/// Columns are the patch's axes in part space.
Matrix axes_of(const PatchRecord& patch)
{
    return {patch.axis_x[0], patch.axis_y[0], patch.axis_z[0], patch.axis_x[1], patch.axis_y[1],
            patch.axis_z[1], patch.axis_x[2], patch.axis_y[2], patch.axis_z[2]};
}

/// In part units.
Bounds part_bounds(const PatchRecord& patch, const Bounds& own)
{
    const Matrix axes = axes_of(patch);
    Bounds box;
    for (int corner = 0; corner < 8; ++corner) {
        const Real3 p = times(axes, widen(own.corner(corner)));
        Vec3 in_part;
        for (size_t i = 0; i < 3; ++i)
            in_part[i] = patch_origin(patch, i) + patch.scale * double(p[i]);
        box.add(in_part);
    }
    return box;
}

} // namespace

/// One ray on its way through the scene.
struct ClosestReference::Walk {
    explicit Walk(const Ray& ray) : world(ray), speed(reference::length(ray.direction)) { assert(speed > 0); }

    Ray world;
    double speed;              // |direction|: mm a unit of t
    bool shells_alone = false; // meets faces with rims only, all of them
    std::optional<uint> only;  // meets this face alone
    uint instance = 0;
    Real3 origin_part{}, direction_part{};
    ReferenceHit best;
    double best_t = std::numeric_limits<double>::infinity();
    double open_from = std::numeric_limits<double>::infinity();

    /// Beyond it nothing can be the closest any more.
    double t_hi() const { return best_t * (1 + kTie); }
    bool meets_back(const Vec3& outward_in_part) const
    {
        Real along = 0;
        for (size_t i = 0; i < 3; ++i)
            along += direction_part[i] * outward_in_part[i];
        return along > 0;
    }
};

ClosestReference::ClosestReference(const PackImage& image)
    : image_(image), trims_(image), beziers_(image.patches.size()), parts_(image.parts.size())
{
    for (const PatchRecord& patch : image.patches)
        to_patch_.push_back(inverse(axes_of(patch)));
    for (size_t p = 0; p < image.parts.size(); ++p) {
        const PartRecord& part = image.parts[p];
        std::vector<Bounds> boxes;
        for (uint i = part.first_patch; i < part.first_patch + part.patch_count; ++i) {
            const PatchRecord& patch = image.patches[i];
            if (kind_of(patch) == kKindBezier) {
                double overlap[2];
                for (size_t k = 0; k < 2; ++k)
                    overlap[k] =
                        std::min(double(kDomainSlack) / std::abs(double(patch.uv_scale[k])), double(kMostPatchSlack));
                beziers_[i].emplace(patch, image.control_points.data(), overlap[0], overlap[1]);
                boxes.push_back(part_bounds(patch, beziers_[i]->bounds()));
                continue;
            }
            double lo[2], hi[2]; // uv_patch of the face's domain
            for (size_t k = 0; k < 2; ++k) {
                const double a = (-double(kDomainSlack) - patch.uv_offset[k]) / patch.uv_scale[k];
                const double b = (1 + double(kDomainSlack) - patch.uv_offset[k]) / patch.uv_scale[k];
                lo[k] = std::min(a, b);
                hi[k] = std::max(a, b);
            }
            boxes.push_back(part_bounds(patch, reference::native_bounds(patch, lo, hi)));
        }
        parts_[p] = reference::BoxTree(std::move(boxes));
    }
    place(image.instances);
}

void ClosestReference::place(std::span<const InstanceRecord> instances, std::span<const uint8_t> visible)
{
    placements_.clear();
    std::vector<Bounds> placed;
    for (const InstanceRecord& instance : instances) {
        const PartRecord& part = image_.parts[instance.part];
        // p_world = M (origin + scale p) + m
        Placement placement;
        Matrix scaled, plain;
        for (size_t row = 0; row < 3; ++row) {
            const double* m = instance.transform + 4 * row;
            placement.moved_mm[row] = m[3];
            for (size_t c = 0; c < 3; ++c) {
                placement.moved_mm[row] += Real(m[c]) * part.origin_mm[c];
                plain[3 * row + c] = m[c];
                scaled[3 * row + c] = Real(m[c]) * part.scale_mm;
            }
        }
        placement.to_part = inverse(scaled);
        const Matrix back = inverse(plain);
        for (size_t row = 0; row < 3; ++row)
            for (size_t c = 0; c < 3; ++c)
                placement.normal[row][c] = double(back[3 * c + row]);
        placements_.push_back(placement);
        const Bounds own = parts_[instance.part].bounds();
        const bool is_visible = visible.empty() || visible[placed.size()] != 0;
        Bounds box;
        for (int corner = 0; corner < 8 && is_visible && !own.empty(); ++corner) {
            const Real3 p = times(scaled, widen(own.corner(corner)));
            box.add({double(placement.moved_mm[0] + p[0]), double(placement.moved_mm[1] + p[1]),
                     double(placement.moved_mm[2] + p[2])});
        }
        placed.push_back(box);
    }
    placed_ = reference::BoxTree(std::move(placed));
}

void ClosestReference::accept(uint patch_id, const Root& root, double t, Walk& walk) const
{
    const PatchRecord& patch = image_.patches[patch_id];
    const double at[2] = {root.u, root.v};
    std::array<double, 2> uv;
    for (size_t k = 0; k < 2; ++k)
        uv[k] = double(patch.uv_offset[k]) + double(patch.uv_scale[k]) * at[k];
    const double half_turn = std::numbers::pi * double(patch.uv_scale[1]);
    if (kind_of(patch) == kKindTorus && uv[1] < 0.5 - half_turn) // pack_layout.h, surface kinds
        uv[1] += 2 * half_turn;
    for (const double x : uv)
        if (!(x >= -double(kDomainSlack) && x <= 1 + double(kDomainSlack)))
            return;
    const bool nearer = t < walk.best_t * (1 - kTie);
    const bool first =
        walk.instance < walk.best.instance || (walk.instance == walk.best.instance && patch.face < walk.best.face);
    if (walk.best.hit && !nearer && !first)
        return;
    for (double& x : uv)
        x = std::clamp(x, 0.0, double(kUvBelowOne));
    if (!trims_.inside(patch.face, uv[0], uv[1]) || is_cut_rim(patch_id, root, uv, walk))
        return;
    walk.best_t = t;
    walk.best.hit = true;
    walk.best.distance_mm = t * walk.speed;
    walk.best.face = patch.face;
    walk.best.instance = walk.instance;
    walk.best.patch = patch_id;
    walk.best.kind = kind_of(patch);
    walk.best.uv_patch = {root.u, root.v};
    walk.best.uv_face = uv;
    walk.best.contact = root.contact;
}

bool ClosestReference::is_cut_rim(uint patch_id, const Root& root, const std::array<double, 2>& uv,
                                  const Walk& walk) const
{
    const uint face_id = image_.patches[patch_id].face, flags = image_.faces[face_id].flags;
    if (walk.shells_alone || (flags & kFaceRims) == 0)
        return false;
    if (!walk.meets_back(outward_in_part(patch_id, {root.u, root.v})))
        return false;
    const double width[2] = {std::ldexp(1.0, -int(flags >> kFaceRimBit & kFaceRimMask)),
                             std::ldexp(1.0, -int(flags >> (kFaceRimBit + kFaceRimBits) & kFaceRimMask))};
    for (int corner = 0; corner < 4; ++corner) {
        const double q[2] = {uv[0] + (corner & 1 ? width[0] : -width[0]), uv[1] + (corner & 2 ? width[1] : -width[1])};
        const bool in_domain = q[0] >= 0 && q[0] <= 1 && q[1] >= 0 && q[1] <= 1;
        if (!in_domain ||
            !trims_.inside(face_id, std::min(q[0], double(kUvBelowOne)), std::min(q[1], double(kUvBelowOne))))
            return begins_outside(walk);
    }
    return false;
}

bool ClosestReference::begins_outside(const Walk& walk) const
{
    constexpr std::array<Vec3, 7> kDirections{{{0.83, 0.21, 0.52},
                                               {-0.71, 0.57, -0.41},
                                               {0.31, -0.78, 0.55},
                                               {-0.36, -0.61, -0.7},
                                               {0.17, 0.9, -0.39},
                                               {-0.53, -0.12, 0.84},
                                               {0.66, -0.44, -0.61}}};
    size_t backs = 0;
    for (const Vec3& direction : kDirections) {
        Walk probe({walk.world.origin, direction});
        probe.shells_alone = true;
        intersect_instance(walk.instance, probe);
        backs += probe.best.hit && probe.meets_back(outward_in_part(probe.best.patch, probe.best.uv_patch));
    }
    return 2 * backs < kDirections.size();
}

void ClosestReference::intersect_patch(uint patch_id, Walk& walk) const
{
    const PatchRecord& patch = image_.patches[patch_id];
    if ((walk.shells_alone && (image_.faces[patch.face].flags & kFaceRims) == 0) ||
        walk.only.value_or(patch.face) != patch.face)
        return;
    ++walk.best.patches;
    // to patch space, from the line's point nearest to the patch's origin: there the rest of the way loses nothing
    Real3 offset;
    Real along = 0, length2 = 0;
    for (size_t i = 0; i < 3; ++i) {
        offset[i] = walk.origin_part[i] - (Real(patch.origin_hi[i]) + Real(patch.origin_lo[i]));
        along -= offset[i] * walk.direction_part[i];
        length2 += walk.direction_part[i] * walk.direction_part[i];
    }
    const Real base = along / length2;
    for (size_t i = 0; i < 3; ++i)
        offset[i] += base * walk.direction_part[i];
    const Matrix& back = to_patch_[patch_id];
    const Real3 o = times(back, offset), d = times(back, walk.direction_part);
    Ray ray;
    for (size_t i = 0; i < 3; ++i) {
        ray.origin[i] = double(o[i] / patch.scale);
        ray.direction[i] = double(d[i] / patch.scale);
    }
    const auto t_base = double(base);
    const auto take = [&](const Root& root) {
        const double t = t_base + root.t;
        if (t > 0 && t <= walk.t_hi())
            accept(patch_id, root, t, walk);
        return walk.t_hi() - t_base;
    };
    if (kind_of(patch) != kKindBezier) {
        for (const Root& root : reference::native_roots(patch, ray))
            take(root);
        return;
    }
    const reference::SearchEnd end = beziers_[patch_id]->intersect(ray, -t_base, walk.t_hi() - t_base, take);
    walk.best.boxes += end.boxes;
    walk.open_from = std::min(walk.open_from, t_base + end.open_from);
}

void ClosestReference::intersect_instance(uint instance, Walk& walk) const
{
    const Placement& placement = placements_[instance];
    const uint part_id = image_.instances[instance].part;
    const PartRecord& part = image_.parts[part_id];
    walk.instance = instance;
    Real3 offset;
    for (size_t i = 0; i < 3; ++i)
        offset[i] = walk.world.origin[i] - placement.moved_mm[i];
    walk.origin_part = times(placement.to_part, offset);
    walk.direction_part = times(placement.to_part, widen(walk.world.direction));
    Ray in_part;
    for (size_t i = 0; i < 3; ++i) {
        in_part.origin[i] = double(walk.origin_part[i]);
        in_part.direction[i] = double(walk.direction_part[i]);
    }
    parts_[part_id].walk(in_part, walk.t_hi(), [&](uint patch) {
        intersect_patch(part.first_patch + patch, walk);
        return walk.t_hi();
    });
}

ReferenceHit ClosestReference::end(Walk walk) const
{
    walk.best.open = walk.open_from < walk.best_t;
    if (walk.best.hit)
        finish(walk.best);
    return walk.best;
}

ReferenceHit ClosestReference::closest(const Ray& ray) const
{
    Walk walk(ray);
    placed_.walk(ray, walk.t_hi(), [&](uint instance) {
        intersect_instance(instance, walk);
        return walk.t_hi();
    });
    return end(walk);
}

ReferenceHit ClosestReference::closest_of(const Ray& ray, uint instance, uint face) const
{
    Walk walk(ray);
    walk.only = face;
    intersect_instance(instance, walk);
    return end(walk);
}

/// Unnormalised; axes of the part, a covector.
Vec3 ClosestReference::outward_in_part(uint patch_id, const std::array<double, 2>& uv_patch) const
{
    const PatchRecord& patch = image_.patches[patch_id];
    // beyond a pole's side a patch is turned inside out
    const Vec3 own = kind_of(patch) == kKindBezier ? beziers_[patch_id]->normal(std::clamp(uv_patch[0], 0.0, 1.0),
                                                                                std::clamp(uv_patch[1], 0.0, 1.0))
                                                   : reference::native_normal(patch, uv_patch[0], uv_patch[1]);
    const Matrix a = axes_of(patch);
    const Real handed =
        a[0] * (a[4] * a[8] - a[5] * a[7]) - a[1] * (a[3] * a[8] - a[5] * a[6]) + a[2] * (a[3] * a[7] - a[4] * a[6]);
    const double turn = (handed < 0) != ((image_.faces[patch.face].flags & kFaceReversed) != 0) ? -1 : 1;
    const Real3 in_part = times(a, widen(own));
    return {turn * double(in_part[0]), turn * double(in_part[1]), turn * double(in_part[2])};
}

void ClosestReference::finish(ReferenceHit& hit) const
{
    const FaceRecord& face = image_.faces[hit.face];
    for (size_t k = 0; k < 2; ++k)
        hit.uv_file[k] = face.domain_lo[k] + (face.domain_hi[k] - face.domain_lo[k]) * hit.uv_face[k];
    // n_world = M^-T n: outward stays outward in a mirror image
    const Vec3 in_part = outward_in_part(hit.patch, hit.uv_patch);
    const Placement& placement = placements_[hit.instance];
    Vec3 normal{};
    for (size_t row = 0; row < 3; ++row)
        for (size_t c = 0; c < 3; ++c)
            normal[row] += placement.normal[row][c] * in_part[c];
    const double size = reference::length(normal);
    if (size > 0)
        hit.normal = reference::operator*(normal, 1 / size);
}

Hair ClosestReference::hair(const Ray& ray, const ReferenceHit& answer, const Vec3& step_x, const Vec3& step_y,
                            double reach_px) const
{
    constexpr int kDirections = 8;
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    using reference::operator+;
    using reference::operator*;
    const double pixel =
        std::max(reference::length(step_x), reference::length(step_y)) / reference::length(ray.direction);
    Hair hair;
    for (int i = 0; i < kDirections; ++i) {
        const double angle = 2 * std::numbers::pi * i / kDirections;
        Ray moved = ray;
        moved.direction = ray.direction + step_x * (reach_px * std::cos(angle)) + step_y * (reach_px * std::sin(angle));
        const ReferenceHit other = closest(moved);
        if (other.hit != answer.hit)
            return {Doubt::Tangent, kInfinity, kInfinity};
        if (!answer.hit)
            continue;
        const double deeper = std::abs(other.distance_mm - answer.distance_mm);
        if (deeper > pixel * std::min(other.distance_mm, answer.distance_mm))
            return {Doubt::Tangent, kInfinity, kInfinity};
        hair.depth_mm = std::max(hair.depth_mm, deeper);
        hair.turn_deg = std::max(hair.turn_deg, reference::angle_deg(other.normal, answer.normal));
        if (other.face != answer.face || other.instance != answer.instance)
            hair.doubt = Doubt::Face;
    }
    return hair;
}

} // namespace trimray
