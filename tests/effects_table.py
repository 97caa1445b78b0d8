#!/usr/bin/env python3
"""Measures what each effect costs alone on many models, and prints tables in Markdown.

    tests/effects_table.py MODEL|PACK... [-o effects.jsonl] [--build DIR] [--size 320x180] [--rounds 5] [--base TRIMRAY]

Each model (`.zst` ones are decompressed first) is packed and goes through `trimray bench effects` on the CPU tracer and,
where there is a driver, through Vulkan. Instructions of the CPU tracer are counted with callgrind, where valgrind is
installed: those of a frame's tracing, with AVX2, whatever else the machine does. `--base` is the trimray of a build from
before there were effects: its picture without effects is counted likewise, which shows what their absence costs. Sizes
of shaders are those of the SPIR-V that is left where spirv-opt (where it is installed) knows the constants that a
pipeline is specialised to, and of what the driver makes of it, where its pipeline cache tells.

Counts are exact. Times are compared in turns, but not freed from each other's noise: for them the machine must do nothing
else. Reports are kept in the output, one line a model, and models that have a line are skipped.
"""

import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from bench_tables import arguments, reports, run_json, table

GOALS = {"absent": 0.005, "specialised": 1.25}
COUNTED = "*trace_block*"
NO_DRIVER = "no driver"


def instructions(command, folder):
    """Of the CPU tracer's frames that the command makes; None without valgrind."""
    if not shutil.which("valgrind"):
        return None
    done = subprocess.run(["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", f"--toggle-collect={COUNTED}",
                           *map(str, command)], capture_output=True, text=True, check=True, cwd=folder)
    return int(re.search(r"Collected : (\d+)", done.stderr)[1])


def specialised_bytes(build, pipeline):
    """SPIR-V of the pipeline's shader once its constants are known; None without spirv-opt."""
    if not shutil.which("spirv-opt"):
        return None
    constants = " ".join(f"{i}:{value}" for i, value in enumerate(pipeline["constants"]))
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "specialised.spv"
        subprocess.run(["spirv-opt", "--set-spec-const-default-value", constants, "--freeze-spec-const",
                        "--fold-spec-const-op-composite", "-O", build / f"shaders/{pipeline['shader']}.comp.spv", "-o", out],
                       check=True)
        return out.stat().st_size


def bench(pack, options, device, *more):
    return run_json([options.build / "bin/trimray", "bench", "effects", pack, "--device", device, "--json", "--size",
                     options.size, "--threads", options.threads, *more])


def measure_vulkan(pack, options):
    try:
        report = bench(pack, options, "vulkan", "--rounds", options.rounds)
    except RuntimeError as failure:
        print(f"no figures through Vulkan: {failure}", file=sys.stderr)
        return None
    [of_pack] = report["packs"]
    for row in of_pack["effects"]:
        for pipeline in row.get("pipelines", []):
            pipeline["spirv_bytes"] = specialised_bytes(options.build, pipeline)
    return {"device": report["device"], "effects": of_pack["effects"]}


def measure(pack, options):
    """All figures of a pack."""
    tool = options.build.resolve() / "bin/trimray"
    pack = pack.resolve()
    report = bench(pack, options, "cpu", "--rounds", options.rounds)
    [of_pack] = report["packs"]
    info = run_json([tool, "info", pack, "--json"])
    picture = ["render", pack, "--device", "cpu", "--threads", 1, "--size", options.size, "-o", "picture.png"]
    with tempfile.TemporaryDirectory() as folder:
        for row in of_pack["effects"]:
            alone = ["--effects", row["effect"], "--rounds", 0]
            row["instructions"] = instructions([tool, "bench", "effects", pack, "--size", options.size, *alone], folder)
        own = instructions([tool, *picture], folder)
        base = instructions([options.base.resolve(), *picture], folder) if options.base else None
    return {"width": report["width"], "height": report["height"], "rounds": report["rounds"], "threads": report["threads"],
            "faces": info["faces"], "cpu": {"device": report["device"], "effects": of_pack["effects"]},
            "instructions": own, "base_instructions": base, "vulkan": measure_vulkan(pack, options)}


def row_of(report, tracer, effect):
    return next((r for r in report[tracer]["effects"] if r["effect"] == effect), None) if report[tracer] else None


def ratio(report, tracer, effect, key):
    row = row_of(report, tracer, effect)
    if not row or row["unsupported"] or not row[key]:
        return "–"
    return f"{row[key] / row_of(report, tracer, 'none')[key]:.2f}" if key == "instructions" else f"{row[key]:.2f}"


def more_kib(report, tracer, effect):
    """Bytes that the effect adds."""
    row = row_of(report, tracer, effect)
    if not row or row["unsupported"]:
        return "–"
    return f"{(row['buffer_bytes'] - row_of(report, tracer, 'none')['buffer_bytes']) / 1024:.0f}"


def shader_kib(report, effect, key):
    row = row_of(report, "vulkan", effect)
    if not row or row["unsupported"] or any(p[key] is None for p in row["pipelines"]):
        return "–"
    return f"{sum(p[key] for p in row['pipelines']) / 1024:.0f}"


def dispatches(report, effect):
    row = row_of(report, "vulkan", effect)
    return "–" if not row or row["unsupported"] else str(row["dispatches"])


def joined(cells):
    """One cell for all models where they are the same."""
    return cells[0] if len(set(cells)) == 1 else " / ".join(cells)


def print_effects(found):
    effects = [row["effect"] for row in found[0]["cpu"]["effects"]]
    rows = []
    for effect in effects:
        each = lambda cell: joined([cell(report) for report in found])
        rows.append([effect, each(lambda r: ratio(r, "cpu", effect, "instructions")),
                     each(lambda r: ratio(r, "cpu", effect, "time_to_none")),
                     each(lambda r: more_kib(r, "cpu", effect)),
                     each(lambda r: ratio(r, "vulkan", effect, "time_to_none")),
                     each(lambda r: more_kib(r, "vulkan", effect)), each(lambda r: dispatches(r, effect)),
                     each(lambda r: shader_kib(r, effect, "spirv_bytes")),
                     each(lambda r: shader_kib(r, effect, "bytes"))])
    table(["effect", "CPU: instructions, × none", "time, × none", "more memory, KiB", "Vulkan: time, × none",
           "more buffers, KiB", "dispatches", "shaders, KiB of SPIR-V", "of the driver's"], rows)


def absence(report):
    """Share of instructions that effects add where there are none; None without a base."""
    if not report["instructions"] or not report["base_instructions"]:
        return None
    return report["instructions"] / report["base_instructions"] - 1


def gain(report, tracer):
    row = row_of(report, tracer, "unspecialised")
    return row["time_to_none"] if row else None


def print_models(found):
    rows = []
    for report in found:
        none, through = row_of(report, "cpu", "none"), row_of(report, "vulkan", "none")
        absent = absence(report)
        counted = none["instructions"]
        shown = lambda value, form: form.format(value) if value is not None else "–"
        late = row_of(report, "cpu", "unspecialised")["instructions"]
        rows.append([report["model"], f"{report['faces']:,}", shown(counted and counted / 1e6, "{:.1f}"),
                     shown(absent, "{:+.2%}"), shown(counted and late / counted, "{:.3f}"),
                     shown(gain(report, "cpu"), "{:.2f}"), shown(through and through["buffer_bytes"] / 2**20, "{:.2f}"),
                     shown(gain(report, "vulkan"), "{:.2f}"), shader_kib(report, "none", "spirv_bytes"),
                     shader_kib(report, "unspecialised", "spirv_bytes")])
    table(["model", "faces", "instructions, M", "than without the code of effects", "unspecialised: instructions, ×",
           "time, ×", "Vulkan: buffers, MiB", "unspecialised: time, ×", "shader, KiB of SPIR-V", "unspecialised"], rows)


def print_goals(found):
    def verdict(name, value, goal, met):
        print(f"- {name}: {value}, goal {goal}: {'met' if met else 'MISSED'}")

    changes = [absence(r) for r in found if absence(r) is not None]
    if changes:
        worst = max(changes, key=abs)
        verdict("instructions that absent effects add, worst model", f"{worst:+.2%}", f"<= {GOALS['absent']:.1%}",
                abs(worst) <= GOALS["absent"])
    for tracer in ("cpu", "vulkan"):
        gains = [(gain(r, tracer), r["model"]) for r in found if gain(r, tracer)]
        if gains:
            best, model = max(gains)
            verdict(f"{tracer}: time of the unspecialised tracer, × the plan's, best model ({model})", f"{best:.2f}",
                    f">= {GOALS['specialised']}", best >= GOALS["specialised"])
    differing = sum(row_of(r, t, "unspecialised")["differing_pixels"] for r in found for t in ("cpu", "vulkan") if r[t])
    verdict("pixels in which the unspecialised tracer differs", differing, 0, differing == 0)


def main():
    def add(parser):
        parser.add_argument("--base", type=pathlib.Path)

    found = reports(arguments(__doc__.splitlines()[0], "effects.jsonl", "320x180", 5, add), measure)
    if not found:
        return 1
    first = found[0]
    print(f"{' / '.join(r['model'] for r in found)} from iso at {first['width']}x{first['height']}, {first['threads']} "
          f"thread(s), {first['cpu']['device']}, {first['vulkan']['device'] if first['vulkan'] else NO_DRIVER}, medians of "
          f"{first['rounds']} rounds\n")
    print_models(found)
    print_effects(found)
    print_goals(found)
    return 0


if __name__ == "__main__":
    sys.exit(main())
