"""The state filters: exact for every input shape, of unit gain, and with the second derivative mended."""

from math import cos, exp, sin

import numpy as np
import pytest
import scipy.linalg
import scipy.signal
from scipy.integrate import quad_vec

from heli_identifier.online.linear_algebra import dot, total
from heli_identifier.online.state_filter import (
    discretise,
    filter_held,
    filter_lagged,
    filter_line,
    matrix_exponential,
    second_derivative,
)

H, LAG = 0.01, 0.08
FILTERS = [(1.0, 0.7), (4.0, 0.7), (8.0, 1.3)]

# Two exact computations of the same number differ by rounding: some hundred operations on numbers of order one.
ROUNDING = 1e-13


def system(omega, rho):
    a = np.array([[0.0, 1.0], [-(omega**2), -2.0 * rho * omega]])
    b = np.array([[0.0], [omega**2]])
    return a, b


@pytest.mark.parametrize("scale", [1e-3, 0.3, 5.0])
def test_the_matrix_exponential_is_that_of_scipy(scale):
    m = scale * np.random.default_rng(1).standard_normal((4, 4))
    reference = scipy.linalg.expm(m)
    # Squaring s times multiplies the rounding error by some 2^s; s <= 6 here.
    np.testing.assert_allclose(matrix_exponential(m.tolist()), reference, rtol=0, atol=1e-13 * np.abs(reference).max())


def test_the_exponential_of_zero_is_the_identity():
    assert matrix_exponential([[0.0, 0.0], [0.0, 0.0]]) == [[1.0, 0.0], [0.0, 1.0]]


@pytest.mark.parametrize(("omega", "rho"), FILTERS)
@pytest.mark.parametrize("method", ["zoh", "foh"])
def test_sampled_signals_pass_as_through_scipys_discretisation(omega, rho, method):
    f = discretise(omega, rho, H, LAG)
    u = np.random.default_rng(2).standard_normal(400)
    a, b = system(omega, rho)
    t = np.arange(400) * H
    # lsim holds (interp=False) or joins the samples by lines (interp=True), exactly in both cases.
    _, _, reference = scipy.signal.lsim((a, b, np.eye(2), np.zeros((2, 1))), u, t, interp=method == "foh")
    xi = (0.0, 0.0)
    ours = [xi]
    for before, now in zip(u, u[1:], strict=False):
        xi = filter_held(xi, before, f) if method == "zoh" else filter_line(xi, before, now, f)
        ours.append(xi)
    np.testing.assert_allclose(ours, reference, atol=ROUNDING * omega * 10)


@pytest.mark.parametrize(("omega", "rho"), FILTERS)
def test_a_voltage_behind_the_motor_passes_as_in_the_joint_linear_system(omega, rho):
    f = discretise(omega, rho, H, LAG)
    a, b = system(omega, rho)
    joint = np.block([[a, b], [np.zeros((1, 2)), np.array([[-1.0 / LAG]])]])
    held = np.array([[0.0], [0.0], [1.0 / LAG]])
    ad, bd, *_ = scipy.signal.cont2discrete((joint, held, np.eye(3), np.zeros((3, 1))), H, method="zoh")
    v = np.random.default_rng(3).standard_normal(300)
    x, xi, nu = np.zeros(3), (0.0, 0.0), 0.0
    for voltage in v:
        x = ad @ x + bd[:, 0] * voltage
        xi = filter_lagged(xi, voltage, nu, 1.0, 1.0, f)
        nu = voltage + (nu - voltage) * exp(-H / LAG)
        np.testing.assert_allclose(xi, x[:2], atol=ROUNDING * omega * 10)


@pytest.mark.parametrize("lag", [0.0, 0.02, 0.08, 3.0])
def test_a_lagged_voltage_times_a_line_is_the_convolution_integral(lag):
    f = discretise(2.0, 0.7, H, lag)
    v, nu, c_0, c_1 = 1.3, -0.4, 0.9, 0.7
    a, b = system(2.0, 0.7)

    def integrand(tau):
        voltage = v + (nu - v) * exp(-tau / lag) if lag > 0.0 else v
        u = voltage * (c_0 + (c_1 - c_0) * tau / H)
        return (scipy.linalg.expm(a * (H - tau)) @ b)[:, 0] * u

    start = np.array([0.2, -0.5])
    reference = scipy.linalg.expm(a * H) @ start + quad_vec(integrand, 0.0, H, epsabs=1e-15)[0]
    np.testing.assert_allclose(filter_lagged(start, v, nu, c_0, c_1, f), reference, atol=1e-14)


def test_the_line_under_a_lagged_voltage_is_off_by_the_known_curvature():
    # mu(t) cos(theta(t)) with cos(theta) between samples a line: the mean error over a step is h^2/12 mu (cos theta)''.
    # theta = .8 sin(3 t) bends strongly, (cos theta)'' <= .8^2 3^2 + .8 3^2 = 13 /s^2, so that the filtered error may
    # reach h^2/12 * 13 * 2 V = 2.2e-4 V; products held at their sample would be off by (h/2) * 2 V * 1.9/s = .02 V.
    f = discretise(1.0, 0.7, H, LAG)
    fine = discretise(1.0, 0.7, H / 50, LAG)
    angle = lambda t: 0.8 * sin(3.0 * t)  # noqa: E731
    worst = 0.0
    xi, reference, nu, nu_fine = (0.0, 0.0), (0.0, 0.0), 0.0, 0.0
    for k in range(1000):
        v = 2.0 if (k // 100) % 2 else 1.0
        for i in range(50):
            t = (k + i / 50) * H
            reference = filter_lagged(reference, v, nu_fine, cos(angle(t)), cos(angle(t + H / 50)), fine)
            nu_fine = v + (nu_fine - v) * exp(-H / 50 / LAG)
        xi = filter_lagged(xi, v, nu, cos(angle(k * H)), cos(angle((k + 1) * H)), f)
        nu = v + (nu - v) * exp(-H / LAG)
        worst = max(worst, abs(xi[0] - reference[0]))
    assert 1e-6 < worst < 2.2e-4


def test_a_constant_passes_unchanged_and_has_no_derivatives():
    f = discretise(1.0, 0.7, H, LAG)
    xi = (3.0, 0.0)
    for _ in range(10_000):
        xi = filter_line(xi, 3.0, 3.0, f)
    assert xi == pytest.approx((3.0, 0.0), abs=1e-11)
    assert second_derivative(xi, 3.0, 3.0, 3.0, f) == pytest.approx(0.0, abs=1e-11)


@pytest.mark.parametrize("w", [0.5, 2.0, 8.0])
def test_the_filtered_second_derivative_is_minus_w_squared_times_the_filtered_sine(w):
    omega = 1.0
    f = discretise(omega, 0.7, H, LAG)
    xi, seconds, firsts = (0.0, w), [], []
    u = [sin(w * k * H) for k in range(6000)]
    for k in range(2, 6000):
        xi = filter_line(xi, u[k - 1], u[k], f)
        firsts.append(xi[0])
        seconds.append(second_derivative(xi, u[k], u[k - 1], u[k - 2], f))
    # The start has died away after 30/omega. What is left: the second difference is centred one sample back, and the
    # mend of omega^2 (h^2/12) u'' therefore off by omega^2 (h^2/12) w^3 h; a tenth for the orders beyond.
    tail = slice(3000, None)
    tolerance = 1.1 * omega**2 * (H * w) ** 3 / 12
    np.testing.assert_allclose(np.array(seconds)[tail], -(w**2) * np.array(firsts)[tail], atol=tolerance)


def test_without_the_mend_the_second_derivative_would_read_as_damping():
    omega, w = 1.0, np.pi / 2
    f = discretise(omega, 0.7, H, LAG)
    xi, error, rate = (0.0, w), [], []
    u = [sin(w * k * H) for k in range(6000)]
    for k in range(2, 6000):
        xi = filter_line(xi, u[k - 1], u[k], f)
        plain = f.omega_squared * (u[k] - xi[0]) - f.two_rho_omega * xi[1]
        error.append(plain - second_derivative(xi, u[k], u[k - 1], u[k - 2], f))
        rate.append(xi[1])
    # Seven whole periods, over which xi_1 and xi_2 are orthogonal.
    rates, errors = np.array(rate[-2800:]), np.array(error[-2800:])
    slope = rates @ errors / (rates @ rates)
    # The error is -omega^2 (h^2/12) u'', u'' = -w^2 u, u = F^-1 xi_1 = (1 - w^2/omega^2) xi_1 + (2 rho/omega) xi_2, one
    # sample late: xi_1(t - h) = xi_1 - h xi_2.
    expected = H**2 / 12 * w**2 * (2 * 0.7 * omega - H * (omega**2 - w**2))
    assert slope == pytest.approx(expected, rel=1e-3)


def test_sums_are_added_from_left_to_right_on_every_python():
    # 1e16 + 1 rounds back to 1e16; a compensated sum, as the built-in one of Python 3.12, gives 2.
    assert total([1e16, 1.0, 1.0, -1e16]) == 0.0
    assert dot([1e8, 1.0, 1.0, -1e8], [1e8, 1.0, 1.0, 1e8]) == 0.0
    assert total([]) == 0.0
