"""What any detector can notice of a change: the information in the motion that was flown, and excited flight by it.

A change adds the acceleration g to one axis, against a random torque and the encoder. The oracle knows everything but
whether the change has taken place: the noise and its spectrum, the axis' dynamics, the size and its sign, g itself, and
that nothing else can change. The Kalman filter of

    x'' = -a x - b x' + d + g,    d' = -d/tau + white noise,    y = x + white noise

makes of g the innovations' mean psi, of variance S. After a time t it has

    J(t) = sum psi^2/S

of information, and its log-likelihood ratio is N(J/2, J) with the change and N(-J/2, J) without.

* power: the test of the largest power (Neyman and Pearson) on the 20 s after the change, of which one in T/20 s may be
  false, notices it with the probability Phi(sqrt(J) - z), z the quantile of 1 - 20 s/T.
* delay: no detector with a mean time T between false alarms is on average faster than the time at which J/2 = ln(T/1 s)
  (Lorden, Annals of Mathematical Statistics 42, 1971, to first order).
* excited: the end of 20 s of excited flight. A motion excites a change as far as it tells of it. Twenty seconds are
  excited if they hold the information with which a detector that does not know which of M changes took place, but all
  the rest, notices this one in 95 %: J* = (z_M + 1.645)^2, z_M the quantile of 1 - 20 s/(M T). The 20 s of excited
  flight are over 20 s after the change, or when J reaches J*, whichever is later.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_discrete_are
from scipy.stats import norm

from benchmarks.closed_loop_rigs import SHAKE, TORQUE_STD, TORQUE_TIME
from benchmarks.follow_changes import FRICTION, GAIN, MASS
from tests.blind.coefficients import Coefficients
from tests.blind.encoders import COUNTS_PER_TURN

H = 0.01
"""Sampling period [s]."""

LIMIT, POWER, TESTS = 20.0, 0.95, 32
"""Time in which a change is to be noticed [s], with which probability, among how many: 16 of either sign."""


class Excitation(NamedTuple):
    """``power`` of the oracle within 20 s [1]; times after the change [s], inf if longer than flown.

    ``delay``: the mean that no detector falls below; ``excited``: when 20 s of excited flight are over.
    """

    power: float
    delay: float
    excited: float


def excitation(
    kind: str, rows: np.ndarray, c: Coefficients, start: float, false_alarm_time: float
) -> Excitation | None:
    """Return what the motion after a change tells of it; None for the kinds that no bar asks for.

    Parameters
    ----------
    kind : str
        Of :mod:`benchmarks.follow_changes`.
    rows : ndarray, shape (N, 5)
        Voltages [V] and angles [rad] every 10 ms.
    c : Coefficients
        Of the rig before the change.
    start : float
        Time of the change [s].
    false_alarm_time : float
        Mean time T between false alarms [s].
    """
    found = _added(kind, rows, c)
    if found is None:
        return None
    axis, g = found
    # what acted before the change did not act: the filter's error begins there
    total = np.cumsum(_information(g[round(start / H) :], axis, c))
    false = LIMIT / false_alarm_time
    power = float(norm.cdf(math.sqrt(total[round(LIMIT / H) - 1]) - norm.ppf(1.0 - false)))
    excited = _reached(total, (norm.ppf(1.0 - false / TESTS) + norm.ppf(POWER)) ** 2)
    return Excitation(power, _reached(total, 2.0 * math.log(false_alarm_time)), max(LIMIT, excited))


def _reached(total: np.ndarray, information: float) -> float:
    """Return the time after which ``total`` exceeds an ``information`` [s]."""
    enough = np.flatnonzero(total > information)
    return H * (int(enough[0]) + 1) if len(enough) else math.inf


def _added(kind: str, rows: np.ndarray, c: Coefficients) -> tuple[int, np.ndarray] | None:
    """Return the axis on which a change acts, and the acceleration that it adds there [rad/s^2]."""
    pitch = rows[:, 2]
    if kind == "k_x":
        return 0, GAIN * c.k_x * _turned(rows[:, 0] - rows[:, 1], c)
    if kind == "k_z":
        return 1, GAIN * c.k_z * _turned(rows[:, 0] + rows[:, 1], c) * np.cos(pitch)
    if kind == "k_y":
        return 2, GAIN * c.k_y * _turned(rows[:, 0] + rows[:, 1], c) * np.sin(pitch)
    if kind == "mass":
        return 1, np.full(len(rows), MASS)
    if kind.startswith("friction_"):
        name = kind.removeprefix("friction_")
        axis = tuple(FRICTION).index(name)
        # the sign of the rate over .2 s, in which a count of the encoder is 8 mrad/s
        rate = np.gradient(np.convolve(np.pad(rows[:, 2 + axis], 10, "edge"), np.ones(21) / 21.0, "valid"))
        return axis, -FRICTION[name] * np.sign(rate)
    return None


def _turned(voltage: np.ndarray, c: Coefficients) -> np.ndarray:
    """Return a sum of voltages [V] as the rotors follow it."""
    stay = math.exp(-H / c.t_m)
    nu, result = float(voltage[0]), np.empty(len(voltage))
    for k in range(len(voltage)):
        result[k] = nu
        nu = voltage[k] + stay * (nu - voltage[k])
    return result


def _information(g: np.ndarray, axis: int, c: Coefficients) -> np.ndarray:
    """Return psi^2/S of every sample."""
    fade = math.exp(-H / TORQUE_TIME)
    stiffness = (c.a_th, c.a_e, 0.0)[axis]
    damping = (c.a_wx, c.a_wz, c.a_wy)[axis]
    F = np.array([[1.0, H, 0.5 * H * H], [-stiffness * H, 1.0 - damping * H, H], [0.0, 0.0, fade]])
    Q = np.diag([0.0, 0.0, TORQUE_STD**2 * (1.0 - fade * fade)])
    count = 2.0 * math.pi / COUNTS_PER_TURN[axis]
    r = count * count * (1.0 / 12.0 + SHAKE * SHAKE)
    P = solve_discrete_are(F.T, np.array([[1.0], [0.0], [0.0]]), Q, np.array([[r]]))
    S = P[0, 0] + r
    gain, made, found = P[:, 0] / S, np.zeros(3), np.empty(len(g))
    for k in range(len(g)):
        made = F @ made + np.array([0.5 * H * H, H, 0.0]) * g[k]
        found[k] = made[0] ** 2 / S
        made = made - gain * made[0]
    return found
