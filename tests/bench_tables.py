"""What the scripts that measure models and print tables in Markdown share."""

import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile

MODEL_ENDINGS = {".step", ".stp", ".igs", ".iges", ".brep"}
EQUAL_DB = 100.0  # more than any picture that differs in one pixel by one level: 8 million pixels would reach 117


def plain_name(path):
    return path.name[:-4] if path.suffix == ".zst" else path.name


def is_input(path):
    return path.is_file() and pathlib.Path(plain_name(path)).suffix.lower() in MODEL_ENDINGS | {".tray"}


def inputs(arguments):
    found = []
    for path in arguments:
        found += sorted(p for p in path.rglob("*") if is_input(p)) if path.is_dir() else [path]
    return found


def run_json(command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    if done.returncode not in (0, 6):
        raise RuntimeError((done.stderr.strip().splitlines() or ["no message"])[-1])
    return json.loads(done.stdout)


def geometric(values):
    values = list(values)
    return math.exp(sum(math.log(v) for v in values) / len(values)) if values else math.nan


def mean(values):
    values = list(values)
    return sum(values) / len(values) if values else math.nan


def decibels(row):
    return EQUAL_DB if row["psnr_db"] is None else min(row["psnr_db"], EQUAL_DB)


def shown(db):
    return "equal" if db >= EQUAL_DB else f"{db:.1f}"


def table(header, rows):
    print("| " + " | ".join(header) + " |\n|" + "---|" * len(header))
    for row in rows:
        print("| " + " | ".join(row) + " |")
    print()


def decompressed(path, folder):
    """The file itself, or what a `.zst` one holds, in `folder`."""
    if path.suffix != ".zst":
        return path
    plain = pathlib.Path(folder) / plain_name(path)
    subprocess.run(["zstd", "-d", "-q", "-f", path, "-o", plain], check=True)
    return plain


def pack_of(path, folder, build):
    """The pack of a model (`.zst` ones are decompressed first), made in `folder`; a pack is its own."""
    model = decompressed(path, folder)
    if model.suffix == ".tray":
        return model
    pack = pathlib.Path(folder) / "model.tray"
    run_json([build / "bin/trimray-pack", model, "-o", pack, "--no-previews", "--json"])
    return pack


def arguments(description, output, size, rounds, add=lambda parser: None):
    """The command line's options; `output`, `size` and `rounds` are defaults, `add` adds more to the parser."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("inputs", nargs="+", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path(output))
    parser.add_argument("--build", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent / "build")
    parser.add_argument("--size", default=size)
    parser.add_argument("--rounds", type=int, default=rounds)
    parser.add_argument("--threads", type=int, default=1)
    add(parser)
    return parser.parse_args()


def reports(options, measure):
    """The line of each model in options.output, in the order of options.inputs; what has none yet is measured:
    measure(pack, options) -> what the line holds beside the model's name."""
    done = {}
    if options.output.exists():
        done = {report["model"]: report for report in map(json.loads, options.output.read_text().splitlines())}
    found = []
    with open(options.output, "a", encoding="utf-8") as output:
        for path in inputs(options.inputs):
            name = path.name.removesuffix(".zst")
            if name not in done:
                print(f"{name} ...", file=sys.stderr, flush=True)
                try:
                    with tempfile.TemporaryDirectory() as folder:
                        done[name] = {"model": name, **measure(pack_of(path, folder, options.build), options)}
                except (RuntimeError, OSError, subprocess.CalledProcessError) as failure:
                    print(f"{name}: {failure}", file=sys.stderr)
                    continue
                output.write(json.dumps(done[name]) + "\n")
                output.flush()
            found.append(done[name])
    return found
