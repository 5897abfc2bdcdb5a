"""Free runs and the noise floor: the model left alone, and what it would get wrong on data of its own making."""

import numpy as np
import pytest

from heli_identifier.tracing.prediction.fit import BASE, fit
from heli_identifier.tracing.prediction.observer import observe, observer_start
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.prediction.whitening import fit_axis
from heli_identifier.tracing.validation.comparison import compared, figures, noise_floor
from heli_identifier.tracing.validation.held_out import hold_out
from heli_identifier.tracing.validation.noise_floor import PIECE, synthetic_pieces, synthetic_record
from heli_identifier.tracing.validation.prediction import ModelErrors, free_run, stable_axes
from heli_plant.parameters import TABLE_2
from heli_plant.simulation import simulate
from tests.online_record import H
from tests.simulated import UNSTABLE, closed_loop, drive, exact, noisy

SECONDS = 90.0


@pytest.fixture(scope="module")
def record():
    return noisy(TABLE_2, drive(SECONDS, 1), 1)


def test_a_free_run_is_the_simulation_from_the_logs_own_start_bit_for_bit(record):
    once, again = free_run(record, TABLE_2), free_run(record, TABLE_2)
    assert np.array_equal(once, again)
    assert np.array_equal(once, simulate(record.voltages, record.step, observer_start(record), TABLE_2)[1])


def test_the_free_run_of_the_true_model_keeps_to_an_exact_record():
    exact_record, start = exact(TABLE_2, drive(SECONDS, 3))
    error = free_run(exact_record, TABLE_2) - exact_record.angles
    read = observer_start(exact_record)
    # a straight line over the first .3 s misses the bend of the motion there, acceleration times .3^2 / 12 or so;
    # pitch and elevation carry that on as a swing of the same size
    off = [abs(read.pitch - start.pitch) + abs(read.pitch_rate) / TABLE_2.a_th**0.5]
    off.append(abs(read.elevation - start.elevation) + abs(read.elevation_rate) / TABLE_2.a_e**0.5)
    assert np.all(np.abs(error[:, :2]).max(axis=0) <= 1.2 * np.array(off) + 0.001)


def test_only_an_axis_that_returns_by_itself_is_run_freely():
    assert stable_axes(TABLE_2) == (True, True, False)
    assert stable_axes(TABLE_2._replace(cable_stiffness_travel=0.01)) == (True, True, True)
    assert stable_axes(UNSTABLE) == (False, True, False)
    assert stable_axes(TABLE_2._replace(a_wz=-0.01)) == (True, False, False)


def test_a_synthetic_record_leaves_the_innovations_of_the_real_one(record):
    made = synthetic_record(record, TABLE_2, 4.0, 3)
    assert np.array_equal(made.voltages, record.voltages)
    assert not np.allclose(made.angles, record.angles, atol=1e-3)
    settled = slice(250, None)
    own = observe(record, TABLE_2, 4.0, observer_start(record))[0][settled]
    found = observe(made, TABLE_2, 4.0, observer_start(made))[0][settled]
    for axis in range(3):
        # of 90 s with a memory of half a second or so: 180 independent values, a deviation known to 5 % in either
        assert found[:, axis].std() == pytest.approx(own[:, axis].std(), rel=0.25)
        # one step ahead nothing but the encoders counts, thousands of values
        scales = [fit_axis([x[:, axis]])[1] for x in (own, found)]
        assert scales[1] == pytest.approx(scales[0], rel=0.06)


def test_seeds_give_other_records_and_the_same_again(record):
    one, same, other = (synthetic_record(record, TABLE_2, 4.0, seed).angles for seed in (1, 1, 2))
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)


def test_the_noise_floor_of_a_model_is_its_own_error_on_its_own_data(record):
    made = tuple(synthetic_record(record, TABLE_2, 4.0, seed) for seed in (11, 12))
    problem = Problem(made)
    errors = ModelErrors(problem, TABLE_2)
    own = figures(errors, [free_run(r, TABLE_2) - r.angles for r in made], [H, H])
    floor = noise_floor(errors)
    for kind in ("prediction_1s", "prediction_2s", "acceleration"):
        for mine, least in zip(getattr(own, kind), getattr(floor, kind), strict=True):
            # two draws of the same noise, 180 s each: their 95 % intervals overlap, all but one pair in a hundred
            assert mine.low < least.high
            assert least.low < mine.high
    assert floor.free_run[2] is None
    assert floor.axis(0).prediction_1s is floor.prediction_1s[0]


def test_longer_horizons_err_more(record):
    floor = noise_floor(ModelErrors(Problem((record,)), TABLE_2))
    for axis in range(3):
        assert floor.prediction_1s[axis].value < floor.prediction_2s[axis].value


def test_an_unstable_model_has_its_floor_from_short_pieces():
    record = closed_loop(UNSTABLE, 60.0, 2)
    pieces = synthetic_pieces(record, UNSTABLE, 4.0, 1)
    assert len(pieces) == int(60.0 / PIECE)
    for piece in pieces:
        assert piece.duration == pytest.approx(PIECE)
        # begun at the rig's motion, it stays near the rig
        assert np.abs(piece.angles[0] - record.angles[round(float(piece.name.split("[")[1][:-1]))]).max() < 0.02
    measured = ModelErrors(Problem((record,)), UNSTABLE)
    floor = noise_floor(measured)
    assert floor.free_run == [None, None, None]
    errors = figures(measured, None, [H])
    for axis in range(3):
        # a true model is at its floor: pieces are noisier figures of fewer starts, within a half
        assert floor.prediction_1s[axis].value == pytest.approx(errors.prediction_1s[axis].value, rel=0.5)


def test_a_comparison_sees_a_missing_effect_before_and_the_floor_after():
    truth = TABLE_2._replace(dry_friction_pitch=0.03)
    training = Problem(tuple(noisy(truth, drive(60.0, seed), seed) for seed in (1, 2)))
    held = noisy(truth, drive(60.0, 5), 5)
    before = fit(training, first_estimate(training.records, TABLE_2))
    begin = before.parameters._replace(dry_friction_pitch=0.01)
    after = fit(training, begin, (*BASE, "dry_friction_pitch"))
    reports, _, run_after = compared(
        hold_out([held], 4.0), before.parameters, after.parameters, after.parameters, None, after.whitener
    )
    pitch = reports["pitch"]
    assert pitch.after.prediction_1s.value < 0.7 * pitch.before.prediction_1s.value
    assert pitch.after.acceleration.value < 0.7 * pitch.before.acceleration.value
    # of held-out data of the true structure: the floor's own interval, and a few per cent for fitted parameters
    assert pitch.after.prediction_1s.low < 1.1 * pitch.noise_floor.prediction_1s.high
    assert pitch.noise_floor.prediction_1s.low < pitch.after.prediction_1s.high
    # no effect on elevation: before and after are the same model there
    elevation = reports["elevation"]
    assert elevation.after.prediction_1s.value == pytest.approx(elevation.before.prediction_1s.value, rel=0.02)
    # the largest of 50 lags of a residual that has nothing to do with the inputs: above 2.1 once in a thousand
    assert pitch.input_correlation["after"] < 2.1
    # the whitening of the training logs fits the held-out one but for its own sampling error
    assert pitch.whiteness_p["after"] > 1e-4
    assert reports["travel"].after.free_run is None
    (run,) = run_after.free_runs
    error = np.sqrt(np.mean((held.angles - run) ** 2, axis=0))
    assert pitch.after.free_run is not None
    assert pitch.after.free_run.value == pytest.approx(error[0], rel=1e-12)
