"""Run benchmarks by name and write each into its section of docs/benchmarks.md as soon as it is done.

Usage: python -m benchmarks [NAME...]. Without a name all of them run, in about a quarter of an hour; nothing else
should run on the machine. The blind battery is separate, `python -m benchmarks.blind`: it takes more than an hour.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from time import perf_counter

from benchmarks.machine import load
from benchmarks.page import BENCHMARKS, assembled
from heli_identifier.files import write_atomically

MODULES = {
    "commands": "benchmarks.commands",
    "loop": "benchmarks.loop",
    "simulation": "benchmarks.simulation",
    "adaptation": "benchmarks.adaptation",
    "fit": "benchmarks.fit",
    "campaign": "benchmarks.campaign_speed",
    "cost": "benchmarks.cost",
    "memory": "benchmarks.memory",
    "native": "benchmarks.native",
    "runs": "benchmarks.native_runs",
    "soak": "benchmarks.soak",
    "numbers": "benchmarks.references",
}
"""Module of each section; its function ``section`` measures and gives the text."""

HEAD = """# Benchmarks

Written by `make bench`; `.venv/bin/python -m benchmarks NAME` measures one section again. The contenders of a section
run in turn, each once per round; ratios are ratios of medians. The blind battery and other rigs are in
[Results](results.md).
"""


def main(arguments: Sequence[str]) -> None:
    for name in _parsed(arguments):
        began, busy = perf_counter(), load()
        print(f"{name} ...", file=sys.stderr, flush=True)
        measure: Callable[[float], str] = import_module(MODULES[name]).section
        text = f"{measure(busy)}\n\n`python -m benchmarks {name}`"
        page = BENCHMARKS.read_text(encoding="utf-8") if BENCHMARKS.exists() else ""
        write_atomically(BENCHMARKS, assembled(HEAD, tuple(MODULES), page, {name: text}))
        print(f"{name}: {perf_counter() - began:.0f} s, written to {BENCHMARKS.name}", file=sys.stderr, flush=True)


def _parsed(arguments: Sequence[str]) -> list[str]:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"one or more of {', '.join(MODULES)}; default: all")
    names = parser.parse_args(arguments).names
    strange = [name for name in names if name not in MODULES]
    if strange:
        parser.error(f"{', '.join(strange)} is no benchmark; choose from {', '.join(MODULES)}")
    return names or list(MODULES)


if __name__ == "__main__":
    main(sys.argv[1:])
