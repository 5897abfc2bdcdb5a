"""Tests of the residual: whether it is white, and whether it still follows the inputs."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

LAGS = 50
"""Lags of the portmanteau test: two seconds at the reduced rate."""


def ljung_box_p(white: NDArray[np.float64]) -> float:
    """P value of the portmanteau test over :data:`LAGS` lags of residuals (n,); source: Ljung and Box 1978, eq. (1.2).

    n (n + 2) sum_k r_k^2 / (n - k), r_k the autocorrelation at lag k, is chi-squared where they are white.
    """
    n, centred = len(white), white - white.mean()
    lags = np.arange(1, LAGS + 1)
    r = np.array([centred[k:] @ centred[:-k] for k in lags]) / (centred @ centred)
    return float(chdtrc(LAGS, n * (n + 2) * (r**2 / (n - lags)).sum()))


def input_correlation(white: Sequence[NDArray[np.float64]], inputs: Sequence[NDArray[np.float64]]) -> float:
    """Largest absolute cross-correlation of white residuals with past inputs, over its 95 % bound.

    Parameters
    ----------
    white, inputs : sequence of NDArray, shape (n_i,)
        Per record, on the same reduced grid.

    Returns
    -------
    float
        Above 1 some lag is significant by itself; over 50 lags a clean record reaches about 1.6.
    """
    total, count = np.zeros(LAGS), 0
    for z, u in zip(white, inputs, strict=True):
        centred = (u - u.mean()) / max(float(u.std()), 1e-12)
        total += [float(z[lag:] @ centred[: len(z) - lag]) for lag in range(LAGS)]
        count += len(z)
    scale = float(np.sqrt(np.mean(np.concatenate(list(white)) ** 2)))
    return float(np.abs(total / np.sqrt(count)).max() / (1.96 * scale))
