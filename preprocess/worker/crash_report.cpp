#include "preprocess/worker/crash_report.h"

#include "preprocess/worker/worker_message.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <cxxabi.h>
#include <dlfcn.h>
#include <execinfo.h>
#include <memory>
#include <sstream>

namespace trimray {
namespace {

constexpr size_t kStackBytes = 256u << 10; // of the handler's own stack: the worker's may be what ran out
constexpr int kMostFrames = 64;
constexpr unsigned kPatienceSeconds = 2; // walking a damaged stack may hang

int crash_descriptor = -1;
std::array<char, 32768> frame_text;
size_t frame_size = 0;

void append(const char* text)
{
    const size_t size = std::min(std::strlen(text), frame_text.size() - frame_size);
    std::memcpy(frame_text.data() + frame_size, text, size);
    frame_size += size;
}

// Not everything here is allowed in a signal handler; the process is lost already, and the alarm ends it if this hangs.
void on_crash(int signal)
{
    alarm(kPatienceSeconds);
    std::array<char, 16> number{};
    const auto end = std::to_chars(number.data(), number.data() + number.size(), signal).ptr;
    send_message(crash_descriptor, MessageType::Signal, {number.data(), static_cast<size_t>(end - number.data())});
    void* addresses[kMostFrames];
    const int count = backtrace(addresses, kMostFrames);
    for (int i = 0; i < count; ++i) {
        Dl_info info{};
        if (dladdr(addresses[i], &info) == 0 || !info.dli_fname || !info.dli_sname)
            continue;
        const char* slash = std::strrchr(info.dli_fname, '/');
        append(slash ? slash + 1 : info.dli_fname);
        append(" ");
        append(info.dli_sname);
        append("\n");
    }
    send_message(crash_descriptor, MessageType::Frames, {frame_text.data(), frame_size});
    raise(signal); // waits until this returns, and then does what it would have done
}

std::string demangled(const std::string& symbol)
{
    int failed = 0;
    const std::unique_ptr<char, decltype(&std::free)> name{
        abi::__cxa_demangle(symbol.c_str(), nullptr, nullptr, &failed), &std::free};
    return failed == 0 && name ? name.get() : symbol;
}

} // namespace

void report_crashes(int descriptor)
{
    crash_descriptor = descriptor;
    void* first = nullptr;
    backtrace(&first, 1); // loads what it needs, while loading is safe
    static std::array<char, kStackBytes> stack;
    stack_t alternative{};
    alternative.ss_sp = stack.data();
    alternative.ss_size = stack.size();
    sigaltstack(&alternative, nullptr);
    struct sigaction action {};
    action.sa_handler = on_crash;
    action.sa_flags = SA_ONSTACK | static_cast<int>(SA_RESETHAND); // a second fault just ends it
    for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT})
        sigaction(signal, &action, nullptr);
}

std::string kernel_frame(const std::string& frames)
{
    std::istringstream lines(frames);
    for (std::string library, symbol; lines >> library >> symbol;) {
        if (!library.starts_with("libTK"))
            continue;
        std::string function = demangled(symbol);
        function.resize(std::min(function.size(), function.find('('))); // without arguments
        return library.substr(3, library.find('.') - 3) + ": " + function;
    }
    return {};
}

} // namespace trimray
