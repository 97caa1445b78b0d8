// What all panels are made of.
#pragma once

#include "runtime/view/gl_picture.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <utility>

namespace trimray {

inline constexpr ImGuiWindowFlags kBare = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                          ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav |
                                          ImGuiWindowFlags_NoFocusOnAppearing;
inline constexpr ImGuiWindowFlags kPanel = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize |
                                           ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse |
                                           ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav;

inline void text(const std::string& words)
{
    ImGui::TextUnformatted(words.data(), words.data() + words.size());
}

inline ImTextureID texture_of(const GlPicture& picture)
{
    return reinterpret_cast<ImTextureID>(static_cast<uintptr_t>(picture.texture()));
}

/// The height of a letter: what lengths in the interface are counted in.
inline float em()
{
    return ImGui::GetFontSize();
}

/// The thickness of a line that is as fine as can be seen well.
inline float hairline()
{
    return std::max(1.0f, std::round(em() / 15));
}

/// A choice among words; true: it was changed.
template <class T, size_t N>
bool choose(const char* label, T& value, const std::pair<T, const char*> (&choices)[N])
{
    bool changed = false;
    const auto now =
        std::find_if(std::begin(choices), std::end(choices), [&](const auto& c) { return c.first == value; });
    if (!ImGui::BeginCombo(label, now == std::end(choices) ? "?" : now->second))
        return false;
    for (const auto& [choice, name] : choices)
        if (ImGui::Selectable(name, choice == value)) {
            changed = choice != value;
            value = choice;
        }
    ImGui::EndCombo();
    return changed;
}

} // namespace trimray
