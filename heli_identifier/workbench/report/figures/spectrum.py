"""Power spectral density of what a figure shows."""

import numpy as np
from matplotlib.mlab import psd
from numpy.typing import NDArray


def power_density(
    values: NDArray[np.float64], step: float, segment: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """One-sided power spectral density by averaged periodograms, under Hann windows (Welch 1967).

    Parameters
    ----------
    values : NDArray, shape (N,)
    step : float
        Sampling period [s].
    segment : int
        Samples of a segment; half of it overlaps the next. At most N are taken.

    Returns
    -------
    frequency : NDArray, shape (F,)
        [Hz].
    power : NDArray, shape (F,)
        Square of the unit of ``values`` per Hz.
    """
    # matplotlib's own rather than scipy's: a process that only draws need not load all of scipy.signal
    size = min(segment, len(values))
    power, frequency = psd(values, NFFT=size, Fs=1.0 / step, noverlap=size // 2, detrend="mean")
    return np.asarray(frequency), np.asarray(power)
