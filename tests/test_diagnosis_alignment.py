"""A log whose elevation was zeroed in another position is found, shifted, and said to be."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from heli_identifier.records import RigConfiguration
from heli_identifier.tracing import DiagnosisSettings, diagnose
from heli_identifier.tracing.alignment.aligned import aligned
from heli_identifier.tracing.alignment.elevation_zero import LEAST, outlying, shifted, zeros
from heli_identifier.tracing.diagnosis.diagnose import model_before
from heli_plant.parameters import TABLE_2
from tests.simulated import closed_loop, drive, noisy

ZERO = 0.35
"""What one log's elevation reads less than the others' [rad]."""


@pytest.fixture(scope="module")
def logs():
    return tuple(replace(closed_loop(TABLE_2, 40.0, seed), name=f"log {seed}") for seed in range(5))


def alignment(training, held_out, bandwidth=4.0):
    settings = DiagnosisSettings.from_rig(RigConfiguration(), bandwidth)
    return aligned(training, held_out, partial(model_before, settings=settings))


@pytest.mark.parametrize(("place", "bandwidth"), [(0, 4.0), (2, 2.0), (2, 8.0), (4, 2.0), (4, 4.0)])
def test_a_zero_in_another_position_is_found_where_it_is(logs, place, bandwidth):
    given = shifted(logs, np.where(np.arange(5) == place, -ZERO, 0.0))
    found = alignment(given[:3], given[3:], bandwidth)
    (note,) = found.notes
    assert note.startswith(f"log {place}: its elevation reads 0.3") and "rad less than" in note
    own = (*found.null.fit.problem.records, *found.held_out.logs)
    # the arm's rest angles in noise and joystick steps are alike to some hundredths of a radian
    for log, whole in zip(own, logs, strict=True):
        assert np.median(log.angles[:, 1]) == pytest.approx(np.median(whole.angles[:, 1]), abs=0.05)


def test_logs_of_one_zero_are_left_alone(logs):
    assert alignment(logs[:3], logs[3:]).notes == ()
    in_open_loop = tuple(noisy(TABLE_2, drive(40.0, seed), seed) for seed in range(4))
    assert alignment(in_open_loop[:3], in_open_loop[3:]).notes == ()


def test_small_zeros_are_left_to_the_fits(logs):
    given = shifted(logs, np.array([0.0, -0.04, 0.0, 0.03, 0.0]))
    assert alignment(given[:3], given[3:]).notes == ()


def test_two_logs_do_not_tell_which_of_them_is_the_other_one():
    residuals = [np.full((100, 3), level) for level in (0.0, 1.0)]
    assert not zeros(residuals, 1.0, 4.0).any()
    assert not zeros(
        [*residuals, residuals[0]], 0.0, 4.0
    ).any()  # an arm that is balanced everywhere has no zero to see


def test_an_outlier_lies_far_from_the_others_and_farther_than_they_spread():
    assert outlying(np.array([0.0, 0.01, -0.01, 1.1 * LEAST])).tolist() == [False, False, False, True]
    assert not outlying(np.array([0.0, 0.2, -0.2, 0.3])).any()


@pytest.mark.slow
def test_a_diagnosis_says_what_it_shifted_and_is_that_of_the_logs_as_they_should_be(logs):
    given = shifted(logs, np.where(np.arange(5) == 1, -ZERO, 0.0))
    whole, found = (diagnose(own[:3], held_out=own[3:]) for own in (logs, given))
    assert any("its elevation reads" in note for note in found.notes)
    assert not any("its elevation reads" in note for note in whole.notes)
    for name in ("a_e", "k_z", "a_1"):
        # what is left of the zero is an offset between logs, which the interval allows for
        error = found.parameters_after[name].standard_error
        assert abs(found.parameters_after[name].value - whole.parameters_after[name].value) < 3.0 * error
