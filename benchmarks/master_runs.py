"""Whole processes of the master, one after another, and how many of them abort.

Usage: python benchmarks/master_runs.py [RUNS]. Each run loads four units, steps the closed loop for 2 s and leaves;
pythonfmu's binary aborts now and then at interpreter exit, which ``leave`` is there to avoid. The results are
compared as well: every run must give the same bits.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from fmu_src import CLOSED_LOOP, MasterError, build
from fmu_src.master import run_apart


def main() -> None:
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    aborts = differing = 0
    first = None
    with TemporaryDirectory() as folder:
        fmus = {name: build(kind, Path(folder)) for name, kind in CLOSED_LOOP.units}
        for _ in range(runs):
            try:
                values = run_apart(CLOSED_LOOP, 2.0, fmus=fmus).values
            except MasterError as problem:
                aborts += 1
                print(problem)
                continue
            first = values if first is None else first
            differing += not np.array_equal(values, first)
    print(f"{runs} runs: {aborts} aborts, {differing} with other results than the first")
    sys.exit(bool(aborts or differing))


if __name__ == "__main__":
    main()
