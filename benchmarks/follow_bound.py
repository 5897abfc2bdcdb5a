"""What any detector can notice of a changed gain of the travel: the information in the motion that was flown.

A change of the travel's gain by delta acts on the travel alone, by g = delta k_y mu_s sin(theta), against a random
torque and the encoder. The oracle knows everything but whether the change has taken place: the noise and its spectrum,
the size and its sign, g itself, and that nothing else can change. The Kalman filter of x'' = d + g, d' = -d/tau + white
noise, y = x + white noise, makes of g the innovations' mean psi, of variance S. After a time t it has

    J(t) = sum psi^2/S

of information, and its log-likelihood ratio is N(J/2, J) with the change and N(-J/2, J) without.

* power: the test of the largest power (Neyman and Pearson) on the 20 s after the change, of which one in T/20 s may be
  false, notices it with the probability Phi(sqrt(J) - z), z the quantile of 1 - 20 s/T.
* delay: no detector with a mean time T between false alarms is on average faster than the time at which J/2 = ln(T/1 s)
  (Lorden, Annals of Mathematical Statistics 42, 1971, to first order).
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_discrete_are
from scipy.stats import norm

from benchmarks.closed_loop_rigs import SHAKE, TORQUE_STD, TORQUE_TIME
from tests.blind.coefficients import Coefficients
from tests.blind.encoders import COUNTS_PER_TURN

H = 0.01
"""Sampling period [s]."""


class Bound(NamedTuple):
    """``power`` within 20 s [1], and the mean ``delay`` [s] that no detector falls below, inf if longer than flown."""

    power: float
    delay: float


def bound(rows: np.ndarray, c: Coefficients, start: float, share: float, false_alarm_time: float) -> Bound:
    """Return the bound of a change of k_y.

    Parameters
    ----------
    rows : ndarray, shape (N, 5)
        Voltages [V] and angles [rad] every 10 ms.
    c : Coefficients
        Of the rig before the change.
    start, share : float
        Time of the change [s], and its size as a share of k_y.
    false_alarm_time : float
        Mean time T between false alarms [s].
    """
    nu, stay = rows[0, :2].copy(), math.exp(-H / c.t_m)
    g = np.empty(len(rows))
    for k in range(len(rows)):
        g[k] = share * c.k_y * nu.sum() * math.sin(rows[k, 2])
        nu = rows[k, :2] + stay * (nu - rows[k, :2])
    # what acted before the change did not act: the filter's error begins there
    total = np.cumsum(_information(g[round(start / H) :]))
    power = float(norm.cdf(math.sqrt(total[round(20.0 / H) - 1]) - norm.ppf(1.0 - 20.0 / false_alarm_time)))
    enough = np.flatnonzero(0.5 * total > math.log(false_alarm_time))
    return Bound(power, H * (int(enough[0]) + 1) if len(enough) else math.inf)


def _information(g: np.ndarray) -> np.ndarray:
    """Return psi^2/S of every sample."""
    fade = math.exp(-H / TORQUE_TIME)
    F = np.array([[1.0, H, 0.5 * H * H], [0.0, 1.0, H], [0.0, 0.0, fade]])
    Q = np.diag([0.0, 0.0, TORQUE_STD**2 * (1.0 - fade * fade)])
    count = 2.0 * math.pi / COUNTS_PER_TURN[2]
    r = count * count * (1.0 / 12.0 + SHAKE * SHAKE)
    P = solve_discrete_are(F.T, np.array([[1.0], [0.0], [0.0]]), Q, np.array([[r]]))
    S = P[0, 0] + r
    gain, made, found = P[:, 0] / S, np.zeros(3), np.empty(len(g))
    for k in range(len(g)):
        made = F @ made + np.array([0.5 * H * H, H, 0.0]) * g[k]
        found[k] = made[0] ** 2 / S
        made = made - gain * made[0]
    return found
