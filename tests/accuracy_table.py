#!/usr/bin/env python3
"""Prints the table of all models of a report of `trimray bench accuracy` in Markdown, and draws its plot.

    tests/accuracy_table.py report.json [--plot FILE.svg --models PART,BOARD]

The plot has a column for each model named (files' names without their ending; without --models the first two): above, time
against PSNR, below, memory against PSNR. Over the views times and bytes are geometric means, PSNRs arithmetic ones, an
equal picture counting as 120 dB where others of the contender's are not equal; as on the report's page.
"""

import argparse
import html
import json
import math
from pathlib import Path

EQUAL_DB = 120


def geometric(values):
    return math.exp(sum(map(math.log, values)) / len(values))


def contenders(model):
    """A row for each contender but the smooth ones, over the views."""
    rows = []
    for i, contender in enumerate(model["contenders"]):
        points = [view["points"][i] for view in model["views"]]
        if contender["dial"] == "anti-aliasing":
            continue
        psnrs = [point["psnr_db"] for point in points]
        rows.append({**contender, **{key: geometric([p[key] for p in points])
                                     for key in ("picture_ms", "time_to_default", "rays_per_second", "bytes")},
                     "psnr_db": math.inf if psnrs == [None] * len(psnrs)
                     else sum(EQUAL_DB if p is None else p for p in psnrs) / len(psnrs)})
    return rows


def decibels(value):
    return "equal" if value == math.inf else f"{value:.1f}"


def figures(model):
    """What the table says of a model with peers."""
    rows = contenders(model)
    default = rows[0]
    paper = next(row for row in rows if row["paper"] == "one-ray")
    mesh = [row for row in rows if row.get("triangles")][-1]
    first_ms = default["first_picture_ms"]
    return {"model": Path(model["model"]).stem, "faces": model["faces"], "ms": default["picture_ms"],
            "rays": default["rays_per_second"] / 1e6, "kB": default["bytes"] / 1e3, "psnr": default["psnr_db"],
            "paper": paper["time_to_default"], "mesh": mesh["name"].split()[-1], "mesh_time": mesh["time_to_default"],
            "mesh_memory": mesh["bytes"] / default["bytes"], "mesh_psnr": mesh["psnr_db"],
            "first": mesh["first_picture_ms"] / first_ms,
            "cad": (1e3 * default["make_seconds"] + first_ms) / first_ms}


def print_table(models):
    rows = [figures(model) for model in models if "paper" in model]
    deflection = "/".join(dict.fromkeys(row["mesh"] for row in rows))
    print(f"| model | faces | ms a picture | M rays/s | kB in memory | PSNR, dB | the paper's shape: × our time | triangles of "
          f"{deflection}: × our time | × our memory | their PSNR, dB | first picture from their file: × ours | from the CAD "
          f"file: × ours |")
    print("|---" + "|---:" * 11 + "|")
    for r in rows:
        print(f"| {r['model']} | {r['faces']:,} | {r['ms']:.2f} | {r['rays']:.1f} | {r['kB']:,.0f} | {decibels(r['psnr'])} | "
              f"{r['paper']:.1f} | {r['mesh_time']:.2f} | {r['mesh_memory']:.1f} | {decibels(r['mesh_psnr'])} | "
              f"{r['first']:.1f} | {r['cad']:.0f} |")
    if len(rows) > 1:
        mean = {key: geometric([row[key] for row in rows]) for key in ("paper", "mesh_time", "mesh_memory", "first", "cad")}
        print(f"| geometric mean | | | | | | {mean['paper']:.1f} | {mean['mesh_time']:.2f} | {mean['mesh_memory']:.1f} | | "
              f"{mean['first']:.1f} | {mean['cad']:.0f} |")


# What the plot shows, as (words, colour, mark, which contenders); the dials as lines in their order
SERIES = [
    ("triangles, traced by Embree", "#d55e00", "square", lambda r: r.get("triangles")),
    ("the paper's shape, one ray", "#0072b2", "diamond", lambda r: r["paper"] == "one-ray"),
    ("the paper's shape, 16 wide, frames 1 and 10", "#56b4e9", "diamond", lambda r: r["paper"] in ("wide", "wide-10-frames")),
    ("our tracer, the paper's textures", "#cc79a7", "triangle", lambda r: (r["paper"] or "").startswith("textures")),
    ("the reference in double", "#8a8a8a", "square", lambda r: r["dial"] == "precision"),
    ("Trimray's default", "#009e73", "circle", lambda r: r["dial"] == "default"),
]
MARKS = {"square": "M-4,-4h8v8h-8z", "diamond": "M0,-6L6,0L0,6L-6,0z", "triangle": "M0,6L6,-5H-6z",
         "circle": "M-6,0a6,6 0 1,0 12,0a6,6 0 1,0 -12,0"}


class Panel:
    """One plot: a cost, logarithmic to the right, against PSNR upwards, with a place of its own for equal pictures."""

    WIDTH, HEIGHT, LEFT, BOTTOM, TOP = 470, 250, 48, 40, 34

    def __init__(self, x, y, rows, cost, unit, title, psnr_range):
        self.x, self.y, self.rows, self.cost, self.unit, self.title = x, y, rows, cost, unit, title
        self.low, self.high = psnr_range
        costs = [math.log10(row[cost]) for row in rows]
        pad = 0.06 * (max(costs) - min(costs))
        self.from_cost, self.to_cost = min(costs) - pad, max(costs) + pad

    def across(self, value):
        return self.x + self.LEFT + (math.log10(value) - self.from_cost) / (self.to_cost - self.from_cost) * (self.WIDTH - self.LEFT - 8)

    def up(self, psnr):
        place = self.high + 8 if psnr == math.inf else psnr
        return self.y + self.HEIGHT - self.BOTTOM - (place - self.low) / (self.high + 12 - self.low) * (self.HEIGHT - self.BOTTOM - self.TOP)

    def svg(self):
        right, floor = self.x + self.WIDTH - 8, self.y + self.HEIGHT - self.BOTTOM
        out = [f'<text x="{self.x + self.LEFT}" y="{self.y + 18}" class="title">{html.escape(self.title)}</text>']
        for exponent in range(math.floor(self.from_cost), math.ceil(self.to_cost) + 1):
            for k in (1, 2, 5) if self.to_cost - self.from_cost < 2.2 else (1,):
                value = k * 10.0 ** exponent
                if self.from_cost <= math.log10(value) <= self.to_cost:
                    at = self.across(value)
                    out.append(f'<path class="grid" d="M{at:.1f},{self.y + self.TOP}V{floor}"/>'
                               f'<text x="{at:.1f}" y="{floor + 16}" text-anchor="middle">{value:,g}</text>')
        for psnr in [*range(math.ceil(self.low / 20) * 20, int(self.high) + 1, 20), math.inf]:
            at = self.up(psnr)
            out.append(f'<path class="grid" d="M{self.x + self.LEFT},{at:.1f}H{right}"/>'
                       f'<text x="{self.x + self.LEFT - 6}" y="{at + 4:.1f}" text-anchor="end">{"equal" if psnr == math.inf else psnr}</text>')
        out.append(f'<text x="{right}" y="{floor + 32}" text-anchor="end">{self.unit}, logarithmic</text>')
        for words, colour, mark, chosen in SERIES:
            points = [(self.across(row[self.cost]), self.up(row["psnr_db"]), row["name"]) for row in self.rows if chosen(row)]
            if len(points) > 1:
                line = " ".join(f"{x:.1f},{y:.1f}" for x, y, _ in points)
                out.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
            for x, y, name in points:
                out.append(f'<path d="{MARKS[mark]}" transform="translate({x:.1f},{y:.1f})" fill="{colour}"><title>'
                           f'{html.escape(name)}</title></path>')
        return out


def shortened(name, longest=22):
    return name if len(name) <= longest else name[:longest - 1] + "…"


def plot(models, command):
    shown = [[row for row in contenders(model) if any(chosen(row) for *_, chosen in SERIES)] for model in models]
    finite = [row["psnr_db"] for rows in shown for row in rows if row["psnr_db"] < math.inf]
    psnr_range = (math.floor(min(finite) / 10) * 10 - 2, math.ceil(max(finite) / 10) * 10)
    width, height = Panel.WIDTH * len(models), 2 * Panel.HEIGHT + 52
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">',
           f"<desc>Made by tests/accuracy_table.py from a report of: {html.escape(command)}</desc>",
           "<style>text { font: 12px system-ui, sans-serif; fill: #1b1f24 } .title { font-weight: 600; font-size: 14px } "
           ".grid { stroke: #d4dae0; fill: none }</style>",
           f'<rect width="{width}" height="{height}" fill="#fff"/>']
    for column, (model, rows) in enumerate(zip(models, shown)):
        name = Path(model["model"]).stem
        for line, (cost, factor, unit, title) in enumerate([("picture_ms", 1, "ms a picture", "time"), ("bytes", 1e-3, "kB", "memory")]):
            scaled = [{**row, cost: row[cost] * factor} for row in rows]
            out += Panel(column * Panel.WIDTH, line * Panel.HEIGHT, scaled, cost, unit,
                         f"{shortened(name)}: PSNR, dB, against {title}", psnr_range).svg()
    for i, (words, colour, mark, _) in enumerate(reversed(SERIES)):
        x, y = 20 + (i % 3) * width / 3, 2 * Panel.HEIGHT + 16 + 20 * (i // 3)
        out.append(f'<path d="{MARKS[mark]}" transform="translate({x:.0f},{y})" fill="{colour}"/>'
                   f'<text x="{x + 12:.0f}" y="{y + 4}">{html.escape(words)}</text>')
    return "\n".join([*out, "</svg>", ""])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("report", type=Path)
    parser.add_argument("--plot", type=Path, help="An SVG to write")
    parser.add_argument("--models", help="Which models the plot shows, with commas")
    options = parser.parse_args()
    report = json.loads(options.report.read_text())
    print_table(report["models"])
    if options.plot:
        by_name = {Path(model["model"]).stem: model for model in report["models"]}
        names = options.models.split(",") if options.models else list(by_name)[:2]
        missing = [name for name in names if name not in by_name]
        if missing:
            parser.error(f"no model {missing[0]} in the report; there are {', '.join(by_name)}")
        options.plot.write_text(plot([by_name[name] for name in names], report["command"]))


if __name__ == "__main__":
    main()
