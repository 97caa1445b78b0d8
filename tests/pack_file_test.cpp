// Packs as files: the second reader, the golden pack, atomic writes.
#include "format/pack_file.h"
#include "format/pack_reader.h"
#include "format/pack_writer.h"
#include "synthetic_pack.h"

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace trimray {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::byte>;

constexpr uint64_t kGoldenContentId = 0x4f9486a89bfaabde; // of tests/golden/synthetic.tray

/// A folder of its own for each test, removed afterwards.
class PackFile : public testing::Test {
protected:
    PackFile()
    {
        std::string name = (fs::temp_directory_path() / "trimray-pack-XXXXXX").string();
        folder = ::mkdtemp(name.data());
    }
    ~PackFile() override
    {
        std::error_code ignored;
        fs::permissions(folder, fs::perms::owner_all, ignored);
        fs::remove_all(folder, ignored);
    }
    std::vector<std::string> names() const
    {
        std::vector<std::string> all;
        for (const auto& entry : fs::directory_iterator(folder))
            all.push_back(entry.path().filename().string());
        return all;
    }
    fs::path folder;
};

Bytes read_bytes(const fs::path& path)
{
    std::ifstream file(path, std::ios::binary);
    const std::vector<char> chars{std::istreambuf_iterator<char>(file), {}};
    const auto* first = reinterpret_cast<const std::byte*>(chars.data());
    return Bytes(first, first + chars.size());
}

/// Output and exit code of a shell command.
std::pair<std::string, int> run(const std::string& command)
{
    std::string output;
    FILE* pipe = ::popen(command.c_str(), "r");
    char buffer[4096];
    while (const size_t n = std::fread(buffer, 1, sizeof buffer, pipe))
        output.append(buffer, n);
    const int status = ::pclose(pipe);
    return {output, WIFEXITED(status) ? WEXITSTATUS(status) : -1};
}

std::pair<std::string, int> second_reader(const fs::path& pack)
{
    return run(fmt::format("python3 {}/second_reader.py {} 2>/dev/null", TRIMRAY_TESTS_DIR, pack.string()));
}

/// More than one frame in some sections, and a skewed count in the last one.
PackImage large_image()
{
    PackImage image = synthetic_image();
    const size_t first = image.trim_points.size();
    for (int i = 0; i < 400000; ++i)
        image.trim_points.push_back(0.5f + 0.4f * std::sin(0.001f * static_cast<float>(i)));
    image.proxy_draco.assign((2u << 20) + 12345, std::byte{42});
    EXPECT_GT(image.trim_points.size(), first);
    return image;
}

TEST_F(PackFile, the_second_reader_finds_the_same_bytes)
{
    for (const bool large : {false, true}) {
        for (const int level : {0, 12}) {
            const PackImage image = large ? large_image() : synthetic_image();
            const fs::path path = folder / "a.tray";
            ASSERT_TRUE(write_file_atomically(path, encode_pack(image, WriteOptions{level})).ok());
            const auto [output, code] = second_reader(path);
            ASSERT_EQ(code, 0);
            const auto json = nlohmann::json::parse(output);
            const Result<LoadedPack> loaded = read_pack(path, ReadOptions{});
            ASSERT_TRUE(loaded.ok()) << loaded.error().where << loaded.error().detail;
            EXPECT_EQ(json["content_id"], fmt::format("{:016x}", loaded->content_id));
            EXPECT_EQ(json["provenance"][0], "Gehäuse.step");
            EXPECT_EQ(json["face_names"][0], "Fläche");
            EXPECT_EQ(json["bounds_mm"][1][0], 120);
            ASSERT_EQ(json["sections"].size(), loaded->sections.size());
            size_t compared = 0;
            for_each_array(loaded->image, [&](std::string_view id, bool, const auto& array) {
                for (const auto& section : json["sections"])
                    if (section["id"] == id) {
                        const uint64_t hash = xxh3(array.data(), array.size() * sizeof(array[0]));
                        EXPECT_EQ(section["decoded_xxh3"], fmt::format("{:016x}", hash)) << id;
                        ++compared;
                    }
            });
            EXPECT_EQ(compared, 15u) << "every array has a section";
        }
    }
}

TEST_F(PackFile, the_second_reader_refuses_damage_too)
{
    Bytes bytes = encode_pack(synthetic_image(), WriteOptions{});
    for (const size_t at : {size_t{3}, size_t{100}, size_t{200}, bytes.size() / 2, bytes.size() - 1}) {
        bytes[at] ^= std::byte{16};
        ASSERT_TRUE(write_file_atomically(folder / "bad.tray", bytes).ok());
        EXPECT_EQ(second_reader(folder / "bad.tray").second, 3) << at;
        bytes[at] ^= std::byte{16};
    }
}

// The golden packs pin the format: a change that breaks old packs shows here. To make them anew, after a change that is
// meant: TRIMRAY_WRITE_GOLDEN=1 build/tests/pack_file_test --gtest_filter='*golden*', and the id it prints goes above.
TEST_F(PackFile, the_golden_packs_still_read_and_the_plain_one_is_still_written)
{
    const fs::path plain = fs::path(TRIMRAY_TESTS_DIR) / "golden" / "synthetic.tray";
    const fs::path compressed = fs::path(TRIMRAY_TESTS_DIR) / "golden" / "synthetic_zstd.tray";
    const Bytes written = encode_pack(synthetic_image(), WriteOptions{0});
    if (std::getenv("TRIMRAY_WRITE_GOLDEN")) {
        ASSERT_TRUE(write_file_atomically(plain, written).ok());
        ASSERT_TRUE(write_file_atomically(compressed, encode_pack(synthetic_image(), WriteOptions{12})).ok());
    }
    for (const fs::path& golden : {plain, compressed}) {
        const Result<LoadedPack> loaded = read_pack(golden, ReadOptions{});
        ASSERT_TRUE(loaded.ok()) << loaded.error().where << loaded.error().detail;
        EXPECT_EQ(loaded->content_id, kGoldenContentId) << fmt::format("{:#018x}", loaded->content_id);
    }
    // the compressed one's bytes belong to the zstd that wrote it
    EXPECT_EQ(read_bytes(plain), written);
}

TEST_F(PackFile, a_missing_file_and_a_folder_are_told_apart)
{
    EXPECT_EQ(read_pack(folder / "none.tray", ReadOptions{}).error().code, ErrorCode::FileNotFound);
    EXPECT_EQ(read_pack(folder, ReadOptions{}).error().code, ErrorCode::FileNotReadable);
}

TEST_F(PackFile, a_write_replaces_the_old_file_and_leaves_nothing_else)
{
    const fs::path path = folder / "модель.tray";
    ASSERT_TRUE(write_file_atomically(path, Bytes(10, std::byte{1})).ok());
    ASSERT_TRUE(write_file_atomically(path, Bytes(20, std::byte{2})).ok());
    EXPECT_EQ(read_bytes(path), Bytes(20, std::byte{2}));
    EXPECT_EQ(names().size(), 1u);
}

TEST_F(PackFile, what_cannot_be_written_says_why_and_leaves_nothing)
{
    const auto code_of = [](const Status& status) { return status.ok() ? ErrorCode::Internal : status.error().code; };
    const Status nowhere = write_file_atomically(folder / "none" / "a.tray", Bytes(1));
    EXPECT_EQ(code_of(nowhere), ErrorCode::FileNotWritable);
    EXPECT_THAT(nowhere.error().detail, testing::HasSubstr("No such file"));
    EXPECT_EQ(code_of(write_file_atomically(folder, Bytes(1))), ErrorCode::FileNotWritable);
    EXPECT_EQ(code_of(write_file_atomically("/dev/null", Bytes(1))), ErrorCode::FileNotWritable);
    EXPECT_TRUE(names().empty());
}

TEST_F(PackFile, a_full_disk_leaves_nothing)
{
    const pid_t child = ::fork();
    if (child == 0) {
        // a limit on file sizes ends a write as a full disk does
        ::signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{1 << 20, 1 << 20};
        ::setrlimit(RLIMIT_FSIZE, &limit);
        const Status status = write_file_atomically(folder / "a.tray", Bytes(4 << 20));
        ::_exit(!status.ok() && status.error().code == ErrorCode::FileNotWritable ? 0 : 1);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    EXPECT_TRUE(names().empty());
}

TEST_F(PackFile, a_writer_killed_in_mid_write_leaves_no_target_and_the_next_one_sweeps)
{
    const fs::path path = folder / "a.tray";
    const Bytes bytes(96 << 20, std::byte{5});
    bool saw_temporary = false;
    for (int round = 0; round < 20 && !saw_temporary; ++round) {
        fs::remove(path);
        const pid_t child = ::fork();
        if (child == 0) {
            (void)write_file_atomically(path, bytes).ok();
            ::_exit(0);
        }
        while (names().empty()) // the temporary appears before its first byte is written
            std::this_thread::yield();
        ::kill(child, SIGKILL);
        ::waitpid(child, nullptr, 0);
        saw_temporary = !fs::exists(path);
    }
    ASSERT_TRUE(saw_temporary) << "the writer was never caught in its write";
    ASSERT_EQ(names().size(), 1u);
    EXPECT_THAT(names()[0], testing::StartsWith(".a.tray."));

    const std::string living = fmt::format(".a.tray.{}.00000000.tmp", ::getpid());
    std::ofstream(folder / living) << "of a writer that runs";
    std::ofstream(folder / ".b.tray.999999999.00000000.tmp") << "of another target";
    ASSERT_TRUE(write_file_atomically(path, Bytes(10)).ok());
    EXPECT_THAT(names(), testing::UnorderedElementsAre("a.tray", living, ".b.tray.999999999.00000000.tmp"));
}

} // namespace
} // namespace trimray
