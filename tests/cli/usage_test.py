import os
import shutil
import subprocess

from case import OPTIONS, WORK, CliTest, run

COMMANDS = ["pack", "batch", "render", "info", "validate", "thumbnail", "export", "preview", "bench", "version"]


class Usage(CliTest):
    def test_no_arguments_print_the_help(self):
        done = self.ok()
        for command in COMMANDS:
            self.assertRegex(done.stdout, rf"(?m)^  {command} ")
        self.assertEqual(done.stdout, self.ok("--help").stdout)

    def test_every_command_explains_itself_with_an_example(self):
        for command in COMMANDS:
            if command in ["pack", "batch"] and not OPTIONS.has_pack:
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
