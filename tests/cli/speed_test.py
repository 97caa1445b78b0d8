import csv
import json
import tempfile
from pathlib import Path

from case import MODEL, PACK, TESTS, WORK, CliTest, run


class Speed(CliTest):
    needs_pack = True
    COUNTS = ["rays", "node_visits", "leaf_visits", "newton_steps", "curve_tests", "uncertified_pixels"]
    SMALL = ["--size", "64x36", "--rounds", 0]

    def stored(self, *options):
        """A stored run of the pack, and its rows, in a folder of its own."""
        folder = Path(tempfile.mkdtemp(dir=WORK))
        self.ok("bench", "speed", PACK, *self.SMALL, *options, "--write-baseline", folder / "stored.csv")
        with open(folder / "stored.csv", newline="") as file:
            return folder / "stored.csv", list(csv.DictReader(file))

    def rewrite(self, path, rows):
        with open(path, "w", newline="") as file:
            writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)

    def test_counts_are_the_stored_ones(self):
        """Where a count changes and should: rewrite the file as runtime/measure/SPEED.md says, and commit it."""
        models = sorted(path for path in MODEL.parent.iterdir() if path.suffix != ".md")
        done = run("bench", "speed", *models, "--size", "160x90", "--rounds", 0, "--errors", "--baseline",
                   TESTS / "baseline.csv", "--check")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn(f"Beside {TESTS / 'baseline.csv'}: 0 counts changed", done.stdout)
        self.assertNotIn("not compared", done.stdout)

    def test_counts_are_the_same_on_any_threads_and_instruction_set(self):
        rows = {}
        for options in ["--threads 1", "--threads 2", "--instruction-set sse4", "--instruction-set avx2",
                        "--instruction-set avx512"]:
            done = run("bench", "speed", MODEL, MODEL.parent / "D150WithGuides_wing.igs", *self.SMALL, *options.split(),
                       "--json")
            if done.returncode == 4 and "instruction-set" in options:
                continue  # this machine has it not
            self.assertEqual(done.returncode, 0, done.stderr)
            rows[options] = json.loads(done.stdout)["models"]
        self.assertGreaterEqual(len(rows), 3, "one instruction set at least, by name")
        for options, models in rows.items():
            self.assertEqual(models, rows["--threads 1"], options)
        self.assertGreater(sum(view["newton_steps"] for model in models for view in model["views"]), 0)

    def test_counts_are_those_of_the_pack_and_of_its_pictures(self):
        report = self.json_of("bench", "speed", PACK, *self.SMALL, "--views", "top,close-up", "--errors", "--json")
        self.assertEqual((report["width"], report["height"], report["rounds"], report["comparison"]), (64, 36, 0, None))
        info = self.json_of("info", PACK, "--json")
        render = self.json_of("render", PACK, "-o", WORK / "speed.png", "--size", "64x36", "--view", "top", "--json")
        [model] = report["models"]
        self.assertEqual([view["view"] for view in model["views"]], ["top", "close-up"])
        for view in model["views"]:
            for key in ["faces", "patches", "leaves", "file_bytes"]:
                self.assertEqual(view[key], info[key])
            for key in ["geometry", "bvh", "trim_exact", "trim_sdf"]:
                self.assertEqual(view[f"{key}_bytes"], render["bytes"][key])
            self.assertEqual((view["width"], view["height"], view["rays"]), (64, 36, 64 * 36))
            self.assertEqual((view["missing"], view["extra"], view["wrong_depth"]), (0, 0, 0))
            self.assertEqual((view["picture_ms"], view["speed_to_one_ray"], view["pcurve_deviation_nm"]), (None, None, None))
        top = model["views"][0]
        self.assertEqual(top["uncertified_pixels"], render["uncertified_pixels"])
        for key in ["leaf_visits", "newton_steps", "curve_tests"]:
            self.assertAlmostEqual(top[key] / top["rays"], render["work"][key], places=5)

    def test_times_are_taken_beside_one_ray_and_triangles(self):
        path = WORK / "timed.csv"
        options = ["--size", "64x36", "--rounds", 3, "--views", "iso"]
        report = self.json_of("bench", "speed", MODEL, PACK, *options, "--write-baseline", path, "--json")
        of_model, of_pack = [model["views"][0] for model in report["models"]]
        for view in [of_model, of_pack]:
            for key in ["picture_ms", "speed_to_one_ray"]:
                self.assertGreater(view[key], 0)
                self.assertGreaterEqual(view[key + "_spread"], 0)
        self.assertGreater(of_model["speed_to_mesh"], 0)
        self.assertIsNotNone(of_model["pcurve_deviation_nm"])
        self.assertIsNone(of_pack["speed_to_mesh"], "triangles are made from the CAD file")
        self.assertEqual([of_model[key] for key in self.COUNTS], [of_pack[key] for key in self.COUNTS])

        with open(path, newline="") as file:
            rows = list(csv.DictReader(file))
        rows[0]["speed_to_one_ray"] = 1000 * of_model["speed_to_one_ray"]
        rows[1]["speed_to_one_ray"] = of_pack["speed_to_one_ray"] / 1000
        self.rewrite(path, rows)
        compared = self.json_of("bench", "speed", MODEL, PACK, *options, "--baseline", path, "--check", "--json")["comparison"]
        verdicts = {(row["model"], row["baseline"]): row["verdict"] for row in compared["speeds"]}
        self.assertEqual(verdicts[MODEL.name, "one_ray"], "slower")
        self.assertEqual(verdicts[PACK.name, "one_ray"], "faster")
        self.assertIn((MODEL.name, "mesh"), verdicts)
        text = self.ok("bench", "speed", MODEL, PACK, *options, "--baseline", path).stdout
        self.assertRegex(text, r"(?m)^iso +[\d.]+ +[\d.]+ % ")
        self.assertRegex(text, r"speed to one_ray: [\d.]+ x the stored \(geometric mean\); beyond the noise 1 faster, 1 slower")

    def test_a_changed_count_is_told_and_fails_a_check(self):
        path, rows = self.stored()
        self.ok("bench", "speed", PACK, *self.SMALL, "--baseline", path, "--check")
        now = int(rows[1]["leaf_visits"])
        rows[1]["leaf_visits"] = 2 * now
        self.rewrite(path, rows)
        text = self.ok("bench", "speed", PACK, *self.SMALL, "--baseline", path).stdout
        self.assertIn("1 counts changed", text)
        self.assertIn(f"{PACK.name}, top: leaf_visits was {2 * now}, is {now} (-50 %)", text)
        done = run("bench", "speed", PACK, *self.SMALL, "--baseline", path, "--check", "--json")
        self.assertEqual(done.returncode, 6)
        comparison = json.loads(done.stdout)["comparison"]
        self.assertFalse(comparison["agrees"])
        self.assertEqual(comparison["changed"], [{"model": PACK.name, "view": "top", "count": "leaf_visits",
                                                  "stored": 2 * now, "now": now}])
        # the next run takes the change, and is the stored one from then on
        self.ok("bench", "speed", PACK, *self.SMALL, "--baseline", path, "--write-baseline", path)
        self.ok("bench", "speed", PACK, *self.SMALL, "--baseline", path, "--check")

    def test_what_is_in_one_run_alone_is_told_and_fails_a_check(self):
        path, rows = self.stored()
        rows[0]["model"] = "other.step"
        self.rewrite(path, rows)
        done = run("bench", "speed", PACK, *self.SMALL, "--baseline", path, "--check")
        self.assertEqual(done.returncode, 6)
        self.assertIn(f"{PACK.name}, iso: not in the stored run", done.stdout)
        self.assertIn("other.step, iso: stored, but not run", done.stdout)

    def test_a_model_that_fails_is_told_and_nothing_is_stored(self):
        path = WORK / "not_stored.csv"
        done = run("bench", "speed", WORK / "missing.tray", PACK, *self.SMALL, "--write-baseline", path, "--json")
        self.assertEqual(done.returncode, 2)
        self.assertIn("missing.tray", done.stderr)
        self.assertIn("not_stored.csv is not written", done.stderr)
        self.assertEqual([model["model"] for model in json.loads(done.stdout)["models"]], [PACK.name])
        self.assertFalse(path.exists())

    def test_errors_have_their_exit_codes(self):
        path, rows = self.stored()
        lines = path.read_text().splitlines(keepends=True)
        for line, text in [(1, "rays,leaves\n" + lines[1]), (3, lines[0] + lines[1] + lines[2][:40]), (1, "")]:
            path.write_text(text)
            self.fails(3, "bench", "speed", PACK, *self.SMALL, "--baseline", path, says=["stored.csv", f"line {line}"])
        path.write_text("".join(lines))
        self.fails(1, "bench", "speed", PACK, "--size", "32x18", "--baseline", path, says=["--size", "64x36"])
        self.fails(1, "bench", "speed", PACK, *self.SMALL, "--check", says=["--check", "--baseline"])
        self.fails(1, "bench", "speed", PACK, PACK, *self.SMALL, says=["two models are named"])
        self.fails(1, "bench", "speed", PACK, *self.SMALL, "--views", "iso,iso", says=["--views", "twice"])
        self.fails(1, "bench", "speed", PACK, *self.SMALL, "--views", "frnt", says=["--views", "close-up"])
        self.fails(1, "bench", "speed", says=["bench speed", "MODEL"])
        self.fails(2, "bench", "speed", PACK, *self.SMALL, "--baseline", WORK / "missing.csv", says=["missing.csv"])
        self.fails(4, "bench", "speed", PACK, *self.SMALL, "--instruction-set", "mmx", says=["mmx"])
        self.assertIn("speed", self.ok("bench", "--help").stdout)
        text = self.ok("bench", "speed", "--help").stdout
        for column in rows[0]:
            self.assertIn(column.removesuffix("_spread"), text)
        done = run("bench", "speed", PACK, *self.SMALL, "--write-baseline", WORK / "no_folder" / "x.csv")
        self.assertEqual(done.returncode, 2)
        self.assertIn("no_folder", done.stderr)
