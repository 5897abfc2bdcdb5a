"""Recursive prediction errors: an estimation of one axis that stays right in closed loop.

Least squares (7) is consistent if its error sigma is independent of the regressors phi. In closed loop it is not: the
voltages answer to torques. Innovations e_k = G sigma (:mod:`.whitening`) cannot be predicted from earlier samples. With
z = G (phi, y) and a noise model that is estimated as well (:mod:`.whitening`), the recursive Gauss-Newton step on the
sum of e^2 / lambda is adaptation (7) with other regressors,

    e   = z_y - z_phi^T Omega
    psi = z_phi + r e / (c + r^T Omega)
    Omega' = Gamma psi e / (lambda h),    Gamma' = alpha Gamma - Gamma psi psi^T Gamma / (lambda h)

c + r^T Omega is the derivative of e with respect to the newest angle, which F takes as the end of a straight line: c
is that of z_y, and r that of z_phi with the opposite sign. So e / (c + r^T Omega) is the innovation of the angle, and
psi is z_phi without it, which is known before the sample. The noise model's nu is appended to Omega, and -d and -g
to psi. Divided by sqrt(lambda h), e has the intensity 1, and Gamma is the covariance of Omega and nu. Gamma(0) can
therefore express which rigs exist (:data:`.settings.WIDTHS`). The first seconds are forgotten
(:func:`.adaptation.kept_information`).
Sources: Ljung and Soderstrom, Theory and Practice of Recursive Identification, 1983, chapter 3; Forssell and Ljung,
Closed-loop identification revisited, Automatica 35 (1999), section 5 (the direct method).
"""

from math import exp, sqrt
from typing import NamedTuple

from .adaptation import AxisState, increase_variance, kept_information, take_measurement
from .instruments import Instruments, initial_instruments, update_instruments
from .linear_algebra import unit_vector
from .loop import Outside, initial_outside, update_outside
from .settings import AxisPlan, Plan
from .whitening import (
    BANDWIDTH_CHANGE,
    BANDWIDTHS,
    CORNER_CHANGE,
    CORNERS,
    REST,
    Memory,
    Noise,
    NoiseModel,
    Whitening,
    bandwidth_slope,
    bound_noise,
    initial_noise,
    settled_memory,
    update_noise,
    whiten,
    whitening,
)


class PredictorState(NamedTuple):
    """State of the prediction errors of an axis."""

    memory: tuple[Memory, ...]  # of the whitened signals
    noise: NoiseModel
    whitening: Whitening  # G
    innovation_sum: float  # sum of the innovations since the last products of ``outside``
    outside: Outside
    instruments: Instruments


def noise_of(axis: AxisState) -> Noise:
    """Return bandwidth and corner [rad/s] of an axis within their bounds; its Omega ends with nu."""
    bandwidth, corner = exp(axis.omega[-2]), exp(axis.omega[-1])
    return Noise(min(max(bandwidth, BANDWIDTHS[0]), BANDWIDTHS[1]), min(max(corner, CORNERS[0]), CORNERS[1]))


def initial_predictor(z: tuple[float, ...], axis_plan: AxisPlan, plan: Plan) -> PredictorState:
    """Return the state at sample 0 of an axis, in steady state with its signals ``z`` = (phi, y)."""
    w = whitening(axis_plan.first[-2], axis_plan.first[-1], plan.filter, plan.sample_time)
    memory, n = tuple([settled_memory(value, w) for value in z]), axis_plan.reported
    noise = initial_noise(plan.angle_slopes[0])
    return PredictorState(memory, noise, w, 0.0, initial_outside(n), initial_instruments(n))


def predict_axis(
    axis: AxisState, p: PredictorState, z: tuple[float, ...], count: int, early: float, b: tuple[float, ...],
    axis_plan: AxisPlan, plan: Plan,
) -> tuple[AxisState, PredictorState]:  # fmt: skip
    """Return axis and predictor after the sample ``z`` = (phi, y), which is numbered ``count`` from 0.

    ``early`` is the share of the information that early forgetting keeps over it.

    Omega ends with nu; the axis' rows are (psi, -d, -g, y). The first element of phi is minus the filtered rate; if
    there are more than two, the second is minus the filtered angle. ``b`` are the instruments, empty while no reference
    has moved.
    """
    h, alpha, n = plan.sample_time, plan.settings.forgetting, axis_plan.reported
    c, by_rate, by_angle = plan.angle_slopes
    # unpacked once: the interpreter reads a local ten times faster than a named tuple's field
    old_memory, old_noise, w, innovation_sum, outside, instruments = p
    old_factor, old_omega, _, rows, moments, errors = axis
    memory, v = whiten(old_memory, z, w)
    factor, omega = list(old_factor), list(old_omega)
    regressand = e = v[-1]
    for i in range(n):
        e -= v[i] * omega[i]
    has_angle = n > 2
    innovation = e / (c + by_rate * omega[0] + (by_angle * omega[1] if has_angle else 0.0))
    v[0] += by_rate * innovation
    if has_angle:
        v[1] += by_angle * innovation
    d, g = 0.0, 0.0
    if old_noise.samples >= REST / h:
        d = bandwidth_slope(old_noise, w)
        g = old_memory[-1][-1]
        for i in range(n):
            g -= old_memory[i][-1] * omega[i]
    # The regressand is psi^T Omega, that is z_y without c times the angle's innovation, plus e for nu = 0.
    known = regressand + e - c * innovation
    v[-1] = known - d * w.log_bandwidth - g * w.log_corner
    scale = 1.0 / sqrt(old_noise.variance * h)
    scaled = tuple([scale * x for x in (*v[:n], -d, -g, *v[n:])])

    r, interval, stride = plan.noise, plan.refresh_samples, plan.product_samples
    _, s = take_measurement(factor, omega, scaled, scaled[-1], r * early, plan.kept * early)
    certainty = r / (r + (s - r * early))
    turn = count % interval
    if turn < n + 2:
        change = 0.0 if turn < n else (BANDWIDTH_CHANGE if turn == n else CORNER_CHANGE) * interval * h
        forgotten = 1.0 - kept_information(count, interval, h, alpha)
        _renew(factor, omega, turn, axis_plan.first[turn], axis_plan.prior[turn], change, forgotten)
    omega[n], omega[n + 1] = bound_noise(omega[n], omega[n + 1], plan.noise_bounds)
    if turn == n + 1:
        w = whitening(omega[n], omega[n + 1], plan.filter, h)

    axis = AxisState(tuple(factor), tuple(omega), e, (*rows, scaled), moments, errors)
    if (count + n) % stride == 0:  # n differs between axes, so that they do this in different samples
        retained = kept_information(count, stride, h, alpha)
        outside, innovation_sum = update_outside(outside, innovation_sum, scaled[:n], retained, stride * h), 0.0
    if len(b) > 0:
        retained, held = kept_information(count, stride, h, alpha), stride if count % stride == 0 else 0
        instruments = update_instruments(instruments, scaled[:n], scale * known, b, held, retained)
    noise = update_noise(old_noise, e, certainty, d, h, c)
    return axis, PredictorState(tuple(memory), noise, w, innovation_sum + scale * e, outside, instruments)


def _renew(
    factor: list[float], omega: list[float], index: int, first: float, prior: float, change: float, forgotten: float
) -> None:
    """Add the variance ``change`` to the parameter ``index``, in place, and let it return to ``first``.

    Without measurements it approaches its ``prior`` variance: Gamma' = change - Gamma^2 change / prior^2. The share of
    the prior that was ``forgotten`` is restored as well.
    """
    if change > 0.0:
        increase_variance(factor, index, change)
    share = change / prior + forgotten
    if share > 0.0:
        take_measurement(factor, omega, unit_vector(index, len(omega)), first, prior / share, 1.0, index)
