"""Covariance of the observer's errors: after a gap, and in the steady state of a stream without gaps.

P is the covariance of the errors (x, w, d) of an axis, s the variance of the innovation. Both are in units of the
variance r of the encoder's noise:

    P <- F P F^T + diag(0, 0, q_d),    F = [[1, h, h^2/2], [0, 1, h], [0, 0, exp(-gamma h)]]
    s = P_xx + 1,    l = P_(.x)/s,    P <- P - l P_(x.)

The observer's bandwidth omega_o stands for the drive q_d = omega_o^6 h^2.
"""

from math import log
from typing import NamedTuple

from heli_plant.observer import ObserverGains, observer_gains

from ..online.linear_algebra import dot
from .changes import Matrix

_FADING = 100.0  # a gap is forgotten when its effect on the covariance has fallen by this factor
_MEMORIES = 4.0  # samples after which the covariance is steady, in multiples of those in which a gap is forgotten


class Steady(NamedTuple):
    """One axis in a stream without gaps: its ``gains``, P after a correction, s, and the drive q_d [1/s^4]."""

    gains: ObserverGains
    covariance: Matrix
    variance: float
    drive: float


def gap_memory(bandwidth: float, h: float) -> int:
    """Return the samples in which a gap is forgotten; ``bandwidth`` [rad/s], sampling period ``h`` [s].

    The slowest poles of the error have the real part -omega_o/2; a covariance fades twice as fast.
    """
    return round(log(_FADING) / (bandwidth * h))


def find_steady_state(bandwidth: float, h: float) -> Steady:
    """Return the steady state for a ``bandwidth`` omega_o [rad/s] and samples every ``h`` [s]."""
    gains, drive = observer_gains(bandwidth, h), bandwidth**6 * h * h
    P: Matrix = ((1.0, 0.0, 0.0), (0.0, bandwidth**2, 0.0), (0.0, 0.0, bandwidth**4))
    variance = 1.0
    for _ in range(round(_MEMORIES * gap_memory(bandwidth, h))):
        P = predict_covariance(P, h, gains.decay, drive)
        variance = P[0][0] + 1.0
        _, P = correct_covariance(P, gains.decay)
    return Steady(gains, P, variance, drive)


def predict_covariance(P: Matrix, h: float, decay: float, drive: float) -> Matrix:
    """Return P one sampling interval later; ``decay`` = exp(-gamma h), ``drive`` q_d [1/s^4]."""
    F, q = ((1.0, h, 0.5 * h * h), (0.0, 1.0, h), (0.0, 0.0, decay)), (0.0, 0.0, drive)
    moved = [[dot(row, column) for column in P] for row in F]  # P is symmetric
    rows = [[dot(row, other) for other in F] for row in moved]
    return tuple([tuple([x + (q[i] if i == j else 0.0) for j, x in enumerate(row)]) for i, row in enumerate(rows)])


def correct_covariance(P: Matrix, decay: float) -> tuple[ObserverGains, Matrix]:
    """Return the Kalman gain l of a sample, and P after the correction by the sample."""
    angle, rate, torque = gains = [x / (P[0][0] + 1.0) for x in P[0]]
    after = [tuple([x - gain * y for x, y in zip(row, P[0], strict=True)]) for row, gain in zip(P, gains, strict=True)]
    return ObserverGains(angle, rate, torque, decay), tuple(after)
