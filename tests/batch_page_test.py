#!/usr/bin/env python3
"""The page that `trimray batch report` writes, opened in headless Chromium: what ended how and why is there, with commands
and previews, sorting works, and names of files are text, whatever they hold.

    batch_page_test.py --bin FOLDER [unittest's own arguments]

FOLDER holds trimray and trimray-batch. Without Chromium the test is skipped, and says so (exit code 77).
"""

import json
import shlex
import shutil
import subprocess

import page_case
from page_case import TESTS

# Names come from files. A folder's "<" and what lies in it make "</script>" of a path.
MODELS = {"unit_sphere.stp": "unit_sphere.stp", "<script>alert(1)<&amp;.step": "revolved_sphere.step",
          "x<": {"script><img src=x onerror=alert(2)>.stp": "io1-cm-214.stp"}}
BROKEN = {"\"quo'ted\" & <b>bold.step": b"ISO-10303-21;\nHEADER;\nno more",
          "empty.step": b"", "empty too.step": b"", "mesh $(id) `id`.step": b"solid of triangles\nfacet normal 0 0 1\n",
          "x<": {"script>cut.step": b"ISO-10303-21;\nHEADER;\nno more of this one either"}}

ASK = """
const cells = (id, n) => [...document.querySelectorAll(`#${id} tbody tr`)].map(r => r.children[n].textContent);
const sorts = {}, whole = id => [...document.querySelectorAll(`#${id} tbody tr`)].map(r => [...r.children].map(c => c.textContent));
for (const id of ["groups", "slowest", "failures", "runs"])
  sorts[id] = {first: whole(id), by: Object.fromEntries([...document.querySelectorAll(`#${id} thead th`)].map(th => {
    const button = th.querySelector("button");
    button.click(); const up = whole(id), said = [th.getAttribute("aria-sort")];
    button.click(); said.push(th.getAttribute("aria-sort"));
    return [th.dataset.key, {up, down: whole(id), said, others: document.querySelectorAll(`#${id} th[aria-sort]`).length}];
  }))};
Object.assign(found, {sorts, classes: document.querySelector("#classes").textContent,
  bar: document.querySelector(".bar").getAttribute("aria-label"), bars: document.querySelectorAll(".plots svg path").length,
  cards: [...document.querySelectorAll("#thumbnails .card")].map(c => c.textContent), alts: [...document.images].map(i => i.alt),
  phases: cells("phases", 0), quantiles: cells("quantiles", 1), made: document.getElementById("made").textContent,
  hostile: document.querySelectorAll("main b, main script, main img:not(#thumbnails img)").length,
  wide: document.documentElement.scrollWidth - document.documentElement.clientWidth});
"""


def write(folder, files):
    folder.mkdir(exist_ok=True)
    for name, content in files.items():
        if isinstance(content, dict):
            write(folder / name, content)
        elif isinstance(content, bytes):
            (folder / name).write_bytes(content)
        else:
            shutil.copy(TESTS / "models" / content, folder / name)


def names(files, before=""):
    return {name for key, content in files.items()
            for name in (names(content, before + key + "/") if isinstance(content, dict) else {before + key})}


class Page(page_case.PageTest):
    script = ASK

    @classmethod
    def write_page(cls, folder):
        trimray = page_case.OPTIONS.bin.resolve() / "trimray"
        cls.models, out = folder / "models", folder / "out"
        write(cls.models, MODELS)
        write(cls.models, BROKEN)
        for options in ([], ["--resume"]):  # two runs
            done = subprocess.run([trimray, "batch", ".", "-o", out, "--quiet", *options], cwd=cls.models, check=False,
                                  capture_output=True, text=True)
            assert done.returncode == 6, done.stderr
        [ledger] = (out / "ledger").glob("*.jsonl")
        begun = json.loads(ledger.read_text(encoding="utf-8").splitlines()[0])
        with open(ledger, "a", encoding="utf-8") as lines:  # what a run that was killed at once leaves
            lines.write(json.dumps({**begun, "run": "killed"}) + "\n")
        cls.report = json.loads(subprocess.run([trimray, "batch", "report", out, "-o", folder / "page.html", "--json"],
                                               check=True, capture_output=True, text=True).stdout)
        return folder / "page.html"

    def rows(self, table):
        return self.found["sorts"][table]["first"]

    def test_all_ends_are_counted_in_words_too(self):
        self.assertEqual(self.report["classes"]["done"], len(names(MODELS)))
        for where in (self.found["classes"], self.found["bar"]):
            for name, count in self.report["classes"].items():
                self.assertEqual(f"{count} {name}" in where, count > 0)
        self.assertIn(f"{len(names(MODELS)) + len(names(BROKEN))} files", self.found["made"])

    def test_groups_of_failures_have_a_command(self):
        groups = self.report["groups"]
        self.assertEqual(self.rows("groups"), [[group["class"], group["reason"], str(group["files"]), group["example"],
                                                group["repeat"]] for group in groups])
        self.assertEqual(sorted(group["files"] for group in groups), [1, 2, 2])
        for group in groups:
            words = shlex.split(group["repeat"])
            self.assertEqual(words[:5], ["cd", str(self.models), "&&", "trimray", "pack"])
            self.assertEqual(words[5], "./" + group["example"])

    def test_names_are_text_whatever_they_hold(self):
        self.assertEqual({row[0] for row in self.rows("slowest")}, names(MODELS))
        self.assertEqual({row[0] for row in self.rows("failures")}, names(BROKEN))
        self.assertEqual(set(self.found["alts"]), {f"Preview of {name}" for name in names(MODELS)})
        self.assertEqual(self.found["hostile"], 0)

    def test_packs_are_shown_and_measured(self):
        self.assertEqual(self.found["images"], len(names(MODELS)))
        self.assertEqual(len(self.found["cards"]), len(names(MODELS)))
        self.assertTrue(any("1 face," in card for card in self.found["cards"]))
        self.assertGreater(self.found["bars"], 2)
        self.assertTrue({"read", "transfer", "convert", "preview", "write"} <= set(self.found["phases"]))
        self.assertEqual(self.found["quantiles"], 3 * [str(len(names(MODELS)))])
        self.assertLessEqual(self.found["wide"], 0, "tables scroll, the page does not")

    def test_headings_sort(self):
        changed = 0
        for table, data in (("groups", "groups"), ("slowest", "slowest"), ("failures", "failures"), ("runs", "runs")):
            first, records = self.rows(table), self.report[data]
            self.assertEqual(len(first), len(records))
            record_of = {tuple(row): record for row, record in zip(first, records)}
            for key, clicked in self.found["sorts"][table]["by"].items():
                self.assertEqual((clicked["said"], clicked["others"]), (["ascending", "descending"], 1))
                for rows, sign in ((clicked["up"], 1), (clicked["down"], -1)):
                    self.assertEqual(sorted(rows), sorted(first), f"{table} by {key}")
                    values = [record_of[tuple(row)].get(key) for row in rows]
                    known = [value for value in values if value is not None]
                    self.assertEqual(values[:len(known)], known, f"{table} by {key}: rows without a value come last")
                    if known and not isinstance(known[0], str):  # words go by the reader's language
                        self.assertEqual(known, sorted(known)[::sign], f"{table} by {key}")
                    changed += rows != first
        self.assertGreater(changed, 10)
        words = [row[0] for row in self.found["sorts"]["failures"]["by"]["file"]["up"]]
        self.assertLess(words.index("empty too.step"), words.index("mesh $(id) `id`.step"))


if __name__ == "__main__":
    page_case.main(__name__)
