"""How well the observer knows the rig after a gap: the covariance of its errors, and the steady state of a stream.

With P the covariance of the errors (x, w, d) of an axis, in units of the variance r of the encoder's noise, and s that
of the innovation,

    P <- F P F^T + diag(0, q_w, q_d),    F = [[1, h, h^2/2], [0, 1, h], [0, 0, exp(-gamma h)]]
    s = P_xx + 1,    l = P_(.x)/s,    P <- P - l P_(x.)

q_d = omega_o^6 h^2 is what the observer's bandwidth stands for; q_w is that of lost voltages (:mod:`.observer`).

Sources: Anderson and Moore, Optimal Filtering, 1979, chapter 3; Gustafsson, Adaptive Filtering and Change Detection,
2000, section 8.3; Sinopoli and others, IEEE Transactions on Automatic Control 49 (2004).
"""

from math import log
from typing import NamedTuple

from heli_plant.observer import ObserverGains, observer_gains

_ALMOST = 100.0  # the steady state is back when what a gap has made of the covariance is less by this factor
_STEADY = 4.0  # the steady state is looked for in this many times the samples in which a gap is forgotten


class Covariance(NamedTuple):
    """P of one axis, over r: ``angle`` xx [1], ``angle_rate`` xw [1/s], ``rate`` ww [1/s^2] and so on for d."""

    angle: float
    angle_rate: float
    angle_torque: float
    rate: float
    rate_torque: float
    torque: float


class Steady(NamedTuple):
    """One axis in a stream without gaps: its ``gains``, P after a correction, s, and the drive q_d [1/s^4]."""

    gains: ObserverGains
    covariance: Covariance
    variance: float
    drive: float


def gap_memory(bandwidth: float, h: float) -> int:
    """Return the samples in which a gap is forgotten; ``bandwidth`` [rad/s], sampling period ``h`` [s].

    The slowest poles of the error have the real part -omega_o/2, and a covariance fades with twice that.
    """
    return round(log(_ALMOST) / (bandwidth * h))


def find_steady_state(bandwidth: float, h: float) -> Steady:
    """Return the steady state for a ``bandwidth`` omega_o [rad/s] and samples every ``h`` [s]."""
    gains, drive = observer_gains(bandwidth, h), bandwidth**6 * h * h
    u, variance = Covariance(1.0, 0.0, 0.0, bandwidth**2, 0.0, bandwidth**4), 1.0
    for _ in range(round(_STEADY * gap_memory(bandwidth, h))):
        u = predict_covariance(u, h, gains.kept, 0.0, drive)
        variance = u.angle + 1.0
        _, u = correct_covariance(u, gains.kept)
    return Steady(gains, u, variance, drive)


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


def correct_covariance(u: Covariance, kept: float) -> tuple[ObserverGains, Covariance]:
    """Return the Kalman gain l of a sample, and P after the correction by it."""
    xx, xw, xd, ww, wd, dd = u
    s = xx + 1.0
    after = Covariance(xx / s, xw / s, xd / s, ww - xw * xw / s, wd - xw * xd / s, dd - xd * xd / s)
    return ObserverGains(xx / s, xw / s, xd / s, kept), after
