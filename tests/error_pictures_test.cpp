// Where pictures are worst, and maps of errors, on pictures whose errors are known because they were put there.
#include "runtime/image_io.h"
#include "runtime/measure/error_pictures.h"
#include "tests/closed_forms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace trimray {
namespace {

Picture grey(uint32_t width, uint32_t height)
{
    return {width, height, std::vector<uint8_t>(size_t{4} * width * height, 100)};
}

void paint(Picture& picture, uint32_t x, uint32_t y, uint8_t red)
{
    picture.rgba[4 * (size_t{y} * picture.width + x)] = red;
}

TEST(worst_place, holds_the_most_difference_and_is_the_first_of_equal_ones)
{
    Picture seen = grey(40, 30);
    paint(seen, 3, 4, 110);   // 100
    paint(seen, 30, 20, 107); // 49, and beside it
    paint(seen, 33, 22, 93);  // 49 more, within four pixels
    paint(seen, 39, 29, 108); // 64, in the corner
    const WorstPlace wide = worst_place(seen, grey(40, 30), 10);
    EXPECT_EQ(wide.difference, 49u + 49 + 64);
    EXPECT_EQ(wide.x, 30u);
    EXPECT_EQ(wide.y, 20u);
    const WorstPlace narrow = worst_place(seen, grey(40, 30), 2);
    EXPECT_EQ(narrow.difference, 100u);
    EXPECT_EQ(narrow.x, 2u); // of four places that hold it
    EXPECT_EQ(narrow.y, 3u);
}

TEST(worst_place, is_the_whole_of_a_small_picture)
{
    Picture seen = grey(5, 3);
    paint(seen, 4, 2, 90);
    const WorstPlace place = worst_place(seen, grey(5, 3), 64);
    EXPECT_EQ(place.width, 5u);
    EXPECT_EQ(place.height, 3u);
    EXPECT_EQ(place.difference, 100u);
    EXPECT_EQ(worst_place(grey(5, 3), grey(5, 3), 64).difference, 0u);
}

class error_pictures_of : public testing::Test {
protected:
    static constexpr uint32_t kSide = 80;
    error_pictures_of()
    {
        TracedScene ball;
        add_ball(ball, {0, 0, 0}, 5);
        RenderOptions options;
        options.width = options.height = kSide;
        options.camera = {{0, 0, 40}, {0, 0, 0}, {0, 1, 0}, 20};
        Result<ReferencePicture> made = ReferencePicture::make(ball.finish(), options);
        reference_ = std::make_unique<ReferencePicture>(std::move(*made));
        frame_ = reference_->frame();
    }
    std::array<uint8_t, 4> at(const Picture& picture, size_t i)
    {
        return {picture.rgba[4 * i], picture.rgba[4 * i + 1], picture.rgba[4 * i + 2], picture.rgba[4 * i + 3]};
    }
    std::array<uint8_t, 4> of_step(double depth_px)
    {
        for (const ErrorStep& step : error_steps())
            if (step.depth_px == depth_px)
                return {step.srgb[0], step.srgb[1], step.srgb[2], 255};
        ADD_FAILURE() << "no step at " << depth_px;
        return {};
    }

    std::unique_ptr<ReferencePicture> reference_;
    Frame frame_;
    const size_t middle_ = kSide / 2 * kSide + kSide / 2;
};

TEST_F(error_pictures_of, equal_colours_are_none)
{
    const Result<ErrorPictures> pictures = error_pictures(*reference_, frame_, {});
    ASSERT_TRUE(pictures.ok());
    EXPECT_EQ(pictures->place.difference, 0u);
    EXPECT_TRUE(pictures->map.empty());
}

TEST_F(error_pictures_of, the_map_tells_steps_of_depth_and_wrong_answers)
{
    const double width_mm = reference_->footprint_mm(middle_);
    frame_.depth_mm[middle_] += float(0.03 * width_mm);
    frame_.depth_mm[middle_ + 1] -= float(2 * width_mm);
    frame_.depth_mm[middle_ + 2] = std::numeric_limits<float>::infinity();
    frame_.depth_mm[0] = 40; // the reference misses there
    const Picture map = error_map(*reference_, frame_, kSide);
    EXPECT_EQ(at(map, middle_), of_step(1e-2));
    EXPECT_EQ(at(map, middle_ + 1), of_step(1));
    const std::array<uint8_t, 4> wrong{kWrongAnswer[0], kWrongAnswer[1], kWrongAnswer[2], 255};
    EXPECT_EQ(at(map, middle_ + 2), wrong);
    EXPECT_EQ(at(map, 0), wrong);
    EXPECT_EQ(at(map, middle_ - 1), of_step(0));
    EXPECT_EQ(at(map, kSide - 1)[3], 0) << "both miss";
}

TEST_F(error_pictures_of, a_small_map_keeps_the_worst)
{
    frame_.depth_mm[middle_] += float(0.03 * reference_->footprint_mm(middle_));
    const Picture map = error_map(*reference_, frame_, kSide / 2 - 1); // squares of three
    EXPECT_EQ(map.width, (kSide + 2) / 3);
    EXPECT_EQ(map.height, (kSide + 2) / 3);
    const size_t at_middle = kSide / 2 / 3 * map.width + kSide / 2 / 3;
    EXPECT_EQ(at(map, at_middle), of_step(1e-2));
    EXPECT_EQ(at(map, at_middle - 1), of_step(0));
}

TEST_F(error_pictures_of, the_worst_place_is_cut_out_of_both_pictures)
{
    frame_.rgba[4 * middle_] += 0.5f;
    const Result<ErrorPictures> pictures = error_pictures(*reference_, frame_, {});
    ASSERT_TRUE(pictures.ok());
    const Result<Picture> seen = decode_png(pictures->seen), right = decode_png(pictures->right);
    ASSERT_TRUE(seen.ok() && right.ok());
    EXPECT_EQ(seen->width, 64u);
    size_t differing = 0;
    for (size_t i = 0; i < seen->rgba.size(); ++i)
        differing += seen->rgba[i] != right->rgba[i];
    EXPECT_EQ(differing, 1u);
    EXPECT_EQ(decode_png(pictures->map)->width, kSide) << "no wider than 320 as it is";
    const Result<ErrorPictures> as_tie = error_pictures(*reference_, frame_, {middle_});
    EXPECT_EQ(as_tie->place.difference, 0u) << "a tie has the reference's colour";
}

} // namespace
} // namespace trimray
