import os
import resource
import statistics
import subprocess

from case import OPTIONS, PACK, WORK, CliTest, run


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
