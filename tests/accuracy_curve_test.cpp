// The curve of accuracy over time: its settings, its front on points made by hand, its sums on pictures whose times and
// errors are known, and curves of real pictures.
#include "runtime/view/accuracy_curve.h"

#include "tests/kit_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <string>
#include <vector>

namespace trimray {
namespace {

const CurvePoint* named(const std::vector<CurvePoint>& points, const std::string& name)
{
    const auto found =
        std::find_if(points.begin(), points.end(), [&](const CurvePoint& point) { return point.name == name; });
    return found == points.end() ? nullptr : &*found;
}

TEST(accuracy_curve, changes_one_dial_at_a_time_and_measures_nothing_twice)
{
    RenderOptions options;
    options.error_px = 0.1f;
    const std::vector<CurvePoint> points = accuracy_settings_of(options);
    EXPECT_EQ(points.front().name, "now");
    EXPECT_EQ(points.front().dial, AccuracyDial::Now);
    EXPECT_EQ(points.front().trim, TrimMode::Exact);
    for (const CurvePoint& point : points) {
        const CurvePoint& now = points.front();
        const bool dial_error = point.error_px != now.error_px, dial_trim = point.trim != now.trim,
                   dial_closest = point.closest != now.closest || point.frames != now.frames;
        EXPECT_EQ(dial_error, point.dial == AccuracyDial::ErrorPx) << point.name;
        EXPECT_EQ(dial_trim, point.dial == AccuracyDial::Trims) << point.name;
        EXPECT_EQ(dial_closest, point.dial == AccuracyDial::Closest) << point.name;
        const RenderOptions asked = with_settings(options, point);
        EXPECT_EQ(asked.error_px, point.error_px);
        EXPECT_EQ(asked.trim, point.trim);
        EXPECT_EQ(asked.closest, point.closest);
        EXPECT_EQ(asked.frames, point.frames);
    }
    EXPECT_FALSE(named(points, "error 0.1 px")) << "it is the view's own";
    EXPECT_FALSE(named(points, "trims by cells"));
    EXPECT_FALSE(named(points, "certified"));
    ASSERT_TRUE(named(points, "stochastic, 4 frames"));
    EXPECT_EQ(named(points, "stochastic, 4 frames")->frames, 4u);

    options.trim = TrimMode::Kd;
    options.closest = ClosestPolicy::Stochastic;
    options.frames = 4;
    const std::vector<CurvePoint> others = accuracy_settings_of(options);
    EXPECT_TRUE(named(others, "trims by cells"));
    EXPECT_FALSE(named(others, "trims by kd-trees"));
    ASSERT_TRUE(named(others, "certified"));
    EXPECT_EQ(named(others, "certified")->frames, 1u);
    EXPECT_FALSE(named(others, "stochastic, 4 frames"));
    EXPECT_EQ(named(others, "error 1 px")->frames, 4u);
}

TEST(accuracy_curve, has_a_front_of_what_nothing_beats)
{
    const auto point = [](const char* name, double ms, double error_ms, double error_px) {
        CurvePoint made;
        made.name = name;
        made.ms = ms;
        made.error_ms = error_ms;
        made.errors.mean_error_px = error_px;
        return made;
    };
    std::vector<CurvePoint> points{point("fast and rough", 1, 0, 9),    point("right", 10, 0, 0),
                                   point("slower, as right", 12, 0, 0), point("between", 5, 0, 4),
                                   point("slower, rougher", 6, 0, 5),   point("as fast, rougher", 5, 0, 6)};
    const auto front = [&] {
        mark_pareto(points);
        std::vector<std::string> names;
        for (const CurvePoint& marked : points)
            if (marked.pareto)
                names.push_back(marked.name);
        return names;
    };
    EXPECT_EQ(front(), (std::vector<std::string>{"fast and rough", "right", "between"}));
    // 10 +- 1 ms and 12 +- 1 ms cannot be told apart; 1 and 10 +- 1 can
    points[1].error_ms = points[2].error_ms = 1;
    EXPECT_EQ(front(), (std::vector<std::string>{"fast and rough", "right", "slower, as right", "between"}));
    // what is rougher is not on the front for being faster by less than noise
    points.push_back(point("faster by noise, rougher", 9, 1, 1));
    EXPECT_EQ(front(), (std::vector<std::string>{"fast and rough", "right", "slower, as right", "between"}));
    points.back().ms = 6.5;
    EXPECT_EQ(front().back(), "faster by noise, rougher") << "faster by more";
}

/// Shows the frame that it is given, with holes that hang on the settings, and takes times that do.
class KnownErrors final : public Tracer {
public:
    explicit KnownErrors(Frame right) : right_(std::move(right))
    {
        for (size_t i = 0; i < right_.face.size(); ++i)
            if (right_.face[i] >= 0)
                hits_.push_back(i);
    }
    DeviceKind device_kind() const override { return DeviceKind::Cpu; }
    std::string device_name() const override { return "known errors"; }
    Result<Frame> render(const RenderOptions& options, RenderStats& stats) override
    {
        ++pictures;
        const bool stochastic = options.closest == ClosestPolicy::Stochastic;
        stats = {};
        stats.device = device_name();
        stats.frame_ms.assign(options.frames, stochastic ? 2 : options.trim == TrimMode::Kd ? 7 : 5);
        stats.work.newton_steps = stochastic ? 1 : 2;
        Frame frame = right_;
        for (size_t i = 0; i < (stochastic ? 64 / options.frames : 0); ++i) {
            const size_t hole = hits_[i * hits_.size() / 64];
            frame.depth_mm[hole] = std::numeric_limits<float>::infinity();
            frame.face[hole] = frame.instance[hole] = -1;
        }
        return frame;
    }
    int pictures = 0;

private:
    Frame right_;
    std::vector<size_t> hits_;
};

class accuracy_curves : public testing::Test {
protected:
    accuracy_curves() : scene_(kit_of({0, 1, 2, 3})), options_(kit_picture(96, 72)) {}
    Result<AccuracyCurve> measure(Tracer& tracer, const TurnOptions& turns,
                                  const std::function<void(const AccuracyCurve&)>& came = {})
    {
        RenderOptions plain = options_;
        plain.cancelled = nullptr;
        Result<ViewReference> reference = ViewReference::make(scene_, plain);
        if (!reference.ok())
            return reference.error();
        return measure_accuracy_curve(tracer, scene_->pack.image, *reference, options_, turns, came);
    }
    std::shared_ptr<const Scene> scene_;
    RenderOptions options_;
};

TEST_F(accuracy_curves, have_the_times_and_errors_of_their_pictures)
{
    KnownErrors tracer(draw(scene_, options_).frame);
    std::vector<size_t> seen; // points that had come, at each call
    std::vector<uint32_t> rounds;
    const Result<AccuracyCurve> curve = measure(tracer, {.rounds = 4}, [&](const AccuracyCurve& so_far) {
        seen.push_back(so_far.points.size());
        rounds.push_back(so_far.points.front().rounds);
        EXPECT_GT(so_far.points.back().ms, 0);
    });
    ASSERT_TRUE(curve.ok());
    EXPECT_TRUE(curve->in_double);
    EXPECT_EQ(curve->device, "known errors");
    const std::vector<CurvePoint>& points = curve->points;
    const CurvePoint &now = points.front(), &one = *named(points, "stochastic, 1 frame"),
                     &four = *named(points, "stochastic, 4 frames"), &sixteen = *named(points, "stochastic, 16 frames");
    // a hole on an outline is open
    const auto differs = [](const CurvePoint& point) { return point.errors.wrong + point.errors.open; };
    EXPECT_EQ(now.ms, 5);
    EXPECT_EQ(one.ms, 2);
    EXPECT_EQ(four.ms, 8) << "all its frames";
    EXPECT_EQ(differs(one), differs(now) + 64);
    EXPECT_EQ(differs(four), differs(now) + 16);
    EXPECT_EQ(differs(sixteen), differs(now) + 4);
    EXPECT_EQ(one.work.newton_steps, 1u);
    EXPECT_TRUE(now.pareto && one.pareto && named(points, "error 1 px")->pareto);
    EXPECT_FALSE(four.pareto || sixteen.pareto || named(points, "trims by kd-trees")->pareto);
    // each point as it is made, then all after each of two pairs of rounds
    ASSERT_EQ(seen.size(), points.size() + 2);
    for (size_t i = 0; i < points.size(); ++i)
        EXPECT_EQ(seen[i], i + 1);
    EXPECT_EQ(rounds[points.size() - 1], 0u);
    EXPECT_EQ(rounds[points.size()], 2u);
    EXPECT_EQ(rounds.back(), 4u);
    EXPECT_EQ(now.rounds, 4u);
    EXPECT_EQ(tracer.pictures, int(points.size()) * (1 + 2 * 4));
}

TEST_F(accuracy_curves, of_real_pictures_say_what_is_right)
{
    scene_ = all_kinds().finish(); // with textures
    options_ = overview(96, 72);
    const auto tracer = make_cpu_tracer(scene_);
    ASSERT_TRUE(tracer.ok());
    options_.threads = 1;
    const Result<AccuracyCurve> curve = measure(**tracer, {.rounds = 2});
    ASSERT_TRUE(curve.ok());
    EXPECT_TRUE(curve->skipped.empty());
    EXPECT_EQ(curve->points.size(), accuracy_settings_of(options_).size());
    for (const CurvePoint& point : curve->points) {
        EXPECT_GT(point.ms, 0) << point.name;
        EXPECT_EQ(point.errors.pixels, 96u * 72) << point.name;
        EXPECT_EQ(point.errors.uncertified, point.work.uncertified_pixels) << point.name;
        const bool approximate = point.closest == ClosestPolicy::Stochastic || point.trim == TrimMode::Sdf;
        if (approximate)
            continue;
        EXPECT_EQ(point.errors.wrong, 0u) << point.name;
        EXPECT_LE(point.errors.mean_error_px, 1e-3) << point.name;
        EXPECT_LE(point.errors.uncertified, point.errors.pixels / 20) << point.name;
    }
    const CurvePoint& texture = *named(curve->points, "trims by distance textures");
    EXPECT_GT(texture.errors.wrong + texture.errors.other_face, 0u) << "its borders are rounded";
    EXPECT_EQ(named(curve->points, "stochastic, 1 frame")->errors.uncertified, 96u * 72);
}

TEST_F(accuracy_curves, leave_out_what_the_pack_has_not)
{
    TracedScene bare = all_kinds();
    bare.with_textures = false;
    scene_ = bare.finish();
    options_ = overview(48, 36);
    const auto tracer = make_cpu_tracer(scene_);
    ASSERT_TRUE(tracer.ok());
    Result<AccuracyCurve> curve = measure(**tracer, {.rounds = 2});
    ASSERT_TRUE(curve.ok());
    ASSERT_EQ(curve->skipped.size(), 2u); // hybrid, textures
    for (const SkippedPoint& skipped : curve->skipped) {
        EXPECT_THAT(skipped.why, testing::HasSubstr("without a distance texture"));
        EXPECT_FALSE(named(curve->points, skipped.name));
    }
    options_.trim = TrimMode::Sdf; // of the view itself it is an error
    curve = measure(**tracer, {.rounds = 2});
    ASSERT_FALSE(curve.ok());
    EXPECT_EQ(curve.error().code, ErrorCode::UnsupportedPackFeature);
}

TEST_F(accuracy_curves, can_be_given_up)
{
    const auto tracer = make_cpu_tracer(scene_);
    ASSERT_TRUE(tracer.ok());
    for (const int after : {0, 1, 500, 8000}) { // in a picture, in its comparison, in a later one
        std::atomic<int> asked{0};
        options_.cancelled = [&] { return asked++ >= after; };
        const Result<AccuracyCurve> curve = measure(**tracer, {.rounds = 1000, .seconds = 1000});
        ASSERT_FALSE(curve.ok());
        EXPECT_EQ(curve.error().code, ErrorCode::Interrupted);
    }
}

} // namespace
} // namespace trimray
