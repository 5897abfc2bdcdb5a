"""Many runs of units: memory of a host, aborts of the master, closed loops a minute.

Bars: 5 MB over 1000 instances of a unit; no abort and the same bits in 50 processes of the master; 2000 closed loops a
minute. That native units have the bits of those in Python is tested (tests/test_native_units.py).
"""

import resource
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.harness import Bar, apart, bar_table, resident_memory, section
from fmu_src import CLOSED_LOOP, MasterError, build, build_all
from fmu_src.master import run_apart
from heli_plant.parameters import TABLE_2
from tests.hosts.unit_host import Unit

HEADER = "time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]\n"
CYCLES, WARM_UP, PROCESSES = 1000, 100, 50


def growth(fmu: str, log: str) -> float:
    """Give the growth of this process over instances of a unit, each initialised, stepped, freed [MB]."""
    unit, before = Unit(fmu), 0.0
    given = {"log.path": log} if "log.path" in unit.variables else {}
    for k in range(WARM_UP + CYCLES):
        if k == WARM_UP:
            before = resident_memory()
        unit.fresh(given)
        if unit.step(0.0, 0.01) != 0:
            raise RuntimeError(f"{fmu} refused a step")
        unit.shown()
        unit.free()
    return resident_memory() - before


def memory() -> str:
    """Measure the growth of a host's memory, and run whole processes of the master."""
    with TemporaryDirectory() as folder:
        log = Path(folder) / "log.csv"
        log.write_text(HEADER + "".join(f"{0.01 * k:.2f},1,1,0,0,0\n" for k in range(9000)))
        built = build_all(folder)
        grown = {name: apart(growth, str(fmu), str(log)) for name, fmu in built.items()}
        fmus = {name: built[kind] for name, kind in CLOSED_LOOP.units}
        aborts, results = 0, []
        for _ in range(PROCESSES):
            try:
                results.append(run_apart(CLOSED_LOOP, 2.0, fmus=fmus).values)
            except MasterError:
                aborts += 1
    differing = sum(not np.array_equal(one, results[0]) for one in results)
    bars = [
        *(Bar(f"{name}, growth over {CYCLES} instances", value, 5.0, "MB") for name, value in grown.items()),
        Bar(f"aborts in {PROCESSES} processes of the master", float(aborts), 0.0, ""),
        Bar("of these with other results than the first", float(differing), 0.0, ""),
    ]
    return section("Many runs", bar_table(bars), packages=("fmpy", "pythonfmu"))


def runs(count: int = 1000, duration: float = 30.0, step: float = 0.01) -> str:
    """Count closed loops of four native units a minute of processor time, with start, bands and result."""
    with TemporaryDirectory(prefix="heli-bench-") as name:
        fmus = {unit: build(kind, Path(name), native=True) for unit, kind in CLOSED_LOOP.units}
        gains = [{"plant.pitch.gain": TABLE_2.k_x * (0.9 + 0.2 * k / count)} for k in range(count)]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        record = ["plant.pitch", "plant.elevation"]
        bands = run_apart(CLOSED_LOOP, duration, step, {}, fmus, variations=gains, record=record).bands
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert bands is not None
    busy = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    bars = [
        Bar("closed loops of four native units a minute", 60.0 * bands.runs / busy, 2000.0, "", True),
        Bar("runs that were refused", float(len(bands.refused)), 0.0, ""),
    ]
    said = f"{count} runs of {duration:g} s in steps of {step:g} s, another pitch gain each; {busy:.1f} s of processor."
    return section("Many closed loops", bar_table(bars), said, packages=("numba",))
