"""Whether a rig can reach the values that a log states; if not, a unit is mistaken or an encoder failed.

Mechanics bound pitch and elevation to less than a quarter of a turn either way; an encoder that counts within one turn
may add a turn. Travel is unbounded but slow: at two turns a second the end of an arm of .65 m would see ten times the
acceleration of gravity. Bench motors run on a few volts, at most some tens.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import HELI_TOML, LogError
from heli_identifier.records.columns import Column
from heli_identifier.records.units import ANGLES, SI_UNIT, VOLTAGES, known_units

POSSIBLE_ANGLE = 2.5 * np.pi
"""Largest pitch or elevation either way [rad]: a quarter of a turn, and a turn of the encoder."""

SUSPICIOUS_ANGLE = np.pi
"""Pitch or elevation either way [rad] above which a note asks for the unit."""

POSSIBLE_SPEED = 4.0 * np.pi
"""Largest travel within a second [rad/s]."""

POSSIBLE_VOLTAGE = 100.0
"""Largest voltage either way [V]."""

STANDING_STILL = "a clamped axis or a dead encoder tells nothing about itself"

_TURN = 2.0 * np.pi
_JUMP = np.pi  # from one sample to the next this is 157 rad/s at the lowest rate; the rig reaches a few rad/s
_OFF_TURN = 0.5  # largest own motion of the rig during a jump [rad]: 25 rad/s at the lowest rate


def unwrapped(
    angle: NDArray[np.float64], signal: str, place: Callable[[int], str]
) -> tuple[NDArray[np.float64], str | None]:
    """Remove jumps of whole turns, which a logger makes that folds its angles into one turn.

    Parameters
    ----------
    angle : NDArray, shape (N,)
        Samples [rad].
    signal : str
        Name of the angle for messages.
    place : Callable[[int], str]
        Gives file and row of a sample, for messages.

    Returns
    -------
    angle : NDArray, shape (N,)
        Without the jumps [rad].
    note : str or None
        What was done, if anything.

    Raises
    ------
    LogError
        If the angle jumps by more than half a turn, but not by whole turns: the encoder or the logger failed.
    """
    jumps = np.diff(angle)
    large = np.abs(jumps) > _JUMP
    if not large.any():
        return angle, None
    off_turn = np.abs(jumps - _TURN * np.round(jumps / _TURN))
    broken = large & (off_turn > _OFF_TURN)
    if broken.any():
        at = int(broken.argmax())
        raise LogError(
            f"{place(at + 1)}: {signal} jumps by {jumps[at]:.3g} rad from the row before, which no rig can; correct "
            "the value or cut the log there with --from and --to."
        )
    count = int(large.sum())
    return np.unwrap(angle), f"{signal} unwrapped at {count} jump{'' if count == 1 else 's'} of whole turns"


def check_plausible(
    columns: Sequence[Column], values: Mapping[str, NDArray[np.float64]], rate_hz: float, file: str
) -> None:
    """Refuse signals that no rig can reach.

    Parameters
    ----------
    columns : Sequence[Column]
        Voltages and angles, and the units in which they were read.
    values : Mapping[str, NDArray]
        Samples of each signal in SI, unwrapped, shape (N,).
    rate_hz : float
        Sampling rate [Hz].
    file : str
        Name of the file for messages.

    Raises
    ------
    LogError
        Names every such signal, its value, the bound, the unit in which it was read and the other units.
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
            f"of {HELI_TOML}."
        )


def _extent(signal: str, values: NDArray[np.float64], rate_hz: float) -> tuple[str, float, float]:
    """Give what a signal does, how far it goes and how far it can go."""
    if signal == "travel":
        second = max(1, round(rate_hz))
        turned = np.abs(values[second:] - values[:-second]).max(initial=0.0)
        return "turns within a second by", float(turned), POSSIBLE_SPEED
    bound = POSSIBLE_VOLTAGE if signal in VOLTAGES else POSSIBLE_ANGLE
    return "reaches", float(np.abs(values).max()), bound


def value_notes(voltages: NDArray[np.float64], angles: NDArray[np.float64], limit: float) -> tuple[str, ...]:
    """Describe values that are accepted but unusual.

    Parameters
    ----------
    voltages : NDArray, shape (N, 2)
        Front and rear [V].
    angles : NDArray, shape (N, 3)
        Pitch, elevation, travel [rad].
    limit : float
        Voltage limit of the rig [V].
    """
    notes = []
    for name, values in zip(VOLTAGES, voltages.T, strict=True):
        beyond = np.abs(values) > limit * (1.0 + 1e-9)
        if beyond.any():
            notes.append(
                f"{name} exceeds +-{limit:g} V in {beyond.sum()} of {len(values)} samples (up to "
                f"{np.abs(values).max():.3g} V) and is kept unchanged"
            )
    for name, values in zip(ANGLES, angles.T, strict=True):
        if np.ptp(values) == 0.0:
            notes.append(f"{name} never changes: {STANDING_STILL}")
        elif name != "travel" and np.abs(values).max() > SUSPICIOUS_ANGLE:
            most = np.abs(values).max()
            notes.append(f"{name} reaches {most:.3g} rad, more than half a turn: are these degrees?")
    return tuple(notes)
