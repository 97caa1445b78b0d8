// Studies: what effects and accuracy cost in the view at hand, where its picture is wrong.
#include "runtime/view/viewer.h"

#include "runtime/scene_write.h"

#include <utility>
#include <variant>

namespace trimray {

void Viewer::study(StudyOrder::What what)
{
    if (model() && !series_)
        wanted_study_ = what;
}

void Viewer::cancel_study()
{
    wanted_study_.reset();
    study_.cancel();
}

void Viewer::show_errors(bool shown)
{
    shows_errors_ = shown;
    asked_errors_ = 0;
    if (!shown && study_.progress() && study_.progress()->what == StudyOrder::What::Errors)
        study_.cancel();
}

const ErrorMask* Viewer::errors() const
{
    return shows_errors_ && errors_ && errors_->picture == ordered_ ? &errors_->found : nullptr;
}

// What makes two pictures of one size show the same surfaces at the same pixels.
std::string Viewer::surfaces_seen() const
{
    SceneRequest seen;
    seen.cameras = {scene_camera(state_.camera)};
    seen.look.arrangement = state_.look.look.arrangement;
    seen.look.section.planes = state_.look.look.section.planes;
    return scene_text(seen);
}

void Viewer::start_study()
{
    if (!model() || study_.busy() || series_ || !shown_ || !shown_->complete || shown_->order != ordered_ || moving_ ||
        dirty_ || !pending_.empty())
        return;
    const bool wants_errors = shows_errors_ && asked_errors_ != ordered_ && hits_ && hits_->order == ordered_;
    if (!wanted_study_ && !wants_errors)
        return;
    const Result<RenderOptions> options = options_of(state_, size(), image());
    if (!options.ok())
        return;
    StudyOrder order;
    order.what = wanted_study_.value_or(StudyOrder::What::Errors);
    order.picture = ordered_;
    order.scene = model_->scene;
    order.options = *options;
    order.samples = state_.samples();
    order.view = surfaces_seen();
    if (std::exchange(wanted_study_, std::nullopt)) {
        pictures_.finish(); // it has nothing to do, and lets the tracer go
        order.tracer = model_->tracer;
    } else {
        asked_errors_ = ordered_;
        order.frame = hits_->frame;
    }
    study_.start(std::move(order));
}

void Viewer::take_study()
{
    if (const std::optional<Error> error = study_.take_error())
        tell(*error);
    std::optional<StudyFindings> findings = study_.take();
    if (!findings)
        return;
    ++shown_count_; // there is more to be seen
    const auto keep = [&](auto& place, auto& found) {
        place = {findings->picture, findings->complete, std::move(found)};
    };
    if (auto* const costs = std::get_if<EffectCosts>(&findings->found))
        keep(effect_costs_, *costs);
    else if (auto* const curve = std::get_if<AccuracyCurve>(&findings->found))
        keep(accuracy_curve_, *curve);
    else if (auto* const mask = std::get_if<ErrorMask>(&findings->found))
        keep(errors_, *mask);
}

// Of another model.
void Viewer::forget_studies()
{
    study_.finish();
    wanted_study_.reset();
    effect_costs_.reset();
    accuracy_curve_.reset();
    errors_.reset();
    asked_errors_ = 0;
}

} // namespace trimray
