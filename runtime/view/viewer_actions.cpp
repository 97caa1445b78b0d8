// What each action of the table of bindings does.
#include "runtime/view/viewer.h"

#include <algorithm>
#include <array>
#include <utility>

namespace trimray {
namespace {
constexpr uint32_t kTurnSteps = 36;

/// The next of `values` after `now`, or the first.
template <class T, size_t N>
T next_of(const std::array<T, N>& values, const T& now)
{
    const auto at = std::find(values.begin(), values.end(), now);
    return at == values.end() || at + 1 == values.end() ? values.front() : *(at + 1);
}

const char* view_of(Action action)
{
    switch (action) {
    case Action::ViewFront:
        return "front";
    case Action::ViewBack:
        return "back";
    case Action::ViewLeft:
        return "left";
    case Action::ViewRight:
        return "right";
    case Action::ViewTop:
        return "top";
    case Action::ViewBottom:
        return "bottom";
    default:
        return "iso";
    }
}

} // namespace

void Viewer::act(Action action)
{
    if (series_ && action == Action::Quit)
        return end_series("the turn is given up", false);
    if (series_)
        return tell("pictures of a turn are being saved; " + chords_of(*preset_, Action::Quit) + " ends that");
    if (act_on_window(action) || !has_view() || act_on_view(action) || act_on_parts(action))
        return;
    if (act_on_look(action))
        changed();
    else
        look_from(view_of(action));
}

// Files and panels: what there is to do without a model, too. False: it is none of these actions, as below.
bool Viewer::act_on_window(Action action)
{
    switch (action) {
    case Action::Quit:
        if (panels.open) // what lies over the picture goes first
            panels.open = false;
        else if (panels.cheat_sheet)
            panels.cheat_sheet = false;
        else
            quits_ = true;
        return true;
    case Action::NextFile:
        step_file(1);
        return true;
    case Action::PreviousFile:
        step_file(-1);
        return true;
    case Action::OpenFile:
        panels.open = !panels.open;
        return true;
    case Action::Reload:
        if (!files_.empty()) {
            keeps_view_ = true;
            begin_load();
        }
        return true;
    case Action::ToggleMenu:
        panels.menu = !panels.menu;
        return true;
    case Action::ToggleTree:
        panels.tree = !panels.tree;
        return true;
    case Action::Search:
        panels.tree = panels.wants_search = true;
        return true;
    case Action::ToggleLook:
        panels.look = !panels.look;
        return true;
    case Action::ToggleStatus:
        panels.status = !panels.status;
        return true;
    case Action::ToggleCosts:
        panels.costs = !panels.costs;
        return true;
    case Action::TimeEffects:
        panels.costs = true;
        study(StudyOrder::What::Effects);
        return true;
    case Action::DrawAccuracyCurve:
        panels.costs = true;
        study(StudyOrder::What::Accuracy);
        return true;
    case Action::ToggleErrors:
        panels.costs |= !shows_errors_;
        show_errors(!shows_errors_);
        return true;
    case Action::ToggleTimes:
        panels.times = !panels.times;
        return true;
    case Action::ToggleCheatSheet:
        panels.cheat_sheet = !panels.cheat_sheet;
        return true;
    case Action::ToggleHandles:
        panels.handles = !panels.handles;
        return true;
    case Action::ToggleMeasure:
        panels.measure = !panels.measure;
        return true;
    case Action::ToggleTurntable:
        turning_ = turning_ == Turning::Turntable ? Turning::Free : Turning::Turntable;
        tell(turning_ == Turning::Turntable ? "turns like a turntable" : "turns freely");
        return true;
    case Action::ClearSelection:
        select({});
        return true;
    default:
        return false;
    }
}

bool Viewer::act_on_view(Action action)
{
    switch (action) {
    case Action::Fit:
        frame([this] { return visible_reach(); });
        return true;
    case Action::FitSelection:
        if (selection_.empty())
            frame([this] { return visible_reach(); });
        return true;
        frame([this, fitted = selection_.placements] { return placements_reach(image(), placed(), fitted); });
        return true;
    case Action::ToggleParallel:
        look_along(state_.camera.orthographic_mm > 0 ? with_perspective(state_.camera)
                                                     : with_parallel_rays(state_.camera));
        return true;
    case Action::RollLeft:
        look_along(roll(state_.camera, -90));
        return true;
    case Action::RollRight:
        look_along(roll(state_.camera, 90));
        return true;
    case Action::Screenshot:
    case Action::ScreenshotTransparent:
        save_numbered_picture(action == Action::ScreenshotTransparent);
        return true;
    case Action::SaveTurntable:
        save_turntable(kTurnSteps);
        return true;
    default:
        return false;
    }
}

bool Viewer::act_on_parts(Action action)
{
    switch (action) {
    case Action::HideSelection:
    case Action::IsolateSelection: {
        if (selection_.empty()) {
            tell("nothing is selected: click a part first");
            return true;
        }
        const std::vector<uint32_t> selected = selection_.placements;
        if (action == Action::IsolateSelection) {
            show_alone(state_.look.look.arrangement, image().instances.size(), selected);
            changed();
            return true;
        }
        select({});
        show(selected, false);
        return true;
    }
    case Action::ShowAll:
        state_.look.look.arrangement.only.clear();
        state_.look.look.arrangement.hide.clear();
        changed();
        return true;
    default:
        return false;
    }
}

// How things are drawn, from the next picture on.
bool Viewer::act_on_look(Action action)
{
    SceneRequest& look = state_.look;
    switch (action) {
    case Action::CycleEdges:
        look.edges = next_of(std::array{EdgeLines::None, EdgeLines::Sharp, EdgeLines::All},
                             look.edges.value_or(EdgeLines::None));
        return true;
    case Action::ToggleSilhouettes:
        look.silhouettes = !look.silhouettes.value_or(false);
        return true;
    case Action::ToggleOcclusion:
        look.look.occlusion.samples = look.look.occlusion.samples > 0 ? 0 : 16;
        return true;
    case Action::ToggleShadows:
        look.shadows =
            look.shadows.value_or(ShadowKind::None) == ShadowKind::None ? ShadowKind::Hard : ShadowKind::None;
        return true;
    case Action::CycleAntialias:
        look.samples = next_of(std::array<uint32_t, 3>{1, 2, 3}, state_.samples());
        return true;
    case Action::ToggleXray:
        look.look.xray = look.look.xray ? std::nullopt : std::optional(0.35f);
        return true;
    case Action::CycleMap:
        look.look.map.map = next_of(std::array{SurfaceMap::None, SurfaceMap::Zebra, SurfaceMap::Isophotes,
                                               SurfaceMap::CurvatureGaussian, SurfaceMap::CurvatureMean,
                                               SurfaceMap::CurvatureMax, SurfaceMap::CurvatureMin, SurfaceMap::Draft},
                                    look.look.map.map);
        return true;
    case Action::ToggleSection:
        if (look.look.section.planes.empty())
            look.look.section.planes = {section_through_middle(placed(), 1)};
        else
            look.look.section.planes.clear();
        return true;
    default:
        return false;
    }
}

} // namespace trimray
