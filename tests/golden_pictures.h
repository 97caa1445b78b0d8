// Pictures that were looked at, kept under golden/. To make them anew, after a change that is meant: run the test with
// TRIMRAY_WRITE_GOLDEN=1, and look at them.
#pragma once

#include "runtime/image_io.h"
#include "runtime/tracer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <span>
#include <string>
#include <vector>

namespace trimray {

inline void write_picture(const std::filesystem::path& to, const Picture& picture)
{
    const Result<std::vector<std::byte>> bytes = encode_png(picture, PngForm::Fewest);
    ASSERT_TRUE(bytes.ok());
    std::ofstream(to, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes->data()), static_cast<std::streamsize>(bytes->size()));
}

/// The frame over white is the picture golden/`name`. If it is not, writes actual_ and difference_`name` to the
/// temporary folder.
inline void expect_golden(Frame frame, const std::string& name)
{
    constexpr int kLittle = 3, kMuch = 40;     // levels of 255
    constexpr double kMostOffByLittle = 0.001; // share of pixels that a compiler's other rounding may move
    namespace fs = std::filesystem;
    composite_over(frame, {1, 1, 1});
    const Picture actual = to_picture(frame);
    const fs::path path = fs::path(TRIMRAY_TESTS_DIR) / "golden" / name;
    if (std::getenv("TRIMRAY_WRITE_GOLDEN") != nullptr)
        write_picture(path, actual);
    std::ifstream file(path, std::ios::binary);
    const std::vector<char> bytes((std::istreambuf_iterator<char>(file)), {});
    const Result<Picture> golden = decode_png(std::as_bytes(std::span(bytes)));
    ASSERT_TRUE(golden.ok()) << path;
    ASSERT_EQ(golden->rgba.size(), actual.rgba.size());
    Picture difference = actual;
    size_t little = 0, much = 0;
    for (size_t i = 0; i < actual.rgba.size(); ++i) {
        const int off = std::abs(int(actual.rgba[i]) - int(golden->rgba[i]));
        little += off > kLittle;
        much += off > kMuch;
        difference.rgba[i] = i % 4 == 3 ? uint8_t(255) : uint8_t(std::min(255, 4 * off));
    }
    EXPECT_EQ(much, 0u);
    EXPECT_LE(double(little), kMostOffByLittle * double(actual.rgba.size()));
    if (testing::Test::HasFailure()) {
        const fs::path folder = fs::temp_directory_path();
        write_picture(folder / ("actual_" + name), actual);
        write_picture(folder / ("difference_" + name), difference);
        std::cout << "expected " << path << "; wrote actual_ and difference_" << name << " to " << folder << "\n";
    }
}

} // namespace trimray
