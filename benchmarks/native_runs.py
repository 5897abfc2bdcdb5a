"""Closed loops a minute: `heli simulate --native --runs` from Python, the four units, 30 s at 10 ms.

Processor time of the child is counted, so that a loaded machine does not slow the figure; building the units, loading
them and drawing the bands are part of it.
"""

import resource
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.machine import measured_at
from benchmarks.tables import Bar, bar_table

RUNS, DURATION, STEP = 1000, 30.0, 0.01
BOUND = 2000.0
"""Closed loops a minute: "thousands"."""


def section(load: float) -> str:
    from fmu_src import CLOSED_LOOP
    from fmu_src.master import run_many_apart
    from fmu_src.native import build_native
    from heli_plant.parameters import TABLE_2

    with TemporaryDirectory(prefix="heli-bench-") as name:
        fmus = {unit: build_native(kind, Path(name)) for unit, kind in CLOSED_LOOP.units}
        gains = [{"plant.pitch.gain": TABLE_2.k_x * (0.9 + 0.2 * k / RUNS)} for k in range(RUNS)]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        bands = run_many_apart(CLOSED_LOOP, DURATION, STEP, {}, gains, fmus, ["plant.pitch", "plant.elevation"])
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    bars = [
        Bar("closed loops of four native units a minute", 60.0 * bands.runs / seconds, BOUND, "", True),
        Bar("runs that were refused", float(len(bands.refused)), 0.0, ""),
    ]
    return "\n\n".join(
        [
            "## Many closed loops",
            bar_table(bars),
            f"{RUNS} runs of {DURATION:g} s in steps of {STEP:g} s with another pitch gain each, {seconds:.1f} s of "
            "processor time of one process with start, bands and result.",
            measured_at(("numba",), load),
        ]
    )
