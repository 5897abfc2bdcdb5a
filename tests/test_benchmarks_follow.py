"""The follow benchmark: its compiled loop is the corrector's own step; the bound of what can be noticed."""

import math

import numpy as np
import pytest

from benchmarks.closed_loop_rigs import TORQUE_STD, TORQUE_TIME
from benchmarks.follow_bound import bound
from benchmarks.follow_fast import corrected
from heli_identifier.online.following import FollowSettings, prepare_following
from heli_plant.parameters import TABLE_2
from tests.blind.coefficients import Coefficients
from tests.following import followed, record


def test_flights_by_blocks_are_those_of_the_pure_step_to_the_bit():
    rows = record(62.0, TABLE_2._replace(k_z=1.2 * TABLE_2.k_z), 25.0, seed=4)
    fresh = [0.0 if k % 977 == 0 else 1.0 for k in range(len(rows))]
    state, events, outputs, _ = followed(rows, fresh)
    said, adoptions, errors, last = corrected(np.array(rows), fresh, prepare_following(FollowSettings()))
    assert said == events
    assert len(adoptions) == 1
    assert last == state
    assert [error[0] for error in errors] == [output.time for output in outputs if output.compared]


def test_the_bound_of_a_constant_change_is_that_of_the_torques_spectrum_at_zero():
    """A constant g against a torque of the spectrum 2 std^2 tau at frequency zero: J grows by g^2/(2 std^2 tau).

    How much its beginning tells cancels in the difference of two delays. Samples make 1 % of difference at most.
    """
    c = Coefficients()
    rows = np.tile([2.7, 2.7, 0.15, 0.0, 0.0], (9000, 1))
    g = 0.2 * c.k_y * 5.4 * math.sin(0.15)
    rate = g * g / (2.0 * TORQUE_STD**2 * TORQUE_TIME)
    near, far = bound(rows, c, 20.0, 0.2, 3.6e4), bound(rows, c, 20.0, 0.2, 3.6e7)
    assert far.delay - near.delay == pytest.approx(2.0 * math.log(1000.0) / rate, rel=0.01)


def test_of_no_change_as_much_is_noticed_as_alarms_are_false():
    rows = np.tile([2.7, 2.7, 0.15, 0.0, 0.0], (4500, 1))
    assert bound(rows, Coefficients(), 20.0, 0.0, 3.6e4) == (pytest.approx(20.0 / 3.6e4), math.inf)
