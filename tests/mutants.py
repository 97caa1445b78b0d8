#!/usr/bin/env python3
"""Writes damaged copies of CAD files: flipped bits, lost entities, cut ends, references to other entities.

    tests/mutants.py MODEL... -o FOLDER [--count N] [--seed S]

The same models, count and seed give the same bytes. Each mutant is called by its model, its number and what was done
to it, e.g. `unit_sphere-007-swapped.stp`.
"""

import argparse
import pathlib
import random
import re


def flipped(content, rng):
    """A few bits the other way."""
    out = bytearray(content)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(out))
        out[at] ^= 1 << rng.randrange(8)
    return bytes(out)


def entities(content):
    """The (start, end) of each entity: STEP's from `#1=` to `;`, IGES' lines of parameters."""
    if content.lstrip().startswith(b"ISO-10303"):
        return [m.span() for m in re.finditer(rb"#\d+\s*=[^;]*;", content)]
    return [m.span() for m in re.finditer(rb"[^\n]{64}[^\n]{8}P[^\n]*\n", content)]


def deleted(content, rng):
    """One to three entities less."""
    spans = entities(content)
    for start, end in sorted(rng.sample(spans, min(len(spans), rng.randint(1, 3))), reverse=True):
        content = content[:start] + content[end:]
    return content


def truncated(content, rng):
    return content[:rng.randrange(len(content) // 4, len(content))]


def swapped(content, rng):
    """References exchanged: STEP's `#n` within entities; IGES' numbers between commas of two parameter lines."""
    step = content.lstrip().startswith(b"ISO-10303")
    pattern = rb"(?<=[(, ])#\d+(?=[,) ])" if step else rb"(?<=,)\d+(?=,)"
    spans = [m.span() for m in re.finditer(pattern, content)]
    for _ in range(rng.randint(1, 3)):
        (a, b), (c, d) = sorted(rng.sample(spans, 2))
        # one of them is overwritten, so that the places of the others stay
        if b - a == d - c:
            content = content[:a] + content[c:d] + content[b:c] + content[a:b] + content[d:]
        elif b - a > d - c:
            content = content[:a] + content[c:d].rjust(b - a) + content[b:]
    return content


MUTATIONS = [flipped, deleted, truncated, swapped]


def write_mutants(models, folder, count, seed):
    """Writes `count` mutants, of the models in turn; returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = random.Random(seed)
    contents = [(model, model.read_bytes()) for model in models]
    paths = []
    for i in range(count):
        model, content = contents[i % len(contents)]
        mutation = MUTATIONS[(i // len(contents)) % len(MUTATIONS)]
        path = folder / f"{model.stem}-{i:03d}-{mutation.__name__}{model.suffix}"
        path.write_bytes(mutation(content, rng))
        paths.append(path)
    return paths


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("models", nargs="+", type=pathlib.Path, metavar="MODEL")
    parser.add_argument("-o", "--output", required=True, type=pathlib.Path)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    write_mutants(options.models, options.output, options.count, options.seed)


if __name__ == "__main__":
    main()
