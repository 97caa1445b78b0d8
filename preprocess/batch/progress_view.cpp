#include "preprocess/batch/progress_view.h"

#include "format/command_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace trimray {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kPlainPeriodSeconds = 30;
// what a file costs beside its bytes, in bytes: a worker's start, tables, previews
constexpr double kBytesOfAFile = 200e3;

double weight(const BatchFile& file)
{
    return static_cast<double>(file.bytes) + kBytesOfAFile;
}

size_t terminal_columns()
{
    winsize size{};
    return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

/// Bytes of `text` that take at most `columns`: whole characters of UTF-8, each counted as one column.
std::string cut(const std::string& text, size_t columns)
{
    size_t used = 0, i = 0;
    for (; i < text.size(); ++i)
        if ((static_cast<unsigned char>(text[i]) & 0xc0) != 0x80 && ++used > columns)
            break;
    return text.substr(0, i);
}

class ProgressView : public BatchWatcher {
public:
    ProgressView(const std::vector<BatchFile>& files, size_t skipped, bool quiet)
        : total_(files.size()), skipped_(skipped), quiet_(quiet), terminal_(isatty(STDERR_FILENO) != 0)
    {
        for (const BatchFile& file : files)
            weight_left_ += weight(file);
    }

    ~ProgressView() override { clear(); }

    void ended(const FileEnd& end) override
    {
        ++ended_;
        failed_ += has_pack(end.kind) ? 0 : 1;
        weight_left_ -= weight(end.file);
        weight_done_ += end.found ? 0 : weight(end.file);
        if (quiet_ || end.kind == FileClass::Done)
            return;
        clear();
        const std::string why = end.kind == FileClass::Incomplete ? "some faces dropped" : end.detail;
        fmt::print(stderr, "{}: {}: {}\n", class_name(end.kind), printable(end.file.path), printable(why));
    }

    void working(const std::vector<FileAtWork>& files, size_t left) override
    {
        if (quiet_)
            return;
        const Clock::time_point now = Clock::now();
        if (!terminal_ && std::chrono::duration<double>(now - last_line_).count() < kPlainPeriodSeconds)
            return;
        last_line_ = now;
        const std::string line = text(files, left);
        if (terminal_)
            fmt::print(stderr, "\r\033[K{}", cut(line, terminal_columns() - 1));
        else
            fmt::print(stderr, "{}\n", line);
        std::fflush(stderr);
    }

private:
    void clear() const
    {
        if (terminal_ && !quiet_)
            fmt::print(stderr, "\r\033[K");
    }

    std::string text(const std::vector<FileAtWork>& files, size_t left) const
    {
        const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
        std::string line = fmt::format("{} of {} files", ended_ + skipped_, total_ + skipped_);
        if (failed_ > 0)
            line += fmt::format(", {} failed", failed_);
        if (ended_ > 0)
            line += fmt::format(", {:.3g} files/s", static_cast<double>(ended_) / seconds);
        // the first files are the largest, and tell little of the many behind them until some have ended
        if (weight_done_ > 0 && left + files.size() > 0)
            line += fmt::format(", {} left", duration_text(seconds * weight_left_ / weight_done_));
        const auto slowest = std::max_element(
            files.begin(), files.end(), [](const FileAtWork& a, const FileAtWork& b) { return a.seconds < b.seconds; });
        if (slowest != files.end())
            line += fmt::format("; {} {:.0f} s{}{}", printable(slowest->name), slowest->seconds,
                                slowest->phase.empty() ? "" : ": ", slowest->phase);
        return line;
    }

    size_t total_, skipped_, ended_ = 0, failed_ = 0;
    double weight_left_ = 0, weight_done_ = 0;
    bool quiet_, terminal_;
    Clock::time_point start_ = Clock::now(), last_line_ = start_;
};

} // namespace

std::unique_ptr<BatchWatcher> make_progress_view(const std::vector<BatchFile>& files, size_t skipped, bool quiet)
{
    return std::make_unique<ProgressView>(files, skipped, quiet);
}

std::string duration_text(double seconds)
{
    const auto whole = static_cast<long long>(std::ceil(seconds));
    if (whole >= 3600)
        return fmt::format("{} h {:02d} min", whole / 3600, whole / 60 % 60);
    if (whole >= 60)
        return fmt::format("{} min {:02d} s", whole / 60, whole % 60);
    return fmt::format("{} s", whole);
}

} // namespace trimray
