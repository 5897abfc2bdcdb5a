"""Endurance over many runs: memory of the units, aborts of the master."""

from benchmarks.machine import measured_at
from benchmarks.printed import printed

CYCLES, RUNS = 1000, 50


def section(load: float) -> str:
    growth = printed("benchmarks.unit_memory", str(CYCLES))
    runs = printed("benchmarks.master_runs", str(RUNS))
    return "\n\n".join(
        [
            "## Many runs",
            "Growth of a host's memory over instances of each unit, and whole processes of the master.",
            growth.block,
            runs.block,
            measured_at(("fmpy", "pythonfmu"), load),
        ]
    )
