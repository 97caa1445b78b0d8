#include "runtime/view/view_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace trimray {
namespace {

constexpr double kStudySeconds = 6; // of rounds, after which no other begins

} // namespace

PictureSize study_size(PictureSize size)
{
    const double pixels = double(size.width) * size.height;
    const double share = std::min(1.0, std::sqrt(double(kStudyPixels) / pixels));
    return {std::max(1u, uint32_t(size.width * share)), std::max(1u, uint32_t(size.height * share))};
}

ViewStudy::ViewStudy(std::function<void()> wake) : wake_(std::move(wake)), thread_([this] { run(); }) {}

ViewStudy::~ViewStudy()
{
    cancelled_ = true;
    {
        const std::lock_guard lock(mutex_);
        stops_ = true;
        wanted_.reset();
    }
    changed_.notify_all();
    thread_.join();
}

void ViewStudy::start(StudyOrder order)
{
    {
        const std::lock_guard lock(mutex_);
        cancelled_ = false;
        busy_ = true;
        uses_tracer_ = order.tracer != nullptr;
        what_ = order.what;
        doing_ = "beginning";
        share_ = 0;
        found_.reset();
        error_.reset();
        wanted_ = std::move(order);
    }
    changed_.notify_all();
}

void ViewStudy::cancel()
{
    cancelled_ = true;
}

void ViewStudy::finish()
{
    cancel();
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !busy_; });
    found_.reset();
    reference_.reset(); // it holds the scene
    reference_view_.clear();
}

std::optional<ViewStudy::Progress> ViewStudy::progress() const
{
    const std::lock_guard lock(mutex_);
    if (!busy_)
        return std::nullopt;
    return Progress{what_, doing_, share_};
}

std::optional<StudyFindings> ViewStudy::take()
{
    const std::lock_guard lock(mutex_);
    return std::exchange(found_, std::nullopt);
}

std::optional<Error> ViewStudy::take_error()
{
    const std::lock_guard lock(mutex_);
    return std::exchange(error_, std::nullopt);
}

void ViewStudy::say(const std::string& doing, double share)
{
    {
        const std::lock_guard lock(mutex_);
        if (doing == doing_ && share < share_ + 0.01 && share > share_)
            return; // nobody sees so little
        doing_ = doing;
        share_ = share;
    }
    wake_();
}

void ViewStudy::publish(const StudyOrder& order, std::variant<EffectCosts, AccuracyCurve, ErrorMask> found,
                        bool complete)
{
    {
        const std::lock_guard lock(mutex_);
        found_ = StudyFindings{order.picture, complete, std::move(found)};
    }
    wake_();
}

void ViewStudy::run()
{
    std::unique_lock lock(mutex_);
    for (;;) {
        changed_.wait(lock, [this] { return stops_ || wanted_; });
        if (stops_)
            return;
        Status done = Done{};
        {
            StudyOrder order = *std::exchange(wanted_, std::nullopt);
            lock.unlock();
            done = work_on(order);
        } // lets go of tracer and scene
        lock.lock();
        if (!done.ok() && done.error().code != ErrorCode::Interrupted)
            error_ = done.error();
        busy_ = uses_tracer_ = false;
        changed_.notify_all();
        lock.unlock();
        wake_();
        lock.lock();
    }
}

Result<ViewReference*> ViewStudy::reference_of(const StudyOrder& order, const RenderOptions& options,
                                               const std::string& view)
{
    if (reference_ && reference_view_ == view)
        return &*reference_;
    reference_.reset();
    Result<ViewReference> made =
        ViewReference::make(order.scene, options, [this](double share) { say("tracing the truth", share); });
    if (!made.ok())
        return made.error();
    reference_ = std::move(*made);
    reference_view_ = view;
    return &*reference_;
}

Status ViewStudy::work_on(StudyOrder& order)
{
    RenderOptions& options = order.options;
    options.cancelled = [this] { return cancelled_.load(); };
    options.reuse_last = false;
    const PackImage& image = order.scene->pack.image;
    switch (order.what) {
    case StudyOrder::What::Effects: {
        const TurnOptions turns{.samples = order.samples, .seconds = kStudySeconds, .progress = [this](double share) {
                                    say("timing each effect", share);
                                }};
        Result<EffectCosts> costs = measure_effect_costs(*order.tracer, image, options, turns);
        if (!costs.ok())
            return costs.error();
        publish(order, std::move(*costs), true);
        return Done{};
    }
    case StudyOrder::What::Accuracy: {
        const PictureSize size = study_size({options.width, options.height});
        options.width = size.width;
        options.height = size.height;
        const Result<ViewReference*> reference =
            reference_of(order, options, fmt::format("{} {} x {}", order.view, size.width, size.height));
        if (!reference.ok())
            return reference.error();
        const TurnOptions turns{.seconds = kStudySeconds,
                                .progress = [this](double share) { say("timing each setting", share); }};
        Result<AccuracyCurve> curve =
            measure_accuracy_curve(*order.tracer, image, **reference, options, turns,
                                   [&](const AccuracyCurve& so_far) { publish(order, so_far, false); });
        if (!curve.ok())
            return curve.error();
        publish(order, std::move(*curve), true);
        return Done{};
    }
    case StudyOrder::What::Errors: {
        const Result<ViewReference*> reference =
            reference_of(order, options, fmt::format("{} {} x {}", order.view, options.width, options.height));
        if (!reference.ok())
            return reference.error();
        Result<ErrorMask> mask = error_mask(**reference, order.frame, options.error_px, options.cancelled);
        if (!mask.ok())
            return mask.error();
        publish(order, std::move(*mask), true);
        return Done{};
    }
    }
    return Done{};
}

} // namespace trimray
