// Random rational Bezier patches and small pictures of them that look at what tracers get wrong: tangents, borders,
// folds, cusps. Each is made from a seed and its number alone. What fails is made smaller while it still fails, by
// RapidCheck, and printed as what a test can be made of.
#pragma once

#include "tests/bezier_surface.h"
#include "tests/hard/closest_hits.h"
#include "tests/hard/nets.h"

#include <fmt/format.h>
#include <rapidcheck.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <span>

namespace trimray::hard {

enum class Shape {
    Hills,
    Folded,     // sheared until it turns over
    Cusped,     // some control points change places with a neighbour, or lie on it
    Needle,     // 1e-4 to 1 as wide as long
    Flat,       // hills of 1e-7 to 1e-3
    Degenerate, // a side that is one point
    Coincident, // two faces that are the same
};
inline constexpr const char* kShapeNames[] = {"Hills", "Folded",     "Cusped",    "Needle",
                                              "Flat",  "Degenerate", "Coincident"};
inline constexpr size_t kShapeCount = 7;

enum class Weighting {
    None, // polynomial
    Mild, // within a factor of 4
    Wide, // 1e-3 to 1e3
};
inline constexpr const char* kWeightingNames[] = {"None", "Mild", "Wide"};
inline constexpr size_t kWeightingCount = 3;

enum class Aim {
    Inside,
    Border,  // 1e-6 to 1e-3 of the parameters from a side, on either side of it
    Grazing, // 1e-6 to 0.1 radians from the tangent plane
};
inline constexpr const char* kAimNames[] = {"Inside", "Border", "Grazing"};
inline constexpr size_t kAimCount = 3;

inline constexpr uint32_t kPixels = 8; // a side of a picture

/// A square picture whose middle is at a point of the surface.
struct Sight {
    Aim aim = Aim::Inside;
    double u = 0.5, v = 0.5;
    double azimuth = 0, elevation = 1; // radians, of the eye: from S_u in the tangent plane, and from that plane
    double distance_mm = 50;
    double pixel_mm = 0.1;                   // at the point
    std::array<double, 2> moved_px = {0, 0}; // of the middle from the point
    uint32_t pixels = kPixels;               // a side

    bool operator==(const Sight&) const = default;
};

struct RandomPatch {
    Shape shape = Shape::Hills;
    Weighting weighting = Weighting::None;
    int degree_u = 1, degree_v = 1;
    std::vector<NetPoint> net; // v runs fastest; in units of 10 mm
    Sight sight;

    NetPoint& at(int i, int j) { return net[size_t(i * (degree_v + 1) + j)]; }
    const NetPoint& at(int i, int j) const { return net[size_t(i * (degree_v + 1) + j)]; }
    bool operator==(const RandomPatch&) const = default;
};

/// Of patch `number` of any run.
inline Shape shape_of(uint32_t number)
{
    return Shape(number % kShapeCount);
}
inline Weighting weighting_of(uint32_t number)
{
    return Weighting(number / kShapeCount % kWeightingCount);
}

/// Patch `number` of the run with this seed, with a sight for each aim.
inline std::array<RandomPatch, kAimCount> draw_patch(uint32_t seed, uint32_t number, uint32_t pixels = kPixels)
{
    std::seed_seq seeds{seed, number};
    std::mt19937_64 random(seeds);
    const auto uniform = [&random](double lo, double hi) {
        return std::uniform_real_distribution<double>(lo, hi)(random);
    };
    const auto power = [&uniform](double lo, double hi) { return std::pow(10, uniform(lo, hi)); };
    const auto integer = [&random](int lo, int hi) { return std::uniform_int_distribution<int>(lo, hi)(random); };
    constexpr int kMostDegree = 15;

    RandomPatch patch;
    patch.shape = shape_of(number);
    patch.weighting = weighting_of(number);
    patch.degree_u = integer(1, kMostDegree);
    patch.degree_v = integer(1, kMostDegree);
    const int p = patch.degree_u, q = patch.degree_v;
    const double height = patch.shape == Shape::Flat ? power(-7, -3) : power(-2, -0.2);
    for (int i = 0; i <= p; ++i)
        for (int j = 0; j <= q; ++j) {
            const double w = patch.weighting == Weighting::None   ? 1
                             : patch.weighting == Weighting::Mild ? power(-0.3, 0.3)
                                                                  : power(-3, 3);
            patch.net.push_back({1.2 * (i + uniform(-0.3, 0.3)) / p - 0.6, 1.2 * (j + uniform(-0.3, 0.3)) / q - 0.6,
                                 height * uniform(-1, 1), w});
        }
    switch (patch.shape) {
    case Shape::Folded: {
        const double shear = uniform(0.5, 2) / height;
        for (NetPoint& point : patch.net)
            point[0] += shear * 0.5 * point[2];
        break;
    }
    case Shape::Cusped:
        for (int k = 0; k < std::max(1, p * q / 4); ++k) {
            const int i = integer(0, p - 1), j = integer(0, q - 1);
            NetPoint &one = patch.at(i, j), &beside = integer(0, 1) == 0 ? patch.at(i + 1, j) : patch.at(i, j + 1);
            if (integer(0, 1) == 0)
                std::swap(one, beside);
            else
                one = beside;
        }
        break;
    case Shape::Needle: {
        const double narrow = power(-4, 0);
        for (NetPoint& point : patch.net)
            point[0] *= narrow;
        break;
    }
    case Shape::Degenerate: {
        const bool along_u = integer(0, 1) == 0, last = integer(0, 1) == 0;
        for (int k = 0; k <= (along_u ? p : q); ++k) {
            NetPoint& point = along_u ? patch.at(k, last ? q : 0) : patch.at(last ? p : 0, k);
            const NetPoint& first = along_u ? patch.at(0, last ? q : 0) : patch.at(last ? p : 0, 0);
            std::copy_n(first.begin(), 3, point.begin());
        }
        break;
    }
    default:
        break;
    }
    double largest = 0;
    for (const NetPoint& point : patch.net)
        for (size_t c = 0; c < 3; ++c)
            largest = std::max(largest, std::abs(point[c]));
    if (largest > 1)
        for (NetPoint& point : patch.net)
            for (size_t c = 0; c < 3; ++c)
                point[c] /= largest;

    std::array<RandomPatch, kAimCount> drawn;
    for (size_t aim = 0; aim < kAimCount; ++aim) {
        Sight& sight = patch.sight;
        sight.aim = Aim(aim);
        sight.pixels = pixels;
        sight.u = uniform(0, 1);
        sight.v = uniform(0, 1);
        if (sight.aim == Aim::Border) {
            double& across = integer(0, 1) == 0 ? sight.u : sight.v;
            across = integer(0, 1) + (integer(0, 1) == 0 ? 1 : -1) * power(-6, -3);
        }
        sight.azimuth = uniform(-std::numbers::pi, std::numbers::pi);
        const double elevation = sight.aim == Aim::Grazing ? power(-6, -1) : std::asin(uniform(0.1, 1));
        sight.elevation = integer(0, 1) == 0 ? elevation : -elevation;
        sight.distance_mm = power(1, 2.3);
        sight.pixel_mm = power(-3, -0.3);
        drawn[aim] = patch;
    }
    return drawn;
}

inline CadSurface surface_of(const RandomPatch& patch)
{
    BezierPatch bezier{patch.degree_u, patch.degree_v, patch.weighting != Weighting::None, {{0, 0}, {1, 1}}, {}};
    for (const auto& [x, y, z, w] : patch.net)
        bezier.control_points.push_back({10 * w * x, 10 * w * y, 10 * w * z, w});
    CadSurface surface = test::as_surface(bezier);
    surface.natural_bounds = bezier.domain;
    return surface;
}

/// The patch as the converter stores it.
inline std::shared_ptr<const Scene> scene_of(const RandomPatch& patch, const LeafOptions& leaf_options = {})
{
    TracedScene scene;
    scene.with_textures = false;
    scene.leaf_options = leaf_options;
    PackImage& image = scene.image;
    for (int copy = 0; copy < (patch.shape == Shape::Coincident ? 2 : 1); ++copy) {
        FaceRecord face{};
        face.flags = kFaceNaturalBorder;
        face.first_patch = uint(image.patches.size());
        face.surface_kind = kKindBezier;
        std::fill_n(face.domain_hi, 2, 1.0);
        const Result<AppendedPatches> made =
            append_patches(surface_of(patch), {{0, 0}, {1, 1}}, {{0, 0, 0}, 10}, uint(image.faces.size()),
                           image.patches, image.control_points);
        EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().detail);
        face.patch_count = uint(image.patches.size()) - face.first_patch;
        image.faces.push_back(face);
    }
    return scene.finish();
}

inline Camera camera_of(const RandomPatch& patch)
{
    using reference::operator+;
    using reference::operator*;
    using reference::Vec3;
    const Sight& sight = patch.sight;
    const CadSurface surface = surface_of(patch);
    const auto vector = [](const Vec3d& a) { return Vec3{a.x, a.y, a.z}; };
    const auto unit = [](const Vec3& a, const Vec3& otherwise) {
        const double size = reference::length(a);
        return size > 0 ? a * (1 / size) : otherwise;
    };
    // where a derivative vanishes, tangents from a little way inside
    const SurfaceDerivatives at = evaluate(surface, sight.u, sight.v);
    const SurfaceDerivatives inside =
        evaluate(surface, sight.u + 1e-4 * (0.5 - sight.u), sight.v + 1e-4 * (0.5 - sight.v));
    const Vec3 outward = reference::cross(vector(at.du), vector(at.dv));
    const Vec3 normal = unit(outward, unit(reference::cross(vector(inside.du), vector(inside.dv)), {0, 0, 1}));
    const Vec3 x = unit(vector(at.du), unit(vector(inside.du), {1, 0, 0})), y = reference::cross(normal, x);
    const Vec3 towards_eye = (x * std::cos(sight.azimuth) + y * std::sin(sight.azimuth)) * std::cos(sight.elevation) +
                             normal * std::sin(sight.elevation);
    Camera camera;
    camera.target = vector(at.p);
    camera.eye = camera.target + towards_eye * sight.distance_mm;
    camera.up = normal;
    camera.fov_deg = 2 * 180 / std::numbers::pi * std::atan(0.5 * sight.pixels * sight.pixel_mm / sight.distance_mm);
    const CameraRays rays = camera_rays(camera, sight.pixels, sight.pixels);
    camera.target =
        camera.target + (rays.step_x * sight.moved_px[0] + rays.step_y * sight.moved_px[1]) * sight.distance_mm;
    return camera;
}

/// What tests count of pictures of random patches.
struct Tally {
    enum Count : size_t {
        Rays,
        Hits,
        FalseMisses,
        FalseHits,
        WrongFaces,
        CertifiedWrong, // of these three kinds
        DepthsOff,
        NormalsOff,
        NotFinite,
        Open,
        Uncertified,
        Tangent,
        Slack,
        kCount
    };
    std::array<uint64_t, kCount> counts{};
    double largest_depth_px = 0; // of hits that are not wrong

    uint64_t operator[](Count count) const { return counts[count]; }
    double per_million(Count count) const
    {
        return 1e6 * double(counts[count]) / double(std::max<uint64_t>(counts[Rays], 1));
    }
    void add(const Tally& other)
    {
        for (size_t k = 0; k < kCount; ++k)
            counts[k] += other.counts[k];
        largest_depth_px = std::max(largest_depth_px, other.largest_depth_px);
    }
};
inline constexpr const char* kCountNames[] = {"rays",        "hits",       "false misses", "false hits", "wrong faces",
                                              "cert wrong",  "depths off", "normals off",  "not finite", "open",
                                              "uncertified", "tangent",    "slack"};

inline Tally tally_picture(Tracer& tracer, const ClosestReference& closest, const RandomPatch& patch)
{
    RenderOptions options;
    options.width = options.height = patch.sight.pixels;
    options.camera = camera_of(patch);
    options.trim = TrimMode::Exact;
    options.shade = false;
    options.threads = 1; // patches are traced at the same time
    RenderStats stats;
    Tally tally;
    const Result<Frame> frame = tracer.render(options, stats);
    if (!frame.ok()) {
        ADD_FAILURE() << frame.error().where << ": " << frame.error().detail;
        return tally;
    }
    const AgainstReference found = compare_with_reference(*frame, options.camera, closest);
    auto& counts = tally.counts;
    counts[Tally::Rays] = found.rays;
    counts[Tally::Hits] = found.both_hit;
    for (const FaultyPixel& pixel : found.pixels) {
        const Verdict verdict = verdict_of(pixel);
        ++counts[verdict == Verdict::Tangent     ? Tally::Tangent
                 : verdict == Verdict::Slack     ? Tally::Slack
                 : verdict == Verdict::FalseMiss ? Tally::FalseMisses
                 : verdict == Verdict::FalseHit  ? Tally::FalseHits
                                                 : Tally::WrongFaces];
        counts[Tally::CertifiedWrong] += pixel.certified && verdict != Verdict::Tangent && verdict != Verdict::Slack;
    }
    counts[Tally::DepthsOff] = found.depths_off;
    counts[Tally::NormalsOff] = found.all_normals_off();
    counts[Tally::NotFinite] = found.not_finite;
    counts[Tally::Open] = found.open;
    counts[Tally::Uncertified] = found.uncertified;
    tally.largest_depth_px = found.largest_depth_px;
    return tally;
}

/// Of one picture by the CPU tracer.
inline Tally tally_of(const RandomPatch& patch, const LeafOptions& leaf_options = {})
{
    const auto scene = scene_of(patch, leaf_options);
    const auto tracer = make_cpu_tracer(scene);
    if (!tracer.ok()) {
        ADD_FAILURE() << tracer.error().where << ": " << tracer.error().detail;
        return {};
    }
    return tally_picture(**tracer, ClosestReference(scene->pack.image), patch);
}

/// Patches and pictures that are simpler than this one in one way each, the simplest first.
inline std::vector<RandomPatch> simpler(const RandomPatch& patch)
{
    const bool few = patch.net.size() <= 16; // so few that each may change alone
    std::vector<RandomPatch> out;
    const auto with = [&](auto&& change) {
        RandomPatch changed = patch;
        change(changed);
        out.push_back(std::move(changed));
    };
    // a quarter of the picture
    const double quarter = 0.25 * patch.sight.pixels;
    for (int corner = 0; corner < 4 && patch.sight.pixels > 1; ++corner)
        with([&](RandomPatch& p) {
            p.sight.pixels /= 2;
            p.sight.moved_px[0] += corner & 1 ? quarter : -quarter;
            p.sight.moved_px[1] += corner & 2 ? quarter : -quarter;
        });
    // one face
    if (patch.shape == Shape::Coincident)
        with([](RandomPatch& p) { p.shape = Shape::Hills; });
    // fewer rows and columns: the first and the last, every second, all but one
    for (const bool rows : {true, false}) {
        const int degree = rows ? patch.degree_u : patch.degree_v;
        const auto keep = [&](auto&& kept) {
            RandomPatch p = patch;
            p.net.clear();
            for (int i = 0; i <= patch.degree_u; ++i)
                for (int j = 0; j <= patch.degree_v; ++j)
                    if (kept(rows ? i : j))
                        p.net.push_back(patch.at(i, j));
            const int lines = int(p.net.size()) / ((rows ? patch.degree_v : patch.degree_u) + 1);
            (rows ? p.degree_u : p.degree_v) = lines - 1;
            if (lines > 1)
                out.push_back(std::move(p));
        };
        if (degree > 1)
            keep([&](int k) { return k == 0 || k == degree; });
        if (degree > 3)
            keep([](int k) { return k % 2 == 0; });
        for (int left_out = 0; left_out <= degree && degree > 1; ++left_out)
            keep([&](int k) { return k != left_out; });
    }
    // weights
    if (patch.weighting != Weighting::None) {
        with([](RandomPatch& p) {
            p.weighting = Weighting::None;
            for (NetPoint& point : p.net)
                point[3] = 1;
        });
        for (int i = 0; i <= patch.degree_u; ++i)
            with([&](RandomPatch& p) {
                for (int j = 0; j <= p.degree_v; ++j)
                    p.at(i, j)[3] = 1;
            });
        for (size_t k = 0; k < patch.net.size() && few; ++k)
            with([&](RandomPatch& p) { p.net[k][3] = 1; });
    }
    // round numbers: all, then one by one; `digits` after the point
    const auto rounded = [](double x, int digits) {
        const double unit = std::pow(10, digits);
        return std::round(x * unit) / unit;
    };
    const auto of_size = [&rounded](double x, int digits) { // `digits` that count
        return x == 0 ? 0 : rounded(x, digits - 1 - int(std::floor(std::log10(std::abs(x)))));
    };
    for (int digits = 1; digits <= 4; ++digits)
        with([&](RandomPatch& p) {
            for (NetPoint& point : p.net)
                for (size_t c = 0; c < 4; ++c)
                    point[c] = c == 3 ? of_size(point[c], digits) : rounded(point[c], digits);
        });
    for (int digits = 1; digits <= 4; ++digits)
        for (double Sight::*number :
             {&Sight::u, &Sight::v, &Sight::azimuth, &Sight::elevation, &Sight::distance_mm, &Sight::pixel_mm})
            with([&](RandomPatch& p) { p.sight.*number = of_size(p.sight.*number, digits); });
    with([](RandomPatch& p) { p.sight.moved_px = {0, 0}; });
    for (size_t k = 0; k < patch.net.size() && few; ++k)
        for (size_t c = 0; c < 3; ++c)
            for (int digits = 0; digits <= 2; ++digits)
                with([&](RandomPatch& p) { p.net[k][c] = rounded(p.net[k][c], digits); });
    // what changes nothing is not simpler
    std::erase(out, patch);
    return out;
}

/// The simplest patch that RapidCheck's search comes to from this one while `count` stays above 0.
inline RandomPatch shrink(const RandomPatch& patch, Tally::Count count, const LeafOptions& leaf_options = {})
{
    const auto tree =
        rc::shrinkable::shrinkRecur(patch, [](const RandomPatch& p) { return rc::seq::fromContainer(simpler(p)); });
    return rc::shrinkable::findLocalMin(tree,
                                        [&](const RandomPatch& p) { return tally_of(p, leaf_options)[count] > 0; })
        .first;
}

/// As a C++ expression, and the camera beside it.
inline std::string literal_of(const RandomPatch& patch)
{
    std::string net;
    for (const auto& [x, y, z, w] : patch.net)
        net += fmt::format("{}{{{}, {}, {}, {}}}", net.empty() ? "" : ", ", x, y, z, w);
    const Sight& s = patch.sight;
    const Camera camera = camera_of(patch);
    const auto vector = [](const std::array<double, 3>& a) { return fmt::format("{{{}, {}, {}}}", a[0], a[1], a[2]); };
    return fmt::format("RandomPatch{{Shape::{}, Weighting::{}, {}, {},\n    {{{}}},\n"
                       "    {{Aim::{}, {}, {}, {}, {}, {}, {}, {{{}, {}}}, {}}}}}\n"
                       "Camera{{{}, {}, {}, {}}}",
                       kShapeNames[size_t(patch.shape)], kWeightingNames[size_t(patch.weighting)], patch.degree_u,
                       patch.degree_v, net, kAimNames[size_t(s.aim)], s.u, s.v, s.azimuth, s.elevation, s.distance_mm,
                       s.pixel_mm, s.moved_px[0], s.moved_px[1], s.pixels, vector(camera.eye), vector(camera.target),
                       vector(camera.up), camera.fov_deg);
}

/// The pictures of one patch, by aim.
using PatchTallies = std::array<Tally, kAimCount>;

/// Of these patches of a run, on all cores.
inline std::vector<PatchTallies> tally_patches(uint32_t seed, std::span<const uint32_t> numbers,
                                               const LeafOptions& leaf_options = {}, uint32_t pixels = kPixels)
{
    std::vector<PatchTallies> out(numbers.size());
    tbb::parallel_for(size_t{0}, numbers.size(), [&](size_t k) {
        const auto drawn = draw_patch(seed, numbers[k], pixels);
        const auto scene = scene_of(drawn[0], leaf_options);
        const auto tracer = make_cpu_tracer(scene);
        if (!tracer.ok()) {
            ADD_FAILURE() << tracer.error().where << ": " << tracer.error().detail;
            return;
        }
        const ClosestReference closest(scene->pack.image);
        for (size_t aim = 0; aim < kAimCount; ++aim)
            out[k][aim] = tally_picture(**tracer, closest, drawn[aim]);
    });
    return out;
}

} // namespace trimray::hard
