"""Ecos builds the system by its API: ecos_api.py ORDER STEPS STEP OUT NAME... (ORDER is JSON)."""

import json
import sys

from ecos_recording import record
from ecospy import EcosSimulation, EcosSimulationStructure

path, steps, step, out, *names = sys.argv[1:]
with open(path) as file:
    order = json.load(file)
structure = EcosSimulationStructure()
for name, fmu in order["fmus"].items():
    structure.add_model(name, fmu)
for source, output, target, input_ in order["connections"]:
    structure.make_real_connection(f"{source}::{output}", f"{target}::{input_}")
structure.add_parameter_set("given", {k.replace(".", "::", 1): v for k, v in order["parameters"].items()})
record(EcosSimulation(float(step), structure=structure), int(steps), out, names, "given")
