"""How much a sample counts after samples that did not come in, and what is not known of their voltages.

After a gap the state is known less well than in the steady state of the observer (:mod:`heli_plant.observer`). With P
the covariance of the errors of angle, rate and unmodelled acceleration (x, w, d), in units of the variance r of the
encoder's noise,

    prediction     P <- F P F^T + diag(0, q_w, q_d),    F = [[1, h, h^2/2], [0, 1, h], [0, 0, exp(-gamma h)]]
    innovation     s = P_xx + 1,    l = P_(.x)/s
    correction     P <- P - l P_(x.)

q_d = omega_o^6 h^2 is what the observer's bandwidth stands for, and q_w = (k h sigma)^2/r for each lost voltage, k the
gain of the axis. Lost voltages are taken to lie on a straight line between those before and after the gap, which misses
by sigma. It is learned where no sample is missing: of three in a row the middle one is taken for lost,

    sigma^2 = mean of (V_(k-1) - (V_(k-2) + V_k)/2)^2

for the difference (front - rear) and the sum of the voltages, over two minutes.

Sources: Anderson and Moore, Optimal Filtering, 1979, chapter 3; Sinopoli and others, Kalman filtering with intermittent
observations, IEEE Transactions on Automatic Control 49 (2004).
"""

from math import log
from typing import NamedTuple

from heli_plant.observer import ObserverGains

from .blocks import MEMORY

Voltages = tuple[float, float]
"""Front and rear [V]."""

_ALMOST = 100.0
"""The covariance has come back to its steady state when what a gap has made of it is less by this factor."""

_STEADY = 4.0
"""The steady state is looked for in this many times the samples in which a gap is forgotten."""


class Covariance(NamedTuple):
    """P of one axis, over r: ``angle`` xx [1], ``angle_rate`` xw [1/s], ``rate`` ww [1/s^2] and so on for d."""

    angle: float
    angle_rate: float
    angle_torque: float
    rate: float
    rate_torque: float
    torque: float


class Steady(NamedTuple):
    """Of one axis in a stream without gaps: P after a correction, s, and the drive q_d [1/s^4]."""

    covariance: Covariance
    variance: float
    drive: float


class Roughness(NamedTuple):
    """sigma^2 of the ``difference`` and of the ``total`` of the voltages [V^2], over ``samples``.

    The ``last`` sample's voltages and those ``before`` it [V]; ``in_a_row``: samples since one was missing.
    """

    difference: float
    total: float
    samples: int
    last: Voltages
    before: Voltages
    in_a_row: int


def gap_memory(bandwidth: float, h: float) -> int:
    """Return the samples in which a gap is forgotten; ``bandwidth`` [rad/s], sampling period ``h`` [s].

    The slowest poles of the error have the real part -omega_o/2, and a covariance fades with twice that.
    """
    return round(log(_ALMOST) / (bandwidth * h))


def find_steady_state(bandwidth: float, h: float, kept: float) -> Steady:
    """Return the steady state for a ``bandwidth`` omega_o [rad/s], samples every ``h`` [s], exp(-gamma h) ``kept``."""
    drive = bandwidth**6 * h * h
    u, variance = Covariance(1.0, 0.0, 0.0, bandwidth**2, 0.0, bandwidth**4), 1.0
    for _ in range(round(_STEADY * gap_memory(bandwidth, h))):
        u = predict_covariance(u, h, kept, 0.0, drive)
        variance = u.angle + 1.0
        u = correct_covariance(u)
    return Steady(u, variance, drive)


def predict_covariance(u: Covariance, h: float, kept: float, of_rate: float, drive: float) -> Covariance:
    """Return P one sampling interval later; ``of_rate`` q_w [1/s^2] and ``drive`` q_d [1/s^4]."""
    xx, xw, xd, ww, wd, dd = u
    half = 0.5 * h * h
    # M = F P, of which only what F P F^T needs
    m_xx, m_xw, m_xd = xx + h * xw + half * xd, xw + h * ww + half * wd, xd + h * wd + half * dd
    m_ww, m_wd = ww + h * wd, wd + h * dd
    return Covariance(
        m_xx + h * m_xw + half * m_xd,
        m_xw + h * m_xd,
        kept * m_xd,
        m_ww + h * m_wd + of_rate,
        kept * m_wd,
        kept * kept * dd + drive,
    )


def kalman_gains(u: Covariance, kept: float) -> ObserverGains:
    """Return the Kalman gain l for P before a correction."""
    s = u.angle + 1.0
    return ObserverGains(u.angle / s, u.angle_rate / s, u.angle_torque / s, kept)


def correct_covariance(u: Covariance) -> Covariance:
    """Return P after the correction by a sample."""
    xx, xw, xd, ww, wd, dd = u
    s = xx + 1.0
    return Covariance(xx / s, xw / s, xd / s, ww - xw * xw / s, wd - xw * xd / s, dd - xd * xd / s)


def learn_roughness(r: Roughness, voltages: Voltages, missing: bool, h: float) -> Roughness:
    """Return what is known after a sample with ``voltages`` [V], before which one was ``missing`` or not."""
    if missing:
        return r._replace(last=voltages, in_a_row=1)
    in_a_row = r.in_a_row + 1
    if in_a_row < 3:
        return r._replace(last=voltages, before=r.last, in_a_row=in_a_row)
    front = r.last[0] - 0.5 * (r.before[0] + voltages[0])
    rear = r.last[1] - 0.5 * (r.before[1] + voltages[1])
    count = min(r.samples + 1, round(MEMORY / h))
    return Roughness(
        difference=r.difference + ((front - rear) * (front - rear) - r.difference) / count,
        total=r.total + ((front + rear) * (front + rear) - r.total) / count,
        samples=count,
        last=voltages,
        before=r.last,
        in_a_row=in_a_row,
    )
