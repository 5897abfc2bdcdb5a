"""The multi-step fit: truth recovered, derivatives, intervals, offsets of logs, what logs do not determine."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from heli_identifier.records import Log
from heli_identifier.tracing.multistep.fit import fit_multistep
from heli_identifier.tracing.multistep.horizons import Starts
from heli_identifier.tracing.multistep.normal import HELD_MEAN, normal_equations
from heli_identifier.tracing.multistep.priors import EVERYTHING, coordinates
from heli_identifier.tracing.multistep.problem import OFFSETS, Multistep
from heli_identifier.tracing.multistep.robust import loss, robust_scales, weights
from heli_identifier.tracing.multistep.search import Search
from heli_identifier.tracing.prediction.fit import BASE
from heli_identifier.tracing.prediction.start import first_estimate
from heli_plant.parameters import TABLE_2
from tests.simulated import drive, exact, noisy


def problem_of(records):
    return Multistep(tuple(Starts(record) for record in records), first_estimate(records, TABLE_2))


@cache
def noisy_records(plant, seed, count=3, seconds=40.0):
    return [coarse(noisy(plant, drive(seconds, 10 * seed + i), 10 * seed + i, name=f"log {i}")) for i in range(count)]


def coarse(record, factor=4):
    """Record at 25 Hz, which multi-step predictions are content with."""
    voltages = record.voltages.reshape(-1, factor, 2).mean(axis=1)
    return Log(record.name, record.rate_hz / factor, voltages, record.angles[::factor])


@pytest.mark.parametrize("field", EVERYTHING)
def test_coordinates_lead_back_to_the_value(field):
    (c,) = coordinates([field], TABLE_2)
    value = c.value(0.4)
    assert c.coordinate(value) == pytest.approx(0.4)
    assert (c.value(0.4 + 1e-6) - value) / 1e-6 == pytest.approx(c.slope(value), rel=1e-5)


def test_gains_keep_the_sign_of_the_wiring():
    reversed_wiring = TABLE_2._replace(k_x=-0.3, k_y=0.1)
    for c in coordinates(("k_x", "k_y", "k_z"), reversed_wiring):
        assert all(np.sign(c.value(x)) == np.sign(getattr(reversed_wiring, c.field)) for x in (-3.0, 0.0, 3.0))


def test_exact_logs_give_the_parameters_back():
    plant = TABLE_2._replace(dry_friction_travel=0.02, quadratic_thrust_rotors=0.05)
    records = [exact(plant, drive(40.0, seed), f"log {seed}")[0] for seed in range(2)]
    fit = fit_multistep(problem_of(records), (*BASE, "dry_friction_travel", "quadratic_thrust_rotors"))
    assert fit.converged
    for field in ("k_x", "k_z", "k_y", "a_th", "a_e", "quadratic_thrust_rotors"):
        # the smoothed rates of the start are off by up to 1 % of a motion at .6 Hz
        assert getattr(fit.parameters, field) == pytest.approx(getattr(plant, field), rel=0.05), field
    assert fit.parameters.dry_friction_travel == pytest.approx(0.02, abs=0.004)


def test_gradient_is_that_of_the_objective():
    problem = problem_of(noisy_records(TABLE_2, 1))
    frame = coordinates((*BASE, "constant_torque_pitch", "quadratic_drag_elevation"), problem.base)
    x = np.array([c.coordinate(getattr(problem.base, c.field)) for c in frame]) + 0.05
    search = Search.begun(problem, frame, x)
    gradient = search.normal_equations().gradient
    for i in range(len(x)):
        step = np.zeros(len(x))
        step[i] = 1e-5
        ahead, behind = (search.moved(x + sign * step, search.offsets).objective() for sign in (1.0, -1.0))
        numeric = (ahead - behind) / 2e-5
        # sensitivities are forward differences of 1e-4 of a parameter
        assert gradient[i] == pytest.approx(numeric, rel=0.02, abs=0.02 * np.abs(gradient).max()), frame[i].field


def test_intervals_cover():
    fields, hits, total = ("a_wx", "a_th", "k_x", "theta0", "a_e", "k_z", "a_wy", "k_y"), 0, 0
    for seed in range(10):
        fit = fit_multistep(problem_of(noisy_records(TABLE_2, seed)))
        for field in fields:
            estimate = fit.estimate(field)
            hits += abs(estimate.value - getattr(TABLE_2, field)) < 1.96 * estimate.standard_error
            total += 1
    # 80 intervals, those of one fit correlated: nominal 76, and not below 64 by chance
    assert hits >= 64


def test_intervals_know_that_the_mean_of_a_few_logs_is_not_that_of_the_rig():
    hits, runs = 0, 8
    for run in range(runs):
        torques = 0.01 * np.random.default_rng(run).standard_normal(3)
        records = [
            noisy(
                TABLE_2._replace(constant_torque_pitch=float(c)), drive(40.0, 3 * run + i), 3 * run + i, name=f"log {i}"
            )
            for i, c in enumerate(torques)
        ]
        estimate = fit_multistep(problem_of(records)).estimate("theta0")
        hits += abs(estimate.value - TABLE_2.theta0) < 1.96 * estimate.standard_error
    # the mean torque moves theta0 by .01 / 3^.5 / a_th = .009 rad, twenty times what one log's noise does; six of eight
    # intervals hold the truth with a probability of .99 if they are of 95 %
    assert hits >= 6


def test_offsets_of_logs_are_found_and_leave_the_common_values_alone():
    torques = (-0.02, 0.0, 0.02)
    records = [
        noisy(TABLE_2._replace(constant_torque_travel=c), drive(40.0, i), i, name=f"log {i}")
        for i, c in enumerate(torques)
    ]
    fit = fit_multistep(problem_of(records))
    found = fit.offsets[:, OFFSETS.index("constant_torque_travel")]
    assert np.corrcoef(found, torques)[0, 1] > 0.9
    assert abs(found.mean()) < 1e-3
    assert fit.parameters.k_y == pytest.approx(TABLE_2.k_y, rel=0.1)


def test_what_all_logs_share_is_no_offset():
    plant = TABLE_2._replace(constant_torque_travel=0.08)
    problem = problem_of(noisy_records(plant, 2))
    with_torque = fit_multistep(problem, (*BASE, "constant_torque_travel"))
    assert with_torque.parameters.constant_torque_travel == pytest.approx(0.08, abs=0.02)
    without = fit_multistep(problem)
    assert np.abs(without.offsets.mean(axis=0)).max() < 1e-3


def test_fit_says_what_the_logs_do_not_determine():
    # all elevations lie a radian and more above the ground, and rotors never reverse here
    voltages = np.abs(drive(40.0, 3)) + 0.5
    record = noisy(TABLE_2, voltages, 3)
    fit = fit_multistep(problem_of([record]), (*BASE, "reverse_thrust_loss_rotors", "constant_torque_travel"))
    assert "reverse_thrust_loss_rotors" in fit.undetermined
    assert not {"k_x", "k_y", "constant_torque_travel"} & set(fit.undetermined)
    assert fit.estimate("reverse_thrust_loss_rotors").standard_error == pytest.approx(1.0 / 3.0, rel=0.01)


def test_touch_by_a_hand_hardly_moves_a_robust_fit():
    records = noisy_records(TABLE_2, 4)
    angles = records[0].angles.copy()
    angles[375:, 2] += 0.5 * (1.0 - np.exp(-np.arange(len(angles) - 375) * 0.08))
    touched = [Log("touched", records[0].rate_hz, records[0].voltages, angles), *records[1:]]
    clean, disturbed = (fit_multistep(problem_of(r)) for r in (records, touched))
    # the hand turns the arm by half a radian, twenty times what a prediction of 2 s is off by
    assert disturbed.parameters.k_y == pytest.approx(clean.parameters.k_y, rel=0.1)


def test_damping_is_never_negative():
    records = noisy_records(TABLE_2._replace(a_wz=-0.02), 5)
    assert fit_multistep(problem_of(records)).parameters.a_wz == 0.0


def test_start_whose_predictions_diverge_is_passed_over():
    problem = problem_of(noisy_records(TABLE_2, 1))
    mad = problem.base._replace(quadratic_thrust_rotors=1e200)
    fit = fit_multistep(problem, (*BASE, "quadratic_thrust_rotors"), (problem.base, mad))
    assert np.isfinite(fit.objective)
    with pytest.raises(ValueError, match="diverge"):
        fit_multistep(replace(problem, base=mad), BASE)


def test_arrow_of_the_normal_equations_is_least_squares():
    random = np.random.default_rng(0)
    J = [random.standard_normal((n, 3, 3, 6)) for n in (30, 40)]
    e = [random.standard_normal((n, 3, 3)) for n in (30, 40)]
    W = [random.uniform(0.5, 2.0, e_.shape) for e_ in e]
    system = normal_equations(J, e, W, np.zeros(2), np.zeros((2, 4)), np.ones(4))
    columns = np.zeros((70 * 9, 10))
    columns[: 30 * 9, :6] = J[0].reshape(-1, 6)
    columns[30 * 9 :, :2], columns[30 * 9 :, 6:] = J[1].reshape(-1, 6)[:, :2], J[1].reshape(-1, 6)[:, 2:]
    root = np.sqrt(np.concatenate([w.ravel() for w in W]))
    mean_held = np.hstack((np.zeros((4, 2)), np.eye(4), np.eye(4)))
    stacked = np.vstack((columns * root[:, None], np.eye(10), np.sqrt(HELD_MEAN / 2) * mean_held))
    target = np.concatenate((-root * np.concatenate([e_.ravel() for e_ in e]), np.zeros(14)))
    direct = np.linalg.lstsq(stacked, target, rcond=None)[0]
    never = np.zeros(2, dtype=bool)
    step, offsets = system.step(0.0, never, never)
    np.testing.assert_allclose(step, direct[:2], rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(offsets.ravel(), direct[2:], rtol=1e-4, atol=1e-6)


def test_robust_loss_is_square_near_zero_and_linear_far_out():
    problem = problem_of(noisy_records(TABLE_2, 1))
    errors = problem.errors(problem.base, np.zeros((3, 4)))
    scales = robust_scales(problem, errors)
    near = [1e-3 * e for e in errors]
    assert loss([2 * e for e in near], scales) == pytest.approx(4 * loss(near, scales))
    far = [1e6 * e for e in errors]
    assert loss([2 * e for e in far], scales) == pytest.approx(2 * loss(far, scales), rel=1e-3)
    assert loss([np.full_like(errors[0], np.nan)], scales) == np.inf
    for weight, starts in zip(weights(problem, errors, scales), problem.records, strict=True):
        assert (weight[np.isnan(starts.measured)] == 0.0).all()
