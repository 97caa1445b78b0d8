// A viewer that is started and ended a hundred times leaves nothing behind: no thread, no open file, and (told at the
// end of the program where it is checked for leaks) no memory.
#include "format/pack_writer.h"
#include "runtime/view/viewer.h"
#include "synthetic_pack.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <iterator>
#include <string>
#include <thread>

namespace trimray {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

long entries_of(const char* folder)
{
    return std::distance(fs::directory_iterator(folder), fs::directory_iterator());
}

/// Ends in the middle of things where `rests` is false.
void start_and_end(const std::string& file, bool rests)
{
    Viewer::Start start;
    start.files = {file};
    start.wake = [] {};
    start.make_tracer = [](const std::shared_ptr<const Scene>& scene, std::string&) { return make_cpu_tracer(scene); };
    Viewer viewer(std::move(start));
    viewer.set_picture_rect({0, 0, 64, 48});
    for (int tries = 0; rests && tries < 20000 && !viewer.at_rest(); ++tries) {
        viewer.update(Viewer::Clock::now());
        std::this_thread::sleep_for(100us);
    }
    if (rests) {
        EXPECT_TRUE(viewer.shown() && viewer.shown()->complete);
    }
}

TEST(viewer_starts, a_hundred_of_them_leave_nothing_behind)
{
    const std::string file = testing::TempDir() + "viewer_starts.tray";
    ASSERT_TRUE(write_file_atomically(file, encode_pack(synthetic_image(), WriteOptions{3})).ok());
    long threads = 0, files = 0;
    for (int i = 0; i < 100; ++i) {
        start_and_end(file, i % 4 != 3);
        if (i == 9) { // libraries have the threads that they keep
            threads = entries_of("/proc/self/task");
            files = entries_of("/proc/self/fd");
        }
    }
    // a thread that has ended may be listed for a moment yet
    for (int tries = 0; tries < 1000 && entries_of("/proc/self/task") > threads; ++tries)
        std::this_thread::sleep_for(1ms);
    EXPECT_LE(entries_of("/proc/self/task"), threads);
    EXPECT_LE(entries_of("/proc/self/fd"), files);
}

} // namespace
} // namespace trimray
