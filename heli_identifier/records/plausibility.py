"""Whether a signal can be in the unit that it was read in: no rig reaches what a mistaken unit makes of it.

Pitch and elevation are bounded by the mechanics to less than a quarter of a turn either way; an encoder that counts
within one turn may add a turn. Travel may turn for ever, but not fast: at two turns a second the end of an arm of .65 m
would see ten times the acceleration of gravity. Bench motors run on a few volts, at most some tens.
"""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import LogError
from heli_identifier.records.header import Column
from heli_identifier.records.units import VOLTAGES, known_units

POSSIBLE_ANGLE = 2.5 * np.pi
"""Largest pitch or elevation either way [rad]: a quarter of a turn, and a turn of the encoder."""

SUSPICIOUS_ANGLE = np.pi
"""Pitch or elevation either way [rad] that is accepted, but whose unit is asked for."""

POSSIBLE_SPEED = 4.0 * np.pi
"""Largest travel within a second [rad/s]."""

POSSIBLE_VOLTAGE = 100.0
"""Largest voltage either way [V]."""


def check_plausible(column: Column, values: NDArray[np.float64], rate_hz: float, file: str) -> None:
    """Refuse a signal that no rig can reach, since its unit is mistaken.

    Parameters
    ----------
    column : Column
        Signal and the unit that it was read in.
    values : NDArray, shape (N,)
        Its samples in SI, unwrapped.
    rate_hz : float
        Sampling rate [Hz].
    file : str
        Name of the file for messages.

    Raises
    ------
    LogError
        Signal, value, bound, the unit that was taken and those that there are.
    """
    if column.signal in VOLTAGES:
        most, bound, unit, reaches = float(np.abs(values).max()), POSSIBLE_VOLTAGE, "V", "reaches"
    elif column.signal == "travel":
        second = max(1, round(rate_hz))
        most = float(np.abs(values[second:] - values[:-second]).max(initial=0.0))
        bound, unit, reaches = POSSIBLE_SPEED, "rad", "turns within a second by"
    else:
        most, bound, unit, reaches = float(np.abs(values).max()), POSSIBLE_ANGLE, "rad", "reaches"
    if most > bound:
        others = " or ".join(f'"{name}"' for name in known_units(column.signal) if name != column.unit)
        raise LogError(
            f"{file}: {column.signal} {reaches} {most:.4g} {unit} when read in {column.unit}, which no rig can (at "
            f"most {bound:.3g} {unit}); state its unit, {column.signal} = {others}, under [log.units] in the rig's "
            "configuration."
        )
