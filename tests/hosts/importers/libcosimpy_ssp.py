"""libcosim imports the .ssp: importers/libcosimpy_ssp.py SSP STEPS STEP OUT NAME... (names are unit.variable)."""

import sys

from cosim_recording import record
from libcosimpy.CosimExecution import CosimExecution

ssp, steps, step, out, *names = sys.argv[1:]
record(CosimExecution.from_ssp_file(ssp, round(float(step) * 1e9)), int(steps), out, names)
