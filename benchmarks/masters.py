"""Time of a communication step: the four-unit closed loop under our master and others, and each unit alone.

Sections ``loop`` (pythonfmu units) and ``native`` (units in C). The contenders run in turn in each round, each in a
process of its own. Times are those of the fastest round, because their bars are for idle cores; ratios are of medians.
"""

import time
from collections.abc import Callable, Iterable
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory, mkdtemp
from typing import Any

from benchmarks.harness import Bar, apart, bar_table, section, table
from heli_identifier.results import significant

STEP = 0.01
"""Communication step [s]."""

GIVEN = {"identifier.adaptation.hold_time": 0.0}
"""The identifier adapts from the first step on, so that a short round does the same."""

Times = dict[str, list[float]]
"""Microseconds a step of each round, by case."""

Order = dict[str, Any]
"""Files by unit class and by unit of the loop, and the loop as an .ssp file."""


def ours(order: Order, steps: int) -> float:
    """Step the closed loop of four units with our master; only wired outputs are fetched, as others do."""
    from fmu_src.master import run

    return run("closed_loop", steps * STEP, STEP, GIVEN, order["fmus"], record=()).seconds


def fmpy_calls(order: Order, steps: int) -> float:
    """Step the same units by fmpy's own methods, one get and one set per connection, nothing recorded."""
    from fmu_src import CLOSED_LOOP
    from fmu_src.master.instance import Instance

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


def _alone(order: Order, steps: int, unit: str, parameters: dict[str, Any]) -> float:
    """Step one unit with our master, its inputs at rest, nothing recorded; a native one in machine code."""
    from fmu_src import Scenario
    from fmu_src.master import run

    alone = Scenario("alone", f"{unit} alone", (("unit", unit),), ())
    given = {f"unit.{name}": value for name, value in parameters.items()}
    return run(alone, steps * STEP, STEP, given, {"unit": order["units"][unit]}, record=()).seconds


def plant_off(order: Order, steps: int) -> float:
    """Step HelicopterPlant, all effects off."""
    return _alone(order, steps, "HelicopterPlant", {})


def plant_on(order: Order, steps: int) -> float:
    """Step HelicopterPlant, every effect of the catalogue on."""
    from heli_plant.effects import CATALOGUE

    small = {f"effects.{e.name}.{e.axis}": 1e-3 * min(e.upper, 1.0) for e in CATALOGUE}
    return _alone(order, steps, "HelicopterPlant", {**small, "effects.input_delay.rotors": 0.034})


def identifier(order: Order, steps: int) -> float:
    """Step AdaptiveIdentifier, three axes."""
    return _alone(order, steps, "AdaptiveIdentifier", {"adaptation.hold_time": 0.0})


def prediction(order: Order, steps: int) -> float:
    """Step AdaptiveIdentifier, prediction errors with the lag estimated."""
    return _alone(order, steps, "AdaptiveIdentifier", {"method": "prediction_error", "adaptation.hold_time": 0.0})


CASES: tuple[Callable[[Order, int], float], ...] = (
    ours, fmpy_calls, libcosim, ecos, plant_off, plant_on, identifier, prediction,
)  # fmt: skip
TITLES = {case.__name__: (case.__doc__ or "").rstrip(".") for case in CASES}
PEERS = {"fmpy_calls": ("fmpy, one call per connection", 3.0), "libcosim": ("libcosim", 1.0), "ecos": ("Ecos", 1.0)}
"""Other masters, and how many times as fast ours has to be."""


def seconds_of(case: str, order: Order, steps: int) -> float | None:
    """Run one case; None where its package is missing."""
    try:
        return {one.__name__: one for one in CASES}[case](order, steps)
    except ModuleNotFoundError:
        return None


def timed(
    cases: Iterable[Callable[[Order, int], float]], order: Order, steps: int, rounds: int
) -> Times:
    """Give the microseconds a step of each case in each round; cases whose package is missing are left out."""
    found: Times = {}
    for _ in range(rounds):
        for case in cases:
            seconds = apart(seconds_of, case.__name__, order, steps)
            if seconds is not None:
                found.setdefault(case.__name__, []).append(1e6 * seconds / steps)
    return found


def order_of(files: dict[str, Path], folder: Path) -> Order:
    """Give what the cases need of built units."""
    from fmu_src import CLOSED_LOOP
    from fmu_src.ssp import write_ssp

    fmus = {name: str(files[unit]) for name, unit in CLOSED_LOOP.units}
    ssp = write_ssp(CLOSED_LOOP, folder / "closed_loop.ssp", GIVEN, fmus)
    return {"units": {unit: str(path) for unit, path in files.items()}, "fmus": fmus, "ssp": str(ssp)}


def loop_bars(times: Times, bounds: dict[str, float], faster: float) -> list[Bar]:
    """Compare the times of the loop and of the units, by case, with their bars."""
    least = {case: min(seen) for case, seen in times.items()}
    return [
        *(Bar(TITLES[case], least[case], bound, "us a step") for case, bound in bounds.items()),
        Bar("speed against real time, 10 ms a step", 1e6 * STEP / least["ours"], faster, "times", True),
        *(Bar(f"against {title}", median(times[case]) / median(times["ours"]), bound, "times faster", True)
          for case, (title, bound) in PEERS.items() if case in times),
    ]  # fmt: skip


def loop(steps: int = 1500, rounds: int = 12) -> str:
    """Measure pythonfmu units."""
    from fmu_src import build_all

    with TemporaryDirectory(prefix="heli-bench-") as name:
        times = timed(CASES, order_of(build_all(name), Path(name)), steps, rounds)
    bounds = {"ours": 100.0, "plant_off": 15.0, "plant_on": 30.0, "identifier": 40.0, "prediction": 80.0}
    bars = loop_bars(times, bounds, 100.0)
    return _loop_section("The four-unit loop and its units", times, bars, steps, rounds, "pythonfmu")


def native(steps: int = 100_000, rounds: int = 5) -> str:
    """Measure native units."""
    from fmu_src.native import NATIVE_UNITS, build_native

    with TemporaryDirectory(prefix="heli-bench-") as name:
        files = {unit: build_native(unit, Path(name)) for unit in NATIVE_UNITS}
        cases = [case for case in CASES if case is not fmpy_calls]
        times = timed(cases, order_of(files, Path(name)), steps, rounds)
    bounds = {"ours": 5.0, "plant_off": 0.3, "plant_on": 1.0, "identifier": 1.0, "prediction": 3.0}
    return _loop_section("Native units", times, loop_bars(times, bounds, 2000.0), steps, rounds, "ziglang", "numba")


def _loop_section(title: str, times: Times, bars: list[Bar], steps: int, rounds: int, *packages: str) -> str:
    rows = [
        (TITLES[case.__name__], significant(median(seen)), significant(min(seen)))
        for case in CASES
        if (seen := times.get(case.__name__))
    ]
    return section(
        title,
        bar_table(bars),
        table(("what", "median [us]", "least [us]"), rows),
        f"{steps} steps of {1000 * STEP:g} ms a round, {rounds} rounds in turn, each case in its own process.",
        packages=("fmpy", "libcosimpy", "ecospy", *packages),
    )
