"""The identifier: exact filters and regressors, the adaptation (7) beside least squares, Table 2 recovered."""

from dataclasses import replace
from math import exp, inf, radians

import numpy as np
import pytest
import scipy.linalg
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad_vec

from heli_identifier.online import IdentifierSettings, ModelParameters, prepare
from heli_identifier.online import linear_algebra as algebra
from heli_identifier.online.adaptation import AxisState, adapt_axis, gain_matrix, initial_factor
from heli_identifier.online.excitation import Excitation, paper_channels
from heli_identifier.online.signals import advance_signals, regressions, settled_signals
from heli_identifier.online.state_filter import discretise, filter_lagged, filter_line
from heli_plant.parameters import TABLE_2
from tests.simulated import H, multisines, run_identifier, simulate_record

TRUTH = ModelParameters(*(getattr(TABLE_2, name) for name in ModelParameters._fields))
KNOWN = IdentifierSettings(rest_angle=TABLE_2.theta0)


def relative(found):
    return np.array(found) / np.array(TRUTH) - 1.0


@pytest.mark.slow
def test_table_2_is_recovered_within_a_thousandth_through_encoders():
    # With the paper's gain, forgetting and filter. The weakest parameter is a_lt: at a travel rate of .6 rad/s its term
    # .026 theta' lambda' has some 5e-3 rad/s^2, and the standard error that encoder noise causes is .1 % in 300 s of
    # it. 2000 s and a memory of 1000 s bring it to .04 %.
    held, angles, _ = simulate_record(2000.0, multisines(seed=1, period=2000.0, base=2.5))
    assert np.abs(relative(run_identifier(held, angles, IdentifierSettings())[1].parameters)).max() < 1e-3


@pytest.mark.parametrize("omega", [pytest.param(1.0, marks=pytest.mark.slow), 4.0])
def test_without_encoders_the_error_is_that_of_the_discretisation_alone(omega):
    held, angles, _ = simulate_record(300.0, multisines(seed=2, period=300.0), encoders=False)
    # No pull of Omega(0) = 0: a gain of 1e9. Left: straight lines between samples, some (h^2/12) omega^2 of each term,
    # 1e-5 at omega = 1, on damping ratios of .01 to .08 ten times that.
    _, found = run_identifier(held, angles, replace(KNOWN, filter_frequency=omega, initial_gain=1e9, gain_limit=inf))
    assert np.abs(relative(found.parameters)).max() < 1e-4 * max(omega, 1.0)


def test_the_adaptation_rests_for_ten_filter_times():
    held, angles, _ = simulate_record(11.0, Excitation(0.5, *paper_channels(1, "both")))
    for omega, samples in ((1.0, 1000), (2.0, 500)):
        settings = replace(KNOWN, filter_frequency=omega, initial=ModelParameters(a_th=0.5))
        _, before = run_identifier(held[:samples], angles[:samples], settings)
        assert not before.adapting
        assert before.parameters == ModelParameters(a_th=0.5, theta0=TABLE_2.theta0)
        _, after = run_identifier(held[: samples + 1], angles[: samples + 1], settings)
        assert after.adapting and after.parameters.a_th != 0.5


def test_standard_errors_cover_the_error_that_encoders_cause_and_a_rest_angle_is_estimated_along():
    tilted = TABLE_2._replace(theta0=radians(5.0))
    held, angles, _ = simulate_record(200.0, multisines(seed=6, period=200.0), tilted)
    # A gain of 1e6 takes the pull of Omega(0) out, which no standard error knows of.
    _, estimate = run_identifier(held, angles, IdentifierSettings(initial_gain=1e6, gain_limit=1e6))
    # Encoder noise behind F against a_th: 3e-5 rad/s^2 / .66 / sqrt(200 s) = 3e-6 rad, a hundred times below.
    assert estimate.parameters.theta0 == pytest.approx(radians(5.0), abs=3e-4)
    assert estimate.parameters.k_x == pytest.approx(TRUTH.k_x, rel=2e-3)
    truth = TRUTH._replace(theta0=tilted.theta0)
    ratio = (np.array(estimate.parameters) - np.array(truth)) / np.array(estimate.standard_errors)
    # Eleven numbers of about unit variance, with tails of a t distribution of ten degrees of freedom. (Over twenty
    # seeds the root mean square was .5 to 1.2, parameter by parameter.)
    assert np.abs(ratio).max() < 4.5 and 0.4 < np.sqrt(np.mean(ratio**2)) < 2.0


def run(phi, y, alpha, gain, limit=inf, h=H, omega_0=None):
    n = phi.shape[1]
    plan = prepare(IdentifierSettings(sample_time=h, forgetting=alpha, gain_limit=limit))
    first = tuple(omega_0) if omega_0 is not None else (0.0,) * n
    axis = AxisState(tuple(initial_factor([gain] * n)), first, 0.0, (0.0,) * (n + 1), None, ())
    for k, z in enumerate(np.column_stack([phi, y]).tolist()):
        axis = adapt_axis(axis, z, k, plan)
    return np.array(gain_matrix(axis.factor, n)), np.array(axis.omega)


@settings(max_examples=12, deadline=None)
@given(st.integers(1, 6), st.sampled_from([0.0, 0.001, 0.5]))
def test_the_recursion_ends_at_weighted_least_squares_in_closed_form(n, alpha):
    random = np.random.default_rng(0)
    phi = random.standard_normal((500, n)) * np.geomspace(0.1, 2.0, n)
    y = phi @ np.linspace(-1.0, 1.0, n) + 0.1 * random.standard_normal(500)
    gain, omega_0 = 1e3, np.full(n, 0.3)
    beta = exp(-alpha * H)
    w = (1.0 - beta) / alpha if alpha else H
    weights = w * beta ** np.arange(499, -1, -1)
    information = (phi * weights[:, None]).T @ phi + beta**500 / gain * np.eye(n)
    reference = np.linalg.solve(information, (phi * weights[:, None]).T @ y + beta**500 / gain * omega_0)
    found_gain, found = run(phi, y, alpha, gain, omega_0=omega_0)
    # The closed form inverts a matrix of condition some 1e3, at 1e-16 each: 1e-11 leaves two digits.
    np.testing.assert_allclose(found, reference, rtol=1e-11)
    np.testing.assert_allclose(found_gain, np.linalg.inv(information), rtol=1e-10, atol=1e-12)


def test_without_excitation_the_gain_follows_the_logistic_curve_to_its_limit_in_every_direction_by_itself():
    alpha, gain, limit = 0.01, 10.0, 1e3
    silence = np.zeros((50_000, 2))
    found, _ = run(silence, np.zeros(50_000), alpha, gain, limit)
    t = 50_000 * H
    reference = 1.0 / (1.0 / limit + (1.0 / gain - 1.0 / limit) * exp(-alpha * t))
    # Information is restored in steps of 1 %, one direction at a time.
    np.testing.assert_allclose(np.diag(found), reference, rtol=0.011)
    # one direction alone rests at the limit while the others go on forgetting
    random = np.random.default_rng(7)
    moving = random.standard_normal(100_000)
    phi = np.column_stack([moving, np.zeros_like(moving)])
    truth = np.where(np.arange(100_000) < 50_000, 1.0, 2.0)
    gain, omega = run(phi, truth * moving, alpha, 1e3, limit)
    # Excited with power 1: Gamma tends to alpha; 500 s after the change exp(-5) of the old value is left.
    assert gain[0, 0] == pytest.approx(alpha, rel=0.2)
    assert omega[0] == pytest.approx(2.0 - exp(-5.0), abs=0.003)
    assert limit * 0.98 < gain[1, 1] < limit * 1.011


LAG, LIMIT = 0.08, 5.0
BANDWIDTHS, DAMPINGS, SEEDS = st.floats(0.3, 10.0), st.floats(0.2, 2.0), st.integers(0, 2**32 - 1)


def system(omega, rho):
    return np.array([[0.0, 1.0], [-(omega**2), -2.0 * rho * omega]]), np.array([[0.0], [omega**2]])


@settings(max_examples=20, deadline=None)
@given(SEEDS, st.integers(1, 8), st.integers(1, 3))
def test_the_elimination_is_that_of_lapack(seed, n, columns):
    rng = np.random.default_rng(seed)
    a, c = rng.standard_normal((n + 3, n)), rng.standard_normal((n, columns))
    b = a.T @ a
    both = np.block([[b, c], [c.T, np.zeros((columns, columns))]])
    factored = algebra.eliminate(*algebra.split_packed(both[np.triu_indices(n + columns)].tolist(), n + columns, n))
    assert not algebra.is_singular(factored[0])
    assert np.array(algebra.back_solve(*factored)).T == pytest.approx(np.linalg.solve(b, c), rel=1e-6, abs=1e-9)
    assert np.array(algebra.quadratic_form(*factored)) == pytest.approx(c.T @ np.linalg.solve(b, c), rel=1e-6, abs=1e-9)
    u, v = rng.standard_normal((2, n)).tolist()
    form = algebra.bilinear_form(u, v)
    assert algebra.dot(form, b[np.triu_indices(n)].tolist()) == pytest.approx(np.array(u) @ b @ np.array(v))
    z = np.column_stack((a, a @ np.arange(1.0, n + 1), a @ np.arange(n)))  # the last but one depends on the others
    U, C = algebra.eliminate(*algebra.split_packed((z.T @ z)[np.triu_indices(n + 2)].tolist(), n + 2, n + 1))
    assert algebra.is_singular(U) and algebra.back_solve(U, C)[0] == pytest.approx([*range(n), 0.0], abs=1e-6)
    # sums are added from left to right on every Python: 1e16 + 1 rounds back to 1e16; the sum of Python 3.12 gives 2
    assert algebra.total([1e16, 1.0, 1.0, -1e16]) == 0.0
    assert algebra.dot([1e8, 1.0, 1.0, -1e8], [1e8, 1.0, 1.0, 1e8]) == 0.0


@settings(max_examples=10, deadline=None)
@given(BANDWIDTHS, DAMPINGS, SEEDS)
def test_sampled_signals_pass_as_through_scipys_discretisation(omega, rho, seed):
    f, (a, b), t = discretise(omega, rho, H, LAG), system(omega, rho), np.arange(200) * H
    u = np.random.default_rng(seed).standard_normal(200)
    for line in (False, True):
        # lsim holds (interp=False) or joins the samples by lines (interp=True), exactly in both cases.
        _, _, reference = scipy.signal.lsim((a, b, np.eye(2), np.zeros((2, 1))), u, t, interp=line)
        ours = [(0.0, 0.0)]
        for before, now in zip(u, u[1:], strict=False):
            ours.append(filter_line(ours[-1], before, now if line else before, f))
        # both are exact: some hundred operations on numbers of order one, or omega, round by 1e-12
        np.testing.assert_allclose(ours, reference, atol=1e-12 * max(omega, 1.0) * 10)


@pytest.mark.parametrize("lag", [0.0, 0.08, 3.0])
def test_a_lagged_voltage_times_a_line_is_the_convolution_integral(lag):
    f, (a, b) = discretise(2.0, 0.7, H, lag), system(2.0, 0.7)
    v, nu, c_0, c_1 = 1.3, -0.4, 0.9, 0.7

    def integrand(tau):
        voltage = v + (nu - v) * exp(-tau / lag) if lag > 0.0 else v
        return (scipy.linalg.expm(a * (H - tau)) @ b)[:, 0] * voltage * (c_0 + (c_1 - c_0) * tau / H)

    start = np.array([0.2, -0.5])
    reference = scipy.linalg.expm(a * H) @ start + quad_vec(integrand, 0.0, H, epsabs=1e-15)[0]
    np.testing.assert_allclose(filter_lagged(start, v, nu, c_0, c_1, f), reference, atol=1e-14)


def regressions_of(held, angles):
    """(y, phi) of pitch with a free theta0, elevation and travel, arrays over the samples."""
    f, rows = discretise(1.0, 0.7, H, LAG), []
    s = settled_signals((*held[0].tolist(), *angles[0].tolist()), LIMIT)
    for v, q in zip(held[1:].tolist(), angles[1:].tolist(), strict=True):
        s = advance_signals(s, (*v, *q), H, LAG, LIMIT, f)
        rows.append(regressions(s, None, None, f))
    return [(np.array([row[i][-1] for row in rows]), np.array([row[i][:-1] for row in rows])) for i in range(3)]


def test_a_rig_at_rest_shows_no_motion_and_a_voltage_acts_only_after_its_sample_and_as_the_plant_saturates_it():
    for y, phi in regressions_of(np.full((300, 2), 1.2), np.tile((radians(-7.8), 0.2, 5.0), (300, 1))):
        # Settled filters: constants pass, derivatives are zero, but for rounding of omega^2 times the angle.
        assert np.abs(y).max() < 1e-12 and np.abs(np.diff(phi, axis=0)).max() < 1e-12
    held, angles = np.full((300, 2), 1.0), np.tile((0.1, 0.2, 0.3), (300, 1))
    stepped = held.copy()
    stepped[200] = (2.0, 0.5)
    before, after = (regressions_of(v, angles)[0][1][:, 3] for v in (held, stepped))
    # Row i belongs to sample i + 1: the voltages of sample 200 act over [t_200, t_201) and show from sample 201 on.
    assert np.array_equal(before[:200], after[:200]) and after[200] > before[200]
    beyond, at_limit = (regressions_of(np.tile((v, 1.0), (300, 1)), angles) for v in (9.0, 5.0))
    assert all(np.array_equal(one[1], other[1]) for one, other in zip(beyond, at_limit, strict=True))
