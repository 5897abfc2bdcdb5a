"""Other importers run the same units, in Python and native, and agree with the master, each in a process of its own.

The four-unit loop has encoders, dry friction, a reference step and the paper's excitation, 10 000 steps. The units are
deterministic; what differs between importers is how they form the time k H (integer nanoseconds, a running sum, a
product). A running sum of 10 000 steps is off by up to 1e-10 s; the exciter's chirp moves by 2.5 V/s.
"""

import json
import os
import shutil
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from fmu_src import CLOSED_LOOP, OPEN_LOOP, build
from fmu_src.master import run_apart
from fmu_src.ssp import write_ssp
from heli_plant.parameters import TABLE_2
from heli_plant.simulation import simulate
from heli_plant.state import rest_state

HOST = Path(__file__).parent / "hosts" / "importer.py"
STEPS, STEP = 10_000, 0.01
"""Steps of the comparison and their length [s]."""
PARAMETERS = {
    "plant.encoder.enabled": True,
    "plant.effects.dry_friction.pitch": 0.02,
    "controller.reference.step_pitch": 0.2,
    "exciter.excitation.experiment": 2,
    "identifier.method": "adaptation",  # prediction errors amplify differences of the time to 3e-8
}
AGREEMENT = 1e-9
IMPORTERS = [
    ("libcosimpy", "libcosimpy", "ssp"),
    ("ecos", "ecospy", "ssp"),
    ("fmucontainer", "fmu_manipulation_toolbox", "json"),
    ("fmpy_simulate_fmu", "fmpy", "json"),
]
"""Host, the package that it needs, and what it reads."""
QUICK = ("libcosimpy", "fmpy_simulate_fmu")
"""Hosts that run native units each time."""


def files_of(wiring, units):
    return {name: str(units[kind]) for name, kind in wiring.units}


@pytest.fixture(scope="module")
def units(request, fmus, twins):
    return {"python": fmus, "native": twins}[request.param]


@pytest.fixture(scope="module")
def ours(units):
    """The master's result."""
    return run_apart(CLOSED_LOOP, STEPS * STEP, STEP, PARAMETERS, files_of(CLOSED_LOOP, units))


@pytest.fixture(scope="module")
def orders(units, ours, tmp_path_factory):
    """The .ssp, and the same system as JSON for those who build it by an API."""
    folder, files = tmp_path_factory.mktemp("order"), files_of(CLOSED_LOOP, units)
    by_unit = CLOSED_LOOP.parameters_by_unit(PARAMETERS)
    np.save(folder / "record.npy", ours.values)
    order = {
        "fmus": files,
        "parameters": {f"{unit}.{name}": value for unit, given in by_unit.items() for name, value in given.items()},
        "connections": [[w.source_unit, w.source, w.target_unit, w.target] for w in CLOSED_LOOP.connections],
        "record": str(folder / "record.npy"),
    }
    (folder / "order.json").write_text(json.dumps(order))
    ssp = write_ssp(CLOSED_LOOP, folder / "closed_loop.ssp", PARAMETERS, files)
    return {"json": folder / "order.json", "ssp": ssp}


def imported(host, order, steps, names, out):
    """Rows 1 .. steps of ``names`` as the importer shows them, shape (steps, len(names))."""
    libraries = os.pathsep.join([str(Path(sys.prefix) / "lib"), os.environ.get("LD_LIBRARY_PATH", "")])
    done = subprocess.run(
        [sys.executable, str(HOST), host, str(order), str(steps), str(STEP), str(out), *names],
        capture_output=True, text=True, timeout=300, env={**os.environ, "LD_LIBRARY_PATH": libraries}, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return np.load(out)


@pytest.mark.parametrize(
    ("units", "host", "package", "order"),
    [
        pytest.param(kind, *one, marks=[] if kind == "native" and one[0] in QUICK else [pytest.mark.slow])
        for kind in ("python", "native")
        for one in IMPORTERS
    ],
    indirect=["units"],
)
def test_an_importer_agrees_with_the_master_over_10000_steps(units, host, package, order, ours, orders, tmp_path):
    if find_spec(package) is None:
        pytest.skip(f"{package} is not installed (extra 'importers')")
    theirs = imported(host, orders[order], STEPS, ours.names, tmp_path / "rows.npy")
    largest = np.abs(theirs - ours.values[1:]).max()
    print(f"{host}: largest difference {largest:.1e} (docs/toolchains.md)")
    assert largest < AGREEMENT


def test_fmpy_ssp_reads_the_file_and_runs_it_but_for_its_first_step(fmus, tmp_path):
    """fmpy.ssp feeds zeros over the first step; apart from that its plant is ours under the same voltages."""
    ssp = write_ssp(OPEN_LOOP, tmp_path / "open_loop.ssp", {"plant.pitch.gain": 0.25}, files_of(OPEN_LOOP, fmus))
    names = ["exciter.v_front", "exciter.v_rear", "plant.pitch", "plant.elevation", "plant.travel"]
    rows = imported("fmpy_ssp", ssp, 1000, names, tmp_path / "rows.npy")
    held = np.vstack([np.zeros(2), rows[:, :2]])
    _, angles = simulate(held, STEP, rest_state(TABLE_2), TABLE_2._replace(k_x=0.25))
    # fmpy.ssp sums up its steps: H/h is 1 to 1e-13, and so is each inner step
    assert np.abs(rows[:, 2:] - angles[1:]).max() < AGREEMENT


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
def test_fmpy_compiles_a_unit_from_its_sources(tmp_path, fmi):
    if shutil.which("cmake") is None:
        pytest.skip("this machine has no cmake, which fmpy compiles with")
    path = build("HelicopterPlant", tmp_path, fmi=fmi, native=True)
    done = subprocess.run(
        [sys.executable, "-m", "fmpy", "compile", str(path)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    with zipfile.ZipFile(path) as archive:
        assert any(name.endswith("HelicopterPlant.so") for name in archive.namelist())
