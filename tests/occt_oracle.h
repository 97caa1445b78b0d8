// An oracle for rays: the CAD kernel reads the file itself and intersects each ray with the trimmed faces
// (IntCurvesFace_Intersector). Shares no code with the converter or the tracers, so agreement means something.
// Source: OpenCASCADE reference manual, IntCurvesFace, BRepExtrema.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace trimray::oracle {

using Point = std::array<double, 3>;

/// Units: mm, world. `direction` is unit.
struct Ray {
    Point origin{}, direction{};
};

/// Pinhole camera in the project's conventions: vertical field of view, pixel centres at +0.5, row 0 at the top.
struct View {
    Point eye{}, target{}, up{0, 0, 1};
    double fov_deg = 35;
};

/// The rays of a picture, row by row from the top. Written anew here, not taken from the runtime.
std::vector<Ray> view_rays(const View& view, uint32_t width, uint32_t height);

/// A view of the whole box from `direction` (towards the eye), its bounding sphere just inside the picture.
View frame_box(const Point& lo_mm, const Point& hi_mm, const Point& direction, const Point& up, double aspect,
               double fov_deg);

struct OracleHit {
    double distance_mm = std::numeric_limits<double>::infinity();
    int32_t face = -1;   // over all placed faces, in the file's order; -1: a miss
    double u = 0, v = 0; // the kernel's parameters
    bool failed = false; // the kernel threw on a face on the way
    bool hit() const { return face >= 0; }
};

/// The area that a plane through `point` and the file's only solid have in common: BRepAlgoAPI_Common with a face that
/// is larger than the solid, and BRepGProp. Nothing where there is no such solid or the kernel fails.
std::optional<double> section_area_mm2(const std::string& path, const Point& point, const Point& normal);

/// Curvatures of a surface at a point, 1/mm and 1/mm^2 of the world.
struct KernelCurvatures {
    double larger = 0, smaller = 0, mean = 0, gaussian = 0;
    Point normal{}; // unit, world
    std::string surface;
};

/// Why a ray of ours and the oracle's disagree.
enum class Cause {
    Edge,        // within the tolerance of an edge of the face in question
    Tangent,     // the ray grazes the surface
    Oracle,      // the kernel is wrong by its own projection, or unstable under a jitter of 1e-7 rad
    Unexplained, // a hole or a false face
};
inline constexpr size_t kCauseCount = 4;
const char* cause_name(Cause cause);

struct Disagreement {
    size_t ray = 0;
    double ours_mm = 0, oracle_mm = 0; // infinite: a miss
    Cause cause = Cause::Unexplained;
    int32_t face = -1;         // of the point that decided the cause
    std::string surface;       // kind of that face's surface
    double cos_incidence = -1; // |normal . direction| there; -1: not known
    double edge_distance_mm = -1;
    double edge_tolerance_mm = -1;
    std::string why;
};

struct Agreement {
    size_t rays = 0, both_hit = 0, both_miss = 0, agree = 0;
    std::array<size_t, kCauseCount> by_cause{};
    double worst_agreeing_error = 0; // depth error over the diagonal, of rays that agree
    std::vector<Disagreement> disagreements;
    double share() const { return rays ? double(agree) / double(rays) : 1.0; }
    size_t unexplained() const { return by_cause[size_t(Cause::Unexplained)]; }
};

struct OracleOptions {
    bool boundary_tolerance = true; // the kernel's default: points within an edge's tolerance are on the face
    double depth_tolerance = 1e-5;  // of the diagonal
    double edge_margin = 1e-6;      // of the diagonal, added to an edge's own tolerance: what trims are simplified to
    double tangent_cosine = 1e-2;   // below it a position error of 1e-7 of the diagonal is a depth error of 1e-5
    size_t max_classified = 2000;   // disagreements looked into; the rest count as unexplained
    double jitter_rad = 1e-7;
    int threads = 0; // 0: all
};

class Oracle {
public:
    /// Reads STEP, IGES or BREP by the file's name. Null and a reason in `error` where the kernel cannot.
    static std::unique_ptr<Oracle> load(const std::string& path, const OracleOptions& options, std::string& error);
    ~Oracle();

    size_t unique_faces() const;
    size_t placed_faces() const;
    const Point& lo_mm() const;
    const Point& hi_mm() const;
    double diagonal_mm() const;

    /// The closest hit of each ray at distance >= 0.
    std::vector<OracleHit> cast(std::span<const Ray> rays) const;

    /// GeomLProp_SLProps at a hit; positive where the surface bends away from `outward`. Nothing where the kernel finds
    /// no tangent plane.
    std::optional<KernelCurvatures> curvatures(const OracleHit& hit, const Point& outward) const;

    /// Compares depths of ours (infinite: a miss) with the oracle's and finds a cause for each disagreement.
    Agreement compare(std::span<const Ray> rays, std::span<const float> ours_mm, std::span<const OracleHit> hits) const;

private:
    struct Impl;
    explicit Oracle(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
    friend struct Explainer;
};

} // namespace trimray::oracle
