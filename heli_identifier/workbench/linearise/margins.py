"""Margins of one loop from its frequency response, by python-control."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

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


def loop_margins(gain: Responses, omega: NDArray[np.float64]) -> Margins:
    """Give the margins of a loop.

    Parameters
    ----------
    gain : NDArray, shape (N,), complex
        Loop gain, of negative feedback.
    omega : NDArray, shape (N,)
        Frequencies [rad/s], growing.
    """
    import control

    turned = np.degrees(np.unwrap(np.angle(gain)))
    found = control.stability_margins((np.abs(gain), turned, omega), returnall=True)
    factors, phases, _, _, crossings, _ = map(np.asarray, found)
    return Margins(
        float(min(factors[factors > 1.0], default=np.inf)),
        float(max(factors[factors < 1.0], default=0.0)),
        float(min(np.abs(phases), default=np.inf)),
        float(np.max(1.0 / np.abs(1.0 + gain))),
        float(max(crossings, default=np.nan)),
    )
