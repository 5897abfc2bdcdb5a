"""Time of a communication step: the four-unit closed loop under our master and others, and each unit alone.

Sections ``loop`` (pythonfmu units) and ``native`` (units in C). The contenders run in turn in each round, each in a
process of its own. Times are those of the fastest round, because their bars are for idle cores; ratios are of medians.
"""

import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import partial
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory, mkdtemp
from typing import Any

from benchmarks.harness import Bar, apart, bar_table, section, table
from fmu_src import CLOSED_LOOP, Scenario, build, build_all
from fmu_src.master import run
from fmu_src.master.instance import Instance
from fmu_src.native import NATIVE_UNITS
from fmu_src.ssp import write_ssp
from heli_identifier.results import significant
from heli_plant.effects import CATALOGUE

STEP = 0.01
"""Communication step [s]."""

GIVEN = {"identifier.adaptation.hold_time": 0.0}
"""The identifier adapts from the first step on, so that a short round does the same."""

Order = dict[str, Any]
"""Files by unit class and by unit of the loop, and the loop as an .ssp file."""


def ours(order: Order, steps: int) -> float:
    """Step the closed loop of four units with our master; only wired outputs are fetched, as others do."""
    return run("closed_loop", steps * STEP, STEP, GIVEN, order["fmus"], record=()).seconds


def fmpy_calls(order: Order, steps: int) -> float:
    """Step the same units by fmpy's own methods, one get and one set per connection, nothing recorded."""

    def reference(unit: str, name: str) -> list[int]:
        return [units[unit].variable(name).valueReference]

    units, given = {}, CLOSED_LOOP.parameters_by_unit(GIVEN)
    for name, fmu in order["fmus"].items():
        units[name] = Instance(name, Path(fmu), Path(mkdtemp(dir=Path(fmu).parent)))
        units[name].initialise(given[name], 0.0, 1e6)
        units[name].finish_initialisation(0.0)
    slaves = {name: unit.slave for name, unit in units.items()}
    wires = [
        (slaves[w.source_unit], reference(w.source_unit, w.source),
         slaves[w.target_unit], reference(w.target_unit, w.target))
        for w in CLOSED_LOOP.connections
    ]  # fmt: skip
    began = time.perf_counter()
    for k in range(steps):
        values = [source.getReal(output) for source, output, _, _ in wires]
        for (_, _, target, input_), value in zip(wires, values, strict=True):
            target.setReal(input_, value)
        for slave in slaves.values():
            slave.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)
    return time.perf_counter() - began


def libcosim(order: Order, steps: int) -> float:
    """Step the same units with libcosim, its own loop, nothing observed."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level

    log_output_level(CosimLogLevel.ERROR)
    execution = CosimExecution.from_ssp_file(order["ssp"], round(STEP * 1e9))
    execution.step()
    began = time.perf_counter()
    execution.step(steps)
    return time.perf_counter() - began


def ecos(order: Order, steps: int) -> float:
    """Step the same units with Ecos, its own loop, nothing recorded."""
    from ecospy import EcosSimulation

    simulation = EcosSimulation(STEP, ssp_path=order["ssp"])
    simulation.init(0.0, "parameters")
    simulation.step(1)
    began = time.perf_counter()
    simulation.step(steps)
    return time.perf_counter() - began


def alone(order: Order, steps: int, unit: str, parameters: dict[str, Any]) -> float:
    """Step one unit with our master, its inputs at rest, nothing recorded; a native one in machine code."""
    one = Scenario("alone", f"{unit} alone", (("unit", unit),), ())
    given = {f"unit.{name}": value for name, value in parameters.items()}
    return run(one, steps * STEP, STEP, given, {"unit": order["units"][unit]}, record=()).seconds


EVERY_EFFECT = {f"effects.{e.name}.{e.axis}": 1e-3 * min(e.upper, 1.0) for e in CATALOGUE}
EVERY_EFFECT["effects.input_delay.rotors"] = 0.034
OURS, FMPY, LIBCOSIM, ECOS = (
    "closed loop of four units with our master", "the same, fmpy, one call per connection", "the same, libcosim",
    "the same, Ecos",
)  # fmt: skip
ALONE: dict[str, tuple[str, dict[str, Any]]] = {
    "HelicopterPlant, all effects off": ("HelicopterPlant", {}),
    "HelicopterPlant, every effect on": ("HelicopterPlant", EVERY_EFFECT),
    "AdaptiveIdentifier, three axes": ("AdaptiveIdentifier", {"adaptation.hold_time": 0.0}),
    "AdaptiveIdentifier, prediction errors with the lag estimated": (
        "AdaptiveIdentifier", {"method": "prediction_error", "adaptation.hold_time": 0.0},
    ),
}  # fmt: skip
CASES: dict[str, Callable[[Order, int], float]] = {
    OURS: ours, FMPY: fmpy_calls, LIBCOSIM: libcosim, ECOS: ecos,
    **{name: partial(alone, unit=unit, parameters=given) for name, (unit, given) in ALONE.items()},
}  # fmt: skip
FASTER = {FMPY: 3.0, LIBCOSIM: 1.0, ECOS: 1.0}
"""How many times as fast as other masters ours has to be."""


def timed(
    title: str, make: Callable[[Path], dict[str, Path]], bounds: Iterable[float], realtime: float, steps: int,
    rounds: int, without: tuple[str, ...] = (),
) -> str:  # fmt: skip
    """Give the section of the units that are built.

    ``bounds`` are of the loop and the units alone [us a step], ``realtime`` is the speed against real time. Masters
    whose package is missing are left out.
    """
    times: dict[str, list[float]] = {}
    with TemporaryDirectory(prefix="heli-bench-") as folder:
        files = make(Path(folder))
        fmus = {name: str(files[unit]) for name, unit in CLOSED_LOOP.units}
        ssp = write_ssp(CLOSED_LOOP, Path(folder, "closed_loop.ssp"), GIVEN, fmus)
        order = {"units": {unit: str(path) for unit, path in files.items()}, "fmus": fmus, "ssp": str(ssp)}
        for _ in range(rounds):
            for name in (name for name in CASES if name not in without):
                with suppress(ModuleNotFoundError):
                    micro = 1e6 * apart(CASES[name], order, steps) / steps
                    times.setdefault(name, []).append(micro)
    bars = [
        *(Bar(name, min(times[name]), bound, "us a step") for name, bound in zip((OURS, *ALONE), bounds, strict=True)),
        Bar("speed against real time, 10 ms a step", 1e6 * STEP / min(times[OURS]), realtime, "times", True),
        *(Bar(f"against {name.removeprefix('the same, ')}", median(times[name]) / median(times[OURS]), bound,
              "times faster", True) for name, bound in FASTER.items() if name in times),
    ]  # fmt: skip
    rows = [(name, significant(median(own)), significant(min(own))) for name, own in times.items()]
    said = f"{steps} steps of {1000 * STEP:g} ms a round, {rounds} rounds in turn, each case in its own process."
    packages = ("fmpy", "pythonfmu", "libcosimpy", "ecospy", "ziglang", "numba")
    return section(title, bar_table(bars), table(("what", "median [us]", "least [us]"), rows), said, packages=packages)


def loop() -> str:
    """Measure pythonfmu units."""
    return timed("The four-unit loop and its units", build_all, (100.0, 15.0, 30.0, 40.0, 80.0), 100.0, 1500, 12)


def native() -> str:
    """Measure native units."""

    def make(folder: Path) -> dict[str, Path]:
        return {unit: build(unit, folder, native=True) for unit in NATIVE_UNITS}

    return timed("Native units", make, (5.0, 0.3, 1.0, 1.0, 3.0), 2000.0, 100_000, 5, (FMPY,))
