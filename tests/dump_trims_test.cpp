// The pictures of trims: one for each trimmed face, a line for each face, and a mask that shows the inside.
#include "preprocess/dump_trims.h"

#include "format/derive.h"
#include "tests/trim_shapes.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <unistd.h>

namespace trimray {
namespace {

using namespace shapes;

TEST(dump_trims, draws_each_trimmed_face_and_lists_all)
{
    PackImage image;
    add_face(image, {polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}}), circle(0.5, 0.5, 0.25, 0.25)}, 10, 10);
    add_face(image, {});
    image.faces.back().flags = kFaceNaturalBorder;
    add_face(image, {star(0.5, 0.5, 0.5, 0.2, 5)}, 1, 100);
    derive_cells(image);
    allocate_trim_memory(image, 2000, {});
    derive_sdf(image);
    const auto folder = std::filesystem::temp_directory_path() / ("trimray_dump_" + std::to_string(::getpid()));
    ASSERT_TRUE(dump_trims(image, folder.string()).ok());

    std::ifstream index(folder / "index.txt");
    std::string line;
    int lines = 0;
    while (std::getline(index, line))
        ++lines;
    EXPECT_EQ(lines, 4); // a heading and three faces
    EXPECT_FALSE(std::filesystem::exists(folder / "face_000001.ppm"));
    EXPECT_TRUE(std::filesystem::exists(folder / "face_000002.ppm"));

    std::ifstream picture(folder / "face_000000.ppm", std::ios::binary);
    std::string magic;
    int width = 0, height = 0, levels = 0;
    picture >> magic >> width >> height >> levels;
    picture.get();
    std::vector<unsigned char> pixels(static_cast<size_t>(width) * height * 3);
    picture.read(reinterpret_cast<char*>(pixels.data()), static_cast<std::streamsize>(pixels.size()));
    ASSERT_TRUE(picture.good());
    // the second of three panels is the mask: the hole is dark, the plate around it white
    const auto red = [&](int x, int y) { return pixels[3 * (static_cast<size_t>(y) * width + x)]; };
    EXPECT_LT(red(width / 2, height / 2), 100);
    EXPECT_EQ(red(width / 2 - height / 3, height / 2), 255);
    std::filesystem::remove_all(folder);
}

TEST(dump_trims, says_where_it_cannot_write)
{
    PackImage image;
    const Status status = dump_trims(image, "/proc/no/such/folder");
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().code, ErrorCode::FileNotWritable);
}

} // namespace
} // namespace trimray
