#!/usr/bin/env python3
"""Compares rendered depths with the CAD kernel's own ray intersections, over many models.

    tests/agreement.py MODEL... [-o table.tsv] [--build DIR] [--size 160x120] [--pictures DIR]

Each model (`.zst` ones are decompressed first) is packed, rendered from two sides as EXR with `--trim exact`, and the
program occt_oracle casts the same rays. A row a model: share of rays that agree on hit or miss and on depth within 1e-5
of the diagonal, disagreements by cause, and up to a few of those that nothing explains. Files that have a row are skipped.
Exit code: 0 when every model reaches 99.99 % of the rays on which the kernel does not contradict itself, with nothing
unexplained; 1 otherwise.
"""

import argparse
import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile

COLUMNS = ["file", "verdict", "rays", "hits", "agree_percent", "edge", "tangent", "oracle", "unexplained",
           "worst_error", "rays_per_second", "remark"]
SHARE = 0.9999
VIEWS = {"a": (0.9, -1.3, 0.8), "b": (-1.1, 0.7, -0.6)}  # towards the eye; along no axis and no diagonal
FOV = 30.0


def camera(lo, hi, towards, aspect):
    """Eye and target that show the whole box."""
    centre = [(a + b) / 2 for a, b in zip(lo, hi)]
    radius = math.dist(lo, hi) / 2
    half = math.radians(FOV / 2)
    distance = radius / math.sin(min(half, math.atan(math.tan(half) * aspect)))
    length = math.hypot(*towards)
    return [c + distance * t / length for c, t in zip(centre, towards)], centre


def joined(point):
    return ",".join(repr(x) for x in point)


def run_json(command, timeout):
    done = subprocess.run(command, capture_output=True, text=True, timeout=timeout)
    if done.returncode not in (0, 6):
        raise RuntimeError(f"{pathlib.Path(command[0]).name}: exit {done.returncode}: "
                           f"{(done.stderr.strip().splitlines() or ['no message'])[-1]}")
    return json.loads(done.stdout)


def check_model(path, tools, size, timeout, pictures, trim, error_px):
    row = dict.fromkeys(COLUMNS, "")
    row["file"] = str(path)
    width, height = size
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        model = path
        if path.suffix == ".zst":
            model = folder / path.name[:-4]
            subprocess.run(["zstd", "-d", "-q", str(path), "-o", str(model)], check=True)
        pack = folder / "model.tray"
        packed = run_json([tools["pack"], str(model), "-o", str(pack), "--json", "--no-previews"], timeout)
        info = run_json([tools["trimray"], "info", str(pack), "--json"], timeout)
        bounds = info["bounds_mm"]
        lo, hi = (bounds["lo"], bounds["hi"]) if isinstance(bounds, dict) else (bounds[0], bounds[1])
        total = {"rays": 0, "both_hit": 0, "agree": 0, "edge": 0, "tangent": 0, "oracle": 0, "unexplained": 0}
        worst, rate, remarks = 0.0, 0.0, []
        for name, towards in VIEWS.items():
            eye, target = camera(lo, hi, towards, width / height)
            picture = folder / f"{name}.exr"
            view = ["--eye", joined(eye), "--target", joined(target), "--up", "0,0,1", "--fov", str(FOV)]
            run_json([tools["trimray"], "render", str(pack), "-o", str(picture), "--size", f"{width}x{height}",
                      "--device", "cpu", "--trim", trim, "--error-px", error_px, "--json"] + view, timeout)
            if pictures:
                pictures.mkdir(parents=True, exist_ok=True)
                run_json([tools["trimray"], "render", str(pack), "-o", str(pictures / f"{path.name}.{name}.png"),
                          "--size", "640x480", "--device", "cpu", "--json"] + view, timeout)
            report = run_json([tools["oracle"], str(model), "--exr", str(picture)] + view, timeout)
            agreement = report["agreement"]
            for key in ("rays", "both_hit", "agree"):
                total[key] += agreement[key]
            for cause, count in agreement["causes"].items():
                total[cause] += count
            worst = max(worst, agreement["worst_agreeing_error"])
            rate = report["rays_per_second"]
            remarks += [f"{name}({d['x']},{d['y']}) {d['why']} face {d['face']} {d['surface']} ours {d['ours_mm']} "
                        f"oracle {d['oracle_mm']}" for d in agreement["disagreements"] if d["cause"] == "unexplained"]
    share = total["agree"] / total["rays"]
    row.update(rays=total["rays"], hits=total["both_hit"], agree_percent=f"{100 * share:.4f}", edge=total["edge"],
               tangent=total["tangent"], oracle=total["oracle"], unexplained=total["unexplained"],
               worst_error=f"{worst:.1e}", rays_per_second=f"{rate:.0f}", remark="; ".join(remarks[:4]))
    faults = []
    if total["agree"] < SHARE * (total["rays"] - total["oracle"]):  # where the kernel is not proved wrong
        faults.append("share")
    if packed["dropped"]:
        faults.append("faces dropped")
        row["remark"] = f"{len(packed['dropped'])} dropped: {packed['dropped'][0]['reason']}; {row['remark']}"
    if total["unexplained"]:
        faults.append("unexplained")
    row["verdict"] = ", ".join(faults) or "ok"
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("models", nargs="+", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("agreement.tsv"))
    parser.add_argument("--build", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent / "build")
    parser.add_argument("--size", default="160x120", help="WxH of each of the two views")
    parser.add_argument("--timeout", type=float, default=300, help="seconds a step")
    parser.add_argument("--trim", default="exact")
    parser.add_argument("--error-px", default="1e-4", help="the accuracy dial; its default in trimray is made for speed")
    parser.add_argument("--pictures", type=pathlib.Path, metavar="DIR", help="keep shaded pictures of the views there")
    options = parser.parse_args()

    tools = {"pack": options.build / "bin" / "trimray-pack", "trimray": options.build / "bin" / "trimray",
             "oracle": options.build / "tests" / "occt_oracle"}
    for tool in tools.values():
        if not tool.exists():
            sys.exit(f"{tool}: not built")
    size = tuple(int(n) for n in options.size.split("x"))
    done = {}
    if options.output.exists():
        with open(options.output, newline="", encoding="utf-8") as table:
            done = {row["file"]: row for row in csv.DictReader(table, delimiter="\t")}
    rows = []
    with open(options.output, "a", newline="", encoding="utf-8") as table:
        writer = csv.DictWriter(table, COLUMNS, delimiter="\t", lineterminator="\n")
        if table.tell() == 0:
            writer.writeheader()
        for path in options.models:
            if str(path) in done:
                rows.append(done[str(path)])
                continue
            try:
                row = check_model(path, tools, size, options.timeout, options.pictures, options.trim, options.error_px)
            except (RuntimeError, subprocess.TimeoutExpired, json.JSONDecodeError, KeyError) as failure:
                row = dict.fromkeys(COLUMNS, "")
                refused = "trimray-pack: exit 3" in str(failure)  # nothing in it to trace, and said so
                row.update(file=str(path), verdict="no shape" if refused else "failed", remark=str(failure)[:300])
            writer.writerow(row)
            table.flush()
            rows.append(row)
            print("\t".join(str(row[c]) for c in COLUMNS), flush=True)
    bad = [row for row in rows if row["verdict"] not in ("ok", "no shape")]
    print(f"{len(rows)} models, {len(rows) - len(bad)} ok, {len(bad)} not", file=sys.stderr)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
