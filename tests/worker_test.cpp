#include "preprocess/worker/machine_memory.h"
#include "preprocess/worker/worker.h"

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <vector>

namespace {
using namespace trimray;
using testing::HasSubstr;

Result<std::string> run(const WorkerFunction& function, const WorkerLimits& limits = {},
                        const WorkerProgress& progress = {})
{
    return run_in_worker("model.step", function, limits, progress);
}

/// No child of this process is left, running or zombie.
bool no_children()
{
    return waitpid(-1, nullptr, WNOHANG) == -1 && errno == ECHILD;
}

void expect_error(const Result<std::string>& result, ErrorCode code, const std::string& in_detail)
{
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, code) << result.error().detail;
    EXPECT_EQ(result.error().where, "model.step");
    EXPECT_THAT(result.error().detail, HasSubstr(in_detail));
    EXPECT_EQ(exit_code(result.error()), kExitInternal);
    EXPECT_TRUE(no_children());
}

TEST(worker, brings_back_an_answer_of_any_size_unchanged)
{
    std::string bytes;
    for (int i = 0; i < 3'000'000; ++i)
        bytes += static_cast<char>(i * 37);
    const auto result = run([&](const WorkerReport&) { return bytes; });
    ASSERT_TRUE(result.ok());
    EXPECT_EQ(*result, bytes);
    EXPECT_TRUE(no_children());
}

TEST(worker, brings_back_an_error_with_its_code_place_and_detail)
{
    const auto result = run([](const WorkerReport&) -> Result<std::string> {
        return Error{ErrorCode::EmptyCad, "file with\na line break", "has\nno faces"};
    });
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::EmptyCad);
    EXPECT_EQ(result.error().where, "file with\na line break");
    EXPECT_EQ(result.error().detail, "has\nno faces");
}

TEST(worker, passes_progress_on_in_order)
{
    std::vector<std::string> seen;
    const auto result = run(
        [](const WorkerReport& progress) -> Result<std::string> {
            progress("read", -1);
            progress("transfer", 0.25);
            progress("transfer", 1);
            return std::string();
        },
        {}, [&](const char* phase, double share) { seen.push_back(phase + std::to_string(share)); });
    ASSERT_TRUE(result.ok());
    EXPECT_THAT(seen, testing::ElementsAre("read-1.000000", "transfer0.250000", "transfer1.000000"));
}

TEST(worker, a_crash_names_the_signal_and_the_phase)
{
    for (const auto& [signal, name] : {std::pair{SIGSEGV, "SIGSEGV"}, {SIGABRT, "SIGABRT"}, {SIGFPE, "SIGFPE"}}) {
        const auto result = run([signal = signal](const WorkerReport& progress) -> Result<std::string> {
            std::signal(signal, SIG_DFL); // sanitizers have their own handlers
            progress("transfer", 0.5);
            raise(signal);
            return std::string("still alive");
        });
        expect_error(result, ErrorCode::KernelCrashed, name);
        EXPECT_THAT(result.error().detail, HasSubstr("in phase transfer"));
    }
}

TEST(worker, a_hang_ends_at_the_time_limit)
{
    WorkerLimits limits;
    limits.wall_seconds = 0.3;
    const auto start = std::chrono::steady_clock::now();
    const auto result = run(
        [](const WorkerReport& progress) -> Result<std::string> {
            progress("read", -1);
            std::signal(SIGTERM, SIG_IGN); // what hangs may ignore polite signals
            for (;;)
                std::this_thread::sleep_for(std::chrono::seconds(1));
        },
        limits);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    expect_error(result, ErrorCode::KernelTimedOut, "0.3 s (in phase read)");
    EXPECT_GE(seconds, 0.3);
    EXPECT_LT(seconds, 3.0);
}

TEST(worker, programs_started_by_a_hanging_worker_end_with_it)
{
    WorkerLimits limits;
    limits.wall_seconds = 0.3;
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const auto result = run(
        [&](const WorkerReport&) -> Result<std::string> {
            if (fork() == 0)
                for (;;)
                    pause(); // holds the pipe's writing end
            for (;;)
                pause();
        },
        limits);
    close(ends[1]);
    expect_error(result, ErrorCode::KernelTimedOut, "0.3 s");
    char byte;
    EXPECT_EQ(read(ends[0], &byte, 1), 0); // end of file: nobody holds the other end any more
    close(ends[0]);
}

#if !defined(__SANITIZE_ADDRESS__) // its shadow memory is above any limit, so the worker sets none
TEST(worker, memory_taken_bit_by_bit_ends_at_the_limit)
{
    WorkerLimits limits;
    limits.memory_bytes = 200u << 20;
    const auto result = run(
        [](const WorkerReport& progress) -> Result<std::string> {
            progress("transfer", 0.1);
            std::vector<std::vector<char>> hoard;
            for (;;) {
                hoard.emplace_back(4u << 20, 'x');
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
            }
        },
        limits);
    expect_error(result, ErrorCode::KernelOutOfMemory, "0.195 GiB");
    EXPECT_THAT(result.error().detail, HasSubstr("in phase transfer"));
}

TEST(worker, an_allocation_above_the_limit_is_out_of_memory_too)
{
    WorkerLimits limits;
    limits.memory_bytes = 200u << 20;
    const auto result = run(
        [](const WorkerReport&) -> Result<std::string> {
            const std::vector<char> huge(8ull << 30, 'x');
            return std::to_string(huge.size());
        },
        limits);
    expect_error(result, ErrorCode::KernelOutOfMemory, "memory");
}
#endif

TEST(worker, being_killed_from_outside_is_reported_as_such)
{
    const auto result = run([](const WorkerReport&) -> Result<std::string> {
        kill(getpid(), SIGKILL);
        return std::string();
    });
    expect_error(result, ErrorCode::KernelOutOfMemory, "killed from outside");
}

TEST(worker, ending_without_an_answer_is_an_error)
{
    const auto result = run([](const WorkerReport&) -> Result<std::string> { _exit(3); });
    expect_error(result, ErrorCode::Internal, "status 3 without an answer");
}

TEST(worker, an_exception_becomes_an_error)
{
    const auto result =
        run([](const WorkerReport&) -> Result<std::string> { throw std::runtime_error("lost a face"); });
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::Internal);
    EXPECT_THAT(result.error().detail, HasSubstr("lost a face"));
}

TEST(worker, its_stdout_is_swallowed_and_its_stderr_is_not)
{
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const auto result = run([](const WorkerReport&) -> Result<std::string> {
        std::printf("chatter of the kernel\n");
        std::fflush(stdout);
        std::fprintf(stderr, "a message\n");
        return std::string();
    });
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "a message\n");
    EXPECT_TRUE(result.ok());
}

TEST(worker, leaves_no_core_and_has_its_own_process_group)
{
    const auto result = run([](const WorkerReport&) -> Result<std::string> {
        rlimit core{};
        getrlimit(RLIMIT_CORE, &core);
        return std::to_string(core.rlim_cur) + (getpgid(0) == getpid() ? " own group" : " shared group");
    });
    ASSERT_TRUE(result.ok());
    EXPECT_EQ(*result, "0 own group");
}

TEST(worker, dies_with_its_parent)
{
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t middle = fork();
    if (middle == 0) { // a process that runs a worker and is killed meanwhile
        close(ends[0]);
        const auto ignored = run([&](const WorkerReport&) -> Result<std::string> {
            kill(getppid(), SIGKILL);
            for (;;)
                pause();
        });
        _exit(ignored.ok());
    }
    close(ends[1]);
    waitpid(middle, nullptr, 0);
    char byte;
    EXPECT_EQ(read(ends[0], &byte, 1), 0); // end of file: the worker is gone as well
    close(ends[0]);
}

TEST(machine_memory, is_the_least_that_a_group_or_one_above_it_has_been_given)
{
    const auto root = std::filesystem::path(testing::TempDir()) / "control_groups";
    std::filesystem::create_directories(root / "job" / "task");
    EXPECT_EQ(group_memory(root, "/job/task"), UINT64_MAX);
    std::ofstream(root / "job" / "memory.max") << "4096\n";
    std::ofstream(root / "job" / "task" / "memory.max") << "max\n";
    EXPECT_EQ(group_memory(root, "/job/task"), 4096u);
    EXPECT_EQ(group_memory(root, "/job"), 4096u);
    EXPECT_EQ(group_memory(root, "/"), UINT64_MAX);
    EXPECT_EQ(group_memory(root / "job", "/"), 4096u); // as a container sees its own
    EXPECT_GT(machine_memory(), 256ull << 20);
    std::filesystem::remove_all(root);
}

} // namespace
