"""The running score: shows what is there, keeps quiet about what is not, and says when it cannot know."""

from math import exp
from pathlib import Path

import numpy as np
import pytest
import scipy.signal

import heli_identifier
from heli_identifier.online import WATCHABLE, IdentifierSettings, prepare
from heli_identifier.online.excitation import paper_excitation
from heli_identifier.online.linear_algebra import outer
from heli_identifier.online.moments import add_products, no_moments, weighted_blocks
from heli_identifier.online.signals import advance_signals, settled_signals
from heli_identifier.online.watch import (
    NOTHING,
    Motion,
    advance_watch,
    candidate,
    candidate_value,
    discretised_rates,
    scores,
    settled_watch,
)  # fmt: skip
from heli_plant.effects import effect
from heli_plant.laws import thrust_voltages
from heli_plant.parameters import TABLE_2
from heli_plant.plant import accelerations
from tests.simulated import identified, multisines, record

INTERVAL = 0.2
LOGS = Path(heli_identifier.__file__).parent / "demo_logs"
EVERY_PAIR = tuple((name, axis) for axis in WATCHABLE for name in WATCHABLE[axis])


def watched(held, angles, pairs, **settings):
    _, estimate = identified(held, angles, IdentifierSettings(watched=pairs, **settings))
    return dict(zip(pairs, estimate.scores, strict=True))


def scored(z):
    """The scores of the columns between two base regressors and y."""
    m = no_moments(z.shape[1])
    for row in z.tolist():
        m = add_products(m, outer(row), 1.0, INTERVAL, 0.0, 20.0)
    return scores(*weighted_blocks(m, 0.0, INTERVAL), 2, z.shape[1] - 3, INTERVAL, False)


ONE_SECOND = exp(-INTERVAL)
"""Pole of noise that is correlated over 1 s."""


def slow(count, columns, seed, pole=ONE_SECOND):
    white = np.random.default_rng(seed).standard_normal((count + 300, columns))
    return scipy.signal.lfilter([1.0 - pole], [1.0, -pole], white, axis=0)[300:]


def test_the_coefficient_is_that_of_the_joint_regression():
    z = slow(800, 4, seed=3)
    z[:, 3] = z[:, :3] @ [1.0, -0.5, 0.2] + 0.05 * slow(800, 1, seed=4)[:, 0]
    joint, *_ = np.linalg.lstsq(z[:, :3], z[:, 3], rcond=None)
    (found,) = scored(z)
    # Frisch, Waugh, Lovell: the same number by another way.
    assert found.coefficient == pytest.approx(joint[2], rel=1e-9)
    assert found.score > 10.0


def test_false_alarms_stay_rare_under_coloured_residuals():
    alarms, naive_alarms, runs = 0, 0, 100
    for seed in range(runs):
        z = slow(1500, 4, seed=100 + seed)
        noise = slow(1500, 1, seed=5000 + seed, pole=exp(-INTERVAL / 3.0))[:, 0]
        z[:, 3] = z[:, :2] @ [1.0, -0.5] + noise
        (found,) = scored(z)
        alarms += abs(found.score) > 3.0
        white_error = noise.std() / np.sqrt(z[:, 2] @ z[:, 2])
        naive_alarms += abs(found.coefficient) / white_error > 3.0
    # Nominal .9 % for a t of ten degrees of freedom; 4 % is three standard deviations of 100 draws above 1 %. A score
    # that takes the residual for white would accuse more often than one in ten.
    assert alarms / runs <= 0.04
    assert naive_alarms / runs > 0.1


def test_dependent_regressors_and_a_candidate_that_is_hardly_seen_or_only_once_get_no_score():
    z = slow(1500, 4, seed=8)
    z[:, 2] = z[:, 0] + z[:, 1] + 1e-3 * z[:, 2]
    assert scored(z) == (NOTHING,)
    z[:, 1] = 2.0 * z[:, 0]
    assert scored(z) == (NOTHING,)
    z = slow(1500, 4, seed=6)
    z[:700, 2] = z[720:, 2] = 0.0
    assert scored(z) == (NOTHING,)


@pytest.mark.parametrize(("name", "axis"), EVERY_PAIR)
def test_a_candidate_is_what_its_effect_adds_to_the_plants_acceleration(name, axis):
    c = candidate(name, axis)
    m = Motion(0.3, -0.2, 1.7, 0.4, -0.3, 0.5, 1.9, -0.8, 0.25)
    if c.in_rotors:
        entry, strength = effect(name, "rotors"), 0.1
    else:
        entry, strength = effect(name, axis), 0.02
    changed = TABLE_2._replace(**{entry.field: strength})
    row = ("pitch", "elevation", "travel").index(axis)

    def acceleration(p):
        mu_diff, mu_sum = thrust_voltages(m.nu_front, m.nu_rear, 0.0, p)
        motion = (m.pitch, m.elevation, m.travel, m.pitch_rate, m.elevation_rate, m.travel_rate)
        return accelerations(0.0, *motion, mu_diff, mu_sum, 0.0, m.cable_rest, (True, True, True), p)[row]

    gain = (TABLE_2.k_x, TABLE_2.k_z, TABLE_2.k_y)[row] if c.times_gain else 1.0
    added = acceleration(changed) - acceleration(TABLE_2)
    # Rounding of a difference of accelerations of order one, over a strength of .02.
    assert gain * strength * candidate_value(c, m) == pytest.approx(added, abs=1e-14)


@pytest.mark.parametrize(
    ("field", "strength", "pair", "tolerance"),
    [
        ("dry_friction_pitch", 0.02, ("dry_friction", "pitch"), 0.15),
        ("quadratic_drag_elevation", 0.2, ("quadratic_drag", "elevation"), 0.15),
        ("cable_stiffness_travel", 0.002, ("cable_stiffness", "travel"), 0.05),
        ("gyroscopic_coupling_elevation", 0.01, ("gyroscopic_coupling", "elevation"), 0.05),
        ("quadratic_thrust_rotors", 0.05, ("quadratic_thrust", "travel"), 0.2),
    ],
)
def test_an_effect_in_the_plant_shows_with_its_sign_and_size(field, strength, pair, tolerance):
    held, angles, _ = record(90.0, multisines(seed=11, period=90.0), TABLE_2._replace(**{field: strength}))
    found = watched(held, angles, (pair,), filter_frequency=2.0)[pair]
    assert found.score > 10.0
    # Rates are smoothed before the law sees them, which costs a sharp law some of its corners; effects of the rotors
    # are divided by a gain that was fitted without them and has taken up a share, 2 c mu of some 10 %.
    assert found.coefficient == pytest.approx(strength, rel=tolerance)


@pytest.mark.parametrize(
    ("rig", "shown"),
    [
        ("rig-a", {("dry_friction", "pitch")}),
        ("rig-b", {("quadratic_thrust", axis) for axis in ("pitch", "elevation", "travel")}),
        ("rig-c", set()),
    ],
)
def test_measured_logs_show_their_effect_and_nothing_else_so_surely(rig, shown):
    table = np.loadtxt(LOGS / rig / "train2.csv", delimiter=",", skiprows=1)
    found = watched(table[:, 1:3], table[:, 3:6], EVERY_PAIR, filter_frequency=2.0)
    best = {pair: abs(score.score) for pair, score in found.items()}
    for pair in shown:
        assert found[pair].score > 5.0
    # Relatives of an effect on the same axis share its score; on the axes where nothing is hidden all is quiet.
    quiet = [score for (_, axis), score in best.items() if axis not in {axis for _, axis in shown}]
    assert not quiet or max(quiet) < 4.0


def test_scores_come_in_the_order_of_the_settings_and_change_no_estimate():
    held, angles, _ = record(60.0, paper_excitation(1))
    pairs = (("dry_friction", "travel"), ("rotor_mismatch", "pitch"), ("dry_friction", "pitch"))
    results = [identified(held, angles, IdentifierSettings(watched=chosen))[1] for chosen in (pairs, pairs[::-1], ())]
    # The columns of one axis change places with the order, and with them the order of sums.
    for one, other in zip(results[0].scores, results[1].scores[::-1], strict=True):
        assert tuple(one) == pytest.approx(tuple(other), rel=1e-6)
    assert results[0].parameters == results[2].parameters
    assert results[0].sigma == results[2].sigma
    assert tuple(results[0].standard_errors) == pytest.approx(tuple(results[2].standard_errors), rel=1e-9)


def test_for_prediction_errors_a_law_uses_nothing_of_the_newest_sample():
    """Its filtered value is the same whatever the newest angle is, which the adaptation's is not."""
    f, friction = prepare(IdentifierSettings()).filter, (candidate("dry_friction", "pitch"),)

    def moved(s, pitch):
        return advance_signals(s, (1.0, 1.0, pitch, 0.1, 0.0), 0.01, 0.08, 5.0, f)

    before = settled_signals((1.0, 1.0, 0.0, 0.1, 0.0), 5.0)
    moving = moved(before, 0.02)
    for held in (True, False):
        d = discretised_rates(0.01, held)
        w = advance_watch(settled_watch(before, friction), moving, friction, d, held, f)
        up, down = (advance_watch(w, moved(moving, angle), friction, d, held, f).filtered for angle in (0.2, -0.2))
        assert (up == down) == held
