"""tests/corpus.py judges a batch of a small corpus right: it is itself what the real corpus is judged by."""

import csv
import json
import shutil
import subprocess
import sys

import case
from case import TESTS, WORK, CliTest

sys.path.insert(0, str(TESTS))
from corpus import referred_files  # noqa: E402

FACES = {"round/unit_sphere.stp": 8, "round/revolved_sphere.step": 1, "io1-cm-214.stp": 29, "broken.step": 0}


class Corpus(CliTest):
    needs_pack = True

    def setUp(self):
        super().setUp()
        self.folder = WORK / "corpus" / self.id().rsplit(".", maxsplit=1)[-1]
        self.models, self.out = self.folder / "in", self.folder / "out"
        (self.models / "round").mkdir(parents=True)
        for name in FACES:
            if name != "broken.step":
                shutil.copy2(TESTS / "models" / name.rsplit("/", maxsplit=1)[-1], self.models / name)
        (self.models / "broken.step").write_text("ISO-10303-21;\nHEADER;\nno more", encoding="ascii")

    def judged(self, faces, *options):
        """Exit code, verdicts by file and stderr, with a manifest of these faces."""
        lines = ["path\tsha256\tfaces_unique\tnote"] + [f"{name}\t-\t{count}\t" for name, count in faces.items()]
        (self.models / "MANIFEST.tsv").write_text("\n".join(lines) + "\n", encoding="utf-8")
        table = self.folder / "table.tsv"
        command = [sys.executable, TESTS / "corpus.py", self.models, "--build", case.OPTIONS.bin.parent, "-o", table,
                   "--keep", self.out, *options]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
        self.assertIn(done.returncode, (0, 1), done.stderr)
        with open(table, newline="", encoding="utf-8") as rows:
            self.rows = {row["file"]: row for row in csv.DictReader(rows, delimiter="\t")}
        return done.returncode, {file: row["verdict"] for file, row in self.rows.items()}, done.stderr

    def ends(self):
        lines = [line for ledger in (self.out / "ledger").glob("*.jsonl") for line in ledger.read_text().splitlines()]
        return [event for event in map(json.loads, lines) if event["event"] == "end"]

    def test_a_right_manifest_is_ok_and_a_wrong_one_names_the_file(self):
        code, verdicts, said = self.judged(FACES)
        self.assertEqual((code, verdicts), (0, dict.fromkeys(FACES, "ok")), said)
        self.assertEqual({row["class"] for row in self.rows.values()}, {"done", "invalid"})
        self.assertEqual(self.rows["io1-cm-214.stp"]["converted"], "29")
        self.assertTrue(self.rows["broken.step"]["remark"])
        ended = len(self.ends())
        self.assertEqual(ended, len(FACES))

        code, verdicts, said = self.judged({**FACES, "io1-cm-214.stp": 30})
        self.assertEqual((code, verdicts), (1, {**dict.fromkeys(FACES, "ok"), "io1-cm-214.stp": "faces differ"}))
        self.assertIn("io1-cm-214.stp: faces differ", said)
        code, verdicts, _ = self.judged({**FACES, "broken.step": 2})
        self.assertEqual((code, verdicts["broken.step"]), (1, "not packed"))
        self.assertEqual(len(self.ends()), ended, "what is in the ledger is not converted again")

    def test_files_of_the_manifest_alone_and_of_the_batch_alone_are_named(self):
        code, verdicts, _ = self.judged({"gone.step": 3, **{name: FACES[name] for name in FACES if name != "broken.step"}})
        self.assertEqual((code, verdicts["gone.step"], verdicts["broken.step"]), (1, "0 final ends", "not in the manifest"))
        self.assertEqual(sum(verdict == "ok" for verdict in verdicts.values()), 3)
        code, verdicts, said = self.judged(FACES, "--only", "round/*", "--only", "io1*.stp")
        self.assertEqual((code, set(verdicts)), (0, set(FACES) - {"broken.step"}), said)

    def test_a_pack_that_was_damaged_is_not_valid(self):
        self.judged(FACES)
        pack = (self.out / "packs/io1-cm-214.stp.tray").resolve()
        pack.chmod(0o644)
        damaged = bytearray(pack.read_bytes())
        damaged[len(damaged) // 2] ^= 1
        pack.write_bytes(damaged)
        code, verdicts, said = self.judged(FACES)
        self.assertEqual((code, verdicts["io1-cm-214.stp"]), (1, "not valid"), said)
        pack.write_bytes(damaged[:-1])
        self.assertIn("bytes differ", self.judged(FACES)[1]["io1-cm-214.stp"])

    def test_files_that_are_referred_to_are_found_through_others_and_once(self):
        refers = {"round/top.stp": ["part.stp", "middle.stp", "not_listed.stp"], "round/middle.stp": ["part.stp", "top.stp"],
                  "round/part.stp": [], "part.stp": []}
        for name, others in refers.items():
            text = "".join(f"#{i}=DOCUMENT_FILE('{other}','','',#9,'',$);\n" for i, other in enumerate(others))
            (self.models / name).write_text(text, encoding="ascii")
        self.assertEqual(referred_files(self.models, "round/top.stp", dict.fromkeys(refers, 1)),
                         {"round/part.stp", "round/middle.stp"})
