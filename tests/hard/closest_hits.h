// A scene's pictures by both tracers, scored against the reference for closest hits in the units of the hard cases.
#pragma once

#include "runtime/derived_scene.h"
#include "tests/against_reference.h"
#include "tests/keep_vulkan_loaded.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

namespace trimray::hard {

/// What a pixel that differs from the reference's is counted as.
enum class Verdict {
    Tangent, // moving the ray by 1e-3 pixels decides it
    Slack,   // missed where the reference has a hit within kDomainSlack outside of a face's domain
    WrongFace,
    FalseMiss, // or a hit that lies behind the true one
    FalseHit,  // or one before it
};

inline Verdict verdict_of(const FaultyPixel& pixel)
{
    const bool of_face = pixel.fault == Fault::WrongFace;
    if (of_face ? pixel.doubt != Doubt::None : pixel.doubt == Doubt::Tangent)
        return Verdict::Tangent;
    if (of_face)
        return Verdict::WrongFace;
    const bool behind = pixel.fault == Fault::FalseMiss || pixel.tracer_mm > pixel.reference_mm;
    const auto [u, v] = pixel.reference_uv_face; // clamped to the domain
    const bool outside = std::min(u, v) <= 0 || std::max(u, v) >= double(kUvBelowOne);
    return !behind ? Verdict::FalseHit : outside ? Verdict::Slack : Verdict::FalseMiss;
}

/// Of pictures that one tracer made.
struct Score {
    std::string tracer; // "cpu" or "vulkan"
    uint64_t rays = 0, hits = 0;
    uint64_t false_misses = 0, false_hits = 0, wrong_faces = 0, tangent = 0, slack = 0; // Verdict
    double farthest_px = 0;  // the least of 1e-3, 1e-2, 0.1 and 1 pixels within which every wrong ray's answer changes
    uint64_t not_finite = 0; // NaN, or an infinity other than a miss's depth
    uint64_t open = 0;       // rays of which the reference itself is not sure
    double depth_px = 0;     // largest |dt| in footprints, of rays that are not wrong
    double normal_deg = 0;   // likewise
    uint64_t uncertified = 0, certified_wrong = 0;
    double leaf_visits = 0, newton_steps = 0; // a ray

    double per_million(uint64_t count) const { return 1e6 * double(count) / double(std::max<uint64_t>(rays, 1)); }
};

inline std::ostream& operator<<(std::ostream& out, const Score& s)
{
    return out << s.tracer << ": " << s.rays << " rays, " << s.hits
               << " hits; a million: " << s.per_million(s.false_misses) << " false misses, "
               << s.per_million(s.false_hits) << " false hits, " << s.per_million(s.wrong_faces) << " wrong faces, "
               << s.per_million(s.tangent) << " tangent, all within " << s.farthest_px << " px, "
               << s.per_million(s.slack) << " in the slack; |dt| " << s.depth_px << " px, normals " << s.normal_deg
               << " deg, " << s.not_finite << " not finite; " << s.uncertified << " uncertified, " << s.certified_wrong
               << " certified and wrong; a ray: " << s.leaf_visits << " leaves, " << s.newton_steps << " steps";
}

/// Which picture, and in how many pixels.
struct View {
    Camera camera;
    uint32_t width = 192, height = 144;
};

/// Pictures of every view, in exact trims. `smaller` divides their sides.
inline Score score(Tracer& tracer, const ClosestReference& closest, const std::vector<View>& views, uint32_t smaller)
{
    Score s;
    for (const View& view : views) {
        RenderOptions options;
        options.width = view.width / smaller;
        options.height = view.height / smaller;
        options.camera = view.camera;
        options.trim = TrimMode::Exact;
        options.shade = false;
        RenderStats stats;
        const Result<Frame> frame = tracer.render(options, stats);
        if (!frame.ok()) {
            ADD_FAILURE() << frame.error().where << ": " << frame.error().detail;
            continue;
        }
        const AgainstReference a = compare_with_reference(*frame, options.camera, closest);
        s.rays += a.rays;
        s.hits += a.both_hit;
        for (const FaultyPixel& pixel : a.pixels) {
            const Verdict verdict = verdict_of(pixel);
            ++(verdict == Verdict::Tangent     ? s.tangent
               : verdict == Verdict::Slack     ? s.slack
               : verdict == Verdict::WrongFace ? s.wrong_faces
               : verdict == Verdict::FalseMiss ? s.false_misses
                                               : s.false_hits);
            if (verdict == Verdict::Slack)
                continue;
            s.farthest_px = std::max(s.farthest_px, pixel.hair_px);
        }
        s.not_finite += a.not_finite;
        s.open += a.open;
        s.depth_px = std::max(s.depth_px, a.largest_depth_px);
        s.normal_deg = std::max(s.normal_deg, a.largest_normal_deg);
        s.uncertified += a.uncertified;
        s.certified_wrong += a.certified_wrong;
        s.leaf_visits += double(stats.work.leaf_visits);
        s.newton_steps += double(stats.work.newton_steps);
    }
    s.leaf_visits /= double(std::max<uint64_t>(s.rays, 1));
    s.newton_steps /= double(std::max<uint64_t>(s.rays, 1));
    return s;
}

/// Ours switched to plain: the first stochastic frame, Newton once from the middle of each leaf, with one leaf a patch.
class PlainTracer final : public Tracer {
public:
    explicit PlainTracer(const Scene& scene)
    {
        Result<std::unique_ptr<Tracer>> made = make_cpu_tracer(with_leaf_budget(scene, 1));
        tracer_ = std::move(*made); // the scene was traced already
    }

    DeviceKind device_kind() const override { return DeviceKind::Cpu; }
    std::string device_name() const override { return "plain"; }

    Result<Frame> render(const RenderOptions& options, RenderStats& stats) override
    {
        RenderOptions plain = options;
        plain.closest = ClosestPolicy::Stochastic;
        return tracer_->render(plain, stats);
    }

private:
    std::unique_ptr<Tracer> tracer_;
};

/// Whether the plain tracer's figures are to be printed beside ours: TRIMRAY_PLAIN is set.
inline bool plain_asked()
{
    return std::getenv("TRIMRAY_PLAIN") != nullptr;
}

/// What a picture's sides are divided by. Vulkan's driver may be software; and sanitizers, which slow the reference by
/// ten, look for other faults than a picture's.
inline uint32_t shrinking(bool vulkan)
{
#ifdef __SANITIZE_ADDRESS__
    return vulkan ? 8 : 4;
#else
    return vulkan ? 4 : 1;
#endif
}

struct NamedTracer {
    std::string name; // "cpu", "vulkan", or "plain", whose figures are only printed
    std::unique_ptr<Tracer> tracer;
};

/// A scene's tracers on one device, on the CPU with the plain one before it if that is asked for. Without a Vulkan
/// driver that tracer is named as skipped.
inline std::vector<NamedTracer> tracers_on(bool vulkan, const std::shared_ptr<const Scene>& scene)
{
    std::vector<NamedTracer> tracers;
    if (vulkan)
        keep_vulkan_loaded();
    Result<std::unique_ptr<Tracer>> made = vulkan ? make_vulkan_tracer(scene, true, false) : make_cpu_tracer(scene);
    if (!made.ok() && vulkan && made.error().code == ErrorCode::NoDevice) {
        std::cout << "skipped vulkan: " << made.error().detail << "\n";
        return tracers;
    }
    if (!made.ok()) {
        ADD_FAILURE() << made.error().where << ": " << made.error().detail;
        return tracers;
    }
    if (plain_asked() && !vulkan)
        tracers.push_back({"plain", std::make_unique<PlainTracer>(*scene)});
    tracers.push_back({vulkan ? "vulkan" : "cpu", std::move(*made)});
    return tracers;
}

inline std::vector<NamedTracer> tracers_of(const std::shared_ptr<const Scene>& scene)
{
    std::vector<NamedTracer> tracers = tracers_on(false, scene);
    for (NamedTracer& on_device : tracers_on(true, scene))
        tracers.push_back(std::move(on_device));
    return tracers;
}

/// Hands over the score of a tracer and prints it; expects no NaN and no open search. Sides are `shrinking` times
/// shorter; without a Vulkan driver that tracer is named as skipped.
inline void on_tracer(bool vulkan, const std::shared_ptr<const Scene>& scene, const std::vector<View>& views,
                      const std::function<void(const Score&)>& check)
{
    const ClosestReference closest(scene->pack.image);
    for (const auto& [name, tracer] : tracers_on(vulkan, scene)) {
        Score s = score(*tracer, closest, views, shrinking(vulkan));
        s.tracer = name;
        std::cout << s << "\n";
        if (name == "plain")
            continue;
        EXPECT_EQ(s.not_finite, 0u) << s;
        EXPECT_EQ(s.open, 0u) << s;
        check(s);
    }
}

inline void on_both_tracers(const std::shared_ptr<const Scene>& scene, const std::vector<View>& views,
                            const std::function<void(const Score&)>& check)
{
    for (const bool vulkan : {false, true})
        on_tracer(vulkan, scene, views, check);
}

} // namespace trimray::hard
