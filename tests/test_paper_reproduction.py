"""`heli paper` in small: runs of the units, all files or none, and sentences with the figures of the tables."""

import csv

import numpy as np
import pytest

from heli_identifier.errors import ConfigurationError
from heli_identifier.online import IdentifierSettings
from heli_identifier.workbench.paper import Extent, reproduce
from heli_identifier.workbench.paper.closed_loop import PLANT, STEP_SIZE, STEP_TIME, closed_loops
from heli_identifier.workbench.paper.published import TRUTH
from heli_identifier.workbench.paper.replay import replay
from heli_identifier.workbench.paper.runs import (
    FREE,
    INITIAL_ESTIMATES,
    JOINT_RUN,
    KNOWN,
    PITCH_RUN,
    STEP,
    Kind,
    order_of,
    run_once,
    twelve_starts,
)

SHORT_PITCH = Kind(PITCH_RUN.name, PITCH_RUN.channel, PITCH_RUN.base, 40.0, PITCH_RUN.identifiers)
SHORT_JOINT = Kind(JOINT_RUN.name, JOINT_RUN.channel, JOINT_RUN.base, 40.0, JOINT_RUN.identifiers)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The reproduction with two starts of 40 s each, Gamma(0) = 1e5 and 1e6."""
    told = []
    extent = Extent(SHORT_PITCH, SHORT_JOINT, starts=(3, 12), effects=(), correlation_times=())
    folder = tmp_path_factory.mktemp("paper") / "new"
    return reproduce(folder, lambda *what: told.append(what), extent), folder, told


def test_all_tables_and_figures_are_there(made):
    reproduction, folder, told = made
    names = {file.name for file in folder.iterdir()}
    assert names == {file.name for file in reproduction.files}
    assert {"table1.csv", "table1_runs.csv", "table2.csv", "recovery.csv", "spread.csv", "within.csv"} <= names
    assert {"figure2_experiment1.svg", "figure3.svg", "figure4.svg", "figure5_experiment2.svg"} <= names
    assert {f"figure{n}.csv" for n in (2, 3, 4, 5)} <= names
    assert told[-1] == (8, 8, "runs of the units")
    assert reproduction.seconds > 0.0


def test_the_pitch_is_recovered_within_a_percent_after_forty_seconds(made):
    _, folder, _ = made
    with (folder / "table1.csv").open() as file:
        rows = list(csv.DictReader(file))
    # Thirty seconds of adaptation hold a seventh of the information of two hundred, which leave some .05 %: .35 %,
    # and a margin for the chance of two starts.
    assert max(float(row["largest deviation [%]"]) for row in rows) < 1.0


def test_the_model_of_experiment_1_follows_experiment_2(made):
    _, folder, _ = made
    data = np.loadtxt(folder / "figure3.csv", delimiter=",", skiprows=1)
    assert np.abs(data[:, 1]).max() > 0.5
    # A percent of the motion, which is near 1 rad, and half a count of the encoder (.8 mrad).
    assert np.abs(data[:, 1] - data[:, 2]).max() < 0.01 + 8e-4


def test_the_sentences_name_their_tables_and_figures(made):
    text = " ".join(made[0].sentences)
    for word in ("Table 1", "Table 2", "Figure 3", "Figure 4", "Spread between the paper's experiments"):
        assert word in text


def test_a_file_in_the_place_of_the_folder_is_refused_before_anything_runs(tmp_path):
    place = tmp_path / "taken"
    place.write_text("")
    with pytest.raises(ConfigurationError, match="is a file, a folder is needed there"):
        reproduce(place)


def test_the_units_estimate_what_the_library_estimates_from_the_same_record(fmus):
    """The twin identifiers of a run are two replays of one record, with theta0 known and estimated."""
    from fmu_src.master import run_apart

    start = twelve_starts(1)[6]
    kind = Kind("pitch", 1, 0.5, 20.0, (KNOWN, FREE))
    run = run_once(kind, 1, start, fmus)
    order = {name: value for name, value in order_of(kind, 1, start).items() if name.startswith(("exciter", "plant"))}
    files = {"exciter": fmus["Exciter"], "plant": fmus["HelicopterPlant"], "identifier": fmus["AdaptiveIdentifier"]}
    record = run_apart("open_loop", kind.duration, STEP, order, files)
    held = record.columns("plant.pitch", "plant.elevation", "plant.travel")
    voltages = record.columns("exciter.v_front", "exciter.v_rear")
    for name, rest_angle in ((KNOWN, TRUTH.theta0), (FREE, None)):
        settings = IdentifierSettings(
            rest_angle=rest_angle,
            initial_gain=start.gain,
            gain_limit=start.gain,
            initial=INITIAL_ESTIMATES[start.omega],
        )
        expected = replay(voltages[:-1], held[:-1], settings, every=100).final
        # Outputs at t_k have used the samples before it; compiled sums may round differently.
        assert run.final(name)[:4] == pytest.approx(expected[:4], rel=1e-6)


def test_the_closed_loop_settles_at_the_step_whatever_the_model(fmus):
    heavier = TRUTH._replace(a_th=0.9 * TRUTH.a_th, k_x=0.9 * TRUTH.k_x)
    time, responses = closed_loops({"model": heavier}, fmus)
    for response in responses.values():
        # The integral's pole near .5 1/s leaves exp(-10) of the step; the encoder keeps the loop within two counts.
        assert response[-1, 0] == pytest.approx(STEP_SIZE, abs=4e-3)
        assert np.abs(response[time < STEP_TIME - 1.0, 0][-100:]).max() < 4e-3
    # A tenth less gain is seen in the transient, at some percent of the step.
    difference = np.abs(responses["model"][:, 0] - responses[PLANT][:, 0]).max()
    assert 2e-3 < difference < 0.05
