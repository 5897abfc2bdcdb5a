"""The following twin: CUSUMs, names and sizes of changes, when one is adopted, and what gaps and faults do to it."""

import json
import math
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import solve_discrete_are
from scipy.stats import norm

from fmu_src.access import thaw_state
from heli_identifier import following
from heli_identifier.following import REASONS, Sample
from heli_identifier.following.covariance import correct_covariance, find_steady_state, predict_covariance
from heli_identifier.following.cusum import _PRIOR_WIDTH, Projection, cusum_statistic, judge_size, siegmund_threshold
from heli_identifier.following.evidence import Coefficients, Noise, shift_block, start_sums
from heli_identifier.following.observer import Encoder
from heli_identifier.following.prediction import compare_errors
from heli_identifier.following.trial import take_back
from heli_plant.observer import observer_gains
from heli_plant.parameters import TABLE_2
from tests.simulated import COUNT, H, changing_rig

PLAN = following.FollowPlan(following.FollowSettings())
CHANGES = {
    "pitch.gain": (TABLE_2._replace(k_x=0.75 * TABLE_2.k_x), "k_x"),
    "elevation.gain": (TABLE_2._replace(k_z=1.2 * TABLE_2.k_z), "k_z"),
    "elevation.offset": (TABLE_2._replace(a_1=TABLE_2.a_1 - 0.08), "a_1"),
    "effects.dry_friction.travel": (TABLE_2._replace(dry_friction_travel=0.04), "dry_friction_travel"),
}


@lru_cache(maxsize=8)
def changed_rows(name, seconds=70.0):
    """Rows of a flight in which the rig changes after 30 s."""
    return changing_rig(seconds, CHANGES[name][0], 30.0, seed=5)


@lru_cache(maxsize=2)
def quiet_rows(seed):
    return changing_rig(50.0, seed=seed)


def follow(rows, fresh=lambda k: 1.0, **settings):
    """Return the corrector's last state, its events, its states from sample 0 on, and the plan."""
    plan = following.FollowPlan(following.FollowSettings(**settings))
    states, events = [following.start_correcting(plan, Sample(*rows[0]))], []
    for k, row in enumerate(rows[1:], 1):
        state, new_events = following.correct(states[-1], Sample(*row, float(fresh(k))), plan)
        states.append(state)
        events.extend(new_events)
    return states[-1], events, states, plan


@given(st.integers(0, 1000))
def test_blocks_after_an_adoption_are_those_of_a_twin_that_had_the_change(seed):
    rng = np.random.default_rng(seed)
    psi, theta, e = rng.standard_normal((50, 3)), (0.3, -0.2, 0.5), rng.standard_normal(50)

    def block(errors):
        sums = start_sums(3)
        for row, error in zip(psi, errors, strict=True):
            sums = sums.with_sample((*row, error)).with_products()
        return (sums.evidence(1.0),)

    moved = shift_block(block(e), tuple((0, i, x) for i, x in enumerate(theta)), 2.0)
    assert np.allclose(moved[0], block(e - 2.0 * psi @ theta)[0], rtol=1e-9, atol=1e-9)


def test_the_variance_inflation_is_learned_from_squares_and_never_below_1():
    """Squares of N(0, 2) have the mean 2; the largest is cut off, which costs some .2. Nothing is learned from none."""
    squares, noise, found = 2.0 * np.random.default_rng(7).standard_normal((4000, 6)) ** 2, Noise(blocks=120.0), []
    for row in squares.tolist():
        noise = noise.inflate([one / noise.inflation for one in row])
        found.append(noise.inflation)
    assert np.mean(found[500:]) == pytest.approx(2.0, abs=0.2)
    assert noise.inflate([]) == noise and Noise().inflate([0.1]).inflation == 1.0


@pytest.mark.parametrize("information", [0.3, 3.0, 100.0])
def test_the_mean_time_between_false_alarms_is_the_stated_one(information):
    """Siegmund's threshold, for two tests and 1000 blocks. The simulation's own error is some 4 % of the mean.
    Siegmund's approximation is one for small steps; it errs to the safe side, the more the larger they are."""
    rng, mean_time, longest = np.random.default_rng(2), 1000.0, 20000
    limit = siegmund_threshold(math.log(2.0 * mean_time), information)
    up, down, times = np.zeros(600), np.zeros(600), np.full(600, longest)
    for k in range(longest):
        response = math.sqrt(information) * rng.standard_normal(600)
        up = np.maximum(0.0, up + response - 0.5 * information)
        down = np.maximum(0.0, down - response - 0.5 * information)
        times = np.where((times == longest) & (np.maximum(up, down) > limit), k + 1, times)
    assert times.mean() > 0.9 * mean_time
    if information <= 3.0:
        assert times.mean() < 1.3 * mean_time
    assert 10.0 - 3.4 < siegmund_threshold(10.0, information) < 10.0 - 1.6


def test_the_bayes_factor_of_a_change_is_the_evidence_of_the_sizes_that_are_expected():
    response, information, nu = 12.0, 40.0, 0.2
    found = judge_size(0, 1, response, information, nu, (-9.0, 9.0))
    size = np.linspace(-3.0, 3.0, 6001)
    likelihood = np.exp(response * size - 0.5 * information * size**2)
    evidence = 0.001 * np.sum(norm.pdf(size, 0.0, _PRIOR_WIDTH * nu) * likelihood)  # exact for a smooth peak
    assert (found.size, found.log_bayes) == pytest.approx((0.3, math.log(evidence)), rel=1e-9)


@given(st.lists(st.floats(-5.0, 5.0), max_size=50), st.floats(0.1, 2.0))
def test_a_cusum_is_the_largest_sum_that_ends_now(responses, nu):
    """Page 1954: S_k = max(0, max over j of s_j + ... + s_k); the run is the length of that sum."""
    total, run = cusum_statistic([Projection(response, 1.0) for response in responses], nu)
    steps = [nu * response - 0.5 * nu * nu for response in responses]
    sums = [sum(steps[j:]) for j in range(len(steps))]
    assert total == pytest.approx(max([0.0, *sums]), abs=1e-9)
    assert run <= len(responses) and (total > 0.0) == (run > 0)


def rows_of(matrix):
    return tuple(map(tuple, matrix.tolist()))


def test_a_block_as_the_tests_see_it_has_the_likelihood_of_a_twin_whose_values_err():
    """ln p(b | delta) - ln p(b | 0) of b ~ N(R (m + delta D), R + R P R), computed with the dense covariance."""
    rng = np.random.default_rng(5)
    psi = rng.standard_normal((9, 4))
    r, b = psi.T @ psi, rng.standard_normal(4)
    a = rng.standard_normal((4, 4))
    p, m, d = a @ a.T, rng.standard_normal(4), rng.standard_normal(4)
    found = np.array(Coefficients(tuple(m), rows_of(p)).marginalise(rows_of(np.column_stack((r, b)))))
    w, u = found[:, :4], found[:, 4]
    inverse = np.linalg.inv(r + r @ p @ r)
    rest, moved = b - r @ m, b - r @ (m + 0.3 * d)
    wanted = 0.5 * (rest @ inverse @ rest - moved @ inverse @ moved)
    assert 0.3 * d @ u - 0.045 * d @ w @ d == pytest.approx(wanted, rel=1e-9)


def test_the_baseline_is_bayes_estimate_and_wanders_within_its_prior():
    """The dense recursion of a linear model with a Gaussian prior, then a share of 1/1800 back to that prior."""
    rng = np.random.default_rng(6)
    theta, deviation = np.array([0.5, -1.0, 0.2]), (1.0, 2.0, 0.5)
    prior, kept = np.diag(np.square(deviation)), math.exp(-1.0 / 1800.0)
    theta_estimate = Coefficients((0.0,) * 3, rows_of(prior))
    m, p = np.zeros(3), prior
    for _ in range(3):
        psi = rng.standard_normal((20, 3))
        r, b = psi.T @ psi, psi.T @ (psi @ theta + rng.standard_normal(20))
        theta_estimate = theta_estimate.learn(theta_estimate.marginalise(rows_of(np.column_stack((r, b)))), deviation)
        after = np.linalg.inv(np.linalg.inv(p) + r)
        m = kept * after @ (np.linalg.solve(p, m) + b)
        p = kept**2 * after + (1.0 - kept**2) * prior
    assert np.allclose(theta_estimate.mean, m, rtol=1e-9)
    assert np.allclose(theta_estimate.covariance, p, rtol=1e-8, atol=1e-12)


def test_a_rig_that_does_not_change_gives_no_alarm_although_a_stiffness_errs():
    """1.5 % of it are .027 rad/s^2 in a swing of .7 rad, beyond half of the smallest change that matters."""
    state, events, _, _ = follow(changing_rig(60.0, before=TABLE_2._replace(a_e=1.015 * TABLE_2.a_e), lift=5.0))
    assert events == [] and state.mode == "following"


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] if n != "elevation.offset" else []) for n in CHANGES]
)
def test_a_change_is_noticed_named_measured_and_adopted(name):
    after, field = CHANGES[name]
    state, events, states, plan = follow(changed_rows(name))
    assert events[0].what == "alarm" and 30.0 < events[0].time_s < 50.0
    assert all((event.what, event.why) in REASONS.values() and 29.0 < event.since_s < 40.0 for event in events[:2])
    adopted = [event for event in events if event.what == "adopted"]
    assert adopted[0].name == name and adopted[0].why == REASONS["better"][1]
    # four standard errors, and a twentieth of the change for what is not linear in it
    change = getattr(after, field) - getattr(TABLE_2, field)
    found = getattr(state.twin, field)
    assert abs(found - getattr(after, field)) < 4.0 * adopted[-1].standard_error + 0.05 * abs(change)
    twins, axis = state.predictions, ("pitch", "elevation", "travel").index(adopted[0].axis)
    assert twins.used.rms(plan.window)[axis] < twins.alone.rms(plan.window)[axis]
    assert compare_errors(twins.used.errors, twins.alone.errors, (axis,))[0] < 0.0
    at = round(adopted[0].time_s / H) - 1
    begin, end = [getattr(states[at + k].twin, field) for k in (0, 1)]
    assert begin == getattr(TABLE_2, field) != end


@pytest.mark.parametrize("bend", [0.0, 0.3])
def test_a_rotor_that_lost_thrust_is_told_from_a_gain_also_where_the_thrust_bends(bend):
    gains = {field: getattr(TABLE_2, field) / (1.0 + 2.25 * bend) for field in ("k_x", "k_z", "k_y")}  # lift at 2.25 V
    before = TABLE_2._replace(**gains, quadratic_thrust_rotors=bend)
    rows = changing_rig(60.0, before._replace(share_front=0.8), change=30.0, seed=5, before=before)
    state, events, _, _ = follow(rows, parameters=before)
    assert [event.name for event in events if event.what == "adopted"][:1] == ["rotor.front"]
    p = state.twin
    assert p.share_front == pytest.approx(0.8, abs=0.03) and p._replace(share_front=1.0) == before  # 3 standard errors


@lru_cache(maxsize=1)
def adopted_flight():
    """States of a flight in which the elevation's gain changes and is adopted, up to behind the watch."""
    return follow(changed_rows("elevation.gain"))[2]


def first_state(mode, after=0):
    """Number of the first state of a mode in that flight, from state ``after`` on."""
    return next(k for k, state in enumerate(adopted_flight()[after:], after) if state.mode == mode)


def continue_flight(state, first):
    """Return the state in which the flight goes on from sample ``first`` until something is said, and what is said."""
    for row in changed_rows("elevation.gain")[first:]:
        state, new_events = following.correct(state, Sample(*row), PLAN)
        if new_events:
            break
    return state, new_events


def test_a_change_that_went_on_trial_under_a_wrong_name_is_held_and_the_right_one_tried():
    k, damping = first_state("on trial"), [change.name for change in PLAN.changes].index("elevation.damping")
    state = adopted_flight()[k]
    state, new_events = continue_flight(state._replace(finding=state.finding._replace(change=damping, size=0.2)), k + 1)
    assert [(one.what, one.name) for one in new_events] == [("held", "elevation.damping"), ("alarm", "elevation.gain")]
    assert new_events[0].why == REASONS["outdone"][1]
    assert (state.mode, PLAN.changes[state.finding.change].name) == ("on trial", "elevation.gain")


def test_values_that_predict_worse_than_those_before_are_taken_back():
    """As if the values before had been adopted in place of those after."""
    k = first_state("adopted")
    state = adopted_flight()[k]
    (before,) = state.rival
    after, new_events = continue_flight(state._replace(twin=before, rival=(state.twin,)), k + 1)
    assert [(one.what, one.why) for one in new_events] == [REASONS["worse"]]
    assert (after.mode, after.twin) == ("following", state.twin)
    back = take_back(state, PLAN)
    assert any(state.errors) and not any(back.errors), "values that were given have no standard error"


@pytest.mark.parametrize("late, share, mode", [(10, 0.1, "following"), (10, 0.8, "on trial"), (90, 0.4, "on trial")])
def test_a_size_that_is_off_when_the_watch_ends_is_put_on_trial_again(late, share, mode):
    """As if the gain had gone on by a share of the smallest change that matters, .1 of which is two standard errors."""
    last = first_state("following", first_state("adopted"))
    before = adopted_flight()[last - 1]
    change = PLAN.changes[before.finding.change]
    along = change.direction(before.twin)
    blocks = tuple(shift_block(one, along, -share * change.size) for one in before.blocks[-late:])
    state, _ = following.correct(
        before._replace(blocks=(*before.blocks[:-late], *blocks)), Sample(*changed_rows("elevation.gain")[last]), PLAN
    )
    assert state.mode == mode
    if mode == "on trial":
        assert PLAN.changes[state.finding.change].name == "elevation.gain"
        # the block that has just closed is not one of those
        assert state.finding.size == pytest.approx(share * change.size, abs=4.0 * state.finding.standard_error)


def test_without_corrections_a_change_is_reported_and_held():
    state, events, _, plan = follow(changed_rows("elevation.gain")[:5000], correcting=False)
    assert {event.what for event in events} == {"alarm", "held"}
    assert state.twin == TABLE_2


def test_the_state_comes_back_from_json_to_the_bit_in_the_middle_of_a_trial_and_of_a_gap():
    """A delay fills the plant's memory; every ninth sample is missing, and more around the copies."""
    rows = changed_rows("elevation.gain")[:4800]

    def fresh(k):
        return k % 9 != 0 and k % 400 > 4

    _, _, states, plan = follow(rows, fresh, parameters=TABLE_2._replace(input_delay_rotors=0.02))
    for k in range(2, 4800, 400):
        again = thaw_state(json.loads(json.dumps(states[k - 1])), following.CorrectorState)
        assert again == states[k - 1]
        assert following.correct(again, Sample(*rows[k], float(fresh(k))), plan)[0] == states[k]
    assert {states[k].mode for k in range(2, 4800, 400)} >= {"following", "on trial"}


BANDWIDTH = 6.6
KEPT = math.exp(-H)
F = np.array([[1.0, H, 0.5 * H * H], [0.0, 1.0, H], [0.0, 0.0, KEPT]])
FIRST = np.array([[1.0, 0.0, 0.0]])
STEADY = find_steady_state(BANDWIDTH, H)


def test_the_poles_of_the_observer_are_those_of_a_butterworth_polynomial():
    g = observer_gains(BANDWIDTH, H)
    poles = np.linalg.eigvals(F @ (np.eye(3) - np.outer([g.angle, g.rate, g.torque], FIRST[0])))
    wanted = [np.exp(H * BANDWIDTH * np.exp(1j * angle)) for angle in (math.pi, 2 * math.pi / 3, -2 * math.pi / 3)]
    # a triple of poles near z = 1: rounding of the characteristic polynomial moves them by some 1e-16^(1/3)
    assert np.allclose(np.sort_complex(poles), np.sort_complex(wanted), atol=1e-5)


def test_prediction_and_correction_are_a_kalman_filters_whose_steady_state_has_the_observers_gains():
    """Its own error is that of a covariance which has faded by 100 four times over, 1e-8. Butterworth's poles are the
    optimal ones for h -> 0 and gamma -> 0: the gains differ by the order of omega_o h/10."""
    P = solve_discrete_are(F.T, FIRST.T, np.diag([0.0, 0.0, STEADY.drive]), np.eye(1))
    assert STEADY.variance == pytest.approx(P[0, 0] + 1.0, rel=1e-7)
    assert np.array(STEADY.covariance) == pytest.approx(P - P @ FIRST.T @ FIRST @ P / (P[0, 0] + 1.0), rel=1e-7)
    optimal, _ = correct_covariance(predict_covariance(STEADY.covariance, H, KEPT, STEADY.drive), KEPT)
    assert optimal == pytest.approx(observer_gains(BANDWIDTH, H), rel=0.1 * BANDWIDTH * H)
    root = np.random.default_rng(3).standard_normal((3, 3))
    P = root @ root.T
    found = predict_covariance(rows_of(P), H, KEPT, 0.7)
    assert np.array(found) == pytest.approx(F @ P @ F.T + np.diag([0.0, 0.0, 0.7]))
    gain = P @ FIRST.T / (P[0, 0] + 1.0)
    assert np.array(correct_covariance(rows_of(P), KEPT)[1]) == pytest.approx((np.eye(3) - gain @ FIRST) @ P)


@pytest.mark.parametrize("delay", [0.0, 0.03])
def test_voltages_on_a_straight_line_are_put_back_over_a_gap(delay):
    """After a gap the plant is the one that has seen every voltage, to rounding."""
    rows = quiet_rows(7)
    state, _, _, plan = follow(rows[:600], parameters=TABLE_2._replace(input_delay_rotors=delay))
    front, rear, *angles = rows[600]
    line = [(front + 0.05 * j, rear - 0.02 * j) for j in range(8)]
    state, _ = following.correct(state, Sample(*line[0], *angles), plan)
    observer = state.observer
    for j in range(7):
        observer, _ = observer._replace(voltages=line[j]).advance(line[j], (600 + j) * H, True, plan.alone, plan)
        now = Sample(*line[0], *angles, 0.0) if j < 6 else Sample(*line[7], *angles)
        state, _ = following.correct(state, now, plan)
        assert state.instants == 601 + j
    assert state.observer.memory.state[6:8] == pytest.approx(observer.memory.state[6:8], abs=1e-12)


STOPPED, FROZEN, BACK = (REASONS[why][1] for why in ("stopped", "frozen", "back"))


def test_a_stop_is_said_once_and_a_trial_goes_on_after_it():
    rows = changed_rows("elevation.gain")[:5800]
    state, events, states, plan = follow(rows, lambda k: not 4200 <= k < 4700)
    assert states[4199].mode == "on trial" and {one.shown_mode for one in states[4230:4700]} == {"suspended"}
    stopped, back, adopted = events[-3:]
    assert [(one.why, one.time_s) for one in (stopped, back)] == [(STOPPED, pytest.approx(42.19)), (BACK, 47.0)]
    assert (adopted.what, adopted.name) == ("adopted", "elevation.gain")
    assert adopted.since_s < 33.0 < adopted.time_s - 15.0
    assert abs(adopted.value - 1.2 * TABLE_2.k_z) < 4.0 * adopted.standard_error


def test_an_encoder_that_stands_still_while_the_rig_moves_is_said_once_however_long_it_stands():
    """The observer is not corrected meanwhile: the acceleration with which it held the axis fades within a second."""
    rows = [list(row) for row in quiet_rows(7)]
    for k in range(3000, 3600):
        rows[k][2] = rows[3000][2]
    state, events, _, plan = follow(rows)
    assert [event.why for event in events] == [FROZEN, BACK]
    assert 30.0 < events[0].time_s < 31.0 and events[1].time_s >= 36.0
    assert state.twin == TABLE_2


def test_an_axis_that_is_locked_from_the_start_stops_no_correction():
    """The twin predicts that its travel turns, at a rate that the encoder has never shown."""
    assert "suspended" not in {state.mode for state in follow([[*row[:4], 0.5] for row in quiet_rows(7)[500:1500]])[2]}


def test_an_axis_that_turns_within_a_count_is_not_taken_for_a_stuck_encoder():
    """Its first rate, which the observer here sees a half too large, makes four counts in the time that it takes."""
    for acceleration in (0.005, 0.02, 0.1):  # [rad/s^2]
        encoder = Encoder(-1.0)
        for t in np.arange(-3.0, 3.0, H):
            angle = COUNT * np.round(0.49 - 0.5 * acceleration * t * t / COUNT)
            encoder = encoder.read(angle, -1.5 * acceleration * t, PLAN)
            assert not encoder.is_at_fault(0.0, PLAN)


def test_an_encoder_that_moves_again_does_not_count_until_the_observer_has_settled_and_one_that_stands_is_doubted():
    encoder, counted = Encoder(0.0), []
    for _ in range(PLAN.stuck):
        assert not encoder.is_ignored(PLAN)
        encoder = encoder.read(0.0, 0.0, PLAN)
    assert encoder.is_ignored(PLAN)
    for k in range(PLAN.settling + 1):
        encoder = encoder.read(COUNT * (1 + k % 2), 0.0, PLAN)
        counted.append(not encoder.is_ignored(PLAN))
    assert counted == [False] * PLAN.settling + [True]
    # an alarm waits while one stands from which the rig has gone: .1 rad/s in 20 ms are 2 mrad, 3.3 deviations
    encoder, doubtful, at_fault = Encoder(0.0), [], []
    for _ in range(PLAN.stuck):
        encoder = encoder.read(0.0, 0.1, PLAN)
        doubtful.append(encoder.is_doubtful(6e-4, PLAN))
        at_fault.append(encoder.is_at_fault(6e-4, PLAN))
    assert doubtful == [False] + [True] * (PLAN.stuck - 1)
    assert at_fault == [False] * (PLAN.stuck - 1) + [True]  # for a shorter time a rig with dry friction may stick
    assert not encoder.read(-0.0015, 0.1, PLAN).is_doubtful(6e-4, PLAN)  # it moves
    assert [encoder.read(angle, 0.1, PLAN).is_at_fault(6e-4, PLAN) for angle in (0.014, 0.016)] == [False, True]
