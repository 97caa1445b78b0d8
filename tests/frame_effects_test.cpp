// Lines, silhouettes and anti-aliased borders, measured as ink: with faces unfilled and lines opaque a picture's alpha
// is what its lines cover, and the sum over a line is its width times its length.
#include "runtime/frame_effects.h"
#include "runtime/image_io.h"
#include "tests/compare_frames.h"
#include "tests/traced_scenes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace trimray {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRadians = kPi / 180;

/// From far above, nearly parallel rays, 0.1 mm a pixel.
RenderOptions plan_view(uint32_t size = 240)
{
    RenderOptions options;
    options.width = options.height = size;
    constexpr double kDistance = 10000;
    options.camera.eye = {0, 0, kDistance};
    options.camera.up = {0, 1, 0};
    options.camera.fov_deg = 2 * std::atan(0.05 * size / kDistance) / kRadians;
    options.threads = 2;
    return options;
}
constexpr double kPixelsPerMm = 10;

RenderOptions lines_only(RenderOptions options, EdgeLines edges = EdgeLines::Sharp)
{
    options.edges = edges;
    options.fill = false;
    return options;
}

double ink(const Frame& frame)
{
    double sum = 0;
    for (size_t i = 3; i < frame.rgba.size(); i += 4)
        sum += double(frame.rgba[i]);
    return sum;
}

/// A turn about y by `slant`, and about z so that no line runs along the pixels.
std::array<double, 12> slanted(double slant_deg, double turn_deg)
{
    const double c = std::cos(slant_deg * kRadians), s = std::sin(slant_deg * kRadians);
    const double a = std::cos(turn_deg * kRadians), b = std::sin(turn_deg * kRadians);
    return {a * c, -b, a * s, 0, b * c, a, b * s, 0, -s, 0, c, 0};
}

/// Perimeter of an ellipse. Source: Ramanujan 1914, second approximation; right to 1e-5 at these ratios.
double ellipse(double a, double b)
{
    const double h = (a - b) * (a - b) / ((a + b) * (a + b));
    return kPi * (a + b) * (1 + 3 * h / (10 + std::sqrt(4 - 3 * h)));
}

TEST(frame_effects, a_straight_outline_is_as_wide_at_every_slant)
{
    for (const double width : {1.0, 1.5, 3.0}) {
        for (const double slant : {0.0, 30.0, 60.0, 75.0, 85.0}) {
            TracedScene model;
            model.with_textures = false;
            model.add(kKindPlane, 1, {0, 0, 0}, {0.6, 0.8}); // 12 x 16 mm, its natural border
            model.place(slanted(slant, 17));
            RenderOptions options = lines_only(plan_view());
            options.edge_width_px = float(width);
            const Drawn drawn = draw(model.finish(), options);
            const double across = 12 * std::cos(slant * kRadians), length = 2 * (across + 16) * kPixelsPerMm;
            EXPECT_NEAR(ink(drawn.frame) / length, width, 0.04 * width) << "width " << width << " slant " << slant;
        }
    }
}

TEST(frame_effects, a_curved_trim_is_as_wide_at_every_slant)
{
    for (const double slant : {0.0, 30.0, 60.0, 75.0, 85.0}) {
        TracedScene model;
        model.with_textures = false;
        model.add(kKindPlane, 1, {0, 0, 0}, {0.9, 0.9});
        model.trim(0, {shapes::circle(0.5, 0.5, 0.5, 0.5)}); // 9 mm
        model.place(slanted(slant, 17));
        const RenderOptions options = lines_only(plan_view());
        const Drawn drawn = draw(model.finish(), options);
        const double length = ellipse(9, 9 * std::cos(slant * kRadians)) * kPixelsPerMm;
        EXPECT_NEAR(ink(drawn.frame) / length, double(options.edge_width_px), 0.06) << slant;
    }
}

TEST(frame_effects, the_border_of_a_texture_is_as_wide_at_every_slant)
{
    for (const double slant : {0.0, 30.0, 60.0, 75.0, 85.0}) {
        TracedScene model;
        model.add(kKindPlane, 1, {0, 0, 0}, {0.9, 0.9});
        model.trim(0,
                   {shapes::polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}}), shapes::circle(0.5, 0.5, 0.3, 0.3)}); // 5.4 mm
        for (uint i = 0; i < 4; ++i)
            model.image.trim_pieces[i] |= kEdgeSeam << kPieceClassShift; // the hole's alone is an edge
        model.place(slanted(slant, 17));
        RenderOptions options = lines_only(plan_view());
        options.trim = TrimMode::Sdf;
        const Drawn drawn = draw(model.finish(), options);
        EXPECT_EQ(drawn.stats.trim, TrimMode::Sdf);
        const double length = ellipse(5.4, 5.4 * std::cos(slant * kRadians)) * kPixelsPerMm;
        EXPECT_NEAR(ink(drawn.frame) / length, double(options.edge_width_px), 0.09) << slant;
    }
}

TEST(frame_effects, each_face_draws_its_half_of_a_crease)
{
    TracedScene model; // a ridge along y at x = 0
    model.with_textures = false;
    for (const double side : {-1.0, 1.0}) {
        const double c = std::cos(0.5), s = std::sin(0.5);
        PatchRecord& patch = model.add(kKindPlane, 1, {side * 0.6 * c, 0, -0.6 * s}, {0.6, 0.8});
        patch.axis_x[0] = float(c);
        patch.axis_x[2] = float(-side * s);
        patch.axis_z[0] = float(side * s);
        patch.axis_z[2] = float(c);
        // only the ridge is an edge
        const uint ridge = side < 0 ? 1 : 0;
        model.image.faces.back().border_classes = (0xaau & ~(3u << 2 * ridge)) | kEdgeSharp << 2 * ridge;
    }
    model.place(slanted(0, 17));
    const auto scene = model.finish();
    const double length = 16 * kPixelsPerMm;
    EXPECT_NEAR(ink(draw(scene, lines_only(plan_view())).frame) / length, 1.5, 0.04);
}

TEST(frame_effects, a_line_round_a_cylinder_keeps_its_width_up_to_the_rim)
{
    TracedScene model;
    model.with_textures = false;
    model.add(kKindCylinder, 0.5, {0, 0, 0}, {kPi, 1}); // radius 5 mm, 10 mm long, all round
    FaceRecord& face = model.image.faces.back();
    face.border_classes = kEdgeSeam | kEdgeSeam << 2; // u = 0 and 1 meet; the ends are edges
    model.place(slanted(60, 17));
    const Drawn drawn = draw(model.finish(), lines_only(plan_view()));
    // the axis leans away from the eye: of the nearer end all is seen, of the farther end half, and through the tube
    // nothing of its other half, which the near wall hides
    const double length = 1.5 * ellipse(5, 5 * std::cos(60 * kRadians)) * kPixelsPerMm;
    EXPECT_NEAR(ink(drawn.frame) / length, 1.5, 0.12);
}

TEST(frame_effects, a_silhouette_is_as_wide_as_other_lines)
{
    TracedScene model;
    model.add(kKindSphere, 0.8, {0, 0, 0}, {kPi, kPi / 2});
    model.image.faces.back().border_classes = 0xaa; // seam and poles
    const auto scene = model.finish();
    RenderOptions options = lines_only(plan_view());
    EXPECT_EQ(ink(draw(scene, options).frame), 0) << "a sphere has no edges";
    options.silhouettes = true;
    for (const float width : {1.0f, 1.5f, 3.0f}) {
        options.edge_width_px = width;
        const double length = 2 * kPi * 8 * kPixelsPerMm;
        EXPECT_NEAR(ink(draw(scene, options).frame) / length, double(width), 0.06 * double(width));
    }
}

TEST(frame_effects, lines_are_of_the_classes_asked_for)
{
    // a square of 10 mm with a side of each class, as trims and as a natural border
    for (const bool natural : {false, true}) {
        TracedScene model;
        model.with_textures = false;
        model.add(kKindPlane, 1, {0, 0, 0}, {0.5, 0.5});
        if (natural) {
            model.image.faces[0].border_classes = kEdgeSharp | kEdgeSmooth << 2 | kEdgeSeam << 4 | kEdgeFree << 6;
        } else {
            model.trim(0, {shapes::polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}})});
            for (uint i = 0; i < 4; ++i)
                model.image.trim_pieces[i] |= i << kPieceClassShift;
        }
        model.place(slanted(0, 17));
        const auto scene = model.finish();
        const double side = 10 * kPixelsPerMm * 1.5;
        EXPECT_EQ(ink(draw(scene, lines_only(plan_view(), EdgeLines::None)).frame), 0);
        EXPECT_NEAR(ink(draw(scene, lines_only(plan_view(), EdgeLines::Sharp)).frame) / side, 2, 0.06) << natural;
        EXPECT_NEAR(ink(draw(scene, lines_only(plan_view(), EdgeLines::All)).frame) / side, 3, 0.06) << natural;
    }
}

TEST(frame_effects, change_colours_alone_and_cost_nothing_unasked)
{
    const auto scene = all_kinds().finish();
    RenderOptions options = overview(157, 93);
    const Drawn plain = draw(scene, options);
    EXPECT_EQ(plain.stats.work.edge_tests, 0u);
    options.edges = EdgeLines::All;
    options.silhouettes = true;
    options.antialias_trims = true;
    const Drawn drawn = draw(scene, options);
    EXPECT_FALSE(same_bits(plain.frame.rgba, drawn.frame.rgba));
    EXPECT_TRUE(same_bits(plain.frame.depth_mm, drawn.frame.depth_mm));
    EXPECT_TRUE(same_bits(plain.frame.normal, drawn.frame.normal));
    EXPECT_TRUE(same_bits(plain.frame.uv, drawn.frame.uv));
    EXPECT_TRUE(same_bits(plain.frame.face, drawn.frame.face));
    EXPECT_TRUE(same_bits(plain.frame.instance, drawn.frame.instance));
    EXPECT_TRUE(same_bits(plain.frame.certified, drawn.frame.certified));
    const WorkCounts &a = plain.stats.work, &b = drawn.stats.work;
    EXPECT_EQ(a.leaf_visits, b.leaf_visits);
    EXPECT_EQ(a.newton_steps, b.newton_steps);
    EXPECT_EQ(a.curve_tests, b.curve_tests);
    EXPECT_GT(b.edge_tests, 0u);
    EXPECT_LT(b.edge_tests, 2 * b.rays) << "pieces far from a pixel are not measured";
    options.shade = false;
    EXPECT_EQ(draw(scene, options).stats.work.edge_tests, 0u) << "without colours there is nothing to draw";
}

TEST(frame_effects, lines_are_the_same_bits_in_every_mode_that_asks_the_pieces)
{
    const auto scene = all_kinds().finish();
    RenderOptions options = overview(157, 93);
    for (const EdgeLines edges : {EdgeLines::Sharp, EdgeLines::All})
        for (const bool fill : {true, false}) {
            options.edges = edges;
            options.fill = fill;
            options.trim = TrimMode::Exact;
            const Drawn exact = draw(scene, options);
            EXPECT_GT(exact.stats.work.edge_tests, 0u);
            for (const TrimMode mode : {TrimMode::Kd, TrimMode::Hybrid, TrimMode::Reference}) {
                options.trim = mode;
                const Drawn drawn = draw(scene, options);
                EXPECT_EQ(drawn.stats.trim, mode);
                EXPECT_EQ(drawn.stats.work.edge_tests, exact.stats.work.edge_tests) << int(mode);
                EXPECT_TRUE(same_bits(drawn.frame.rgba, exact.frame.rgba)) << int(mode);
            }
            options.trim = TrimMode::Sdf; // its borders are the textures'
            EXPECT_FALSE(same_bits(draw(scene, options).frame.rgba, exact.frame.rgba));
        }
}

TEST(frame_effects, give_the_same_bits_on_every_instruction_set_and_any_number_of_threads)
{
    const auto scene = all_kinds().finish();
    RenderOptions options = overview(301, 203);
    options.edges = EdgeLines::All;
    for (const bool with_borders : {true, false}) { // drawn over the frame, or block by block
        options.silhouettes = options.antialias_trims = with_borders;
        options.threads = 1;
        const Drawn first = draw(scene, options);
        options.threads = 4;
        EXPECT_TRUE(same_bits(first.frame.rgba, draw(scene, options).frame.rgba));
        for (const char* set : {"avx512", "avx2", "sse4"})
            if (make_cpu_tracer(scene, set).ok()) {
                EXPECT_TRUE(same_bits(first.frame.rgba, draw(scene, options, set).frame.rgba)) << set;
            }
    }
}

TEST(frame_effects, lines_drawn_while_a_block_is_traced_are_those_drawn_over_the_frame)
{
    const auto scene = all_kinds().finish();
    RenderOptions options = overview(301, 203);
    const Drawn plain = draw(scene, options);
    options.edge_color = {0, 0, 0};
    for (const float width : {0.5f, 1.5f, 9.0f, kLargestEdgeWidthPx}) {
        options.edge_width_px = width;
        options.edges = EdgeLines::All;
        options.fill = true; // block by block
        const Drawn filled = draw(scene, options);
        const Drawn lines = draw(scene, lines_only(options, EdgeLines::All));
        double worst = 0, covered = 0;
        for (size_t i = 0; i < plain.frame.rgba.size(); ++i) {
            const float share = lines.frame.rgba[i / 4 * 4 + 3], below = plain.frame.rgba[i];
            const float expected = i % 4 < 3 ? (1 - share) * below : below + (1 - below) * share;
            worst = std::max(worst, double(std::abs(filled.frame.rgba[i] - expected)));
            covered += double(share);
        }
        // a line is taken off a pixel again before a stronger one is drawn: rounding of 1 / (1 - share)
        EXPECT_LT(worst, 1e-3) << width;
        EXPECT_GT(covered, 1000) << width;
    }
}

TEST(frame_effects, far_away_a_face_is_never_more_than_half_lines)
{
    TracedScene model; // strips of 1 mm side by side
    model.with_textures = false;
    for (int i = -8; i < 8; ++i)
        model.add(kKindPlane, 1, {0.1 * i + 0.05, 0, 0}, {0.05, 0.8});
    model.place(slanted(0, 17));
    const auto scene = model.finish();
    RenderOptions options = plan_view(64);
    for (const double pixels_per_mm : {4.0, 2.0, 1.0, 0.5}) {
        options.camera.fov_deg = 2 * std::atan(32 / pixels_per_mm / 10000) / kRadians;
        const double area = 16 * 16 * pixels_per_mm * pixels_per_mm;
        const double share = ink(draw(scene, lines_only(options)).frame) / area;
        EXPECT_LT(share, 0.62) << pixels_per_mm; // an outline's outer half lies beside the faces
    }
}

double psnr(const Frame& frame, const Frame& reference)
{
    double sum = 0;
    for (size_t i = 0; i < frame.rgba.size(); i += 4)
        for (size_t c = 0; c < 3; ++c) {
            // over black, linear light
            const double d = double(frame.rgba[i + c]) * double(frame.rgba[i + 3]) -
                             double(reference.rgba[i + c]) * double(reference.rgba[i + 3]);
            sum += d * d;
        }
    return -10 * std::log10(sum / (double(frame.rgba.size()) * 0.75));
}

TEST(frame_effects, antialiasing_comes_near_to_64_samples_a_pixel)
{
    const auto scene = all_kinds().finish();
    RenderOptions options = overview(200, 150);
    const Frame plain = draw(scene, options).frame;
    RenderOptions many = options;
    many.width *= 8;
    many.height *= 8;
    const Frame reference = average_samples(draw(scene, many).frame, 8);
    options.antialias_trims = true;
    const Frame smooth = draw(scene, options).frame;
    const double before = psnr(plain, reference), after = psnr(smooth, reference);
    RecordProperty("before_db", std::to_string(before));
    RecordProperty("after_db", std::to_string(after));
    EXPECT_GT(after, before + 4) << before << " dB without";
}

TEST(frame_effects, refuses_widths_that_are_none)
{
    const auto tracer = make_cpu_tracer(all_kinds().finish());
    ASSERT_TRUE(tracer.ok());
    RenderOptions options;
    options.edges = EdgeLines::Sharp;
    for (const float width : {0.0f, -1.0f, kLargestEdgeWidthPx + 1, std::nanf("")}) {
        options.edge_width_px = width;
        RenderStats stats;
        const Result<Frame> frame = (*tracer)->render(options, stats);
        ASSERT_FALSE(frame.ok());
        EXPECT_EQ(frame.error().code, ErrorCode::Usage);
    }
}

} // namespace
} // namespace trimray
