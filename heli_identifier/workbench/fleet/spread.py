"""The spread tau between rigs, from the weighted sum of squares of their estimates.

    Q(tau) = sum w_i (y_i - m)^2,   m = sum w_i y_i / sum w_i,   w_i = 1 / (s_i^2 + tau^2)

Q(tau) falls with tau, and at the true tau it is chi-squared with k - 1 degrees of freedom for k rigs. So every quantile
q of that distribution gives one tau, by Q(tau) = q: its mean k - 1 the estimate, its outer quantiles the interval
(the Q profile of Viechtbauer 2007), and all of them the confidence distribution of tau.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Values = NDArray[np.float64]

HALVINGS = 60
"""Of the interval of tau: the last one is below the rounding of its upper end."""

QUANTILES = 41
"""Of the confidence distribution of tau, from which a prediction interval is made."""


def weighted(y: Values, s: Values, tau: ArrayLike) -> tuple[Values, Values, Values]:
    """Weigh the estimates.

    Parameters
    ----------
    y, s : NDArray, shape (k,)
        Estimates and their standard errors.
    tau : array_like, shape (n,)

    Returns
    -------
    tuple of NDArray, each of shape (n,)
        Weighted mean m, sum of squares Q about it, and sum of the weights.
    """
    w = 1.0 / (s**2 + np.square(tau)[:, None])
    m = w @ y / w.sum(axis=1)
    return m, (w * (y - m[:, None]) ** 2).sum(axis=1), w.sum(axis=1)


def spreads(y: Values, s: Values, q: ArrayLike) -> Values:
    """Solve Q(tau) = q for every element of ``q`` (n,), all positive; 0 where already Q(0) is at most q."""
    targets = np.asarray(q, dtype=float)
    low = np.zeros(len(targets))
    high = np.sqrt(np.sum((y - y.mean()) ** 2) / targets)  # there Q <= sum (y - mean)^2 / tau^2 = q
    wanted = weighted(y, s, low)[1] > targets
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        above = weighted(y, s, middle)[1] > targets
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    return np.where(wanted, high, 0.0)


def prediction_interval(y: Values, s: Values, level: float) -> tuple[float, float]:
    """Give the interval that holds the true value of a further rig with probability ``level``.

    Given tau, that value is normal about m with the variance tau^2 + 1 / sum w_i; the interval holds the middle of the
    mixture over the confidence distribution of tau (after Nagashima, Noma and Furukawa 2019). The interval with the
    estimated tau alone (Higgins, Thompson and Spiegelhalter 2009) holds the value in only 86 % where tau is half of the
    standard errors.
    """
    from scipy.optimize import brentq
    from scipy.stats import chi2, norm

    share = (np.arange(QUANTILES) + 0.5) / QUANTILES
    tau = spreads(y, s, chi2.isf(share, len(y) - 1))
    m, _, precision = weighted(y, s, tau)
    deviation = np.sqrt(tau**2 + 1.0 / precision)
    ends = float((m - 10.0 * deviation).min()), float((m + 10.0 * deviation).max())

    def beyond(x: float, probability: float) -> float:
        return float(norm.cdf((x - m) / deviation).mean()) - probability

    low, high = (brentq(beyond, *ends, args=(p,)) for p in (0.5 - 0.5 * level, 0.5 + 0.5 * level))
    return float(low), float(high)
