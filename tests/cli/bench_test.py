import csv
import json
import math
import subprocess
import sys
import tempfile
import xml.etree.ElementTree
from pathlib import Path

from case import MODEL, OPTIONS, PACK, TESTS, WORK, CliTest, run


class Bench(CliTest):
    needs_pack = True

    def test_trims_measures_every_setting(self):
        report = self.json_of("bench", "trims", PACK, "--json", "--size", "64x48", "--rounds", 2, "--memory", "100,400",
                              "--views", "front,close-up")
        self.assertEqual((report["width"], report["height"], report["rounds"], report["threads"]), (64, 48, 2, 1))
        [measured] = report["packs"]
        self.assertEqual(measured["pack"], str(PACK))
        self.assertEqual([view["view"] for view in measured["views"]], ["front", "close-up"])
        for view in measured["views"]:
            self.assertEqual(set(view["camera"]), {"eye", "target", "up", "fov"})
            settings = view["settings"]
            self.assertEqual([row["mode"] for row in settings], ["kd", "exact", "exact"] + 8 * ["hybrid"] + 8 * ["sdf"])
            self.assertEqual({(r["source"], r["layout"], r["memory_percent"]) for r in settings[3:]},
                             {(s, l, m) for s in ["curve", "mask"] for l in ["isotropic", "square"] for m in [100, 400]})
            self.assertEqual([i for i, row in enumerate(settings) if row["edges"]], [2])
            self.assertEqual(settings[0]["speed_to_kd"], 1)
            self.assertGreater(settings[2]["bytes"], settings[1]["bytes"], "the borders' cells")
            for row in settings:
                self.assertGreater(row["frame_ms"], 0)
                self.assertGreater(row["ns_per_query"], 0)
                self.assertGreater(row["bytes"], 0)
                self.assertEqual(row["wrong_rays_per_million"], row["wrong_rays"] / (64 * 48) * 1e6)
                if row["mode"] != "sdf":
                    self.assertEqual((row["wrong_rays"], row["wrong_queries"], row["psnr_db"]), (0, 0, None), row)

    def test_trims_prints_a_table(self):
        text = self.ok("bench", "trims", PACK, "--size", "32x24", "--rounds", 1, "--memory", 100, "--views", "iso").stdout
        self.assertRegex(text, r"(?m)^kd +\d+ ")
        self.assertRegex(text, r"(?m)^sdf curve isotropic 100 % +\d+ ")
        self.assertIn("--eye", text)

    def test_closest_measures_both_policies_against_the_reference(self):
        report = self.json_of("bench", "closest", PACK, "--json", "--size", "48x36", "--rounds", 2, "--frames", "3,1",
                              "--views", "front,iso")
        self.assertEqual((report["width"], report["height"], report["rounds"], report["threads"]), (48, 36, 2, 1))
        [measured] = report["packs"]
        self.assertLessEqual(measured["bezier_patches"], measured["bezier_leaves"])
        self.assertEqual([view["view"] for view in measured["views"]], ["front", "iso"])
        costs = [view["certified_cost"] for view in measured["views"]]
        self.assertAlmostEqual(report["certified_cost"], math.sqrt(costs[0] * costs[1]))
        for view in measured["views"]:
            self.assertEqual([(row["closest"], row["leaves"], row["frames"]) for row in view["settings"]],
                             [("stochastic", "one", 1), ("stochastic", "one", 3), ("stochastic", "pack", 1),
                              ("stochastic", "pack", 3), ("certified", "pack", 1)])
            for row in view["settings"]:
                self.assertGreater(row["frame_ms"], 0)
                wrong = row["missing"] + row["extra"] + row["wrong_depth"]
                self.assertAlmostEqual(row["wrong_per_million"], wrong / (48 * 36) * 1e6)
                self.assertTrue(row["psnr_db"] is None or row["psnr_db"] > 40, row)
            self.assertEqual(view["settings"][-1]["wrong_per_million"], 0)
        text = self.ok("bench", "closest", PACK, "--size", "32x24", "--rounds", 1, "--frames", 1, "--views", "iso").stdout
        self.assertRegex(text, r"(?m)^stochastic +one +1 ")
        self.assertRegex(text, r"Certified frames cost [\d.]+ of")

    def check_effects(self, device):
        names = ["none", "edges", "hard-shadows", "draft", "unspecialised"]
        options = ["bench", "effects", PACK, "--device", device, "--size", "48x36", "--effects", ",".join(reversed(names))]
        # a software driver that has nothing cached compiles the unspecialised tracer for minutes
        report = self.json_of(*options, "--json", "--rounds", 1, timeout=500)
        self.assertEqual((report["width"], report["height"], report["rounds"], report["threads"]), (48, 36, 1, 1))
        [measured] = report["packs"]
        rows = {row["effect"]: row for row in measured["effects"]}
        self.assertEqual(list(rows), names)
        for row in rows.values():
            self.assertEqual(set(row), {"effect", "unsupported", "frame_ms", "time_to_none", "differing_pixels",
                                        "buffer_bytes", "dispatches", "pipelines", "work"})
            self.assertIsNone(row["unsupported"])
            self.assertGreater(row["frame_ms"], 0)
            self.assertGreater(row["time_to_none"], 0)
        none = rows["none"]
        self.assertEqual(none["time_to_none"], 1)
        self.assertEqual(rows["unspecialised"]["differing_pixels"], 0)
        self.assertEqual(rows["unspecialised"]["work"], none["work"])
        self.assertEqual((none["work"]["free_rays"], none["work"]["edge_tests"]), (0, 0))
        self.assertGreater(rows["hard-shadows"]["work"]["free_rays"], 0)
        self.assertGreater(rows["edges"]["work"]["edge_tests"], 0)
        for name in names[1:-1]:
            self.assertGreater(rows[name]["differing_pixels"], 0, name)
            self.assertGreater(rows[name]["buffer_bytes"], none["buffer_bytes"], name)
        return rows

    def test_effects_measures_each_effect_alone_on_the_cpu(self):
        rows = self.check_effects("cpu")
        self.assertEqual({(row["dispatches"], len(row["pipelines"])) for row in rows.values()}, {(0, 0)})
        options = ["bench", "effects", PACK, "--size", "48x36", "--effects", "none,unspecialised"]
        untimed = self.json_of(*options, "--json", "--rounds", 0)["packs"][0]["effects"]
        self.assertEqual({(row["frame_ms"], row["time_to_none"]) for row in untimed}, {(None, None)})
        self.assertRegex(self.ok(*options, "--rounds", 1).stdout, r"(?m)^unspecialised +[\d.]+ +[\d.]+ ")

    def test_effects_measures_each_effect_alone_through_vulkan(self):
        if run("bench", "effects", PACK, "--device", "vulkan", "--size", "16x16", "--effects", "none").returncode == 4:
            self.skipTest("no Vulkan driver")
        rows = self.check_effects("vulkan")
        shaders = {name: [pipeline["shader"] for pipeline in row["pipelines"]] for name, row in rows.items()}
        self.assertEqual(shaders.pop("hard-shadows"), ["primary", "light"])
        self.assertEqual(set(map(tuple, shaders.values())), {("primary",)})
        self.assertEqual(rows["unspecialised"]["dispatches"], rows["none"]["dispatches"])
        self.assertGreater(rows["hard-shadows"]["dispatches"], rows["none"]["dispatches"])

    def test_accuracy_sweeps_every_dial_and_keeps_the_numbers(self):
        with tempfile.TemporaryDirectory() as root:
            folder = Path(root) / "new" / "report"
            options = ["--quick", "--size", "48x36", "--views", 2, "--rounds", 1]
            report = self.json_of("bench", "accuracy", PACK, "-o", folder, *options, "--json")
            kept = json.loads((folder / "report.json").read_text())
            self.assertEqual(kept, report)
            self.assertEqual((report["schema"], report["width"], report["height"], report["rounds"]), (2, 48, 36, 1))
            self.assertIn(f"trimray bench accuracy {PACK} -o ", report["command"])
            [model] = report["models"]
            self.assertEqual(model["model"], PACK.name)
            contenders = model["contenders"]
            self.assertEqual(contenders[0], {"dial": "default", "name": "default", "paper": None})
            self.assertEqual({row["dial"] for row in contenders},
                             {"default", "error-px", "leaves", "closest", "trims", "together", "precision", "anti-aliasing"})
            self.assertEqual(len({row["name"] for row in contenders}), len(contenders))
            self.assertEqual([view["view"] for view in model["views"]], ["iso", "top"])
            for view in model["views"]:
                self.assertEqual(len(view["points"]), len(contenders))
                self.assertEqual(view["points"][0]["time_to_default"], 1)
                for point in view["points"]:
                    self.assertGreater(point["picture_ms"], 0)
                    self.assertGreater(point["bytes"], 0)
                by_name = {row["name"]: point for row, point in zip(contenders, view["points"])}
                in_double = by_name["double"]
                self.assertEqual((in_double["psnr_db"], in_double["ssim"], in_double["wrong_per_million"]), (None, 1, 0))
                smooth = by_name["2 × 2 samples"]
                self.assertGreater(smooth["psnr_db"], by_name["one sample"]["psnr_db"])
                self.assertNotIn("wrong_per_million", smooth, "it is held against another picture")
            rows = list(csv.DictReader((folder / "report.csv").read_text().splitlines()))
            self.assertEqual(len(rows), 2 * len(contenders))
            self.assertEqual(rows[0]["contender"], "default")
            self.assertEqual(float(rows[1]["leaf_visits"]), model["views"][0]["points"][1]["leaf_visits"])

    def test_accuracy_has_peers_where_it_has_the_cad_file(self):
        if not OPTIONS.has_pack:
            self.skipTest("no converter")
        with tempfile.TemporaryDirectory() as root:
            report = self.json_of("bench", "accuracy", MODEL, PACK, "-o", root, "--quick", "--size", "64x48", "--views", 1,
                                  "--rounds", 1, "--json")
            plot = Path(root) / "plot.svg"
            table = subprocess.run([sys.executable, TESTS / "accuracy_table.py", Path(root) / "report.json", "--plot", plot,
                                    "--models", MODEL.stem], capture_output=True, text=True, check=True).stdout.splitlines()
            self.assertEqual(len(table), 3, "a head of two lines, and the model that has peers")
            self.assertTrue(table[2].startswith(f"| {MODEL.stem} | "))
            marks = xml.etree.ElementTree.parse(plot).findall(".//{*}path/{*}title")
            self.assertEqual(len(marks), 2 * 9, "the default, double, 3 of the paper's, textures, and 3 of triangles, twice")
        of_model, of_pack = report["models"]
        self.assertEqual(of_model["notes"], [])
        self.assertIn("CAD file", of_pack["notes"][0])
        self.assertNotIn("peers", {row["dial"] for row in of_pack["contenders"]})
        peers = [(row, point) for row, point in zip(of_model["contenders"], of_model["views"][0]["points"])
                 if row["dial"] == "peers"]
        self.assertEqual([row["name"].split(",")[0].split(":")[0] for row, _ in peers],
                         ["the paper's shape"] + 3 * ["the same"] + 3 * ["triangles"])
        default = of_model["contenders"][0]
        for row in [default] + [row for row, _ in peers]:
            self.assertGreater(row["make_seconds"], 0)
            self.assertGreater(row["file_bytes"], 0)
        self.assertGreater(default["first_picture_ms"], 0)
        self.assertEqual([row["paper"] for row, _ in peers], ["one-ray", "wide", "wide-10-frames", "wide-textures"] + 3 * [None])
        self.assertIn("textures-100", [row["paper"] for row in of_model["contenders"]])
        counts = of_model["paper"]
        self.assertEqual(counts["nurbs_surfaces"], of_model["faces"])
        self.assertGreaterEqual(counts["bezier_surfaces"], counts["nurbs_surfaces"])
        self.assertGreater(counts["nurbs_curves"], 0)
        self.assertEqual(counts["bytes"], peers[1][1]["bytes"], "as the contender reads them")
        self.assertNotIn("paper", of_pack)
        (one_ray, alone), (_, wide) = peers[:2]
        self.assertIn("one ray", one_ray["name"])
        self.assertEqual(alone["wrong_per_million"], wide["wrong_per_million"], "the same pictures, but for rounding")
        triangles = [row["triangles"] for row, _ in peers[4:]]
        self.assertEqual(triangles, sorted(set(triangles)))
        depths = [point["depth_px_mean"] for _, point in peers[4:]]
        self.assertEqual(depths, sorted(depths, reverse=True), "finer meshes lie nearer")
        self.assertLess(of_model["views"][0]["points"][0]["depth_px_mean"], depths[-1])

    def test_accuracy_goes_on_after_a_model_that_fails(self):
        with tempfile.TemporaryDirectory() as root:
            missing = Path(root) / "missing.tray"
            done = run("bench", "accuracy", missing, PACK, "-o", root, "--quick", "--size", "32x24", "--views", 1, "--rounds",
                       1, "--json")
            self.assertEqual(done.returncode, 2)
            self.assertIn("missing.tray", done.stderr)
            self.assertEqual([model["model"] for model in json.loads(done.stdout)["models"]], [PACK.name])
            if OPTIONS.has_pack:
                broken = Path(root) / "broken.step"
                broken.write_text("ISO-10303-21;\nHEADER;\n")
                self.fails(3, "bench", "accuracy", broken, "-o", root, says=["broken.step", "was not converted: "])

    def test_accuracy_refuses_what_it_cannot_do(self):
        with tempfile.TemporaryDirectory() as root:
            missing = Path(root) / "missing.tray"
            self.fails(2, "bench", "accuracy", missing, "-o", root, says=["missing.tray"])
            self.fails(1, "bench", "accuracy", PACK, says=["bench accuracy", "--output", "--help"])
            self.fails(1, "bench", "accuracy", PACK, "-o", root, "--views", 9, says=["--views"])
            self.fails(1, "bench", "accuracy", PACK, "-o", root, "--device", "gpu", says=["--device", "gpu"])
            file = Path(root) / "file"
            file.write_text("")
            self.fails(2, "bench", "accuracy", PACK, "-o", file / "report", says=["report", "-o"])
            self.assertIn("accuracy", self.ok("bench", "--help").stdout)
            self.assertIn("Examples:", self.ok("bench", "accuracy", "--help").stdout)

    def test_moving_measures_pictures_with_and_without_the_last_ones_hits(self):
        options = ["bench", "moving", PACK, "--size", "48x36", "--frames", 2, "--degrees", 3]
        if run(*options).returncode == 4:
            self.skipTest("no Vulkan driver")
        report = self.json_of(*options, "--json")
        self.assertEqual((report["width"], report["height"], report["frames"], report["degrees"]), (48, 36, 2, 3))
        [measured] = report["packs"]
        self.assertEqual(measured["differing_pixels"], 0)
        self.assertGreater(measured["speedup"], 0)
        for row in [measured["plain"], measured["reusing"]]:
            self.assertEqual(set(row), {"frame_ms", "node_visits", "leaf_visits", "newton_steps"})
            self.assertGreater(row["frame_ms"], 0)
            self.assertGreater(row["leaf_visits"], 0)
        self.assertNotEqual(measured["plain"]["node_visits"], measured["reusing"]["node_visits"], "nothing was reused")
        text = self.ok(*options).stdout
        self.assertRegex(text, r"times as fast with reuse; 0 pixels differ")
        self.assertRegex(text, r"(?m)^last hits +[\d.]+ ")

    def test_errors_have_their_exit_codes(self):
        self.fails(1, "bench", says=["bench", "subcommand"])
        self.fails(1, "bench", "moving", PACK, "--frames", "0", says=["--frames"])
        self.fails(1, "bench", "effects", PACK, "--effects", "none,mirrors", says=["--effects", "'mirror'"])
        self.fails(1, "bench", "moving", PACK, "--device", "gpu", says=["--device", "vulkan"])
        self.fails(4, "bench", "moving", PACK, "--device", "cpu", "--size", "32x24", says=["reuses nothing", "--device vulkan"])
        self.fails(1, "bench", "closest", says=["bench closest", "PACK"])
        self.fails(1, "bench", "closest", PACK, "--frames", "0", says=["--frames"])
        self.fails(1, "bench", "closest", PACK, "--views", "frnt", says=["--views", "frnt"])
        self.fails(1, "bench", "trims", says=["bench trims", "PACK", "trimray bench trims --help"])
        self.fails(1, "bench", "trims", PACK, "--rouns", "3", says=["bench trims", "did you mean '--rounds'?"])
        self.fails(1, "bench", "trims", PACK, "--views", "iso,frnt", says=["--views", "frnt", "close-up"])
        self.fails(1, "bench", "trims", PACK, "--memory", "0", says=["--memory"])
        self.fails(2, "bench", "trims", WORK / "missing.tray", says=["missing.tray"])
        self.fails(4, "bench", "trims", PACK, "--instruction-set", "mmx", says=["mmx"])
