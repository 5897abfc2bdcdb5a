"""Margins of one loop from its frequency response.

Between the frequencies the loop gain l(w) is a cubic spline (not-a-knot), real and imaginary part alike. With negative
feedback the gain margin is 1/abs(l) where l crosses the negative real axis, the phase margin arg(-l) where abs(l)
crosses 1. This is what :func:`control.stability_margins` does with frequency data, with the splines of all plants made
at once and each crossing sought on its own piece alone.
"""

from cmath import phase
from collections.abc import Callable
from dataclasses import dataclass
from math import degrees
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

Responses = NDArray[Any]
"""Frequency responses, complex."""


@dataclass(frozen=True)
class Margins:
    """Margins of one loop.

    Attributes
    ----------
    gain : float
        Factor by which the loop gain may grow; infinite if any.
    gain_down : float
        Factor by which it may shrink, below 1; 0 if any.
    phase : float
        [deg].
    sensitivity : float
        Peak of abs(1/(1 + l)).
    crossover : float
        Highest frequency [rad/s] of unit gain.
    """

    gain: float
    gain_down: float
    phase: float
    sensitivity: float
    crossover: float


def loop_margins(gains: Responses, omega: NDArray[np.float64]) -> list[Margins]:
    """Give the margins of loops.

    Parameters
    ----------
    gains : NDArray, shape (M, N), complex
        Loop gain of M plants, of negative feedback.
    omega : NDArray, shape (N,)
        Frequencies [rad/s], growing.
    """
    pieces = CubicSpline(omega, gains, axis=1).c
    return [_margins(gain, omega, pieces[:, :, number]) for number, gain in enumerate(gains)]


def _margins(gain: Responses, omega: NDArray[np.float64], pieces: Responses) -> Margins:
    """Margins of one loop with the coefficients (4, N - 1) of its spline, highest power first."""
    negative = [k for k in _changes(gain.imag) if gain[k].real <= 0.0]
    turned = [_crossing(pieces[:, k], omega[k], omega[k + 1], _imaginary)[1] for k in negative]
    unit = [_crossing(pieces[:, k], omega[k], omega[k + 1], _excess) for k in _changes(np.abs(gain) - 1.0)]
    factors = [1.0 / abs(value) for value in turned]
    return Margins(
        min((factor for factor in factors if factor > 1.0), default=np.inf),
        max((factor for factor in factors if factor < 1.0), default=0.0),
        min((abs(degrees(phase(-value))) for _, value in unit), default=np.inf),
        float(np.max(1.0 / np.abs(1.0 + gain))),
        max((at for at, _ in unit), default=np.nan),
    )


def _imaginary(value: complex) -> float:
    return value.imag


def _excess(value: complex) -> float:
    return abs(value) - 1.0


def _changes(values: NDArray[np.float64]) -> NDArray[np.intp]:
    """Pieces at whose ends ``values`` has other signs."""
    return np.flatnonzero(np.diff(np.sign(values)))


def _crossing(piece: Responses, low: float, high: float, figure: Callable[[complex], float]) -> tuple[float, complex]:
    """Frequency [rad/s] and loop gain where a figure of the gain is zero on a piece of its spline."""
    a, b, c, d = piece.tolist()

    def gain(w: float) -> complex:
        x = w - low
        return ((a * x + b) * x + c) * x + d

    at = float(brentq(lambda w: figure(gain(w)), low, high))
    return at, gain(at)
