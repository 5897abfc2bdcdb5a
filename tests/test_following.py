"""The following twin: the observer, Page's test, the name and size of a change, and when it is adopted."""

import json
import math

import numpy as np
import pytest

from heli_identifier.errors import ConfigurationError
from heli_identifier.following import (
    HEARD,
    MODES,
    FollowSettings,
    Sample,
    Told,
    correct,
    event_document,
    frozen_state,
    parameters_in_use,
    prepare_following,
    shares_in_use,
    start_correcting,
    thawed_state,
)
from heli_identifier.following.adoption import adopted
from heli_identifier.following.baseline import Coefficients, discounted, learned_from
from heli_identifier.following.blocks import Block, Sums, added, multiplied, no_sums, shifted
from heli_identifier.following.detection import AT_ZERO, lowered, paged, threshold
from heli_identifier.following.errors import compared
from heli_identifier.following.naming import compass_of
from heli_plant.observer import observer_gains
from heli_plant.parameters import TABLE_2
from tests.following import H, documents, followed, record

# --- observer and sums ---------------------------------------------------------------------------------------------


def test_the_poles_of_the_observer_are_those_of_a_butterworth_polynomial():
    bandwidth = 6.6
    g = observer_gains(bandwidth, H)
    F = np.array([[1.0, H, 0.5 * H * H], [0.0, 1.0, H], [0.0, 0.0, g.kept]])
    poles = np.linalg.eigvals(F @ (np.eye(3) - np.outer([g.angle, g.rate, g.torque], [1.0, 0.0, 0.0])))
    wanted = [np.exp(H * bandwidth * np.exp(1j * angle)) for angle in (math.pi, 2 * math.pi / 3, -2 * math.pi / 3)]
    # a triple of poles near z = 1: rounding of the characteristic polynomial moves them by some 1e-16^(1/3)
    assert np.allclose(np.sort_complex(poles), np.sort_complex(wanted), atol=1e-5)


def test_blocks_after_an_adoption_are_those_of_a_twin_that_had_the_change():
    rng = np.random.default_rng(1)
    psi, theta = rng.standard_normal((50, 3)), (0.3, -0.2, 0.5)
    e = rng.standard_normal(50)

    def block(errors):
        sums: Sums = no_sums(3)
        for row, error in zip(psi, errors, strict=True):
            sums = multiplied(added(sums, tuple(row), float(error)))
        r = tuple(sums.products[i] for i in (0, 1, 2, 4, 5, 7))
        b = tuple(sums.products[i] for i in (3, 6, 8))
        return Block((r, (), ()), (b, (), ()))

    moved = shifted(block(e), (theta, (), ()))
    assert np.allclose(moved.response[0], block(e - psi @ theta).response[0], rtol=1e-12)


# --- Page's test ---------------------------------------------------------------------------------------------------


def alarm_times(count, limit, nu, information, longest, rng):
    """Blocks until the first alarm of one two-sided test without a change."""
    up, down = np.zeros(count), np.zeros(count)
    times = np.full(count, longest)
    for k in range(longest):
        response = math.sqrt(information) * rng.standard_normal(count)
        drift = 0.5 * nu * nu * information
        up, down = np.maximum(0.0, up + nu * response - drift), np.maximum(0.0, down - nu * response - drift)
        times = np.where((times == longest) & (np.maximum(up, down) > limit), k + 1, times)
    return times


@pytest.mark.parametrize("information", [0.3, 3.0, 30.0, 300.0])
def test_the_mean_time_between_false_alarms_is_the_stated_one(information):
    """Siegmund's threshold, for two tests and 1000 blocks.

    The simulation's own error is some 4 % of the mean. Siegmund's approximation is one for small steps; it errs to the
    safe side, the more the larger they are.
    """
    asked = 1000.0
    limit = lowered(threshold(2, asked, 1.0), information)
    times = alarm_times(600, limit, 1.0, information, 20000, np.random.default_rng(2))
    assert times.mean() > 0.9 * asked
    if information <= 3.0:
        assert times.mean() < 1.3 * asked


@pytest.mark.parametrize("information", [0.0, 0.3, 3.0, 30.0, 300.0])
def test_the_threshold_lies_below_the_bound_by_lorden_by_a_few_nats(information):
    assert 10.0 - 3.4 < lowered(10.0, information) < 10.0 - 1.6


# --- the baseline --------------------------------------------------------------------------------------------------


def packed(matrix):
    return tuple(float(matrix[i, j]) for i in range(len(matrix)) for j in range(i, len(matrix)))


def test_a_block_as_the_tests_see_it_has_the_likelihood_of_a_twin_whose_values_err():
    """ln p(b | delta) - ln p(b | 0) of b ~ N(R (m + delta D), R + R P R), computed with the dense covariance."""
    rng = np.random.default_rng(5)
    psi = rng.standard_normal((9, 4))
    r, b = psi.T @ psi, rng.standard_normal(4)
    a = rng.standard_normal((4, 4))
    p, m, d = a @ a.T, rng.standard_normal(4), rng.standard_normal(4)
    w, u = discounted(packed(r), tuple(b), Coefficients(tuple(m), tuple(p.ravel())))
    inverse = np.linalg.inv(r + r @ p @ r)
    rest, moved = b - r @ m, b - r @ (m + 0.3 * d)
    wanted = 0.5 * (rest @ inverse @ rest - moved @ inverse @ moved)
    upper = np.zeros((4, 4))
    upper[np.triu_indices(4)] = w
    full = upper + upper.T - np.diag(np.diag(upper))
    assert 0.3 * d @ u - 0.045 * d @ full @ d == pytest.approx(wanted, rel=1e-9)


def test_the_baseline_is_bayes_estimate_and_wanders_within_its_prior():
    """The dense recursion of a linear model with a Gaussian prior, then a share of 1/1800 back to that prior."""
    rng = np.random.default_rng(6)
    theta, deviation = np.array([0.5, -1.0, 0.2]), (1.0, 2.0, 0.5)
    prior, kept = np.diag(np.square(deviation)), math.exp(-1.0 / 1800.0)
    own = Coefficients((0.0,) * 3, tuple(prior.ravel()))
    m, p = np.zeros(3), prior
    for _ in range(3):
        psi = rng.standard_normal((20, 3))
        r, b = psi.T @ psi, psi.T @ (psi @ theta + rng.standard_normal(20))
        own = learned_from(*discounted(packed(r), tuple(b), own), own, deviation)
        after = np.linalg.inv(np.linalg.inv(p) + r)
        m = kept * after @ (np.linalg.solve(p, m) + b)
        p = kept**2 * after + (1.0 - kept**2) * prior
    assert np.allclose(own.mean, m, rtol=1e-9)
    assert np.allclose(np.reshape(own.covariance, (3, 3)), p, rtol=1e-8, atol=1e-12)


def test_a_twin_whose_stiffness_errs_gives_no_alarm_in_large_motions():
    """The stiffness of the elevation errs by 1.5 %; in a swing of .7 rad that is .027 rad/s^2, beyond half of nu."""
    rows = record(80.0, before=TABLE_2._replace(a_e=1.015 * TABLE_2.a_e), lift=5.0)
    assert np.ptp([row[3] for row in rows]) > 1.4
    _, events, _, _ = followed(rows)
    assert events == []


def test_the_simulated_test_is_the_one_that_flies():
    rng = np.random.default_rng(3)
    pages, up = (AT_ZERO,), 0.0
    for response in rng.standard_normal(100):
        pages = paged(pages, ((float(response), 1.0),), (0.5,))
        up = max(0.0, up + 0.5 * response - 0.125)
    assert pages[0].up == pytest.approx(up, abs=1e-12)


def test_a_twin_that_errs_by_less_than_half_the_smallest_change_drifts_away_from_the_threshold():
    pages = (AT_ZERO,)
    for _ in range(1000):
        pages = paged(pages, ((0.4 * 5.0, 5.0),), (1.0,))  # delta = .4 nu, without noise
    assert pages[0] == AT_ZERO


# --- the gate ------------------------------------------------------------------------------------------------------


def test_errors_are_compared_on_the_axes_that_change_alone():
    used = tuple((0.01, 0.0, 0.01 * (-1) ** k) for k in range(40))
    rival = tuple((0.02, 0.0, 0.005 * (-1) ** k) for k in range(40))
    assert compared(rival, used, (2,))[0] == pytest.approx(-0.75)
    assert compared(rival, used, (0,))[0] == pytest.approx(3.0)


def test_an_unchanged_rig_gives_no_alarm():
    _, events, outputs, _ = followed(record(70.0))
    assert events == []
    assert MODES[outputs[-1].mode] == "following"


CHANGES = {
    "pitch.gain": (TABLE_2._replace(k_x=0.75 * TABLE_2.k_x), "k_x"),
    "elevation.gain": (TABLE_2._replace(k_z=1.2 * TABLE_2.k_z), "k_z"),
    "elevation.offset": (TABLE_2._replace(a_1=TABLE_2.a_1 - 0.08), "a_1"),
    "effects.dry_friction.travel": (TABLE_2._replace(dry_friction_travel=0.04), "dry_friction_travel"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_is_noticed_named_measured_and_adopted(name):
    after, field = CHANGES[name]
    state, events, outputs, plan = followed(record(90.0, after, 30.0, seed=4))
    said = documents(events, plan)
    assert said[0]["what"] == "alarm"
    assert 30.0 < said[0]["time_s"] < 50.0
    adopted = [one for one in said if one["what"] == "adopted"]
    assert [one["name"] for one in adopted][:1] == [name]
    found = getattr(parameters_in_use(state, plan), field)
    # four standard errors, and a twentieth of the change for what is not linear in it
    change = getattr(after, field) - getattr(TABLE_2, field)
    assert abs(found - getattr(after, field)) < 4.0 * adopted[-1]["standard_error"] + 0.05 * abs(change)
    last = [output for output in outputs if output.compared][-1]
    axis = ("pitch", "elevation", "travel").index(adopted[0]["axis"])
    assert last.error[axis] < last.error_alone[axis]


def test_a_rotor_that_lost_thrust_is_told_from_a_gain():
    state, events, _, plan = followed(record(90.0, change=30.0, seed=5, front=0.8))
    assert [one["name"] for one in documents(events, plan) if one["what"] == "adopted"][:1] == ["rotor.front"]
    front, rear = shares_in_use(state)
    assert front == pytest.approx(0.8, abs=0.03)  # three standard errors
    assert rear == 1.0
    p = parameters_in_use(state, plan)
    assert p.k_x == pytest.approx(0.5 * (front + rear) * TABLE_2.k_x)
    assert p.rotor_mismatch_pitch == pytest.approx(0.5 * (front - rear) * TABLE_2.k_x)


def test_a_change_that_went_on_trial_under_a_wrong_name_is_held_and_the_right_one_tried():
    """Friction that was named damping: both brake, and only motions at different rates tell them apart."""
    after, _ = CHANGES["effects.dry_friction.travel"]
    rows = record(75.0, after, 30.0, seed=4)
    plan = prepare_following(FollowSettings())
    state, events, misnamed = start_correcting(plan, Sample(*rows[0])), [], False
    for row in rows[1:]:
        state, output = correct(state, Sample(*row), Told(), plan)
        events.extend(output.events)
        if MODES[state.mode] == "on trial" and not misnamed:
            misnamed = True
            damping = [change.name for change in plan.changes].index("travel.damping")
            state = state._replace(finding=state.finding._replace(change=damping, size=0.2))
    said = [(one["what"], one["name"]) for one in documents(events, plan) if one["time_s"] > 30.0][2:5]
    friction = "effects.dry_friction.travel"
    assert said == [("held", "travel.damping"), ("alarm", friction), ("adopted", friction)]


def test_a_change_that_went_on_while_it_was_watched_is_put_on_trial_again():
    """The last ten blocks alone tell of what is left: in the mean over all blocks since the change it is too little."""
    after, _ = CHANGES["elevation.gain"]
    rows = record(75.0, after, 30.0, seed=4)
    plan = prepare_following(FollowSettings())
    state = start_correcting(plan, Sample(*rows[0]))
    before = state
    for row in rows[1:]:
        before = state
        state, _ = correct(state, Sample(*row), Told(), plan)
        if MODES[before.mode] == "adopted" and MODES[state.mode] == "following":
            break
    twins = before.twins  # the watch ends with the next comparison
    before = before._replace(
        twins=twins._replace(rival=twins.rival[-1:] + twins.rival, against=twins.against[-1:] + twins.against)
    )
    number, compass = before.finding.change, compass_of(before, plan)
    assert plan.changes[number].name == "elevation.gain"
    # what the last ten blocks would be had the gain gone on by a tenth of its smallest change that matters ...
    for share, mode in ((0.1, "following"), (0.8, "on trial")):
        left = -share * plan.sizes[number]
        theta = tuple(tuple(left * x for x in row) for row in compass[number])
        moved = before._replace(blocks=(*before.blocks[:-10], *(shifted(one, theta) for one in before.blocks[-10:])))
        ended, _ = adopted(moved, compass, 70.0, plan)
        assert MODES[ended.mode] == mode
    # ... and by most of it
    assert 8 <= ended.finding.blocks <= 12
    assert ended.finding.size == pytest.approx(0.8 * plan.sizes[number], abs=4.0 * ended.finding.standard_error)


def test_what_is_adopted_is_ramped_in_over_two_seconds():
    after, _ = CHANGES["elevation.gain"]
    _, events, outputs, plan = followed(record(60.0, after, 30.0, seed=4))
    at = next(event.time for event in events if event_document(event, plan.changes)["what"] == "adopted")
    place = plan.changeable.index("elevation.gain")
    values = {round(output.time, 2): output.values[place] for output in outputs}
    begin, middle, end = values[at], values[round(at + 1.0, 2)], values[round(at + 2.0, 2)]
    assert begin == TABLE_2.k_z
    assert middle == pytest.approx(0.5 * (begin + end))


def test_without_corrections_a_change_is_reported_and_held():
    after, _ = CHANGES["elevation.gain"]
    state, events, _, plan = followed(record(50.0, after, 30.0, seed=4), correcting=False)
    said = documents(events, plan)
    assert {one["what"] for one in said} == {"alarm", "held"}
    assert parameters_in_use(state, plan) == TABLE_2


@pytest.mark.parametrize("moved, what", [(+0.02, "adopted"), (-0.02, "held")])
def test_a_change_that_the_identifier_contradicts_is_held(moved, what):
    """k_z falls by 20 %; the identifier, with a standard error of .002, says that it has moved by .02 either way."""
    plan = prepare_following(FollowSettings())
    rows = record(60.0, TABLE_2._replace(k_z=0.8 * TABLE_2.k_z), 30.0, seed=4)
    state, events = start_correcting(plan, Sample(*rows[0])), []
    errors = (0.002,) * len(HEARD)
    for k, row in enumerate(rows[1:], 1):
        says = [getattr(TABLE_2, field) for field in HEARD]
        says[HEARD.index("k_z")] -= moved if k > 3100 else 0.0
        state, output = correct(state, Sample(*row), Told((1.0, 1.0, 1.0), (), tuple(says), errors), plan)
        events.extend(output.events)
    last = [one for one in documents(events, plan) if one["what"] in ("adopted", "held")][0]
    assert (last["name"], last["what"]) == ("elevation.gain", what)
    assert ("identifier" in last["why"]) == (what == "held")


# --- state and settings --------------------------------------------------------------------------------------------


def test_the_state_comes_back_from_json_to_the_bit_in_the_middle_of_a_trial():
    after, _ = CHANGES["elevation.gain"]
    rows = record(60.0, after, 30.0, seed=4)
    state, _, outputs, plan = followed(rows[:4200])
    assert MODES[outputs[-1].mode] == "on trial"
    again = thawed_state(json.loads(json.dumps(frozen_state(state))), plan)
    for row in rows[4200:4400]:
        state, output = correct(state, Sample(*row), Told(), plan)
        again, same = correct(again, Sample(*row), Told(), plan)
        assert same == output


@pytest.mark.parametrize(
    "settings, said",
    [
        ({"sample_time": 0.5}, "sample_time = 0.5 s must lie in"),
        ({"window": 1.0}, "window = 1.0 s must lie in"),
        ({"effects": (("dry_friction", "rotors"),)}, "watched axis 'rotors'"),
    ],
)
def test_bad_settings_are_refused(settings, said):
    with pytest.raises(ConfigurationError, match=said):
        prepare_following(FollowSettings(**settings))
