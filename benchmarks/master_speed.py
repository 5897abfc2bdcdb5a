"""Time per communication step of the four-unit closed loop, ours and others', and of each unit's own arithmetic.

Usage: python -m benchmarks.master_speed [STEPS] [ROUNDS]. Everything runs in turn in each round, in a process of its
own; the table gives the median and the smallest of the rounds, in microseconds.

The FMI boundary is what FMI adds to a step: the master's step with wired outputs alone, less that of the same four
units as Python objects, their connections copied value by value and ``advance`` called directly (``models_alone``).
Its floor is ``empty_units``: the same master on four pythonfmu units that do nothing, wired alike (ten calls a step).
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from benchmarks.fmpy_masters import STEP, fmpy_per_connection, fmpy_recording_all, fmpy_ssp

ROOT = Path(__file__).resolve().parent.parent
GIVEN = {"identifier.adaptation.hold_time": 0.0}
"""Parameters in every contender: the identifier adapts from the first step on, so that a short round does the same."""

EMPTY_UNIT = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real

class Empty(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        for kind, count in ((Fmi2Causality.input, 5), (Fmi2Causality.output, 3)):
            for i in range(count):
                start = {"start": 0.0} if kind == Fmi2Causality.input else {}
                name = f"{kind.name}_{i}"
                self.register_variable(Real(name, causality=kind, getter=float, setter=float, **start))
    def set_real(self, references, values):
        pass
    def get_real(self, references):
        return [0.0] * len(references)
    def do_step(self, time, step):
        return True
"""


def ours(order: dict, steps: int) -> float:
    """Step with the master: prebuilt buffers, three calls per unit; only wired outputs are fetched, as others do."""
    from fmu_src.master import run

    return run("closed_loop", steps * STEP, STEP, GIVEN, order["fmus"], record=()).seconds


def ours_recording_all(order: dict, steps: int) -> float:
    """Step with the master, all 47 outputs recorded at every step."""
    from fmu_src.master import run

    return run("closed_loop", steps * STEP, STEP, GIVEN, order["fmus"]).seconds


def libcosimpy(order: dict, steps: int) -> float:
    """Step with libcosim, its own loop, nothing observed."""
    from libcosimpy.CosimExecution import CosimExecution

    execution = CosimExecution.from_ssp_file(order["ssp"], round(STEP * 1e9))
    execution.step()
    began = time.perf_counter()
    execution.step(steps)
    return time.perf_counter() - began


def ecos(order: dict, steps: int) -> float:
    """Step with Ecos, its own loop, nothing recorded."""
    from ecospy import EcosSimulation

    simulation = EcosSimulation(STEP, ssp_path=order["ssp"])
    simulation.init(0.0, "parameters")
    simulation.step(1)
    began = time.perf_counter()
    simulation.step(steps)
    return time.perf_counter() - began


def models_alone(order: dict, steps: int) -> float:
    """Run the four units' Python code in the same loop without FMI: what is not the boundary."""
    from fmu_src import CLOSED_LOOP, unit_class

    units = {}
    for name, kind in CLOSED_LOOP.units:
        unit = unit_class(kind)(instance_name=name, resources="")
        for parameter, value in order["parameters"].get(name, {}).items():
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


def empty_units(order: dict, steps: int) -> float:
    """Step four pythonfmu units that do nothing, wired alike, with the master: the boundary's floor."""
    from pythonfmu.builder import FmuBuilder

    from fmu_src import CLOSED_LOOP, Connection, Scenario
    from fmu_src.master import run

    units = [name for name, _ in CLOSED_LOOP.units]
    place = {(w.source_unit, w.source): None for w in CLOSED_LOOP.connections}
    for unit in units:
        own = [key for key in place if key[0] == unit]
        place.update({key: f"output_{i}" for i, key in enumerate(own)})
    fed = dict.fromkeys(units, 0)
    wires = []
    for w in CLOSED_LOOP.connections:
        wires.append(
            Connection(w.source_unit, place[w.source_unit, w.source], w.target_unit, f"input_{fed[w.target_unit]}")
        )
        fed[w.target_unit] += 1
    with TemporaryDirectory() as folder:
        script = Path(folder) / "empty.py"
        script.write_text(EMPTY_UNIT)
        fmu = FmuBuilder.build_FMU(script, dest=folder)
        alike = Scenario("empty", "units that do nothing", tuple((name, "Empty") for name in units), tuple(wires))
        return run(alike, steps * STEP, STEP, {}, dict.fromkeys(units, fmu), record=()).seconds


RESTING = ("correction.", "measured.", "observer.")
"""Inputs of a plant that follows a rig; at zero it simulates."""


def _do_step(order: dict, steps: int, unit: str, parameters: dict) -> float:
    """Time fmi2DoStep of one unit through the boundary, by a ready pointer."""
    import numpy as np

    from fmu_src.master.instance import Instance
    from fmu_src.master.tape import Clock, Tape

    alarm, clock = [], Clock(STEP)
    with TemporaryDirectory() as folder:
        instance = Instance("unit", Path(order["units"][unit]), Path(folder) / "unpacked", alarm)
        instance.initialise(parameters, 0.0, steps * STEP)
        inputs = [name for name, v in instance.variables.items() if v.causality == "input"]
        fed = np.array([0.0 if name.startswith(RESTING) else 0.8 for name in inputs])
        instance.bind(inputs, instance.outputs, fed, np.zeros(len(instance.outputs)), clock)
        instance.finish_initialisation(0.0)
        Tape(instance.puts, clock, alarm).play(0.0)
        tape = Tape(instance.steps, clock, alarm)
        began = time.perf_counter()
        for k in range(steps):
            tape.play(k * STEP)
        return time.perf_counter() - began


def plant_off(order: dict, steps: int) -> float:
    """Time HelicopterPlant doStep, all effects off."""
    return _do_step(order, steps, "HelicopterPlant", {})


def plant_on(order: dict, steps: int) -> float:
    """Time HelicopterPlant doStep, every effect of the catalogue on."""
    from heli_plant.effects import CATALOGUE

    small = {f"effects.{e.name}.{e.axis}": 1e-3 * min(e.upper, 1.0) for e in CATALOGUE}
    small["effects.input_delay.rotors"] = 0.034
    return _do_step(order, steps, "HelicopterPlant", small)


def identifier(order: dict, steps: int) -> float:
    """Time AdaptiveIdentifier doStep, three axes."""
    return _do_step(order, steps, "AdaptiveIdentifier", {"adaptation.hold_time": 0.0})


CASES: dict[str, Callable[[dict, int], float]] = {
    case.__name__: case
    for case in (
        ours,
        ours_recording_all,
        models_alone,
        empty_units,
        fmpy_per_connection,
        fmpy_recording_all,
        fmpy_ssp,
        libcosimpy,
        ecos,
        plant_off,
        plant_on,
        identifier,
    )
}


def child(case: str, path: str, steps: str) -> None:
    """Run one case on an order in JSON and print its seconds per step."""
    with open(path) as file:
        order = json.load(file)
    print(f"SECONDS {CASES[case](order, int(steps)) / int(steps)!r}")
    sys.stdout.flush()
    os._exit(0)


def main(steps: int, rounds: int) -> None:
    """Build, run all cases in turn, print the table and the ratios."""
    from fmu_src import CLOSED_LOOP, build_all
    from fmu_src.ssp import write_ssp

    times: dict[str, list[float]] = {case: [] for case in CASES}
    with TemporaryDirectory() as folder:
        built = build_all(folder)
        files = {name: str(built[kind]) for name, kind in CLOSED_LOOP.units}
        order = {
            "fmus": files,
            "units": {name: str(path) for name, path in built.items()},
            "connections": [[w.source_unit, w.source, w.target_unit, w.target] for w in CLOSED_LOOP.connections],
            "outputs": {name: _outputs(kind) for name, kind in CLOSED_LOOP.units},
            "parameters": CLOSED_LOOP.parameters_by_unit(GIVEN),
            "ssp": str(write_ssp(CLOSED_LOOP, Path(folder) / "closed_loop.ssp", GIVEN, files)),
        }
        path = Path(folder) / "order.json"
        path.write_text(json.dumps(order))
        for _ in range(rounds):
            for case, seen in times.items():
                seconds = _timed(case, path, steps)
                if seconds is not None:
                    seen.append(1e6 * seconds)
    print(f"{'us a step':22s} {'median':>8s} {'least':>8s}")
    for case, seen in times.items():
        shown = f"{median(seen):8.1f} {min(seen):8.1f}" if seen else "not installed"
        print(f"{case:22s} {shown}   {CASES[case].__doc__}")
    least = {case: min(seen) for case, seen in times.items() if seen}
    print(
        f"boundary: {least['ours'] - least['models_alone']:.1f} us a step, "
        f"of which {least['empty_units']:.1f} with units that do nothing"
    )
    print(f"real time: {1e6 * STEP / least['ours']:.0f} times")
    against = dict.fromkeys(("fmpy_recording_all", "fmpy_ssp"), "ours_recording_all")
    for other in ("fmpy_per_connection", "fmpy_recording_all", "fmpy_ssp", "libcosimpy", "ecos"):
        if other in least:
            own = against.get(other, "ours")
            print(f"{other} takes {least[other] / least[own]:.2f} times as long as {own}")


def _outputs(kind: str) -> list[str]:
    """Names of a unit's outputs."""
    from fmu_src import unit_class

    return [variable.name for variable in unit_class(kind).variables if variable.causality == "output"]


def _timed(case: str, path: Path, steps: int) -> float | None:
    """Seconds per step of a case in a child process; None where its package is missing."""
    libraries = os.pathsep.join([str(Path(sys.prefix) / "lib"), os.environ.get("LD_LIBRARY_PATH", "")])
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.master_speed", "child", case, str(path), str(steps)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        env={**os.environ, "LD_LIBRARY_PATH": libraries},
        check=False,
    )
    if "ModuleNotFoundError" in done.stderr:
        return None
    for line in done.stdout.splitlines():
        if line.startswith("SECONDS "):
            return float(line.split()[1])
    raise RuntimeError(f"{case} failed: {done.stdout[-500:]}{done.stderr[-1500:]}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["child"]:
        child(*sys.argv[2:])
    main(*(int(text) for text in (*sys.argv[1:], *("10000", "3")[len(sys.argv) - 1 :])))
