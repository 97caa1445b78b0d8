#include "runtime/view/panels.h"
#include "runtime/view/widgets.h"

#include <optional>
#include <string_view>
#include <vector>

namespace trimray {

float draw_menu_bar(Viewer& viewer)
{
    float height = 0;
    if (!ImGui::BeginMainMenuBar())
        return height;
    height = ImGui::GetWindowSize().y;
    const std::vector<Action> actions = all_actions();
    std::optional<Action> chosen;
    for (size_t i = 0; i < actions.size();) {
        const std::string_view group = action_text(actions[i]).group;
        const bool open = ImGui::BeginMenu(group.data());
        for (; i < actions.size() && action_text(actions[i]).group == group; ++i)
            if (open && ImGui::MenuItem(action_text(actions[i]).what, chords_of(viewer.preset(), actions[i]).c_str()))
                chosen = actions[i];
        if (open)
            ImGui::EndMenu();
    }
    ImGui::EndMainMenuBar();
    if (chosen)
        viewer.act(*chosen);
    return height;
}

} // namespace trimray
