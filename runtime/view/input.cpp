#include "runtime/view/input.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <sstream>

namespace trimray {
namespace {

static_assert(kModShift == GLFW_MOD_SHIFT && kModControl == GLFW_MOD_CONTROL && kModAlt == GLFW_MOD_ALT);
static_assert(kLeftButton == GLFW_MOUSE_BUTTON_LEFT && kRightButton == GLFW_MOUSE_BUTTON_RIGHT &&
              kMiddleButton == GLFW_MOUSE_BUTTON_MIDDLE);

struct NamedKey {
    int key;
    const char* name;
};
constexpr NamedKey kKeys[] = {
    {GLFW_KEY_SPACE, "Space"},
    {GLFW_KEY_APOSTROPHE, "'"},
    {GLFW_KEY_COMMA, ","},
    {GLFW_KEY_MINUS, "-"},
    {GLFW_KEY_PERIOD, "."},
    {GLFW_KEY_SLASH, "/"},
    {GLFW_KEY_SEMICOLON, ";"},
    {GLFW_KEY_EQUAL, "="},
    {GLFW_KEY_LEFT_BRACKET, "["},
    {GLFW_KEY_BACKSLASH, "\\"},
    {GLFW_KEY_RIGHT_BRACKET, "]"},
    {GLFW_KEY_GRAVE_ACCENT, "`"},
    {GLFW_KEY_ESCAPE, "Escape"},
    {GLFW_KEY_ENTER, "Enter"},
    {GLFW_KEY_TAB, "Tab"},
    {GLFW_KEY_BACKSPACE, "Backspace"},
    {GLFW_KEY_INSERT, "Insert"},
    {GLFW_KEY_DELETE, "Delete"},
    {GLFW_KEY_RIGHT, "Right"},
    {GLFW_KEY_LEFT, "Left"},
    {GLFW_KEY_DOWN, "Down"},
    {GLFW_KEY_UP, "Up"},
    {GLFW_KEY_PAGE_UP, "PageUp"},
    {GLFW_KEY_PAGE_DOWN, "PageDown"},
    {GLFW_KEY_HOME, "Home"},
    {GLFW_KEY_END, "End"},
    {GLFW_KEY_KP_DECIMAL, "Numpad."},
    {GLFW_KEY_KP_DIVIDE, "Numpad/"},
    {GLFW_KEY_KP_MULTIPLY, "Numpad*"},
    {GLFW_KEY_KP_SUBTRACT, "Numpad-"},
    {GLFW_KEY_KP_ADD, "Numpad+"},
    {GLFW_KEY_KP_ENTER, "NumpadEnter"},
    {GLFW_KEY_LEFT_SHIFT, "LeftShift"},
    {GLFW_KEY_LEFT_CONTROL, "LeftCtrl"},
    {GLFW_KEY_LEFT_ALT, "LeftAlt"},
    {GLFW_KEY_RIGHT_SHIFT, "RightShift"},
    {GLFW_KEY_RIGHT_CONTROL, "RightCtrl"},
    {GLFW_KEY_RIGHT_ALT, "RightAlt"},
};

constexpr struct {
    int mod;
    const char* name;
} kModifiers[] = {{kModControl, "Ctrl+"}, {kModShift, "Shift+"}, {kModAlt, "Alt+"}};

bool same_word(std::string_view a, std::string_view b)
{
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

Error not_understood(std::string_view line, const char* expected)
{
    return {ErrorCode::Usage, "", fmt::format("'{}': expected {}", line, expected)};
}

} // namespace

std::string key_name(int key)
{
    if ((key >= GLFW_KEY_A && key <= GLFW_KEY_Z) || (key >= GLFW_KEY_0 && key <= GLFW_KEY_9))
        return std::string(1, static_cast<char>(key)); // their numbers are ASCII's
    if (key >= GLFW_KEY_F1 && key <= GLFW_KEY_F25)
        return fmt::format("F{}", key - GLFW_KEY_F1 + 1);
    if (key >= GLFW_KEY_KP_0 && key <= GLFW_KEY_KP_9)
        return fmt::format("Numpad{}", key - GLFW_KEY_KP_0);
    for (const NamedKey& named : kKeys)
        if (named.key == key)
            return named.name;
    return "";
}

int key_of(std::string_view name)
{
    for (int key = GLFW_KEY_SPACE; key <= GLFW_KEY_LAST; ++key)
        if (const std::string known = key_name(key); !known.empty() && same_word(known, name))
            return key;
    return 0;
}

std::string modifier_names(int mods)
{
    std::string names;
    for (const auto& modifier : kModifiers)
        if ((mods & modifier.mod) != 0)
            names += modifier.name;
    return names;
}

std::string chord_name(const KeyChord& chord)
{
    return modifier_names(chord.mods) + key_name(chord.key);
}

KeyChord chord_of(std::string_view name)
{
    KeyChord chord;
    for (bool found = true; found;) {
        found = false;
        for (const auto& modifier : kModifiers) {
            const std::string_view word = modifier.name;
            if (name.size() > word.size() && same_word(name.substr(0, word.size()), word)) {
                chord.mods |= modifier.mod;
                name.remove_prefix(word.size());
                found = true;
            }
        }
    }
    chord.key = key_of(name);
    return chord;
}

const char* button_name(int button)
{
    return button == kLeftButton ? "left" : button == kRightButton ? "right" : "middle";
}

int button_of(std::string_view name)
{
    for (const int button : {kLeftButton, kRightButton, kMiddleButton})
        if (same_word(name, button_name(button)))
            return button;
    return -1;
}

std::string to_line(const InputEvent& event)
{
    using Kind = InputEvent::Kind;
    switch (event.kind) {
    case Kind::Move:
        return fmt::format("move {} {}", event.x, event.y);
    case Kind::Leave:
        return "leave";
    case Kind::Button:
        return fmt::format("{} {}{}", event.down ? "press" : "release", modifier_names(event.mods),
                           button_name(event.code));
    case Kind::Scroll:
        return fmt::format("scroll {} {}", event.x, event.y);
    case Kind::Key:
        return fmt::format("{} {}", event.down ? "down" : "up", chord_name({event.code, event.mods}));
    case Kind::Text:
        return "text " + event.text;
    case Kind::Drop: {
        std::string lines;
        for (const std::string& path : event.paths)
            lines += (lines.empty() ? "drop " : "\ndrop ") + path;
        return lines;
    }
    case Kind::Resize:
        return fmt::format("resize {} {}", event.x, event.y);
    case Kind::Close:
        break;
    }
    return "close";
}

Result<InputEvent> event_of(std::string_view line)
{
    using Kind = InputEvent::Kind;
    std::istringstream words{std::string(line)};
    words.imbue(std::locale::classic());
    std::string name;
    words >> name;
    InputEvent event;
    const auto rest = [&] {
        std::string text;
        std::getline(words >> std::ws, text);
        return text;
    };
    if (name == "move" || name == "scroll" || name == "resize") {
        event.kind = name == "move" ? Kind::Move : name == "scroll" ? Kind::Scroll : Kind::Resize;
        if (!(words >> event.x >> event.y))
            return not_understood(line, "two numbers");
    } else if (name == "press" || name == "release") {
        event.kind = Kind::Button;
        event.down = name == "press";
        std::string button = rest();
        const size_t plus = button.rfind('+');
        if (plus != std::string::npos) {
            event.mods = chord_of(button.substr(0, plus + 1) + "A").mods;
            button.erase(0, plus + 1);
        }
        event.code = button_of(button);
        if (event.code < 0)
            return not_understood(line, "left, middle or right");
    } else if (name == "down" || name == "up") {
        event.kind = Kind::Key;
        event.down = name == "down";
        const KeyChord chord = chord_of(rest());
        if (chord.key == 0)
            return not_understood(line, "a key, such as A, F12 or Ctrl+Left");
        event.code = chord.key;
        event.mods = chord.mods;
    } else if (name == "text") {
        event.kind = Kind::Text;
        event.text = rest();
    } else if (name == "drop") {
        event.kind = Kind::Drop;
        event.paths = {rest()};
    } else if (name == "leave" || name == "close") {
        event.kind = name == "leave" ? Kind::Leave : Kind::Close;
    } else {
        return not_understood(line, "move, press, release, scroll, down, up, text, drop, resize, leave or close");
    }
    return event;
}

} // namespace trimray
