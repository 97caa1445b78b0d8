"""What the scripts that take every file of a corpus of CAD files through programs, a row a file, share."""

import argparse
import os
import pathlib
import resource
import signal
import subprocess
import sys
import tempfile
import time


def run(command, timeout, memory_bytes=0):
    """Exit code, stdout, last line of stderr, wall seconds, peak MiB of the process and its children. -1: time is up."""
    def limit():
        os.setsid()
        if memory_bytes:
            resource.setrlimit(resource.RLIMIT_AS, (memory_bytes, memory_bytes))
    start = time.monotonic()
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        process = subprocess.Popen(command, stdout=out, stderr=err, preexec_fn=limit)
        code, usage = None, None
        while code is None:
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            if pid:
                code = os.waitstatus_to_exitcode(status)
            elif time.monotonic() - start > timeout:
                os.killpg(process.pid, signal.SIGKILL)
                os.wait4(process.pid, 0)
                code = -1
            else:
                time.sleep(0.01)
        process.returncode = code
        wall = time.monotonic() - start
        out.seek(0)
        err.seek(0)
        lines = [line for line in err.read().decode(errors="replace").splitlines() if line.strip()]
        return (code, out.read().decode(errors="replace"), lines[-1] if lines else "", wall,
                usage.ru_maxrss / 1024 if usage else 0)


def arguments(description, output, timeout, timeout_help, add=lambda parser: None):
    """The command line's options; `output` and `timeout` are defaults, `add` adds more to the parser."""
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("corpus", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path(output))
    parser.add_argument("--only", action="append", default=[], metavar="GLOB", help="e.g. 'small/*'; may be repeated")
    parser.add_argument("--build", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent / "build")
    parser.add_argument("--timeout", type=float, default=timeout, help=timeout_help)
    add(parser)
    return parser.parse_args()


def built(options, **programs):
    """The programs of a build by their name here; `programs`: their paths in it. Ends the script if one is missing."""
    paths = {name: options.build / path for name, path in programs.items()}
    for path in paths.values():
        if not path.exists():
            sys.exit(f"{path}: not built")
    return paths
