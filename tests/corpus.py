#!/usr/bin/env python3
"""Converts every file of a corpus of CAD files by one `trimray batch`, holds its ledger against the corpus' MANIFEST.tsv,
and prints a table.

    tests/corpus.py CORPUS_DIR [-o table.tsv] [--only GLOB] [--build DIR] [--timeout S] [--jobs N] [--keep DIR]

MANIFEST.tsv (tab-separated, with a heading) names each file in `path` and its faces in `faces_unique`. A row is `ok` when
the file has one final end, its faces are the manifest's (with those of the files it refers to), none is dropped, and its
pack is valid; of a file without faces, when it ended as one that cannot be converted, says why, and has no pack. Files
that only one of manifest and ledger has are rows too. With --keep the batch's folder stays, and the same command goes on
where an earlier one was interrupted; the folder is this script's alone.
Exit code: 0 when every row is `ok`, 1 otherwise.
"""

import collections
import concurrent.futures
import contextlib
import csv
import fnmatch
import json
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

from bench_tables import decompressed
from corpus_tables import arguments, built, run

PHASES = ["read", "transfer", "faces", "mesh", "convert", "trims", "bvh", "proxy", "preview", "write"]
COLUMNS = (["file", "verdict", "class", "exit", "attempt", "faces", "expected", "converted", "dropped"] +
           [f"s_{phase}" for phase in PHASES] +
           ["s_wall", "s_cpu", "peak_mib", "bytes", "source_bytes", "pack_bytes", "remark"])
EXITS = {"done": 0, "incomplete": 6, "io": 2, "invalid": 3, "unsupported": 4, "timeout": 5, "memory": 5, "crash": 5}
# How a file without a shape may end: as invalid input, or as one that made the kernel crash.
REFUSALS = {"invalid", "unsupported", "crash"}
# What is right although it is not "ok": the verdict that is expected, and why.
KNOWN = {
    "hard/ap203_invalid_brep.stp": ("not packed", "its only loop is one circle around an endless cylinder: no area"),
    "large/composite_voron_klicky_parts_x3.step.zst":
        ("faces dropped", "four faces between two edges with the same curve: no area"),
}
VALIDATE_SECONDS = 600


def manifest_faces(corpus):
    with open(corpus / "MANIFEST.tsv", newline="", encoding="utf-8") as table:
        return {row["path"]: int(row["faces_unique"]) for row in csv.DictReader(table, delimiter="\t")}


def chosen(names, patterns):
    """Those that `trimray batch --include` takes: a pattern with a `/` is of the path, another of the name alone."""
    def matches(name, pattern):
        return fnmatch.fnmatchcase(name if "/" in pattern else name.rsplit("/", maxsplit=1)[-1], pattern)
    return [name for name in names if not patterns or any(matches(name, pattern) for pattern in patterns)]


def run_batch(options, trimray, out):
    """The report of the batch of the corpus into `out`; names in its ledger are paths in the corpus."""
    command = [trimray, "batch", ".", "-o", out, "--json", "--resume", "--timeout", str(options.timeout), "--jobs",
               str(options.jobs)]
    for pattern in options.only:
        command += ["--include", pattern]
    with subprocess.Popen(command, cwd=options.corpus, stdout=subprocess.PIPE) as batch:
        interrupt = signal.signal(signal.SIGINT, signal.SIG_IGN)  # the batch has it too, and ends its files first
        text, _ = batch.communicate()
        signal.signal(signal.SIGINT, interrupt)
    if batch.returncode not in (0, 6):
        sys.exit(f"the batch ended with {batch.returncode}; with --keep DIR the same command goes on where it was")
    return json.loads(text)


def final_ends(out, latest):
    """By file its final ends, of runs with the same options and versions as the run `latest`."""
    events = []
    for ledger in sorted((out / "ledger").glob("*.jsonl")):
        events += [json.loads(line) for line in ledger.read_text(encoding="utf-8").splitlines()]
    runs = {event["run"]: event for event in events if event["event"] == "run"}
    basis = runs[latest]["basis"]
    ends = collections.defaultdict(list)
    for event in events:
        if event["event"] == "end" and event["final"] and runs[event["run"]]["basis"] == basis:
            ends[event["file"]].append(event)
    return ends


def referred_files(corpus, name, expected):
    """Files of the manifest that a STEP file refers to, and those that they refer to."""
    found, left = set(), [name]
    while left:
        file = left.pop()
        with tempfile.TemporaryDirectory() as folder:
            text = decompressed(corpus / file, folder).read_text(encoding="latin-1")
        for other in re.findall(r"\bDOCUMENT_FILE\s*\(\s*'([^']+)'", text):
            other = str(pathlib.PurePosixPath(file).parent / other)
            if other in expected and other not in found and other != name:
                found.add(other)
                left.append(other)
    return found


def faults_of_a_pack(row, end, pack, corpus, expected, trimray):
    """What is wrong with the pack and what the ledger says of it; the row's remark where there is something to say."""
    faults = []
    row["remark"] = "; ".join(end["warnings"])[:300]
    if end["faces"] != row["expected"]:
        parts = referred_files(corpus, row["file"], expected)
        if end["faces"] == row["expected"] + sum(expected[part] for part in parts):
            row["remark"] = f"with the faces of the {len(parts)} files it refers to"
        else:
            faults.append("faces differ")
    if end["dropped_faces"] > 0:
        row["remark"] = "; ".join(sorted({face["reason"] for face in end["dropped"]}))[:300]
        faults.append("faces dropped")
    if end["faces"] != end["converted"] + end["dropped_faces"]:
        faults.append("faces lost")
    if (end["class"] == "done") != (end["dropped_faces"] == 0):
        faults.append("class")
    if not pack.exists():
        return [*faults, "no pack"]
    if pack.stat().st_size != end["pack_bytes"]:
        faults.append("bytes differ")
    code, _, complaint, _, _ = run([trimray, "validate", str(pack)], VALIDATE_SECONDS)
    if code != 0:
        faults.append("not valid")
        row["remark"] = complaint[:200]
    return faults


def faults_of_a_refusal(row, end, pack):
    """What is wrong with how a file without a pack ended."""
    row["remark"] = end["error"]["detail"][:300]
    faults = []
    if row["expected"] > 0:
        faults.append("not packed")
    if end["class"] not in REFUSALS:
        faults.append("time is up" if end["class"] == "timeout" else "class")
    if not row["remark"]:
        faults.append("no message")
    if pack.is_symlink() or pack.exists():
        faults.append("left a pack")
    return faults


def judge(name, ends, expected, options, trimray, out):
    """A file's row: what the ledger says, and whether that is what the manifest lets expect."""
    row = dict.fromkeys(COLUMNS, "")
    row.update(file=name, expected=expected.get(name, ""))
    if name not in expected or len(ends) != 1:
        row["verdict"] = "not in the manifest" if name not in expected else f"{len(ends)} final ends"
        return row
    [end] = ends
    row.update({column: end[column] for column in ("class", "exit", "attempt", "bytes")})
    row.update({column: end.get(column, "") for column in ("faces", "converted", "source_bytes", "pack_bytes")})
    row.update(dropped=end.get("dropped_faces", ""), peak_mib=f"{end['peak_memory_bytes'] / 2**20:.0f}")
    seconds = end["seconds"]
    row.update({f"s_{phase}": f"{seconds[phase]:.2f}" for phase in ["wall", "cpu", *PHASES] if phase in seconds})
    pack = out / "packs" / (name + ".tray")
    if end["class"] in ("done", "incomplete"):
        faults = faults_of_a_pack(row, end, pack, options.corpus, expected, trimray)
    else:
        faults = faults_of_a_refusal(row, end, pack)
    if end["exit"] != EXITS[end["class"]]:
        faults.append("exit code")
    row["verdict"] = ", ".join(faults) or "ok"
    verdict, reason = KNOWN.get(name, ("ok", row["remark"]))
    if row["verdict"] == verdict:
        row.update(verdict="ok", remark=reason)
    elif name in KNOWN and not faults:
        row["verdict"] = "KNOWN is out of date"
    return row


def judge_all(options, trimray, out):
    """The batch, and the rows of what the manifest, the ledger or both have, by name."""
    report = run_batch(options, trimray, out)
    ends = final_ends(out, report["run"])
    expected = manifest_faces(options.corpus)
    names = chosen(sorted({*expected, *ends}), options.only)
    with concurrent.futures.ThreadPoolExecutor(options.jobs or None) as workers:
        rows = list(workers.map(lambda name: judge(name, ends[name], expected, options, trimray, out), names))
    for what in ("left", "unreadable_inputs"):
        if report[what] > 0:
            rows.append({**dict.fromkeys(COLUMNS, ""), "file": ".", "verdict": f"{what}: {report[what]}"})
    return rows


def add_options(parser):
    parser.add_argument("--jobs", type=int, default=0, metavar="N", help="files at a time; 0: one a core")
    parser.add_argument("--keep", type=pathlib.Path, metavar="DIR", help="keep the batch there, and go on with one that is")


def main():
    options = arguments(__doc__, "corpus.tsv", 600, "seconds a file", add_options)
    trimray = built(options, trimray="bin/trimray", batch="bin/trimray-batch")["trimray"].resolve()
    with contextlib.ExitStack() as stack:
        out = options.keep or pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="corpus-")))
        rows = judge_all(options, trimray, out.resolve())
    with open(options.output, "w", newline="", encoding="utf-8") as table:
        writer = csv.DictWriter(table, COLUMNS, delimiter="\t", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    print(options.output.read_text(encoding="utf-8"), end="")
    bad = [row for row in rows if row["verdict"] != "ok"]
    for row in bad:
        print(f"{row['file']}: {row['verdict']} {row['remark']}", file=sys.stderr)
    print(f"{len(rows)} files, {len(rows) - len(bad)} ok, {len(bad)} not", file=sys.stderr)
    return 1 if bad or not rows else 0


if __name__ == "__main__":
    sys.exit(main())
