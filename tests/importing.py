"""What the tests with other importers share: the order of the four-unit loop, the importers, a run in one of them.

The loop has encoders, dry friction, a reference step and the paper's excitation, 10 000 steps. The units are
deterministic; what differs between importers is how they form the time k H (integer nanoseconds, a running sum, a
product). A running sum of 10 000 steps is off by up to 1e-10 s; the exciter's chirp moves by 2.5 V/s.
"""

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from fmu_src import CLOSED_LOOP

HOST = Path(__file__).parent / "hosts" / "importer.py"
STEPS, STEP = 10_000, 0.01
PARAMETERS = {
    "plant.encoder.enabled": True,
    "plant.effects.dry_friction.pitch": 0.02,
    "controller.reference.step_pitch": 0.2,
    "exciter.excitation.experiment": 2,
    "identifier.method": "adaptation",  # prediction errors amplify differences of the time to 3e-8
}
AGREEMENT = 1e-9
IMPORTERS = [
    ("libcosimpy_api", "libcosimpy", "json"),
    ("libcosimpy_ssp", "libcosimpy", "ssp"),
    ("ecos_api", "ecospy", "json"),
    ("ecos_ssp", "ecospy", "ssp"),
    ("fmucontainer", "fmu_manipulation_toolbox", "json"),
    ("fmpy_simulate_fmu", "fmpy", "json"),
]
"""Host, the package that it needs, and what it reads."""


def files_of(wiring, fmus):
    return {name: str(fmus[kind]) for name, kind in wiring.units}


def written_order(folder, fmus, ours):
    """The closed loop as JSON for those who build it by an API; ``ours`` is the master's result."""
    by_unit = CLOSED_LOOP.parameters_by_unit(PARAMETERS)
    np.save(folder / "record.npy", ours.values)
    order = {
        "fmus": files_of(CLOSED_LOOP, fmus),
        "parameters": {f"{unit}.{name}": value for unit, given in by_unit.items() for name, value in given.items()},
        "connections": [[w.source_unit, w.source, w.target_unit, w.target] for w in CLOSED_LOOP.connections],
        "record": str(folder / "record.npy"),
    }
    (folder / "order.json").write_text(json.dumps(order))
    return folder / "order.json"


def imported(host, order, steps, names, out):
    """Rows 1 .. steps of ``names`` as the importer shows them, shape (steps, len(names))."""
    libraries = os.pathsep.join([str(Path(sys.prefix) / "lib"), os.environ.get("LD_LIBRARY_PATH", "")])
    done = subprocess.run(
        [sys.executable, str(HOST), host, str(order), str(steps), str(STEP), str(out), *names],
        capture_output=True, text=True, timeout=300, env={**os.environ, "LD_LIBRARY_PATH": libraries}, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return np.load(out)


def check_agreement(host, package, order, ours, folder):
    """Run the order in an importer; the test is skipped if it is not installed. Returns the largest difference."""
    if find_spec(package) is None:
        pytest.skip(f"{package} is not installed (extra 'importers')")
    theirs = imported(host, order, STEPS, ours.names, folder / "rows.npy")
    largest = np.abs(theirs - ours.values[1:]).max()
    print(f"{host}: largest difference {largest:.1e} (docs/toolchains.md)")
    assert largest < AGREEMENT
    return largest
