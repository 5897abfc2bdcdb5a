"""The criterion: scales, sensitivities, chunks, the fit's bounds; the air's torque and its filter beside scipy's."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_lyapunov
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter

from benchmarks.rigs import likelihood_of, log_of, windy_logs
from heli_identifier.chain import MARGIN
from heli_identifier.records import Event, Log
from heli_identifier.results.prediction import encoder_error
from heli_identifier.tracing import helicopter, sensitivity
from heli_identifier.tracing import noise as filters
from heli_identifier.tracing.fit import Fit, bounded_step, covariance, fit, fit_log_spread, known_fit
from heli_identifier.tracing.rig import block_samples, record_of, records_of
from heli_identifier.tracing.settings import COLOURED, OUTLIER, PER_LOG_PRIOR
from heli_plant.laws import thrust_voltage
from heli_plant.parameters import BY_FIELD
from tests.blind.generator import Case
from tests.blind.windy import windy_rig


def logs_of(kind, index=0, count=2, seconds=40.0):
    """Logs of a blind rig in open loop, cut to ``seconds``."""
    made = Case("test", kind, 20).rig(index)
    return [log_of(f"log {n}", 100.0, s[: round(100 * seconds)]) for n, s in enumerate(made.train[:count])], made.truth


@pytest.fixture(scope="module")
def clean():
    """A clean rig in open loop and the fit of the simplified model to it."""
    logs, truth = logs_of("clean")
    likelihood = likelihood_of(logs)
    return logs, truth, fit(likelihood, likelihood.rig.base)


def test_the_scale_minimises_the_criterion(clean):
    """sigma is the minimiser of N ln sigma + sum of Huber's loss: an independent minimisation finds the same."""
    fitted = clean[2]
    record, e = fitted.likelihood.records[0], fitted.e[0]
    counted = np.abs(e[record.weights[:, 0] > 0, 0])

    def F(log_sigma):
        u = counted / np.exp(log_sigma)
        return len(u) * log_sigma + np.where(u < OUTLIER, 0.5 * u * u, OUTLIER * u - 0.5 * OUTLIER**2).sum()

    found = minimize_scalar(F, bracket=(-10.0, -5.0), tol=1e-12)
    value, sigma = fitted.likelihood.data_terms([e], [record])
    assert np.log(sigma[0]) == pytest.approx(found.x, abs=1e-5)
    assert value[0] == pytest.approx(found.fun - 0.5 * len(counted), abs=1e-6 * abs(found.fun))


def test_sensitivities_agree_with_runs_of_the_filter(clean):
    """Columns are secants of the filter to 2 %: the linear error dynamics leave out what is of second order."""
    fitted = clean[2]
    likelihood, point = fitted.likelihood, fitted.point
    quadratic = fitted.quadratic
    record = likelihood.records[0]
    for i, coordinate in enumerate(fitted.coordinates):
        _, step, p, _ = likelihood.move(point, coordinate, fitted.x[i])
        exact = 0.0
        for n, own in enumerate(likelihood.records):
            e, _ = likelihood.run(n, replace(point, parameters=p))
            column = own.weights * (e - fitted.e[n]) / step / fitted.sigma
            exact += (column**2).sum()
        assert quadratic.information.sum(0)[i] == pytest.approx(exact, rel=0.04), coordinate.field
    assert record.samples == 4000


def test_torques_of_a_log_are_integrated_over(clean):
    """Innovations are linear in a constant torque b: the integral of exp(-F) over b is ln(1 + tau^2 H)/2 nats less. H
    is measured by runs of the filter, whose responses are not settled everywhere: to 2 % of a nat."""
    fitted, expected = clean[2], np.zeros(3)
    likelihood, tau = fitted.likelihood, fitted.likelihood.widths[:3]
    for i, record in enumerate(likelihood.records):
        own = fitted.point.per_log.copy()
        own[i, :3] += tau
        e, _ = likelihood.run(i, replace(fitted.point, per_log=own))
        change = (e - fitted.e[i]) / fitted.sigma
        expected += 0.5 * np.log1p((record.weights * change**2).sum(0))
    np.testing.assert_allclose(likelihood.log_determinants(fitted.point, fitted.sigma), expected, atol=0.02)


def test_chunks_make_no_difference(clean, monkeypatch):
    fitted = clean[2]
    at = (fitted.point, fitted.coordinates, fitted.x, fitted.sigma)
    whole = sensitivity.linearise(fitted.likelihood, *at)
    monkeypatch.setattr(sensitivity, "CHUNK", 900)
    pieces = sensitivity.linearise(fitted.likelihood, *at)
    np.testing.assert_allclose(pieces.H, whole.H, rtol=1e-7, atol=1e-6 * np.abs(whole.H).max())
    np.testing.assert_allclose(pieces.g, whole.g, rtol=1e-6, atol=1e-6 * np.abs(whole.g).max())


def test_the_gradient_vanishes_where_the_fit_stops_at_the_gains_of_a_clean_rig(clean):
    """The remaining step is far below a standard error, four of which hold the truth and are a few per cent at most."""
    _, truth, fitted = clean
    free = np.append(~fitted.at_bound, fitted.point.z > filters.LOWEST)
    H, g = (of_all[free] for of_all in fitted.quadratic.total)
    assert np.sqrt(g @ np.linalg.solve(H[:, free], g)) < 0.3
    C = covariance(fitted)
    for name in ("k_x", "k_z", "k_y"):
        error = fitted.slope(name) * np.sqrt(C[fitted.fields.index(name)][fitted.fields.index(name)])
        assert abs(fitted.estimate(name) - getattr(truth.base, name)) < 4.0 * error
        assert error < 0.03 * abs(fitted.estimate(name))
    # offsets that all logs share are none: their spread is estimated near what is known beforehand, not at .1 rad/s^2
    assert (fit_log_spread(fitted).likelihood.widths[:3] < 0.02).all()


def test_the_spread_of_gains_from_log_to_log_is_right_on_average_for_few_logs(clean, monkeypatch):
    """That of three logs has the mean square of the truth and the prior, whose mean of 2000 is known to 1.3 %."""
    monkeypatch.setitem(fit_log_spread.__globals__, "fit", lambda likelihood, *others: likelihood)
    fitted, squares = clean[2], []
    for own in np.random.default_rng(1).normal(0.0, 0.015, (2000, 3, 15)):
        drawn = replace(fitted, point=replace(fitted.point, per_log=own))
        drawn.__dict__["quadratic"] = replace(fitted.quadratic, covariance=np.zeros((3, 15, 15)))
        squares.append(fit_log_spread(drawn).widths[9:12] ** 2)
    assert np.mean(squares) == pytest.approx(0.015**2 + PER_LOG_PRIOR[0] * PER_LOG_PRIOR[2] ** 2 / 2.0, rel=4 * 0.013)


@pytest.mark.parametrize("at, off, rel", [(slice(9, 12), 0.02, 0.05), (12, 0.004, 0.05), (slice(15, 17), 0.3, 0.1)])
def test_a_log_with_gains_or_a_zero_of_its_own_hovers_as_the_quadratic_form_says(clean, at, off, rel):
    """Where the gains of one log are 2 % off, or the pitch's zero 4 mrad, F falls by what is promised, to 5 %. So it
    does for the torques of a push of .3 rad/s^2, to 10 %: it turns the pitch by more than is linear."""
    logs, _, fitted = clean
    pushed = replace(logs[0], events=(Event(logs[0].name, "pitch", 20.0, 21.0, 20.0, 21.0, "force", 1.0),))
    likelihood = replace(likelihood_of([pushed, *logs[1:]]), widths=fitted.likelihood.widths)
    own = likelihood.pad_per_log(fitted.point.per_log)
    own[0, at] += off

    def fit_at(own):
        return Fit.at(likelihood, fitted.coordinates, fitted.x, replace(fitted.point, per_log=own))

    away = fit_at(own)
    there = fit_at(own + np.array([change for change, _ in away.quadratic.per_log_steps]))
    assert away.quadratic.per_log_fall > 1.0
    assert away.value - there.value == pytest.approx(away.quadratic.per_log_fall, rel=rel)


def test_at_the_slopes_of_the_gains_all_that_the_thrust_does_is_linear_in_the_coordinate_of_its_curve():
    """From rotors that are linear to ones that are all but purely quadratic; a drag torque at hover stays as it is."""
    rig = helicopter([Log("hover", 100.0, np.full((200, 2), 3.0), np.zeros((200, 3)))])
    field, drag, voltages = "quadratic_thrust_rotors", "rotor_drag_torque_travel", np.linspace(0.5, 5.0, 10)
    bare = rig.assign(rig.parameters, {"k_x": 0.6, "k_z": 0.2, drag: 0.02})
    coordinate = rig.coordinate(field, bare)
    x = np.linspace(0.0, coordinate.bounds[1], 5)
    plants = [rig.assign(bare, coordinate.assigned(own)) for own in x.tolist()]
    thrust = np.array([[thrust_voltage(v, 0.0, p) for v in voltages] for p in plants])
    lift = np.array([p.k_z for p in plants])[:, None] * thrust
    np.testing.assert_allclose(np.diff(lift, axis=0), np.tile((lift[1] - lift[0]), (4, 1)), rtol=1e-9, atol=1e-12)
    assert lift[-1, -1] / lift[-1, 4] == pytest.approx((voltages[-1] / voltages[4]) ** 2, rel=0.03)
    at_hover = [getattr(p, drag) * thrust_voltage(3.0, 0.0, p) / 3.0 for p in plants]
    np.testing.assert_allclose(at_hover, 0.02, rtol=1e-12)
    assert coordinate.coordinate(getattr(plants[3], field)) == pytest.approx(x[3], rel=1e-12)


def test_bounds_hold_and_the_rest_is_minimised():
    """A quadratic form of two coupled parameters with one at its bound: the other takes its conditional minimum."""
    H, g = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-4.0, 0.0])
    s = bounded_step(H, g, np.array([-1.0, -9.0]), np.array([1.0, 9.0]))
    np.testing.assert_allclose(s, [1.0, -0.5])


def test_a_thrust_at_the_bound_of_its_curve_is_one_that_the_unit_takes(clean):
    """Its coordinate depends on the voltage of hover, and rounding would pass the bound at some of them."""
    likelihood, field = clean[2].likelihood, "quadratic_thrust_rotors"
    for hover in np.linspace(1.0, 5.0, 41).tolist():
        rig = replace(likelihood.rig, operating_point=hover)
        coordinate = rig.coordinate(field, clean[2].parameters)
        at = Fit.at(replace(likelihood, rig=rig), (coordinate,), np.array(coordinate.bounds[1:]), clean[2].point)
        assert at.parameters.quadratic_thrust_rotors <= BY_FIELD[field].maximum
        low, high = (likelihood.move(clean[2].point, coordinate, bound).step for bound in coordinate.bounds)
        assert high < 0.0 < low  # differences are taken within the bounds


@pytest.mark.parametrize("height, flexing, again", [(-0.5, 0.0, 25.0), (-0.5, 0.005, 25.0), (0.0, 0.0, 22.75)])
def test_the_filter_settles_after_a_table_held_the_arm_and_goes_on_after_a_rest_on_its_way(
    clean, height, flexing, again
):  # fmt: skip
    """From 20 to 23 s; a quarter of a second is not told from the end of a rest. What a table gives is no air.

    A table that gives way by 6 counts is one too: 23 s and SETTLING.
    """
    log, rig = clean[0][0], clean[2].likelihood.rig
    angles, on_it = log.angles.copy(), slice(2000, 2301)
    angles[on_it, 1] = angles[:, 1].mean() + height + flexing * np.sin(10.0 * log.time[on_it])
    weights = record_of(replace(log, angles=angles), rig).weights[:, 1]
    assert not weights[2000 + 30 * (height == 0.0) : 2225].any()
    first = 2200 + int(np.flatnonzero(weights[2200:])[0])
    assert first * 0.01 == pytest.approx(again, abs=0.1)


def test_a_resting_axis_counts_nowhere_nor_a_passage_that_is_left_out_until_the_filter_has_settled(clean):
    """An axis that moves by less than a count says nothing on torques; the others are not touched."""
    log = clean[0][0]
    angles = log.angles.copy()
    angles[:, 1] = 0.2
    still = Log("still", 100.0, log.voltages, angles)
    rig = helicopter([still])
    weights = record_of(still, rig).weights
    assert weights[:, 1].sum() == 0.0 and weights[:, 0].mean() > 0.9
    assert records_of((still,), rig)[0].weights[:, 1].sum() == 0.0
    cycle = angles.copy()
    cycle[:, 1] += rig.resolution[1] * (np.arange(len(angles)) // 20 % 3)  # a limit cycle of at most two counts
    assert records_of((replace(still, angles=cycle),), rig)[0].weights[:, 1].sum() == 0.0
    event = Event(log.name, "pitch", 10.0 + MARGIN, 12.0 - MARGIN, 10.0, 12.0, "slip", 0.0)
    record = record_of(replace(log, events=(event,)), rig)
    inside = (record.time >= 10.0) & (record.time <= 14.0)
    assert record.weights[inside].sum() == 0.0 and record.weights[~inside].any()
    # an arm that rests in flight hovers: at the median voltage thrust carries the weight; a_e is expected at 0
    voltages = log.voltages + 3.0
    likelihood = likelihood_of([Log("still", 100.0, voltages, angles)])
    p = fit(likelihood, likelihood.rig.base).parameters
    assert 2.0 * np.median(voltages) * p.k_z - p.a_1 == pytest.approx(0.0, abs=1e-6)


def test_a_fast_log_is_averaged_from_the_middle_of_a_block_to_the_next(clean):
    log = clean[0][0]
    for n in (4, 5):
        time = np.arange(n * log.samples) / (n * log.rate_hz)
        middle = (log.samples - 1) * log.step / 2.0
        ramp = (time - middle)[:, None] * np.array([0.3, -0.2])  # held over a sample: on average half a sample later
        fast = Log("fast", n * log.rate_hz, ramp, np.column_stack((time, 2.0 * time, -time)))
        assert block_samples(fast) == n and block_samples(log) == 1
        record = record_of(fast, helicopter([fast]))
        ends = (record.angles[1:, 0], record.angles[:-1, 0])
        np.testing.assert_allclose(ends[0] - ends[1], record.step, rtol=1e-9)
        held = (0.5 * (ends[0] + ends[1]) - 0.5 / fast.rate_hz - middle)[:, None] * np.array([0.3, -0.2])
        np.testing.assert_allclose(record.inputs[:-1], held, atol=1e-12)
    record = record_of(log, helicopter([log]))
    np.testing.assert_array_equal(record.angles, log.angles)
    np.testing.assert_array_equal(record.inputs, log.voltages)


def test_a_fine_encoder_makes_no_other_plant():
    """Logs of encoders of 18 bits: gains within four standard errors, as well known as with 12 bits, .16 or better."""
    rig = windy_rig(6, "ou", effects="bare", counts={"a": 4}, finer=64)
    logs = windy_logs(rig, "a")
    fitted = fit(likelihood_of(logs), likelihood_of(logs).rig.base)
    slopes = rig.truth.slopes(float(np.mean(np.concatenate([log.voltages for log in logs]))))
    error = np.sqrt(np.diag(covariance(fitted)))
    for name, true in slopes.items():
        own = fitted.slope(name) * error[fitted.fields.index(name)]
        assert abs(fitted.estimate(name) - true) < 4.0 * own, name
        assert 1.96 * own < 0.2 * abs(true), name


def test_air_that_swirls_is_found_from_nothing():
    """A fit of a quiet flight in swirling air is as likely as one that begins at the true gains in such air."""
    rig = windy_rig(18, "swirl", True, effects="bare", counts={"a": 3})
    likelihood = likelihood_of(logs := windy_logs(rig, "a"))
    base = likelihood.rig.base
    found = fit(likelihood, base)
    true = rig.truth.slopes(float(np.mean(np.concatenate([log.voltages for log in logs]))))
    air = np.repeat([[0.0], [0.5], [-2.2], [4.0], [0.0]], 3, axis=1)
    begun = likelihood.neutral_point(likelihood.rig.assign(found.parameters, true), air)
    told = fit(likelihood, base, known_fit(likelihood, base, begun, found.sigma))
    assert found.value < told.value + 1.0


H = 0.01
AXIS = (0.1, 0.6)
"""Damping [1/s] and stiffness [1/s^2]."""


def solved(rho: float, c: float, f: float, psi: float, k: float = 40.0) -> filters.AxisFilter:
    """Filter of the axis in one air, with an encoder that turns slowly."""
    return filters.filters(H, [AXIS], np.array([[rho, c, f, psi, k]]).T)[0]


def van_loan(rho: float, c: float, f: float, psi: float) -> tuple[np.ndarray, np.ndarray]:
    """Step of (angle, rate, d, u) and covariance of its noise, by scipy's matrix exponential (Van Loan 1978)."""
    w, R = np.sqrt(c * f), np.array([[np.cos(psi), np.sin(psi)], [-np.sin(psi), np.cos(psi)]])
    D, W = np.zeros((4, 4)), np.zeros((4, 4))
    D[:2, :3] = [[0.0, 1.0, 0.0], [-AXIS[1], -AXIS[0], 1.0]]
    D[2:, 2:] = R @ np.array([[0.0, w], [-w, -f]]) @ R.T
    W[2:, 2:] = R @ np.diag((0.0, 2.0 * f * rho**2)) @ R.T
    both = expm(H * np.block([[-D, W], [np.zeros((4, 4)), D.T]]))
    return both[4:, 4:].T, both[4:, 4:].T @ both[:4, 4:]


@pytest.mark.parametrize("c, f, psi", [(2.5, 20.0, 0.3), (2.5, 300.0, 0.0), (6.0, 1.0, -1.2)])
def test_the_torque_is_stationary_with_the_stated_variance_and_a_sample_the_integral_of_axis_and_torque(c, f, psi):
    """P = F P F' + Q has the solution rho^2 I: the torque's standard deviation is what is called rho."""
    own = solved(80.0, c, f, psi)
    A, F = own.A, own.F
    Q = 80.0**2 * (np.eye(2) - F @ F.T)
    np.testing.assert_allclose(solve_discrete_lyapunov(F, Q), 80.0**2 * np.eye(2), rtol=1e-6, atol=1e-6)
    np.testing.assert_array_equal(A[2:4, 2:4], F)
    np.testing.assert_allclose(solved(80.0, c, f, -psi).S, own.S, rtol=1e-9, err_msg="the spectrum is even in psi")
    np.testing.assert_allclose(A[:4, :4], van_loan(80.0, c, f, psi)[0], rtol=1e-9, atol=1e-12)


def test_the_gain_minimises_the_stationary_error():
    """The filter's own recursion, started elsewhere, ends at the same variance and gain."""
    own = solved(80.0, 2.5, 20.0, 0.3)
    A, stay = own.A, np.exp(-40.0 * H)
    Q = np.diag((1e-10, 1e-9, 0.0, 0.0, COLOURED * (1.0 - stay**2)))
    Q[:4, :4] += van_loan(80.0, 2.5, 20.0, 0.3)[1]
    P, C, R = 100.0 * np.eye(5), np.array([1.0, 0.0, 0.0, 0.0, 1.0]), 1.0 - COLOURED
    for _ in range(5000):
        k = P @ C / (C @ P @ C + R)
        P = A @ (P - np.outer(k, C @ P)) @ A.T + Q
    assert C @ P @ C + R == pytest.approx(own.S, rel=1e-6)
    np.testing.assert_allclose(P @ C / own.S, own.K, rtol=1e-5)


def test_the_encoders_error_has_its_variance_and_colour():
    """Mean square 1 and correlation COLOURED exp(-k h) from one sample to the next, to 4 standard errors."""
    own, count = solved(80.0, 2.5, 200.0, 0.0), 200_000
    n, stay = encoder_error(own, count, np.random.default_rng(6)), np.exp(-40.0 * H)
    error = np.sqrt(2.0 / count * (1.0 + stay**2) / (1.0 - stay**2))
    assert np.mean(n**2) == pytest.approx(1.0, abs=4.0 * error)
    assert np.mean(n[1:] * n[:-1]) == pytest.approx(COLOURED * stay, abs=4.0 * error)


def _linear_run(torque, noise, air):
    """Innovations of the filter of one linear axis, made by its matrices; the axis itself obeys A's upper block."""
    own = solved(*air)
    K, A = own.K, own.A
    x, angle, e = np.zeros(5), np.zeros(2), np.empty(len(torque))
    for i in range(len(torque)):
        e[i] = angle[0] + noise[i] - x[0] - x[4]
        x = A @ (x + K * e[i])
        angle = A[:2, :2] @ angle + np.array([0.5 * H * H, H]) * torque[i]
    return e


def test_another_filter_is_a_linear_filter_of_the_innovations():
    """recoloured gives what the other filter would have given: exact on a linear axis."""
    rng = np.random.default_rng(3)
    torque, noise = rng.standard_normal(3000), 0.01 * rng.standard_normal(3000)
    one, other = (80.0, 2.5, 200.0, 0.0, 300.0), (30.0, 5.0, 2.0, 0.8, 20.0)
    first, second = _linear_run(torque, noise, one), _linear_run(torque, noise, other)
    found = next(filters.recolour(first, solved(*one), [solved(*other)]))
    np.testing.assert_allclose(found, second, atol=1e-9 * np.abs(second).max())


def test_slopes_of_the_colour_are_those_of_recoloured():
    """Central differences over 2 d of what recolour gives: their error is of the order d^2 = 1e-8."""
    e, air, d = np.random.default_rng(4).standard_normal(1000), np.array((80.0, 2.5, 15.0, 0.4, 40.0)), 1e-4
    axis, others = solved(*air), [solved(*(air * (1.0 + d * sign))) for sign in (1.0, -1.0)]
    (up, down), both = filters.recolour(e, axis, others), filters.slopes_of_colour(e, axis, others, np.ones(2))
    np.testing.assert_allclose(both[0] - both[1], up - down, atol=1e-6 * np.abs(up - down).max())


def test_a_further_acceleration_passes_the_error_dynamics():
    """The innovations change by the transfer function, exactly on a linear axis; the plant lags a step behind."""
    rng = np.random.default_rng(5)
    torque, air = rng.standard_normal(2000), (80.0, 2.5, 20.0, 0.3)
    still = np.zeros(2000)
    # a further acceleration of the *plant in the filter* is minus one of the rig
    change = lfilter(*filters.error_dynamics(solved(*air)), torque)
    np.testing.assert_allclose(change, -_linear_run(torque, still, air), atol=1e-9 * np.abs(change).max())
