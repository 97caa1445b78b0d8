"""Runs every micro-benchmark once, shortly: each name is there, none fails, and each has a rate.

usage: micro_benchmarks_test.py --program FILE [--splines]
--splines: the build has the converter, and so its benchmarks.
"""

import argparse
import json
import subprocess
import sys

ITEMS = {"bezier_point", "newton_step", "newton_solve_plain", "newton_solve_proved", "cell_look_up", "texture_look_up",
         "hybrid_look_up", "kd_look_up", "cells_of_a_face", "kd_tree_of_a_face", "distance_field_of_curves",
         "distance_field_of_a_mask"}
SPLINES = {"knot_insertion", "decomposition", "patch_records"}
BYTES = {"pack_reading", "pack_validating", "scene_loading"}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--program", required=True)
    parser.add_argument("--splines", action="store_true")
    arguments = parser.parse_args()
    command = [arguments.program, "--benchmark_format=json", "--benchmark_min_time=0.001"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return f"exit code {done.returncode}: {done.stderr}"
    report = json.loads(done.stdout)
    rows = report["benchmarks"]
    faults = [f"{row['name']}: {row['error_message']}" for row in rows if row.get("error_occurred")]
    names = {row["name"].split("/")[0] for row in rows}
    items = ITEMS | SPLINES if arguments.splines else ITEMS
    faults += [f"{name}: is missing" for name in (items | BYTES) - names]
    faults += [f"{name}: nobody checks it; add it to this test" for name in names - (items | BYTES)]
    for row in rows:
        name = row["name"].split("/")[0]
        rate = "bytes_per_second" if name in BYTES else "items_per_second"
        if not row.get(rate, 0) > 0:
            faults.append(f"{row['name']}: has no {rate}")
        if "found" in row and not 0.9 < row["found"] <= 1:
            faults.append(f"{row['name']}: {row['found']:.2f} of the rays find a root")
    if "instruction_set" not in report["context"]:
        faults.append("the context does not name the instruction set")
    return "\n".join(faults)


if __name__ == "__main__":
    sys.exit(main() or 0)
