"""Whitening of the innovations: one autoregressive model per axis, by Burg's method, common to all records.

Process noise and encoder noise make the innovations correlated in time. Without whitening, t-scores would show effects
in a clean record far too often. Source: Ljung, System Identification, 2nd ed., section 7.2.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.prediction.autoregression import burg
from heli_plant.compiled import compiled

BLOCK = 1024
"""Values that the filter works on at a time: 16 kB of input and output."""

ORDER = 25
"""Order of the autoregression: one second at the reduced rate of 25 Hz."""


@dataclass(frozen=True, eq=False)
class Whitener:
    """Per axis the prediction-error filter 1 - a_1 z^-1 - ... and the standard deviation of what it leaves.

    Attributes
    ----------
    filters : NDArray, shape (3, p + 1)
    scales : NDArray, shape (3,)
        Standard deviation of the whitened innovations [rad/s^2].
    """

    filters: NDArray[np.float64]
    scales: NDArray[np.float64]

    @property
    def order(self) -> int:
        """Order p of the autoregressions."""
        return self.filters.shape[1] - 1

    def apply(self, residuals: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
        """Whiten and scale, drop each record's first p samples, and stack.

        Parameters
        ----------
        residuals : sequence of NDArray, shape (n_i, 3) or (n_i, 3, m)

        Returns
        -------
        NDArray, shape (3 sum(n_i - p),) or (3 sum(n_i - p), m)
            Axis by axis, record by record.
        """
        return np.concatenate([self.apply_axis(axis, [r[:, axis] for r in residuals]) for axis in range(3)])

    def apply_axis(self, axis: int, signals: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
        """Whiten signals of one axis, each (n_i,) or (n_i, m)."""
        return whitened(signals, self.filters[axis], float(self.scales[axis]))


def _filter(signal, taps, columns, out):
    """Fill ``out`` with what ``taps`` (p + 1,) make of ``signal``, rows of ``columns`` values each, laid end to end.

    The innermost loop runs along memory, over a piece that the processor's first cache holds.
    """
    order = len(taps) - 1
    for first in range(0, len(out), BLOCK):
        piece = out[first : first + BLOCK]
        piece[:] = 0.0
        for j in range(order + 1):
            begin = first + (order - j) * columns
            tap, moved = taps[j], signal[begin : begin + len(piece)]
            for i in range(len(piece)):
                piece[i] += tap * moved[i]


def whitened(signals: Sequence[NDArray[np.float64]], taps: NDArray[np.float64], scale: float) -> NDArray[np.float64]:
    """Signals (n_i, ...) through a prediction-error filter, scaled, without their first samples, stacked."""
    order, inner = len(taps) - 1, signals[0].shape[1:]
    columns, run, out = int(np.prod(inner)), compiled(_filter), []
    for signal in signals:
        out.append(np.empty((len(signal) - order, *inner)))
        run(np.ascontiguousarray(signal).reshape(-1), taps / scale, columns, out[-1].reshape(-1))
    return np.concatenate(out)


def fit_axis(
    signals: Sequence[NDArray[np.float64]], order: int = ORDER, contraction: float = 1.0
) -> tuple[NDArray[np.float64], float]:
    """Prediction-error filter (order + 1,) and residual scale of one axis, from records (n_i,).

    The filter is that of the records joined end to end. Without joints their constant offsets would drive it towards a
    unit root, behind which a constant torque can no longer be estimated; the mean of all is taken off for the same
    reason. The scale is that of the whitened records, without the joints: there the filter meets a jump from one offset
    to the next, which a better model can make larger, so that its likelihood would fall.

    Parameters
    ----------
    contraction : float
        Factor on the radius of the autoregression's poles. Below 1 no step, drift or period can hide behind a pole on
        the unit circle, at the price of a residual that is not quite white (bandwidth expansion, Tohkura 1978).
    """
    mean = np.concatenate(list(signals)).mean()
    centred = [signal - mean for signal in signals]
    taps = burg(np.concatenate(centred), order)
    if contraction != 1.0:
        taps = taps * contraction ** np.arange(order + 1)
    return taps, float(np.sqrt(np.mean(whitened(centred, taps, 1.0) ** 2)))


def fit_whitener(residuals: Sequence[NDArray[np.float64]], order: int = ORDER) -> Whitener:
    """Fit the three autoregressions to records of innovations, each (n_i, 3) [rad/s^2]."""
    fitted = [fit_axis([r[:, axis] for r in residuals], order) for axis in range(3)]
    return Whitener(np.array([taps for taps, _ in fitted]), np.array([scale for _, scale in fitted]))
