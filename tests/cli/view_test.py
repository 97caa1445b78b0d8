"""The viewer's window, on a display without a screen: what recordings do, and what is seen then."""

import json
import os
import shutil
import subprocess
import threading
import time

from case import MODEL, OPTIONS, PACK, TESTS, WORK, CliTest, run
from pictures import read_png

SLOW = 4 if OPTIONS.sanitized else 1


def start_display():
    """The process of an X server and its name."""
    reading, writing = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-screen", "0", "1400x1000x24", "-noreset", "-displayfd", str(writing)],
        pass_fds=[writing], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(writing)
    with os.fdopen(reading) as pipe:
        return server, ":" + pipe.readline().strip()


class View(CliTest):
    @classmethod
    def setUpClass(cls):
        cls.server, cls.display = None, None
        if shutil.which("Xvfb"):
            cls.server, cls.display = start_display()

    @classmethod
    def tearDownClass(cls):
        if cls.server:
            cls.server.terminate()
            cls.server.wait()

    def setUp(self):
        super().setUp()
        if not (OPTIONS.bin / "trimray-view").exists():
            self.skipTest("no viewer in this build")
        if not self.server:
            self.skipTest("no Xvfb: apt install xvfb")
        self.folder = WORK / self._testMethodName
        self.folder.mkdir()
        self.cache = self.folder / "cache"  # drivers keep theirs in it too

    def view(self, script, *arguments, files=(PACK,), size="640x480", timeout=120 * SLOW, device="cpu"):
        """Plays the lines and gives the report; the process, if it failed."""
        recording = self.folder / "script.txt"
        recording.write_text(script)
        done = run("view", *files, "--play", recording, "--json", "--size", size, "--device", device, *arguments,
                   env=dict(os.environ, DISPLAY=self.display, XDG_CACHE_HOME=str(self.cache)), cwd=self.folder,
                   timeout=timeout)
        if done.returncode != 0:
            return done
        return json.loads(done.stdout)

    def same_as_render(self, picture, report):
        scene = picture.with_suffix(".json")
        size = f"{report['picture']['width']}x{report['picture']['height']}"
        self.ok("render", report["pack"], "--scene", scene, "--size", size, "--device", "cpu", "-o",
                self.folder / "again.png")
        self.assertEqual((self.folder / "again.png").read_bytes(), picture.read_bytes())

    def test_a_picture_is_what_render_makes_of_its_scene_file(self):
        report = self.view("wait\npicture first.png\nwait\ndrag left 300 200 380 260\nscroll 0 3\nwait\n"
                           "picture turned.png\nkey 5\nwait\npicture parallel.png\npicture clear.png transparent\n")
        for name in ["first", "turned", "parallel", "clear"]:
            self.same_as_render(self.folder / f"{name}.png", report)
        pictures = {(self.folder / f"{name}.png").read_bytes() for name in ["first", "turned", "parallel", "clear"]}
        self.assertEqual(len(pictures), 4)
        self.assertTrue(report["picture"]["complete"])
        self.assertGreater(report["camera"]["height_mm"], 0)

    def both_pictures(self, script, *arguments):
        """Pixels of the first picture, from the proxy, and of the traced one in its place: lists of RGB, without what
        panels cover. A tracer whose shaders are compiled anew leaves the time to see the first."""
        if not OPTIONS.has_pack:
            self.skipTest("the golden pack's proxy is none")
        if run("render", PACK, "-o", self.folder / "any.png", "--size", "16x16", "--device", "vulkan").returncode != 0:
            self.skipTest("no Vulkan driver, so no shaders to wait for")
        report = self.view(f"wait proxy\n{script}window first.png\nreport first.json\nwait\nwindow traced.png\n",
                           "--plain", *arguments, device="vulkan")
        first = json.loads((self.folder / "first.json").read_text())
        self.assertNotIn("picture", first, "the traced picture was there already")
        self.assertTrue(report["picture"]["complete"])
        self.assertLess(report["seconds"]["proxy"], report["seconds"]["first_picture"])
        self.assertEqual(first["camera"], report["camera"])
        pictures = []
        for name in ["first.png", "traced.png"]:
            width, height, rows = read_png(self.folder / name)
            pictures.append([row[4 * x : 4 * x + 3] for y, row in enumerate(rows[: height - 110])
                             for x in range(width) if x < width - 120 or y > 120])  # the cube of views
        return pictures

    def assert_same_place(self, first, traced):
        background = first[0]
        self.assertEqual(background, traced[0])
        only_one = sum((a == background) != (b == background) for a, b in zip(first, traced))
        both = [(a, b) for a, b in zip(first, traced) if a != background and b != background]
        self.assertGreater(len(both), 0.05 * len(first))
        # half a pixel along outlines, and what chords cut off arcs
        self.assertLess(only_one, 0.02 * (len(both) + only_one))
        # the same colours under the same light; triangles are flat, and small ones may lie before another
        off = sum(max(abs(x - y) for x, y in zip(a, b)) > 24 for a, b in both)
        self.assertLess(off, 0.1 * len(both))

    def test_the_first_picture_is_where_the_traced_one_will_be(self):
        self.assert_same_place(*self.both_pictures(""))

    def test_the_first_picture_turns_and_may_have_parallel_rays(self):
        self.assert_same_place(*self.both_pictures("drag left 300 200 380 260\nscroll 0 2\nkey 5\n"))

    def test_each_presets_mouse_turns_and_moves(self):
        moves = {"f3d": ("drag left", "drag middle"), "cad": ("drag Shift+right", "drag Ctrl+right"),
                 "blender": ("drag middle", "drag Shift+middle")}
        for preset, (turn, move) in moves.items():
            start = self.view("wait\n", "--navigation", preset)["camera"]
            turned = self.view(f"wait\n{turn} 300 200 400 200\nwait\n", "--navigation", preset)["camera"]
            moved = self.view(f"wait\n{move} 300 200 400 200\nwait\n", "--navigation", preset)["camera"]
            self.assertEqual(turned["target"], start["target"], preset)
            self.assertNotEqual(turned["eye"], start["eye"], preset)
            way = [b - a for a, b in zip(start["target"], moved["target"])]
            self.assertGreater(sum(x * x for x in way), 0, preset)
            for a, b, x in zip(start["eye"], moved["eye"], way):
                self.assertAlmostEqual(b - a, x, places=6)

    def test_a_click_selects_what_a_picture_has_there(self):
        if not OPTIONS.has_pack:
            self.skipTest("the golden pack has nothing there")
        report = self.view("wait\nmove 320 220\nclick 320 220\nwait\nwindow w.png\nreport r.json\n"
                           "click 3 60\nwait\n")
        picked = json.loads((self.folder / "r.json").read_text())["selection"]
        self.assertGreaterEqual(picked["face"], 0)
        self.assertEqual(picked["instance"], 0)
        self.assertNotIn("selection", report)  # the background is nothing
        width, height, _ = read_png(self.folder / "w.png")
        self.assertEqual((width, height), (640, 480))

    def test_parts_are_found_by_name_hidden_and_shown_alone(self):
        if not OPTIONS.has_pack:
            self.skipTest("no converter in this build")
        pack = self.folder / "two.tray"
        self.ok("pack", MODEL.parent / "red_cube_blue_cylinder.step", "-o", pack)
        report = self.view("wait\nkey Ctrl+F\nwait 0.2\ntext CYL\nwait 0.1\nkey Enter\nwait\nreport found.json\n"
                           "window w.png\nkey Delete\nwait\nreport hidden.json\npicture left.png\nwait\n"
                           "key Shift+I\nwait\nreport all.json\nkey Ctrl+F\nwait 0.2\nkey Enter\nwait\nkey I\nwait\n"
                           "picture alone.png\nwait\n", files=[pack])
        reports = {name: json.loads((self.folder / f"{name}.json").read_text()) for name in ["found", "hidden", "all"]}
        found = reports["found"]["selection"]["placements"]
        self.assertEqual(len(found), 1)
        self.assertEqual([reports[name]["hidden"] for name in ["found", "hidden", "all"]], [0, 1, 0])
        self.assertEqual(json.loads((self.folder / "left.json").read_text())["placements"],
                         {"hide": [f"@{found[0]}"]})
        self.assertEqual(report["hidden"], 1)
        self.assertEqual(report["selection"]["placements"], found)
        for name in ["left", "alone"]:
            self.same_as_render(self.folder / f"{name}.png", report)
        self.assertNotEqual((self.folder / "left.png").read_bytes(), (self.folder / "alone.png").read_bytes())

    def test_standard_views_are_those_of_render(self):
        report = self.view("wait\nkey 7\nwait\n", "--plain")
        up = report["camera"]["up"]
        way = [t - e for e, t in zip(report["camera"]["eye"], report["camera"]["target"])]
        self.assertAlmostEqual(way[0], 0, places=9)
        self.assertAlmostEqual(way[1], 0, places=9)
        self.assertLess(way[2], 0)
        self.assertEqual(up, [0, 1, 0])

    def test_the_window_follows_its_size(self):
        report = self.view("wait\nresize 500 400\nwait 0.5\nwait\nwindow w.png\n")
        self.assertEqual(read_png(self.folder / "w.png")[:2], (500, 400))
        self.assertEqual(report["picture"]["width"], 500)
        self.assertTrue(report["picture"]["complete"])

    def test_a_model_is_converted_into_the_cache_once(self):
        if not OPTIONS.has_pack:
            self.skipTest("no converter in this build")
        first = self.view("wait\n", files=[MODEL])
        self.assertGreater(first["convert_seconds"], 0)
        self.assertTrue(first["pack"].startswith(str(self.cache)))
        second = self.view("wait\n", files=[MODEL])
        self.assertEqual(second["convert_seconds"], 0)
        self.assertEqual(second["pack"], first["pack"])
        self.assertEqual([path.name for path in (self.cache / "trimray").rglob("*") if path.is_file()],
                         [os.path.basename(first["pack"])])

    def test_a_dropped_file_takes_the_place_of_the_first(self):
        other = self.folder / "other.tray"
        shutil.copy2(PACK, other)
        report = self.view(f"wait\ndrop {other}\nwait 0.3\nwait\n")
        self.assertEqual(report["file"], str(other))
        self.assertEqual(report["files"], [str(other)])

    def test_a_file_that_fails_is_told_and_what_is_there_stays(self):
        broken = self.folder / "broken.tray"
        broken.write_bytes(PACK.read_bytes()[:400])
        report = self.view(f"wait\ndrop {broken}\nwait 0.3\nwait\nreport r.json\ndrop {PACK}\nwait 0.3\nwait\n")
        told = json.loads((self.folder / "r.json").read_text())
        self.assertEqual(told["file"], str(PACK))
        self.assertIn("broken.tray", told["error"]["where"])
        self.assertNotIn("error", report)
        empty = self.folder / "empty.step"
        empty.write_bytes(b"")
        for file, code, words in [(broken, 3, "finding"), (self.folder, 2, "is a folder"), ("none.tray", 2, "none.tray"),
                                  (empty, *((3, "empty") if OPTIONS.has_pack else (4, "trimray-pack")))]:
            done = self.view("wait\n", files=[file])
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertIn(words, done.stderr)

    def test_a_picture_that_cannot_be_is_told_and_not_waited_for(self):
        done = self.view("wait\npicture p.png\nwait\n", "--hide", "#99")
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("#99", done.stderr)
        self.assertFalse((self.folder / "p.png").exists())
        done = self.view("wait\npicture none/p.png\nwait\n")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("none", done.stderr)

    def test_what_a_scene_file_has_no_key_for_is_in_the_command_told(self):
        report = self.view("wait\npicture p.png\nwait\n", "--trim", "kd", "--error-px", "0.25")
        told = [message for message in report["messages"] if message.startswith("saved p.png")]
        self.assertIn("--trim kd", told[0])
        self.assertIn("--error-px 0.25", told[0])

    def test_a_conversion_that_is_given_up_leaves_nothing_behind(self):
        if not OPTIONS.has_pack:
            self.skipTest("no converter in this build")
        big = self.folder / "big.step"
        big.write_bytes((MODEL.parent / "NIST_MBE_PMI_11.stp").read_bytes())
        report = self.view(f"wait\ndrop {big}\nwait 0.15\nclose\n")
        self.assertEqual(report["file"], str(PACK))
        time.sleep(0.5)
        self.assertEqual([path for path in (self.cache / "trimray").rglob("*") if path.is_file()], [])

    def test_what_is_recorded_plays_to_the_same_view(self):
        first = self.view("wait\ndrag left 300 200 350 260\nscroll 0 2\nkey E\nwait\npicture a.png\n", "--record",
                          "done.txt")
        lines = (self.folder / "done.txt").read_text()
        self.assertIn("press left", lines)
        second = self.view(lines.replace("close\n", "") + "wait\npicture b.png\n")
        self.assertEqual(second["camera"], first["camera"])
        self.assertEqual((self.folder / "a.png").read_bytes(), (self.folder / "b.png").read_bytes())

    def test_settings_and_recent_files_are_kept(self):
        other = self.folder / "other.tray"
        shutil.copy2(PACK, other)
        keep = ("--state", self.folder / "state")
        (self.folder / "state").mkdir()
        self.view(f"wait\nkey E\nkey T\nwait\ndrop {other}\nwait 0.3\nwait\n", "--navigation", "blender", *keep)
        settings = json.loads((self.folder / "state" / "settings.json").read_text())
        self.assertEqual((settings["navigation"], settings["panels"]["tree"]), ("blender", True))
        report = self.view("wait\npicture p.png\nkey Ctrl+O\nwait 0.2\nwindow w.png\nkey Escape\nwait\n", *keep)
        self.assertEqual(report["preset"], "blender")
        self.assertEqual(json.loads((self.folder / "p.json").read_text())["effects"]["edges"]["lines"], "all")
        self.assertLess(report["picture"]["width"], 640)  # the tree is there
        recent = [entry["file"] for entry in json.loads((self.folder / "state" / "recent.json").read_text())]
        self.assertEqual(recent, [str(PACK), str(other)])
        fresh = self.view("wait\n")  # a recording keeps and reads nothing but what it is told to
        self.assertEqual((fresh["preset"], fresh["picture"]["width"]), ("f3d", 640))
        broken = self.folder / "broken"
        broken.mkdir()
        (broken / "settings.json").write_text("{nonsense")
        self.view("wait\n", "--state", broken)
        self.assertEqual((broken / "settings.json").read_text(), "{nonsense")

    def test_arrow_keys_go_through_the_folder(self):
        models = self.folder / "models"
        models.mkdir()
        for name in ["b10.tray", "a.tray", "b9.tray", "notes.txt"]:
            shutil.copy2(PACK, models / name)
        seen = self.view("wait\nkey Right\nwait 0.1\nwait\nreport 1.json\nkey Right\nwait 0.1\nwait\nreport 2.json\n"
                         "key Left\nkey Left\nwait 0.1\nwait\n", files=[models / "a.tray"])
        seen = [json.loads((self.folder / f"{n}.json").read_text()) for n in (1, 2)] + [seen]
        self.assertEqual([os.path.basename(report["file"]) for report in seen], ["b9.tray", "b10.tray", "a.tray"])

    def test_faces_that_a_pack_has_not_are_told(self):
        golden = sorted((TESTS / "golden").glob("*.tray"))[0]
        report = self.view("wait\n", files=[golden], size="160x120")
        self.assertIn("1 face is missing (face 4 of part 1) because: its domain has no area", report["messages"])

    def test_a_file_that_is_written_anew_is_read_again(self):
        if not OPTIONS.has_pack:
            self.skipTest("no converter in this build")
        first, second = self.folder / "model.tray", self.folder / "two.tray"
        shutil.copy2(PACK, first)
        self.ok("pack", MODEL.parent / "red_cube_blue_cylinder.step", "-o", second)
        written = []

        def replace():
            while not (self.folder / "seen.json").exists():
                time.sleep(0.02)
            written.append(json.loads((self.folder / "seen.json").read_text())["placements"])
            os.replace(second, first)

        writer = threading.Thread(target=replace)
        writer.start()
        report = self.view(f"wait\ndrag left 300 200 350 260\nwait\nreport seen.json\nwait {1 * SLOW}\nwait\n",
                           files=[first])
        writer.join()
        self.assertEqual((written, report["placements"]), ([1], 2))
        self.assertEqual(report["camera"], json.loads((self.folder / "seen.json").read_text())["camera"])

    def test_a_turn_is_saved_as_render_makes_it(self):
        report = self.view("wait\nscroll 0 2\nwait\nkey Shift+F12\nwait\n", "--plain", size="160x120")
        pictures = sorted(self.folder.glob("*-turn-1_*.png"))
        self.assertEqual(len(pictures), 36)
        scene = next(self.folder.glob("*-turn-1.json"))
        size = f"{report['picture']['width']}x{report['picture']['height']}"
        self.ok("render", PACK, "--scene", scene, "--turntable", 36, "--size", size, "--device", "cpu", "-o",
                self.folder / "again_%03d.png")
        for number, picture in enumerate(pictures):
            again = self.folder / f"again_{number + 1:03}.png"
            self.assertEqual(picture.read_bytes(), again.read_bytes(), picture)
        self.assertNotEqual(pictures[0].read_bytes(), pictures[9].read_bytes())

    def test_effects_are_timed_on_request(self):
        report = self.view("wait\nkey Shift+E\nwait\nreport timed.json\nkey 7\nwait\n",
                           "--occlusion", "16", size="320x240")
        timed = json.loads((self.folder / "timed.json").read_text())["effects"]
        self.assertTrue(timed["of_this_view"])
        self.assertEqual(set(timed["ms"]), {"edges", "occlusion"})
        self.assertGreater(timed["ms"]["occlusion"], 0.2 * timed["picture_ms"])  # 16 rays where there was one
        self.assertLess(timed["ms"]["occlusion"], timed["picture_ms"])
        self.assertEqual(report["effects"], {**timed, "of_this_view": False})

    def test_the_curve_of_accuracy_is_of_the_view(self):
        report = self.view("wait\nkey Shift+W\nwait\n", size="160x120")
        curve = report["accuracy"]
        self.assertTrue(curve["complete"] and curve["in_double"])
        names = [point["name"] for point in curve["points"]]
        self.assertEqual(names[0], "now")
        self.assertIn("error 1 px", names)
        self.assertIn("stochastic, 4 frames", names)
        ms = {point["name"]: point["ms"] for point in curve["points"]}
        self.assertGreater(ms["stochastic, 16 frames"], ms["now"])
        self.assertTrue(any(point["pareto"] for point in curve["points"]))

    def test_a_view_that_changes_gives_a_study_up(self):
        report = self.view("wait\nkey Shift+W\nwait 0.1\ndrag left 300 200 380 260\nwait\npicture after.png\n")
        self.assertFalse(report.get("accuracy", {}).get("complete", False))
        self.assertEqual([m for m in report["messages"] if not m.startswith("saved") and "missing" not in m], [])
        self.same_as_render(self.folder / "after.png", report)

    def test_where_the_picture_is_wrong_is_laid_over_it(self):
        report = self.view("wait\nwindow without.png\nkey W\nwait\nwindow with.png\nreport first.json\nkey 7\nwait\n"
                           "report second.json\nkey W\nwait\nkey Shift+Tab\n", "--closest", "stochastic", size="320x240")
        self.assertNotIn("errors", report)
        _, _, without = read_png(self.folder / "without.png")
        _, height, over = read_png(self.folder / "with.png")
        # starts that were drawn by lot prove no pixel: all are marked as not certified
        left = 4 * 60  # where no panel is
        changed = sum(without[y][left - 4 : left] != over[y][left - 4 : left] for y in range(60, height - 60))
        self.assertEqual(changed, height - 120)
        for name in ["first", "second"]:  # each view's own
            told = json.loads((self.folder / f"{name}.json").read_text())
            self.assertEqual(told["errors"]["pixels"], told["picture"]["width"] * told["picture"]["height"])

    def test_a_plane_that_cuts_is_moved_and_turned_by_its_handle(self):
        if not OPTIONS.has_pack:
            self.skipTest("the golden pack's box is not that of its faces: its handle is out of the picture")
        start = self.view("wait\nkey X\nwait\nreport r.json\nkey Shift+X\nwait\n")
        self.assertNotIn("handles", start["section"])  # hidden
        first = json.loads((self.folder / "r.json").read_text())
        handle, plane = first["section"]["handles"][0], first["section"]["planes"][0]
        (mx, my), (bx, by) = handle["middle"], handle["ball"]
        way = [(bx - mx) / 2, (by - my) / 2]
        arrow = f"{mx + way[0]} {my + way[1]}"
        report = self.view(f"wait\nkey X\nwait\nwindow before.png\n"
                           f"drag left {arrow} {mx + 1.2 * way[0]} {my + 1.2 * way[1]}\nwait\npicture moved.png\n"
                           f"report moved.txt\n"
                           f"drag left {bx + 0.2 * way[0]} {by + 0.2 * way[1]} {bx + 30} {by - 25}\nwait\n"
                           f"picture turned.png\nwait\n")
        moved = json.loads((self.folder / "moved.txt").read_text())["section"]["planes"][0]
        self.assertEqual(moved["normal"], plane["normal"])
        along = sum((b - a) * n for a, b, n in zip(plane["point"], moved["point"], plane["normal"]))
        self.assertGreater(along, 0)  # to where the arrow points
        self.assertEqual(report["camera"], first["camera"])  # the view is not turned
        turned = report["section"]["planes"][0]
        cosine = sum(a * b for a, b in zip(turned["normal"], moved["normal"]))
        self.assertLess(cosine, 0.995)
        self.assertAlmostEqual(sum(a * a for a in turned["normal"]), 1, places=9)
        for name in ["moved", "turned"]:  # and their caps are render's
            self.same_as_render(self.folder / f"{name}.png", report)
        self.assertNotEqual((self.folder / "moved.png").read_bytes(), (self.folder / "turned.png").read_bytes())

    def test_pictures_go_to_the_folder_for_them_and_take_no_others_place(self):
        shots = self.folder / "shots"
        shots.mkdir()
        name = PACK.stem
        (shots / f"{name}-1.png").write_bytes(b"somebody's")
        report = self.view("wait\nkey F12\nwait\nkey F11\nwait\n", "--screenshots", shots, size="160x120")
        self.assertEqual((shots / f"{name}-1.png").read_bytes(), b"somebody's")
        self.assertEqual(sorted(file.name for file in shots.iterdir()),
                         sorted(f"{name}-{end}" for end in ["1.png", "2.png", "2.json", "3.png", "3.json"]))
        for number in [2, 3]:
            self.same_as_render(shots / f"{name}-{number}.png", report)
        failed = self.view("wait\nkey F12\nwait\n", "--screenshots", self.folder / "none", size="160x120")
        self.assertEqual(failed.returncode, 2)
        self.assertIn("none", failed.stderr)

    def test_a_scene_file_that_is_dropped_brings_its_view_back(self):
        report = self.view("wait\nkey O\ndrag left 300 200 380 260\nwait\npicture a.png\nwait\nreport a.txt\nkey 7\n"
                           f"key O\nwait\ndrop {self.folder}/a.json\nwait\npicture b.png\nwait\n")
        self.assertEqual(report["camera"], json.loads((self.folder / "a.txt").read_text())["camera"])
        self.assertEqual((self.folder / "a.png").read_bytes(), (self.folder / "b.png").read_bytes())

    def test_an_idle_window_leaves_the_processor_alone(self):
        self.view("wait\nwait 7\nreport a.json\nwait 5\nreport b.json\n")  # messages are gone by then
        before, after = (json.loads((self.folder / name).read_text()) for name in ["a.json", "b.json"])
        self.assertGreater(before["cpu_seconds"], 0)
        self.assertLess((after["cpu_seconds"] - before["cpu_seconds"]) / 5, 0.02)

    def test_window_after_window_ends_clean(self):
        if not OPTIONS.sanitized:
            self.skipTest("this build does not check for leaks")
        for _ in range(10):
            report = self.view("wait\n", size="160x120")  # a leak ends it with an error
            self.assertIn("picture", report)

    def test_on_a_display_of_twice_the_dots_all_is_twice_as_large(self):
        if not shutil.which("xprop"):
            self.skipTest("no xprop: apt install x11-utils")
        script = "wait\nkey T\nwait\nclick {} {}\nwait\nwindow {}\n"
        once = self.view(script.format(400, 250, "once.png") + "report once.json\n", size="600x400")
        display = dict(os.environ, DISPLAY=self.display)
        resources = ["xprop", "-root", "-f", "RESOURCE_MANAGER", "8s"]
        subprocess.run([*resources, "-set", "RESOURCE_MANAGER", "Xft.dpi:\t192\n"], env=display, check=True)
        try:
            twice = self.view(script.format(800, 500, "twice.png") + "picture p.png\nwait\n", size="600x400")
        finally:
            subprocess.run(["xprop", "-root", "-remove", "RESOURCE_MANAGER"], env=display, check=True)
        self.assertEqual(read_png(self.folder / "twice.png")[:2], (1200, 800))
        for side in ["width", "height"]:  # panels and lines of text leave the same room, but for rounding
            self.assertAlmostEqual(twice["picture"][side] / once["picture"][side], 2, delta=0.02)
        self.assertEqual(twice.get("selection", {}).get("face"), once.get("selection", {}).get("face"))
        self.same_as_render(self.folder / "p.png", twice)

    def test_without_a_display_the_error_names_render(self):
        environment = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
        done = run("view", PACK, env=environment)
        self.assertEqual(done.returncode, 4)
        self.assertIn("trimray render", done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1)

    def test_wrong_arguments_and_recordings_are_told(self):
        self.assertEqual(run("view", "--navigation", "maya", PACK).returncode, 1)
        recording = self.folder / "wrong.txt"
        recording.write_text("wait\ndance\n")
        done = run("view", PACK, "--play", recording)
        self.assertEqual(done.returncode, 1)
        self.assertIn("wrong.txt:2", done.stderr)
        self.assertEqual(run("view", PACK, "--play", self.folder / "none.txt").returncode, 2)
        self.assertIn("Examples", self.ok("view", "--help").stdout)
