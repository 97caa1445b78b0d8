// The thread of studies: what it finds of which picture, that it gives up when told, lets go of what it was lent, and
// tells why it failed.
#include "runtime/view/view_study.h"
#include "tests/kit_scene.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <variant>

namespace trimray {
namespace {

using namespace std::chrono_literals;

/// Fails, or never ends a picture but when it is given up.
class OddTracer : public Tracer {
public:
    explicit OddTracer(bool fails) : fails_(fails) {}
    DeviceKind device_kind() const override { return DeviceKind::Cpu; }
    std::string device_name() const override { return "odd"; }
    Result<Frame> render(const RenderOptions& options, RenderStats&) override
    {
        if (fails_)
            return Error{ErrorCode::DeviceFailed, "", "no picture today"};
        asked = true;
        while (!options.cancelled())
            std::this_thread::sleep_for(1ms);
        return given_up();
    }
    std::atomic<bool> asked = false;

private:
    bool fails_;
};

class ViewStudyTest : public testing::Test {
protected:
    bool ends()
    {
        for (int tries = 0; tries < 60000 && study.busy(); ++tries)
            std::this_thread::sleep_for(1ms);
        return !study.busy();
    }
    StudyOrder order(StudyOrder::What what)
    {
        StudyOrder order;
        order.what = what;
        order.picture = 7;
        order.scene = scene;
        order.options = kit_picture(32, 24);
        order.options.threads = 1;
        order.view = "the only one";
        return order;
    }

    const std::shared_ptr<const Scene> scene = kit_of({0, 1, 2, 3});
    std::atomic<int> wakes = 0;
    ViewStudy study{[this] { ++wakes; }};
};

TEST_F(ViewStudyTest, errors_are_those_of_the_picture_that_it_is_given)
{
    const Result<std::unique_ptr<Tracer>> tracer = make_cpu_tracer(scene);
    ASSERT_TRUE(tracer.ok());
    StudyOrder right = order(StudyOrder::What::Errors);
    RenderStats stats;
    Result<Frame> frame = (*tracer)->render(right.options, stats);
    ASSERT_TRUE(frame.ok());
    StudyOrder wrong = right;
    right.frame = *frame;
    wrong.frame = *frame;
    wrong.picture = 8;
    uint64_t spoiled = 0;
    for (size_t at = 0; at < wrong.frame.depth_mm.size(); ++at)
        if (wrong.frame.face[at] >= 0 && ++spoiled)
            wrong.frame.depth_mm[at] *= 1.5f;
    ASSERT_GT(spoiled, 20u);

    study.start(std::move(right));
    EXPECT_FALSE(study.uses_tracer());
    ASSERT_TRUE(ends());
    std::optional<StudyFindings> found = study.take();
    ASSERT_TRUE(found && found->complete);
    EXPECT_EQ(found->picture, 7u);
    EXPECT_EQ(std::get<ErrorMask>(found->found).pixels, 32u * 24u);
    EXPECT_EQ(std::get<ErrorMask>(found->found).differing(), 0u);
    EXPECT_GT(wakes, 0);
    EXPECT_FALSE(study.take()); // once

    study.start(std::move(wrong)); // the same view: what is true is known
    ASSERT_TRUE(ends());
    found = study.take();
    ASSERT_TRUE(found);
    EXPECT_EQ(found->picture, 8u);
    EXPECT_EQ(std::get<ErrorMask>(found->found).differing(), spoiled);
    EXPECT_FALSE(study.take_error());
}

TEST_F(ViewStudyTest, effects_are_timed_with_the_tracer_which_is_then_let_go)
{
    Result<std::unique_ptr<Tracer>> made = make_cpu_tracer(scene);
    ASSERT_TRUE(made.ok());
    const std::shared_ptr<Tracer> tracer = std::move(*made);
    StudyOrder asked = order(StudyOrder::What::Effects);
    asked.options.look.occlusion.samples = 4;
    asked.tracer = tracer;
    study.start(std::move(asked));
    ASSERT_TRUE(ends());
    EXPECT_FALSE(study.uses_tracer());
    EXPECT_EQ(tracer.use_count(), 1);
    const std::optional<StudyFindings> found = study.take();
    ASSERT_TRUE(found && found->complete);
    bool timed = false;
    for (const EffectCost& effect : std::get<EffectCosts>(found->found).effects)
        timed |= effect.name == "occlusion" && effect.ms;
    EXPECT_TRUE(timed);
}

TEST_F(ViewStudyTest, what_is_given_up_tells_nothing_and_lets_go_of_all)
{
    const auto tracer = std::make_shared<OddTracer>(false);
    StudyOrder asked = order(StudyOrder::What::Effects);
    asked.tracer = tracer;
    study.start(std::move(asked)); // it ends by no other way, so these hold however fast a thread is
    EXPECT_TRUE(study.busy());
    EXPECT_TRUE(study.uses_tracer());
    for (int tries = 0; tries < 60000 && !tracer->asked; ++tries)
        std::this_thread::sleep_for(1ms);
    ASSERT_TRUE(tracer->asked);
    EXPECT_EQ(study.progress()->what, StudyOrder::What::Effects);
    study.finish();
    EXPECT_FALSE(study.busy());
    EXPECT_FALSE(study.progress());
    EXPECT_FALSE(study.take());
    EXPECT_FALSE(study.take_error());
    EXPECT_EQ(tracer.use_count(), 1);

    StudyOrder errors = order(StudyOrder::What::Errors); // it keeps the truth of a view, and with it the scene
    RenderStats stats;
    errors.frame = *(*make_cpu_tracer(scene))->render(errors.options, stats);
    const long held = scene.use_count() - 1; // `errors` has one
    study.start(std::move(errors));
    ASSERT_TRUE(ends());
    EXPECT_GT(scene.use_count(), held);
    study.finish();
    EXPECT_EQ(scene.use_count(), held);
}

TEST_F(ViewStudyTest, a_study_that_fails_says_why_once)
{
    StudyOrder asked = order(StudyOrder::What::Effects);
    asked.tracer = std::make_shared<OddTracer>(true);
    study.start(std::move(asked));
    ASSERT_TRUE(ends());
    EXPECT_FALSE(study.take());
    const std::optional<Error> error = study.take_error();
    ASSERT_TRUE(error);
    EXPECT_EQ(error->detail, "no picture today");
    EXPECT_FALSE(study.take_error());
}

TEST(study_size, keeps_the_shape_within_the_bound)
{
    const PictureSize small = study_size({640, 360});
    EXPECT_EQ(small.width, 640u);
    EXPECT_EQ(small.height, 360u);
    const PictureSize large = study_size({3840, 2160});
    EXPECT_LE(uint64_t(large.width) * large.height, kStudyPixels);
    EXPECT_GT(uint64_t(large.width) * large.height, kStudyPixels * 98 / 100);
    EXPECT_NEAR(double(large.width) / large.height, 16.0 / 9.0, 0.01);
    EXPECT_EQ(study_size({10'000'000, 1}).height, 1u);
}

} // namespace
} // namespace trimray
