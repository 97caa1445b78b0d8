// Leaks counted in pictures of closed solids: from outside every first hit shows the front of a face, from inside every
// ray meets one. What breaks that is a leak; at a face's border it counts as a rim: where two faces meet at an angle,
// each reaches beyond the other by what its border was moved outwards, and there its back could be seen. And what the
// true picture shows must be there: a ray that passes through it found a hole.
#pragma once

#include "format/derive.h"
#include "format/trim_reference.h"
#include "runtime/tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

namespace trimray::hard {

using Point = std::array<double, 3>;

inline Point operator+(const Point& a, const Point& b)
{
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Point operator-(const Point& a, const Point& b)
{
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Point operator*(double s, const Point& a)
{
    return {s * a[0], s * a[1], s * a[2]};
}
inline double dot(const Point& a, const Point& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Sine of the angle between a ray and a surface
inline constexpr double kGrazing = 0.05;

/// Pixels of one or more pictures.
struct LeakCount {
    int64_t rays = 0;
    int64_t leaks =
        0;            // from outside: backs of faces away from any border; from inside: misses, and fronts away from it
    int64_t rims = 0; // the other side of a face than a closed solid shows, at that face's border
    int64_t grazing = 0; // or where the ray grazes it: a tangent's two roots are one front and one back
    int64_t holes = 0;   // from outside: no hit, or one well behind the true picture's, which shows a front

    LeakCount& operator+=(const LeakCount& other)
    {
        rays += other.rays;
        leaks += other.leaks;
        rims += other.rims;
        grazing += other.grazing;
        holes += other.holes;
        return *this;
    }
};

/// A picture of the model as it should be.
struct TruePicture {
    const PackImage& image;
    const Frame& frame;
};

/// A closed solid, or several, to look at.
class ClosedModel {
public:
    /// `rim_mm`: how near its face's border a hit counts as a rim, and how far behind the true one it may lie.
    ClosedModel(std::shared_ptr<const Scene> scene, double rim_mm)
        : scene_(std::move(scene)), reference_(scene_->pack.image), rim_mm_(rim_mm)
    {
    }

    const Scene& scene() const { return *scene_; }

    /// `truth`: of the same view; null: not known.
    LeakCount count(const RenderOptions& options, const Frame& frame, bool from_inside, const TruePicture* truth) const
    {
        const CameraRays rays = camera_rays(options.camera, options.width, options.height);
        LeakCount count;
        for (uint32_t y = 0; y < frame.height; ++y)
            for (uint32_t x = 0; x < frame.width; ++x) {
                const size_t i = size_t(y) * frame.width + x;
                ++count.rays;
                count.holes += truth && !from_inside && is_hole(rays, frame, *truth, x, y);
                if (frame.face[i] < 0) {
                    count.leaks += from_inside;
                    continue;
                }
                const double facing = facing_of(rays, frame, x, y);
                if ((facing <= 0) != from_inside)
                    continue;
                if (std::abs(facing) < kGrazing) {
                    ++count.grazing;
                    continue;
                }
                ++(at_border(uint32_t(frame.face[i]), frame.uv[2 * i], frame.uv[2 * i + 1]) ? count.rims : count.leaks);
            }
        return count;
    }

private:
    /// Whether the true picture shows a front that is missing here, or well behind it. Not in what a tracer adds to a
    /// domain's sides: there a hit is answered as the side's nearest point.
    bool is_hole(const CameraRays& rays, const Frame& frame, const TruePicture& truth, uint32_t x, uint32_t y) const
    {
        const size_t i = size_t(y) * frame.width + x;
        if (truth.frame.face[i] < 0 || !(facing_of(rays, truth.frame, x, y) < -kGrazing))
            return false;
        const FaceRecord& face = truth.image.faces[size_t(truth.frame.face[i])];
        for (size_t c = 0; c < 2; ++c) {
            const double at = double(truth.frame.uv[2 * i + c]),
                         margin = 1e-6 * (face.domain_hi[c] - face.domain_lo[c]);
            if (!(at > face.domain_lo[c] + margin && at < face.domain_hi[c] - margin))
                return false;
        }
        return frame.face[i] < 0 || double(frame.depth_mm[i]) > double(truth.frame.depth_mm[i]) + rim_mm_;
    }

    /// Cosine of the angle between the ray and the outward normal; below 0: a front.
    static double facing_of(const CameraRays& rays, const Frame& frame, uint32_t x, uint32_t y)
    {
        const float* n = &frame.normal[3 * (size_t(y) * frame.width + x)];
        const Point along = rays.corner + (x + 0.5) * rays.step_x + (y + 0.5) * rays.step_y;
        return dot(along, {n[0], n[1], n[2]}) / std::sqrt(dot(along, along));
    }

    bool at_border(uint32_t id, double u_file, double v_file) const
    {
        const FaceRecord& face = scene_->pack.image.faces[id];
        const double u = (u_file - face.domain_lo[0]) / (face.domain_hi[0] - face.domain_lo[0]);
        const double v = (v_file - face.domain_lo[1]) / (face.domain_hi[1] - face.domain_lo[1]);
        // a border within the rim has the outside near the hit: at one of these places, if it is no hair-thin slot
        constexpr int kAround = 16;
        for (const double radius : {1.0, 0.3})
            for (int k = 0; k < kAround; ++k) {
                const double angle = 2 * std::numbers::pi * k / kAround;
                const double a = u + radius * rim_mm_ * std::cos(angle) / double(face.extent_mm[0]);
                const double b = v + radius * rim_mm_ * std::sin(angle) / double(face.extent_mm[1]);
                if (a < 0 || b < 0 || a > double(kUvBelowOne) || b > double(kUvBelowOne) ||
                    !reference_.inside(id, a, b))
                    return true;
            }
        return false;
    }

    std::shared_ptr<const Scene> scene_;
    TrimReference reference_;
    double rim_mm_;
};

/// A picture to count in.
struct LeakView {
    Camera camera;
    bool inside = false; // of the solids of instance `within`
    uint32_t within = 0;
};

/// The scene of one placed part alone. Solids of an assembly may stand in one another: from within one of them the
/// others' fronts are no leaks, and what it leaks must not end at another.
inline std::shared_ptr<const Scene> alone(const Scene& scene, uint32_t instance)
{
    auto only = std::make_shared<Scene>();
    only->pack = scene.pack;
    PackImage& image = only->pack.image;
    image.instances = {image.instances[instance]};
    derive_trees(image);
    return only;
}

struct Bounds {
    Point lo{1e300, 1e300, 1e300}, hi{-1e300, -1e300, -1e300};
    Point middle() const { return 0.5 * (lo + hi); }
    double diagonal() const { return std::sqrt(dot(hi - lo, hi - lo)); }
};

/// Of the boxes around all placed parts.
inline Bounds bounds_of(const PackImage& image)
{
    Bounds bounds;
    for (const InstanceRecord& instance : image.instances) {
        const PartRecord& part = image.parts[instance.part];
        for (unsigned corner = 0; corner < 8; ++corner)
            for (size_t row = 0; row < 3; ++row) {
                const double* t = instance.transform + 4 * row;
                double x = t[3];
                for (size_t c = 0; c < 3; ++c)
                    x += t[c] * (part.origin_mm[c] + (corner >> c & 1u ? part.scale_mm : -part.scale_mm));
                bounds.lo[row] = std::min(bounds.lo[row], x);
                bounds.hi[row] = std::max(bounds.hi[row], x);
            }
    }
    return bounds;
}

inline Point point_of(const Frame& frame, const CameraRays& rays, uint32_t x, uint32_t y)
{
    const Point along = rays.corner + (x + 0.5) * rays.step_x + (y + 0.5) * rays.step_y;
    return rays.eye + (double(frame.depth_mm[size_t(y) * frame.width + x]) / std::sqrt(dot(along, along))) * along;
}

/// Views of a closed model: whole, from `around` directions; and for each of these close-ups of places where two faces
/// meet in the picture, by a long lens (pixels of 1e-5 and 1e-6 of the diagonal) and from nearby; and six views of 90
/// degrees each from a point within. Found by tracing, so they follow the model; the same every time.
/// They are looked for with the backs of rims on show, so that what is done about these does not move them.
inline std::vector<LeakView> leak_views(const Scene& looked_at, const Bounds& bounds, int around, int close_ups,
                                        uint32_t pixels)
{
    const auto copy = std::make_shared<Scene>();
    copy->pack = looked_at.pack;
    for (FaceRecord& face : copy->pack.image.faces)
        face.flags &= ~kFaceRims;
    const Scene& scene = *copy;
    auto made = make_cpu_tracer(copy);
    if (!made.ok())
        return {};
    Tracer& tracer = **made;
    constexpr double kFov = 30;
    const double diagonal = bounds.diagonal();
    std::mt19937 rng(7);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::vector<LeakView> views;
    bool have_inside = false;
    for (int a = 0; a < around; ++a) {
        Point towards;
        do
            towards = {uniform(rng), uniform(rng), uniform(rng)};
        while (!(dot(towards, towards) > 0.1 && dot(towards, towards) < 1));
        Camera camera;
        camera.fov_deg = kFov;
        camera.target = bounds.middle();
        camera.eye = camera.target + (2 * diagonal / std::sqrt(dot(towards, towards))) * towards;
        views.push_back({camera, false});

        RenderOptions options;
        options.width = options.height = pixels;
        options.camera = camera;
        options.trim = TrimMode::Exact;
        options.shade = false;
        RenderStats stats;
        const auto frame = tracer.render(options, stats);
        if (!frame.ok())
            return {};
        const CameraRays rays = camera_rays(camera, pixels, pixels);
        std::vector<std::array<uint32_t, 2>> meets;
        for (uint32_t y = 0; y + 1 < pixels; ++y)
            for (uint32_t x = 0; x + 1 < pixels; ++x) {
                const size_t i = size_t(y) * pixels + x;
                for (const size_t beside : {i + 1, i + pixels})
                    if (frame->face[i] >= 0 && frame->face[beside] >= 0 && frame->face[i] != frame->face[beside] &&
                        std::abs(frame->depth_mm[i] - frame->depth_mm[beside]) < 0.02 * diagonal) {
                        meets.push_back({x, y});
                        break;
                    }
            }
        for (int c = 0; c < close_ups && !meets.empty(); ++c) {
            const auto [x, y] = meets[rng() % meets.size()];
            const Point p = point_of(*frame, rays, x, y);
            Camera near = camera;
            near.target = p;
            // the border lies within two of the wide picture's pixels: narrower and narrower, it is found again
            double width = 8 * diagonal / pixels; // mm across the picture
            const double narrowest = (c % 2 == 0 ? 1e-5 : 1e-6) * diagonal * pixels;
            const double from = c % 3 == 2 ? 0.02 : 1; // of the distance to the eye
            near.eye = p + from * (camera.eye - p);
            for (int step = 0; step < 8; ++step) {
                const double distance = std::sqrt(dot(near.eye - near.target, near.eye - near.target));
                near.fov_deg = 2 * std::atan(0.5 * width / distance) * 57.29577951308232;
                if (width <= narrowest)
                    break;
                options.camera = near;
                const auto closer = tracer.render(options, stats);
                if (!closer.ok())
                    return {};
                // the pixel nearest to the middle where faces meet
                const CameraRays near_rays = camera_rays(near, pixels, pixels);
                double best = 1e300;
                Point found = near.target;
                for (uint32_t j = 0; j + 1 < pixels; ++j)
                    for (uint32_t k = 0; k + 1 < pixels; ++k) {
                        const size_t i = size_t(j) * pixels + k;
                        const double off = std::hypot(k - 0.5 * pixels, j - 0.5 * pixels);
                        for (const size_t beside : {i + 1, i + pixels})
                            if (off < best && closer->face[i] >= 0 && closer->face[beside] >= 0 &&
                                closer->face[i] != closer->face[beside] &&
                                std::abs(closer->depth_mm[i] - closer->depth_mm[beside]) < width) {
                                best = off;
                                found = point_of(*closer, near_rays, k, j);
                            }
                    }
                near.target = found;
                width = std::max(narrowest, width * 8 / pixels);
            }
            views.push_back({near, false});
        }
        // a point within: the middle between the first hit of a ray and the next
        for (size_t k = 0; k < meets.size() && !have_inside; k += 1 + meets.size() / 64) {
            const auto [x, y] = meets[k];
            const Point p = point_of(*frame, rays, x, y);
            const Point into = p - 1.0 * camera.eye;
            const Point just_in = p + (1e-4 * diagonal / std::sqrt(dot(into, into))) * into;
            const RayHit out = trace_ray(scene, just_in, into);
            const int32_t within_instance = frame->instance[size_t(y) * pixels + x];
            if (!out.hit || out.instance != within_instance || !(dot(out.normal, into) > 0) ||
                out.distance_mm < 0.02 * diagonal)
                continue;
            const Point within = just_in + (0.5 * out.distance_mm / std::sqrt(dot(into, into))) * into;
            for (const Point& way :
                 {Point{1, 0, 0}, Point{-1, 0, 0}, Point{0, 1, 0}, Point{0, -1, 0}, Point{0, 0, 1}, Point{0, 0, -1}}) {
                Camera camera_in;
                camera_in.eye = within;
                camera_in.target = within + diagonal * way;
                camera_in.up = way[2] != 0 ? Point{1, 0, 0} : Point{0, 0, 1};
                camera_in.fov_deg = 90;
                views.push_back({camera_in, true, uint32_t(within_instance)});
            }
            have_inside = true;
        }
    }
    return views;
}

} // namespace trimray::hard
