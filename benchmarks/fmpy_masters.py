"""Masters on the four-unit loop that fmpy has or that its users write, for comparison with the project's own master.

Each takes an order (FMU files by unit, connections, parameters by unit, output names by unit, an .ssp file) and a
number of steps, and returns the wall seconds of the steps.
"""

import time
from types import SimpleNamespace

STEP = 0.01
"""Communication step [s]."""


def fmpy_per_connection(order: dict, steps: int) -> float:
    """Step the same units by fmpy's own methods, one get and one set per connection, nothing recorded."""
    slaves, references = _fmpy_slaves(order)
    wires = _wires_by_reference(order, slaves, references)
    began = time.perf_counter()
    for k in range(steps):
        _per_connection(slaves, wires, k)
    return time.perf_counter() - began


def fmpy_recording_all(order: dict, steps: int) -> float:
    """Step the same way, all 47 outputs recorded by one fmpy get per unit, as fmpy's own recorder does it."""
    slaves, references = _fmpy_slaves(order)
    wires = _wires_by_reference(order, slaves, references)
    shown = [(slave, [references[name][output] for output in order["outputs"][name]]) for name, slave in slaves.items()]
    rows = []
    began = time.perf_counter()
    for k in range(steps):
        _per_connection(slaves, wires, k)
        row = [(k + 1) * STEP]
        for slave, outputs in shown:
            row.extend(slave.getReal(outputs))
        rows.append(tuple(row))
    return time.perf_counter() - began


def fmpy_ssp(order: dict, steps: int) -> float:
    """Step with fmpy's own master for .ssp files: a set per input, a get per output, all 47 recorded."""
    from fmpy.ssp.simulation import simulate_ssp

    # parameters as this master wants them: it reads none from the .ssp file
    given = [
        SimpleNamespace(name=f"{unit}.{name}", value=value)
        for unit, own in order["parameters"].items()
        for name, value in own.items()
    ]

    def run(count: int) -> float:
        began = time.perf_counter()
        stop = (count - 0.5) * STEP
        simulate_ssp(order["ssp"], stop_time=stop, step_size=STEP, parameter_set=SimpleNamespace(parameters=given))
        return time.perf_counter() - began

    loading = min(run(1) for _ in range(3))
    return run(steps) - loading


def _fmpy_slaves(order: dict) -> tuple[dict, dict]:
    """Instances of the four units by name, ready to step, and the references of their variables."""
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
        for parameter, value in order["parameters"].get(name, {}).items():
            slave.setReal([references[name][parameter]], [value])
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        slaves[name] = slave
    return slaves, references


def _wires_by_reference(order: dict, slaves: dict, references: dict) -> list[tuple]:
    return [
        (slaves[source], [references[source][output]], slaves[target], [references[target][input_]])
        for source, output, target, input_ in order["connections"]
    ]


def _per_connection(slaves: dict, wires: list[tuple], k: int) -> None:
    """Take step ``k``: every connection by a get and a set of its own, then every unit's step."""
    values = [source.getReal(output) for source, output, _, _ in wires]
    for (_, _, target, input_), value in zip(wires, values, strict=True):
        target.setReal(input_, value)
    for slave in slaves.values():
        slave.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)
