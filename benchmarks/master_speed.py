"""Time per communication step of the four-unit closed loop, ours and others', and of each unit's own arithmetic.

Usage: python benchmarks/master_speed.py [STEPS] [ROUNDS]. Everything runs in turn in each round, in a process of its
own; the table gives the median and the smallest of the rounds, in microseconds.
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

STEP = 0.01


def ours(order: dict, steps: int) -> float:
    """Step with the master: prebuilt buffers, three calls per unit; only wired outputs are fetched, as others do."""
    from fmu_src.master import run

    return run("closed_loop", steps * STEP, STEP, {}, order["fmus"], record=()).seconds


def ours_recording_all(order: dict, steps: int) -> float:
    """Step with the master, all 47 outputs recorded at every step."""
    from fmu_src.master import run

    return run("closed_loop", steps * STEP, STEP, {}, order["fmus"]).seconds


def fmpy_per_connection(order: dict, steps: int) -> float:
    """Step the same units by fmpy's own methods, one get and one set per connection."""
    import fmpy
    from fmpy.fmi2 import FMU2Slave

    slaves, references = {}, {}
    for name, fmu in order["fmus"].items():
        description = fmpy.read_model_description(fmu)
        references[name] = {v.name: v.valueReference for v in description.modelVariables}
        slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=fmpy.extract(fmu),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        slave.instantiate()
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        slaves[name] = slave
    wires = [
        (slaves[source], [references[source][output]], slaves[target], [references[target][input_]])
        for source, output, target, input_ in order["connections"]
    ]
    began = time.perf_counter()
    for k in range(steps):
        values = [source.getReal(output) for source, output, _, _ in wires]
        for (_, _, target, input_), value in zip(wires, values, strict=True):
            target.setReal(input_, value)
        for slave in slaves.values():
            slave.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)
    return time.perf_counter() - began


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
    from fmu_src.builder import unit_class
    from fmu_src.wiring import CLOSED_LOOP

    units = {}
    for name, kind in CLOSED_LOOP.units:
        unit = unit_class(kind)(instance_name=name, resources="")
        unit.setup_experiment(0.0)
        unit.enter_initialization_mode()
        unit.exit_initialization_mode()
        units[name] = unit
    wires = [
        (units[w.source_unit].reals, units[w.source_unit].references[w.source],
         units[w.target_unit].reals, units[w.target_unit].references[w.target])
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


def _do_step(order: dict, steps: int, unit: str, parameters: dict) -> float:
    """Time fmi2DoStep of one unit through the boundary, by a ready pointer."""
    import numpy as np

    from fmu_src.master.instance import Instance, address

    instance = Instance("unit", Path(order["units"][unit]))
    instance.initialise(parameters, 0.0, steps * STEP)
    inputs = [name for name, v in instance.variables.items() if v.causality == "input"]
    fed, shown = np.full(max(len(inputs), 1), 0.8), np.zeros(len(instance.outputs))
    instance.bind(inputs, instance.outputs, address(fed), address(shown))
    instance.finish_initialisation(0.0)
    instance.put(0.0)
    began = time.perf_counter()
    for k in range(steps):
        instance.step(k * STEP, STEP)
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
        fmpy_per_connection,
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
    from fmu_src.builder import build_all
    from fmu_src.ssp import write_ssp
    from fmu_src.wiring import CLOSED_LOOP

    times: dict[str, list[float]] = {case: [] for case in CASES}
    with TemporaryDirectory() as folder:
        built = build_all(folder)
        files = {name: str(built[kind]) for name, kind in CLOSED_LOOP.units}
        order = {
            "fmus": files,
            "units": {name: str(path) for name, path in built.items()},
            "connections": [[w.source_unit, w.source, w.target_unit, w.target] for w in CLOSED_LOOP.connections],
            "ssp": str(write_ssp(CLOSED_LOOP, Path(folder) / "closed_loop.ssp", fmus=files)),
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
    print(f"boundary: {least['ours'] - least['models_alone']:.1f} us a step")
    print(f"real time: {1e6 * STEP / least['ours']:.0f} times")
    for other in ("fmpy_per_connection", "libcosimpy", "ecos"):
        if other in least:
            print(f"{other} takes {least[other] / least['ours']:.2f} times as long as the master")


def _timed(case: str, path: Path, steps: int) -> float | None:
    """Seconds per step of a case in a child process; None where its package is missing."""
    libraries = os.pathsep.join([str(Path(sys.prefix) / "lib"), os.environ.get("LD_LIBRARY_PATH", "")])
    done = subprocess.run(
        [sys.executable, __file__, "child", case, str(path), str(steps)],
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
