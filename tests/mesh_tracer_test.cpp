// The mesh tracer: pictures of triangles against closed forms, and of a meshed model beside those of its surfaces.
#include "preprocess/collect_mesh.h"
#include "runtime/measure/mesh_tracer.h"
#include "tests/traced_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <numbers>

namespace trimray {
namespace {

using Point = std::array<double, 3>;

/// One part about `origin_mm`, placed where it is.
TriangleMesh one_part(const Point& origin_mm, size_t faces)
{
    TriangleMesh mesh;
    mesh.parts = {{{origin_mm[0], origin_mm[1], origin_mm[2]}, 0, 0}};
    mesh.instances = {{{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, 0, 0xff3060c0u}};
    for (size_t f = 0; f < faces; ++f)
        mesh.faces.push_back({0, 0});
    return mesh;
}

/// The cube [-1, 1]^3 from `origin_mm`; face 2 a + 1 looks along axis a, face 2 a against it.
TriangleMesh cube(const Point& origin_mm = {0, 0, 0})
{
    TriangleMesh mesh = one_part(origin_mm, 6);
    for (uint32_t face = 0; face < 6; ++face) {
        const size_t axis = face / 2, b = (axis + 1) % 3, c = (axis + 2) % 3;
        const float side = face % 2 != 0 ? 1.0f : -1.0f;
        const uint32_t first = 4 * face;
        for (const auto& [x, y] : {std::pair{-1.0f, -1.0f}, {1.0f, -1.0f}, {1.0f, 1.0f}, {-1.0f, 1.0f}}) {
            float p[3], n[3] = {0, 0, 0};
            p[axis] = n[axis] = side;
            p[b] = x;
            p[c] = y;
            mesh.positions.insert(mesh.positions.end(), p, p + 3);
            mesh.normals.insert(mesh.normals.end(), n, n + 3);
        }
        for (const uint32_t corner : {0u, 1u, 2u, 0u, 2u, 3u})
            mesh.triangles.push_back(first + corner);
        mesh.triangle_face.insert(mesh.triangle_face.end(), 2, face);
    }
    mesh.parts[0].triangle_count = 12;
    return mesh;
}

/// The unit sphere: `rows` bands of latitude with twice as many columns, face 0 its southern half, 1 its northern.
TriangleMesh sphere(uint32_t rows)
{
    TriangleMesh mesh = one_part({0, 0, 0}, 2);
    const uint32_t columns = 2 * rows;
    for (uint32_t i = 0; i <= rows; ++i)
        for (uint32_t j = 0; j <= columns; ++j) {
            const double latitude = std::numbers::pi * (double(i) / rows - 0.5);
            const double longitude = 2 * std::numbers::pi * j / columns;
            for (const double x : {std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude),
                                   std::sin(latitude)}) {
                mesh.positions.push_back(float(x));
                mesh.normals.push_back(float(x));
            }
        }
    for (uint32_t i = 0; i < rows; ++i)
        for (uint32_t j = 0; j < columns; ++j) {
            const uint32_t a = i * (columns + 1) + j, b = a + columns + 1;
            for (const uint32_t corner : {a, a + 1, b + 1, a, b + 1, b})
                mesh.triangles.push_back(corner);
            mesh.triangle_face.insert(mesh.triangle_face.end(), 2, 2 * i < rows ? 0u : 1u);
        }
    mesh.parts[0].triangle_count = uint32_t(mesh.triangle_face.size());
    return mesh;
}

RenderOptions looking(const Point& eye, const Point& target, double fov_deg)
{
    RenderOptions options;
    options.width = 157; // no whole number of blocks
    options.height = 93;
    options.camera = {eye, target, {0, 0, 1}, fov_deg};
    options.threads = 2;
    return options;
}

Frame traced(TriangleMesh mesh, const RenderOptions& options)
{
    const Result<TriangleMesh> checked = decode_mesh(encode_mesh(mesh));
    if (!checked.ok()) {
        ADD_FAILURE() << checked.error().detail;
        return {};
    }
    const auto tracer = make_mesh_tracer(*checked);
    if (!tracer.ok()) {
        ADD_FAILURE() << tracer.error().detail;
        return {};
    }
    return picture(**tracer, options);
}

/// Unit direction of the ray through a pixel's middle, and where the ray begins to count its depth.
struct PixelRay {
    Point from, along;
};
PixelRay ray_of(const RenderOptions& options, size_t pixel)
{
    const double x = double(pixel % options.width) + 0.5, y = double(pixel / options.width) + 0.5;
    PixelRay ray{};
    if (options.camera.orthographic_mm > 0) {
        const ParallelRays rays = parallel_rays(options.camera, options.width, options.height);
        for (size_t c = 0; c < 3; ++c)
            ray.from[c] = rays.corner[c] + x * rays.step_x[c] + y * rays.step_y[c];
        ray.along = rays.direction;
        return ray;
    }
    const CameraRays rays = camera_rays(options.camera, options.width, options.height);
    double size = 0;
    for (size_t c = 0; c < 3; ++c) {
        ray.from[c] = rays.eye[c];
        ray.along[c] = rays.corner[c] + x * rays.step_x[c] + y * rays.step_y[c];
        size += ray.along[c] * ray.along[c];
    }
    for (double& a : ray.along)
        a /= std::sqrt(size);
    return ray;
}

/// Where a ray enters the cube [-1, 1]^3 about `middle`: depth and face, or face -1. `hair`: how near another answer
/// is.
struct CubeHit {
    double depth = 0, hair = 0;
    int face = -1;
};
CubeHit enter_cube(const PixelRay& ray, const Point& middle)
{
    double nearest = -1e30, second = -1e30, leave = 1e30;
    int face = -1;
    for (size_t c = 0; c < 3; ++c) {
        const double at = ray.from[c] - middle[c], step = ray.along[c];
        double t0 = (-1 - at) / step, t1 = (1 - at) / step;
        if (t0 > t1)
            std::swap(t0, t1);
        if (t0 > nearest) {
            second = nearest;
            nearest = t0;
            face = int(2 * c) + (step < 0);
        } else {
            second = std::max(second, t0);
        }
        leave = std::min(leave, t1);
    }
    return {nearest, std::min(std::abs(leave - nearest), nearest - second), nearest < leave ? face : -1};
}

void expect_cube(const Frame& frame, const RenderOptions& options, const Point& middle, double rounding_mm)
{
    int hits = 0;
    for (size_t i = 0; i < frame.face.size(); ++i) {
        const CubeHit expected = enter_cube(ray_of(options, i), middle);
        if (expected.hair < 1e-4)
            continue; // through an edge
        ASSERT_EQ(frame.face[i], expected.face) << i;
        EXPECT_EQ(frame.certified[i], 1);
        if (expected.face < 0) {
            EXPECT_EQ(frame.instance[i], -1);
            EXPECT_TRUE(std::isinf(frame.depth_mm[i]));
            EXPECT_EQ(frame.rgba[4 * i + 3], 0);
            continue;
        }
        ++hits;
        EXPECT_EQ(frame.instance[i], 0);
        EXPECT_NEAR(frame.depth_mm[i], expected.depth, rounding_mm);
        EXPECT_EQ(frame.rgba[4 * i + 3], 1);
        for (size_t c = 0; c < 3; ++c)
            EXPECT_NEAR(frame.normal[3 * i + c],
                        size_t(expected.face / 2) == c ? (expected.face % 2 != 0 ? 1.0 : -1.0) : 0.0, 1e-6);
    }
    EXPECT_GT(hits, 2000);
}

TEST(mesh_tracer, sees_a_cube_as_it_is)
{
    for (const Point& eye : {Point{4, -5, 3}, Point{-5, 0.3, 0.2}, Point{0.1, 0.2, 6}}) {
        const RenderOptions options = looking(eye, {0, 0, 0}, 30);
        expect_cube(traced(cube(), options), options, {0, 0, 0}, 1e-5);
    }
    RenderOptions parallel = looking({4, -5, 3}, {0, 0, 0}, 30);
    parallel.camera.orthographic_mm = 4;
    expect_cube(traced(cube(), parallel), parallel, {0, 0, 0}, 1e-5);
}

TEST(mesh_tracer, looks_straight_at_a_side_that_is_the_models_nearest)
{
    RenderOptions options = looking({0, 0, 5}, {0, 0, 0}, 15);
    options.camera.up = {0, 1, 0};
    const Frame frame = traced(cube(), options);
    for (const int32_t face : frame.face)
        ASSERT_EQ(face, 5);
}

TEST(mesh_tracer, keeps_its_precision_far_from_the_worlds_origin)
{
    const Point middle{1e5, -2e5, 3e5};
    RenderOptions options = looking({middle[0] + 4, middle[1] - 5, middle[2] + 3}, middle, 30);
    expect_cube(traced(cube(middle), options), options, middle, 1e-5);
}

TEST(mesh_tracer, sees_a_spheres_inside_too)
{
    const RenderOptions options = looking({0, 0, 0}, {1, 0.2, 0.1}, 60);
    const Frame frame = traced(sphere(64), options);
    for (size_t i = 0; i < frame.face.size(); ++i) {
        ASSERT_GE(frame.face[i], 0);
        EXPECT_NEAR(frame.depth_mm[i], 1, 1e-3);
        const PixelRay ray = ray_of(options, i);
        for (size_t c = 0; c < 3; ++c)
            EXPECT_NEAR(frame.normal[3 * i + c], ray.along[c], 2e-3); // outward, away from the eye
    }
}

/// Largest errors of depth and normal, by the closed form, of rays that meet the sphere no flatter than 30 degrees.
std::array<double, 2> sphere_errors(uint32_t rows)
{
    const RenderOptions options = looking({3, -4, 2}, {0, 0, 0}, 24);
    const Frame frame = traced(sphere(rows), options);
    std::array<double, 2> largest{};
    int hits = 0;
    for (size_t i = 0; i < frame.face.size(); ++i) {
        const PixelRay ray = ray_of(options, i);
        double b = 0, c = -1;
        for (size_t k = 0; k < 3; ++k) {
            b += ray.from[k] * ray.along[k];
            c += ray.from[k] * ray.from[k];
        }
        if (b * b - c < 0.25) // the square of the cosine to the normal
            continue;
        ++hits;
        const double depth = -b - std::sqrt(b * b - c);
        EXPECT_GE(frame.face[i], 0);
        const double height = ray.from[2] + depth * ray.along[2];
        if (std::abs(height) > 0.05) {
            EXPECT_EQ(frame.face[i], height < 0 ? 0 : 1);
        }
        largest[0] = std::max(largest[0], std::abs(frame.depth_mm[i] - depth));
        double off2 = 0;
        for (size_t k = 0; k < 3; ++k)
            off2 += std::pow(frame.normal[3 * i + k] - (ray.from[k] + depth * ray.along[k]), 2);
        largest[1] = std::max(largest[1], std::sqrt(off2));
    }
    EXPECT_GT(hits, 3000);
    return largest;
}

TEST(mesh_tracer, a_spheres_errors_fall_with_the_square_of_the_edge_length)
{
    const auto coarse = sphere_errors(24), fine = sphere_errors(96);
    std::cout << fmt::format("depth {:.3g} mm and {:.3g} mm, normal {:.3g} and {:.3g}\n", coarse[0], fine[0], coarse[1],
                             fine[1]);
    EXPECT_GT(coarse[0] / fine[0], 13);
    EXPECT_LT(coarse[0] / fine[0], 19);
    EXPECT_LT(fine[0], 1e-3);
    EXPECT_GT(coarse[1] / fine[1], 13); // of the normal too: it is interpolated
}

TEST(mesh_tracer, placements_have_their_numbers_colours_and_normals)
{
    TriangleMesh mesh = cube();
    mesh.faces[1] = {0xff0000ffu, 1}; // +x is red, others as placed
    const double turn = std::numbers::pi / 6, c = std::cos(turn), s = std::sin(turn);
    mesh.instances = {{{1, 0, 0, -4, 0, 1, 0, 0, 0, 0, 1, 0}, 0, 0xff00ff00u},
                      {{2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, 0, 0xffff0000u},
                      {{-c, -s, 0, 5, -s, c, 0, 0, 0, 0, 1, 0}, 0, 0}}; // mirrored and turned
    const RenderOptions options = looking({6, -18, 5}, {0.5, 0, 0}, 30);
    const Frame frame = traced(mesh, options);
    std::array<int, 3> seen{};
    for (size_t i = 0; i < frame.face.size(); ++i) {
        const int32_t instance = frame.instance[i], face = frame.face[i];
        if (face < 0)
            continue;
        ++seen[size_t(instance)];
        const double sign = face % 2 != 0 ? 1 : -1;
        Point normal{};
        for (size_t row = 0; row < 3; ++row) // unit columns but one along an axis
            normal[row] = sign * mesh.instances[size_t(instance)].transform[4 * row + size_t(face / 2)];
        const double size = std::hypot(normal[0], normal[1], normal[2]);
        for (size_t k = 0; k < 3; ++k)
            EXPECT_NEAR(frame.normal[3 * i + k], normal[k] / size, 1e-6);
        const float* rgba = &frame.rgba[4 * i];
        if (face == 1)
            EXPECT_GT(rgba[0], 3 * rgba[1]);
        else if (instance == 0)
            EXPECT_GT(rgba[1], 3 * rgba[0]);
        else if (instance == 1)
            EXPECT_GT(rgba[2], 3 * rgba[0]);
        else
            EXPECT_NEAR(rgba[0] / rgba[1], 1, 0.1); // the default grey
    }
    for (const int count : seen)
        EXPECT_GT(count, 200);
}

TEST(mesh_tracer, gives_the_same_bits_on_any_number_of_threads)
{
    RenderOptions options = looking({3, -4, 2}, {0, 0, 0}, 30);
    options.width = 400;
    options.height = 300;
    const auto tracer = make_mesh_tracer(sphere(128));
    ASSERT_TRUE(tracer.ok());
    options.threads = 1;
    RenderStats stats;
    options.frames = 3;
    const Result<Frame> one = (*tracer)->render(options, stats);
    ASSERT_TRUE(one.ok());
    EXPECT_EQ(stats.frame_ms.size(), 3u);
    EXPECT_EQ(stats.frame_cpu_ms.size(), 3u);
    EXPECT_EQ(stats.work.rays, 400u * 300u);
    EXPECT_EQ(stats.work.uncertified_pixels, 0u);
    // 129 x 257 vertices of 24 bytes and 128 x 512 triangles of 16, and Embree's own
    EXPECT_GT(stats.buffer_bytes, 2u * (129 * 257 * 24 + 128 * 512 * 16));
    EXPECT_LT(stats.buffer_bytes, 20u * (129 * 257 * 24 + 128 * 512 * 16));
    options.frames = 1;
    for (const uint32_t threads : {2u, 5u, 0u}) {
        options.threads = threads;
        const auto again = make_mesh_tracer(sphere(128)); // the trees are built anew
        ASSERT_TRUE(again.ok());
        const Frame other = picture(**again, options);
        EXPECT_TRUE(same_bits(one->rgba, other.rgba));
        EXPECT_TRUE(same_bits(one->depth_mm, other.depth_mm));
        EXPECT_TRUE(same_bits(one->normal, other.normal));
        EXPECT_TRUE(same_bits(one->uv, other.uv));
        EXPECT_TRUE(same_bits(one->face, other.face));
        EXPECT_TRUE(same_bits(one->instance, other.instance));
        EXPECT_TRUE(same_bits(one->certified, other.certified));
    }
}

TEST(mesh_tracer, refuses_what_it_does_not_do)
{
    EXPECT_EQ(make_mesh_tracer({}).error().code, ErrorCode::InvalidMesh);
    const auto tracer = make_mesh_tracer(cube());
    ASSERT_TRUE(tracer.ok());
    const RenderOptions plain = looking({4, -5, 3}, {0, 0, 0}, 30);
    const auto refused = [&](const std::function<void(RenderOptions&)>& change) {
        RenderOptions options = plain;
        change(options);
        RenderStats stats;
        return !(*tracer)->render(options, stats).ok();
    };
    EXPECT_FALSE(refused([](RenderOptions&) {}));
    EXPECT_TRUE(refused([](RenderOptions& o) { o.width = 0; }));
    EXPECT_TRUE(refused([](RenderOptions& o) { o.silhouettes = true; }));
    EXPECT_TRUE(refused([](RenderOptions& o) { o.trim = TrimMode::Sdf; }));
    EXPECT_TRUE(refused([](RenderOptions& o) { o.closest = ClosestPolicy::Stochastic; }));
    EXPECT_TRUE(refused([](RenderOptions& o) { o.look.lights = {{.shadows = true}}; }));
    EXPECT_TRUE(refused([](RenderOptions& o) { o.look.section.planes = {{.normal = {0, 0, 1}}}; }));
}

/// The model's surfaces and its mesh seen alike.
struct TwoPictures {
    Frame surfaces, mesh;
};
TwoPictures pictures_of(const std::string& model_name, double deflection)
{
    ImportOptions import;
    import.mesh_deflection = deflection;
    const Result<CadModel> model = import_cad(TRIMRAY_TESTS_DIR "/models/" + model_name, import, {});
    if (!model.ok()) {
        ADD_FAILURE() << model.error().detail;
        return {};
    }
    BuildReport report;
    const auto scene = scene_of_model(*model);
    Result<TriangleMesh> mesh = collect_mesh(*model, convert_faces(*model, {}, report));
    const auto tracer = scene ? tracer_of(scene, false) : nullptr;
    if (!tracer || !mesh.ok()) {
        ADD_FAILURE() << model_name;
        return {};
    }
    const RenderOptions options = from_iso(scene->pack.image, 320, 200);
    return {picture(*tracer, options), traced(std::move(*mesh), options)};
}

TEST(mesh_tracer, a_models_mesh_shows_the_packs_faces_instances_and_colours)
{
    for (const char* model : {"red_cube_blue_cylinder.step", "io1-cm-214.stp", "NIST_MBE_PMI_3.stp"}) {
        const TwoPictures two = pictures_of(model, 1e-4);
        size_t hits = 0, other = 0;
        double largest_rgb = 0, rgb = 0;
        for (size_t i = 0; i < two.mesh.face.size(); ++i) {
            hits += two.surfaces.face[i] >= 0;
            if (two.surfaces.face[i] != two.mesh.face[i] || two.surfaces.instance[i] != two.mesh.instance[i]) {
                ++other;
                continue;
            }
            for (size_t c = 0; c < 3; ++c) {
                const double off = std::abs(double(two.surfaces.rgba[4 * i + c]) - double(two.mesh.rgba[4 * i + c]));
                largest_rgb = std::max(largest_rgb, off);
                rgb += off;
            }
        }
        std::cout << fmt::format(
            "{}: {} pixels hit, {} with another face; colours off by {:.2g} at most, {:.2g} in the "
            "mean\n",
            model, hits, other, largest_rgb, rgb / double(3 * hits));
        EXPECT_GT(hits, two.mesh.face.size() / 10);
        EXPECT_LT(other, hits / 200) << model; // beside borders of faces, which are chords on the mesh
        EXPECT_LT(rgb, 1e-3 * 3 * double(hits)) << model;
    }
}

} // namespace
} // namespace trimray
