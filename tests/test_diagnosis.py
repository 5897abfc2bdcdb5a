"""The whole diagnosis on the three rigs that come with the package, whose truth is known, and on a false friend."""

import json
import os

import numpy as np
import pytest

from heli_identifier.errors import LogError
from heli_identifier.online import ModelParameters
from heli_identifier.records import demo_files, demo_logs
from heli_identifier.results import Determination, RigVerdict, Use, Verdict, diagnose
from heli_plant.parameters import TABLE_2
from tests.commands import HELI, run_python
from tests.faults.case import ROOT
from tests.simulated import drive, noisy_log

pytestmark = pytest.mark.slow

RIGS = ("rig-a", "rig-b", "rig-c")
TRUTH = {"rig-a": ("dry_friction", "pitch", 0.025), "rig-b": ("quadratic_thrust", "rotors", 0.10)}


@pytest.fixture(scope="module")
def diagnosed():
    """Diagnoses of the three rigs; the share of the work that is reported only grows."""
    results = {}
    for rig in RIGS:
        training, held_out = demo_logs(rig)
        shares = []
        results[rig] = diagnose(
            training, held_out=held_out, progress=lambda what, share, seen=shares: seen.append(share)
        )
        assert np.all(np.diff([0.0, *shares, 1.0]) >= 0.0)
    return results


@pytest.mark.parametrize("rig", TRUTH)
def test_the_effect_that_the_rig_holds_is_found_alone_and_held_out_logs_are_likelier_with_it(diagnosed, rig):
    result, (name, axis, size) = diagnosed[rig], TRUTH[rig]
    assert result.verdict == RigVerdict.EFFECTS_SHOWN
    (found,) = result.effects
    assert (found.name, found.axis, found.verdict, found.alternatives) == (name, axis, Verdict.SHOWN, ())
    # the project's bar is 15 %; the interval is tighter, and four standard errors hold the truth
    assert found.coefficient.value == pytest.approx(size, rel=0.15)
    assert abs(found.coefficient.value - size) < 4.0 * found.coefficient.standard_error
    assert result.held_out.gain.low > 0.0
    # where the effect acts most: beyond the chance that the intervals state
    driven = result.axes["pitch" if rig == "rig-a" else "elevation"]
    assert driven.after.prediction_1s.high < driven.before.prediction_1s.low


def test_a_rig_that_holds_nothing_is_accused_of_nothing(diagnosed):
    result = diagnosed["rig-c"]
    assert (result.verdict, result.effects) == (RigVerdict.MODEL_ADEQUATE, ())
    # what is only possible is no finding, and logs that were left out want it
    assert all(found.left_out_gain > 0.0 for found in result.possible if found.in_plant)


@pytest.mark.parametrize("rig", RIGS)
def test_gains_of_a_calm_rig_are_fit_for_a_controller_and_parameters_are_the_delivered_plants(diagnosed, rig):
    result = diagnosed[rig]
    assert (result.closed_loop, result.references) == (False, "voltages")
    for name, axis in (("k_x", "pitch"), ("k_z", "elevation"), ("k_y", "travel")):
        report = result.parameters[name]
        assert report.determination is Determination.OUTSIDE and not report.contradicted
        assert abs(report.instrument.value - report.estimate.value) < 0.05 * abs(report.estimate.value)
        assert result.axes[axis].use is Use.CONTROL
    # the fit has slopes in place of gains, and of a_1 what is beyond the lift; what is stated is the plant's own
    reports = {name: own.estimate for name, own in result.parameters.items() if name not in ("k_x", "k_z", "k_y")}
    for plant, listed in (
        (result.plant_before, result.parameters_before), (result.plant_after, result.parameters_after | reports),
    ):  # fmt: skip
        assert set(listed) >= {*ModelParameters._fields, "T_m"}
        for name in (*ModelParameters._fields, "T_m"):
            assert listed[name].value == pytest.approx(getattr(plant, name), abs=1e-12), name
    assert {*ModelParameters._fields} <= {*result.parameters}
    # a larger gain beside a larger damping explains about the same: their errors go together, or not at all
    i, j = map(result.covariance_fields.index, ("k_y", "a_wy"))  # k_y is negative
    assert result.covariance[i, j] / np.sqrt(result.covariance[i, i] * result.covariance[j, j]) < 0.05
    offset = result.parameters["a_1"]
    assert offset.plausible[0] < offset.estimate.value < offset.plausible[1]


@pytest.mark.parametrize("rig", RIGS)
def test_errors_on_held_out_logs_are_near_the_noise_floor_and_those_of_a_rig_without_effects(diagnosed, rig):
    for axis, report in diagnosed[rig].axes.items():
        found, clean = report.after.prediction_1s, diagnosed["rig-c"].axes[axis].after.prediction_1s
        assert found.value < 1.3 * clean.value
        # figures of 340 starts that overlap: some twenty independent seconds a log, 16 % each way, two of those
        assert found.value < 1.4 * report.noise_floor.prediction_1s.value
        assert found.low <= found.value <= found.high
    (series,) = diagnosed[rig].series
    # scale of one log against that of three: 9000 samples know theirs to 1 %, the air of another flight to a few
    np.testing.assert_allclose(series.residuals["after"][500:].std(axis=0), 1.0, atol=0.1)


def test_held_out_logs_of_another_rig_are_less_likely_and_that_is_said_and_a_log_too_short_is_refused():
    """Held-out logs decide nothing: what the training logs hold is shown, and a note says that it does not hold."""
    moved = TABLE_2._replace(moving_mass_elevation=0.05, moving_mass_time=33.0)
    records = [noisy_log(moved, drive(60.0, seed), seed, name=f"train{seed}") for seed in (1, 2)]
    result = diagnose(records, held_out=noisy_log(TABLE_2, drive(60.0, 7), 7, name="held"))
    assert [(found.name, found.axis) for found in result.effects] == [("moving_mass", "elevation")]
    assert result.held_out.gain.high < 0.0
    assert any("less likely under the corrected plant" in note for note in result.notes)
    short = noisy_log(TABLE_2, drive(7.0, 3), 3, name="short")
    with pytest.raises(LogError, match=r"log short lasts 7 s; a diagnosis needs 8 s a log"):
        diagnose([records[0], short], held_out=records[1])


def diagnosis_of_a_process(folder, seed, threads):
    """Diagnose two demonstration logs in a process of its own; gives diagnosis.json without its times."""
    (first, second, _), (held,) = demo_files("rig-a")
    words = ["diagnose", first, second, "--validate", held, "--to", "40", "--output", "out"]
    limits = {f"{library}_NUM_THREADS": str(threads) for library in ("OPENBLAS", "OMP", "MKL", "NUMBA")}
    told = {**os.environ, **limits, "PYTHONHASHSEED": str(seed), "PYTHONPATH": str(ROOT)}
    run_python(HELI, *words, cwd=folder, env=told)
    document = json.loads((folder / "out" / "diagnosis.json").read_text())
    del document["seconds"], document["provenance"]["date"]
    del document["provenance"]["command"]  # of a process that is started with -c it holds no more than that
    return document, (folder / "out" / "HelicopterPlant.fmu").read_bytes()


def test_a_diagnosis_repeats_to_the_bit_with_another_hash_seed_and_two_threads(tmp_path):
    (tmp_path / "one").mkdir()
    (tmp_path / "two").mkdir()
    assert diagnosis_of_a_process(tmp_path / "one", 1, 1) == diagnosis_of_a_process(tmp_path / "two", 2, 2)
