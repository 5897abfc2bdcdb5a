"""Ecos imports the .ssp: ecos_ssp.py SSP STEPS STEP OUT NAME... (names are unit.variable)."""

import sys

from ecos_recording import record
from ecospy import EcosSimulation

ssp, steps, step, out, *names = sys.argv[1:]
record(EcosSimulation(float(step), ssp_path=ssp), int(steps), out, names, "parameters")
