"""Recursive prediction errors: estimation of one axis that stays right when a controller closes the loop.

Least squares (7) is consistent where its error sigma is independent of the regressors phi. Under a controller it is
not: a torque moves the rig, the controller answers through the voltages, and phi^T Omega explains the torque by them.
Innovations do not have this fault. e_k = G sigma (:mod:`.whitening`) is what no earlier sample can tell, and a
controller knows none but earlier samples. With z = G (phi, y) and the noise model (:mod:`.whitening`) estimated
along, the recursive Gauss-Newton step on the sum of e^2 / lambda is adaptation (7) with other regressors,

    e   = z_y - z_phi^T Omega
    psi = z_phi + r e / (c + r^T Omega)
    Omega' = Gamma psi e / (lambda h),    Gamma' = alpha Gamma - Gamma psi psi^T Gamma / (lambda h)

c + r^T Omega is the derivative of e with respect to the newest angle, which F takes as the end of a straight line: c
that of z_y, and r that of z_phi with the sign turned. e / (c + r^T Omega) is thus the innovation of the angle itself,
and psi is z_phi without it: what was known before the sample. Without this, the damping of an elevation comes out
wrong by .05 to .1 1/s. The noise model's nu stands behind Omega, with -d and -g behind psi. Divided by
sqrt(lambda h), e has the intensity 1, and Gamma is the covariance of Omega and nu. The first seconds are forgotten
(:func:`.adaptation.kept_early`).
Sources: Ljung and Soderstrom, Theory and Practice of Recursive Identification, 1983, chapter 3; Forssell and Ljung,
Closed-loop identification revisited, Automatica 35 (1999), section 5 (the direct method).

**Prior:** Gamma is the covariance of Omega where innovations have the intensity 1 (:mod:`.prediction_error`), so that
Gamma(0) can say what can be built on a bench, and never needs to be 1e3. The widths are those of the tracer. Without
them the first seconds of a flight in wind give a pitch that falls over (a_th < 0) with five times the damping of any
rig, and the noise model follows.
"""

from math import exp, log, sqrt
from operator import add
from typing import NamedTuple

from .adaptation import AdaptationCoefficients, AxisState, kept_early, loosen, measure, unit_vector
from .instruments import Instruments, add_signals, no_instruments
from .loop import Outside, OutsideCoefficients, add_regressors, nothing_outside
from .moments import no_moments
from .whitening import (
    BANDWIDTH_PRIOR,
    CORNER_PRIOR,
    Memory,
    Noise,
    NoiseCoefficients,
    NoiseModel,
    Whitening,
    bandwidth_slope,
    bounded,
    first_noise,
    remember,
    settled_memory,
    whiten,
    whitening,
)

PITCH, PITCH_FREE = (0.5, 4.0, 1.2), (0.5, 4.0, 2.0, 1.2)
"""Standard deviations of Omega of the pitch, theta0 known or not: a motion does not die out much faster than in a
second [1/s]; g d / l^2 with the mass within 2 cm of its axis [1/s^2]; with theta0 within .5 rad; a gain [rad/s^2/V]
of twice that of a full thrust of 3 rad/s^2 at 5 V."""

ELEVATION = (0.5, 4.0, 3.0, 0.5, 0.4)
"""The same of the elevation: its period is longer than 3 s [1/s^2]; the weight that the counterweight leaves
[rad/s^2]; a_lt [1]; full thrust of 1 rad/s^2."""

TRAVEL = (0.5, 0.4)
"""The same of the travel."""

PITCH_LAG, ELEVATION_LAG = 0.03, 0.008
"""The same of k Delta [rad/s^2 s/V] (:mod:`.signals`): .04 s of lag, half of what is given, times usual gains."""


class PredictorCoefficients(NamedTuple):
    """What the prediction errors need to know of filter and sampling.

    ``f1``, ``f2`` of A_F; h [s]; ``newest`` c [1/s^2]; ``newest_rate`` and ``newest_angle``, the r of the columns
    -(angle')_f [1/s] and -(angle)_f [1]; the noise model's; ``refresh`` samples between two evaluations of G,
    the share ``kept`` by the forgetting in that time and the variances by which ln omega_o and ln gamma may change.
    """

    f1: float
    f2: float
    sample_time: float
    newest: float
    newest_rate: float
    newest_angle: float
    noise: NoiseCoefficients
    refresh: int
    kept: float
    bandwidth_change: float
    corner_change: float
    outside: OutsideCoefficients


class PredictorState(NamedTuple):
    """What an axis remembers beside :class:`AxisState`.

    The whitened signals' past, the noise model, G, what came from outside the loop with the sum of the innovations that
    it has not taken in yet, the prior of Omega and nu, ``first`` values and their variances, and the instruments.
    """

    memory: tuple[Memory, ...]
    noise: NoiseModel
    whitening: Whitening
    outside: Outside
    waiting: float
    first: tuple[float, ...]
    prior: tuple[float, ...]
    instruments: Instruments


def with_noise(axis: AxisState, noise: Noise, widths: tuple[float, ...], c: PredictorCoefficients) -> AxisState:
    """Return ``axis`` before its first sample, with nu, beginning at ``noise``, appended to Omega and Gamma.

    ``widths`` are the standard deviations of Omega beforehand, where Gamma(0) says no smaller ones.
    """
    n = len(axis.omega)
    before = list(axis.factor)
    for i in range(n):
        own = i * (i + 3) // 2
        before[own] = min(before[own], widths[i] * widths[i])
    bandwidth = bounded(log(noise.bandwidth), c.noise.least_bandwidth, c.noise.most_bandwidth)
    factor = (*before, *([0.0] * n), BANDWIDTH_PRIOR**2, *([0.0] * (n + 1)), CORNER_PRIOR**2)
    size = n + 2 + len(axis.scores) + 1
    packed = (0.0,) * (size * (size + 1) // 2)
    return axis._replace(
        factor=factor, omega=(*axis.omega, bandwidth, log(noise.corner)), sums=packed, moments=no_moments(size)
    )


def noise_of(axis: AxisState) -> Noise:
    """Return bandwidth and corner [rad/s] of an axis that :func:`with_noise` gave nu."""
    return Noise(exp(axis.omega[-2]), exp(axis.omega[-1]))


def first_predictor(z: tuple[float, ...], axis: AxisState, c: PredictorCoefficients) -> PredictorState:
    """Return the state at sample 0 of the signals ``z`` = (phi, watched, y) of ``axis``, settled there."""
    w = whitening(axis.omega[-2], axis.omega[-1], c.f1, c.f2, c.sample_time)
    noise = first_noise(c.noise)
    outside = nothing_outside(len(axis.omega) - 2)
    prior = tuple([axis.factor[i * (i + 3) // 2] for i in range(len(axis.omega))])
    memory = tuple([settled_memory(value, w) for value in z])
    instruments = no_instruments(len(axis.omega) - 2)
    return PredictorState(memory, noise, w, outside, 0.0, axis.omega, prior, instruments)


def rest_predictor(p: PredictorState, z: tuple[float, ...]) -> PredictorState:
    """Return ``p`` after a sample at which nothing is estimated yet."""
    memory, _ = whiten(p.memory, z, p.whitening)
    return PredictorState(tuple(memory), p.noise, p.whitening, p.outside, 0.0, p.first, p.prior, p.instruments)


def predict_axis(
    axis: AxisState,
    p: PredictorState,
    z: tuple[float, ...],
    count: int,
    c: PredictorCoefficients,
    a: AdaptationCoefficients,
    b: tuple[float, ...] = (),
) -> tuple[AxisState, PredictorState]:
    """Return axis and predictor after the sample ``z`` = (phi, watched, y), the one numbered ``count`` from 0.

    Omega ends with nu; the axis' sums are those of the products of (psi, -d, -g, watched, y), packed. The first column
    of phi is minus the filtered rate and, where there are more than two, the second one minus the filtered angle. ``b``
    are the instruments (:mod:`.instruments`), empty while no reference has moved.
    """
    # Taken apart once: the interpreter inside an FMU reads a tuple's field by name at several times a local's cost.
    before, past, w, outside, waiting, first, prior, instruments = p
    factor_before, omega_before, _, sums, moments, errors, excitation, scores = axis
    bounds, h = c.noise, c.sample_time
    memory, v = whiten(before, z, w)
    omega = list(omega_before)
    n = len(omega) - 2
    regressand = e = v[-1]
    for i in range(n):
        e -= v[i] * omega[i]
    angle = n > 2
    innovation = e / (c.newest + c.newest_rate * omega[0] + (c.newest_angle * omega[1] if angle else 0.0))
    v[0] += c.newest_rate * innovation
    if angle:
        v[1] += c.newest_angle * innovation
    d, g = 0.0, 0.0
    if past.seen >= bounds.rest:
        d = bandwidth_slope(past, w)
        g = before[-1].corner_slope
        for i in range(n):
            g -= before[i].corner_slope * omega[i]
    # The regressand: psi^T Omega, which is z_y short of c times the angle's innovation, and e as it is with nu = 0.
    known = regressand + e - c.newest * innovation
    v[-1] = known - d * w.log_bandwidth - g * w.log_corner
    scale = 1.0 / sqrt(past.variance * h)
    seen = [scale * x for x in (*v[:n], -d, -g, *v[n:])]

    factor, direction = list(factor_before), [0.0] * (n + 2)
    kept = kept_early(count, 1, h)
    beta, r, _, _ = a
    _, s = measure(factor, omega, seen[: n + 2], seen[-1], r * kept, beta * kept, direction)
    certain = r / (r + (s - r * kept))
    turn = count % c.refresh
    if turn < n + 2:
        change = 0.0 if turn < n else c.bandwidth_change if turn == n else c.corner_change
        forgotten = 1.0 - c.kept * kept_early(count, c.refresh, h)
        _renew(factor, omega, turn, first[turn], prior[turn], change, forgotten)
    if not bounds.least_bandwidth <= omega[n] <= bounds.most_bandwidth:
        omega[n] = bounded(omega[n], bounds.least_bandwidth, bounds.most_bandwidth)
    if not bounds.least_corner <= omega[n + 1] <= bounds.most_corner:
        omega[n + 1] = bounded(omega[n + 1], bounds.least_corner, bounds.most_corner)
    if turn == n + 1:
        w = whitening(omega[n], omega[n + 1], c.f1, c.f2, h)

    products = [a * b for i, a in enumerate(seen) for b in seen[i:]]
    sums = tuple(map(add, sums, products))
    axis = AxisState(tuple(factor), tuple(omega), e, sums, moments, errors, excitation, scores)
    # n differs from axis to axis: their turns come in different samples.
    if (count + n) % c.outside.stride == 0:
        kept = c.outside.kept * kept_early(count, c.outside.stride, h)
        outside = add_regressors(outside, seen[:n], waiting, kept, c.outside)
        waiting = 0.0
    if len(b) > 0:
        stride = c.outside.stride if count % c.outside.stride == 0 else 0
        kept = c.outside.kept * kept_early(count, c.outside.stride, h)
        instruments = add_signals(instruments, seen[:n], scale * known, b, stride, kept)
    noise = remember(past, e, certain, d, bounds)
    return axis, PredictorState(tuple(memory), noise, w, outside, waiting + scale * e, first, prior, instruments)


def _renew(
    factor: list[float], omega: list[float], index: int, first: float, prior: float, change: float, forgotten: float
) -> None:
    """Let the parameter ``index`` change by the variance ``change`` in time, in place, and return to ``first``.

    Left alone, it would approach its prior: the mean ``first`` and the variance ``prior``, Gamma' = change
    - Gamma^2 change / prior^2. The share of the prior that was ``forgotten`` is given back too.
    """
    if change > 0.0:
        loosen(factor, index, change)
    share = change / prior + forgotten
    if share > 0.0:
        n = len(omega)
        measure(factor, omega, unit_vector(index, n), first, prior / share, 1.0, [0.0] * n)
