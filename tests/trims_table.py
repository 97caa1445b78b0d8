#!/usr/bin/env python3
"""Measures the trim modes on many models, and prints tables in Markdown.

    tests/trims_table.py MODEL|PACK|FOLDER... [-o trims.jsonl] [--build DIR] [--size 1920x1080] [--rounds 5]

Each model (`.zst` ones are decompressed first) is packed and goes through `trimray bench trims`: every mode, distance
source, layout and memory from three views, one of them a close-up. The report is appended to the output as one line a
model, and models that have a line are skipped, so an interrupted run goes on where it stopped; the tables are of all
that the command line names. Run it on a machine that does nothing else: times are compared in turns, but not freed from
each other's noise.

Means over models and views: geometric for speeds, times and bytes, arithmetic for wrong rays and decibels, where a picture
that equals the reference's counts as 100 dB.
"""

import sys

from bench_tables import arguments, decibels, geometric, mean, reports, run_json, shown, table

PAPER, OURS = ("mask", "square"), ("curve", "isotropic")
GOALS = {"speed": 1.6, "to_sdf": 0.97, "wrong": 1.0, "decibels": 6.0, "edges": 5.0}


def measure(pack, options):
    """What `bench trims` says of a pack, with its face counts."""
    tools = options.build / "bin"
    info = run_json([tools / "trimray", "info", pack, "--json"])
    report = run_json([tools / "trimray", "bench", "trims", pack, "--json", "--size", options.size, "--rounds",
                       options.rounds, "--threads", options.threads])
    return {"faces": info["faces"],
            "trimmed": next((int(e["why"].split()[0].replace(",", "")) for e in info["effects"]
                             if e["name"].startswith("trim-")), 0),
            "width": report["width"], "height": report["height"], "rounds": report["rounds"],
            "threads": report["threads"], "device": report["device"], "views": report["packs"][0]["views"]}


def wrong_rays(rows):
    value = mean(r["wrong_rays_per_million"] for r in rows)
    return f"{value:.2f}" if value < 10 else f"{value:,.0f}"


class Reports:
    """All rows of all models and views, by setting."""

    def __init__(self, reports):
        self.reports = reports

    def rows(self, mode, textures=(None, None), percent=None, reports=None, edges=False):
        return [row for report in reports or self.reports for view in report["views"] for row in view["settings"]
                if (row["mode"], (row["source"], row["layout"]), row["memory_percent"], row["edges"])
                == (mode, textures, percent, edges)]

    def settings(self):
        """Arguments for rows(), those with edges left out."""
        view = self.reports[0]["views"][0]
        return [(r["mode"], (r["source"], r["layout"]), r["memory_percent"]) for r in view["settings"] if not r["edges"]]


def setting_name(mode, textures, percent):
    return mode if percent is None else f"{mode} {textures[0]}/{textures[1]} {percent:g} %"


def print_settings(all_of, settings):
    rows = []
    for setting in settings:
        found = all_of.rows(*setting)
        kd = all_of.rows("kd")
        rows.append([setting_name(*setting), f"{geometric(r['speed_to_kd'] for r in found):.2f}",
                     f"{geometric(r['ns_per_query'] for r in found):.2f}",
                     f"{100 * geometric(r['bytes'] / k['bytes'] for r, k in zip(found, kd)):.0f}",
                     shown(mean(decibels(r) for r in found)), shown(min(decibels(r) for r in found)),
                     wrong_rays(found),
                     f"{max(r['border_error_px'] for r in found):.2f}"])
    table(["trims", "frames a second, × kd", "ns a query", "bytes, % of kd", "PSNR mean, dB", "worst", "wrong rays a million",
           "border error, px"], rows)


def print_models(all_of):
    rows = []
    for report in all_of.reports:
        of = [report]
        kd, exact = all_of.rows("kd", reports=of), all_of.rows("exact", reports=of)
        hybrid, sdf = (all_of.rows(mode, OURS, 100, of) for mode in ("hybrid", "sdf"))
        paper = all_of.rows("sdf", PAPER, 100, of)
        speed = [f"{geometric(r['speed_to_kd'] for r in found):.2f}" for found in (exact, hybrid, sdf, paper)]
        rows.append([report["model"], f"{report['trimmed']:,} of {report['faces']:,}",
                     " ".join(f"{r['bytes'] / 1000:.0f}" for r in (kd[0], exact[0], sdf[0])),
                     f"{geometric(r['frame_ms'] for r in kd):.1f}", *speed,
                     " ".join(f"{geometric(r['ns_per_query'] for r in found):.1f}"
                              for found in (kd, exact, hybrid, sdf)),
                     " / ".join(shown(decibels(r)) for r in paper), " / ".join(shown(decibels(r)) for r in sdf),
                     wrong_rays(exact), wrong_rays(sdf),
                     f"{max(r['border_error_px'] for r in exact):.2f}", f"{max(r['border_error_px'] for r in sdf):.1f}"])
    table(["model", "trimmed faces", "kB kd, exact, sdf", "kd ms", "exact × kd", "hybrid", "sdf", "sdf mask/square",
           "ns a query kd, exact, hybrid, sdf", "dB mask/square " + " / ".join(v["view"] for v in
                                                                            all_of.reports[0]["views"]),
           "dB curve/isotropic", "wrong a million exact", "sdf", "border px exact", "sdf"], rows)


def print_goals(all_of):
    def verdict(name, value, goal, met, unit=""):
        print(f"- {name}: {value}{unit}, goal {goal}{unit}: {'met' if met else 'MISSED'}")

    speed = {setting_name(*s): geometric(r["speed_to_kd"] for r in all_of.rows(*s))
             for s in all_of.settings() if s[0] in ("exact", "hybrid")}
    best = max(speed, key=speed.get)
    verdict(f"frames faster than kd ({best})", f"{speed[best]:.3f}", f">= {GOALS['speed']}", speed[best] >= GOALS["speed"], " ×")
    free = geometric(r["frame_ms"] / (r["frame_ms"] - 1e-6 * r["queries"] * r["ns_per_query"]) for r in all_of.rows("kd"))
    print(f"- if trims cost nothing, frames would be {free:.3f} × as fast as kd's: its queries alone, taken from its frames")
    sdf = geometric(r["speed_to_kd"] for r in all_of.rows("sdf", OURS, 100))
    verdict(f"speed of sdf at 100 % ({best})", f"{speed[best] / sdf:.3f}", f">= {GOALS['to_sdf']}",
            speed[best] / sdf >= GOALS["to_sdf"], " ×")
    right = [r for s in all_of.settings() if s[0] in ("exact", "hybrid") for r in all_of.rows(*s)]
    worst = max(r["wrong_rays_per_million"] for r in right)
    verdict("wrong rays a million, exact and hybrid, worst view", f"{worst:.2f}", f"<= {GOALS['wrong']:g}", worst <= GOALS["wrong"])
    edges = [100 * (with_edges["frame_ms"] / plain["frame_ms"] - 1)
             for with_edges, plain in zip(all_of.rows("exact", edges=True), all_of.rows("exact"))]
    cost = 100 * (geometric(1 + e / 100 for e in edges) - 1)
    verdict("edges, part of the frame (exact, sharp edges)", f"{cost:.1f}", f"<= {GOALS['edges']:g}", cost <= GOALS["edges"], " %")
    asked = sum(r["queries"] for r in all_of.rows("exact"))
    wrong = sum(r["wrong_queries"] for r in all_of.rows("exact"))
    print(f"- wrong answers of exact among all {asked:,} queries: {wrong}")
    for percent in sorted({s[2] for s in all_of.settings() if s[2] is not None}):
        pairs = list(zip(all_of.rows("sdf", OURS, percent), all_of.rows("sdf", PAPER, percent)))
        gain = mean(decibels(a) - decibels(b) for a, b in pairs)
        bytes_ratio = geometric(a["bytes"] / b["bytes"] for a, b in pairs)
        verdict(f"sdf curve/isotropic over mask/square at {percent:g} % ({bytes_ratio:.3f} of its bytes)", f"{gain:.1f}",
                f">= {GOALS['decibels']:g}", gain >= GOALS["decibels"], " dB")


def main():
    found = reports(arguments(__doc__.splitlines()[0], "trims.jsonl", "1920x1080", 5), measure)
    if not found:
        return 1
    first = found[0]
    print(f"{len(found)} models, {sum(len(r['views']) for r in found)} views at {first['width']}x{first['height']}, "
          f"{first['threads']} thread(s), {first['device']}, medians of {first['rounds']} rounds\n")
    all_of = Reports(found)
    every = all_of.settings()
    print("## README\n")
    print_settings(all_of, [s for s in every if s[0] in ("kd", "exact") or s == ("hybrid", OURS, 100)
                            or (s[0] == "sdf" and s[1] in (OURS, PAPER))])
    print("## Models\n")
    print_models(all_of)
    print("## All settings\n")
    print_settings(all_of, every)
    print("## Goals\n")
    print_goals(all_of)
    return 0


if __name__ == "__main__":
    sys.exit(main())
