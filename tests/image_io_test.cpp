// Pictures out and in again, read by OpenImageIO itself, not by the code that wrote them.
#include "runtime/image_io.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>

namespace trimray {
namespace {
namespace fs = std::filesystem;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A frame whose every value differs from its neighbours'; every third pixel is a miss.
Frame sample_frame(uint32_t width, uint32_t height)
{
    Frame frame;
    frame.width = width;
    frame.height = height;
    for (uint32_t i = 0; i < width * height; ++i) {
        const bool miss = i % 3 == 2;
        const float f = static_cast<float>(i) / static_cast<float>(width * height);
        for (const float value : {f, 1 - f, f * f, miss ? 0.0f : 1.0f})
            frame.rgba.push_back(value);
        frame.depth_mm.push_back(miss ? kInfinity : 1000 + f);
        for (const float value : {0.6f, -0.8f * f, 0.1f + f})
            frame.normal.push_back(miss ? 0 : value);
        for (const float value : {f * 1e3f, -f})
            frame.uv.push_back(miss ? 0 : value);
        frame.face.push_back(miss ? -1 : static_cast<int32_t>(i * 1000));
        frame.instance.push_back(miss ? -1 : 0);
        frame.certified.push_back(i % 2);
    }
    return frame;
}

class ImageIo : public testing::Test {
protected:
    void SetUp() override
    {
        std::string name = (fs::temp_directory_path() / "trimray-image-XXXXXX").string();
        ASSERT_NE(mkdtemp(name.data()), nullptr);
        folder_ = name;
    }
    void TearDown() override { fs::remove_all(folder_); }
    std::string path(const char* name) const { return (folder_ / name).string(); }
    static std::string bytes(const std::string& path)
    {
        std::ifstream file(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    fs::path folder_;
};

TEST_F(ImageIo, exr_holds_every_aov_as_it_was)
{
    const Frame frame = sample_frame(7, 5);
    ASSERT_TRUE(write_image(path("a.exr"), frame).ok());
    const auto in = OIIO::ImageInput::open(path("a.exr"));
    ASSERT_TRUE(in) << OIIO::geterror();
    const OIIO::ImageSpec& spec = in->spec();
    EXPECT_THAT(spec.channelnames, testing::UnorderedElementsAre("R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "U", "V",
                                                                 "face", "certified"));
    EXPECT_EQ(spec.format, OIIO::TypeDesc::FLOAT);
    EXPECT_TRUE(spec.channelformats.empty()) << "every channel has the same type";
    EXPECT_EQ(spec.get_string_attribute("compression"), "zip");
    EXPECT_EQ(spec.get_string_attribute("DateTime"), "") << "the time of writing is not in the bytes";
    ASSERT_EQ(spec.width, 7);
    ASSERT_EQ(spec.height, 5);
    std::vector<float> pixels(7 * 5 * 12);
    ASSERT_TRUE(in->read_image(0, 0, 0, 12, OIIO::TypeDesc::FLOAT, pixels.data()));
    const auto at = [&](size_t pixel, const char* channel) {
        return pixels[pixel * 12 + static_cast<size_t>(spec.channelindex(channel))];
    };
    for (size_t i = 0; i < 35; ++i) {
        EXPECT_EQ(at(i, "R"), frame.rgba[4 * i]);
        EXPECT_EQ(at(i, "G"), frame.rgba[4 * i + 1]);
        EXPECT_EQ(at(i, "B"), frame.rgba[4 * i + 2]);
        EXPECT_EQ(at(i, "A"), frame.rgba[4 * i + 3]);
        EXPECT_EQ(at(i, "Z"), frame.depth_mm[i]) << "+inf for a miss survives";
        EXPECT_EQ(at(i, "N.X"), frame.normal[3 * i]);
        EXPECT_EQ(at(i, "N.Y"), frame.normal[3 * i + 1]);
        EXPECT_EQ(at(i, "N.Z"), frame.normal[3 * i + 2]);
        EXPECT_EQ(at(i, "U"), frame.uv[2 * i]);
        EXPECT_EQ(at(i, "V"), frame.uv[2 * i + 1]);
        EXPECT_EQ(at(i, "face"), static_cast<float>(frame.face[i]));
        EXPECT_EQ(at(i, "certified"), static_cast<float>(frame.certified[i]));
    }
}

TEST_F(ImageIo, exr_holds_what_a_map_measured_and_only_then)
{
    Frame frame = sample_frame(7, 5);
    for (uint32_t i = 0; i < 35; ++i)
        frame.map_value.push_back(frame.face[i] < 0 ? 0.0f : 0.125f * static_cast<float>(i) - 2);
    ASSERT_TRUE(write_image(path("map.exr"), frame).ok());
    const auto in = OIIO::ImageInput::open(path("map.exr"));
    ASSERT_TRUE(in) << OIIO::geterror();
    EXPECT_THAT(in->spec().channelnames, testing::UnorderedElementsAre("R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z",
                                                                       "U", "V", "face", "certified", "map"));
    std::vector<float> pixels(7 * 5 * 13);
    ASSERT_TRUE(in->read_image(0, 0, 0, 13, OIIO::TypeDesc::FLOAT, pixels.data()));
    const size_t map = static_cast<size_t>(in->spec().channelindex("map"));
    const size_t red = static_cast<size_t>(in->spec().channelindex("R"));
    for (size_t i = 0; i < 35; ++i) {
        EXPECT_EQ(pixels[13 * i + map], frame.map_value[i]);
        EXPECT_EQ(pixels[13 * i + red], frame.rgba[4 * i]);
    }
}

TEST_F(ImageIo, png_is_srgb_with_straight_alpha)
{
    Frame frame;
    frame.width = 4;
    frame.height = 1;
    // linear 0.5 is sRGB 187.5 -> 188, 0.0031308 is 10.3 -> 10, 0.2 is 123.6 -> 124; alpha is linear
    frame.rgba = {0.5f, 0.0031308f, 0.2f, 0.5f, 0, 0, 0, 0, 2, -1, NAN, 1, 1, 1, 1, 0.25f};
    ASSERT_TRUE(write_image(path("a.PNG"), frame).ok());
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    const auto in = OIIO::ImageInput::open(path("a.PNG"), &config);
    ASSERT_TRUE(in) << OIIO::geterror();
    ASSERT_EQ(in->spec().nchannels, 4);
    std::vector<uint8_t> rgba(16);
    ASSERT_TRUE(in->read_image(0, 0, 0, 4, OIIO::TypeDesc::UINT8, rgba.data()));
    EXPECT_EQ(rgba, (std::vector<uint8_t>{188, 10, 124, 128, 0, 0, 0, 0, 255, 0, 0, 255, 255, 255, 255, 64}));
}

TEST_F(ImageIo, same_frame_gives_same_bytes_without_place_or_date)
{
    const Frame frame = sample_frame(33, 17);
    for (const char* name : {"a.png", "a.exr"}) {
        ASSERT_TRUE(write_image(path(name), frame).ok());
        const std::string first = bytes(path(name));
        ASSERT_TRUE(write_image(path(name), frame).ok());
        EXPECT_EQ(first, bytes(path(name)));
        for (const char* word : {"OpenImageIO", "DateTime", "tIME", "Software", "HostComputer"})
            EXPECT_EQ(first.find(word), std::string::npos) << name << " says " << word;
    }
}

TEST_F(ImageIo, decode_png_returns_what_encode_png_took)
{
    const Picture picture = to_picture(sample_frame(16, 9));
    const auto bytes = encode_png(picture);
    ASSERT_TRUE(bytes.ok());
    const auto again = decode_png(*bytes);
    ASSERT_TRUE(again.ok()) << again.error().detail;
    EXPECT_EQ(again->width, 16u);
    EXPECT_EQ(again->height, 9u);
    EXPECT_EQ(again->rgba, picture.rgba);
}

TEST_F(ImageIo, decode_png_refuses_what_is_cut_or_no_png)
{
    const auto bytes = encode_png(to_picture(sample_frame(16, 9)));
    ASSERT_TRUE(bytes.ok());
    const std::span<const std::byte> all(*bytes);
    for (const size_t size : {size_t{0}, size_t{4}, size_t{20}, all.size() / 2})
        EXPECT_FALSE(decode_png(all.first(size)).ok()) << size << " bytes";
    const std::string text = "this is not a picture, it is a line of text";
    EXPECT_FALSE(decode_png(std::as_bytes(std::span(text))).ok());
}

TEST_F(ImageIo, refuses_other_endings_and_folders_that_are_not_there)
{
    const Frame frame = sample_frame(2, 2);
    const Status jpeg = write_image(path("a.jpg"), frame);
    ASSERT_FALSE(jpeg.ok());
    EXPECT_EQ(jpeg.error().code, ErrorCode::UnsupportedFormat);
    EXPECT_FALSE(fs::exists(path("a.jpg")));
    const Status nowhere = write_image(path("no/such/folder/a.png"), frame);
    ASSERT_FALSE(nowhere.ok());
    EXPECT_EQ(exit_code(nowhere.error()), kExitIo);
}

/// Written by OpenImageIO: 3 x 2 pixels of so many channels, counted up from `first` in steps of 1/4.
void write_picture(const std::string& path, int channels, float first)
{
    const OIIO::ImageSpec spec(3, 2, channels, OIIO::TypeDesc::FLOAT);
    std::vector<float> pixels;
    for (int i = 0; i < 6 * channels; ++i)
        pixels.push_back(first + 0.25f * float(i));
    const auto out = OIIO::ImageOutput::create(path);
    ASSERT_TRUE(out && out->open(path, spec) && out->write_image(OIIO::TypeDesc::FLOAT, pixels.data()) && out->close());
}

TEST_F(ImageIo, pictures_all_around_are_read_as_linear_light)
{
    write_picture(path("rgb.exr"), 3, 1);
    Result<Environment> picture = read_environment(path("rgb.exr"));
    ASSERT_TRUE(picture.ok()) << picture.error().detail;
    EXPECT_EQ(picture->width, 3u);
    EXPECT_EQ(picture->height, 2u);
    ASSERT_EQ(picture->rgb.size(), 18u);
    EXPECT_EQ(picture->rgb[0], 1.0f);
    EXPECT_EQ(picture->rgb[17], 1 + 0.25f * 17);
    write_picture(path("rgba.exr"), 4, 1);
    picture = read_environment(path("rgba.exr"));
    ASSERT_TRUE(picture.ok()) << picture.error().detail;
    EXPECT_EQ(picture->rgb[3], 2.0f) << "the second pixel's red";
    write_picture(path("grey.exr"), 1, 1);
    picture = read_environment(path("grey.exr"));
    ASSERT_TRUE(picture.ok()) << picture.error().detail;
    EXPECT_EQ(picture->rgb[3], picture->rgb[5]);
    write_picture(path("sky.hdr"), 3, 1);
    picture = read_environment(path("sky.hdr"));
    ASSERT_TRUE(picture.ok()) << picture.error().detail;
    EXPECT_NEAR(picture->rgb[17], 1 + 0.25f * 17, 0.05f) << "8 bits and an exponent";

    write_picture(path("negative.exr"), 3, -0.1f);
    EXPECT_THAT(read_environment(path("negative.exr")).error().detail, testing::HasSubstr("pixel (0, 0)"));
    std::ofstream(path("cut.exr"), std::ios::binary) << "v/1\x01";
    EXPECT_EQ(read_environment(path("cut.exr")).error().code, ErrorCode::InvalidScene);
    EXPECT_EQ(read_environment(path("none.exr")).error().code, ErrorCode::FileNotFound);
    EXPECT_EQ(read_environment(path("sky.png")).error().code, ErrorCode::UnsupportedFormat);
}

TEST(box_filter, keeps_the_mean_light_and_the_covered_area)
{
    // black and white in halves: half the light, which is sRGB 188; a fourth of the area covered: alpha 64
    const Picture checker{2, 2, {0, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255, 255, 0, 0, 0, 255}};
    EXPECT_EQ(box_filter(checker, 1, 1).rgba, (std::vector<uint8_t>{188, 188, 188, 255}));
    const Picture corner{2, 2, {200, 100, 50, 255, 1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9, 0}};
    EXPECT_EQ(box_filter(corner, 1, 1).rgba, (std::vector<uint8_t>{200, 100, 50, 64}));
    // 3 -> 2: the middle pixel is shared by both
    const Picture row{3, 1, {255, 255, 255, 255, 255, 255, 255, 0, 255, 255, 255, 0}};
    const Picture two = box_filter(row, 2, 1);
    EXPECT_EQ(two.rgba[3], 170); // 1 of 1.5 pixels
    EXPECT_EQ(two.rgba[7], 0);
    EXPECT_EQ(box_filter(row, 3, 1).rgba[3], 255) << "the same size changes nothing";
}

TEST(average_samples, is_weighted_by_alpha)
{
    Frame frame;
    frame.width = frame.height = 2;
    frame.rgba = {1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 9, 0, 0, 0, 9, 0}; // red, green, two misses with a colour
    const Frame mean = average_samples(frame, 2);
    EXPECT_EQ(mean.rgba, (std::vector<float>{0.5f, 0.5f, 0, 0.5f}));
    Frame over = mean;
    composite_over(over, {0, 0, 1});
    EXPECT_EQ(over.rgba, (std::vector<float>{0.25f, 0.25f, 0.5f, 1}));
}

} // namespace
} // namespace trimray
