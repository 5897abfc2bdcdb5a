r"""The mean of one coefficient over several rigs, by a random-effects model.

Rig i gives an estimate y_i with standard error s_i. The model is

    y_i = mu + u_i + e_i,   u_i ~ N(0, tau^2),   e_i ~ N(0, s_i^2)

with the mean mu of the make, the spread tau between its rigs, and

    Q(tau) = sum w_i (y_i - m)^2,   m = sum w_i y_i / sum w_i,   w_i = 1 / (s_i^2 + tau^2).

* Q(tau) falls with tau, and at the true tau it is chi-squared with k - 1 degrees of freedom for k rigs. So every
  value q of that distribution gives one tau, by Q(tau) = q. The mean k - 1 gives the estimate (Paule and Mandel 1982;
  DerSimonian and Kacker 2007, eq. 10), the outer quantiles give the interval (the Q profile of Viechtbauer 2007).
* The variance of the mean is max(1, q) / sum w_i with q = Q(tau) / (k - 1), and its quantiles are those of Student's t
  with k - 1 degrees of freedom (Hartung and Knapp 2001). The lower bound of 1 keeps the interval of a few rigs that
  agree by chance from being too short (Röver, Knapp and Friede 2015).
* Q(0) tests whether all rigs have one value (Cochran 1954). I^2 = max(0, 1 - (k - 1) / Q(0)) is the share of the
  variance of the estimates that comes from differences between the rigs (Higgins and Thompson 2002, eq. 10).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2, norm, t

from heli_identifier.records import Array

LEVEL = 0.95  # probability of all intervals

LARGEST_LIKE_SPREAD = 0.5
"""Largest spread of coefficients that are alike, over the size of their mean: 97.7 % of a normal distribution then have
the sign of the mean."""

HOMOGENEOUS = 0.05  # least probability by Cochran's test of rigs whose coefficients are alike


@dataclass(frozen=True)
class Pooled:
    """The random-effects mean of one coefficient over k ``rigs``, in the unit of the coefficient, intervals of 95 %.

    ``p`` is the two-sided probability of such a mean if the true mean is zero, whatever the spread. ``p_no_effect`` is
    the probability of such estimates if no rig has the effect, from the fixed-effect mean over its standard error; with
    few rigs it is far smaller than ``p``, because it knows no spread. ``spread`` is tau. ``Q`` and ``Q_p`` are of
    Cochran's test, ``I2`` is 0 to 1. ``alike``: the test allows one value, and the spread is at most half of the mean.
    """

    mean: float
    standard_error: float
    interval: tuple[float, float]
    p: float
    p_no_effect: float
    spread: float
    spread_interval: tuple[float, float]
    Q: float
    Q_p: float
    I2: float
    rigs: int
    alike: bool

    @property
    def has_sign(self) -> bool:
        """Whether the interval of the mean excludes zero."""
        return self.interval[0] > 0.0 or self.interval[1] < 0.0


def pool_estimates(values: Sequence[float], standard_errors: Sequence[float]) -> Pooled:
    """Pool two or more finite estimates of one coefficient with their standard errors, which are positive."""
    y, s, k, tail = np.array(values), np.array(standard_errors), len(values), 0.5 - 0.5 * LEVEL
    fixed, Q, fixed_precision = weighted_mean(y, s, 0.0)
    tau, low, high = (solve_spread(y, s, q) for q in (k - 1.0, chi2.isf(tail, k - 1), chi2.ppf(tail, k - 1)))
    m, q, precision = weighted_mean(y, s, tau)
    error = float(np.sqrt(max(1.0, q / (k - 1)) / precision))
    half, Q_p = float(t.isf(tail, k - 1)) * error, float(chi2.sf(Q, k - 1))
    return Pooled(
        mean=m,
        standard_error=error,
        interval=(m - half, m + half),
        p=float(2.0 * t.sf(abs(m) / error, k - 1)),
        p_no_effect=float(2.0 * norm.sf(abs(fixed) * np.sqrt(fixed_precision))),
        spread=tau,
        spread_interval=(low, high),
        Q=Q,
        Q_p=Q_p,
        I2=1.0 - (k - 1) / Q if Q > k - 1 else 0.0,
        rigs=k,
        alike=Q_p >= HOMOGENEOUS and tau <= LARGEST_LIKE_SPREAD * abs(m),
    )


def weighted_mean(y: Array, s: Array, tau: float) -> tuple[float, float, float]:
    """Return m, Q(tau) and sum w_i of estimates (k,)."""
    w = 1.0 / (s**2 + tau**2)
    m = float(w @ y / w.sum())
    return m, float(w @ (y - m) ** 2), float(w.sum())


def solve_spread(y: Array, s: Array, q: float) -> float:
    """Solve Q(tau) = q for tau; 0 if Q(0) is at most q."""
    if weighted_mean(y, s, 0.0)[1] <= q:
        return 0.0
    high = float(np.sqrt(np.sum((y - y.mean()) ** 2) / q))  # there Q <= sum (y - mean)^2 / tau^2 = q
    return float(brentq(lambda tau: weighted_mean(y, s, tau)[1] - q, 0.0, 1.001 * high, xtol=1e-14 * high, rtol=1e-14))
