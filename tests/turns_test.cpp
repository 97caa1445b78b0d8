// Pictures timed in turns: who is asked when, and which times are kept.
#include "runtime/measure/turns.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace trimray {
namespace {

using testing::ElementsAre;

/// Makes no picture, but notes that it was asked for, and says that it took `ms`.
class NamedTracer final : public Tracer {
public:
    NamedTracer(std::string name, std::vector<double> ms, std::string& asked)
        : name_(std::move(name)), ms_(std::move(ms)), asked_(asked)
    {
    }
    DeviceKind device_kind() const override { return DeviceKind::Cpu; }
    std::string device_name() const override { return name_; }
    Result<Frame> render(const RenderOptions& options, RenderStats& stats) override
    {
        asked_ += name_;
        if (options.frames == 0)
            return Error{ErrorCode::Usage, "frames", "none"};
        stats.frame_ms.assign(options.frames, 1e6);
        stats.frame_cpu_ms.assign(options.frames, ms_[calls_++ % ms_.size()] / options.frames);
        return Frame{};
    }

private:
    std::string name_;
    std::vector<double> ms_;
    std::string& asked_;
    size_t calls_ = 0;
};

struct Contenders {
    std::string asked, first;
    std::vector<Contender> list;

    void add(const std::string& name, std::vector<double> ms)
    {
        list.push_back({"", name, std::make_shared<NamedTracer>(name, std::move(ms), asked), [](RenderOptions&) {}});
    }
    Result<TurnTimes> time(uint32_t rounds, uint32_t frames = 1)
    {
        RenderOptions render;
        render.frames = frames;
        return time_in_turns(
            list, render, rounds,
            [&](size_t i, const Made&) -> Status {
                first += list[i].name;
                return Done{};
            },
            [](const std::string&) {});
    }
};

TEST(turns, every_other_round_goes_backwards_and_each_picture_is_made_twice)
{
    Contenders contenders;
    contenders.add("a", {10, 1, 10, 2, 10, 3}); // the first of each pair is not timed
    contenders.add("b", {20, 4, 20, 5, 20, 6});
    const Result<TurnTimes> times = contenders.time(3);
    ASSERT_TRUE(times.ok());
    EXPECT_EQ(contenders.asked, "aabbbbaaaabb");
    EXPECT_EQ(contenders.first, "ab");
    EXPECT_THAT(*times, ElementsAre(ElementsAre(1, 2, 3), ElementsAre(4, 5, 6)));
}

TEST(turns, a_picture_of_many_frames_takes_what_they_take_together)
{
    Contenders contenders;
    contenders.add("a", {8});
    const Result<TurnTimes> times = contenders.time(1, 4);
    ASSERT_TRUE(times.ok());
    EXPECT_THAT(*times, ElementsAre(ElementsAre(8)));
}

TEST(turns, what_takes_long_is_made_and_timed_once)
{
    Contenders contenders;
    contenders.add("a", {1.5 * kLongPicture_ms});
    contenders.add("b", {2});
    const Result<TurnTimes> times = contenders.time(3);
    ASSERT_TRUE(times.ok());
    EXPECT_EQ(contenders.asked, "abbbbbb");
    EXPECT_THAT(*times, ElementsAre(ElementsAre(1500), ElementsAre(2, 2, 2)));
    EXPECT_THAT(time_ratios((*times)[0], (*times)[1]), ElementsAre(750));
    EXPECT_THAT(time_ratios((*times)[1], (*times)[0]), ElementsAre(2 / 1500.0));
}

TEST(turns, a_failure_names_its_contender)
{
    Contenders contenders;
    contenders.add("a", {1});
    const Result<TurnTimes> times = contenders.time(2, 0);
    ASSERT_FALSE(times.ok());
    EXPECT_EQ(times.error().detail, "a: none");
}

TEST(turns, ratios_are_of_the_same_round)
{
    EXPECT_THAT(time_ratios({1, 4, 9}, {2, 2, 3}), ElementsAre(0.5, 2, 3));
}

} // namespace
} // namespace trimray
