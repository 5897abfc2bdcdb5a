"""What a person does with a joystick: steps and holds at times of his own, some of them ramps.

A reference is held for a random time and then moved to a new value, within a tenth of a second or two (the stick is
thrown) or, in three cases of ten, by a ramp of a second or more. About every third value is the middle again.
"""

import numpy as np
from numpy.typing import NDArray

_RAMPS, _BACK = 0.3, 0.35
"""Shares of moves that are ramps and of values that are the middle."""

_THROW, _RAMP = (0.05, 0.25), (1.0, 3.0)
"""How long a move takes [s]."""

_PITCH, _PITCH_HOLDS = (0.06, 0.3), (1.2, 6.0)
_ELEVATION, _ELEVATION_HOLDS = (0.02, 0.12), (2.5, 8.0)
_TRAVEL, _TRAVEL_HOLDS = (0.6, 2.4), (4.0, 9.0)
"""Sizes [rad] and holds [s]."""


def _moves(
    t: NDArray[np.float64], sizes: tuple[float, float], holds: tuple[float, float], rng: np.random.Generator
) -> NDArray[np.float64]:
    times, values = [0.0], [0.0]
    while times[-1] < t[-1]:
        begin = times[-1] + rng.uniform(*holds)
        end = begin + rng.uniform(*(_RAMP if rng.random() < _RAMPS else _THROW))
        size = 0.0 if rng.random() < _BACK else rng.uniform(*sizes)
        # A person corrects what he did: two moves of three go to the other side.
        side = -np.sign(values[-1]) if values[-1] != 0.0 and rng.random() < 2 / 3 else rng.choice([-1.0, 1.0])
        times += [begin, end]
        values += [values[-1], float(side * size)]
    return np.interp(t, times, values)


def joystick(
    samples: int, rate: float, liveliness: float, travel: bool, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Make the references of one flight, about the hover.

    Parameters
    ----------
    samples
        Number n of control samples.
    rate
        Control rate [Hz].
    liveliness
        Size of the moves, 1 for the usual [1].
    travel
        Whether the pilot moves the travel in place of the pitch.
    rng
        Source of the person.

    Returns
    -------
    ndarray, shape (n, 3)
        References of pitch, elevation and travel [rad].
    """
    t = np.arange(samples) / rate
    pitch = 0.0 * t if travel else liveliness * _moves(t, _PITCH, _PITCH_HOLDS, rng)
    elevation = liveliness * _moves(t, _ELEVATION, _ELEVATION_HOLDS, rng)
    along = liveliness * _moves(t, _TRAVEL, _TRAVEL_HOLDS, rng) if travel else 0.0 * t
    return np.column_stack([pitch, elevation, along])
