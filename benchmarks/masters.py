"""Time of a communication step: the four-unit closed loop under our master and others, and each unit alone.

Sections ``loop`` (pythonfmu units) and ``native`` (units in C). The contenders run in turn in each round, each in a
process of its own. Times are those of the fastest round, because their bars are for idle cores; ratios are of medians.
The FMI boundary is what FMI adds to a step: the master's step less that of the same four units as Python objects, their
connections copied value by value and ``advance`` called directly.
"""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.harness import ROOT, Bar, apart, bar_table, figure, measured_at, table

STEP = 0.01
"""Communication step [s]."""

GIVEN = {"identifier.adaptation.hold_time": 0.0}
"""The identifier adapts from the first step on, so that a short round does the same."""

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
) -> dict[str, list[float]]:
    """Give the microseconds a step of each case in each round; cases whose package is missing are left out."""
    found: dict[str, list[float]] = {}
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


def loop_bars(times: dict[str, list[float]], bounds: dict[str, float], faster: float) -> list[Bar]:
    """Compare the times of the loop and of the units, by case, with their bars."""
    least = {case: min(seen) for case, seen in times.items()}
    titles = {case.__name__: (case.__doc__ or "").rstrip(".") for case in CASES}
    return [
        *(Bar(titles[case], least[case], bound, "us a step") for case, bound in bounds.items()),
        Bar("speed against real time, 10 ms a step", 1e6 * STEP / least["ours"], faster, "times", True),
        *(Bar(f"against {title}", median(times[case]) / median(times["ours"]), bound, "times faster", True)
          for case, (title, bound) in PEERS.items() if case in times),
    ]  # fmt: skip


def _rows(times: dict[str, list[float]]) -> str:
    rows = [
        ((case.__doc__ or "").rstrip("."), figure(median(seen)), figure(min(seen)))
        for case in CASES if (seen := times.get(case.__name__))
    ]  # fmt: skip
    return table(("what", "median [us]", "least [us]"), rows)


def loop(steps: int = 1500, rounds: int = 12) -> str:
    """Measure pythonfmu units."""
    from fmu_src import build_all

    with TemporaryDirectory(prefix="heli-bench-") as name:
        times = timed(CASES, order_of(build_all(name), Path(name)), steps, rounds)
    boundary = min(times["ours"]) - min(times["models_alone"])
    bounds = {"ours": 100.0, "plant_off": 15.0, "plant_on": 30.0, "identifier": 40.0, "prediction": 80.0}
    return "\n\n".join(
        [
            "## The four-unit loop and its units",
            bar_table([*loop_bars(times, bounds, 100.0), Bar("the FMI boundary of the loop", boundary, 25.0, "us")]),
            _rows(times),
            f"{steps} steps of {1000 * STEP:g} ms a round, {rounds} rounds in turn, each case in its own process.",
            measured_at("fmpy", "pythonfmu", "libcosimpy", "ecospy"),
        ]
    )


# --- native units ------------------------------------------------------------------------------------------------

HOST = ROOT / "tests" / "hosts" / "native_host.c"


def in_c_host(folder: Path, fmu: Path) -> tuple[float, float]:
    """Return what a C host with two instances of a native unit needs: first instance [ms], peak memory [MB]."""
    from tests.c_hosts import described

    compiler = shutil.which("gcc")
    if compiler is None:
        return float("nan"), float("nan")
    program, opened = folder / "host", folder / f"opened-{fmu.stem}"
    subprocess.run([compiler, "-std=gnu11", "-O1", str(HOST), "-o", str(program), "-ldl", "-lm"], check=True)
    shutil.unpack_archive(fmu, opened, "zip")
    guid, _, references = described(opened)
    done = subprocess.run(
        [str(program), str(opened / f"binaries/linux64/{fmu.stem}.so"), guid, "2000", "-1", "", *references],
        check=True, capture_output=True, text=True,
    )  # fmt: skip
    said = {line.split()[0]: line.split()[2] for line in done.stderr.splitlines() if line[:4] in ("firs", "peak")}
    return float(said["first"]), float(said["peak"]) / 1024.0


def native(steps: int = 100_000, rounds: int = 5) -> str:
    """Measure native units."""
    from fmu_src.native import NATIVE_UNITS

    with TemporaryDirectory(prefix="heli-bench-") as name:
        folder = Path(name)
        began = time.perf_counter()
        subprocess.run(
            [sys.executable, "-c", "from heli_command import main; main()", "build", "--native", "--output", name],
            check=True, capture_output=True, env={**os.environ, "PYTHONPATH": str(ROOT), "ZIG_GLOBAL_CACHE_DIR": name},
        )  # fmt: skip
        cold = time.perf_counter() - began
        files = {unit: folder / f"{unit}.fmu" for unit in NATIVE_UNITS}
        cases = [case for case in CASES if case not in IN_PYTHON_ONLY]
        times = timed(cases, order_of(files, folder), steps, rounds)
        hosts = {unit: in_c_host(folder, files[unit]) for unit in ("HelicopterPlant", "AdaptiveIdentifier")}
    bounds = {"ours": 5.0, "plant_off": 0.3, "plant_on": 1.0, "identifier": 1.0, "prediction": 3.0}
    bars = [
        *loop_bars(times, bounds, 2000.0),
        *(Bar(f"first {unit} in a C host, with loading", said[0], 1.0, "ms") for unit, said in hosts.items()),
        *(Bar(f"memory of a C host, {unit}", said[1], 4.0, "MB") for unit, said in hosts.items()),
        Bar("`heli build --native`, five units, both platforms, cold", cold, 60.0, "s"),
    ]
    return "\n\n".join(
        [
            "## Native units",
            bar_table(bars),
            _rows(times),
            f"{steps} steps a round, {rounds} rounds in turn, every case in a process of its own.",
            measured_at("fmpy", "libcosimpy", "ecospy", "ziglang", "numba"),
        ]
    )
