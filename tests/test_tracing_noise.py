"""The whitener of the noise alone: a step of torque must not become part of the noise spectrum."""

import numpy as np
import pytest

from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.search.candidates import STEP_SPACING, candidates, stepping_at
from heli_identifier.tracing.search.noise import CONTRACTION, noise_whitener
from heli_identifier.tracing.search.scan import scan, scored
from heli_identifier.tracing.search.steps import step_times
from heli_plant.parameters import TABLE_2
from tests.simulated import drive, noisy

SECONDS, MOVED_AT, SHIFT = 60.0, 33.0, 0.06


def score_catalogue(truth):
    records = tuple(noisy(truth, drive(SECONDS, seed), seed) for seed in (1, 2))
    fitted = fit(Problem(records), first_estimate(records, TABLE_2))
    scanned = scan(fitted, candidates(records, fitted.parameters))
    return fitted, noise_whitener(fitted, scanned.raw)


@pytest.fixture(scope="module")
def moved():
    """Two logs in which a mass moves at the same time."""
    return score_catalogue(TABLE_2._replace(moving_mass_elevation=SHIFT, moving_mass_time=MOVED_AT))


@pytest.fixture(scope="module")
def clean():
    return score_catalogue(TABLE_2)


def gain_at_rest(whitener, axis):
    """What a constant becomes behind the whitening, in standard deviations of its residual."""
    return whitener.filters[axis].sum() / whitener.scales[axis]


def test_no_pole_remembers_longer_than_three_seconds(moved):
    _, of_noise = moved
    for taps in of_noise.filters:
        assert np.abs(np.roots(taps)).max() <= CONTRACTION * (1.0 + 1e-9)


def test_a_step_does_not_teach_the_whitening_to_hide_it(moved, clean):
    fitted, of_noise = moved
    noise = gain_at_rest(clean[0].whitener, 1)
    # the fit's own whitening has taken the step for noise and lets a constant pass no more
    assert gain_at_rest(fitted.whitener, 1) < 0.1 * noise
    # an autoregression's gain at rest hangs on the few slowest periods of a record and varies by a factor of two
    # either way; so does that of the noise proper, and no more
    assert 0.25 * noise < gain_at_rest(of_noise, 1) < 4.0 * noise


def test_the_step_scores_higher_under_the_noise_proper(moved):
    fitted, of_noise = moved
    moves = stepping_at((MOVED_AT,), fitted.parameters)
    own = scan(fitted, moves)
    noise_scan = scored(fitted, of_noise, moves, own.raw)
    assert noise_scan.scores[0] > max(own.scores[0], 8.0)


def test_many_alike_columns_leave_no_level_that_was_not_there():
    # steady flight in which nearly every candidate is a constant: a weighted fit would leave the level free
    records = tuple(noisy(TABLE_2, 0.05 * drive(20.0, seed), seed) for seed in (1, 2))
    fitted = fit(Problem(records), first_estimate(records, TABLE_2))
    of_noise = noise_whitener(fitted, scan(fitted, candidates(records, fitted.parameters)).raw)
    # what the fullest model leaves is no larger than what the least one does, but for the bound on the memory
    assert np.all(of_noise.scales < 1.5 * fitted.whitener.scales)


def test_the_time_of_the_step_is_found(moved):
    fitted, of_noise = moved
    times = step_times(fitted, of_noise)
    # to the spacing of what is tried; the refit moves it to the place
    assert times[0] == pytest.approx(MOVED_AT, abs=STEP_SPACING)
    assert abs(times[1] - times[0]) > 2.0
    assert all(2.0 <= t <= SECONDS - 2.0 for t in step_times(fitted, of_noise, 5))
    assert len(step_times(fitted, of_noise, 5)) == 5
