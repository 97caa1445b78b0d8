"""What tests of pages share: a page that a program wrote, opened in headless Chromium and asked by a script of the test.
Holds for every page: no error in its console, nothing asked of a network, its style is understood."""

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

TESTS = Path(__file__).resolve().parent
CHROMIUM = shutil.which("chromium")
OPTIONS = None  # parsed arguments: bin, the programs' folder

# Runs before the page's own script, and after it; what it finds is the text of one element in the dumped page. The policy
# forbids every request, and what asks for one all the same is told.
CATCH = """<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:">
<script>
window.faults = [];
window.addEventListener("error", e => faults.push(e.message));
document.addEventListener("securitypolicyviolation", e => faults.push(`asks for ${e.blockedURI} (${e.violatedDirective})`));
console.error = console.warn = (...words) => faults.push(words.join(" "));
</script>"""
ASK = """<script>
const found = {style: {width: getComputedStyle(document.body).maxWidth, scheme: getComputedStyle(document.documentElement).colorScheme,
  table: getComputedStyle(document.querySelector("table")).borderCollapse, dark: matchMedia("(prefers-color-scheme: dark)").matches,
  page: getComputedStyle(document.body).backgroundColor},
  broken: [...document.images].filter(i => !i.complete || i.naturalWidth === 0 || !i.alt).length, images: document.images.length};
@ASK@
setTimeout(() => {  // violations of the policy are told in a task of their own
  const all = document.createElement("script");
  all.type = "application/json"; all.id = "found"; all.textContent = JSON.stringify({...found, faults}).replaceAll("<", "\\\\u003c");
  document.body.append(all);
}, 100);
</script>"""


def ask(page, script, folder, *flags):
    """What `script` left in `found` after it ran in the page of that text. `folder` is for Chromium's files."""
    asked = folder / "asked.html"
    asked.write_text(page.replace("<head>", "<head>" + CATCH, 1).replace("</body>", ASK.replace("@ASK@", script) + "</body>"))
    dumped = subprocess.run([CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
                             f"--user-data-dir={folder}/profile", "--window-size=1200,2000", "--virtual-time-budget=5000",
                             *flags, "--dump-dom", asked.as_uri()],
                            capture_output=True, text=True, check=True, timeout=120).stdout
    return json.loads(re.search(r'id="found">(.*?)</script>', dumped, re.S)[1])


class PageTest(unittest.TestCase):
    """Of a class with `script`, which fills `found`, and write_page(folder), which returns the page's path."""

    script = ""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.page = cls.write_page(Path(cls.folder.name)).read_text()
        cls.found = ask(cls.page, cls.script, Path(cls.folder.name))

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_the_console_is_silent_and_nothing_is_asked_of_a_network(self):
        self.assertEqual(self.found["faults"], [])
        self.assertEqual(self.found["broken"], 0)

    def test_its_style_is_understood_in_light_and_dark(self):
        light = self.found["style"]
        self.assertEqual(light, {"width": "1100px", "scheme": "light dark", "table": "collapse", "dark": False,
                                 "page": "rgb(255, 255, 255)"})
        dark = ask(self.page, "", Path(self.folder.name), "--blink-settings=preferredColorScheme=0")["style"]
        self.assertEqual(dark, {**light, "dark": True, "page": "rgb(20, 23, 26)"})

    def test_it_is_alone_in_its_file(self):
        self.assertNotRegex(self.page, r"(src|href)\s*=\s*[\"']")
        self.assertNotRegex(re.sub(r"http://www\.w3\.org/(2000/svg|1999/xhtml)", "", self.page), r"https?://")
        self.assertNotIn("<script>alert", self.page)


def main(module):
    """The tests of a file, whose command line has --bin FOLDER; 77, and says so, without Chromium."""
    global OPTIONS
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--bin", type=Path, required=True)
    OPTIONS, rest = parser.parse_known_args()
    if CHROMIUM is None:
        print("skipped: no chromium")
        sys.exit(77)
    unittest.main(module, argv=[sys.argv[0], *rest])
