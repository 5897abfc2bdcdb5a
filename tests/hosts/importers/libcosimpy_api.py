"""libcosim builds the system by its API: libcosimpy_api.py ORDER STEPS STEP OUT NAME... (ORDER is JSON)."""

import json
import sys

from cosim_recording import record, references
from libcosimpy import CosimConstants
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimSlave import CosimLocalSlave

path, steps, step, out, *names = sys.argv[1:]
with open(path) as file:
    order = json.load(file)
execution = CosimExecution.from_step_size(round(float(step) * 1e9))
slaves = {}
for name, fmu in order["fmus"].items():
    slaves[name] = execution.add_local_slave(CosimLocalSlave(fmu, name))
known = {name: references(execution, index) for name, index in slaves.items()}
for full, value in order["parameters"].items():
    unit, _, variable = full.partition(".")
    kind = {bool: "boolean", int: "integer", float: "real", str: "string"}[type(value)]
    set_initial = getattr(execution, f"{kind}_initial_value")
    assert set_initial(slaves[unit], known[unit][variable], value), full
for source, output, target, input_ in order["connections"]:
    wire = slaves[source], known[source][output], slaves[target], known[target][input_]
    assert execution.connect_real_variables(*wire) == CosimConstants.success
record(execution, int(steps), out, names)
