#!/usr/bin/env python3
"""Packs and validates every file of a corpus of CAD files, and prints a table.

    tests/corpus.py CORPUS_DIR [-o table.tsv] [--only GLOB] [--build DIR] [--timeout S] [--limit-seconds S]

Each file (`.zst` ones are decompressed first) goes through `trimray-pack` and `trimray validate` in processes of their
own. A row is appended as soon as its file is done, and files that have a row are skipped, so an interrupted run goes on
where it stopped. The face counts are compared with `faces_unique` in the corpus' MANIFEST.tsv; a file without faces
there has to end with one line that says why, the exit code of its class, and no pack.
Exit code: 0 when every row is `ok`, 1 otherwise.
"""

import csv
import fnmatch
import json
import pathlib
import subprocess
import sys
import tempfile
import time

from bench_tables import decompressed
from corpus_tables import SLACK_SECONDS, arguments, built, chosen_files, done_rows, run

PHASES = ["read", "transfer", "faces", "mesh", "convert", "trims", "bvh", "proxy", "preview", "write"]
COLUMNS = (["file", "verdict", "exit", "faces", "expected", "converted", "dropped"] + [f"s_{p}" for p in PHASES] +
           ["s_wall", "peak_mib", "pack_bytes", "zst_bytes", "remark"])
# A file without a shape is invalid input, or one that made the kernel crash.
REFUSALS = {3, 4, 5}
# What is right although it is not "ok": the verdict that is expected, and why.
KNOWN = {
    "hard/ap203_invalid_brep.stp": ("not packed", "its only loop is one circle around an endless cylinder: no area"),
    "hard/Legacy_Klicky_Probe.step.zst":
        ("faces dropped", "one face that the kernel itself splits off at a pole, outside of its own surface"),
    "large/composite_voron_klicky_parts_x3.step.zst":
        ("faces dropped", "four faces between two edges with the same curve: no area"),
}


def manifest_faces(corpus):
    with open(corpus / "MANIFEST.tsv", newline="", encoding="utf-8") as table:
        return {row["path"]: int(row["faces_unique"]) for row in csv.DictReader(table, delimiter="\t")}


def compressed_size(path):
    if path.suffix == ".zst":
        return path.stat().st_size
    with subprocess.Popen(["zstd", "-19", "-q", "-c", str(path)], stdout=subprocess.PIPE) as process:
        size = len(process.stdout.read())
    return size


def why_faces_differ(model, faces, expected, pack_command, timeout):
    """A reason that makes another count than the manifest's right, or nothing."""
    if faces > expected and b"DOCUMENT_FILE" in model.read_bytes():
        return "with the files it refers to, which the manifest does not count"
    with tempfile.TemporaryDirectory() as folder:
        healed = [*pack_command, "--heal"]
        healed[healed.index("-o") + 1] = str(pathlib.Path(folder) / "healed.tray")
        code, out, _, _, _ = run(healed, timeout + SLACK_SECONDS)
        if code in (0, 6) and json.loads(out)["faces"] == expected:
            return f"{expected} faces with --heal, which splits some"
    return ""


def check_file(corpus, name, expected, tools, timeout, pack_dir):
    row = dict.fromkeys(COLUMNS, "")
    row["file"] = str(name)
    row["expected"] = "" if expected is None else expected
    with tempfile.TemporaryDirectory() as folder:
        model = decompressed(corpus / name, folder)
        pack = (pack_dir or pathlib.Path(folder)) / (str(name).replace("/", "__").removesuffix(".zst") + ".tray")
        pack.unlink(missing_ok=True)
        row["zst_bytes"] = compressed_size(corpus / name)
        pack_command = [tools["pack"], str(model), "-o", str(pack), "--json", "--timeout", str(int(timeout))]
        code, out, message, wall, peak = run(pack_command, timeout + SLACK_SECONDS)
        row.update(exit=code, s_wall=f"{wall:.2f}", peak_mib=f"{peak:.0f}", remark=message[:200])
        faults = []
        if code in (0, 6):
            try:
                report = json.loads(out)
            except json.JSONDecodeError:
                row["verdict"] = "no report"
                return row
            row.update(faces=report["faces"], converted=report["converted"], dropped=len(report["dropped"]),
                       pack_bytes=report["bytes"])
            for phase in PHASES:
                row[f"s_{phase}"] = f"{report['seconds'].get(phase, 0):.2f}"
            if report["warnings"]:
                row["remark"] = "; ".join(report["warnings"])[:300]
            if expected is not None and report["faces"] != expected:
                excuse = why_faces_differ(model, report["faces"], expected, pack_command, timeout)
                if excuse:
                    row["remark"] = excuse
                else:
                    faults.append("faces differ")
            if report["dropped"]:
                reasons = sorted({str(d["reason"]) for d in report["dropped"]})
                row["remark"] = "; ".join(reasons)[:300]
                faults.append("faces dropped")
            if (code == 6) != bool(report["dropped"]):
                faults.append("exit code")
            if pack.stat().st_size != report["bytes"]:
                faults.append("bytes differ")
            valid, _, complaint, _, _ = run([tools["trimray"], "validate", str(pack)], timeout)
            if valid != 0:
                faults.append("not valid")
                row["remark"] = complaint[:200]
        else:
            if expected:
                faults.append("not packed")
            if code not in REFUSALS:
                faults.append("time is up" if code == -1 else "exit code")
            if not message:
                faults.append("no message")
            if pack.exists():
                faults.append("left a pack")
        row["verdict"] = ", ".join(faults) or "ok"
        verdict, reason = KNOWN.get(str(name), ("", ""))
        if row["verdict"] == verdict:
            row.update(verdict="ok", remark=reason)
    return row


def add_options(parser):
    parser.add_argument("--skip", action="append", default=[], metavar="GLOB")
    parser.add_argument("--limit-seconds", type=float, default=float("inf"), help="start no further file after this")
    parser.add_argument("--keep", type=pathlib.Path, metavar="DIR", help="keep the packs there")


def main():
    options = arguments(__doc__, "corpus.tsv", 600, "seconds a file", add_options)
    tools = built(options, pack="bin/trimray-pack", trimray="bin/trimray")
    if options.keep:
        options.keep.mkdir(parents=True, exist_ok=True)
    expected = manifest_faces(options.corpus)
    done = done_rows(options)
    names = [n for n in chosen_files(options) if not any(fnmatch.fnmatch(str(n), g) for g in options.skip)]

    start = time.monotonic()
    rows = []
    with open(options.output, "a", newline="", encoding="utf-8") as table:
        writer = csv.DictWriter(table, COLUMNS, delimiter="\t", lineterminator="\n")
        if not done and table.tell() == 0:
            writer.writeheader()
        for name in names:
            if str(name) in done:
                rows.append(done[str(name)])
                continue
            if time.monotonic() - start > options.limit_seconds:
                print(f"{len(names) - len(rows)} files left for another run", file=sys.stderr)
                break
            row = check_file(options.corpus, name, expected.get(str(name)), tools, options.timeout, options.keep)
            writer.writerow(row)
            table.flush()
            rows.append(row)
            print("\t".join(str(row[c]) for c in COLUMNS), flush=True)
    bad = [row for row in rows if row["verdict"] != "ok"]
    print(f"{len(rows)} files, {len(rows) - len(bad)} ok, {len(bad)} not", file=sys.stderr)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
