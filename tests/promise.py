#!/usr/bin/env python3
"""Measures on every file of a corpus of CAD files whether pictures keep what `--error-px` promises.

    tests/promise.py CORPUS_DIR [-o promise.tsv] [--only GLOB] [--build DIR] [--error-px E,...] [--timeout S]

Each file (`.zst` ones are decompressed first) is packed and goes through `error_promise`, in processes of their own: three
views of the whole model, each traced at every E and held against the reference in double. A row is appended as soon as
its file is done, and files that have a row are skipped, so an interrupted run goes on where it stopped.
Exit code: 0 when every file that can be packed keeps the promise, 1 otherwise.
"""

import csv
import fnmatch
import json
import pathlib
import sys
import tempfile

from bench_tables import MODEL_ENDINGS, decompressed, plain_name
from corpus_tables import arguments, built, run

SLACK_SECONDS = 20  # the converter's own limit comes first, and gives the clearer message
KEPT, NOT_PACKED, TIME_IS_UP = "kept", "not packed", "time is up"


def columns(errors):
    per_error = [f"{what} {error}" for error in errors for what in ("centre", "within", "broken", "worst px")]
    return ["file", "verdict", "s_pack", "s_measure", "pixels", "hits"] + per_error + ["remark"]


def chosen_files(options):
    """Paths relative to the corpus, those that --only names, small files first."""
    found = []
    for path in options.corpus.rglob("*"):
        if path.is_file() and pathlib.Path(plain_name(path)).suffix.lower() in MODEL_ENDINGS:
            found.append(path)
    names = [p.relative_to(options.corpus) for p in sorted(found, key=lambda p: (p.stat().st_size, str(p)))]
    return [name for name in names
            if not options.only or any(fnmatch.fnmatch(str(name), glob) for glob in options.only)]


def done_rows(options):
    """The rows that the table has, by file."""
    if not options.output.exists():
        return {}
    with open(options.output, newline="", encoding="utf-8") as table:
        return {row["file"]: row for row in csv.DictReader(table, delimiter="\t")}


def describe(pixel):
    """Of a broken pixel: where, what was traced there, what is right, and how far away the traced answer is shown."""
    shown = pixel["shown_within_px"]
    return (f"{pixel['view']} {pixel['pixel'][0]},{pixel['pixel'][1]}: {pixel['traced_mm']} for {pixel['right_mm']} mm, "
            f"face {pixel['face'][0]} for {pixel['face'][1]}, "
            f"{'nowhere near' if shown is None else f'shown within {shown:g} px'}"
            f"{', certified' if pixel['certified'] else ''}{'' if pixel['sure'] else ', the reference is in doubt'}")


def measure_file(corpus, name, options, tools):
    row = dict.fromkeys(columns(options.error_px), "")
    row["file"] = str(name)
    with tempfile.TemporaryDirectory() as folder:
        pack = pathlib.Path(folder) / "model.tray"
        command = [tools["pack"], str(decompressed(corpus / name, folder)), "-o", str(pack), "--json", "--timeout",
                   str(int(options.timeout))]
        code, _, message, wall, _ = run(command, options.timeout + SLACK_SECONDS)
        row["s_pack"] = f"{wall:.1f}"
        if code not in (0, 6):
            # the packer's own limit, or that on it
            row.update(verdict=TIME_IS_UP if "[E502]" in message or code == -1 else NOT_PACKED, remark=message[:200])
            return row
        command = [tools["promise"], str(pack), "--size", options.size, "--error-px", ",".join(options.error_px)]
        code, out, message, wall, _ = run(command, options.timeout)
        row["s_measure"] = f"{wall:.1f}"
        if code not in (0, 1):
            row.update(verdict=TIME_IS_UP if code == -1 else f"exit code {code}", remark=message[:200])
            return row
    remarks = []
    for error, line in zip(options.error_px, map(json.loads, out.splitlines())):
        row.update({"pixels": line["pixels"], "hits": line["hits"],
                    f"centre {error}": line["at_centre"], f"within {error}": line["within"],
                    f"broken {error}": line["broken"],
                    f"worst px {error}": "inf" if line["worst_px"] is None else f"{line['worst_px']:g}"})
        remarks += [f"{error}: {describe(pixel)}" for pixel in line["worst"]]
    row["verdict"] = "broken" if remarks else KEPT
    row["remark"] = "; ".join(remarks)
    return row


def add_options(parser):
    parser.add_argument("--error-px", type=lambda text: text.split(","), default=["1", "0.1", "0.02", "0.001"])
    parser.add_argument("--size", default="160x90")


def main():
    options = arguments(__doc__, "promise.tsv", 300, "seconds to pack a file, and to measure it", add_options)
    tools = built(options, pack="bin/trimray-pack", promise="tests/error_promise")
    done = done_rows(options)
    rows = []
    with open(options.output, "a", newline="", encoding="utf-8") as table:
        writer = csv.DictWriter(table, columns(options.error_px), delimiter="\t", lineterminator="\n")
        if table.tell() == 0:
            writer.writeheader()
        for name in chosen_files(options):
            row = done.get(str(name))
            if row is None:
                row = measure_file(options.corpus, name, options, tools)
                writer.writerow(row)
                table.flush()
                print("\t".join(map(str, row.values())), flush=True)
            rows.append(row)
    measured = [row for row in rows if row["pixels"]]
    for error in options.error_px:
        total = {what: sum(int(row[f"{what} {error}"]) for row in measured) for what in ("centre", "within", "broken")}
        print(f"error-px {error}: {len(measured)} models, {sum(int(row['pixels']) for row in measured)} pixels, "
              f"{sum(int(row['hits']) for row in measured)} hits, "
              f"{total['centre']} kept at their middle, {total['within']} within {error} px, {total['broken']} broken",
              file=sys.stderr)
    return 0 if all(row["verdict"] in (KEPT, NOT_PACKED) for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
