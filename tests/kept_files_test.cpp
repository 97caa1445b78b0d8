// What the viewer keeps between runs, and how it follows files and folders: all of it may be written by others, too.
#include "format/pack_writer.h"
#include "runtime/view/file_watch.h"
#include "runtime/view/folder_models.h"
#include "runtime/view/recent_files.h"
#include "runtime/view/settings.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

namespace trimray {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

class KeptFilesTest : public testing::Test {
protected:
    void SetUp() override
    {
        fs::remove_all(folder);
        fs::create_directories(folder);
    }
    std::string write(const std::string& name, const std::string& text) const
    {
        std::ofstream(folder / name) << text;
        return (folder / name).string();
    }
    static bool comes(FileWatch& watch)
    {
        for (int tries = 0; tries < 5000; ++tries) {
            if (watch.take_change())
                return true;
            std::this_thread::sleep_for(1ms);
        }
        return false;
    }
    // tests run side by side
    const fs::path folder =
        fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(KeptFilesTest, settings_come_back_as_they_were_written)
{
    ViewerSettings settings;
    settings.navigation = "blender";
    settings.unit = LengthUnit::Inch;
    settings.panels.tree = settings.panels.costs = true;
    settings.panels.menu = false;
    settings.window = {900, 700};
    settings.look.emplace();
    settings.look->edges = EdgeLines::All;
    settings.look->samples = 3;
    settings.look->look.occlusion.samples = 12;
    settings.look->look.section.planes.emplace_back(); // of one model: not kept
    ASSERT_TRUE(write_settings(folder, settings).ok());
    const Result<ViewerSettings> read = read_settings(folder);
    ASSERT_TRUE(read.ok()) << read.error().detail;
    EXPECT_EQ(read->navigation, "blender");
    EXPECT_EQ(read->unit, LengthUnit::Inch);
    EXPECT_TRUE(read->panels.tree && read->panels.costs);
    EXPECT_FALSE(read->panels.menu);
    EXPECT_EQ(read->window.width, 900u);
    EXPECT_EQ(read->window.height, 700u);
    ASSERT_TRUE(read->look);
    EXPECT_EQ(read->look->edges, EdgeLines::All);
    EXPECT_EQ(read->look->samples, 3u);
    EXPECT_EQ(read->look->look.occlusion.samples, 12u);
    EXPECT_TRUE(read->look->look.section.planes.empty());
}

TEST_F(KeptFilesTest, settings_of_another_version_are_taken_as_far_as_they_mean_something)
{
    write("settings.json", R"({"navigation": "maya", "unit": "cm", "panels": {"tree": true, "menu": 7},
                               "window": [10, 99999999999], "later": {}})");
    const Result<ViewerSettings> read = read_settings(folder);
    ASSERT_TRUE(read.ok()) << read.error().detail;
    EXPECT_EQ(read->navigation, ViewerSettings{}.navigation);
    EXPECT_EQ(read->unit, LengthUnit::Centimetre);
    EXPECT_TRUE(read->panels.tree);
    EXPECT_TRUE(read->panels.menu);
    EXPECT_GE(read->window.width, 100u);
    EXPECT_LE(read->window.height, 20000u);
}

TEST_F(KeptFilesTest, what_is_no_state_is_named_and_not_overwritten)
{
    EXPECT_TRUE(read_settings(folder).ok()); // none yet
    const std::string settings = write("settings.json", "once upon a time"), list = write("recent.json", "[1, 2]");
    const Result<ViewerSettings> read = read_settings(folder);
    ASSERT_FALSE(read.ok());
    EXPECT_NE(read.error().where.find("settings.json"), std::string::npos);
    EXPECT_FALSE(read_recent_files(list).ok());
    EXPECT_FALSE(remember_file(list, {"a.tray", "a.tray"}).ok());
    std::string text;
    std::getline(std::ifstream(list), text);
    EXPECT_EQ(text, "[1, 2]");
}

TEST_F(KeptFilesTest, recent_files_are_newest_first_once_each_and_not_too_many)
{
    const std::string list = (folder / "recent.json").string();
    for (size_t i = 0; i < kMostRecentFiles + 5; ++i)
        ASSERT_TRUE(remember_file(list, {"/m/" + std::to_string(i) + ".step", "/c/x.tray"}).ok());
    ASSERT_TRUE(remember_file(list, {"/m/../m/20.step", "/c/20.tray"}).ok());
    const Result<std::vector<RecentFile>> files = read_recent_files(list);
    ASSERT_TRUE(files.ok());
    ASSERT_EQ(files->size(), kMostRecentFiles);
    EXPECT_EQ((*files)[0], (RecentFile{"/m/20.step", "/c/20.tray"}));
    EXPECT_EQ((*files)[1].file, "/m/" + std::to_string(kMostRecentFiles + 4) + ".step");
    for (size_t i = 1; i < files->size(); ++i)
        EXPECT_NE((*files)[i].file, "/m/20.step");
}

TEST_F(KeptFilesTest, a_folder_lists_models_in_the_order_of_their_numbers)
{
    for (const char* name : {"part10.step", "part2.tray", "part1.IGS", "notes.txt", ".hidden.step", "part3.stp.zst"})
        write(name, "");
    fs::create_directories(folder / "sub");
    const Result<FolderListing> listing = list_folder(folder);
    ASSERT_TRUE(listing.ok());
    EXPECT_EQ(listing->folders, std::vector<std::string>{"sub"});
    EXPECT_EQ(listing->models, (std::vector<std::string>{"part1.IGS", "part2.tray", "part3.stp.zst", "part10.step"}));
    const std::string gone = (folder / "part5.step").string();
    const std::vector<std::string> beside = models_beside(gone);
    ASSERT_EQ(beside.size(), 5u);
    EXPECT_EQ(beside[3], gone);
    EXPECT_EQ(list_folder((folder / "none").string()).error().code, ErrorCode::FileNotFound);
}

TEST_F(KeptFilesTest, a_watched_file_is_followed_in_its_place_and_when_another_takes_it)
{
    std::atomic<int> woken = 0;
    FileWatch watch([&] { ++woken; });
    const std::string file = write("a.tray", "1"), other = write("b.tray", "1");
    ASSERT_TRUE(watch.watch(file).ok());
    EXPECT_FALSE(watch.take_change());
    write("a.tray", "2");
    EXPECT_TRUE(comes(watch));
    EXPECT_GT(woken, 0);
    const std::string text = "3";
    const auto bytes = std::as_bytes(std::span(text));
    ASSERT_TRUE(write_file_atomically(file, {bytes.begin(), bytes.end()}).ok()); // by a name of its own, then moved
    EXPECT_TRUE(comes(watch));
    write("b.tray", "2"); // another file of the folder
    write("a.tray", "4"); // events come in order
    EXPECT_TRUE(comes(watch));
    ASSERT_TRUE(watch.watch(other).ok());
    write("a.tray", "5");
    std::this_thread::sleep_for(50ms);
    EXPECT_FALSE(watch.take_change());
    write("b.tray", "3");
    EXPECT_TRUE(comes(watch));
    EXPECT_FALSE(watch.watch((folder / "none" / "c.tray").string()).ok());
}

} // namespace
} // namespace trimray
