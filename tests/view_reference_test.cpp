// What a view shows in truth, and the mask of a picture's errors: on balls whose errors were put there, and on pictures
// of moved, hidden and cut placements.
#include "runtime/view/view_reference.h"

#include "runtime/view/error_mask.h"
#include "tests/closed_forms.h"
#include "tests/kit_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>

namespace trimray {
namespace {

/// From straight above by parallel rays: a pixel is a millimetre, and pixels' middles are at whole millimetres.
constexpr uint32_t kSide = 61;
RenderOptions from_above()
{
    RenderOptions options;
    options.width = options.height = kSide;
    options.camera = {{0, 0, 100}, {0, 0, 0}, {0, 1, 0}, 35};
    options.camera.orthographic_mm = kSide;
    return options;
}
size_t pixel_at(int x_mm, int y_mm)
{
    constexpr int kMiddle = int(kSide) / 2;
    return size_t((kMiddle - y_mm) * int(kSide) + kMiddle + x_mm);
}

Result<ViewReference> reference_of(const std::shared_ptr<const Scene>& scene, const RenderOptions& options)
{
    return ViewReference::make(scene, options);
}

class balls_from_above : public testing::Test {
protected:
    /// Balls about the origin, a face each; the frame is as the reference has it.
    void show(const std::vector<double>& radii)
    {
        TracedScene balls;
        for (const double radius : radii)
            add_ball(balls, {0, 0, 0}, radius);
        scene_ = balls.finish();
        Result<ViewReference> made = reference_of(scene_, from_above());
        ASSERT_TRUE(made.ok());
        ASSERT_TRUE(made->in_double());
        reference_.emplace(std::move(*made));
        frame_ = draw(scene_, from_above()).frame;
    }
    ViewErrors errors() { return *reference_->errors(frame_); }
    void miss(size_t i)
    {
        frame_.depth_mm[i] = std::numeric_limits<float>::infinity();
        frame_.face[i] = frame_.instance[i] = -1;
    }

    std::shared_ptr<const Scene> scene_;
    std::optional<ViewReference> reference_;
    Frame frame_;
};

TEST_F(balls_from_above, have_no_errors_where_the_picture_is_right)
{
    show({20.3});
    const ViewErrors found = errors();
    EXPECT_EQ(found.pixels, uint64_t{kSide} * kSide);
    EXPECT_EQ(found.wrong + found.other_face, 0u);
    EXPECT_EQ(found.differing_share(), 0);
    EXPECT_LE(found.depth_px.largest, 1e-3);
    EXPECT_LE(found.mean_error_px, 1e-4);
    EXPECT_GT(found.depth_mm.mean, 0) << "single against double";
}

TEST_F(balls_from_above, have_the_errors_that_were_put_there)
{
    show({20.3});
    for (const int x : {-3, 0, 4}) // a millimetre is a pixel
        frame_.depth_mm[pixel_at(x, 0)] += 0.5f;
    frame_.depth_mm[pixel_at(2, 7)] -= 30;
    frame_.face[pixel_at(1, 1)] = 4;
    frame_.instance[pixel_at(1, 2)] = 1;
    miss(pixel_at(-9, 3));
    frame_.depth_mm[pixel_at(28, 28)] = 100; // beside the ball
    frame_.face[pixel_at(28, 28)] = frame_.instance[pixel_at(28, 28)] = 0;
    frame_.certified[pixel_at(5, 5)] = 0;
    const ViewErrors found = errors();
    EXPECT_EQ(found.wrong, 6u);
    EXPECT_EQ(found.other_face, 2u);
    EXPECT_EQ(found.open, 0u);
    EXPECT_EQ(found.uncertified, 1u);
    EXPECT_NEAR(found.depth_mm.largest, 30, 1e-3);
    EXPECT_NEAR(found.depth_px.largest, 30, 1e-3);
    // three half pixels, five that show something else or lie too far off
    EXPECT_NEAR(found.mean_error_px * double(found.pixels), 3 * 0.5 + 5, 0.1);
    EXPECT_NEAR(found.differing_share(), 8.0 / double(found.pixels), 1e-12);
}

TEST_F(balls_from_above, leave_open_what_a_hair_changes_and_which_of_two_at_one_depth_is_seen)
{
    show({20, 20}); // rays at 20 mm touch; two faces at one place
    const size_t touched = pixel_at(20, 0);
    if (std::isfinite(frame_.depth_mm[touched])) {
        miss(touched);
        EXPECT_EQ(errors().wrong, 0u);
    }
    frame_.depth_mm[touched] = 100;
    frame_.face[touched] = frame_.instance[touched] = 0;
    EXPECT_EQ(errors().wrong, 0u);
    const uint64_t open = errors().open;
    frame_.face[pixel_at(0, 0)] = 1 - frame_.face[pixel_at(0, 0)];
    const ViewErrors found = errors();
    EXPECT_EQ(found.other_face, 0u);
    EXPECT_LE(found.open - open, 1u); // one more or less: the frame or the reference may have had the other one
    frame_.face[pixel_at(0, 0)] = 2;  // of no face
    EXPECT_EQ(errors().other_face, 1u);
}

TEST(view_reference, leaves_open_which_face_is_seen_a_hair_from_their_border)
{
    TracedScene sheets; // they meet at the hair beside the middle of the pixel at (0, 0)
    constexpr double kBorder = 0.4 * kHairPx, kFar = 10;
    const double half = 0.5 * (kFar + kBorder), other_half = 0.5 * (kFar - kBorder);
    add_rectangle(sheets, {kBorder - half, 0, 0}, {0, 1, half}, {1, 1, kFar});
    add_rectangle(sheets, {kBorder + other_half, 0, 0}, {0, 1, other_half}, {1, 1, kFar});
    const auto scene = sheets.finish();
    Result<ViewReference> reference = reference_of(scene, from_above());
    ASSERT_TRUE(reference.ok());
    Frame frame = draw(scene, from_above()).frame;
    for (const int x : {0, -3}) {
        for (const int32_t face : {0, 1}) {
            frame.face[pixel_at(x, 0)] = face;
            const ViewErrors found = *reference->errors(frame);
            EXPECT_EQ(found.other_face, x == -3 && face == 1 ? 1u : 0u) << x << ", " << face;
            EXPECT_EQ(found.open, x == 0 && face == 1 ? 1u : 0u) << x << ", " << face;
        }
        frame.face[pixel_at(x, 0)] = 0;
    }
}

TEST(view_reference, knows_what_is_hidden_and_moved_apart)
{
    const auto scene = kit_of({0, 1, 2, 3});
    for (const bool parallel : {false, true}) {
        RenderOptions plain = kit_picture(96, 72);
        plain.camera.orthographic_mm = parallel ? 40 : 0;
        RenderOptions moved = plain;
        moved.look.arrangement.hide = {"lid"};
        moved.look.arrangement.explode = 0.4;
        moved.look.xray = 0.5f; // and what lies on surfaces does not matter
        moved.edges = EdgeLines::Sharp;
        Result<ViewReference> of_moved = reference_of(scene, moved);
        Result<ViewReference> of_plain = reference_of(scene, plain);
        ASSERT_TRUE(of_moved.ok() && of_plain.ok());
        const Frame frame = draw(scene, moved).frame;
        EXPECT_LE(of_moved->errors(frame)->differing_share(), 1e-3) << parallel;
        EXPECT_GE(of_plain->errors(frame)->differing_share(), 0.1) << parallel;
    }
}

TEST(view_reference, of_cut_models_is_the_best_picture)
{
    const auto scene = kit_of({0, 1, 2, 3});
    RenderOptions options = kit_picture(96, 72);
    options.look.section.planes = {{{0, 0, 6}, {0.1, 0, 1}}};
    Result<ViewReference> reference = reference_of(scene, options);
    ASSERT_TRUE(reference.ok());
    EXPECT_FALSE(reference->in_double());
    options.trim = TrimMode::Kd;
    EXPECT_EQ(reference->errors(draw(scene, options).frame)->wrong, 0u);
    options.look.section.planes.clear();
    EXPECT_GT(reference->errors(draw(scene, options).frame)->wrong, 100u);
}

TEST(view_reference, tells_how_far_it_is_and_can_be_given_up)
{
    const auto scene = kit_of({0, 1, 2, 3});
    RenderOptions options = kit_picture(64, 48);
    double last = 0;
    Result<ViewReference> whole = ViewReference::make(scene, options, [&](double share) {
        EXPECT_GT(share, last);
        last = share;
    });
    ASSERT_TRUE(whole.ok());
    EXPECT_EQ(last, 1);
    const Frame frame = draw(scene, options).frame;
    EXPECT_EQ(whole->verdicts(frame, 0.1, [] { return true; }).error().code, ErrorCode::Interrupted);
    for (const bool cut : {false, true})
        for (const int after : {0, 1}) {
            if (cut)
                options.look.section.planes = {{{0, 0, 6}, {0, 0, 1}}};
            std::atomic<int> asked{0};
            options.cancelled = [&] { return asked++ >= after; };
            const Result<ViewReference> made = ViewReference::make(scene, options);
            ASSERT_FALSE(made.ok());
            EXPECT_EQ(made.error().code, ErrorCode::Interrupted);
        }
    options.cancelled = nullptr;
    options.look.section.planes.clear();
    options.look.arrangement.hide = {"@17"};
    EXPECT_EQ(ViewReference::make(scene, options).error().code, ErrorCode::InvalidScene);
}

// ---- the mask ------------------------------------------------------------------------------------------------------

std::array<uint8_t, 4> color_at(const ErrorMask& mask, size_t i)
{
    const uint8_t* c = &mask.overlay.rgba[4 * i];
    return {c[0], c[1], c[2], c[3]};
}

TEST_F(balls_from_above, are_masked_where_they_are_wrong)
{
    show({20.3});
    const auto clear_pixels = [](const ErrorMask& mask) {
        uint64_t count = 0;
        for (size_t i = 3; i < mask.overlay.rgba.size(); i += 4)
            count += mask.overlay.rgba[i] == 0;
        return count;
    };
    Result<ErrorMask> mask = error_mask(*reference_, frame_, 0.02f);
    ASSERT_TRUE(mask.ok());
    EXPECT_EQ(mask->overlay.width, kSide);
    EXPECT_EQ(mask->overlay.height, kSide);
    EXPECT_EQ(clear_pixels(*mask), mask->pixels - mask->uncertified);
    EXPECT_EQ(mask->differing(), 0u);
    const uint64_t uncertified = mask->uncertified;

    miss(pixel_at(3, 4));
    frame_.face[pixel_at(-5, 0)] = 7;
    frame_.depth_mm[pixel_at(0, 6)] += 0.05f; // more than the promise of 0.02, less than that of 0.1
    frame_.certified[pixel_at(1, 1)] = frame_.certified[pixel_at(3, 4)] = 0;
    mask = error_mask(*reference_, frame_, 0.02f);
    EXPECT_EQ(mask->wrong, 2u);
    EXPECT_EQ(mask->other_face, 1u);
    EXPECT_EQ(mask->differing(), 3u);
    EXPECT_EQ(mask->uncertified, uncertified + 2);
    EXPECT_EQ(color_at(*mask, pixel_at(3, 4)), mask_colors()[0].srgb);
    EXPECT_EQ(color_at(*mask, pixel_at(0, 6)), mask_colors()[0].srgb);
    EXPECT_EQ(color_at(*mask, pixel_at(-5, 0)), mask_colors()[1].srgb);
    EXPECT_EQ(color_at(*mask, pixel_at(1, 1)), mask_colors()[3].srgb);
    EXPECT_EQ(clear_pixels(*mask), mask->pixels - uncertified - 4);
    mask = error_mask(*reference_, frame_, 0.1f);
    EXPECT_EQ(mask->wrong, 1u);
    EXPECT_EQ(color_at(*mask, pixel_at(0, 6))[3], 0);
    EXPECT_EQ(error_mask(*reference_, frame_, 1e-6f)->depth_px, kLeastDepthPx);
    EXPECT_FALSE(error_mask(*reference_, frame_, 0.02f, [] { return true; }).ok());
}

TEST(error_mask, of_stochastic_pictures_says_that_nothing_is_certified)
{
    const auto scene = kit_of({0, 1, 2, 3});
    RenderOptions options = kit_picture(64, 48);
    Result<ViewReference> reference = reference_of(scene, options);
    ASSERT_TRUE(reference.ok());
    options.closest = ClosestPolicy::Stochastic;
    const Result<ErrorMask> mask = error_mask(*reference, draw(scene, options).frame, options.error_px);
    EXPECT_EQ(mask->uncertified, mask->pixels);
    EXPECT_EQ(color_at(*mask, 0), mask_colors()[3].srgb) << "a corner of the background";
}

} // namespace
} // namespace trimray
