"""What benchmarks read out of a native identifier's serialised state is what the unit in Python remembers."""

import subprocess
import sys

from tests.native_builds import needs_a_compiler

SCRIPT = """
import os, sys
from pathlib import Path
from benchmarks.native_memory import identifier_state
from fmu_src import build
from fmu_src.master.instance import Instance
from fmu_src.native import build_native

folder, states = Path(sys.argv[1]), []
for builder in (build, build_native):
    fmu = builder("AdaptiveIdentifier", folder / builder.__name__)
    unit = Instance("unit", fmu, folder / f"{builder.__name__}.d", [])
    given = {"method": "prediction_error", "watch.pitch": "dry_friction"}
    unit.initialise(given, 0.0, 9.0)
    unit.finish_initialisation(0.0)
    for k in range(400):
        angles = [0.3 * ((k % 90) / 90.0 - 0.5), 0.1, 0.01 * k]
        unit.slave.setReal(list(range(5)), [1.0, 1.0 + 0.3 * (k % 7), *angles])
        unit.slave.doStep(k * 0.01, 0.01)
    states.append(identifier_state(unit))
assert states[0].samples == 399, states[0].samples
assert states[0] == states[1]
print("same")
sys.stdout.flush()
os._exit(0)  # pythonfmu's library may abort while the interpreter ends
"""


def test_the_state_of_a_native_identifier_is_that_of_the_unit_in_python_to_the_bit(tmp_path):
    needs_a_compiler()
    done = subprocess.run([sys.executable, "-c", SCRIPT, str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "same", done.stderr[-2000:]
