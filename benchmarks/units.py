"""Time and memory of commands and units, each a section of docs/benchmarks.md.

``commands``: `heli --help`, `heli diagnose` of four logs cold, nothing compiled is cached, and warm.

``loop`` (pythonfmu units) and ``native`` (units in C): the contenders run in turn in each round, each in a process of
its own. Times are those of the fastest round, because their bars are for idle cores; ratios are of medians.

``memory``: of a host over 1000 instances of a unit. ``runs``: closed loops a minute.
"""

import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.harness import ROOT, Bar, bar_table, call_in_process, resident_memory, section, table
from fmu_src import CLOSED_LOOP, SCENARIOS, UNITS, Scenario, build, build_all
from fmu_src.master import run, run_apart
from fmu_src.master.loop import instantiate_units
from fmu_src.native import NATIVE_UNITS
from fmu_src.ssp import write_ssp
from heli_identifier.records import demo_files
from heli_identifier.results import to_digits
from heli_plant.effects import CATALOGUE
from heli_plant.parameters import TABLE_2
from tests.hosts.unit_host import Unit

STEP = 0.01
"""Communication step [s]."""

PARAMETERS = {"identifier.adaptation.hold_time": 0.0}
"""The identifier adapts from the first step on, as in a long round."""


def fmus_of(scenario: Scenario, files: dict[str, str]) -> dict[str, str]:
    """Return the FMUs of a scenario by its units; ``files`` has them by unit class, and the closed loop as ``ssp``."""
    return {name: files[unit] for name, unit in scenario.units}


def step_scenario(scenario: Scenario, files: dict[str, str], steps: int) -> float:
    """Step a scenario with our master, nothing recorded; only wired outputs are read, as other masters do."""
    return run(scenario, steps * STEP, STEP, {}, fmus_of(scenario, files), record=()).seconds


def fmpy_calls(files: dict[str, str], steps: int) -> float:
    """Step the same units by fmpy's own methods, one get and one set per connection, nothing recorded."""
    parameters = CLOSED_LOOP.parameters_by_unit(PARAMETERS)
    with instantiate_units(CLOSED_LOOP, fmus_of(CLOSED_LOOP, files), False) as units:
        for name, unit in units.items():
            unit.initialise(parameters[name], 0.0, 1e6)
            unit.finish_initialisation(0.0)
        pairs = [(*source.split(".", 1), *target.split(".", 1)) for target, source in CLOSED_LOOP.connections.items()]
        wires = [(units[one].slave, [units[one].variable(out).valueReference], units[other].slave,
                  [units[other].variable(fed).valueReference]) for one, out, other, fed in pairs]  # fmt: skip
        start = time.perf_counter()
        for k in range(steps):
            values = [source.getReal(output) for source, output, _, _ in wires]
            for (_, _, target, input_), value in zip(wires, values, strict=True):
                target.setReal(input_, value)
            for unit in units.values():
                unit.slave.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)
        return time.perf_counter() - start


def libcosim(files: dict[str, str], steps: int) -> float:
    """Step the same units with libcosim, its own loop, nothing observed."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level

    log_output_level(CosimLogLevel.ERROR)
    execution = CosimExecution.from_ssp_file(files["ssp"], round(STEP * 1e9))
    execution.step()
    start = time.perf_counter()
    execution.step(steps)
    return time.perf_counter() - start


def ecos(files: dict[str, str], steps: int) -> float:
    """Step the same units with Ecos, its own loop, nothing recorded."""
    from ecospy import EcosSimulation

    simulation = EcosSimulation(STEP, ssp_path=files["ssp"])
    simulation.init(0.0, "parameters")
    simulation.step(1)
    start = time.perf_counter()
    simulation.step(steps)
    return time.perf_counter() - start


def alone(unit: str, parameters: dict[str, Any]) -> Scenario:
    """Return a scenario of one unit with parameters; its inputs are at rest."""
    values = tuple((f"unit.{name}", value) for name, value in parameters.items())
    return Scenario("alone", f"{unit} alone", (("unit", unit),), {}, values)


EVERY_EFFECT = {f"effects.{e.name}.{e.axis}": 1e-3 * min(e.upper, 1.0) for e in CATALOGUE}
EVERY_EFFECT["effects.input_delay.rotors"] = 0.034
ADAPTING, FOLLOW = {"adaptation.hold_time": 0.0}, SCENARIOS["follow"]
PREDICTING = {"method": "prediction_error", **ADAPTING}
LOOP = "closed loop of four units with our master"
OURS = {
    LOOP: (replace(CLOSED_LOOP, parameters=(*CLOSED_LOOP.parameters, *PARAMETERS.items())), 100.0, 5.0),
    "HelicopterPlant, all effects off": (alone("HelicopterPlant", {}), 15.0, 0.3),
    "HelicopterPlant, every effect on": (alone("HelicopterPlant", EVERY_EFFECT), 30.0, 1.0),
    "AdaptiveIdentifier, three axes": (alone("AdaptiveIdentifier", ADAPTING), 40.0, 1.0),
    "AdaptiveIdentifier, prediction errors, lag estimated": (alone("AdaptiveIdentifier", PREDICTING), 80.0, 3.0),
    "scenario follow, on a rig that the twin does not fit": (
        replace(FOLLOW, parameters=(*FOLLOW.parameters, ("player.log.path", str(demo_files("rig-a")[0][0])))),
        250.0, 0.0,
    ),
}  # fmt: skip
"""Scenarios that our master steps, and the longest times of units in Python and in C [us a step]; 0: not in C."""

OTHERS = {"fmpy, one call per connection": (fmpy_calls, 3.0), "libcosim": (libcosim, 1.0), "Ecos": (ecos, 1.0)}
"""Other masters, and the required ratio of their time to that of our master."""


def measure_units(title: str, native: bool, realtime: float, steps: int, rounds: int) -> str:
    """Return the section of the units of a language; ``realtime`` is the required multiple of real time."""
    bounds = {name: most[native] for name, (_, *most) in OURS.items() if most[native] > 0.0}
    cases: dict[str, Callable[..., float]] = {name: partial(step_scenario, OURS[name][0]) for name in bounds}
    cases |= {name: other for name, (other, _) in OTHERS.items() if not native or other is not fmpy_calls}
    times = dict[str, list[float]]()
    with TemporaryDirectory() as name:
        folder = Path(name)
        fmus = {unit: str(build(unit, folder, native=native)) for unit in (NATIVE_UNITS if native else UNITS)}
        fmus["ssp"] = str(write_ssp(CLOSED_LOOP, folder / "loop.ssp", PARAMETERS, fmus_of(CLOSED_LOOP, fmus)))
        for _, (name, case) in product(range(rounds), cases.items()):
            with suppress(ModuleNotFoundError):
                times.setdefault(name, []).append(1e6 * call_in_process(case, fmus, steps) / steps)
    bars = [
        *(Bar(name, min(times[name]), most, "us a step") for name, most in bounds.items()),
        Bar("speed against real time, 10 ms a step", 1e6 * STEP / min(times[LOOP]), unit="times", least=realtime),
        *(Bar(f"against {name}", median(times[name]) / median(times[LOOP]), unit="times faster", least=least)
          for name, (_, least) in OTHERS.items() if name in times),
    ]  # fmt: skip
    rows = [(name, to_digits(median(of_case)), to_digits(min(of_case))) for name, of_case in times.items()]
    text = f"{steps} steps of {1000 * STEP:g} ms a round, {rounds} rounds in turn, each case in its own process."
    packages = ("fmpy", "pythonfmu", "libcosimpy", "ecospy", "ziglang", "numba")
    return section(title, bar_table(bars), table(("what", "median [us]", "least [us]"), rows), text, packages=packages)


def loop() -> str:
    """Measure pythonfmu units."""
    return measure_units("The four-unit loop and its units", False, 100.0, 1500, 12)


def native() -> str:
    """Measure native units."""
    return measure_units("Native units", True, 2000.0, 100_000, 5)


CYCLES, WARM_UP, ROUNDS = 1000, 100, 3


def commands() -> str:
    """Measure single commands in turn, so that a busy moment of the machine affects all of them."""
    training, held_out = (list(map(str, logs)) for logs in demo_files("rig-a"))
    diagnose, times = ["diagnose", *training, "--validate", *held_out, "-o"], dict[str, list[float]]()
    cases = {"`heli --help`": ["--help"]}
    cases |= {f"`heli diagnose`, rig-a, {word}": [*diagnose, word] for word in ("cold", "warm")}
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    for _ in range(ROUNDS):
        with TemporaryDirectory() as folder:
            environment |= {"PYTHONPATH": str(ROOT), "HELI_CACHE_DIR": f"{folder}/cache"}
            for name, words in cases.items():
                start = time.perf_counter()
                command = [sys.executable, "-P", "-m", "heli_command", *words]
                subprocess.run(command, capture_output=True, check=True, env=environment, cwd=folder)
                times.setdefault(name, []).append(time.perf_counter() - start)
    bars = [Bar(name, median(times[name]), most, "s") for name, most in zip(cases, (0.25, 8.0, 4.5), strict=True)]
    text = f"Median of {ROUNDS} rounds, wall time. Four logs of 90 s a diagnosis; cold: nothing compiled is cached."
    return section("Whole commands", bar_table(bars), text, packages=("numpy", "numba", "scipy"))


def memory_growth(fmu: str, log: str) -> float:
    """Return the growth of this process over instances of a unit, each initialised, stepped, freed [MB]."""
    unit, before = Unit(fmu), 0.0
    parameters = {"log.path": log} if "log.path" in unit.variables else {}
    for k in range(WARM_UP + CYCLES):
        if k == WARM_UP:
            before = resident_memory()
        unit.fresh(parameters)
        if unit.step(0.0, 0.01) != 0:
            raise RuntimeError(f"{fmu} refused a step")
        unit.shown()
        unit.free()
    return resident_memory() - before


def memory() -> str:
    """Measure the growth of a host's memory."""
    log = str(demo_files("rig-a")[0][0])
    with TemporaryDirectory() as folder:
        files = {unit: str(path) for unit, path in build_all(folder).items()}
        growths = {name: call_in_process(memory_growth, fmu, log) for name, fmu in files.items()}
    bars = [Bar(f"{name}, growth over {CYCLES} instances", value, 5.0, "MB") for name, value in growths.items()]
    return section("Many runs", bar_table(bars), packages=("fmpy", "pythonfmu"))


def runs(count: int = 1000, duration: float = 30.0) -> str:
    """Count closed loops of four native units a minute of processor time, with start, bands and result."""
    gains = [{"plant.pitch.gain": TABLE_2.k_x * (0.9 + 0.2 * k / count)} for k in range(count)]
    with TemporaryDirectory(prefix="heli-bench-") as name:
        fmus = {unit: build(kind, Path(name), native=True) for unit, kind in CLOSED_LOOP.units}
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        record = ["plant.pitch", "plant.elevation"]
        bands = run_apart(CLOSED_LOOP, duration, STEP, {}, fmus, variations=gains, record=record).bands
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert bands is not None
    busy = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    bars = [
        Bar("closed loops of four native units a minute", 60.0 * bands.runs / busy, least=2000.0),
        Bar("runs that were refused", float(len(bands.refused)), 0.0),
    ]
    text = f"{count} runs of {duration:g} s in steps of {STEP:g} s, another pitch gain each; {busy:.1f} s of processor."
    return section("Many closed loops", bar_table(bars), text, packages=("numba",))
