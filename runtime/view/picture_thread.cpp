#include "runtime/view/picture_thread.h"

#include "runtime/command_trace.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace trimray {
namespace {

constexpr double kMovingMs = 33; // of a picture while the camera moves: thirty a second
// A still picture at full size comes at once where it is expected to take no longer than this; otherwise one at the
// moving size is shown before
constexpr double kAtOnceMs = 100;

uint32_t scaled(uint32_t pixels, double share)
{
    return std::max(1u, static_cast<uint32_t>(std::lround(pixels * share)));
}

} // namespace

double next_share(double share, double ms, double target_ms)
{
    // as many pixels as time allows, at most four times as many at once: the first picture of a kind may be slow
    const double wanted = share * std::sqrt(std::clamp(target_ms / std::max(ms, 1e-3), 0.0625, 4.0));
    const double kept = wanted > 0.9 ? 1 : wanted;
    // a little more or less is not worth another size: textures would be made anew and the picture would swim
    return std::clamp(std::abs(kept - share) < 0.1 * share ? share : kept, 1.0 / 16, 1.0);
}

PictureThread::PictureThread(std::function<void()> wake) : wake_(std::move(wake)), thread_([this] { run(); }) {}

PictureThread::~PictureThread()
{
    {
        const std::lock_guard lock(mutex_);
        stops_ = true;
        wanted_.reset();
        ++wanted_number_;
    }
    changed_.notify_all();
    thread_.join();
}

uint64_t PictureThread::order(PictureOrder order)
{
    uint64_t number;
    {
        const std::lock_guard lock(mutex_);
        wanted_ = std::move(order);
        number = ++wanted_number_;
        error_.reset();
    }
    changed_.notify_all();
    return number;
}

void PictureThread::cancel()
{
    const std::lock_guard lock(mutex_);
    wanted_.reset();
    ++wanted_number_;
    shown_.reset();
}

void PictureThread::finish()
{
    cancel();
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !busy_; });
    shown_.reset();
}

std::optional<ShownPicture> PictureThread::take()
{
    const std::lock_guard lock(mutex_);
    return std::exchange(shown_, std::nullopt);
}

std::optional<Error> PictureThread::take_error()
{
    const std::lock_guard lock(mutex_);
    return std::exchange(error_, std::nullopt);
}

bool PictureThread::outdated(uint64_t number)
{
    const std::lock_guard lock(mutex_);
    return wanted_number_ != number;
}

void PictureThread::run()
{
    for (;;) {
        PictureOrder order;
        uint64_t number;
        {
            std::unique_lock lock(mutex_);
            changed_.wait(lock, [this] { return stops_ || wanted_; });
            if (stops_)
                return;
            order = std::move(*wanted_);
            wanted_.reset();
            number = wanted_number_;
            busy_ = true;
        }
        work_on(std::move(order), number);
        {
            const std::lock_guard lock(mutex_);
            busy_ = false;
        }
        changed_.notify_all();
    }
}

void PictureThread::work_on(PictureOrder order, uint64_t number)
{
    if (order.moving) {
        trace(order, number, share_, 1, false);
        return;
    }
    const double expected_ms = kMovingMs / (share_ * share_);
    if (share_ < 1 && expected_ms > kAtOnceMs && !trace(order, number, share_, 1, false))
        return;
    if (!trace(order, number, 1, 1, order.samples == 1) || order.samples == 1)
        return;
    trace(order, number, 1, order.samples, true);
}

// False: what follows is not wanted any more.
bool PictureThread::trace(const PictureOrder& order, uint64_t number, double share, uint32_t samples, bool last)
{
    RenderOptions options = order.options;
    options.width = scaled(options.width, share);
    options.height = scaled(options.height, share);
    if (share < 1) // lines as wide as in the full picture, as far as pixels allow
        options.edge_width_px = std::max(1.0f, options.edge_width_px * static_cast<float>(share));
    if (!order.moving)
        options.cancelled = [this, number] { return outdated(number); };
    ShownPicture shown;
    const auto start = std::chrono::steady_clock::now();
    Result<Frame> frame = trace_picture(*order.tracer, options, samples, shown.stats);
    if (!frame.ok()) {
        if (frame.error().code == ErrorCode::Interrupted)
            return false;
        {
            const std::lock_guard lock(mutex_);
            if (wanted_number_ == number)
                error_ = frame.error();
        }
        wake_();
        return false;
    }
    shown.complete = last && !order.moving;
    std::vector<float> alone;
    if (options.look.background) {
        if (shown.complete)
            alone = frame->rgba;
        composite_over(*frame, *options.look.background);
    }
    shown.colours = to_picture(*frame);
    if (!alone.empty())
        frame->rgba = std::move(alone);
    else if (!shown.complete)
        frame->rgba.clear();
    shown.ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    if (samples == 1 && share == share_)
        share_ = next_share(share, shown.ms, kMovingMs);
    shown.frame = std::move(*frame);
    options.cancelled = nullptr;
    shown.order = number;
    shown.traced = std::move(options);
    shown.samples = samples;
    shown.full_width = order.options.width;
    shown.full_height = order.options.height;
    bool goes_on;
    {
        const std::lock_guard lock(mutex_);
        goes_on = wanted_number_ == number;
        // a moving picture is shown though the next is ordered already; one of before a cancel is not
        if (!goes_on && !wanted_)
            return false;
        shown_ = std::move(shown);
    }
    wake_();
    return goes_on;
}

} // namespace trimray
