// What a person does to the window, as plain events: what the window system says becomes these, and so do the lines of
// a recording. Every part of the viewer takes its input from here, so a recording drives the very same code.
#pragma once

#include "format/result.h"

#include <string>
#include <string_view>
#include <vector>

namespace trimray {

// Numbers of buttons and modifiers, and those of keys, are GLFW's
constexpr int kLeftButton = 0, kRightButton = 1, kMiddleButton = 2;
constexpr int kModShift = 1, kModControl = 2, kModAlt = 4;
constexpr int kModMask = 7; // of those that bindings tell apart

struct InputEvent {
    enum class Kind {
        Move,   // the pointer, to x, y: framebuffer pixels from the window's upper left corner
        Leave,  // the pointer, out of the window
        Button, // `code`, down or up
        Scroll, // by x, y steps; y > 0: away from the hand
        Key,    // `code`, down (again, while it is held) or up
        Text,   // `text`, typed
        Drop,   // `paths`, onto the window
        Resize, // the framebuffer, to x, y pixels
        Close,
    };
    Kind kind = Kind::Move;
    double x = 0, y = 0;
    int code = 0;
    bool down = false;
    int mods = 0; // kMod...
    std::string text = {};
    std::vector<std::string> paths = {};
};

/// A key's name as bindings and recordings have it: "A", "F12", "Escape", "Left"; "" where it has none.
std::string key_name(int key);
/// The key of a name, in any case; 0: there is none such.
int key_of(std::string_view name);

/// "Ctrl+Shift+" and the like.
std::string modifier_names(int mods);

/// A key with its modifiers, as "Ctrl+F12"; 0 in `key`: the text names none.
struct KeyChord {
    int key = 0, mods = 0;
    bool operator==(const KeyChord&) const = default;
};
std::string chord_name(const KeyChord& chord);
KeyChord chord_of(std::string_view name);

/// "left", "right", "middle".
const char* button_name(int button);
/// -1: there is none such.
int button_of(std::string_view name);

/// An event as a line of a recording: "move 120 80", "press left", "release left Shift", "scroll 0 1", "down Ctrl+F12",
/// "up F12", "text abc", "drop PATH", "resize 800 600", "leave", "close". A drop of several is a line each.
std::string to_line(const InputEvent& event);

/// The event of such a line. Fails: Usage, with what was expected.
Result<InputEvent> event_of(std::string_view line);

} // namespace trimray
