// Scenes made by hand for the tracers' tests: one part of 20 mm with faces of all kinds, placed as often as one likes.
#pragma once

#include "format/derive.h"
#include "runtime/tracer.h"
#include "tests/trim_shapes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <initializer_list>
#include <memory>
#include <numbers>

namespace trimray {

struct TracedScene {
    PackImage image;
    bool with_textures = true;
    LeafOptions leaf_options;

    TracedScene()
    {
        PartRecord part{};
        part.scale_mm = 10;
        image.parts.push_back(part);
        image.tree.push_back(TreeNode{});
    }

    /// A face of one native patch around `origin` (part units), u and v running to +- half_uv. Its radius is 1 times
    /// the scale. Untrimmed.
    PatchRecord& add(uint kind, double scale, std::array<double, 3> origin, std::array<double, 2> half_uv)
    {
        FaceRecord face{};
        face.flags = kFaceNaturalBorder | kFaceHasColor;
        const uint shade = static_cast<uint>(image.faces.size()) * 0x29u % 0xa0u;
        face.color_rgba = 0xff000000u | (0x40u + shade) | (0xe0u - shade) << 8 | (0x60u + shade / 2) << 16;
        face.first_patch = static_cast<uint>(image.patches.size());
        face.patch_count = 1;
        face.area_mm2 = 100;
        face.extent_mm[0] = face.extent_mm[1] = 10;
        face.surface_kind = kind;
        PatchRecord patch{};
        for (size_t i = 0; i < 2; ++i) {
            face.domain_lo[i] = kind == kKindBezier ? 0 : -half_uv[i];
            face.domain_hi[i] = kind == kKindBezier ? 1 : half_uv[i];
            patch.uv_offset[i] = kind == kKindBezier ? 0.0f : 0.5f;
            patch.uv_scale[i] = kind == kKindBezier ? 1.0f : static_cast<float>(0.5 / half_uv[i]);
        }
        for (size_t i = 0; i < 3; ++i) {
            patch.origin_hi[i] = static_cast<float>(origin[i]);
            patch.origin_lo[i] = static_cast<float>(origin[i] - static_cast<double>(patch.origin_hi[i]));
        }
        patch.scale = static_cast<float>(scale);
        patch.face = static_cast<uint>(image.faces.size());
        patch.shape = kind;
        patch.axis_x[0] = patch.axis_y[1] = patch.axis_z[2] = 1;
        patch.param[0] = 1;
        image.faces.push_back(face);
        image.patches.push_back(patch);
        return image.patches.back();
    }

    PatchRecord& add_bezier(int degree_u, int degree_v, bool rational, double scale, std::array<double, 3> origin)
    {
        PatchRecord& patch = add(kKindBezier, scale, origin, {1, 1});
        patch.shape |= static_cast<uint>(degree_u) << 8 | static_cast<uint>(degree_v) << 16;
        patch.shape |= rational ? kShapeRational : 0u;
        patch.first_control_point = static_cast<uint>(image.control_points.size());
        return patch;
    }

    /// A polynomial patch of the given degree over [-1, 1]^2 whose control points go up and down by `height`.
    void add_wave(int degree, std::array<double, 3> origin, float height, double scale = 0.9)
    {
        add_bezier(degree, degree, false, scale, origin);
        for (int i = 0; i <= degree; ++i) {
            for (int j = 0; j <= degree; ++j) {
                const auto at = [&](int k) { return 2.0f * static_cast<float>(k) / static_cast<float>(degree) - 1; };
                const float z = height * static_cast<float>(std::sin(3.0 * at(i)) * std::cos(4.0 * at(j)));
                image.control_points.insert(image.control_points.end(), {at(i), at(j), z});
            }
        }
    }

    /// Gives a face trim loops. Call it for the faces in their order.
    void trim(size_t face, const std::vector<shapes::Loop>& loops)
    {
        PackImage drawn;
        drawn.trim_points.swap(image.trim_points);
        drawn.trim_pieces.swap(image.trim_pieces);
        shapes::add_face(drawn, loops, 10, 10);
        drawn.trim_points.swap(image.trim_points);
        drawn.trim_pieces.swap(image.trim_pieces);
        const FaceRecord& from = drawn.faces[0];
        FaceRecord& to = image.faces[face];
        to.flags &= ~kFaceNaturalBorder;
        to.first_point = from.first_point;
        to.point_count = from.point_count;
        to.first_piece = from.first_piece;
        to.piece_count = from.piece_count;
        to.loop_count = from.loop_count;
    }

    /// Row-major 3x4, part mm to world mm.
    void place(std::array<double, 12> transform)
    {
        InstanceRecord instance{};
        std::copy(transform.begin(), transform.end(), instance.transform);
        image.instances.push_back(instance);
    }

    /// Derives leaves, trees, cells and textures; placed once where it is, if it was not placed.
    std::shared_ptr<const Scene> finish()
    {
        if (image.instances.empty())
            place({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
        image.parts[0].face_count = static_cast<uint>(image.faces.size());
        image.parts[0].patch_count = static_cast<uint>(image.patches.size());
        for (size_t i = 0; i < 3; ++i) {
            image.bounds_lo_mm[i] = -30;
            image.bounds_hi_mm[i] = 30;
        }
        image.world_scale_mm = 30;
        derive_leaves(image, leaf_options);
        derive_trees(image);
        derive_cells(image);
        if (with_textures) {
            allocate_trim_memory(image, 20000, {});
            derive_sdf(image);
        }
        auto scene = std::make_shared<Scene>();
        scene->pack.image = image;
        return scene;
    }
};

/// Two round discs of 20 mm, 4 mm apart, their outsides above and below: a shell without its wall, with rims as `flags`
/// (FaceRecord) says.
inline std::shared_ptr<const Scene> slab(uint flags)
{
    TracedScene scene;
    scene.add(kKindPlane, 1, {0, 0, 0.2}, {1, 1});
    scene.add(kKindPlane, 1, {0, 0, -0.2}, {1, 1});
    for (const size_t face : {0u, 1u}) {
        scene.trim(face, {shapes::circle(0.5, 0.5, 0.47, 0.47)});
        scene.image.faces[face].flags |= flags | (face == 1 ? kFaceReversed : 0);
    }
    return scene.finish();
}

struct Drawn {
    Frame frame;
    RenderStats stats;
};

/// A picture by the CPU tracer. A failure is the test's, and the frame then holds nothing.
inline Drawn draw(const std::shared_ptr<const Scene>& scene, const RenderOptions& options,
                  const std::string& instruction_set = "")
{
    Drawn drawn;
    const auto tracer = make_cpu_tracer(scene, instruction_set);
    if (!tracer.ok()) {
        ADD_FAILURE() << tracer.error().where << ": " << tracer.error().detail;
        return drawn;
    }
    Result<Frame> frame = (*tracer)->render(options, drawn.stats);
    if (frame.ok())
        drawn.frame = std::move(*frame);
    else
        ADD_FAILURE() << frame.error().where << ": " << frame.error().detail;
    return drawn;
}

/// From where all_kinds() is seen whole.
inline const Camera kOverview{{18, -26, 19}, {0, 0, 0}, {0, 0, 1}, 40};

inline RenderOptions overview(uint32_t width, uint32_t height)
{
    RenderOptions options;
    options.width = width;
    options.height = height;
    options.camera = kOverview;
    return options;
}

/// Every kind of surface once, some trimmed, one reversed, one in left-handed axes.
inline TracedScene all_kinds()
{
    constexpr double kPi = std::numbers::pi;
    TracedScene scene;
    scene.add(kKindPlane, 1, {0, 0, -0.5}, {0.9, 0.6});
    scene.add(kKindCylinder, 0.2, {-0.5, 0, 0}, {kPi, 2});
    PatchRecord& cone = scene.add(kKindCone, 0.2, {0, 0, 0}, {kPi, 1.5});
    cone.param[1] = -0.5f;
    PatchRecord& sphere = scene.add(kKindSphere, 0.2, {0.5, 0, 0}, {kPi, kPi / 2});
    sphere.axis_y[1] = -1; // left-handed
    PatchRecord& torus = scene.add(kKindTorus, 0.3, {0.2, -0.4, 0.3}, {kPi, kPi});
    torus.param[1] = 0.3f;
    scene.add_wave(3, {-0.3, 0.4, 0.5}, 0.4f);
    // a quarter of a cylinder: control points (wx, wy, wz, w)
    scene.add_bezier(2, 1, true, 0.4, {0.6, 0.5, 0.4});
    const float half = std::sqrt(0.5f);
    const float arc[3][3] = {{1, 0, 1}, {half, half, half}, {0, 1, 1}};
    for (const auto& [wx, wy, w] : arc)
        for (const float z : {-0.8f, 0.8f})
            scene.image.control_points.insert(scene.image.control_points.end(), {wx, wy, z * w, w});
    scene.image.faces.back().flags |= kFaceReversed;
    scene.trim(0, {shapes::polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}}), shapes::circle(0.7, 0.4, 0.12, 0.2),
                   shapes::star(0.25, 0.3, 0.15, 0.06, 5)});
    scene.trim(1, {shapes::polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}}), shapes::circle(0.3, 0.5, 0.2, 0.3)});
    scene.trim(4, {shapes::gear(0.5, 0.5, 0.49, 0.4, 12)});
    scene.trim(5, {shapes::circle(0.5, 0.5, 0.5, 0.5)});
    return scene;
}

} // namespace trimray
