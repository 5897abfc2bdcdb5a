"""Whether a signal can be in the unit that it was read in: no rig reaches what a mistaken unit makes of it.

Pitch and elevation are bounded by the mechanics to less than a quarter of a turn either way; an encoder that counts
within one turn may add a turn. Travel may turn for ever, but not fast: at two turns a second the end of an arm of .65 m
would see ten times the acceleration of gravity. Bench motors run on a few volts, at most some tens.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import LogError
from heli_identifier.records.header import Column
from heli_identifier.records.units import SI_UNIT, VOLTAGES, known_units

POSSIBLE_ANGLE = 2.5 * np.pi
"""Largest pitch or elevation either way [rad]: a quarter of a turn, and a turn of the encoder."""

SUSPICIOUS_ANGLE = np.pi
"""Pitch or elevation either way [rad] that is accepted, but whose unit is asked for."""

POSSIBLE_SPEED = 4.0 * np.pi
"""Largest travel within a second [rad/s]."""

POSSIBLE_VOLTAGE = 100.0
"""Largest voltage either way [V]."""


def check_plausible(
    columns: Sequence[Column], values: Mapping[str, NDArray[np.float64]], rate_hz: float, file: str
) -> None:
    """Refuse signals that no rig can reach, since their units are mistaken.

    Parameters
    ----------
    columns : Sequence[Column]
        Voltages and angles, and the units that they were read in.
    values : Mapping[str, NDArray]
        Samples of each signal in SI, unwrapped, shape (N,).
    rate_hz : float
        Sampling rate [Hz].
    file : str
        Name of the file for messages.

    Raises
    ------
    LogError
        Every such signal with its value, the bound, the unit that was taken and those that there are.
    """
    beyond, remedies = [], []
    for column in columns:
        what, most, bound = _extent(column.signal, values[column.signal], rate_hz)
        if most > bound:
            unit = SI_UNIT[column.signal]
            beyond.append(f"{column.signal} {what} {most:.4g} {unit} when read in {column.unit} (at most {bound:.3g})")
            others = " or ".join(f'"{name}"' for name in known_units(column.signal) if name != column.unit)
            remedies.append(f"{column.signal} = {others}")
    if beyond:
        raise LogError(
            f"{file}: {', '.join(beyond)}, which no rig can; state the unit, {', '.join(remedies)}, under [log.units] "
            "in the rig's configuration."
        )


def _extent(signal: str, values: NDArray[np.float64], rate_hz: float) -> tuple[str, float, float]:
    """Give what a signal does, how far it goes and how far it can."""
    if signal == "travel":
        second = max(1, round(rate_hz))
        turned = np.abs(values[second:] - values[:-second]).max(initial=0.0)
        return "turns within a second by", float(turned), POSSIBLE_SPEED
    bound = POSSIBLE_VOLTAGE if signal in VOLTAGES else POSSIBLE_ANGLE
    return "reaches", float(np.abs(values).max()), bound
