"""One FMU of the whole scenario by fmucontainer, run by fmpy: fmucontainer.py ORDER STEPS STEP OUT NAME..."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import fmpy
import numpy as np

path, steps, step, out, *names = sys.argv[1:]
with open(path) as file:
    order = json.load(file)
folder = Path(tempfile.mkdtemp())
for unit, fmu in order["fmus"].items():
    (folder / f"{unit}.fmu").write_bytes(Path(fmu).read_bytes())
# the container names its own locals unit.variable, so the outputs need names of their own
container = {
    "name": "scenario.fmu",
    "fmu": [f"{unit}.fmu" for unit in order["fmus"]],
    "link": [
        [f"{source}.fmu", output, f"{target}.fmu", input_] for source, output, target, input_ in order["connections"]
    ],
    "output": [[f"{name.partition('.')[0]}.fmu", name.partition(".")[2], f"shown.{name}"] for name in names],
    "start": [[f"{k.partition('.')[0]}.fmu", k.partition(".")[2], value] for k, value in order["parameters"].items()],
    "auto_input": False,
    "auto_output": False,
    "auto_link": False,
}
(folder / "scenario.json").write_text(json.dumps(container))
command = [str(Path(sys.executable).parent / "fmucontainer"), "-fmu-directory", str(folder)]
subprocess.run([*command, "-container", f"scenario.json:{step}"], check=True)
result = fmpy.simulate_fmu(
    str(folder / "scenario.fmu"),
    stop_time=int(steps) * float(step),
    output_interval=float(step),
    step_size=float(step),
    output=[f"shown.{name}" for name in names],
    validate=False,
)
np.save(out, np.column_stack([result[f"shown.{name}"] for name in names])[1:])
sys.stdout.flush()
os._exit(0)
