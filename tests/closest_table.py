#!/usr/bin/env python3
"""Measures both policies for closest hits on many models, and prints tables in Markdown.

    tests/closest_table.py MODEL|PACK|FOLDER... [-o closest.jsonl] [--build DIR] [--size 640x360] [--rounds 9]

Each model (`.zst` ones are decompressed first) is packed and goes through `trimray bench closest`: the paper's stochastic
frames with one leaf a patch and with the pack's leaves, and the one certified frame, from three views, against the
reference in double. Reports are kept in the output, one line a model, and models that have a line are skipped. Run it on
a machine that does nothing else: times are compared in turns, but not freed from each other's noise.

Means over views and models: geometric for times, arithmetic for wrong pixels and decibels, where a picture that equals
the reference's counts as 100 dB.
"""

import sys

from bench_tables import arguments, decibels, geometric, mean, reports, run_json, shown, table

GOALS = {"decibels": 70.0, "cost": 1.15}


def measure(pack, options):
    """What `bench closest` says of a pack."""
    report = run_json([options.build / "bin/trimray", "bench", "closest", pack, "--json", "--size", options.size, "--rounds",
                       options.rounds, "--threads", options.threads])
    [of_pack] = report.pop("packs")
    return {**report, **of_pack}


def rows(found, closest, leaves, frames):
    return [row for report in found for view in report["views"] for row in view["settings"]
            if (row["closest"], row["leaves"], row["frames"]) == (closest, leaves, frames)]


def frames_of(found):
    return sorted({row["frames"] for row in found[0]["views"][0]["settings"]})


def wrong(some):
    return f"{mean(row['wrong_per_million'] for row in some):,.1f}"


def all_decibels(some):
    return shown(mean(decibels(row) for row in some))


def cost(found):
    return geometric(view["certified_cost"] for report in found for view in report["views"])


def print_models(found):
    frames = frames_of(found)
    table_rows = []
    for report in found:
        row = [report["model"], f"{report['bezier_patches']:,} / {report['bezier_leaves']:,}"]
        first, certified = [], rows([report], "certified", "pack", 1)
        for leaves in ("one", "pack"):
            pictures = [rows([report], "stochastic", leaves, n) for n in frames]
            row += [" / ".join(map(all_decibels, pictures)), " / ".join(wrong(pictures[i]) for i in (0, -1))]
            first.append(f"{geometric(r['frame_ms'] for r in pictures[0]):.1f}")
        ms = [*first, f"{geometric(r['frame_ms'] for r in certified):.1f}"]
        table_rows.append([*row, all_decibels(certified), wrong(certified), " / ".join(ms), f"{cost([report]):.2f}"])
    made_of = "frames " + " / ".join(map(str, frames))
    wrong_of = f"wrong pixels a million, frames {frames[0]} / {frames[-1]}"
    table(["model", "Bézier patches / leaves", f"one leaf a patch: PSNR, dB, {made_of}", wrong_of,
           f"our leaves: PSNR, dB, {made_of}", wrong_of, "certified: PSNR, dB", "wrong pixels a million",
           "ms: one leaf / our leaves / certified", "certified × stochastic frame"], table_rows)


def print_goals(found):
    def verdict(name, value, goal, met):
        print(f"- {name}: {value}, goal {goal}: {'met' if met else 'MISSED'}")

    certified = rows(found, "certified", "pack", 1)
    least = min(map(decibels, certified))
    verdict("PSNR of the certified frame, worst view", f"{least:.1f} dB", f">= {GOALS['decibels']:g} dB",
            least >= GOALS["decibels"])
    lost = sum(row["missing"] + row["extra"] for row in certified)
    verdict("missing and extra pixels of all certified frames", lost, 0, lost == 0)
    print(f"- wrong depths of all certified frames: {sum(row['wrong_depth'] for row in certified)}")
    verdict("cost of the certified frame, of the first stochastic one (geometric mean)", f"{cost(found):.3f} ×",
            f"<= {GOALS['cost']:g} ×", cost(found) <= GOALS["cost"])


def main():
    found = reports(arguments(__doc__.splitlines()[0], "closest.jsonl", "640x360", 9), measure)
    if not found:
        return 1
    first = found[0]
    views = [view["view"] for view in first["views"]]
    print(f"{len(found)} models, views {', '.join(views)} at {first['width']}x{first['height']}, {first['threads']} thread(s), "
          f"{first['device']}, medians of {first['rounds']} rounds\n")
    print_models(found)
    print_goals(found)
    return 0


if __name__ == "__main__":
    sys.exit(main())
