#!/usr/bin/env python3
"""The command line as outside programs see it: what is printed where, the shape of the JSON, and the exit codes.

    tests/cli/run.py --bin FOLDER [--sanitized] TOPIC [unittest arguments]

FOLDER holds trimray and, where the converter is built, trimray-pack; without it the packs under golden/ stand in.
TOPIC is a file beside this one, without its _test.py: one for each command, and for what holds for all of them. To test
another command, put its file here: ctest finds it, as cli.<Topic>.
"""

import argparse
import importlib
import sys
import tempfile
import unittest
from pathlib import Path

import case


def main():
    topics = sorted(path.name.removesuffix("_test.py") for path in Path(__file__).resolve().parent.glob("*_test.py"))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=Path, required=True)
    parser.add_argument("--sanitized", action="store_true")
    parser.add_argument("topic", choices=topics)
    options, rest = parser.parse_known_args()
    with tempfile.TemporaryDirectory(prefix="trimray-cli-") as folder:
        case.prepare(options, folder)
        unittest.main(importlib.import_module(f"{options.topic}_test"), argv=[sys.argv[0], *rest])


if __name__ == "__main__":
    main()
