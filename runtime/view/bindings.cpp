#include "runtime/view/bindings.h"

#include <algorithm>

namespace trimray {
namespace {

constexpr unsigned kLeft = 1u << kLeftButton, kRight = 1u << kRightButton, kMiddle = 1u << kMiddleButton;

struct NamedAction {
    Action action;
    ActionText text;
};
constexpr NamedAction kActions[] = {
    {Action::Fit, {"View", "show the whole model"}},
    {Action::FitSelection, {"View", "show what is selected"}},
    {Action::ViewIso, {"View", "from a corner (isometric)"}},
    {Action::ViewFront, {"View", "from the front"}},
    {Action::ViewBack, {"View", "from the back"}},
    {Action::ViewLeft, {"View", "from the left"}},
    {Action::ViewRight, {"View", "from the right"}},
    {Action::ViewTop, {"View", "from above"}},
    {Action::ViewBottom, {"View", "from below"}},
    {Action::ToggleParallel, {"View", "parallel rays or perspective"}},
    {Action::ToggleTurntable, {"View", "turntable or free turning"}},
    {Action::RollLeft, {"View", "roll the picture to the left"}},
    {Action::RollRight, {"View", "roll the picture to the right"}},
    {Action::CycleEdges, {"Drawing", "lines: none, sharp edges, all edges"}},
    {Action::ToggleSilhouettes, {"Drawing", "outlines"}},
    {Action::ToggleOcclusion, {"Drawing", "ambient occlusion"}},
    {Action::ToggleShadows, {"Drawing", "shadows"}},
    {Action::CycleAntialias, {"Drawing", "samples a pixel: 1, 4, 9"}},
    {Action::ToggleXray, {"Drawing", "see through everything"}},
    {Action::CycleMap, {"Drawing", "maps: none, zebra, isophotes, curvatures, draft"}},
    {Action::ToggleSection, {"Drawing", "cut by a plane"}},
    {Action::ToggleHandles, {"Drawing", "handles of planes that cut"}},
    {Action::TimeEffects, {"Accuracy", "time each effect of the picture"}},
    {Action::DrawAccuracyCurve, {"Accuracy", "what accuracy costs in this view"}},
    {Action::ToggleErrors, {"Accuracy", "show where the picture is wrong"}},
    {Action::HideSelection, {"Parts", "hide what is selected"}},
    {Action::IsolateSelection, {"Parts", "show what is selected alone"}},
    {Action::ShowAll, {"Parts", "show all parts"}},
    {Action::ClearSelection, {"Parts", "select nothing"}},
    {Action::ToggleMeasure, {"Parts", "measure"}},
    {Action::Search, {"Parts", "search by name"}},
    {Action::ToggleTree, {"Panels", "tree of parts"}},
    {Action::ToggleLook, {"Panels", "drawing and accuracy"}},
    {Action::ToggleStatus, {"Panels", "status line and file name"}},
    {Action::ToggleMenu, {"Panels", "menu"}},
    {Action::ToggleCosts, {"Panels", "what effects and accuracy cost"}},
    {Action::ToggleTimes, {"Panels", "times of a picture"}},
    {Action::ToggleCheatSheet, {"Panels", "this sheet"}},
    {Action::OpenFile, {"Files", "open a file"}},
    {Action::PreviousFile, {"Files", "previous file, or of the folder"}},
    {Action::NextFile, {"Files", "next file, or of the folder"}},
    {Action::Reload, {"Files", "read the file again"}},
    {Action::Screenshot, {"Files", "save the picture"}},
    {Action::ScreenshotTransparent, {"Files", "save the picture without a background"}},
    {Action::SaveTurntable, {"Files", "save 36 pictures of a turn"}},
    {Action::Quit, {"Files", "quit"}},
};

KeyBinding bind(const char* chord, Action action)
{
    return {chord_of(chord), action};
}

/// Those of every preset; where F3D has a key for the same, it is F3D's.
std::vector<KeyBinding> common_keys()
{
    return {
        bind("Enter", Action::Fit),
        bind("F", Action::FitSelection),
        bind("K", Action::ToggleTurntable),
        bind("E", Action::CycleEdges),
        bind("O", Action::ToggleSilhouettes),
        bind("Q", Action::ToggleOcclusion),
        bind("L", Action::ToggleShadows),
        bind("A", Action::CycleAntialias),
        bind("P", Action::ToggleXray),
        bind("C", Action::CycleMap),
        bind("X", Action::ToggleSection),
        bind("Shift+X", Action::ToggleHandles),
        bind("Shift+E", Action::TimeEffects),
        bind("Shift+W", Action::DrawAccuracyCurve),
        bind("W", Action::ToggleErrors),
        bind("Delete", Action::HideSelection),
        bind("I", Action::IsolateSelection),
        bind("Shift+I", Action::ShowAll),
        bind("Backspace", Action::ClearSelection),
        bind("M", Action::ToggleMeasure),
        bind("Ctrl+F", Action::Search),
        bind("T", Action::ToggleTree),
        bind("F10", Action::ToggleMenu),
        bind("Tab", Action::ToggleLook),
        bind("N", Action::ToggleStatus),
        bind("Shift+Tab", Action::ToggleCosts),
        bind("Z", Action::ToggleTimes),
        bind("H", Action::ToggleCheatSheet),
        bind("F1", Action::ToggleCheatSheet),
        bind("Left", Action::PreviousFile),
        bind("Right", Action::NextFile),
        bind("Up", Action::Reload),
        bind("F12", Action::Screenshot),
        bind("F11", Action::ScreenshotTransparent),
        bind("Shift+F12", Action::SaveTurntable),
        bind("Ctrl+O", Action::OpenFile),
        bind("Escape", Action::Quit),
        bind("Ctrl+Q", Action::Quit),
    };
}

Preset f3d()
{
    Preset preset{"f3d",
                  "F3D",
                  Turning::Turntable,
                  {{kLeft, 0, Drag::Orbit, "left drag"},
                   {kMiddle, 0, Drag::Pan, "middle drag"},
                   {kLeft, kModShift, Drag::Pan, "Shift + left drag"},
                   {kRight, 0, Drag::Zoom, "right drag"}},
                  common_keys()};
    for (const KeyBinding& key :
         {bind("9", Action::ViewIso), bind("1", Action::ViewFront), bind("Ctrl+1", Action::ViewBack),
          bind("3", Action::ViewRight), bind("Ctrl+3", Action::ViewLeft), bind("7", Action::ViewTop),
          bind("Ctrl+7", Action::ViewBottom), bind("5", Action::ToggleParallel), bind("4", Action::RollLeft),
          bind("6", Action::RollRight)})
        preset.keys.push_back(key);
    return preset;
}

Preset cad()
{
    Preset preset{"cad",
                  "FreeCAD",
                  Turning::Turntable,
                  {{kMiddle | kLeft, 0, Drag::Orbit, "middle + left drag"},
                   {kMiddle | kRight, 0, Drag::Orbit, "middle + right drag"},
                   {kRight, kModShift, Drag::Orbit, "Shift + right drag"},
                   {kMiddle, 0, Drag::Pan, "middle drag"},
                   {kRight, kModControl, Drag::Pan, "Ctrl + right drag"},
                   {kRight, kModControl | kModShift, Drag::Zoom, "Ctrl + Shift + right drag"}},
                  common_keys()};
    for (const KeyBinding& key :
         {bind("0", Action::ViewIso), bind("1", Action::ViewFront), bind("2", Action::ViewTop),
          bind("3", Action::ViewRight), bind("4", Action::ViewBack), bind("5", Action::ViewBottom),
          bind("6", Action::ViewLeft), bind("V", Action::ToggleParallel), bind("Shift+Left", Action::RollLeft),
          bind("Shift+Right", Action::RollRight)})
        preset.keys.push_back(key);
    return preset;
}

Preset blender()
{
    Preset preset{"blender",
                  "Blender",
                  Turning::Turntable,
                  {{kMiddle, 0, Drag::Orbit, "middle drag"},
                   {kMiddle, kModShift, Drag::Pan, "Shift + middle drag"},
                   {kMiddle, kModControl, Drag::Zoom, "Ctrl + middle drag"},
                   {kLeft, kModAlt, Drag::Orbit, "Alt + left drag"}},
                  common_keys()};
    for (const KeyBinding& key : {bind("Home", Action::Fit),
                                  bind("Numpad.", Action::FitSelection),
                                  bind("Numpad/", Action::IsolateSelection),
                                  bind("Numpad1", Action::ViewFront),
                                  bind("1", Action::ViewFront),
                                  bind("Ctrl+Numpad1", Action::ViewBack),
                                  bind("Ctrl+1", Action::ViewBack),
                                  bind("Numpad3", Action::ViewRight),
                                  bind("3", Action::ViewRight),
                                  bind("Ctrl+Numpad3", Action::ViewLeft),
                                  bind("Ctrl+3", Action::ViewLeft),
                                  bind("Numpad7", Action::ViewTop),
                                  bind("7", Action::ViewTop),
                                  bind("Ctrl+Numpad7", Action::ViewBottom),
                                  bind("Ctrl+7", Action::ViewBottom),
                                  bind("9", Action::ViewIso),
                                  bind("Numpad5", Action::ToggleParallel),
                                  bind("5", Action::ToggleParallel),
                                  bind("Shift+Numpad4", Action::RollLeft),
                                  bind("Shift+Numpad6", Action::RollRight)})
        preset.keys.push_back(key);
    return preset;
}

} // namespace

ActionText action_text(Action action)
{
    return std::find_if(std::begin(kActions), std::end(kActions),
                        [&](const NamedAction& a) { return a.action == action; })
        ->text;
}

std::vector<Action> all_actions()
{
    std::vector<Action> actions;
    for (const NamedAction& named : kActions)
        actions.push_back(named.action);
    return actions;
}

const std::vector<Preset>& presets()
{
    static const std::vector<Preset> all{f3d(), cad(), blender()};
    return all;
}

const Preset* find_preset(std::string_view name)
{
    for (const Preset& preset : presets())
        if (name == preset.name)
            return &preset;
    return nullptr;
}

std::optional<Action> action_of(const Preset& preset, const KeyChord& chord)
{
    for (const KeyBinding& binding : preset.keys)
        if (binding.chord == chord)
            return binding.action;
    return std::nullopt;
}

Drag drag_of(const Preset& preset, unsigned buttons, int mods)
{
    for (const DragBinding& binding : preset.drags)
        if (binding.buttons == buttons && binding.mods == mods)
            return binding.drag;
    return Drag::None;
}

std::string chords_of(const Preset& preset, Action action)
{
    std::string chords;
    for (const KeyBinding& binding : preset.keys)
        if (binding.action == action)
            chords += (chords.empty() ? "" : ", ") + chord_name(binding.chord);
    return chords;
}

std::vector<CheatSheetRow> cheat_sheet(const Preset& preset)
{
    std::vector<CheatSheetRow> rows;
    constexpr struct {
        Drag drag;
        const char* what;
    } kDrags[] = {{Drag::Orbit, "turn about the point in the middle"}, {Drag::Pan, "move"}, {Drag::Zoom, "zoom"}};
    for (const auto& named : kDrags) {
        std::string says;
        for (const DragBinding& binding : preset.drags)
            if (binding.drag == named.drag)
                says += (says.empty() ? "" : ", ") + std::string(binding.says);
        rows.push_back({"Mouse", says, named.what});
    }
    rows.push_back({"Mouse", "wheel", "zoom to what is under the pointer"});
    rows.push_back({"Mouse", "left click", "select a part's face"});
    rows.push_back({"Mouse", "Ctrl + left click", "select more parts, or fewer"});
    rows.push_back({"Mouse", "left drag of a handle", "move a plane that cuts; turn it by the ball"});
    rows.push_back({"Mouse", "left double click", "turn about the point under the pointer"});
    for (const NamedAction& named : kActions)
        if (std::string keys = chords_of(preset, named.action); !keys.empty())
            rows.push_back({named.text.group, std::move(keys), named.text.what});
    return rows;
}

} // namespace trimray
