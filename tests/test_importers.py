"""Other importers run the same units and agree with the master, each in a process of its own."""

import numpy as np
import pytest

from fmu_src import CLOSED_LOOP, OPEN_LOOP
from fmu_src.master import run_apart
from fmu_src.ssp import write_ssp
from heli_plant.parameters import TABLE_2
from heli_plant.simulation import simulate
from heli_plant.state import rest_state
from tests.importing import (
    AGREEMENT,
    IMPORTERS,
    PARAMETERS,
    STEP,
    STEPS,
    check_agreement,
    files_of,
    imported,
    written_order,
)


@pytest.fixture(scope="module")
def ours(fmus):
    return run_apart(CLOSED_LOOP, STEPS * STEP, STEP, PARAMETERS, files_of(CLOSED_LOOP, fmus))


@pytest.fixture(scope="module")
def orders(fmus, ours, tmp_path_factory):
    """The .ssp, and the same system as JSON for those who build it by an API."""
    folder = tmp_path_factory.mktemp("order")
    return {
        "json": written_order(folder, fmus, ours),
        "ssp": write_ssp(CLOSED_LOOP, folder / "closed_loop.ssp", PARAMETERS, files_of(CLOSED_LOOP, fmus)),
    }


@pytest.mark.slow
@pytest.mark.parametrize(("host", "package", "order"), IMPORTERS)
def test_an_importer_agrees_with_the_master_over_10000_steps(host, package, order, ours, orders, tmp_path):
    check_agreement(host, package, orders[order], ours, tmp_path)


def test_fmpy_ssp_reads_the_file_and_runs_it_but_for_its_first_step(fmus, tmp_path):
    """fmpy.ssp feeds zeros over the first step; apart from that its plant is ours under the same voltages."""
    ssp = write_ssp(OPEN_LOOP, tmp_path / "open_loop.ssp", {"plant.pitch.gain": 0.25}, files_of(OPEN_LOOP, fmus))
    names = ["exciter.v_front", "exciter.v_rear", "plant.pitch", "plant.elevation", "plant.travel"]
    rows = imported("fmpy_ssp", ssp, 1000, names, tmp_path / "rows.npy")
    held = np.vstack([np.zeros(2), rows[:, :2]])
    _, angles = simulate(held, STEP, rest_state(TABLE_2), TABLE_2._replace(k_x=0.25))
    # fmpy.ssp sums up its steps: H/h is 1 to 1e-13, and so is each inner step
    assert np.abs(rows[:, 2:] - angles[1:]).max() < AGREEMENT
