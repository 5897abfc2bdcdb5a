"""How well the observer knows an axis: the covariance of its error, the gain, and the variance of the innovation.

In a stream without gaps all three are constant: the observer is the Kalman filter in its steady state. After samples
that did not come in, the state is known less well; the next sample counts for more, and its innovation scatters more.
With P the covariance of the errors of (x, w, d), in units of the variance r of the encoder's noise,

    prediction     P <- F P F^T + diag(0, q_w, q_d),    F = [[1, h, h^2/2], [0, 1, h], [0, 0, exp(-gamma h)]]
    innovation     s = P_xx + 1,    l = P_(.x)/s
    correction     P <- P - l P_(x.)

q_d = omega_o^6 h^2 is what the observer's bandwidth stands for (:mod:`heli_plant.observer`). A lost sample takes the
voltages of its instant with it. They are put back by a straight line (:mod:`.gap`), which is wrong by sigma [V]; a
gain k makes of that a rate of k h sigma, so that each of them adds q_w = (k h sigma)^2/r. sigma comes from the samples
that did come in (:mod:`.roughness`).
Source: Anderson and Moore, Optimal Filtering, 1979, chapter 3; Sinopoli, Schenato, Franceschetti, Poolla, Jordan,
Sastry, Kalman filtering with intermittent observations, IEEE Transactions on Automatic Control 49 (2004).
"""

from math import log
from typing import NamedTuple

from heli_plant.observer import ObserverGains

_ALMOST = 100.0
"""The covariance has come back to its steady state when what a gap has made of it is less by this factor."""

_STEADY = 4.0
"""The steady state is looked for in this many times the samples in which a gap is forgotten."""


class Uncertainty(NamedTuple):
    """P of one axis, over r: ``angle`` xx [1], ``angle_rate`` xw [1/s], ``rate`` ww [1/s^2] and so on for d."""

    angle: float
    angle_rate: float
    angle_torque: float
    rate: float
    rate_torque: float
    torque: float


class Steady(NamedTuple):
    """Of one axis in a stream without gaps: P after a correction, s, and the drive q_d [1/s^4]."""

    uncertainty: Uncertainty
    variance: float
    drive: float


def memory_of(bandwidth: float, h: float) -> int:
    """Return the samples in which a gap is forgotten; ``bandwidth`` [rad/s], sampling period ``h`` [s].

    The slowest poles of the error have the real part -omega_o/2, and a covariance fades with twice that.
    """
    return round(log(_ALMOST) / (bandwidth * h))


def steady_state(bandwidth: float, h: float, kept: float) -> Steady:
    """Return the steady state for a ``bandwidth`` omega_o [rad/s], samples every ``h`` [s], exp(-gamma h) ``kept``."""
    drive = bandwidth**6 * h * h
    u, variance = Uncertainty(1.0, 0.0, 0.0, bandwidth**2, 0.0, bandwidth**4), 1.0
    for _ in range(round(_STEADY * memory_of(bandwidth, h))):
        u = grown(u, h, kept, 0.0, drive)
        variance = u.angle + 1.0
        u = corrected(u)
    return Steady(u, variance, drive)


def grown(u: Uncertainty, h: float, kept: float, of_rate: float, drive: float) -> Uncertainty:
    """Return P one sampling interval later; ``of_rate`` q_w [1/s^2] and ``drive`` q_d [1/s^4]."""
    xx, xw, xd, ww, wd, dd = u
    half = 0.5 * h * h
    # M = F P, of which only what F P F^T needs
    m_xx, m_xw, m_xd = xx + h * xw + half * xd, xw + h * ww + half * wd, xd + h * wd + half * dd
    m_ww, m_wd = ww + h * wd, wd + h * dd
    return Uncertainty(
        m_xx + h * m_xw + half * m_xd,
        m_xw + h * m_xd,
        kept * m_xd,
        m_ww + h * m_wd + of_rate,
        kept * m_wd,
        kept * kept * dd + drive,
    )


def gains_of(u: Uncertainty, kept: float) -> ObserverGains:
    """Return the Kalman gain l for P before a correction."""
    s = u.angle + 1.0
    return ObserverGains(u.angle / s, u.angle_rate / s, u.angle_torque / s, kept)


def corrected(u: Uncertainty) -> Uncertainty:
    """Return P after the correction by a sample."""
    xx, xw, xd, ww, wd, dd = u
    s = xx + 1.0
    return Uncertainty(xx / s, xw / s, xd / s, ww - xw * xw / s, wd - xw * xd / s, dd - xd * xd / s)
