// What keys and buttons do: one table, from which the viewer acts, and from which its cheat sheet is made. Presets copy
// the habits of other programs for the mouse and for views; all else is the same in each.
#pragma once

#include "runtime/navigation.h"
#include "runtime/view/input.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace trimray {

enum class Action {
    // where one looks from
    Fit,
    FitSelection,
    ViewIso,
    ViewFront,
    ViewBack,
    ViewLeft,
    ViewRight,
    ViewTop,
    ViewBottom,
    ToggleParallel,
    ToggleTurntable,
    RollLeft,
    RollRight,
    // what is drawn
    CycleEdges,
    ToggleSilhouettes,
    ToggleOcclusion,
    ToggleShadows,
    CycleAntialias,
    ToggleXray,
    CycleMap,
    ToggleSection,
    ToggleHandles,
    // parts
    HideSelection,
    IsolateSelection,
    ShowAll,
    ClearSelection,
    ToggleMeasure,
    Search,
    // panels
    ToggleMenu,
    ToggleTree,
    ToggleLook,
    ToggleStatus,
    ToggleCosts,
    TimeEffects,
    DrawAccuracyCurve,
    ToggleErrors,
    ToggleTimes,
    ToggleCheatSheet,
    // files
    OpenFile,
    PreviousFile,
    NextFile,
    Reload,
    Screenshot,
    ScreenshotTransparent,
    SaveTurntable,
    Quit,
};

/// What it does, in words for the cheat sheet; and the heading that it stands below.
struct ActionText {
    const char* group;
    const char* what;
};
ActionText action_text(Action action);
/// All of them, as sheets and menus have them: those of a heading side by side.
std::vector<Action> all_actions();

enum class Drag { None, Orbit, Pan, Zoom };

/// Buttons held together, with modifiers, and what moving the pointer then does.
struct DragBinding {
    unsigned buttons = 0; // bit 1 << kLeftButton and so on
    int mods = 0;
    Drag drag = Drag::None;
    const char* says; // for the cheat sheet: "left drag"
};

struct KeyBinding {
    KeyChord chord;
    Action action;
};

/// The habits of a program.
struct Preset {
    const char* name;  // as options and menus have it: "f3d", "cad", "blender"
    const char* title; // "F3D"
    Turning turning;
    std::vector<DragBinding> drags;
    std::vector<KeyBinding> keys; // the first chord of an action is the one that is shown
};

const std::vector<Preset>& presets();
/// Null: no such preset.
const Preset* find_preset(std::string_view name);

std::optional<Action> action_of(const Preset& preset, const KeyChord& chord);
Drag drag_of(const Preset& preset, unsigned buttons, int mods);

/// The chords that cause an action, as "Enter, F"; "" where there are none.
std::string chords_of(const Preset& preset, Action action);

struct CheatSheetRow {
    std::string group, keys, what;
};
/// All that a preset binds, in the order of the actions, those of the mouse first.
std::vector<CheatSheetRow> cheat_sheet(const Preset& preset);

} // namespace trimray
