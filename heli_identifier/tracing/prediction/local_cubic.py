"""Zero-phase smoothing and derivatives by a local cubic (Savitzky and Golay 1964).

Around each sample a cubic is fitted to the samples of a window, and its derivative in the middle is taken. At the ends
of a record, where no whole window lies around a sample, the cubic of the first and of the last window is taken instead.

`scipy.signal.savgol_filter` does the same to the bit; it is not used, since its package takes half a second to import.
"""

from functools import lru_cache
from math import factorial

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lstsq
from scipy.ndimage import convolve1d

DEGREE = 3


@lru_cache(maxsize=64)
def _weights(length: int, order: int, step: float) -> NDArray[np.float64]:
    """Weights (length,) of the samples of a window in the derivative at its middle, the last sample's first."""
    behind = np.arange(length // 2, -(length // 2) - 1, -1, dtype=float)
    powers = behind ** np.arange(DEGREE + 1.0)[:, None]
    wanted = np.zeros(DEGREE + 1)
    wanted[order] = factorial(order) / step**order
    limit = np.finfo(float).eps * length
    weights: NDArray[np.float64] = lstsq(powers, wanted, cond=limit)[0]
    weights.flags.writeable = False
    return weights


def _at_end(window: NDArray[np.float64], at: slice, order: int, step: float) -> NDArray[np.float64]:
    """Differentiate, at the samples ``at``, a window (length, ...) by the cubic through all of it."""
    samples = np.arange(len(window), dtype=float)
    cubic = np.polyfit(samples, window.reshape(len(window), -1), DEGREE)
    for _ in range(order):
        cubic = cubic[:-1] * np.arange(len(cubic) - 1, 0, -1)[:, None]
    values = np.zeros((len(samples[at]), cubic.shape[1]))
    for coefficients in cubic:
        values = values * samples[at, None] + coefficients
    return values.reshape(-1, *window.shape[1:]) / step**order


def local_cubic(values: NDArray[np.float64], length: int, order: int, step: float) -> NDArray[np.float64]:
    """Give the derivative of ``order`` 0 to 3 of ``values`` (N, ...) sampled every ``step`` [s].

    Parameters
    ----------
    values : NDArray, shape (N, ...)
        At least ``length`` samples.
    length : int
        Samples in a window, odd and above 3.
    order : int
    step : float
        [s].
    """
    half = length // 2
    smooth: NDArray[np.float64] = convolve1d(values, _weights(length, order, step), axis=0, mode="constant")
    smooth[:half] = _at_end(values[:length], slice(0, half), order, step)
    smooth[-half:] = _at_end(values[-length:], slice(length - half, length), order, step)
    return smooth
