"""Other importers run the native loop and agree with the master; its compiled loop agrees with its tape.

The order is that of the pythonfmu units (tests/importing.py).
"""

import shutil
import subprocess
import sys
import zipfile

import numpy as np
import pytest

from fmu_src import CLOSED_LOOP, OPEN_LOOP, MasterError
from fmu_src.master import run_apart
from fmu_src.native import build_native
from fmu_src.ssp import write_ssp
from tests.importing import IMPORTERS, PARAMETERS, STEP, STEPS, check_agreement, files_of, written_order

LONG = 100_000
"""Steps from which on the master's loop is compiled."""


@pytest.fixture(scope="module")
def ours(twins):
    return run_apart(CLOSED_LOOP, STEPS * STEP, STEP, PARAMETERS, files_of(CLOSED_LOOP, twins))


@pytest.fixture(scope="module")
def orders(twins, ours, tmp_path_factory):
    folder = tmp_path_factory.mktemp("order")
    return {
        "json": written_order(folder, twins, ours),
        "ssp": write_ssp(CLOSED_LOOP, folder / "closed_loop.ssp", PARAMETERS, native=True),
    }


def test_the_master_gets_the_same_bits_from_native_and_pythonfmu_units(fmus, ours):
    theirs = run_apart(CLOSED_LOOP, STEPS * STEP, STEP, PARAMETERS, files_of(CLOSED_LOOP, fmus))
    assert ours.names == theirs.names
    assert np.array_equal(ours.values, theirs.values)


def test_the_compiled_loop_gets_the_bits_of_the_tape(ours, twins):
    compiled = run_apart(CLOSED_LOOP, LONG * STEP, STEP, PARAMETERS, files_of(CLOSED_LOOP, twins))
    assert np.array_equal(compiled.values[: STEPS + 1], ours.values)
    print(f"compiled loop {1e6 * compiled.seconds / LONG:.1f} us a step, tape {1e6 * ours.seconds / STEPS:.1f} us")


def test_the_compiled_loop_says_which_unit_refused_and_why(twins):
    """A plant without gravity that is driven by a huge gain leaves the finite range."""
    parameters = {"plant.pitch.damping": -10.0, "plant.pitch.stiffness": 0.0, "controller.pitch.derivative": 0.0}
    with pytest.raises(MasterError, match=r"doStep at t = .* answered discard: doStep: .*finite|must lie in"):
        run_apart(OPEN_LOOP, LONG * STEP, STEP, {k: v for k, v in parameters.items() if k.startswith("plant")},
                  files_of(OPEN_LOOP, twins))  # fmt: skip


@pytest.mark.parametrize(
    ("host", "package", "order"),
    [
        pytest.param(*one, marks=[pytest.mark.slow] if one[0] not in ("libcosimpy_api", "fmpy_simulate_fmu") else [])
        for one in IMPORTERS
    ],
)
def test_an_importer_agrees_with_the_master_over_10000_steps(host, package, order, ours, orders, tmp_path):
    check_agreement(host, package, orders[order], ours, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
def test_fmpy_compiles_a_unit_from_its_sources(tmp_path, fmi):
    if shutil.which("cmake") is None:
        pytest.skip("this machine has no cmake, which fmpy compiles with")
    path = build_native("HelicopterPlant", tmp_path, fmi=fmi)
    done = subprocess.run(
        [sys.executable, "-m", "fmpy", "compile", str(path)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    with zipfile.ZipFile(path) as archive:
        assert any(name.endswith("HelicopterPlant.so") for name in archive.namelist())
