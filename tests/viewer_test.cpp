// The viewer's table of keys, its lines of recordings, and the size that keeps the rate.
#include "runtime/view/bindings.h"
#include "runtime/view/picture_thread.h"
#include "runtime/view/script.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <string>

namespace trimray {
namespace {

TEST(bindings, no_preset_binds_a_chord_twice)
{
    for (const Preset& preset : presets()) {
        std::set<std::string> seen;
        for (const KeyBinding& binding : preset.keys) {
            EXPECT_NE(binding.chord.key, 0) << preset.name;
            EXPECT_TRUE(seen.insert(chord_name(binding.chord)).second) << preset.name << chord_name(binding.chord);
        }
        std::set<std::pair<unsigned, int>> drags;
        for (const DragBinding& drag : preset.drags)
            EXPECT_TRUE(drags.insert({drag.buttons, drag.mods}).second) << preset.name << drag.says;
    }
}

TEST(bindings, every_preset_can_turn_move_and_zoom_and_has_the_views)
{
    for (const Preset& preset : presets()) {
        for (const Action action : {Action::Fit, Action::ViewIso, Action::ViewFront, Action::ViewTop,
                                    Action::ToggleParallel, Action::ToggleCheatSheet, Action::Quit})
            EXPECT_NE(chords_of(preset, action), "") << preset.name << action_text(action).what;
        for (const Drag wanted : {Drag::Orbit, Drag::Pan}) {
            bool found = false;
            for (const DragBinding& drag : preset.drags)
                found |= drag.drag == wanted;
            EXPECT_TRUE(found) << preset.name;
        }
    }
}

TEST(bindings, the_cheat_sheet_has_each_binding)
{
    for (const Preset& preset : presets()) {
        std::string all;
        for (const CheatSheetRow& row : cheat_sheet(preset)) {
            EXPECT_NE(row.keys, "") << row.what;
            all += row.keys + "\n";
        }
        for (const KeyBinding& binding : preset.keys)
            EXPECT_NE(all.find(chord_name(binding.chord)), std::string::npos) << chord_name(binding.chord);
        for (const DragBinding& drag : preset.drags)
            EXPECT_NE(all.find(drag.says), std::string::npos) << drag.says;
    }
}

TEST(input, chords_are_read_as_they_are_named)
{
    for (const Preset& preset : presets())
        for (const KeyBinding& binding : preset.keys)
            EXPECT_EQ(chord_of(chord_name(binding.chord)), binding.chord) << chord_name(binding.chord);
    EXPECT_EQ(chord_of("shift+ctrl+a"), (KeyChord{'A', kModControl | kModShift}));
    EXPECT_EQ(chord_of("Hyper+A").key, 0);
}

TEST(input, events_are_read_as_they_are_written)
{
    for (const char* line :
         {"move 12.5 80", "leave", "press left", "release Ctrl+Shift+middle", "scroll 0 -1", "down Ctrl+F12",
          "up Escape", "text a b", "drop /tmp/a b.tray", "resize 800 600", "close"}) {
        const Result<InputEvent> event = event_of(line);
        ASSERT_TRUE(event.ok()) << line;
        EXPECT_EQ(to_line(*event), line);
    }
    for (const char* line : {"move 1", "press nose", "down Nothing", "dance", ""})
        EXPECT_FALSE(event_of(line).ok()) << line;
}

TEST(script, a_drag_is_a_press_moves_and_a_release)
{
    const std::string file = testing::TempDir() + "viewer_script.txt";
    std::ofstream(file) << "# how it begins\n\ndrag Shift+right 0 0 40 20 4\npicture a b.png transparent\nwait\n";
    const Result<std::deque<ScriptStep>> steps = read_script(file);
    ASSERT_TRUE(steps.ok());
    ASSERT_EQ(steps->size(), 9u); // move, press, 4 moves, release, picture, wait
    const InputEvent& press = std::get<InputEvent>((*steps)[1]);
    EXPECT_EQ(press.code, kRightButton);
    EXPECT_EQ(press.mods, kModShift);
    EXPECT_TRUE(press.down);
    EXPECT_EQ(std::get<InputEvent>((*steps)[3]).x, 20);
    EXPECT_FALSE(std::get<InputEvent>((*steps)[6]).down);
    EXPECT_EQ(std::get<SaveFile>((*steps)[7]).what, SaveFile::What::TransparentPicture);
    EXPECT_EQ(std::get<SaveFile>((*steps)[7]).file, "a b.png");
}

TEST(script, waits_for_what_it_says)
{
    const std::string file = testing::TempDir() + "waits.txt";
    std::ofstream(file) << "wait\nwait proxy\nwait 0.5\n";
    const Result<std::deque<ScriptStep>> steps = read_script(file);
    ASSERT_TRUE(steps.ok());
    ASSERT_EQ(steps->size(), 3u);
    EXPECT_TRUE(std::holds_alternative<WaitForRest>((*steps)[0]));
    EXPECT_TRUE(std::holds_alternative<WaitForProxy>((*steps)[1]));
    EXPECT_EQ(std::get<WaitSeconds>((*steps)[2]).seconds, 0.5);
    std::ofstream(file) << "wait for it\n";
    EXPECT_FALSE(read_script(file).ok());
}

TEST(picture_size, follows_the_time_that_a_moving_picture_takes)
{
    EXPECT_EQ(next_share(1, 20, 33), 1);            // in time: nothing is to be gained
    EXPECT_NEAR(next_share(1, 132, 33), 0.5, 1e-9); // four times too slow: half as wide and high
    EXPECT_EQ(next_share(0.5, 33, 33), 0.5);
    EXPECT_EQ(next_share(0.5, 36, 33), 0.5); // a little late: no other size for that
    EXPECT_GT(next_share(0.25, 5, 33), 0.25);
    EXPECT_EQ(next_share(1.0 / 16, 1e6, 33), 1.0 / 16);
}

} // namespace
} // namespace trimray
