"""The command line as outside programs see it: what is printed where, the shape of the JSON, and the exit codes.

usage: cli_test.py --bin FOLDER [--sanitized] [unittest arguments]
FOLDER holds trimray and, where the converter is built, trimray-pack; without it the packs under golden/ stand in.
"""

import argparse
import csv
import json
import math
import os
import resource
import shutil
import statistics
import struct
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree
import zlib
from pathlib import Path

TESTS = Path(__file__).resolve().parent
MODEL = TESTS / "models" / "io1-cm-214.stp"  # 29 faces: planes, cylinders, tori; colours
COMMANDS = ["pack", "render", "info", "validate", "thumbnail", "export", "preview", "bench", "version"]
OPTIONS = None  # parsed arguments
WORK = None  # a temporary folder
PACK = None  # a valid pack


def run(*arguments, env=None, cwd=None, program="trimray"):
    """The finished process, its output as text."""
    command = [str(OPTIONS.bin / program), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, env=env, cwd=cwd, check=False)


def read_png(path):
    """Width, height and rows of RGBA bytes of an 8-bit RGBA PNG, or one with a colour map. Knows the five filters, not interlacing."""
    data = Path(path).read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", f"{path} is no PNG"
    at, packed, colours, opacity = 8, b"", b"", b""
    while at < len(data):
        (size,), kind = struct.unpack(">I", data[at : at + 4]), data[at + 4 : at + 8]
        body = data[at + 8 : at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", body[:10])
            assert color == 3 or (depth, color) == (8, 6), f"{path}: depth {depth}, colour type {color}"
        elif kind == b"PLTE":
            colours = body
        elif kind == b"tRNS":
            opacity = body
        elif kind == b"IDAT":
            packed += body
        at += 12 + size
    step = 4 if color == 6 else 1  # bytes from a pixel to the next, for the filters
    raw, stride = zlib.decompress(packed), width * 4 if color == 6 else (width * depth + 7) // 8
    rows, above = [], bytes(stride)
    for y in range(height):
        method, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        for x in range(stride):
            left = line[x - step] if x >= step else 0
            corner = above[x - step] if x >= step else 0
            if method == 1:
                line[x] = (line[x] + left) & 255
            elif method == 2:
                line[x] = (line[x] + above[x]) & 255
            elif method == 3:
                line[x] = (line[x] + (left + above[x]) // 2) & 255
            elif method == 4:
                p = left + above[x] - corner
                near = min((abs(p - left), 0, left), (abs(p - above[x]), 1, above[x]), (abs(p - corner), 2, corner))
                line[x] = (line[x] + near[2]) & 255
        rows.append(bytes(line))
        above = rows[-1]
    if color == 3:
        opacity += b"\xff" * (len(colours) // 3 - len(opacity))
        mapped = [colours[3 * i : 3 * i + 3] + opacity[i : i + 1] for i in range(len(opacity))]
        shifts = [(x * depth // 8, 8 - depth - x * depth % 8) for x in range(width)]
        rows = [b"".join(mapped[row[at] >> shift & (1 << depth) - 1] for at, shift in shifts) for row in rows]
    return width, height, rows


def alphas(rows):
    return [row[x] for row in rows for x in range(3, len(row), 4)]


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

    def json_of(self, *arguments):
        """The one object on stdout, and what was said on stderr."""
        done = self.ok(*arguments)
        self.assertEqual(len(done.stdout.splitlines()), 1, "one object, one line")
        return json.loads(done.stdout)


class Usage(CliTest):
    def test_no_arguments_print_the_help(self):
        done = self.ok()
        for command in COMMANDS:
            self.assertRegex(done.stdout, rf"(?m)^  {command} ")
        self.assertEqual(done.stdout, self.ok("--help").stdout)

    def test_every_command_explains_itself_with_an_example(self):
        for command in COMMANDS:
            if command == "pack" and not OPTIONS.has_pack:
                continue
            text = self.ok(command, "--help").stdout
            self.assertIn("Example", text, command)
            self.assertRegex(text, rf"trimray[ -]{command} ", command)

    def test_unknown_commands_and_options_suggest_the_nearest(self):
        self.fails(1, "rendr", says=["no command 'rendr'", "did you mean 'render'?"])
        self.fails(1, "val", says=["did you mean 'validate'?"])
        self.fails(1, "frobnicate", says=["no command 'frobnicate'", "trimray --help"])
        self.fails(1, "render", "a.tray", "-o", "a.png", "--sise", "1x1", says=["'--sise'", "did you mean '--size'?"])
        self.fails(1, "--frob", says=["--frob"])

    def test_missing_arguments_are_usage_errors(self):
        for command in ["render", "info", "validate", "thumbnail", "preview"]:
            self.fails(1, command, says=[command, "required", f"trimray {command} --help"])

    def test_version_is_the_same_everywhere(self):
        text = self.ok("--version").stdout
        self.assertRegex(text, r"^trimray \d+\.\d+\.\d+\n$")
        self.assertEqual(self.ok("version").stdout, text)
        self.assertEqual("trimray " + self.json_of("version", "--json")["version"], text.strip())

    def test_a_full_disk_behind_stdout_is_an_error(self):
        with open("/dev/full", "w", encoding="ascii") as full:
            done = subprocess.run([OPTIONS.bin / "trimray", "version"], stdout=full, stderr=subprocess.PIPE, text=True,
                                  check=False)
        self.assertEqual(done.returncode, 2)
        self.assertIn("stdout", done.stderr)

    def test_pack_is_found_beside_trimray_then_in_libexec_then_in_path(self):
        """With stand-ins that say where they lie; the folders are made anew, so nothing else is found."""
        prefix, other = WORK / "prefix", WORK / "other"
        for folder in [prefix / "bin", prefix / "libexec" / "trimray", other]:
            folder.mkdir(parents=True)
            stand_in = folder / "trimray-pack"
            stand_in.write_text('#!/bin/sh\necho "$0 $*"; exit 6\n', encoding="ascii")
            stand_in.chmod(0o755)
        shutil.copy2(OPTIONS.bin / "trimray", prefix / "bin" / "trimray")
        env = dict(os.environ, PATH=f"{other}:/usr/bin:/bin")
        for folder in [prefix / "bin", prefix / "libexec" / "trimray", other]:
            done = subprocess.run([prefix / "bin" / "trimray", "pack", "a b.step", "--json", "-o", "x"], env=env,
                                  capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 6, "the program's own exit code comes through")
            self.assertIn(str(folder) if folder != other else "trimray-pack", done.stdout)
            self.assertIn("a b.step --json -o x", done.stdout)
            (folder / "trimray-pack").unlink()
        done = subprocess.run([prefix / "bin" / "trimray", "pack", "x"], env=env, capture_output=True, text=True,
                              check=False)
        self.assertEqual(done.returncode, 4)
        self.assertIn("trimray-pack: not found", done.stderr)
        self.assertIn("TRIMRAY_PREPROCESS", done.stderr)


class Start(CliTest):
    """The runtime starts fast: what it does not need is not loaded."""

    def test_neither_the_cad_kernel_nor_the_picture_library_is_linked(self):
        for file in [OPTIONS.bin / "trimray", OPTIONS.bin.parent / "lib" / "libtrimray.so"]:
            linked = subprocess.run(["ldd", file], capture_output=True, text=True, check=True).stdout
            self.assertIn("libc.so", linked)
            self.assertNotRegex(linked, r"libTK|OpenImageIO|OpenColorIO|libvulkan|not found")
        self.assertNotIn("libdraco", linked, "the library needs no mesh codec")

    def test_the_picture_library_is_loaded_only_for_exr(self):
        env = dict(os.environ, LD_DEBUG="files")
        self.assertNotIn("OpenImageIO", run("info", PACK, env=env).stderr)
        for name in ["loaded.png", "loaded.exr"]:
            done = run("render", PACK, "-o", WORK / name, "--size", "8x8", "--device", "cpu", env=env)
            (self.assertIn if name.endswith(".exr") else self.assertNotIn)("OpenImageIO", done.stderr)

    def test_version_takes_less_than_50_ms(self):
        if OPTIONS.sanitized:
            self.skipTest("sanitizers take their time")
        times = []  # of the processor: the clock on the wall says how busy the machine is
        for _ in range(15):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            run("--version")
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        self.assertLess(statistics.median(times), 0.050)


class Info(CliTest):
    KEYS = ["version", "source", "units", "faces", "faces_by_kind", "instances", "patches", "leaves", "parts",
            "bounds_mm", "bytes_by_section", "effects", "dropped"]

    def test_json_has_the_agreed_keys(self):
        info = self.json_of("info", PACK, "--json")
        self.assertEqual(list(info)[: len(self.KEYS)], self.KEYS)
        self.assertRegex(info["version"], r"^\d+\.\d+$")
        self.assertEqual(sum(info["faces_by_kind"].values()), info["faces"])
        self.assertLessEqual(sum(info["bytes_by_section"].values()), PACK.stat().st_size)
        low, high = info["bounds_mm"]
        for axis in range(3):
            self.assertLess(low[axis], high[axis])
        for item in info["effects"]:
            self.assertEqual(set(item), {"name", "why"})
            self.assertTrue(item["name"] and item["why"])

    def test_steeper_rays_are_proved_for_more_leaves(self):
        leaves = self.json_of("info", PACK, "--json")["bezier_leaves"]
        proved = [leaves["proved_above_deg"][degrees] for degrees in ["5", "10", "20", "45"]]
        self.assertEqual(proved, sorted(proved))
        self.assertLessEqual(proved[-1] + leaves["flagged"], leaves["count"])

    def test_json_says_what_is_in_the_model(self):
        if not OPTIONS.has_pack:
            self.skipTest("no converter in this build")
        info = self.json_of("info", PACK, "--json")
        self.assertEqual(info["source"], MODEL.name)
        self.assertEqual(info["units"].upper(), "MM")
        self.assertEqual(info["faces"], 29)
        self.assertEqual(info["faces_by_kind"]["plane"], 5)
        self.assertEqual(info["faces_by_kind"]["cylinder"], 22)
        self.assertEqual(info["faces_by_kind"]["torus"], 2)
        self.assertEqual(info["dropped"], [])
        names = [item["name"] for item in info["effects"]]
        self.assertTrue({"plane", "cylinder", "torus", "trim-exact"} <= set(names), names)
        self.assertNotIn("sphere", names)

    def test_text_says_the_same(self):
        text = self.ok("info", PACK).stdout
        info = self.json_of("info", PACK, "--json")
        self.assertIn(info["source"], text)
        self.assertRegex(text, rf"(?m)^faces +{info['faces']}\b")
        for section, stored in info["bytes_by_section"].items():
            self.assertRegex(text, rf"(?m)^{section} .* {stored} ")
        for item in info["effects"]:
            self.assertIn(item["why"], text)

    def test_missing_files_and_files_that_are_no_packs(self):
        no_pack = WORK / "no_pack.tray"
        no_pack.write_text("solid of words\n" * 100, encoding="ascii")
        empty = WORK / "empty.tray"
        empty.write_bytes(b"")
        cut = WORK / "cut.tray"
        cut.write_bytes(PACK.read_bytes()[: PACK.stat().st_size // 2])
        for command, rest in [("info", []), ("validate", []), ("render", ["-o", WORK / "x.png"]),
                              ("thumbnail", [WORK / "x.png"]), ("preview", ["-o", WORK / "x"])]:
            self.fails(2, command, WORK / "missing.tray", *rest, says=["missing.tray"])
            self.fails(2, command, WORK, *rest, says=[str(WORK)])  # a folder
            for file in [no_pack, empty, cut]:
                done = run(command, file, *rest)
                self.assertEqual(done.returncode, 3, f"{command} {file}: {done.stderr}")
                self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
                self.assertIn(file.name, done.stderr)
        self.assertFalse((WORK / "x.png").exists())


class Validate(CliTest):
    def test_a_valid_pack_has_no_findings(self):
        self.assertIn("valid", self.ok("validate", PACK).stdout)
        report = self.json_of("validate", PACK, "--json")
        self.assertEqual((report["valid"], report["findings"]), (True, []))

    def test_a_changed_byte_is_a_numbered_finding(self):
        data = bytearray(PACK.read_bytes())
        data[len(data) * 2 // 3] ^= 0x10
        broken = WORK / "broken.tray"
        broken.write_bytes(data)
        done = run("validate", broken)
        self.assertEqual(done.returncode, 3)
        self.assertRegex(done.stdout, r"broken\.tray: .+ \[F\d+\]")
        done = run("validate", broken, "--json")
        self.assertEqual(done.returncode, 3)
        report = json.loads(done.stdout)
        self.assertFalse(report["valid"])
        for finding in report["findings"]:
            self.assertEqual(set(finding), {"number", "section", "detail"})
            self.assertGreater(finding["number"], 0)


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
        budget = json.loads(done.stdout)["time_budget"]
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
        self.ok("render", PACK, "-o", whole, *asked)
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
                              "--turntable", 2, "--time-budget", "1e-6", "--json")
        self.assertNotIn("time_budget", report)
        for number, picture in enumerate(report["pictures"], 1):
            self.assertEqual(picture["time_budget"]["gave_up"], [{"what": "size traced", "from": "full", "to": "1/3"}])
            self.assertTrue((WORK / f"budgeted_{number}.exr").exists())

    def test_wrong_time_budgets_are_usage_errors(self):
        for value in ["0", "-5", "nan", "soon", ""]:
            self.fails(1, "render", PACK, "-o", WORK / "g.png", "--time-budget", value, says=["--time-budget"])

    def test_a_picture_that_cannot_be_written_is_named(self):
        target = WORK / "no_such_folder" / "h.png"
        self.fails(2, "render", PACK, "-o", target, "--size", "8x8", "--device", "cpu", says=[str(target)])


class Scene(CliTest):
    """Scene files, the options that say the same, and pictures from several cameras."""

    needs_pack = True
    SMALL = ("--size", "40x30", "--device", "cpu")

    def scene(self, text, name="scene.json"):
        path = WORK / name
        path.write_text(text if isinstance(text, str) else json.dumps(text))
        return path

    def picture(self, name, *arguments):
        self.ok("render", PACK, "-o", WORK / name, *self.SMALL, *arguments)
        return (WORK / name).read_bytes()

    def plan(self, *arguments):
        """The names of what a picture calls for beyond the pack and its shading."""
        names = [item["name"] for item in self.json_of("render", PACK, "--explain", "--json", "--device", "cpu",
                                                       *arguments)["plan"]]
        plain = [item["name"] for item in self.json_of("render", PACK, "--explain", "--json", "--device", "cpu")["plan"]]
        return [name for name in names if name not in plain]

    def test_a_scene_file_and_the_options_make_the_same_picture(self):
        for key, options in [
                ({"cameras": [{"view": "front"}]}, ["--view", "front"]),
                ({"cameras": [{"eye": [90, -100, 80], "target": [0, 0, 0], "up": [0, 1, 0], "fov_deg": 50}]},
                 ["--eye", "90,-100,80", "--target", "0,0,0", "--up", "0,1,0", "--fov", "50"]),
                ({"background": "#204060"}, ["--background", "#204060"]),
                ({"effects": {"edges": {"lines": "all", "width_px": 3, "color": "#ff0000"}, "silhouettes": True}},
                 ["--edges", "all", "--edge-width", "3", "--edge-color", "#ff0000", "--silhouettes"]),
                ({"effects": {"style": "edges-only"}}, ["--style", "edges-only"]),
                ({"effects": {"antialias": {"samples": 3, "trims": True}}}, ["--samples", "3", "--antialias", "trims"])]:
            plain = self.picture("plain.png")
            made = self.picture("scene.png", "--scene", self.scene(key))
            self.assertEqual(made, self.picture("options.png", *options), key)
            self.assertNotEqual(made, plain, key)

    def test_options_win_over_the_file(self):
        path = self.scene({"cameras": [{"name": "a", "view": "front"}, {"name": "b", "view": "top"}],
                           "background": "white", "effects": {"edges": {"lines": "sharp"}}})
        self.assertEqual(self.picture("a.png", "--scene", path, "--edges", "none", "--background", "transparent"),
                         self.picture("b.png", "--view", "front"))
        self.assertEqual(self.picture("a.png", "--scene", path, "--camera", "b"),
                         self.picture("b.png", "--scene", path, "--view", "top"))
        self.fails(1, "render", PACK, "-o", WORK / "c.png", "--scene", path, "--camera", "c", says=["--camera", "'c'"])
        self.fails(1, "render", PACK, "-o", WORK / "c.png", "--camera", "c", says=["--camera", "no scene file"])

    def test_each_option_is_a_key_of_the_file(self):
        for options, key, effects in [
                (["--light", "direction=1,0,-1,strength=0.5"], {"lights": [{"direction": [1, 0, -1], "strength": 0.5}]},
                 ["lights"]),
                (["--shadows", "hard"], {"effects": {"shadows": {"kind": "hard"}}}, ["lights", "shadows"]),
                (["--shadows", "soft", "--light-samples", "4"], {"effects": {"shadows": {"kind": "soft", "samples": 4}}},
                 ["lights", "shadows", "soft-shadows"]),
                (["--light", "position=0,0,9,radius_mm=2,shadows=true"],
                 {"lights": [{"position": [0, 0, 9], "radius_mm": 2, "shadows": True}]},
                 ["lights", "shadows", "soft-shadows"]),
                (["--occlusion", "8,2.5"], {"effects": {"occlusion": {"samples": 8, "reach_mm": 2.5}}}, ["occlusion"]),
                (["--section", "0,0,1:0,0,1", "--section", "-1,0,0:1,0,0", "--caps", "none"],
                 {"effects": {"section": {"planes": [{"point": [0, 0, 1], "normal": [0, 0, 1]},
                                                     {"point": [-1, 0, 0], "normal": [1, 0, 0]}], "caps": "none"}}},
                 ["section"]),
                (["--material", "color=#aabbcc"], {"materials": [{"color": "#aabbcc"}]}, ["materials"]),
                (["--material", "faces=0+1,mirror=0.5", "--mirror-depth", "3"],
                 {"materials": [{"faces": [0, 1], "mirror": 0.5}], "effects": {"mirror_depth": 3}}, ["mirrors"]),
                (["--xray", "0.25"], {"effects": {"xray": 0.25}}, ["transparency"]),
                (["--map", "curvature-mean", "--map-range", "-1,1"],
                 {"effects": {"map": {"kind": "curvature-mean", "range": [-1, 1]}}}, ["curvature-mean"]),
                (["--map", "zebra", "--map-direction", "1,0,0", "--stripes", "4"],
                 {"effects": {"map": {"kind": "zebra", "direction": [1, 0, 0], "stripes": 4}}}, ["zebra"]),
                (["--map", "draft", "--draft", "5"], {"effects": {"map": {"kind": "draft", "draft_deg": 5}}},
                 ["draft"]),
                (["--ortho", "20"], {"cameras": [{"height_mm": 20}]}, ["orthographic"]),
                (["--ortho", "fit"], {"cameras": [{"parallel": True}]}, ["orthographic"])]:
            self.assertEqual(self.plan(*options), effects, options)
            whys = [self.json_of("render", PACK, "--explain", "--json", "--device", "cpu", *arguments)["plan"]
                    for arguments in (options, ("--scene", self.scene(key)))]
            self.assertEqual(*whys)

    def test_faults_of_the_file_are_named_by_line_and_key(self):
        for text, says in [
                ('{\n "lights": [\n  {"direction": "up"}]}', ["scene.json:3:", "lights[0].direction", '"up"']),
                ('{"efects": {}}', ["scene.json:1:", "efects", "did you mean 'effects'?"]),
                ('{"effects": {\n"xray": 2}}', ["scene.json:2:", "effects.xray", "[0, 1]", "found 2"]),
                ('{"background": "white",\n"background": "black"}', ["scene.json:2:", "twice"]),
                ('{"cameras": [\n', ["scene.json:", "syntax error"]), ("[" * 100000, ["scene.json:1:", "deep"])]:
            self.fails(3, "render", PACK, "-o", WORK / "no.png", "--scene", self.scene(text), says=says)
        self.fails(2, "render", PACK, "-o", WORK / "no.png", "--scene", WORK / "none.json", says=["none.json"])
        self.fails(2, "render", PACK, "-o", WORK / "no.png", "--scene", self.scene({"environment": "sky.hdr"}),
                   says=[str(WORK / "sky.hdr")])
        (WORK / "sky.hdr").write_bytes(b"#?RADIANCE\nnothing")
        self.fails(3, "render", PACK, "-o", WORK / "no.png", "--environment", WORK / "sky.hdr", says=["sky.hdr"])
        self.fails(4, "render", PACK, "-o", WORK / "no.png", "--environment", WORK / "sky.png", says=[".hdr", ".exr"])
        self.assertFalse((WORK / "no.png").exists())

    def test_the_schema_has_the_keys_that_are_read(self):
        schema = json.loads((TESTS.parent / "examples" / "scene.schema.json").read_text())

        def resolved(node):
            return schema["$defs"][node["$ref"].split("/")[-1]] if "$ref" in node else node

        def check(node, around):
            """around(text): a scene file with `text` in the node's place."""
            done = run("render", PACK, "--explain", "--scene", self.scene(around('{"?": 1}')))
            self.assertEqual(done.returncode, 3)
            known = done.stderr.split("there are ")[1].split(" [E")[0].split(", ")
            self.assertEqual(known, list(node["properties"]))
            for key, value in node["properties"].items():
                inner = resolved(value)
                if inner.get("type") == "object":
                    check(inner, lambda text, key=key: around(f'{{"{key}": {text}}}'))
                elif inner.get("type") == "array" and resolved(inner["items"]).get("type") == "object":
                    check(resolved(inner["items"]), lambda text, key=key: around(f'{{"{key}": [{text}]}}'))

        check(schema, lambda text: text)

    def test_wrong_options_are_usage_errors(self):
        for option, value, said in [
                ("--light", "up", "key=value"), ("--light", "direction=0,0,0", "no length"),
                ("--light", "direction=1,2,3,colour=white", "'color'"), ("--light", "direction=1,2,nan", "three numbers"),
                ("--shadows", "sharp", "hard"), ("--light-samples", "0", "4096"), ("--occlusion", "4,0", "reach"),
                ("--occlusion", "-1", "4096"), ("--section", "1,2,3", "x,y,z:nx,ny,nz"),
                ("--section", "1,2,3:0,0,0", "no length"), ("--caps", "full", "filled"), ("--xray", "2", "[0, 1]"),
                ("--material", "part=a", "gives nothing"), ("--material", "opacity=2", "[0, 1]"),
                ("--map", "zebras", "'zebra'"), ("--map-range", "2,1", "below"), ("--stripes", "0", "10000"),
                ("--draft", "90", "90)"), ("--ortho", "0", "number"), ("--ortho", "whole", "number")]:
            says = [option, said] if said != "reach" else [option]
            self.fails(1, "render", PACK, "-o", WORK / "no.png", option, value, says=says)
        self.fails(1, "render", PACK, "-o", WORK / "no.png", "--eye", "1,2,3", "--ortho", "fit", says=["--ortho"])
        self.fails(1, "render", PACK, "-o", WORK / "no.png", "--fov", "30", "--ortho", "3", says=["exclude"])
        self.assertFalse((WORK / "no.png").exists())

    def test_rules_that_match_nothing_are_told(self):
        done = self.ok("render", PACK, "--explain", "--device", "cpu", "--scene",
                       self.scene('{"materials": [{"opacity": 0.5},\n{"part": "No such part", "opacity": 0.5}]}'))
        self.assertEqual(done.stderr, f"trimray: {WORK / 'scene.json'}:2: materials[1]: matches no face of the pack\n")

    def test_explain_says_why_and_makes_a_picture_only_where_one_is_named(self):
        done = self.ok("render", PACK, "--explain", "--device", "cpu", "--edges", "sharp")
        self.assertRegex(done.stdout, r"(?m)^effect +why\n")
        self.assertRegex(done.stdout, r"(?m)^edges +asked for: ")
        report = self.json_of("render", PACK, "-o", WORK / "e.png", *self.SMALL, "--explain", "--json")
        self.assertEqual([item["name"] for item in report["plan"]], report["effects"])
        self.assertTrue((WORK / "e.png").exists())
        self.fails(1, "render", PACK, says=["-o"])

    def test_a_turntable_starts_at_the_camera_and_goes_round(self):
        report = self.json_of("render", PACK, "-o", WORK / "turn_%03d.png", *self.SMALL, "--turntable", 4, "--eye",
                              "90,-100,80", "--target", "0,0,0", "--json")
        files = [WORK / f"turn_{i:03}.png" for i in range(1, 5)]
        self.assertEqual([picture["file"] for picture in report["pictures"]], [str(file) for file in files])
        self.assertEqual(list(report["pictures"][0]),
                         ["file", "camera", "ms_per_frame", "rays_per_second", "uncertified_pixels", "work"])
        self.assertEqual(list(report), ["device", "width", "height", "frames", "trim", "closest", "bytes", "effects",
                                        "pictures"])
        pictures = [file.read_bytes() for file in files]
        self.assertEqual(pictures[0], self.picture("one.png", "--eye", "90,-100,80", "--target", "0,0,0"))
        self.assertEqual(len(set(pictures)), 4)
        self.ok("render", PACK, "-o", WORK / "whole.png", *self.SMALL, "--turntable", 10)
        for i in range(1, 11):
            _, _, rows = read_png(WORK / f"whole_{i:02}.png")
            border = rows[0] + rows[-1] + b"".join(row[:4] + row[-4:] for row in rows)
            self.assertEqual(max(border[3::4]), 0, "framed whole at every step")
            self.assertGreater(alphas(rows).count(255), 0)

    def test_cameras_of_a_file_make_a_picture_each(self):
        cameras = [{"name": "a", "view": "front"}, {"view": "top", "fov_deg": 20}]
        for name, text in [("list.json", cameras), ("scene.json", {"cameras": cameras})]:
            report = self.json_of("render", PACK, "-o", WORK / "from.png", *self.SMALL, "--frames-from",
                                  self.scene(text, name), "--json")
            self.assertEqual([(p["file"], p["camera"]) for p in report["pictures"]],
                             [(str(WORK / "from_1.png"), "a"), (str(WORK / "from_2.png"), "")])
            self.assertEqual((WORK / "from_2.png").read_bytes(), self.picture("b.png", "--view", "top", "--fov", "20"))
        wrong = self.scene([{"view": "front"}, {"view": "frnt"}], "wrong.json")
        self.fails(3, "render", PACK, "-o", WORK / "wrong.png", *self.SMALL, "--frames-from", wrong,
                   says=["wrong.json:1", "cameras[1].view", "'front'"])
        self.fails(3, "render", PACK, "-o", WORK / "wrong.png", *self.SMALL, "--frames-from", self.scene("{}"),
                   says=["no cameras"])
        self.assertEqual(list(WORK.glob("wrong*.png")), [], "a fault in one camera is found before the first picture")
        for pattern in ["a%s.png", "a%d%d.png", "a%.png", "a%03.png"]:
            self.fails(1, "render", PACK, "-o", WORK / pattern, *self.SMALL, "--turntable", 2, says=["-o", "%0Nd"])


class Thumbnail(CliTest):
    needs_pack = True

    def test_previews_are_square_and_scaled(self):
        self.ok("preview", PACK, "-o", WORK / "p")
        self.assertEqual(read_png(WORK / "p-256.png")[:2], (256, 256))
        self.assertEqual(read_png(WORK / "p-512.png")[:2], (512, 512))
        for size in [16, 256, 512]:
            self.ok("thumbnail", "-s", size, PACK, WORK / "t.png")
            width, height, rows = read_png(WORK / "t.png")
            self.assertEqual((width, height), (size, size))
            covered = sum(alphas(rows)) / 255 / size**2
            self.assertTrue(0.1 < covered < 0.9, covered)

    def test_the_stored_preview_is_what_the_tracer_shows(self):
        self.ok("preview", PACK, "-o", WORK / "q")
        self.ok("thumbnail", PACK, WORK / "t256.png")
        self.assertEqual((WORK / "q-256.png").read_bytes(), (WORK / "t256.png").read_bytes())


def read_glb(path):
    """The JSON chunk of a binary glTF file, and the size of its binary chunk."""
    data = path.read_bytes()
    magic, version, size, json_size, json_kind = struct.unpack_from("<4sIII4s", data)
    assert (magic, version, size, json_kind) == (b"glTF", 2, len(data), b"JSON"), f"{path} is no glTF"
    binary_size, binary_kind = struct.unpack_from("<I4s", data, 20 + json_size)
    assert (binary_kind, 28 + json_size + binary_size) == (b"BIN\0", size), f"{path}: binary chunk"
    return json.loads(data[20 : 20 + json_size]), binary_size


def placed_corners(gltf, index=0, parents=()):
    """The corners of every placed primitive's bounds, in the scene's metres."""
    node = gltf["nodes"][index]
    chain = (*parents, node["matrix"]) if "matrix" in node else parents
    for primitive in gltf["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
        bounds = gltf["accessors"][primitive["attributes"]["POSITION"]]
        for corner in range(8):
            point = [bounds["max" if corner >> axis & 1 else "min"][axis] for axis in range(3)]
            for m in reversed(chain):
                point = [sum(m[4 * k + row] * point[k] for k in range(3)) + m[12 + row] for row in range(3)]
            yield point
    for child in node.get("children", []):
        yield from placed_corners(gltf, child, chain)


class Export(CliTest):
    needs_pack = True

    def test_the_model_stands_upright_in_metres_and_is_whole(self):
        info = self.json_of("info", PACK, "--json")
        low, high = info["bounds_mm"]
        # z up to y up, mm to metres: (x, y, z) -> (x, z, -y) / 1000
        expected_lo = [low[0] / 1000, low[2] / 1000, -high[1] / 1000]
        expected_hi = [high[0] / 1000, high[2] / 1000, -low[1] / 1000]
        slack = 0.05 * max(b - a for a, b in zip(expected_lo, expected_hi))  # the triangles are coarse
        sizes = {}
        for draco in [[], ["--draco"]]:
            report = self.json_of("export", PACK, "-o", WORK / "model.glb", "--json", *draco)
            gltf, sizes[bool(draco)] = read_glb(WORK / "model.glb")
            self.assertEqual((report["nodes"], report["meshes"]), (len(gltf["nodes"]), len(gltf["meshes"])))
            self.assertGreater(report["triangles"], info["faces"])
            corners = list(placed_corners(gltf))
            for axis in range(3):
                lo, hi = min(c[axis] for c in corners), max(c[axis] for c in corners)
                self.assertGreater(lo, expected_lo[axis] - slack)
                self.assertLess(hi, expected_hi[axis] + slack)
                # the pack's bounds are those of its boxes, which are larger than what is in them
                self.assertGreater(hi - lo, 0.7 * (expected_hi[axis] - expected_lo[axis]))
        self.assertLess(sizes[True], sizes[False] / 2)

    def test_errors_have_their_exit_codes(self):
        self.fails(1, "export", PACK, "-o", WORK / "model.obj", says=[".glb"])
        self.fails(2, "export", WORK / "missing.tray", "-o", WORK / "x.glb", says=["missing.tray"])
        self.fails(2, "export", PACK, "-o", WORK / "no_folder" / "x.glb", says=["no_folder", "No such file"])
        self.assertFalse((WORK / "x.glb").exists())


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
        report = self.json_of(*options, "--json", "--rounds", 1)
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
                self.fails(3, "bench", "accuracy", broken, "-o", root, says=["broken.step", "was not converted: trimray-pack"])

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


class Pack(CliTest):
    needs_pack = True

    def test_json_has_the_agreed_keys(self):
        report = self.json_of("pack", MODEL, "-o", WORK / "again.tray", "--json")
        for key in ["faces", "converted", "dropped", "seconds", "bytes"]:
            self.assertIn(key, report)
        self.assertEqual((report["faces"], report["converted"], report["dropped"]), (29, 29, []))
        self.assertTrue({"read", "transfer", "convert", "trims", "bvh", "write"} <= set(report["seconds"]))
        trims = report["trims"]
        self.assertLess(trims["largest_pcurve_deviation_mm"], 1)
        self.assertLessEqual(len(trims["edges_above_tolerance"]), trims["pcurves_above_tolerance"])
        self.assertEqual(sum(trims["findings"].values()), len(report["trim_findings"]))
        self.assertEqual(trims["findings"]["loop is not grown"], 0)

    def test_says_what_is_doubtful_about_trims(self):
        text = self.ok("pack", MODEL, "-o", WORK / "again.tray").stdout
        self.assertRegex(text, r"\ntrims +pcurves within \S+ mm of their edges, \d+ beyond an edge's tolerance, \d+ rebuilt")

    def test_patches_have_no_more_leaves_than_they_may(self):
        leaves = {}
        for budget in ["1", "1024"]:
            out = WORK / "leaves.tray"
            self.ok("pack", MODEL, "-o", out, "--surfaces", "bezier", "--leaf-budget", budget, "--no-previews")
            info = self.json_of("info", out, "--json")
            leaves[budget] = info["leaves"]
            if budget == "1":
                self.assertEqual(info["leaves"], info["patches"])
        self.assertGreater(leaves["1024"], leaves["1"])
        for budget in ["0", "4097", "one"]:
            self.fails(1, "pack", MODEL, "-o", WORK / "x.tray", "--leaf-budget", budget, says=["--leaf-budget"])

    def test_the_same_model_gives_the_same_bytes(self):
        self.ok("pack", MODEL, "-o", WORK / "same.tray")
        self.assertEqual(PACK.read_bytes(), (WORK / "same.tray").read_bytes())

    def test_writes_a_mesh_in_a_packs_place(self):
        out = WORK / "model.trimesh"
        sizes = {}
        for deflection in ["1e-2", "1e-4"]:
            report = self.json_of("pack", MODEL, "--mesh", deflection, "-o", out, "--json")
            self.assertEqual((report["faces"], report["dropped"], report["without_triangles"]), (29, [], []))
            self.assertEqual(set(report["seconds"]), {"read", "transfer", "mesh", "write"})
            self.assertEqual(report["bytes"], out.stat().st_size)
            sizes[deflection] = report
        coarse, fine = sizes["1e-2"], sizes["1e-4"]
        self.assertGreater(fine["triangles"], 2 * coarse["triangles"])
        self.assertAlmostEqual(coarse["deflection_mm"] / fine["deflection_mm"], 100)
        self.assertRegex(self.ok("pack", MODEL, "--mesh", "1e-2", "-o", out).stdout, r"\ntriangles +\d+ with \d+ vertices")

    def test_a_mesh_takes_no_options_of_packs(self):
        out = WORK / "none.trimesh"
        for options in [["--compact"], ["--trim-memory", "50%"], ["--leaf-budget", "1"], ["--no-previews"]]:
            self.fails(1, "pack", MODEL, "--mesh", "1e-3", "-o", out, *options, says=["--mesh", options[0]])
        for deflection in ["0", "-1e-3", "0.2", "nan", "fine"]:
            self.fails(1, "pack", MODEL, f"--mesh={deflection}", "-o", out, says=["--mesh"])
        self.fails(3, "pack", MODEL, "--mesh", "1e-12", "-o", out, says=["no triangles"]) # finer than the kernel goes
        self.assertFalse(out.exists())

    def test_errors_have_their_exit_codes(self):
        self.assertEqual(run("pack").returncode, 1)
        self.assertEqual(run("pack", MODEL, "-o", WORK / "x.tray", "--frob").returncode, 1)
        self.assertEqual(run("pack", WORK / "missing.step", "-o", WORK / "x.tray").returncode, 2)
        junk = WORK / "junk.step"
        junk.write_text("not a model\n", encoding="ascii")
        self.assertEqual(run("pack", junk, "-o", WORK / "x.tray").returncode, 3)
        self.assertEqual(run("pack", MODEL, "-o", WORK / "no_folder" / "x.tray").returncode, 2)
        self.assertFalse((WORK / "x.tray").exists())


def main():
    global OPTIONS, WORK, PACK
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=Path, required=True)
    parser.add_argument("--sanitized", action="store_true")
    OPTIONS, rest = parser.parse_known_args()
    OPTIONS.bin = OPTIONS.bin.resolve()
    OPTIONS.has_pack = (OPTIONS.bin / "trimray-pack").exists()
    os.environ["LC_ALL"] = "C.UTF-8"
    with tempfile.TemporaryDirectory(prefix="trimray-cli-") as folder:
        WORK = Path(folder)
        PACK = WORK / "model.tray"
        if OPTIONS.has_pack:
            done = run("pack", MODEL, "-o", PACK)
            if done.returncode != 0:
                sys.exit(f"the test's model cannot be packed: {done.stderr}")
        else:
            shutil.copy2(sorted((TESTS / "golden").glob("*.tray"))[0], PACK)
        unittest.main(argv=[sys.argv[0], *rest])


if __name__ == "__main__":
    main()
