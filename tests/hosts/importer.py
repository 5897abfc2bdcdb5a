"""Run units in another importer and save what they show: importer.py HOST ORDER STEPS STEP OUT NAME... ORDER is an
.ssp, or JSON with the units' FMUs, parameters and connections and the master's record (.npy, rows 0 to STEPS of the
NAMEs, which are unit.variable). OUT becomes an .npy with rows 1 to STEPS. The process leaves at once."""

import json
import os
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np


def parted(full):
    """Unit and variable."""
    unit, _, variable = full.partition(".")
    return unit, variable


def libcosimpy(ssp, steps, step, names):
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    execution = CosimExecution.from_ssp_file(ssp, round(step * 1e9))
    observer = CosimObserver.create_last_value()
    assert execution.add_observer(observer)
    wanted = {}
    for column, name in enumerate(names):
        unit, variable = parted(name)
        index = execution.slave_index_from_instance_name(unit)
        columns, wished = wanted.setdefault(index, ([], []))
        columns.append(column)
        wished.append({v.name.decode(): v.reference for v in execution.slave_variables(index)}[variable])
    rows = np.empty((steps, len(names)))
    for row in rows:
        assert execution.step()
        for index, (columns, wished) in wanted.items():
            row[columns] = observer.last_real_values(index, wished)
    return rows


def ecos(ssp, steps, step, names):
    from ecospy import EcosSimulation

    simulation, rows = EcosSimulation(step, ssp_path=ssp), np.empty((steps, len(names)))
    simulation.init(0.0, "parameters")
    for row in rows:
        simulation.step()
        row[:] = [simulation.get_real(name.replace(".", "::", 1)) for name in names]
    return rows


def fmucontainer(order, steps, step, names):
    import fmpy

    folder = Path(tempfile.mkdtemp())
    for unit, fmu in order["fmus"].items():
        (folder / f"{unit}.fmu").write_bytes(Path(fmu).read_bytes())
    # the container names its own locals unit.variable, so the outputs need names of their own
    container = {
        "name": "scenario.fmu",
        "fmu": [f"{unit}.fmu" for unit in order["fmus"]],
        "link": [[f"{source}.fmu", out, f"{target}.fmu", fed] for source, out, target, fed in order["connections"]],
        "output": [[f"{parted(name)[0]}.fmu", parted(name)[1], f"shown.{name}"] for name in names],
        "start": [[f"{parted(k)[0]}.fmu", parted(k)[1], value] for k, value in order["parameters"].items()],
        **dict.fromkeys(("auto_input", "auto_output", "auto_link"), False),
    }
    (folder / "scenario.json").write_text(json.dumps(container))
    command = [str(Path(sys.executable).parent / "fmucontainer"), "-fmu-directory", str(folder)]
    subprocess.run([*command, "-container", f"scenario.json:{step}"], check=True)
    result = fmpy.simulate_fmu(
        str(folder / "scenario.fmu"), stop_time=steps * step, output_interval=step, step_size=step,
        output=[f"shown.{name}" for name in names], validate=False,
    )  # fmt: skip
    return np.column_stack([result[f"shown.{name}"] for name in names])[1:]


def fmpy_simulate_fmu(order, steps, step, names):
    """Each unit alone, fed with what the master recorded."""
    import fmpy

    record = dict(zip(names, np.load(order["record"]).T, strict=True))
    shown = {}
    for unit, fmu in order["fmus"].items():
        wires = [(f"{source}.{output}", fed) for source, output, target, fed in order["connections"] if target == unit]
        signals = np.zeros(steps + 1, dtype=[("time", float), *((fed, float) for _, fed in wires)])
        signals["time"] = np.arange(steps + 1) * step
        for source, fed in wires:
            signals[fed] = record[source]
        names_of_unit = [name for name in names if parted(name)[0] == unit]
        result = fmpy.simulate_fmu(
            fmu, stop_time=steps * step, output_interval=step, input=signals if wires else None,
            start_values={parted(k)[1]: value for k, value in order["parameters"].items() if parted(k)[0] == unit},
            output=[parted(name)[1] for name in names_of_unit],
        )  # fmt: skip
        shown |= {name: result[parted(name)[1]][1 : steps + 1] for name in names_of_unit}
    return np.column_stack([shown[name] for name in names])


def fmpy_ssp(ssp, steps, step, names):
    """It sets every parameter of the .ssv files as text, so they are read here and handed over typed. At the first step
    it feeds zeros, not the outputs at t_0, and it keeps no row for t_0."""
    import fmpy.ssp.simulation as simulation
    from fmpy.ssp.ssd import ParameterSet, read_ssv

    parameters = []
    with zipfile.ZipFile(ssp) as archive:
        sets = [name for name in archive.namelist() if name.endswith(".ssv")]
    for resource in sets:
        unit = resource.removeprefix("resources/").removesuffix(".ssv")
        for parameter in read_ssv(ssp, resource).parameters:
            if parameter.type != "String":
                value = parameter.value == "true" if parameter.type == "Boolean" else float(parameter.value)
                parameter.name, parameter.value = f"{unit}.{parameter.name}", value
                parameters.append(parameter)
    given = ParameterSet(parameters=parameters)
    result = simulation.simulate_ssp(ssp, stop_time=(steps - 0.5) * step, step_size=step, parameter_set=given)
    return np.column_stack([result[name] for name in names])


if __name__ == "__main__":
    host, path, count, length, out, *shown_names = sys.argv[1:]
    given = json.loads(Path(path).read_text()) if path.endswith(".json") else path
    np.save(out, globals()[host](given, int(count), float(length), shown_names))
    sys.stdout.flush()
    os._exit(0)
