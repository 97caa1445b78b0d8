// How far pictures are from the reference's, on pictures whose errors are known because they were put there.
#include "runtime/measure/picture_errors.h"
#include "runtime/measure/ssim.h"
#include "tests/closed_forms.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace trimray {
namespace {

Picture plain(uint32_t width, uint32_t height, uint8_t grey)
{
    Picture picture{width, height, std::vector<uint8_t>(size_t{4} * width * height, grey)};
    for (size_t i = 3; i < picture.rgba.size(); i += 4)
        picture.rgba[i] = 255;
    return picture;
}

TEST(ssim, is_one_of_equal_pictures_and_the_luminance_term_of_plain_ones)
{
    const Picture a = plain(20, 7, 100), b = plain(20, 7, 130);
    EXPECT_NEAR(ssim(a, a), 1, 1e-12);
    constexpr double kC1 = 0.01 * 255 * 0.01 * 255;
    EXPECT_NEAR(ssim(a, b), (2 * 100 * 130 + kC1) / (100 * 100 + 130 * 130 + kC1), 1e-9);
}

TEST(ssim, falls_where_structure_is_lost)
{
    Picture stripes = plain(64, 64, 50);
    for (size_t i = 0; i < stripes.rgba.size(); ++i)
        if (i % 4 != 3 && i / 4 % 8 < 4)
            stripes.rgba[i] = 200;
    EXPECT_LT(ssim(stripes, plain(64, 64, 125)), 0.05);
    Picture faint = stripes;
    for (size_t i = 0; i < faint.rgba.size(); ++i)
        faint.rgba[i] = uint8_t(faint.rgba[i] + (i % 4 != 3 && i / 4 % 2 == 0));
    EXPECT_GT(ssim(stripes, faint), 0.99);
    EXPECT_LT(ssim(stripes, faint), 1);
}

TEST(spread, has_the_nearest_rank)
{
    std::vector<double> values(200);
    std::iota(values.rbegin(), values.rend(), 1.0); // 200 down to 1
    const Spread found = spread(values);
    EXPECT_EQ(found.mean, 100.5);
    EXPECT_EQ(found.at_99, 198);
    EXPECT_EQ(found.largest, 200);
    EXPECT_EQ(spread({}).largest, 0);
}

class picture_errors_of : public testing::Test {
protected:
    static constexpr uint32_t kSide = 60;
    picture_errors_of()
    {
        options_.width = options_.height = kSide;
        options_.camera = {{0, 0, 40}, {0, 0, 0}, {0, 1, 0}, 20};
        middle_ = kSide / 2 * kSide + kSide / 2;
        show({5});
    }
    /// Balls about the origin, a face each.
    void show(const std::vector<double>& radii)
    {
        TracedScene balls;
        for (const double radius : radii)
            add_ball(balls, {0, 0, 0}, radius);
        Result<ReferencePicture> made = ReferencePicture::make(balls.finish(), options_);
        reference_ = std::make_unique<ReferencePicture>(std::move(*made));
        frame_ = reference_->frame();
    }
    /// The pixel shows another face, red and turned away, at the same depth.
    void repaint(size_t i, int32_t face)
    {
        frame_.face[i] = face;
        frame_.rgba[4 * i] += 0.5f;
        for (size_t k = 0; k < 3; ++k)
            frame_.normal[3 * i + k] *= -1;
    }
    PictureErrors errors() { return picture_errors(*reference_, frame_); }
    void miss(size_t i)
    {
        frame_.depth_mm[i] = std::numeric_limits<float>::infinity();
        frame_.face[i] = -1;
    }

    RenderOptions options_;
    std::unique_ptr<ReferencePicture> reference_;
    Frame frame_;
    size_t middle_;
};

TEST_F(picture_errors_of, the_reference_itself_are_none)
{
    const PictureErrors found = errors();
    EXPECT_TRUE(std::isinf(found.answers.psnr_db));
    EXPECT_EQ(found.answers.wrong() + found.answers.tangent, 0u);
    EXPECT_NEAR(found.ssim, 1, 1e-12);
    EXPECT_GT(found.both_hit, 1000u);
    for (const Spread* zero : {&found.depth_mm, &found.depth_px, &found.outline_px})
        EXPECT_EQ(zero->largest, 0);
    EXPECT_LT(found.normal_deg.largest, 1e-9);
    EXPECT_EQ(found.leaks, 0u);
}

TEST_F(picture_errors_of, which_of_two_faces_in_one_place_is_seen_is_open)
{
    show({5, 5});
    repaint(middle_, 1);
    const PictureErrors found = errors();
    EXPECT_EQ(found.answers.ties, std::vector<size_t>{middle_});
    EXPECT_TRUE(std::isinf(found.answers.psnr_db));
    EXPECT_NEAR(found.ssim, 1, 1e-12);
    EXPECT_LT(found.normal_deg.largest, 1e-9);
}

TEST_F(picture_errors_of, a_face_that_lies_behind_the_other_is_no_tie)
{
    const double pixel_mm = 35 * 2 * std::tan(10 * kPi / 180) / kSide;
    show({5, 5 - 0.01 * pixel_mm}); // ten times as far as a hair
    repaint(middle_, 1);
    repaint(middle_ + 1, 7); // there is no such face
    const PictureErrors found = errors();
    EXPECT_TRUE(found.answers.ties.empty());
    EXPECT_LT(found.answers.psnr_db, 60);
    EXPECT_NEAR(found.normal_deg.largest, 180, 1e-6);
}

TEST_F(picture_errors_of, depths_are_distances_and_widths_of_a_pixel)
{
    // 35 mm away, of 60 pixels over 20 degrees
    const double pixel_mm = 35 * 2 * std::tan(10 * kPi / 180) / kSide;
    frame_.depth_mm[middle_] += float(3 * pixel_mm);
    const PictureErrors found = errors();
    EXPECT_NEAR(found.depth_mm.largest, 3 * pixel_mm, 1e-4);
    EXPECT_NEAR(found.depth_px.largest, 3, 1e-2);
    EXPECT_NEAR(found.depth_px.mean, 3 / double(found.both_hit), 1e-4);
    EXPECT_EQ(found.answers.wrong_depth, 1u);
}

TEST_F(picture_errors_of, normals_are_angles)
{
    for (size_t i = 0; i < frame_.depth_mm.size(); ++i) {
        float* n = &frame_.normal[3 * i];
        const float cosine = float(std::cos(0.02)), sine = float(std::sin(0.02));
        const std::array<float, 2> turned{cosine * n[0] - sine * n[1], sine * n[0] + cosine * n[1]};
        std::copy(turned.begin(), turned.end(), n); // about z
    }
    const PictureErrors found = errors();
    EXPECT_LE(found.normal_deg.largest, 0.02 * 180 / kPi + 1e-5);
    EXPECT_GT(found.normal_deg.largest, 0.9 * 0.02 * 180 / kPi) << "at the rim the axis is at a right angle";
    EXPECT_LT(found.normal_deg.mean, found.normal_deg.at_99);
}

TEST_F(picture_errors_of, a_hole_is_a_leak_and_its_distance_goes_to_the_outline)
{
    miss(middle_);
    const PictureErrors found = errors();
    EXPECT_EQ(found.answers.missing, 1u);
    EXPECT_EQ(found.leaks, 1u);
    EXPECT_EQ(found.wrong_per_million(), 1e6 / (kSide * kSide));
    // to the middle of the nearest pixel beyond the ball's outline, within half a pixel's diagonal; from one that lies
    // half a pixel's diagonal from the picture's middle
    const double radius_px = std::tan(std::asin(5.0 / 40)) / std::tan(10 * kPi / 180) * kSide / 2;
    EXPECT_NEAR(found.outline_px.largest, radius_px - std::sqrt(0.5), std::sqrt(0.5));
}

TEST_F(picture_errors_of, a_picture_moved_by_a_pixel_has_its_outline_half_to_one_pixel_off)
{
    const Frame right = frame_;
    for (uint32_t y = 0; y < kSide; ++y)
        for (uint32_t x = 1; x < kSide; ++x)
            frame_.depth_mm[y * kSide + x] = right.depth_mm[y * kSide + x - 1];
    const PictureErrors found = errors();
    EXPECT_GT(found.answers.missing + found.answers.extra + found.answers.tangent, 40u);
    EXPECT_EQ(found.leaks, 0u);
    EXPECT_GE(found.outline_px.mean, 0.5);
    EXPECT_LE(found.outline_px.largest, std::sqrt(2) - 0.5 + 1e-9);
}

} // namespace
} // namespace trimray
