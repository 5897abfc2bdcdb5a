"""Samples that did not come in: what the observer then knows, how much the next sample counts, which voltages acted."""

import json
import math

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from heli_identifier.following import (
    FollowSettings,
    Sample,
    Told,
    correct,
    frozen_state,
    prepare_following,
    start_correcting,
    thawed_state,
)
from heli_identifier.following.roughness import no_roughness, roughened
from heli_identifier.following.uncertainty import (
    Uncertainty,
    corrected,
    gains_of,
    grown,
    memory_of,
    steady_state,
)
from heli_plant.observer import observer_gains
from tests.following import H, record

BANDWIDTH = 6.6
KEPT = math.exp(-H)
F = np.array([[1.0, H, 0.5 * H * H], [0.0, 1.0, H], [0.0, 0.0, KEPT]])
FIRST = np.array([[1.0, 0.0, 0.0]])


def _matrix(u: Uncertainty) -> np.ndarray:
    xx, xw, xd, ww, wd, dd = u
    return np.array([[xx, xw, xd], [xw, ww, wd], [xd, wd, dd]])


def test_the_steady_state_solves_the_riccati_equation():
    """Its own error is that of a covariance which has faded by 100 four times over, 1e-8."""
    steady = steady_state(BANDWIDTH, H, KEPT)
    Q = np.diag([0.0, 0.0, steady.drive])
    P = solve_discrete_are(F.T, FIRST.T, Q, np.eye(1))
    assert steady.variance == pytest.approx(P[0, 0] + 1.0, rel=1e-7)
    assert _matrix(steady.uncertainty) == pytest.approx(P - P @ FIRST.T @ FIRST @ P / (P[0, 0] + 1.0), rel=1e-7)


def test_in_the_steady_state_the_gains_are_those_of_the_observer():
    """Butterworth's poles are the optimal ones for h -> 0 and gamma -> 0: they differ by the order of omega_o h/10."""
    steady = steady_state(BANDWIDTH, H, KEPT)
    optimal = gains_of(grown(steady.uncertainty, H, KEPT, 0.0, steady.drive), KEPT)
    assert optimal == pytest.approx(observer_gains(BANDWIDTH, H), rel=0.1 * BANDWIDTH * H)


def test_prediction_and_correction_are_those_of_a_kalman_filter():
    root = np.random.default_rng(3).standard_normal((3, 3))
    P = root @ root.T
    u = Uncertainty(P[0, 0], P[0, 1], P[0, 2], P[1, 1], P[1, 2], P[2, 2])
    assert _matrix(grown(u, H, KEPT, 0.3, 0.7)) == pytest.approx(F @ P @ F.T + np.diag([0.0, 0.3, 0.7]))
    l = P @ FIRST.T / (P[0, 0] + 1.0)  # noqa: E741 - the letter of the module
    assert _matrix(corrected(u)) == pytest.approx((np.eye(3) - l @ FIRST) @ P)


def test_a_gap_is_forgotten_by_a_hundredth_in_the_samples_that_it_is_remembered():
    steady = steady_state(BANDWIDTH, H, KEPT)
    u = grown(steady.uncertainty, H, KEPT, 0.0, steady.drive)
    before = u.angle
    for _ in range(19):  # the longest gap that is none of the stops
        u = grown(u, H, KEPT, 0.0, steady.drive)
    excess = u.angle - before
    for _ in range(memory_of(BANDWIDTH, H)):
        u = grown(corrected(u), H, KEPT, 0.0, steady.drive)
    assert abs(u.angle - before) < 0.01 * excess


def test_innovations_stay_white_where_samples_and_their_voltages_are_missing():
    """What is not known of a lost voltage kicks the rate; e/sqrt(s) is N(0, 1) right after a gap and long after it.

    The tolerances are four standard errors: of a variance from n innovations sqrt(2/n), of a correlation 1/sqrt(n).
    With the observer's constant gain the variance is 1.17 and the correlation .14 one sample apart.
    """
    rng, n, kick = np.random.default_rng(4), 60000, 4.0
    steady = steady_state(BANDWIDTH, H, KEPT)
    lost = rng.random(n) < 0.12
    encoder, drive, kicks = rng.standard_normal((3, n))
    x, u, found, since = np.zeros(3), steady.uncertainty, np.full(n, np.nan), np.zeros(n)
    for k in range(1, n):
        # the voltage from k - 1 on is that of the sample of k - 1
        unknown = kick * lost[k - 1]
        x = F @ x + np.array([0.0, unknown * kicks[k], math.sqrt(steady.drive) * drive[k]])
        u = grown(u, H, KEPT, unknown * unknown, steady.drive)
        since[k] = since[k - 1] + 1 if not lost[k - 1] else 1
        if not lost[k]:
            e, gains = x[0] + encoder[k], gains_of(u, KEPT)
            found[k] = e / math.sqrt(u.angle + 1.0)
            x = x - np.array(gains[:3]) * e
            u = corrected(u)
    after = found[(since == 1) & ~lost]
    assert np.mean(after**2) == pytest.approx(1.0, abs=4.0 * math.sqrt(2.0 / len(after)))
    assert np.nanmean(found**2) == pytest.approx(1.0, abs=4.0 * math.sqrt(2.0 / n))
    for lag in (1, 2, 5, 10, 20):
        assert abs(np.nanmean(found[lag:] * found[:-lag])) < 4.0 / math.sqrt(0.77 * n)


def test_a_straight_line_misses_a_kick_by_itself_and_its_neighbours_by_half():
    """White voltages of the variance v: the middle one less the mean of its neighbours has 1.5 v.

    The tolerance is four standard errors: n second differences are worth n/2 independent ones, of which a mean square
    has the relative error sqrt(2/(n/2)).
    """
    rng, n = np.random.default_rng(5), 10000
    rows = rng.standard_normal((n, 2)) * 0.1
    known = no_roughness((rows[0, 0], rows[0, 1]))
    for k in range(1, n):
        known = roughened(known, (rows[k, 0], rows[k, 1]), False, H)
    # sum and difference of two independent voltages have twice the variance of one
    expected, tolerance = 1.5 * 2 * 0.01, 4.0 * math.sqrt(4.0 / n)
    assert known.total == pytest.approx(expected, rel=tolerance)
    assert known.difference == pytest.approx(expected, rel=tolerance)


def test_nothing_is_learned_of_voltages_across_a_gap():
    known = roughened(no_roughness((2.0, 2.0)), (5.0, 2.0), True, H)
    known = roughened(known, (9.0, 2.0), False, H)
    assert (known.samples, known.difference, known.total) == (0, 0.0, 0.0)
    assert roughened(known, (13.0, 3.0), False, H)[:3] == (0.25, 0.25, 1)


@pytest.mark.parametrize("delay", [0.0, 0.03])
def test_voltages_on_a_straight_line_are_put_back_over_a_gap(delay):
    """After a gap the plant is the one that has seen every voltage, to rounding; with held voltages it is not."""
    rows = record(14.0, seed=8)
    plan = prepare_following(FollowSettings(parameters=FollowSettings().parameters._replace(input_delay_rotors=delay)))
    state = start_correcting(plan, Sample(*rows[0]))
    for row in rows[1:1200]:
        state, _ = correct(state, Sample(*row), Told(), plan)
    front, rear, *angles = rows[1200]
    line = [[front + 0.05 * j, rear - 0.02 * j, *angles] for j in range(8)]
    state, _ = correct(state, Sample(*line[0]), Told(), plan)
    whole = lossy = state
    for j in range(1, 7):
        # no angles in either case; the voltages are known in one
        whole, _ = correct(whole, Sample(*line[j], 0.0), Told(), plan)
        lossy, _ = correct(lossy, Sample(*line[0], 0.0), Told(), plan)
    held = lossy.memory.state.nu_front
    whole, _ = correct(whole, Sample(*line[7], 0.0), Told(), plan)
    lossy, _ = correct(lossy, Sample(*line[7]), Told(), plan)
    motors = lossy.memory.state.nu_front, lossy.memory.state.nu_rear
    assert motors == pytest.approx((whole.memory.state.nu_front, whole.memory.state.nu_rear), abs=1e-12)
    assert abs(motors[0] - held) > 0.01


def test_the_copies_one_second_ahead_take_the_voltages_that_were_put_back():
    """They move in steps of five samples under the mean voltage: what they missed comes with the next step."""
    rows = record(14.0, seed=8)
    plan = prepare_following(FollowSettings())
    state = start_correcting(plan, Sample(*rows[0]))
    for row in rows[1:1201]:
        state, _ = correct(state, Sample(*row), Told(), plan)
    front, rear, *angles = rows[1201]
    state, _ = correct(state, Sample(front, rear, *angles), Told(), plan)
    begin = state.arrived[0]
    state, _ = correct(state, Sample(front, rear, *angles, 0.0), Told(), plan)
    assert state.arrived[0] - begin == pytest.approx(front)
    state, _ = correct(state, Sample(front + 1.0, rear, *angles), Told(), plan)
    assert state.arrived[0] - begin == pytest.approx(2.0 * front + 0.5)


def test_the_state_comes_back_from_json_to_the_bit_in_the_middle_of_a_gap():
    rows = record(14.0, seed=8)
    plan = prepare_following(FollowSettings())
    state = start_correcting(plan, Sample(*rows[0]))
    for k in range(1, 1204):
        state, _ = correct(state, Sample(*rows[k], 0.0 if k % 9 == 0 or k > 1200 else 1.0), Told(), plan)
    again = thawed_state(json.loads(json.dumps(frozen_state(state))), plan)
    assert again == state
    for row in rows[1204:1300]:
        state, output = correct(state, Sample(*row), Told(), plan)
        again, same = correct(again, Sample(*row), Told(), plan)
        assert same == output
