// The CPU tracer against the surfaces themselves, evaluated in double, and against itself on every instruction set.
#include "format/derive_kd.h"
#include "format/record_surface.h"
#include "format/trim_query.h"
#include "runtime/tracer.h"
#include "tests/compare_frames.h"
#include "tests/traced_scenes.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <vector>

namespace trimray {
namespace {

using Point = std::array<double, 3>;

Drawn render(const std::shared_ptr<const Scene>& scene, const Camera& camera, uint32_t width = 160,
             uint32_t height = 120, TrimMode trim = TrimMode::Exact, const std::string& instruction_set = "")
{
    RenderOptions options;
    options.width = width;
    options.height = height;
    options.camera = camera;
    options.trim = trim;
    options.threads = 2;
    return draw(scene, options, instruction_set);
}

Camera looking(Point eye, Point target, double fov_deg)
{
    return {eye, target, {0, 0, 1}, fov_deg};
}

Point direction_of(const CameraRays& rays, double x, double y)
{
    Point d;
    double size = 0;
    for (size_t i = 0; i < 3; ++i) {
        d[i] = rays.corner[i] + x * rays.step_x[i] + y * rays.step_y[i];
        size += d[i] * d[i];
    }
    for (double& c : d)
        c /= std::sqrt(size);
    return d;
}

size_t hits_of(const Frame& frame)
{
    size_t hits = 0;
    for (const int32_t face : frame.face)
        hits += face >= 0;
    return hits;
}

/// S(uv) and its unit normal in world mm, of the hit of a pixel; the part stands where it is.
void surface_at(const PackImage& image, const Frame& frame, size_t pixel, Point& point, Point& normal)
{
    const FaceRecord& face = image.faces[size_t(frame.face[pixel])];
    const PatchRecord& patch = image.patches[face.first_patch];
    double uv[2];
    for (size_t i = 0; i < 2; ++i) {
        const double at = (frame.uv[2 * pixel + i] - face.domain_lo[i]) / (face.domain_hi[i] - face.domain_lo[i]);
        uv[i] = (at - patch.uv_offset[i]) / patch.uv_scale[i];
    }
    const auto part_mm = [&](double u, double v) {
        const Point q = point_of(patch, image.control_points.data(), u, v);
        Point p;
        for (size_t c = 0; c < 3; ++c)
            p[c] = image.parts[0].scale_mm *
                   (double(patch.origin_hi[c]) + patch.origin_lo[c] +
                    patch.scale * (patch.axis_x[c] * q[0] + patch.axis_y[c] * q[1] + patch.axis_z[c] * q[2]));
        return p;
    };
    point = part_mm(uv[0], uv[1]);
    constexpr double kStep = 1e-5;
    const Point u1 = part_mm(uv[0] + kStep, uv[1]), u0 = part_mm(uv[0] - kStep, uv[1]);
    const Point v1 = part_mm(uv[0], uv[1] + kStep), v0 = part_mm(uv[0], uv[1] - kStep);
    const Point du{u1[0] - u0[0], u1[1] - u0[1], u1[2] - u0[2]}, dv{v1[0] - v0[0], v1[1] - v0[1], v1[2] - v0[2]};
    normal = {du[1] * dv[2] - du[2] * dv[1], du[2] * dv[0] - du[0] * dv[2], du[0] * dv[1] - du[1] * dv[0]};
    const double size = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    for (double& c : normal)
        c *= ((face.flags & kFaceReversed) != 0 ? -1 : 1) / size;
}

TEST(cpu_tracer, gives_the_same_bits_on_every_instruction_set)
{
    const auto scene = all_kinds().finish();
    const Drawn first = render(scene, kOverview);
    EXPECT_GT(hits_of(first.frame), 4000u);
    int compared = 0;
    for (const char* set : {"avx512", "avx2", "sse4"}) {
        if (!make_cpu_tracer(scene, set).ok())
            continue;
        for (const TrimMode trim : {TrimMode::Exact, TrimMode::Sdf, TrimMode::Hybrid, TrimMode::Kd}) {
            const Drawn base = render(scene, kOverview, 157, 93, trim);
            const Drawn other = render(scene, kOverview, 157, 93, trim, set);
            EXPECT_TRUE(same_bits(base.frame.rgba, other.frame.rgba)) << set;
            EXPECT_TRUE(same_bits(base.frame.depth_mm, other.frame.depth_mm)) << set;
            EXPECT_TRUE(same_bits(base.frame.normal, other.frame.normal)) << set;
            EXPECT_TRUE(same_bits(base.frame.uv, other.frame.uv)) << set;
            EXPECT_TRUE(same_bits(base.frame.face, other.frame.face)) << set;
            EXPECT_TRUE(same_bits(base.frame.certified, other.frame.certified)) << set;
            EXPECT_EQ(base.stats.work.newton_steps, other.stats.work.newton_steps) << set;
            EXPECT_EQ(base.stats.work.leaf_visits, other.stats.work.leaf_visits) << set;
            ++compared;
        }
    }
    EXPECT_GE(compared, 2);
    EXPECT_FALSE(make_cpu_tracer(scene, "mmx").ok());
}

/// Curved patches of all degrees up to 3, polynomial and rational, side by side; nothing but their borders ends them.
TracedScene small_degrees()
{
    TracedScene scene;
    for (int k = 0; k < 18; ++k) {
        const int degree_u = k % 3 + 1, degree_v = k / 3 % 3 + 1;
        const bool rational = k >= 9;
        scene.add_bezier(degree_u, degree_v, rational, 0.14, {0.3 * (k % 6) - 0.75, 0.3 * (k / 6) - 0.3, 0});
        for (int i = 0; i <= degree_u; ++i) {
            for (int j = 0; j <= degree_v; ++j) {
                const float x = 2.0f * float(i) / float(degree_u) - 1, y = 2.0f * float(j) / float(degree_v) - 1;
                const float w = rational ? 0.6f + 0.3f * float((i + 2 * j) % 2) : 1;
                const float z = 0.35f * float((i * 2 + j) % 3) - 0.3f * x * y;
                scene.image.control_points.insert(scene.image.control_points.end(), {w * x, w * y, w * z});
                if (rational)
                    scene.image.control_points.push_back(w);
            }
        }
    }
    return scene;
}

TEST(cpu_tracer, patches_of_small_degree_give_the_same_bits_on_every_instruction_set)
{
    const auto scene = small_degrees().finish();
    const Camera camera = looking({5, -14, 16}, {0, 0, 0}, 52);
    const Drawn base = render(scene, camera, 301, 203);
    EXPECT_GT(hits_of(base.frame), 6000u);
    for (const char* set : {"avx512", "avx2", "sse4"}) {
        if (!make_cpu_tracer(scene, set).ok())
            continue;
        const Drawn other = render(scene, camera, 301, 203, TrimMode::Exact, set);
        EXPECT_TRUE(same_bits(base.frame.depth_mm, other.frame.depth_mm)) << set;
        EXPECT_TRUE(same_bits(base.frame.normal, other.frame.normal)) << set;
        EXPECT_TRUE(same_bits(base.frame.uv, other.frame.uv)) << set;
        EXPECT_TRUE(same_bits(base.frame.certified, other.frame.certified)) << set;
    }
}

TEST(cpu_tracer, a_ray_that_passes_a_patchs_border_is_not_in_doubt)
{
    // Newton is drawn outwards there, and trembles along the border where it is held
    const Camera camera = looking({5, -14, 16}, {0, 0, 0}, 52);
    const Frame frame = render(small_degrees().finish(), camera, 602, 406).frame;
    EXPECT_GT(hits_of(frame), 24000u);
    const CameraRays rays = camera_rays(camera, frame.width, frame.height);
    int misses = 0, hits = 0;
    for (uint32_t y = 0; y < frame.height; ++y) {
        for (uint32_t x = 0; x < frame.width; ++x) {
            const size_t pixel = size_t(y) * frame.width + x;
            const Point d = direction_of(rays, x + 0.5, y + 0.5);
            double facing = 0;
            for (size_t i = 0; i < 3; ++i)
                facing += d[i] * frame.normal[3 * pixel + i];
            misses += !frame.certified[pixel] && frame.face[pixel] < 0;
            hits += !frame.certified[pixel] && std::abs(facing) > 0.2; // else it grazes the surface
        }
    }
    EXPECT_LE(misses, 60) << "of " << frame.face.size();
    EXPECT_LE(hits, 40) << "of " << frame.face.size();
}

TEST(cpu_tracer, depth_uv_and_normal_belong_to_the_surface)
{
    const auto scene = all_kinds().finish();
    const PackImage& image = scene->pack.image;
    const Frame frame = render(scene, kOverview).frame;
    const CameraRays rays = camera_rays(kOverview, frame.width, frame.height);
    std::vector<int> seen(image.faces.size()), complained(image.faces.size());
    double worst_mm = 0, worst_off_ray = 0, worst_cosine = 1;
    for (uint32_t y = 0; y < frame.height; ++y) {
        for (uint32_t x = 0; x < frame.width; ++x) {
            const size_t pixel = size_t(y) * frame.width + x;
            if (frame.face[pixel] < 0)
                continue;
            ++seen[size_t(frame.face[pixel])];
            const Point d = direction_of(rays, x + 0.5, y + 0.5);
            Point surface, normal;
            surface_at(image, frame, pixel, surface, normal);
            // S(uv) from the ray, and along it
            Point off;
            double along = 0, cosine = 0, off2 = 0;
            for (size_t i = 0; i < 3; ++i) {
                off[i] = surface[i] - rays.eye[i];
                along += off[i] * d[i];
                cosine += normal[i] * frame.normal[3 * pixel + i];
            }
            for (size_t i = 0; i < 3; ++i)
                off2 += (off[i] - along * d[i]) * (off[i] - along * d[i]);
            double facing = 0;
            for (size_t i = 0; i < 3; ++i)
                facing += normal[i] * d[i];
            if (std::sqrt(off2) > 2e-5 && !complained[size_t(frame.face[pixel])]++)
                ADD_FAILURE() << "face " << frame.face[pixel] << " is " << std::sqrt(off2) << " mm off its ray";
            worst_off_ray = std::max(worst_off_ray, std::sqrt(off2));
            worst_cosine = std::min(worst_cosine, cosine);
            // rounding of uv moves S along the surface; on a grazing ray that is depth
            worst_mm = std::max(worst_mm, std::abs(along - frame.depth_mm[pixel]) * std::abs(facing));
        }
    }
    for (size_t face = 0; face < seen.size(); ++face)
        EXPECT_GT(seen[face], 50) << "face " << face;
    // the part is 20 mm, uv is stored to 2^-24 of a turn
    EXPECT_LT(worst_mm, 2e-5);
    EXPECT_LT(worst_off_ray, 2e-5);
    EXPECT_GT(worst_cosine, std::cos(0.1 * std::numbers::pi / 180));
}

TEST(cpu_tracer, a_pixel_is_a_whole_hit_or_a_whole_miss)
{
    const Frame frame = render(all_kinds().finish(), kOverview, 101, 67).frame;
    for (size_t i = 0; i < frame.face.size(); ++i) {
        const bool hit = frame.face[i] >= 0;
        EXPECT_EQ(hit, frame.instance[i] >= 0);
        EXPECT_EQ(hit, std::isfinite(frame.depth_mm[i]));
        EXPECT_EQ(frame.rgba[4 * i + 3], hit ? 1.0f : 0.0f);
        double size = 0;
        for (size_t c = 0; c < 3; ++c) {
            ASSERT_TRUE(std::isfinite(frame.rgba[4 * i + c]));
            size += double(frame.normal[3 * i + c]) * frame.normal[3 * i + c];
        }
        EXPECT_NEAR(size, hit ? 1 : 0, 1e-6);
        ASSERT_TRUE(std::isfinite(frame.uv[2 * i]) && std::isfinite(frame.uv[2 * i + 1]));
    }
}

TEST(cpu_tracer, what_it_keeps_lies_inside_the_trims)
{
    const auto scene = all_kinds().finish();
    const PackImage& image = scene->pack.image;
    const Frame frame = render(scene, kOverview, 320, 240).frame;
    int asked = 0, wrong = 0;
    for (size_t i = 0; i < frame.face.size(); ++i) {
        if (frame.face[i] < 0)
            continue;
        const FaceRecord& face = image.faces[size_t(frame.face[i])];
        float uv[2];
        for (size_t c = 0; c < 2; ++c)
            uv[c] = float((frame.uv[2 * i + c] - face.domain_lo[c]) / (face.domain_hi[c] - face.domain_lo[c]));
        ++asked;
        wrong += !trim_inside(image, uint(frame.face[i]), uv[0], uv[1]);
    }
    EXPECT_GT(asked, 10000);
    EXPECT_LE(wrong, 2); // uv made a trip through uv_file's rounding
}

TEST(cpu_tracer, the_texture_differs_from_the_cells_only_near_the_border)
{
    const auto scene = all_kinds().finish();
    const Frame exact = render(scene, kOverview, 320, 240).frame;
    const Drawn sdf = render(scene, kOverview, 320, 240, TrimMode::Sdf);
    EXPECT_EQ(sdf.stats.trim, TrimMode::Sdf);
    size_t differ = 0;
    for (size_t i = 0; i < exact.face.size(); ++i)
        differ += exact.face[i] != sdf.frame.face[i];
    EXPECT_GT(differ, 0u); // the texture is not the cells
    EXPECT_LT(double(differ), 0.01 * double(hits_of(exact)));
}

TEST(cpu_tracer, hybrid_trims_answer_as_exact_ones)
{
    const auto scene = all_kinds().finish();
    for (const Camera& camera : {kOverview, looking({2, -6, 8}, {2, -1, 0}, 30)}) {
        const Drawn exact = render(scene, camera, 320, 240);
        const Drawn hybrid = render(scene, camera, 320, 240, TrimMode::Hybrid);
        EXPECT_EQ(hybrid.stats.trim, TrimMode::Hybrid);
        EXPECT_TRUE(same_bits(exact.frame.face, hybrid.frame.face));
        EXPECT_TRUE(same_bits(exact.frame.depth_mm, hybrid.frame.depth_mm));
        // the texture decides most of what the cells leave open
        EXPECT_GT(hybrid.stats.work.curve_tests, 0u);
        EXPECT_LT(hybrid.stats.work.curve_tests, exact.stats.work.curve_tests);
    }
}

TEST(cpu_tracer, kd_trims_answer_as_exact_ones_with_fewer_tests)
{
    const auto scene = all_kinds().finish();
    for (const Camera& camera : {kOverview, looking({2, -6, 8}, {2, -1, 0}, 30)}) {
        const Drawn exact = render(scene, camera, 320, 240);
        const Drawn kd = render(scene, camera, 320, 240, TrimMode::Kd);
        EXPECT_EQ(kd.stats.trim, TrimMode::Kd);
        EXPECT_EQ(exact.stats.kd_bytes, 0u);
        EXPECT_EQ(double(kd.stats.kd_bytes), kd_trim_bytes(scene->pack.image));
        EXPECT_TRUE(same_bits(exact.frame.face, kd.frame.face));
        EXPECT_TRUE(same_bits(exact.frame.depth_mm, kd.frame.depth_mm));
        EXPECT_GT(kd.stats.work.curve_tests, 0u);
        EXPECT_LT(kd.stats.work.curve_tests, exact.stats.work.curve_tests);
    }
}

TEST(cpu_tracer, kd_trims_need_neither_cells_nor_textures)
{
    const auto whole = all_kinds().finish();
    Scene bare;
    bare.pack.image = whole->pack.image;
    for (FaceRecord& face : bare.pack.image.faces)
        face.grid = face.sdf_size = 0;
    bare.pack.image.cells.clear();
    bare.pack.image.cell_entries.clear();
    bare.pack.image.sdf_words.clear();
    const Drawn with = render(whole, kOverview, 160, 120, TrimMode::Kd);
    const Drawn without = render(std::make_shared<const Scene>(bare), kOverview, 160, 120, TrimMode::Kd);
    EXPECT_TRUE(same_bits(with.frame.face, without.frame.face));
}

TEST(cpu_tracer, refuses_kd_trims_of_faces_that_share_pieces)
{
    const auto whole = all_kinds().finish();
    Scene shared;
    shared.pack.image = whole->pack.image;
    std::vector<FaceRecord>& faces = shared.pack.image.faces;
    const auto trimmed =
        std::find_if(faces.begin(), faces.end(), [](const FaceRecord& f) { return f.piece_count > 0; });
    ASSERT_NE(trimmed, faces.end());
    for (FaceRecord& face : faces) {
        face.first_point = trimmed->first_point;
        face.point_count = trimmed->point_count;
        face.first_piece = trimmed->first_piece;
        face.piece_count = trimmed->piece_count;
    }
    shared.pack.image.trim_pieces.resize(trimmed->first_piece + trimmed->piece_count);
    const auto tracer = make_cpu_tracer(std::make_shared<const Scene>(shared));
    ASSERT_TRUE(tracer.ok());
    RenderOptions options;
    options.trim = TrimMode::Kd;
    RenderStats stats;
    const Result<Frame> frame = (*tracer)->render(options, stats);
    ASSERT_FALSE(frame.ok());
    EXPECT_EQ(frame.error().code, ErrorCode::InvalidPack);
}

TEST(cpu_tracer, refuses_trim_modes_that_the_pack_has_no_data_for)
{
    TracedScene scene = all_kinds();
    scene.with_textures = false;
    auto tracer = make_cpu_tracer(scene.finish());
    ASSERT_TRUE(tracer.ok());
    RenderOptions options;
    RenderStats stats;
    for (const TrimMode mode : {TrimMode::Sdf, TrimMode::Hybrid}) {
        options.trim = mode;
        const Result<Frame> frame = (*tracer)->render(options, stats);
        ASSERT_FALSE(frame.ok());
        EXPECT_EQ(frame.error().code, ErrorCode::UnsupportedPackFeature);
        EXPECT_NE(frame.error().detail.find("--trim exact"), std::string::npos);
    }
}

TEST(cpu_tracer, sees_the_same_from_a_million_sizes_away)
{
    const auto scene = all_kinds().finish();
    const auto from = [&](double sizes) {
        const Point along{0.5, -0.7, 0.51};
        const double distance = 20 * sizes;
        return render(scene, looking({along[0] * distance, along[1] * distance, along[2] * distance}, {0, 0, 0},
                                     2 * std::atan(14 / distance) * 180 / std::numbers::pi))
            .frame;
    };
    const Frame near = from(1e5), far = from(1e6);
    EXPECT_GT(hits_of(near), 4000u);
    size_t differ = 0;
    double worst_cosine = 1;
    for (size_t i = 0; i < near.face.size(); ++i) {
        if (near.face[i] != far.face[i]) {
            ++differ;
            continue;
        }
        if (near.face[i] < 0)
            continue;
        double cosine = 0;
        for (size_t c = 0; c < 3; ++c)
            cosine += double(near.normal[3 * i + c]) * far.normal[3 * i + c];
        worst_cosine = std::min(worst_cosine, cosine);
    }
    EXPECT_LE(differ, 8u); // borders within the perspective's own difference, 1e-5 of the size
    EXPECT_GT(worst_cosine, 0.999);
}

TEST(cpu_tracer, from_inside_a_closed_surface_there_is_no_way_out)
{
    constexpr double kPi = std::numbers::pi;
    TracedScene ball;
    ball.add(kKindSphere, 0.9, {0, 0, 0}, {kPi, kPi / 2});
    TracedScene ring;
    ring.add(kKindTorus, 0.6, {0, 0, 0}, {kPi, kPi}).param[1] = 0.4f;
    for (const Point target : {Point{1, 0.3, 0.2}, Point{-1, 0.1, 0}, Point{0, 0.01, 1}, Point{0, 1, -1}}) {
        const Frame in_ball = render(ball.finish(), looking({0.5, 0.4, 0.3}, target, 110)).frame;
        EXPECT_EQ(hits_of(in_ball), in_ball.face.size());
        Point beside{6.0 + target[0], target[1], target[2]};
        const Frame in_ring = render(ring.finish(), looking({6, 0.1, 0.2}, beside, 110)).frame;
        EXPECT_EQ(hits_of(in_ring), in_ring.face.size());
    }
}

/// 12 x 12 bilinear patches that share their corners, in an area of +-10 mm.
TracedScene patch_grid(double height, uint32_t seed)
{
    constexpr int kCount = 12;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> any(-height, height);
    double z[kCount + 1][kCount + 1];
    for (auto& row : z)
        for (double& value : row)
            value = any(random);
    TracedScene scene;
    scene.with_textures = false;
    for (int i = 0; i < kCount; ++i) {
        for (int j = 0; j < kCount; ++j) {
            const double step = 2.0 / kCount, x = -1 + step * i, y = -1 + step * j;
            scene.add_bezier(1, 1, false, step, {x + step / 2, y + step / 2, 0});
            for (int a = 0; a < 2; ++a)
                for (int b = 0; b < 2; ++b)
                    scene.image.control_points.insert(scene.image.control_points.end(),
                                                      {float(a - 0.5), float(b - 0.5), float(z[i + a][j + b] / step)});
        }
    }
    return scene;
}

TEST(cpu_tracer, patches_that_share_their_borders_leave_no_hole)
{
    // turned, so that borders run along no axis
    const double c = std::cos(0.37), s = std::sin(0.37);
    for (const double height : {0.0, 0.02}) {
        TracedScene model = patch_grid(height, 7);
        model.place({c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0});
        const auto scene = model.finish();
        // from above, and nearly edge-on
        for (const Point eye : {Point{1, 2, 12}, Point{-9.4, 0.7, 1.2}, Point{-3, 6, 0.6}}) {
            const Camera camera = looking(eye, {0.3, 0.1, 0}, 30);
            const Frame frame = render(scene, camera, 400, 300).frame;
            const CameraRays rays = camera_rays(camera, frame.width, frame.height);
            size_t asked = 0, holes = 0;
            for (uint32_t y = 0; y < frame.height; ++y) {
                for (uint32_t x = 0; x < frame.width; ++x) {
                    const Point d = direction_of(rays, x + 0.5, y + 0.5);
                    const double t = -eye[2] / d[2];
                    const double px = eye[0] + t * d[0], py = eye[1] + t * d[1];
                    // well inside of the square, whatever the heights do to where the ray meets it
                    const double side = std::max(std::abs(c * px + s * py), std::abs(c * py - s * px));
                    if (t <= 0 || side > (height > 0 ? 6 : 9.99))
                        continue;
                    ++asked;
                    holes += frame.face[size_t(y) * frame.width + x] < 0;
                }
            }
            EXPECT_GT(asked, 1000u);
            EXPECT_EQ(holes, 0u) << "height " << height << " eye " << eye[2];
        }
    }
}

TEST(cpu_tracer, few_rays_ask_a_leaf_that_lies_askew)
{
    TracedScene model;
    model.add(kKindPlane, 1, {0, 0, 0}, {1, 0.005});
    const double h = std::sqrt(0.5);
    model.place({h, -h, 0, 0, h, h, 0, 0, 0, 0, 1, 0});
    const Drawn drawn = render(model.finish(), looking({0, 0.01, 40}, {0, 0, 0}, 30), 400, 400);
    const size_t hits = hits_of(drawn.frame);
    EXPECT_GT(hits, 400u);
    // packets of 4 x 4 along its 4 or so pixels of width; in the square around it there are 100 times as many
    EXPECT_LT(drawn.stats.work.leaf_visits, 10 * hits);
}

/// A flat square, turned by `angle` radians, whose only leaf has the square itself as its box, of no thickness.
struct LeafSquare {
    static constexpr double kHalf = 1.0 / 256, kPart_mm = 10; // half a side, in part units
    std::shared_ptr<const Scene> scene;
    PatchRecord patch;

    explicit LeafSquare(double angle)
    {
        TracedScene model;
        model.with_textures = false;
        PatchRecord& own = model.add_bezier(1, 1, false, kHalf, {-0.61, 0.27, 0.05});
        own.axis_x[0] = own.axis_y[1] = float(std::cos(angle));
        own.axis_x[1] = float(std::sin(angle));
        own.axis_y[0] = -own.axis_x[1];
        patch = own;
        model.image.control_points = {-1, -1, 0, -1, 1, 0, 1, -1, 0, 1, 1, 0};
        Scene tight;
        tight.pack.image = model.finish()->pack.image;
        EXPECT_EQ(tight.pack.image.leaves.size(), 1u);
        constexpr uint kOne = 16384; // kLeafQuantum
        LeafRecord& leaf = tight.pack.image.leaves.front();
        leaf.center_xy = 0;
        leaf.center_z_half_x = kOne << 16;
        leaf.half_yz = kOne;
        leaf.quat_xy = 0;
        leaf.quat_z_bend &= 0xffff0000u;
        scene = std::make_shared<const Scene>(tight);
    }

    /// World mm of (x, y) in patch units, where the square is [-1, 1]^2.
    Point at(double x, double y) const
    {
        Point p;
        for (size_t i = 0; i < 3; ++i)
            p[i] = kPart_mm * (double(patch.origin_hi[i]) + patch.origin_lo[i] +
                               kHalf * (x * patch.axis_x[i] + y * patch.axis_y[i]));
        return p;
    }

    /// How far inside the square a ray from `eye` passes, mm; negative outside.
    double inside_mm(Point eye, Point direction) const
    {
        const Point middle = at(0, 0);
        const double t = (middle[2] - eye[2]) / direction[2];
        double x = 0, y = 0;
        for (size_t i = 0; i < 3; ++i) {
            const double off = eye[i] + t * direction[i] - middle[i];
            x += off * patch.axis_x[i];
            y += off * patch.axis_y[i];
        }
        return kPart_mm * kHalf - std::max(std::abs(x), std::abs(y));
    }
};

TEST(cpu_tracer, no_leaf_is_lost_where_a_pixel_is_a_millionth_of_the_part)
{
    constexpr double kPixel_mm = 1e-5, kRounding_px = 0.2; // a ray nearer to a border may be on either side of it
    constexpr uint32_t kWidth = 120, kHeight = 90;
    for (const double angle : {0.0, 0.37, 1.2}) {
        const LeafSquare square(angle);
        size_t asked = 0, near = 0, lost = 0;
        for (const Point spot : {Point{1, 1}, Point{1, -1}, Point{-1, 1}, Point{-1, -1}, Point{1, 0.3}, Point{-1, 0.3},
                                 Point{0.3, 1}, Point{0.3, -1}}) {
            for (const double above : {12.0, 0.1, 0.01}) {
                const Point target = square.at(spot[0], spot[1]);
                const Point eye{target[0] + 0.1 * above, target[1] + 0.2 * above, target[2] + above};
                const Camera camera = looking(eye, target, 180 / std::numbers::pi * kHeight * kPixel_mm / above);
                const Frame frame = render(square.scene, camera, kWidth, kHeight).frame;
                const CameraRays rays = camera_rays(camera, kWidth, kHeight);
                for (uint32_t y = 0; y < kHeight; ++y) {
                    for (uint32_t x = 0; x < kWidth; ++x) {
                        const double inside_px =
                            square.inside_mm(rays.eye, direction_of(rays, x + 0.5, y + 0.5)) / kPixel_mm;
                        if (inside_px < kRounding_px)
                            continue;
                        ++asked;
                        near += inside_px < 1;
                        lost += frame.face[size_t(y) * kWidth + x] < 0;
                    }
                }
            }
        }
        EXPECT_GT(asked, 90000u);
        EXPECT_GT(near, 1000u);
        EXPECT_EQ(lost, 0u) << "of " << asked << ", turned by " << angle;
    }
}

TEST(cpu_tracer, one_ray_meets_what_its_pixel_shows)
{
    const auto scene = all_kinds().finish();
    const Frame frame = render(scene, kOverview).frame;
    const CameraRays rays = camera_rays(kOverview, frame.width, frame.height);
    std::mt19937 random(3);
    int hits = 0;
    for (int k = 0; k < 400; ++k) {
        const uint32_t x = random() % frame.width, y = random() % frame.height;
        const size_t pixel = size_t(y) * frame.width + x;
        const RayHit hit = trace_ray(*scene, rays.eye, direction_of(rays, x + 0.5, y + 0.5));
        EXPECT_EQ(hit.hit, frame.face[pixel] >= 0);
        EXPECT_EQ(hit.face, frame.face[pixel]);
        if (!hit.hit)
            continue;
        ++hits;
        EXPECT_NEAR(hit.distance_mm, frame.depth_mm[pixel], 1e-4);
    }
    EXPECT_GT(hits, 50);
    EXPECT_FALSE(trace_ray(*scene, {0, 0, 0}, {0, 0, 0}).hit);
}

} // namespace
} // namespace trimray
