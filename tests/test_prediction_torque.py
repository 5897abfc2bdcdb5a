"""The linearised observer's answer to a torque, against what the whole observer sees of that torque in the data."""

import numpy as np
import pytest

from heli_identifier.records import Log
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.torque import torque_responses
from heli_plant.parameters import TABLE_2
from tests.online_record import H
from tests.simulated import UNSTABLE, drive, pushed, square_drive

SECONDS = 30.0
TIME = H * np.arange(round(SECONDS / H))
SHAPE = np.sin(2.0 * np.pi * 0.4 * TIME) + 0.5 * (TIME > 15.0)
"""A period and a step: what the search looks for."""


def seen(parameters, voltages, axis, size):
    """Change of the reduced innovations (n, 3) when ``size`` times the shape pushes one axis of the data."""
    torque = np.zeros((len(TIME), 3))
    still = Log("still", 1.0 / H, voltages, pushed(parameters, voltages, torque)[1])
    torque[:, axis] = size * SHAPE
    pushed_ = Log("pushed", 1.0 / H, voltages, pushed(parameters, voltages, torque)[1])
    return Problem((pushed_,)).residuals(parameters)[0] - Problem((still,)).residuals(parameters)[0]


def expected(parameters, voltages, axis, size):
    problem = Problem((Log("any", 1.0 / H, voltages, np.zeros((len(TIME), 3))),))
    return torque_responses(problem, axis, parameters, [size * SHAPE[:, None]])[0][:, 0]


def distance(a, b):
    return float(np.linalg.norm(a - b) / np.linalg.norm(b))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_torque_in_the_data_is_answered_as_the_linearised_observer_says(axis):
    voltages = drive(SECONDS, 1)
    change, wanted = seen(TABLE_2, voltages, axis, 1e-3)[:, axis], expected(TABLE_2, voltages, axis, 1e-3)
    # The pitch's stiffness is a_th cos(theta - theta0), here at worst .25 a_th less, beside omega_f^2 = 16; the push's
    # half step of the angle is right to a_wx h. Elevation and travel are linear in themselves.
    assert distance(change, wanted) < (0.25 * TABLE_2.a_th / 16.0 if axis == 0 else 2.0 * TABLE_2.a_wy * H)


def test_what_the_linear_answer_leaves_out_is_of_second_order_in_the_torque():
    voltages = square_drive(SECONDS)
    parameters = TABLE_2._replace(a_th=3.0)  # a stiff pitch, so that its sine shows
    unit = seen(parameters, voltages, 0, 1e-6)[:, 0] / 1e-6
    errors = [np.linalg.norm(seen(parameters, voltages, 0, size)[:, 0] / size - unit) for size in (0.05, 0.1)]
    # relative error in proportion to the torque: of second order; a tenth for the third
    assert errors[1] / errors[0] == pytest.approx(2.0, rel=0.1)


def test_an_unstable_pitch_answers_with_its_own_stiffness():
    # left alone the pitch tips over within seconds: the angles magnify the torque many times, the innovations do not
    voltages = np.zeros((len(TIME), 2))
    short = TIME < 6.0
    torque = np.zeros((short.sum(), 3))
    torque[:, 0] = 1e-4 * SHAPE[short]
    angles = pushed(UNSTABLE, voltages[short], torque)[1]
    record = Log("tipping", 1.0 / H, voltages[short], angles)
    problem = Problem((record,))
    wanted = torque_responses(problem, 0, UNSTABLE, [torque[:, :1]])[0][:, 0]
    assert distance(problem.residuals(UNSTABLE)[0][:, 0], wanted) < 0.01
    other = torque_responses(problem, 0, UNSTABLE._replace(a_th=-UNSTABLE.a_th), [torque[:, :1]])[0][:, 0]
    # 2 a_th / omega_f^2 = 5 % between the stiffnesses of either sign
    assert distance(other, wanted) > 0.03


def test_records_and_columns_are_answered_one_by_one():
    voltages = drive(SECONDS, 1)
    angles = np.zeros((len(TIME), 3))
    problem = Problem((Log("a", 1.0 / H, voltages, angles), Log("b", 1.0 / H, voltages[:2000], angles[:2000])))
    pair = np.column_stack((SHAPE, np.cos(TIME)))
    both = torque_responses(problem, 1, TABLE_2, [pair, pair[:2000]])
    alone = torque_responses(problem, 1, TABLE_2, [pair[:, 1:], pair[:2000, 1:]])
    assert [r.shape for r in both] == [(problem.lengths[0], 2), (problem.lengths[1], 2)]
    np.testing.assert_array_equal(both[0][:, 1:], alone[0])
    # the same filter from rest: a shorter record is the beginning of the longer one
    np.testing.assert_array_equal(both[1], both[0][: problem.lengths[1]])
