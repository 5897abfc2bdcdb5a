"""Time of a communication step: the four-unit closed loop under our master and others, and each unit alone.

Sections ``loop`` (pythonfmu units) and ``native`` (units in C). The contenders run in turn in each round, each in a
process of its own. Times are those of the fastest round, because their bars are for idle cores; ratios are of medians.
The FMI boundary is what FMI adds to a step: the master's step less that of the same four units as Python objects, their
connections copied value by value and ``advance`` called directly.
"""

import time
from collections.abc import Callable, Iterable
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.harness import Bar, apart, bar_table, figure, section, table

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


def models_alone(order: Order, steps: int) -> float:
    """Run the four units' Python code in the same loop without FMI."""
    from fmu_src import CLOSED_LOOP, unit_class

    units: dict[str, Any] = {}
    for name, kind in CLOSED_LOOP.units:
        unit: Any = unit_class(kind)(instance_name=name, resources="")
        for parameter, value in CLOSED_LOOP.parameters_by_unit(GIVEN).get(name, {}).items():
            unit.set_real([unit.references[parameter]], [value])
        unit.setup_experiment(0.0)
        unit.enter_initialization_mode()
        unit.exit_initialization_mode()
        units[name] = unit
    wires = [
        (units[w.source_unit].values, units[w.source_unit].references[w.source],
         units[w.target_unit].values, units[w.target_unit].references[w.target])
        for w in CLOSED_LOOP.connections
    ]  # fmt: skip
    began = time.perf_counter()
    for k in range(steps):
        values = [shown[output] for shown, output, _, _ in wires]
        for (_, _, fed, input_), value in zip(wires, values, strict=True):
            fed[input_] = value
        for unit in units.values():
            unit.advance(k * STEP, STEP)
    return time.perf_counter() - began


def fmpy_calls(order: Order, steps: int) -> float:
    """Step the same units by fmpy's own methods, one get and one set per connection, nothing recorded."""
    import fmpy
    from fmpy.fmi2 import FMU2Slave

    from fmu_src import CLOSED_LOOP

    slaves, references = {}, {}
    for name, fmu in order["fmus"].items():
        description = fmpy.read_model_description(fmu)
        references[name] = {v.name: v.valueReference for v in description.modelVariables}
        identifier = description.coSimulation.modelIdentifier
        slave = FMU2Slave(guid=description.guid, unzipDirectory=fmpy.extract(fmu), modelIdentifier=identifier,
                          instanceName=name)  # fmt: skip
        slave.instantiate()
        slave.setupExperiment(startTime=0.0)
        for parameter, value in CLOSED_LOOP.parameters_by_unit(GIVEN).get(name, {}).items():
            kind = next(v.type for v in description.modelVariables if v.name == parameter)
            getattr(slave, f"set{kind}")([references[name][parameter]], [value])
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        slaves[name] = slave
    wires = [
        (slaves[w.source_unit], [references[w.source_unit][w.source]],
         slaves[w.target_unit], [references[w.target_unit][w.target]])
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
    given = {"method": "prediction_error", "adaptation.hold_time": 0.0}
    return _alone(order, steps, "AdaptiveIdentifier", given)


CASES: tuple[Callable[[Order, int], float], ...] = (
    ours, models_alone, fmpy_calls, libcosim, ecos, plant_off, plant_on, identifier, prediction,
)  # fmt: skip
TITLES = {case.__name__: (case.__doc__ or "").rstrip(".") for case in CASES}
IN_PYTHON_ONLY = (models_alone, fmpy_calls)
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
    boundary = min(times["ours"]) - min(times["models_alone"])
    bounds = {"ours": 100.0, "plant_off": 15.0, "plant_on": 30.0, "identifier": 40.0, "prediction": 80.0}
    bars = [*loop_bars(times, bounds, 100.0), Bar("the FMI boundary of the loop", boundary, 25.0, "us")]
    return _loop_section("The four-unit loop and its units", times, bars, steps, rounds, "pythonfmu")


def native(steps: int = 100_000, rounds: int = 5) -> str:
    """Measure native units."""
    from fmu_src.native import NATIVE_UNITS, build_native

    with TemporaryDirectory(prefix="heli-bench-") as name:
        files = {unit: build_native(unit, Path(name)) for unit in NATIVE_UNITS}
        cases = [case for case in CASES if case not in IN_PYTHON_ONLY]
        times = timed(cases, order_of(files, Path(name)), steps, rounds)
    bounds = {"ours": 5.0, "plant_off": 0.3, "plant_on": 1.0, "identifier": 1.0, "prediction": 3.0}
    return _loop_section("Native units", times, loop_bars(times, bounds, 2000.0), steps, rounds, "ziglang", "numba")


def _loop_section(title: str, times: Times, bars: list[Bar], steps: int, rounds: int, *packages: str) -> str:
    rows = [
        (TITLES[case.__name__], figure(median(seen)), figure(min(seen)))
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
