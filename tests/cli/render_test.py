import json

from case import MODEL, PACK, WORK, CliTest, run
from pictures import alphas, read_png


class Render(CliTest):
    needs_pack = True
    KEYS = ["device", "width", "height", "frames", "trim", "closest", "ms_per_frame", "rays_per_second", "bytes",
            "effects", "uncertified_pixels", "work"]

    def render(self, name, *arguments):
        self.ok("render", PACK, "-o", WORK / name, "--device", "cpu", *arguments)
        return WORK / name

    def test_json_has_the_agreed_keys(self):
        report = self.json_of("render", PACK, "-o", WORK / "a.png", "--size", "64x48", "--device", "cpu", "--frames", 3,
                              "--trim", "exact", "--json")
        self.assertEqual(list(report), self.KEYS)
        self.assertEqual((report["width"], report["height"], report["frames"]), (64, 48, 3))
        self.assertEqual((report["trim"], report["closest"]), ("exact", "certified"))
        times = report["ms_per_frame"]
        self.assertEqual(list(times), ["median", "min", "max"])
        self.assertTrue(0 < times["min"] <= times["median"] <= times["max"])
        self.assertAlmostEqual(report["rays_per_second"] * times["median"] / 1000 / (64 * 48), 1, 3)
        self.assertEqual(list(report["bytes"]), ["geometry", "bvh", "trim_exact", "trim_sdf", "trim_kd", "total"])
        self.assertEqual(sum(report["bytes"].values()), 2 * report["bytes"]["total"])
        self.assertEqual(list(report["work"]), ["leaf_visits", "newton_steps", "curve_tests"])
        self.assertGreater(report["work"]["leaf_visits"], 0)
        self.assertTrue(all(isinstance(name, str) for name in report["effects"]))

    def test_kd_trims_show_what_exact_ones_show_and_count_their_bytes(self):
        reports, pictures = {}, {}
        for trim in ["exact", "kd"]:
            out = WORK / f"{trim}_trims.png"
            reports[trim] = self.json_of("render", PACK, "-o", out, "--size", "64x48", "--device", "cpu", "--trim", trim,
                                         "--json")
            pictures[trim] = out.read_bytes()
        self.assertEqual(pictures["exact"], pictures["kd"])
        self.assertEqual(reports["kd"]["trim"], "kd")
        self.assertIn("trim-kd", reports["kd"]["effects"])
        self.assertEqual(reports["exact"]["bytes"]["trim_kd"], 0)
        self.assertGreater(reports["kd"]["bytes"]["trim_kd"], 0)
        self.assertEqual(sum(reports["kd"]["bytes"].values()), 2 * reports["kd"]["bytes"]["total"])

    def test_png_shows_the_model_whole_on_nothing(self):
        width, height, rows = read_png(self.render("b.png", "--size", "80x60"))
        self.assertEqual((width, height), (80, 60))
        seen = alphas(rows)
        self.assertEqual(set(seen), {0, 255})
        self.assertGreater(seen.count(255), 80 * 60 // 10)
        border = rows[0] + rows[-1] + b"".join(row[:4] + row[-4:] for row in rows)
        self.assertEqual(max(border[3::4]), 0, "framed whole: nothing touches the border")

    def test_samples_smooth_the_edges_and_a_background_fills_the_rest(self):
        _, _, rows = read_png(self.render("c.png", "--size", "40x30", "--samples", 4))
        self.assertGreater(len(set(alphas(rows))), 4)
        _, _, rows = read_png(self.render("d.png", "--size", "40x30", "--background", "#102030"))
        self.assertEqual(set(alphas(rows)), {255})
        self.assertEqual(rows[0][:3], b"\x10\x20\x30")

    def test_the_same_picture_on_any_number_of_threads(self):
        one = self.render("one.exr", "--size", "64x48", "--threads", 1).read_bytes()
        self.assertEqual(one, self.render("two.exr", "--size", "64x48", "--threads", 2).read_bytes())

    def test_edges_silhouettes_and_smoothed_trims_are_drawn_where_they_are_asked_for(self):
        small = ("--size", "64x48", "--device", "cpu", "--json")
        drawn = {}
        for name, options, effects in [
                ("plain", [], []), ("sharp", ["--edges", "sharp"], ["edges"]),
                ("all", ["--edges", "all", "--edge-color", "#ff0000", "--edge-width", "3"], ["edges", "edges-smooth"]),
                ("rims", ["--silhouettes"], ["silhouettes"]), ("smooth", ["--antialias", "trims"], ["trim-antialiasing"]),
                ("lines", ["--style", "edges-only"], ["edges", "silhouettes", "unfilled-faces"]),
                ("few", ["--style", "edges-only", "--no-silhouettes"], ["edges", "unfilled-faces"])]:
            report = self.json_of("render", PACK, "-o", WORK / (name + ".png"), *small, *options)
            self.assertEqual(report["effects"][report["effects"].index("shading") + 1:], effects)
            self.assertEqual("edge_tests" in report["work"], name != "plain")
            self.assertEqual("borders" in report["bytes"], name != "plain")
            self.assertEqual(sum(report["bytes"].values()), 2 * report["bytes"]["total"])
            drawn[name] = read_png(WORK / (name + ".png"))[2]
        self.assertEqual(len({str(rows) for rows in drawn.values()}), len(drawn))
        for option, value, said in [("--edges", "shap", "'sharp'"), ("--style", "edges", "edges-only"),
                                    ("--antialias", "trim", "'trims'"), ("--edge-width", "0", "--edge-width"),
                                    ("--edge-width", "61", "60"), ("--edge-color", "#12", "#rrggbb")]:
            self.fails(1, "render", PACK, "-o", WORK / "g.png", option, value, says=[option, said])
        self.fails(1, "render", PACK, "-o", WORK / "g.png", "--style", "edges-only", "--edges", "none",
                   "--no-silhouettes", says=["--style", "nothing"])

    def test_views_differ_and_an_eye_stands_where_it_is_told(self):
        front = self.render("front.png", "--size", "40x30", "--view", "front").read_bytes()
        top = self.render("top.png", "--size", "40x30", "--view", "top").read_bytes()
        self.assertFalse(front == top)
        away = ["--size", "40x30", "--eye", "-.5,-99999,1e2", "--target", "0,-199999,0", "--up", "0,0,1"]
        self.assertEqual(set(alphas(read_png(self.render("away.png", *away))[2])), {0}, "it looks away from the model")

    def test_auto_says_which_device_and_why(self):
        done = self.ok("render", PACK, "-o", WORK / "e.png", "--size", "8x8", "--json")
        self.assertRegex(done.stderr, r"^trimray: tracing on [^\n]*\n$")
        device = json.loads(done.stdout)["device"]
        self.assertIn(device, done.stderr)
        self.assertNotIn("llvmpipe", device, "never a software driver unasked")

    def test_the_reference_shows_what_the_others_show_and_refuses_what_it_cannot_do(self):
        cpu = read_png(self.render("cpu.png", "--size", "64x48"))[2]
        out = WORK / "reference.png"
        report = self.json_of("render", PACK, "-o", out, "--size", "64x48", "--device", "reference", "--json")
        self.assertEqual((report["device"], report["trim"]), ("reference", "reference"))
        slow = read_png(out)[2]
        self.assertEqual(alphas(cpu), alphas(slow))
        self.assertLessEqual(max(abs(a - b) for a, b in zip(b"".join(cpu), b"".join(slow))), 1)
        for option, value in [("--trim", "sdf"), ("--edges", "sharp"), ("--antialias", "trims")]:
            self.fails(1, "render", PACK, "-o", WORK / "g.png", "--device", "reference", option, value,
                       says=["--device reference", option])

    def test_stochastic_frames_are_kept_and_claim_nothing(self):
        reports, pictures = {}, {}
        for closest in ["certified", "stochastic"]:
            for frames in [1, 4]:
                out = WORK / f"{closest}{frames}.png"
                report = self.json_of("render", PACK, "-o", out, "--size", "64x48", "--device", "cpu", "--closest", closest,
                                      "--frames", frames, "--json")
                self.assertEqual((report["closest"], report["frames"]), (closest, frames))
                self.assertEqual("stochastic-starts" in report["effects"], closest == "stochastic")
                reports[closest, frames], pictures[closest, frames] = report, out.read_bytes()
        self.assertEqual(pictures["certified", 1], pictures["certified", 4])
        self.assertEqual(reports["stochastic", 4]["uncertified_pixels"], 64 * 48)
        for value, says in [("certain", ["certified, stochastic"]), ("stochastik", ["did you mean 'stochastic'"])]:
            self.fails(1, "render", PACK, "-o", WORK / "g.png", "--closest", value, says=["--closest", *says])
        self.fails(1, "render", PACK, "-o", WORK / "g.png", "--closest", "stochastic", "--device", "reference",
                   says=["--device reference", "--closest"])

    def test_modes_that_do_not_exist_name_those_that_do(self):
        self.fails(4, "render", PACK, "-o", WORK / "f.jpg", says=["f.jpg", ".png", ".exr"])
        self.assertFalse((WORK / "f.png").exists())

    def test_a_pack_without_textures_is_not_traced_by_them(self):
        bare = WORK / "bare.tray"
        self.ok("pack", MODEL, "-o", bare, "--trim-memory", "0")
        for device, trim in [("cpu", "sdf"), ("auto", "sdf"), ("cpu", "hybrid")]:
            self.fails(4, "render", bare, "-o", WORK / "bare.png", "--trim", trim, "--device", device,
                       says=[f"--trim {trim}", "without a distance texture", "--trim exact"])
        self.ok("render", bare, "-o", WORK / "bare.png", "--size", "8x8", "--device", "cpu")

    def test_wrong_values_are_usage_errors(self):
        for option, value in [("--size", "640"), ("--size", "0x5"), ("--size", "5x-5"), ("--size", "9999999x9"),
                              ("--size", "60000x60000"), ("--trim", "exakt"), ("--device", "gpu"), ("--fov", "180"),
                              ("--fov", "nan"), ("--eye", "1,2"), ("--eye", "1,2,nan"), ("--eye", "a,b,c"),
                              ("--view", "isometric"), ("--target", "1,2,3"), ("--background", "#12345"),
                              ("--frames", "0"), ("--threads", "-1"), ("--samples", "0"), ("--error-px", "0")]:
            self.fails(1, "render", PACK, "-o", WORK / "g.png", option, value, says=[option])
        self.fails(1, "render", PACK, "-o", WORK / "g.exr", "--samples", 2, says=["--samples", "EXR"])
        self.fails(1, "render", PACK, "-o", WORK / "g.png", "--view", "top", "--eye", "1,2,3", says=["--eye"])
        self.fails(1, "render", PACK, "-o", WORK / "g.png", "--trim", "exakt", says=["did you mean 'exact'?"])

    def test_a_time_budget_that_holds_all_changes_nothing(self):
        asked = ["--size", "64x48", "--samples", 2, "--occlusion", 8, "--shadows", "soft", "--background", "white"]
        without = self.render("without.png", *asked).read_bytes()
        out = WORK / "within.png"
        done = self.ok("render", PACK, "-o", out, "--device", "cpu", *asked, "--time-budget", "1e9", "--json")
        self.assertEqual(out.read_bytes(), without)
        report = json.loads(done.stdout)
        self.assertEqual(list(report), self.KEYS + ["time_budget"])
        self.assertTrue({"occlusion", "shadows", "soft-shadows"} <= set(report["effects"]), report["effects"])
        budget = report["time_budget"]
        self.assertEqual(list(budget), ["ms", "measured_ms", "fits", "gave_up"])
        self.assertEqual((budget["ms"], budget["fits"], budget["gave_up"]), (1e9, True, []))
        self.assertGreaterEqual(budget["measured_ms"], report["ms_per_frame"]["median"])
        self.assertRegex(done.stderr, r"^trimray: --time-budget 1e\+09: .* ms a frame; gave up nothing\n$")

    def test_a_time_budget_that_nothing_fits_gives_up_everything_and_says_so(self):
        out, whole = WORK / "hasty.png", WORK / "whole.png"
        asked = ["--size", "150x101", "--device", "cpu", "--samples", 3, "--occlusion", 8, "--shadows", "soft",
                 "--antialias", "trims"]
        done = self.ok("render", PACK, "-o", out, *asked, "--time-budget", "1e-6", "--json")
        report = json.loads(done.stdout)
        budget = report["time_budget"]
        self.assertFalse(budget["fits"])
        self.assertGreater(budget["measured_ms"], 1e-6)
        self.assertEqual([list(one) for one in budget["gave_up"]], [["what", "from", "to"]] * 5)
        self.assertEqual([tuple(one.values()) for one in budget["gave_up"]],
                         [("samples a pixel", "3 x 3", "1 x 1"), ("rays of occlusion", "8", "0"),
                          ("shadows", "soft, 16 rays a light", "hard"), ("smoothed trims", "yes", "no"),
                          ("size traced", "full", "1/6")])
        self.assertIn("over the budget", done.stderr)
        for one in budget["gave_up"]:
            self.assertIn(f"{one['what']} {one['from']} -> {one['to']}", done.stderr)
        least = self.json_of("render", PACK, "-o", whole, *asked[:4], "--shadows", "hard", "--json")
        self.assertEqual(report["effects"], least["effects"], "what it was made with, not what was asked for")
        self.assertEqual(list(report["work"]), list(least["work"]))
        self.assertTrue({"occlusion", "soft-shadows", "trim-antialiasing"} <=
                        set(self.json_of("render", PACK, "-o", whole, *asked, "--json")["effects"]))
        (width, height, hasty), (_, _, right) = read_png(out), read_png(whole)
        self.assertEqual((width, height), (150, 101), "enlarged to the size that was asked for")
        for pixel in (hasty[0][3], hasty[-1][-1]):
            self.assertEqual(pixel, 0, "what is transparent stays so")
        middles = []  # of what is seen: nothing has moved by half a traced pixel, 3 of these
        for rows in (hasty, right):
            weights = [(x, y, row[4 * x + 3]) for y, row in enumerate(rows) for x in range(width)]
            total = sum(w for _, _, w in weights)
            middles.append([sum(place[axis] * place[2] for place in weights) / total for axis in (0, 1)])
        for a, b in zip(*middles):
            self.assertAlmostEqual(a, b, delta=1.5)

    def test_a_time_budget_holds_through_vulkan_too(self):
        asked = ["--size", "48x32", "--samples", 2, "--device", "vulkan"]
        without, within = WORK / "vulkan.png", WORK / "vulkan_within.png"
        if run("render", PACK, "-o", without, *asked).returncode == 4:
            self.skipTest("no Vulkan driver")
        self.ok("render", PACK, "-o", within, *asked, "--time-budget", "1e9")
        self.assertEqual(without.read_bytes(), within.read_bytes())
        budget = self.json_of("render", PACK, "-o", within, *asked, "--time-budget", "1e-6", "--json")["time_budget"]
        self.assertEqual([one["to"] for one in budget["gave_up"]], ["1 x 1", "1/2"])
        self.assertEqual(read_png(within)[:2], (48, 32))

    def test_each_picture_has_its_time_budget(self):
        report = self.json_of("render", PACK, "-o", WORK / "budgeted_%d.exr", "--size", "64x48", "--device", "cpu",
                              "--antialias", "trims", "--turntable", 2, "--time-budget", "1e-6", "--json")
        self.assertNotIn("time_budget", report)
        for number, picture in enumerate(report["pictures"], 1):
            self.assertEqual([tuple(one.values()) for one in picture["time_budget"]["gave_up"]],
                             [("smoothed trims", "yes", "no"), ("size traced", "full", "1/3")])
            self.assertEqual(picture["effects"], report["effects"])
            self.assertNotIn("trim-antialiasing", picture["effects"])
            self.assertNotIn("edge_tests", picture["work"])
            self.assertTrue((WORK / f"budgeted_{number}.exr").exists())

    def test_wrong_time_budgets_are_usage_errors(self):
        for value in ["0", "-5", "nan", "soon", ""]:
            self.fails(1, "render", PACK, "-o", WORK / "g.png", "--time-budget", value, says=["--time-budget"])

    def test_a_picture_that_cannot_be_written_is_named(self):
        target = WORK / "no_such_folder" / "h.png"
        self.fails(2, "render", PACK, "-o", target, "--size", "8x8", "--device", "cpu", says=[str(target)])
