"""Recursive prediction errors: estimation of one axis that stays right when a controller closes the loop.

Least squares (7) is consistent where its error sigma is independent of the regressors phi, which a controller, that
answers to torques through the voltages, prevents. Innovations e_k = G sigma (:mod:`.whitening`) are what no earlier
sample can tell. With z = G (phi, y) and the noise model (:mod:`.whitening`) estimated along, the recursive Gauss-Newton
step on the sum of e^2 / lambda is adaptation (7) with other regressors,

    e   = z_y - z_phi^T Omega
    psi = z_phi + r e / (c + r^T Omega)
    Omega' = Gamma psi e / (lambda h),    Gamma' = alpha Gamma - Gamma psi psi^T Gamma / (lambda h)

c + r^T Omega is the derivative of e with respect to the newest angle, which F takes as the end of a straight line: c
that of z_y, and r that of z_phi with the sign turned. e / (c + r^T Omega) is thus the innovation of the angle itself,
and psi is z_phi without it: what was known before the sample. The noise model's nu stands behind Omega, with -d and -g
behind psi. Divided by sqrt(lambda h), e has the intensity 1, and Gamma is the covariance of Omega and nu. Gamma(0) can
therefore say what can be built on a bench (:data:`.settings.WIDTHS`). The first seconds are forgotten
(:func:`.adaptation.kept_information`).
Sources: Ljung and Soderstrom, Theory and Practice of Recursive Identification, 1983, chapter 3; Forssell and Ljung,
Closed-loop identification revisited, Automatica 35 (1999), section 5 (the direct method).
"""

from math import exp, sqrt
from operator import add
from typing import NamedTuple

from .adaptation import AxisState, kept_information, loosen, measurement_noise, take_measurement
from .instruments import Instruments, add_signals, no_instruments
from .linear_algebra import outer, unit_vector
from .loop import Outside, add_regressors, nothing_outside, products_every
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
    first_noise,
    remember,
    settled_memory,
    whiten,
    whitening,
)

_REFRESH = 0.2  # time between two evaluations of the whitening filter [s]
_MOST_PARAMETERS = 8  # of an axis: the elevation's with the motors' lag and the noise model


class PredictorState(NamedTuple):
    """Past of the whitened signals, noise model, G, what came from outside the loop, and instruments of an axis."""

    memory: tuple[Memory, ...]
    noise: NoiseModel
    whitening: Whitening
    outside: Outside
    instruments: Instruments


def noise_of(axis: AxisState) -> Noise:
    """Return bandwidth and corner [rad/s] of an axis whose Omega ends with nu, within their bounds."""
    bandwidth, corner = exp(axis.omega[-2]), exp(axis.omega[-1])
    return Noise(min(max(bandwidth, BANDWIDTHS[0]), BANDWIDTHS[1]), min(max(corner, CORNERS[0]), CORNERS[1]))


def first_predictor(z: tuple[float, ...], own: AxisPlan, plan: Plan) -> PredictorState:
    """Return the state at sample 0 of the signals ``z`` = (phi, y) of an axis, settled there."""
    w = whitening(own.first[-2], own.first[-1], plan.filter, plan.sample_time)
    memory = tuple([settled_memory(value, w) for value in z])
    noise = first_noise(plan.angle_slopes[0])
    return PredictorState(memory, noise, w, nothing_outside(own.reported), no_instruments(own.reported))


def predict_axis(
    axis: AxisState, p: PredictorState, z: tuple[float, ...], count: int, b: tuple[float, ...], own: AxisPlan,
    plan: Plan,
) -> tuple[AxisState, PredictorState]:  # fmt: skip
    """Return axis and predictor after the sample ``z`` = (phi, y), the one numbered ``count`` from 0.

    Omega ends with nu; the axis' sums are of the products of (psi, -d, -g, y), packed. The first column of phi
    is minus the filtered rate; the second, of more than two, minus the filtered angle. ``b`` are the instruments, empty
    while no reference has moved.
    """
    h, alpha, n = plan.sample_time, plan.settings.forgetting, own.reported
    c, by_rate, by_angle = plan.angle_slopes
    # taken apart once: the interpreter reads a local ten times faster than a named tuple's field
    before, past, w, outside, instruments = p
    factor_before, omega_before, _, sums, moments, errors, excitation = axis
    memory, v = whiten(before, z, w)
    factor, omega = list(factor_before), list(omega_before)
    regressand = e = v[-1]
    for i in range(n):
        e -= v[i] * omega[i]
    angle = n > 2
    innovation = e / (c + by_rate * omega[0] + (by_angle * omega[1] if angle else 0.0))
    v[0] += by_rate * innovation
    if angle:
        v[1] += by_angle * innovation
    d, g = 0.0, 0.0
    if past.seen >= REST / h:
        d = bandwidth_slope(past, w)
        g = before[-1].corner_slope
        for i in range(n):
            g -= before[i].corner_slope * omega[i]
    # The regressand: psi^T Omega, which is z_y short of c times the angle's innovation, and e as it is with nu = 0.
    known = regressand + e - c * innovation
    v[-1] = known - d * w.log_bandwidth - g * w.log_corner
    scale = 1.0 / sqrt(past.variance * h)
    seen = [scale * x for x in (*v[:n], -d, -g, *v[n:])]

    early, r = kept_information(count, 1, h), measurement_noise(alpha, h)
    _, s = take_measurement(factor, omega, seen, seen[-1], r * early, exp(-alpha * h) * early)
    certain = r / (r + (s - r * early))
    refresh = max(_MOST_PARAMETERS, round(_REFRESH / h))
    turn = count % refresh
    if turn < n + 2:
        change = 0.0 if turn < n else (BANDWIDTH_CHANGE if turn == n else CORNER_CHANGE) * refresh * h
        forgotten = 1.0 - kept_information(count, refresh, h, alpha)
        _renew(factor, omega, turn, own.first[turn], own.prior[turn], change, forgotten)
    omega[n], omega[n + 1] = bound_noise(omega[n], omega[n + 1], plan.noise_bounds)
    if turn == n + 1:
        w = whitening(omega[n], omega[n + 1], plan.filter, h)

    sums = tuple(map(add, sums, outer(seen)))
    axis = AxisState(tuple(factor), tuple(omega), e, sums, moments, errors, excitation)
    stride = products_every(h)
    if (count + n) % stride == 0:  # n differs from axis to axis: their turns come in different samples
        outside = add_regressors(outside, seen[:n], kept_information(count, stride, h, alpha), stride * h)
    outside = Outside(outside.waiting + scale * e, *outside[1:])
    if len(b) > 0:
        kept = kept_information(count, stride, h, alpha)
        instruments = add_signals(instruments, seen[:n], scale * known, b, stride if count % stride == 0 else 0, kept)
    noise = remember(past, e, certain, d, h, c)
    return axis, PredictorState(tuple(memory), noise, w, outside, instruments)


def _renew(
    factor: list[float], omega: list[float], index: int, first: float, prior: float, change: float, forgotten: float
) -> None:
    """Let the parameter ``index`` change by the variance ``change`` in time, in place, and return to ``first``.

    Left alone, it would approach its ``prior`` variance: Gamma' = change - Gamma^2 change / prior^2. The share of the
    prior that was ``forgotten`` is given back too.
    """
    if change > 0.0:
        loosen(factor, index, change)
    share = change / prior + forgotten
    if share > 0.0:
        n = len(omega)
        take_measurement(factor, omega, unit_vector(index, n), first, prior / share, 1.0)
