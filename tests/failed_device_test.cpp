// A device that is lost is started anew once, in the view at hand; lost again, that is the end, said plainly.
#include "format/pack_writer.h"
#include "runtime/view/viewer.h"
#include "synthetic_pack.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>

namespace trimray {
namespace {

using namespace std::chrono_literals;

/// Traces on the CPU until its pictures are used up, then fails as a lost device does.
class FrailTracer : public Tracer {
public:
    FrailTracer(std::unique_ptr<Tracer> within, std::atomic<int>& pictures_left)
        : within_(std::move(within)), pictures_left_(pictures_left)
    {
    }
    DeviceKind device_kind() const override { return within_->device_kind(); }
    std::string device_name() const override { return within_->device_name(); }
    Result<Frame> render(const RenderOptions& options, RenderStats& stats) override
    {
        if (is_lost_ || pictures_left_-- <= 0) {
            is_lost_ = true;
            return Error{ErrorCode::DeviceFailed, "", "the device was lost"};
        }
        return within_->render(options, stats);
    }

private:
    std::unique_ptr<Tracer> within_;
    std::atomic<int>& pictures_left_;
    bool is_lost_ = false;
};

class FailedDeviceTest : public testing::Test {
protected:
    void SetUp() override
    {
        const std::string file =
            testing::TempDir() + testing::UnitTest::GetInstance()->current_test_info()->name() + ".tray";
        ASSERT_TRUE(write_file_atomically(file, encode_pack(synthetic_image(), WriteOptions{3})).ok());
        Viewer::Start start;
        start.files = {file};
        start.wake = [] {};
        start.make_tracer = [this](const std::shared_ptr<const Scene>& scene,
                                   std::string&) -> Result<std::unique_ptr<Tracer>> {
            ++made;
            Result<std::unique_ptr<Tracer>> within = make_cpu_tracer(scene);
            if (!within.ok())
                return within.error();
            return std::unique_ptr<Tracer>(std::make_unique<FrailTracer>(std::move(*within), pictures_left));
        };
        viewer = std::make_unique<Viewer>(std::move(start));
        viewer->set_picture_rect({0, 0, 160, 120});
    }
    bool comes_to_rest()
    {
        for (int tries = 0; tries < 20000; ++tries) {
            viewer->update(Viewer::Clock::now());
            if (viewer->at_rest())
                return true;
            std::this_thread::sleep_for(1ms);
        }
        return false;
    }
    bool tells(const std::string& words) const
    {
        for (const Toast& toast : viewer->toasts())
            if (toast.is_error && toast.text.find(words) != std::string::npos)
                return true;
        return false;
    }

    std::atomic<int> made = 0, pictures_left = 1'000'000;
    std::unique_ptr<Viewer> viewer; // last: its threads use what is above
};

TEST_F(FailedDeviceTest, it_is_started_anew_in_the_view_at_hand)
{
    ASSERT_TRUE(comes_to_rest());
    EXPECT_EQ(made, 1);
    viewer->look_from("top");
    ASSERT_TRUE(comes_to_rest());
    const Camera camera = viewer->state().camera;
    const std::vector<uint8_t> before = viewer->shown()->colours.rgba;

    pictures_left = 0;
    viewer->changed();
    for (int tries = 0; tries < 20000 && made < 2; ++tries) {
        viewer->update(Viewer::Clock::now());
        std::this_thread::sleep_for(1ms);
        if (tells("started anew"))
            pictures_left = 1'000'000;
    }
    ASSERT_TRUE(comes_to_rest());
    EXPECT_EQ(made, 2);
    EXPECT_TRUE(tells("the device was lost"));
    EXPECT_EQ(viewer->state().camera.eye, camera.eye);
    ASSERT_TRUE(viewer->shown() && viewer->shown()->complete);
    EXPECT_EQ(viewer->shown()->colours.rgba, before);
    EXPECT_FALSE(viewer->save_failure());
}

TEST_F(FailedDeviceTest, lost_again_it_is_told_and_not_tried_for_ever)
{
    ASSERT_TRUE(comes_to_rest());
    pictures_left = 0;
    viewer->changed();
    ASSERT_TRUE(comes_to_rest());
    EXPECT_EQ(made, 2);
    EXPECT_TRUE(tells("the device was lost"));
    viewer->save_picture(testing::TempDir() + "none.png", false);
    ASSERT_TRUE(viewer->save_failure());
    EXPECT_EQ(viewer->save_failure()->code, ErrorCode::DeviceFailed);
    viewer->changed(); // as often as it is asked
    ASSERT_TRUE(comes_to_rest());
    EXPECT_EQ(made, 2);
}

TEST_F(FailedDeviceTest, read_again_by_hand_the_file_has_another_chance)
{
    ASSERT_TRUE(comes_to_rest());
    pictures_left = 0;
    viewer->changed();
    ASSERT_TRUE(comes_to_rest());
    ASSERT_EQ(made, 2);
    pictures_left = 1'000'000;
    viewer->act(Action::Reload);
    ASSERT_TRUE(comes_to_rest());
    EXPECT_EQ(made, 3);
    EXPECT_TRUE(viewer->shown() && viewer->shown()->complete);
}

} // namespace
} // namespace trimray
