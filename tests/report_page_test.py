#!/usr/bin/env python3
"""The page that `trimray bench accuracy` writes, opened in headless Chromium: no error in its console, plots and tables
there, in words too, sorting works, and nothing is asked of a network.

    report_page_test.py --bin FOLDER [unittest's own arguments]

FOLDER holds trimray and trimray-measure. Without Chromium the test is skipped, and says so (exit code 77).
"""

import json
import shutil
import subprocess

import page_case
from page_case import TESTS

PACK = TESTS / "golden" / "synthetic.tray"

ASK = """
Object.assign(found, {models: document.querySelectorAll("#models section").length,
  plots: [...document.querySelectorAll("#models figure svg")].map(s => ({points: s.querySelectorAll(".point").length, label: s.getAttribute("aria-label"),
    outside: [...s.querySelectorAll(".point")].filter(p => { const b = p.getBoundingClientRect(), o = s.getBoundingClientRect(); return b.right > o.right + 1 || b.left < o.left - 1 || b.top < o.top - 1 || b.bottom > o.bottom + 1; }).length})),
  named: [...document.querySelectorAll(".point")].every(p => p.getAttribute("aria-label").includes(":")),
  words: document.querySelector("#models section p:nth-of-type(2)").textContent, command: document.getElementById("command").textContent});
const times = () => [...document.querySelectorAll("#models section:first-child .scroll:last-of-type tbody tr")].map(r => Number(r.children[1].textContent.replace(/,/g, "")));
const click = key => document.querySelector(`#models section:first-child th[data-key=${key}] button`).click();
found.rows = times().length;
click("picture_ms"); found.up = times();
click("picture_ms"); found.down = times();
found.cards = [...document.querySelectorAll("#models section")].map(s => s.querySelectorAll(".card").length);
found.paper = [...document.querySelectorAll("#paper table")].map(t => t.querySelectorAll("tbody tr").length);
found.overview = document.querySelectorAll("#overview tbody tr").length;
found.smooth = [...document.querySelectorAll("caption")].filter(c => c.textContent.includes("anti-aliasing")).map(c => c.parentElement.querySelectorAll("tbody tr").length);
found.sorted = document.querySelector("th[data-key=picture_ms]").getAttribute("aria-sort");
for (const input of document.querySelectorAll("#measures input")) { input.click(); found.plots.push(document.querySelectorAll("#models figure svg .point").length); }
"""


class Page(page_case.PageTest):
    script = ASK

    @classmethod
    def write_page(cls, folder):
        bin_folder = page_case.OPTIONS.bin
        pack = folder / "<script>alert(1)<&script>.tray"  # names come from files
        shutil.copy(PACK, pack)
        # a CAD file has peers; a build without the converter has packs alone
        models = [pack, PACK] + ([TESTS / "models" / "nozzle.stp"] if (bin_folder / "trimray-pack").exists() else [])
        subprocess.run([bin_folder / "trimray", "bench", "accuracy", *models, "-o", folder, "--quick", "--size", "48x36",
                        "--views", "2", "--rounds", "2"], check=True, capture_output=True)
        cls.report = json.loads((folder / "report.json").read_text())
        return folder / "report.html"

    def test_every_model_has_its_plots_tables_and_words(self):
        models = self.report["models"]
        counts = [sum(c["dial"] != "anti-aliasing" for c in m["contenders"]) for m in models]
        contenders = counts[0]
        self.assertEqual(self.found["models"], len(models))
        plots = self.found["plots"][:2 * len(models)]
        self.assertEqual([plot["points"] for plot in plots], [count for count in counts for _ in range(2)])
        self.assertEqual([plot["outside"] for plot in plots], 2 * len(models) * [0])
        self.assertTrue(all("table below" in plot["label"] for plot in plots))
        self.assertTrue(self.found["named"])
        self.assertEqual(self.found["plots"][2 * len(models):], 4 * [2 * sum(counts)], "each measure of error")
        self.assertIn("The default takes", self.found["words"])
        self.assertEqual(self.found["rows"], contenders)

    def test_each_contender_that_differs_is_shown_where_it_is_worst(self):
        differing = [sum(any(v["points"][i]["psnr_db"] is not None for v in m["views"])
                         for i, c in enumerate(m["contenders"]) if c["dial"] != "anti-aliasing") for m in self.report["models"]]
        self.assertGreater(sum(differing), 0)
        self.assertEqual(self.found["cards"], differing)
        self.assertEqual(self.found["images"], 3 * sum(differing), "the reference, the contender, the map")

    def test_smooth_borders_and_all_models_have_their_tables(self):
        models = self.report["models"]
        self.assertEqual(self.found["smooth"], [3] * len(models))
        peers = sum("paper" in m for m in models)
        self.assertEqual(self.found["overview"], len(models) + (peers > 0))
        self.assertEqual(self.found["paper"], [5 + peers, 5 + peers, 5 + peers, 1 + peers] if peers else [])

    def test_headings_sort(self):
        self.assertEqual(self.found["up"], sorted(self.found["up"]))
        self.assertEqual(self.found["down"], sorted(self.found["up"], reverse=True))
        self.assertGreater(len(set(self.found["up"])), 1)
        self.assertEqual(self.found["sorted"], "descending")

    def test_it_says_how_to_make_it_again(self):
        self.assertEqual(self.found["command"], self.report["command"])


if __name__ == "__main__":
    page_case.main(__name__)
