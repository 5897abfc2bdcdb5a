"""The follow benchmark: the bound of what can be noticed, excited flight, faults of a stream."""

import math

import numpy as np
import pytest
from scipy.stats import norm

from benchmarks.flown import TORQUE_STD, TORQUE_TIME
from benchmarks.follow import GAIN, errors_ahead, excited_until
from heli_identifier.following import FollowSettings, prepare_following
from heli_plant.parameters import TABLE_2
from tests.blind.coefficients import Coefficients
from tests.following import followed, record

HOVER = [2.7, 2.7, 0.15, 0.0, 0.0]


def test_information_on_a_constant_change_is_that_of_the_torques_spectrum_at_zero():
    """A constant g against a torque of the spectrum 2 std^2 tau at frequency zero: J grows by g^2/(2 std^2 tau).

    J* grows by what the quantile of a longer time between false alarms adds; how much the beginning of the change tells
    cancels in the difference of two times. Samples make 1 % of difference at most.
    """
    c = Coefficients()
    rows = np.tile(HOVER, (30000, 1))
    rows[:, 2] *= 0.5
    g = GAIN * c.k_y * 5.4 * math.sin(0.075)
    rate = g * g / (2.0 * TORQUE_STD**2 * TORQUE_TIME)
    near, far = (excited_until("k_y", rows, c, 0.0, time) for time in (3.6e4, 3.6e7))
    needed = [(norm.ppf(1.0 - 20.0 / (32 * time)) + norm.ppf(0.95)) ** 2 for time in (3.6e4, 3.6e7)]
    assert far - near == pytest.approx((needed[1] - needed[0]) / rate, rel=0.01)


@pytest.mark.slow
def test_a_twin_with_the_values_in_use_errs_as_the_one_that_does_not_correct():
    rows = record(40.0, seed=4)
    fresh = [0.0 if k % 97 == 0 else 1.0 for k in range(len(rows))]
    _, _, states, _ = followed(rows, fresh, correcting=False)
    plan = prepare_following(FollowSettings(correcting=False))
    errors = errors_ahead(np.array(rows), fresh, plan, 20.0, 39.0, plan.first_values)
    compared = [one for one in states if one.predictions.compared and 2000 <= one.samples <= 3900]
    expected = np.array([np.subtract(rows[one.samples][2:], one.predictions.used.predicted) for one in compared])
    # the two observers began at different times; after 6 s what is left of that is exp(-6.6/2 6) of a rate of .1 rad/s
    assert errors == pytest.approx(expected, abs=1e-6)
    assert TABLE_2 == plan.settings.parameters
