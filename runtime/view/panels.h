// The panels that keep nothing of their own: each draws one window of the interface, from the viewer and into it.
// Lengths in framebuffer pixels; `scale` is that of text and controls.
#pragma once

#include "runtime/view/viewer.h"

namespace trimray {

/// What is picked or under the pointer, along the window's lower side.
void draw_status_line(Viewer& viewer, int width, int height, float scale);
float status_line_height(float scale);

void draw_view_cube(Viewer& viewer, float scale);
/// What the colours of the map stand for, where one is drawn, and its value under the pointer.
void draw_legend_panel(Viewer& viewer, float scale);
/// What the effects and the accuracy of the view at hand cost, on request; where the picture is wrong.
void draw_costs_panel(Viewer& viewer, float scale);
void draw_look_panel(Viewer& viewer, float scale);
/// The planes that cut, as a part of the panel at hand. True: one was changed.
bool edit_section(Viewer& viewer);
/// What they are moved by, over the picture.
void draw_section_handles(Viewer& viewer, float scale);
void draw_measure_panel(Viewer& viewer, float scale);
void draw_times_panel(Viewer& viewer, float scale);
void draw_cheat_sheet(Viewer& viewer, int width, int height, float scale);

/// The actions in menus, by the headings of the cheat sheet. Returns the height of their bar.
float draw_menu_bar(Viewer& viewer);

} // namespace trimray
