// The thread that traces, beside the one that draws the window. It is told what is to be seen, shows something at once
// and refines it: while the camera moves, at a size that keeps the rate; when it rests, at full size, then with all its
// samples. Then it sleeps. A picture that nobody waits for any more is given up.
#pragma once

#include "runtime/image_io.h"
#include "runtime/tracer.h"

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

namespace trimray {

/// What is to be seen in the end.
struct PictureOrder {
    std::shared_ptr<Tracer> tracer; // called by the picture thread alone
    RenderOptions options;          // at full size, one sample a pixel
    uint32_t samples = 1;           // N x N a pixel
    bool moving = false;            // another order will follow soon: the rate matters more than the size
};

struct ShownPicture {
    uint64_t order = 0;   // which one it is of, counted from 1
    Picture colours;      // at the size that was traced
    Frame frame;          // what lies where, where samples is 1; colours, without the background, where it is complete
    RenderOptions traced; // what it was made with
    uint32_t samples = 1;
    uint32_t full_width = 0, full_height = 0; // of the order
    bool complete = false;                    // nothing better follows
    RenderStats stats;
    double ms = 0; // tracing, shading and making it ready for a screen

    /// Of a complete picture: as it is without its background.
    Picture transparent() const { return to_picture(frame); }
};

/// The share of full width and height that keeps a moving picture within `target_ms`, if the last one took `ms` at
/// `share`; at least 1/16, at most 1.
double next_share(double share, double ms, double target_ms);

class PictureThread {
public:
    /// `wake` is called from the thread when there is something to take.
    explicit PictureThread(std::function<void()> wake);
    ~PictureThread();
    PictureThread(const PictureThread&) = delete;
    PictureThread& operator=(const PictureThread&) = delete;

    /// Replaces what is wanted; returns the order's number. Never waits.
    uint64_t order(PictureOrder order);
    /// Nothing is wanted any more; the tracer is let go. Never waits.
    void cancel();
    /// Likewise, and waits until the thread holds no tracer.
    void finish();

    /// The newest picture since the last call.
    std::optional<ShownPicture> take();
    /// Why the last order failed, once. Interrupted is not told.
    std::optional<Error> take_error();

private:
    void run();
    void work_on(PictureOrder order, uint64_t number);
    bool trace(const PictureOrder& order, uint64_t number, double share, uint32_t samples, bool last);
    bool outdated(uint64_t number);

    std::function<void()> wake_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::optional<PictureOrder> wanted_;
    uint64_t wanted_number_ = 0;
    bool stops_ = false, busy_ = false;
    std::optional<ShownPicture> shown_;
    std::optional<Error> error_;
    double share_ = 0.25; // of the next moving picture
    std::thread thread_;  // last: it uses all of the above
};

} // namespace trimray
