"""Each unit alone under fmpy.simulate_fmu, fed with what the master recorded: ORDER STEPS STEP OUT NAME...

ORDER (JSON) names the record (.npy, rows 0 .. steps of the NAMEs).
"""

import json
import os
import sys

import fmpy
import numpy as np

path, steps, step, out, *names = sys.argv[1:]
with open(path) as file:
    order = json.load(file)
steps, step = int(steps), float(step)
record = dict(zip(names, np.load(order["record"]).T, strict=True))
shown = {}
for unit, fmu in order["fmus"].items():
    wires = [
        (f"{source}.{output}", input_) for source, output, target, input_ in order["connections"] if target == unit
    ]
    fed = np.zeros(steps + 1, dtype=[("time", float), *((input_, float) for _, input_ in wires)])
    fed["time"] = np.arange(steps + 1) * step
    for source, input_ in wires:
        fed[input_] = record[source]
    own = [name for name in names if name.startswith(f"{unit}.")]
    parameters = {
        name.partition(".")[2]: value for name, value in order["parameters"].items() if name.startswith(f"{unit}.")
    }
    result = fmpy.simulate_fmu(
        fmu,
        stop_time=steps * step,
        output_interval=step,
        start_values=parameters,
        input=fed if wires else None,
        output=[name.partition(".")[2] for name in own],
    )
    for name in own:
        shown[name] = result[name.partition(".")[2]][1 : steps + 1]
np.save(out, np.column_stack([shown[name] for name in names]))
sys.stdout.flush()
os._exit(0)
