"""fmpy.ssp runs the .ssp: fmpy_ssp.py SSP STEPS STEP OUT NAME...

It sets every parameter that the .ssv files give as text, so they are read here and handed over typed. At the first
step it feeds zeros, not the outputs at t_0, and it keeps no row for t_0.
"""

import os
import sys
import zipfile

import fmpy.ssp.simulation as simulation
import numpy as np
from fmpy.ssp.ssd import ParameterSet, read_ssv

ssp, steps, step, out, *names = sys.argv[1:]
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
result = simulation.simulate_ssp(
    ssp,
    stop_time=(int(steps) - 0.5) * float(step),
    step_size=float(step),
    parameter_set=ParameterSet(parameters=parameters),
)
np.save(out, np.column_stack([result[name] for name in names]))
sys.stdout.flush()
os._exit(0)
