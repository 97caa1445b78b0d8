"""What tests of commands share: the model, a pack of it, a folder to write in, and how to run a program and judge how
it ends. run.py calls prepare() before it imports a file of tests, so that these have their values there."""

import json
import os
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

TESTS = Path(__file__).resolve().parent.parent
MODEL = TESTS / "models" / "io1-cm-214.stp"  # 29 faces: planes, cylinders, tori; colours
OPTIONS = None  # parsed arguments: bin, the programs' folder; has_pack, whether the converter is there; sanitized
WORK = None  # a temporary folder
PACK = None  # a valid pack


def prepare(options, folder):
    """Makes the pack in `folder`: the model's, or, where there is no converter, a golden one."""
    global OPTIONS, WORK, PACK
    OPTIONS = options
    OPTIONS.bin = OPTIONS.bin.resolve()
    OPTIONS.has_pack = (OPTIONS.bin / "trimray-pack").exists()
    os.environ["LC_ALL"] = "C.UTF-8"
    WORK = Path(folder)
    PACK = WORK / "model.tray"
    if not OPTIONS.has_pack:
        shutil.copy2(sorted((TESTS / "golden").glob("*.tray"))[0], PACK)
        return
    done = run("pack", MODEL, "-o", PACK)
    if done.returncode != 0:
        sys.exit(f"the test's model cannot be packed: {done.stderr}")


def run(*arguments, env=None, cwd=None, program="trimray", timeout=120):
    """The finished process, its output as text."""
    command = [str(OPTIONS.bin / program), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=timeout, env=env, cwd=cwd, check=False)


class CliTest(unittest.TestCase):
    needs_pack = False  # a real model, not a golden pack

    def setUp(self):
        if self.needs_pack and not OPTIONS.has_pack:
            self.skipTest("no converter in this build")

    def ok(self, *arguments, **keywords):
        done = run(*arguments, **keywords)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def fails(self, code, *arguments, says, **keywords):
        """The command ends with `code`, nothing on stdout, and one line on stderr that holds all of `says`."""
        done = run(*arguments, **keywords)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertEqual(done.stdout, "")
        lines = done.stderr.splitlines()
        self.assertEqual(len(lines), 1, done.stderr)
        self.assertTrue(lines[0].startswith("trimray"), lines[0])
        for words in says:
            self.assertIn(words, lines[0])
        return done

    def json_of(self, *arguments, **keywords):
        """The one object on stdout, and what was said on stderr."""
        done = self.ok(*arguments, **keywords)
        self.assertEqual(len(done.stdout.splitlines()), 1, "one object, one line")
        return json.loads(done.stdout)

