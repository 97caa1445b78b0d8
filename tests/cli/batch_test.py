import json
import random
import shutil
import signal
import subprocess
import sys
import time
import zipfile

import case
from case import MODEL, TESTS, WORK, CliTest, run

sys.path.insert(0, str(TESTS))
from mutants import write_mutants  # noqa: E402

MODELS = TESTS / "models"
SMALL = ["unit_sphere.stp", "revolved_sphere.step", "red_cube_blue_cylinder.step", "mayo_332_file.stp",
         "sg1-c5-214.stp", "nozzle.stp", "nozzle.igs", "abc_00000050.step"]


def events(out, kind):
    """The ledger's events of one kind; every line is one."""
    found = []
    for ledger in sorted((out / "ledger").glob("*.jsonl")):
        found += [json.loads(line) for line in ledger.read_text(encoding="utf-8").splitlines()]
    return [event for event in found if event["event"] == kind]


def packs(out):
    """The packs' bytes by their keys."""
    return {path.stem: path.read_bytes() for path in (out / "store").rglob("*.tray")}


def start(*arguments):
    command = [str(case.OPTIONS.bin / "trimray"), "batch", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


class Batch(CliTest):
    needs_pack = True

    def folder(self, name, models=()):
        folder = WORK / "batch" / self.id().rsplit(".", maxsplit=1)[-1] / name
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        for model in models:
            shutil.copy2(MODELS / model, folder)
        return folder

    def test_a_pack_is_the_one_that_pack_makes(self):
        models, out = self.folder("in", [MODEL.name]), self.folder("out")
        report = self.json_of("batch", models, "-o", out, "--json")
        self.assertEqual((report["files"], report["classes"]["done"], report["found"]), (1, 1, 0))
        [link] = (out / "packs").rglob("*.tray")
        self.assertEqual(link.name, MODEL.name + ".tray")
        self.assertEqual(link.read_bytes(), case.PACK.read_bytes())
        self.ok("validate", link)
        [end] = events(out, "end")
        self.assertEqual((end["faces"], end["converted"], end["dropped"], end["class"]), (29, 29, [], "done"))
        self.assertTrue({"wall", "cpu", "read", "transfer", "convert"} <= set(end["seconds"]))
        self.assertGreater(end["peak_memory_bytes"], 1 << 20)

        again = self.json_of("batch", models, "-o", out, "--json")
        self.assertEqual((again["found"], again["skipped"]), (1, 0))
        resumed = self.json_of("batch", models, "-o", out, "--resume", "--json")
        self.assertEqual((resumed["found"], resumed["skipped"], resumed["files"]), (0, 1, 1))
        other = self.json_of("batch", models, "-o", out, "--resume", "--compact", "--json")
        self.assertEqual((other["found"], other["skipped"], len(packs(out))), (0, 0, 2))

    def test_inputs_can_be_anything_that_holds_models(self):
        models, out = self.folder("in", ["unit_sphere.stp"]), self.folder("out")
        with zipfile.ZipFile(models / "parts.zip", "w", zipfile.ZIP_DEFLATED) as archive:
            archive.write(MODELS / "revolved_sphere.step", "round/ball.step")
            archive.writestr("readme.txt", "no model")
        (models / "broken.zip").write_bytes(b"PK\3\4 and no more")
        (models / "notes.txt").write_text("no model", encoding="ascii")
        done = run("batch", models, "-o", out, "--no-previews", "--json")
        self.assertEqual(done.returncode, 6, done.stderr)
        self.assertIn("broken.zip", done.stderr)
        report = json.loads(done.stdout)
        self.assertEqual((report["classes"]["done"], report["unreadable_inputs"]), (2, 1))
        self.assertEqual(sorted(link.name for link in (out / "packs").rglob("*.tray")),
                         ["ball.step.tray", "unit_sphere.stp.tray"])
        listed = subprocess.run([str(case.OPTIONS.bin / "trimray"), "batch", "-", "-o", str(out), "--json", "--no-previews"],
                                input=f"{models}/unit_sphere.stp\n{models}/parts.zip!/round/ball.step\n", text=True,
                                capture_output=True, timeout=60, check=True)
        self.assertEqual(json.loads(listed.stdout)["found"], 2)

    def test_damaged_models_each_end_in_one_class_and_cost_only_themselves(self):
        models, out = self.folder("in"), self.folder("out")
        step = [MODELS / m for m in SMALL if not m.endswith(".igs")]
        mutants = write_mutants(step, models / "step", 500, seed=7) + write_mutants(
            [MODELS / "nozzle.igs"], models / "iges", 200, seed=8)
        done = run("batch", models, "-o", out, "--no-previews", "--timeout", "10", "--memory-limit", "2GiB", "--quiet",
                   "--json", timeout=200)
        self.assertEqual(done.returncode, 6, done.stderr)
        report = json.loads(done.stdout)
        self.assertEqual(sum(report["classes"].values()), len(mutants))
        self.assertEqual(report["left"], 0)
        self.assertLess(report["supervisor_memory_growth_bytes"], 4 << 20)
        final = [end["file"] for end in events(out, "end") if end["final"]]
        self.assertEqual(len(final), len(set(final)))
        self.assertEqual(len(final), len(mutants))
        self.assertEqual(len(events(out, "start")), len(events(out, "end")))
        crashes = [end for end in events(out, "end") if end["class"] == "crash"]
        self.assertGreater(len(crashes), 100)
        framed = [end for end in crashes if end["error"].get("frame", "").startswith("TK")]
        self.assertGreater(len(framed), 0.9 * len(crashes))
        self.assertGreater(report["classes"]["invalid"], 20)
        self.assertGreater(report["classes"]["done"], 100)
        status = self.json_of("batch", "status", out, "--json")
        self.assertEqual((status["classes"], status["begun"], status["at_work"]), (report["classes"], [], []))
        again = run("batch", models, "-o", out, "--no-previews", "--resume", "--quiet", "--json")
        self.assertEqual(json.loads(again.stdout)["skipped"], len(mutants))
        self.assertEqual(again.returncode, 6, "what failed before has not become well")
        told = self.json_of("batch", "report", out, "-o", out / "report.html", "--json")
        self.assertEqual((told["classes"], told["files"]), (report["classes"], len(mutants)))
        self.assertEqual(sum(group["files"] for group in told["groups"]), len(mutants) - report["classes"]["done"])
        self.assertEqual(told["failures_in_all"], len(told["failures"]))
        crash = next(group for group in told["groups"] if group["class"] == "crash" and " in TK" in group["reason"])
        again = subprocess.run(crash["repeat"].replace("trimray", str(case.OPTIONS.bin / "trimray"), 1), shell=True,
                               capture_output=True, text=True, timeout=60, check=False, cwd=out)
        self.assertEqual(again.returncode, 5, again.stderr)
        self.assertIn(crash["reason"].split(" in ")[1], again.stderr)
        page = (out / "report.html").read_text(encoding="utf-8")
        self.assertNotIn("@REPORT@", page)
        self.assertNotIn("@TOOLS@", page)
        some = sorted((out / "store").rglob("*.tray"))[::20]
        for pack in some:
            self.ok("validate", pack)

    def test_a_supervisor_killed_at_random_loses_nothing(self):
        models, out, undisturbed = self.folder("in", SMALL), self.folder("out"), self.folder("undisturbed")
        options = ["--no-previews", "--quiet", "--json"]
        self.json_of("batch", models, "-o", undisturbed, *options)
        seconds = events(undisturbed, "stop")[0]["seconds"]
        rng, kills = random.Random(3), 0
        for _ in range(20):
            with start(models, "-o", out, "--resume", *options) as batch:
                try:
                    batch.wait(rng.uniform(0, 0.5 * seconds))
                except subprocess.TimeoutExpired:
                    batch.send_signal(signal.SIGKILL)
                    kills += 1
        self.assertGreater(kills, 3)
        self.json_of("batch", models, "-o", out, "--resume", *options)
        self.assertEqual(packs(out), packs(undisturbed))
        made = [end["file"] for end in events(out, "end") if not end["found"]]
        self.assertEqual(len(made), len(set(made)))
        self.assertEqual(len({end["file"] for end in events(out, "end")}), len(SMALL))
        self.assertEqual(list((out / "tmp").iterdir()), [])

    def test_ctrl_c_keeps_what_is_finished_and_says_how_to_go_on(self):
        models, out = self.folder("in", SMALL), self.folder("out")
        with start(models, "-o", out, "--jobs", "1") as batch:
            while not events(out, "end"):
                time.sleep(0.01)
            batch.send_signal(signal.SIGINT)
            text, messages = batch.communicate(timeout=60)
        self.assertEqual(batch.returncode, 128 + signal.SIGINT, messages)
        self.assertIn("--resume", text)
        self.assertIn("Ctrl-C again", messages)
        ended = len(events(out, "end"))
        self.assertTrue(0 < ended < len(SMALL), ended)
        self.assertEqual(len(events(out, "start")), ended)
        report = self.json_of("batch", models, "-o", out, "--resume", "--json")
        self.assertEqual((report["skipped"], report["classes"]["done"]), (ended, len(SMALL) - ended))

    def test_retry_needs_no_inputs_and_keeps_each_files_options(self):
        models, out = self.folder("in", ["unit_sphere.stp", "revolved_sphere.step"]), self.folder("out")
        (models / "broken.step").write_text("no model", encoding="ascii")
        with zipfile.ZipFile(models / "parts.zip", "w") as archive:
            archive.writestr("other.step", "no model either")
        program = [str(case.OPTIONS.bin / "trimray"), "batch"]
        options = ["--no-previews", "--trim-memory", "50%", "--json"]
        first = subprocess.run([*program, ".", "-o", str(out), *options, "--failures-ok"], cwd=models, timeout=60,
                               capture_output=True, text=True, check=True)
        self.assertEqual(json.loads(first.stdout)["classes"]["invalid"], 2)
        resumed = subprocess.run([*program, ".", "-o", str(out), *options, "--resume"], cwd=models, timeout=60,
                                 capture_output=True, text=True, check=False)
        self.assertEqual(resumed.returncode, 6, resumed.stderr)

        none = self.json_of("batch", "retry", out, "--class", "crash,memory", "--json")
        self.assertEqual((none["files"], none["left"]), (0, 0))
        shutil.copy2(MODELS / "nozzle.stp", models / "broken.step")
        retried = run("batch", "retry", out, "--trim-memory", "25%", "--compact", "--json")
        self.assertEqual(retried.returncode, 6, "the archive's member is broken still")
        report = json.loads(retried.stdout)
        self.assertEqual((report["files"], report["classes"]["done"], report["classes"]["invalid"]), (2, 1, 1))
        self.assertEqual(events(out, "run")[-1]["pack_words"], ["--no-previews", "--trim-memory", "25%", "--compact"])
        self.ok("validate", out / "packs" / "broken.step.tray")
        with zipfile.ZipFile(models / "parts.zip", "w") as archive:
            archive.write(MODELS / "sg1-c5-214.stp", "other.step")
        self.assertEqual(self.json_of("batch", "retry", out, "--json")["classes"]["done"], 1)
        self.assertEqual(self.json_of("batch", "retry", out, "--json")["files"], 0)
        told = self.json_of("batch", "report", out, "--json")
        self.assertEqual((told["files"], told["classes"]["done"], told["begun"]), (4, 4, []))

    def test_retry_takes_up_what_was_begun(self):
        models, out = self.folder("in", ["abc_00000050.step"]), self.folder("out")
        with start(models, "-o", out, "-q") as batch:
            while not list((out / "ledger").glob("*.jsonl")) or not events(out, "start"):
                time.sleep(0.01)
            batch.send_signal(signal.SIGKILL)
        self.assertEqual(len(events(out, "end")), 0)
        report = self.json_of("batch", "retry", out, "--no-previews", "--json")
        self.assertEqual((report["files"], report["classes"]["done"]), (1, 1))
        self.assertEqual(self.json_of("batch", "status", out, "--json")["begun"], [])

    def test_a_plan_shares_the_work_out(self):
        models, plan, out = self.folder("in", SMALL), self.folder("plan"), self.folder("out")
        shards = self.json_of("batch", "plan", models, "-n", "3", "-o", plan, "--json")["shards"]
        self.assertEqual(sum(shard["files"] for shard in shards), len(SMALL))
        for shard in shards:
            self.json_of("batch", "--list", shard["list"], "-o", out, "--no-previews", "--json")
        self.assertEqual(len(packs(out)), len(SMALL))

    def test_errors_say_what_to_do(self):
        models, out = self.folder("in", SMALL[:1]), self.folder("out")
        self.fails(1, "batch", models, says=["--output"])
        self.fails(1, "batch", "-o", out, says=["INPUTS"])
        self.fails(1, "batch", models, "-o", out, "--shard", "2/2", says=["--shard", "0/8"])
        self.fails(1, "batch", models, "-o", out, "--retry", "bad", says=["--retry", "timeout"])
        self.fails(1, "batch", models, "-o", out, "--memory-limit", "much", says=["--memory-limit"])
        self.fails(2, "batch", models / "missing", "-o", out, says=["missing", "check the path"])
        (out / "file").write_text("", encoding="ascii")
        self.fails(2, "batch", models, "-o", out / "file", says=["cannot be made"])
        self.fails(2, "batch", "status", models, says=["ledger"])
