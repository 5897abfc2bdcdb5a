"""Check that a rig can reach the values of a log; if not, a unit is wrong or an encoder failed.

Mechanics limit pitch and elevation to less than a quarter of a turn either way; an encoder that counts from 0 to a turn
may add a turn, which is taken off. Travel is unlimited but slow: at two turns a second the end of an arm of .65 m would
see ten times the acceleration of gravity. Bench motors run on a few volts, at most some tens.

A logger that wraps its angles into one turn makes jumps of whole turns, and one that loses count jumps by a turn. No
such jump is larger than two turns, and none returns within one sample, unless the angle lies at the edge at which it
is wrapped: there the encoder's last count makes it jump to and fro. Any other single value that lies far away is a
mark of a missing value (999), a lost sample written as 0, or a bit error.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from heli_identifier.errors import HELI_TOML, LogError

from .columns import Array, Column
from .configuration import HIGHEST_VOLTAGE
from .units import ANGLES, COMBINED, SI_UNIT, VOLTAGES, known_units

POSSIBLE_ANGLE = np.pi  # of pitch or elevation either way [rad], twice what mechanics allow
POSSIBLE_SPEED = 4.0 * np.pi  # largest travel within a second [rad/s]
STANDING_STILL = "a clamped axis or a dead encoder tells nothing about itself"

LEAST_MOTION = 4e-3
"""Least range of an angle that moves [rad]: an encoder of 4096 counts at rest flickers over two counts of 1.5e-3 rad,
and a rig that hovers quietly moves further."""

FEWEST_CHANGES = 20  # of a signal whose steps can be found: values set by hand change less often
MOST_STEPS = 50  # in a usual change: 16384 counts a turn at 1 rad/s and 50 Hz; fine digits mostly give more

DIGITS = 0.25
"""Largest last digit of a text, in encoder steps, with which the steps are found: two decimals of a degree with 8192
counts. With larger digits, interpolated readings look like those of an encoder with two or three times the counts."""

EXCURSION = 0.3  # deviation of a single sample [rad] that no rig makes: at 50 Hz it needs 15 rad/s each way

_TURN = 2.0 * np.pi
_MOST_TURNS = 2.0  # an encoder that wraps and loses count at the same time
_JUMP = np.pi  # from one sample to the next this is 157 rad/s at the lowest rate; the rig reaches a few rad/s
_OFF_TURN = 0.5  # largest motion of the rig during a jump [rad]: 25 rad/s at the lowest rate


def unwrap_angle(angle: Array, column: Column, file: str, row: int) -> tuple[Array, list[str]]:
    """Unwrap an angle [rad], shape (N,), and return it with notes; ``row`` is that of its first sample in the file.

    A turn is taken off a pitch or an elevation around 2 pi. A LogError names the row in which the angle jumps by more
    than half a turn, but not by one or two whole turns, or leaves for one sample: the encoder or the logger failed, or
    the unit is wrong.
    """
    signal = column.signal
    with np.errstate(over="ignore", invalid="ignore"):  # by values like 1e308, which are refused below
        jumps = np.diff(angle)
        size, off_turn = np.abs(jumps), np.abs(jumps - _TURN * np.round(jumps / _TURN))
        # A sample far from both of its neighbours, which lie close to each other, is an excursion. The median keeps
        # every sample of an angle that is only noise from being one.
        deviation = np.minimum(size[:-1], size[1:])
        outlier = (jumps[:-1] * jumps[1:] < 0.0) & (deviation > max(EXCURSION, 10.0 * float(np.median(size))))
        outlier &= np.abs(angle[2:] - angle[:-2]) < 0.5 * deviation
        if any(angle.min() >= lower - 1e-6 and angle.max() <= lower + _TURN + 1e-6 for lower in (-np.pi, 0.0)):
            outlier &= np.abs(deviation - _TURN) > _OFF_TURN  # a turn to and fro at the edge is the last count
    large = size > _JUMP
    wrong = large & ~((off_turn <= _OFF_TURN) & (size <= _MOST_TURNS * _TURN + _OFF_TURN))
    wrong[:-1] |= outlier
    if wrong.any():
        at = int(wrong.argmax()) + 1
        raise LogError(
            f"{file}, row {row + at}: {signal} is {angle[at]:.6g} rad and was {angle[at - 1]:.4g} rad in the row "
            f"before when read in {column.unit}, which no rig can; correct the value (is it a mark of a missing one?), "
            f"state its unit under [log.units] of {HELI_TOML}, or cut the log there with --from and --to."
        )
    notes = list[str]()
    if count := int(large.sum()):
        angle = np.unwrap(angle)
        notes.append(f"{signal} unwrapped at {count} jump{'' if count == 1 else 's'} of whole turns")
    turn = whole_turns(angle)
    if signal != "travel" and turn == _TURN:  # more turns are another unit
        notes.append(f"{signal} lies around {np.median(angle):.3g} rad and is read a turn lower: is its unit right?")
        angle = angle - turn
    return angle, notes


def whole_turns(angle: Array) -> float:
    """Return the whole turns [rad] by which an angle, shape (N,), lies off zero."""
    return _TURN * float(np.round(np.median(angle / _TURN)))


def why_still(angle: Array) -> str | None:
    """Say why an angle, shape (N,) [rad], shows no motion; None if it moves."""
    extent = float(np.ptp(angle))
    if extent == 0.0:
        return "never changes"
    return f"moves by {extent:.2g} rad in all, no more than an encoder flickers" if extent < LEAST_MOTION else None


def quantisation_step(values: Array) -> float:
    """Find the step of the coarsest grid on which the values of a signal, shape (N,), lie; 0 if there is none.

    An encoder, a converter and the digits of a text make a grid. A filter removes it; a mean of n readings has one that
    is n times as fine. The usual change is taken for a whole number of steps, since values may never repeat.
    """
    changes = np.diff(values, prepend=values[0])
    sizes = np.abs(changes)[np.abs(changes) > 1e-9 * float(np.ptp(values))]
    if len(sizes) < FEWEST_CHANGES:
        return 0.0
    usual = float(np.median(sizes))
    sizes = sizes[sizes < 2.0 * usual]
    for parts in range(1, MOST_STEPS + 1):
        counts = np.round(sizes * (parts / usual))
        step = float(sizes @ counts / (counts @ counts))
        if np.abs(sizes / step - counts).mean() < DIGITS / 3.0:  # mean error of a difference of two rounded numbers
            step = float(np.polyfit(np.cumsum(np.round(changes / step)), values, 1)[0])
            if step > 0.0 and is_on_grid(values, step):
                return step
    return 0.0


def is_on_grid(values: Array, step: float) -> bool:
    """Whether the values of a signal, shape (N,), lie on a grid but for digits; repeated values count once."""
    changed = values[np.diff(values, prepend=np.nan) != 0.0]
    return bool(np.abs(np.exp(2j * np.pi / step * changed).mean()) > np.sinc(DIGITS))  # mean for uniform errors


def check_plausible(columns: Sequence[Column], values: Mapping[str, Array], rate_hz: float, file: str) -> None:
    """Raise a LogError that names the signals, shape (N,) each in SI and unwrapped, that no rig can reach."""
    largest = {signal: float(np.abs(samples).max()) for signal, samples in values.items()}
    largest |= dict.fromkeys(COMBINED, max(largest[signal] for signal in VOLTAGES))  # already converted to voltages
    second = max(1, round(rate_hz))  # the travel is unlimited, but slow
    largest["travel"] = float(np.abs(values["travel"][second:] - values["travel"][:-second]).max(initial=0.0))
    problems, remedies, clip = list[str](), list[str](), ""
    for column in columns:
        signal, unit = column.signal, SI_UNIT[column.signal]
        bound = HIGHEST_VOLTAGE if unit == "V" else POSSIBLE_SPEED if signal == "travel" else POSSIBLE_ANGLE
        if largest[signal] > bound:
            reach = f"{largest[signal]:.4g} {unit}{' within a second' if signal == 'travel' else ''}"
            problems.append(f"{signal} reaches {reach} when read in {column.unit} (at most {bound:.3g})")
            others = [f'"{name}"' for name in known_units(signal) if name != column.unit]
            remedies.append(f"{signal} = {' or '.join(others)}")
            if unit == "V":
                clip = "; if these are commands before the amplifiers' limit, set clip = true under [log] there"
    if problems:
        raise LogError(
            f"{file}: {', '.join(problems)}, which no rig can; state the unit, {', '.join(remedies)}, under "
            f"[log.units] of {HELI_TOML}{clip}."
        )


def describe_values(voltages: Array, angles: Array, limit: float) -> tuple[str, ...]:
    """Describe unusual voltages, shape (N, 2), at the amplifiers' ``limit`` [V], and angles [rad], shape (N, 3)."""
    notes = []
    for name, size in zip(VOLTAGES, np.abs(voltages).T, strict=True):
        beyond = int((size > limit * (1.0 + 1e-9)).sum())
        if beyond:
            samples = f"in {beyond} of {len(size)} samples (up to {size.max():.3g} V)"
            notes.append(f"{name} exceeds ±{limit:g} V {samples} and is kept unchanged")
    for name, values in zip(ANGLES, angles.T, strict=True):
        if why := why_still(values):
            notes.append(f"{name} {why}: {STANDING_STILL}")
    return tuple(notes)
