"""What goes wrong between a rig and its log: the rig is clean, the log is not.

    damaged = DAMAGES["pitch late"](time, voltages, angles)

A damage takes the time (n,) [s], the voltages (n, 2) [V] and the angles (n, 3) [rad] that a rig really had, and gives
voltages and angles as a log has them. Sizes are those that laboratories meet: a sample or three of delay, a filter that
somebody left in the block diagram, an encoder of another make. ``DAMAGES`` has one entry a line; the channel that it
strikes is its first word, so that a test can ask for it. :func:`interrupted` is what goes wrong between a rig and a
program that hears it while it flies.
"""

from collections.abc import Callable, Iterator, Mapping
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Damage = Callable[[Array, Array, Array], tuple[Array, Array]]
Own = Callable[[Array, Array], Array]
"""Damage of one signal: of time [s] and signal."""

FRONT, REAR, PITCH, ELEVATION, TRAVEL = range(5)
VOLTAGES, ANGLES = (FRONT, REAR), (PITCH, ELEVATION, TRAVEL)
DEGREE, COUNT = np.pi / 180.0, 2.0 * np.pi / 4096.0


def on(channels: int | tuple[int, ...], own: Own) -> Damage:
    """Damage some channels, each by itself."""

    def damage(time: Array, voltages: Array, angles: Array) -> tuple[Array, Array]:
        struck = np.vstack([voltages.T, angles.T])
        for k in np.atleast_1d(channels):
            struck[k] = own(time, struck[k])
        return np.ascontiguousarray(struck[:2].T), np.ascontiguousarray(struck[2:].T)

    return damage


def late(delay: float) -> Own:
    """What was true ``delay`` [s] before; between samples on the straight line."""
    return lambda time, x: np.interp(time - delay, time, x)


def low_pass(corner_hz: float) -> Own:
    """First-order filter of a data logger."""

    def own(time: Array, x: Array) -> Array:
        share = 1.0 - np.exp(-2.0 * np.pi * corner_hz * (time[1] - time[0]))
        return np.array(list(accumulate(x, lambda y, new: y + share * (new - y))))

    return own


def drift(rate: float) -> Own:
    """Zero that wanders at ``rate`` [rad/s]."""
    return lambda time, x: x + rate * (time - time[0])


def counted(counts: int) -> Own:
    """Encoder of so many counts a turn."""
    quantum = 2.0 * np.pi / counts
    return lambda _, x: np.floor(x / quantum + 0.5) * quantum


def play(gap: float) -> Own:
    """Backlash of width ``gap`` [rad] between axis and encoder."""
    return lambda _, x: np.array(list(accumulate(x, lambda at, new: min(max(at, new - 0.5 * gap), new + 0.5 * gap))))


def scaled(factor: float) -> Own:
    """Factor that is wrong."""
    return lambda _, x: factor * x


def slipped(size: float) -> Own:
    """Encoder whose coupling slips once, at 40 % of the log, by ``size`` [rad]."""
    return lambda time, x: x + size * (time - time[0] > 0.4 * (time[-1] - time[0]))


def jittered(std: float) -> Own:
    """Read at instants that err by ``std`` [s], and written as if they were uniform."""
    return lambda time, x: np.interp(time + np.random.default_rng(0).normal(0.0, std, len(time)), time, x)


def stretched(time: Array, voltages: Array, angles: Array) -> tuple[Array, Array]:
    """A clock that is fast by 2 %: the same instants are written as others; both held at the ends."""
    at = time[0] + (time - time[0]) * 0.98
    held = np.minimum(np.searchsorted(time, at, "right") - 1, len(time) - 1)
    return voltages[held], np.column_stack([np.interp(at, time, x) for x in angles.T])


def clipped(time: Array, voltages: Array, angles: Array) -> tuple[Array, Array]:
    """An amplifier that gives 80 % of what it is asked for at most."""
    limit = 0.8 * np.abs(voltages).max()
    return np.clip(voltages, -limit, limit), angles


DAMAGES: Mapping[str, Damage] = {
    "none": lambda time, voltages, angles: (voltages, angles),
    "pitch drifts 1 degree in 90 s": on(PITCH, drift(DEGREE / 90.0)),
    "elevation drifts 1 degree in 90 s": on(ELEVATION, drift(DEGREE / 90.0)),
    "voltages late by a sample": on(VOLTAGES, lambda _, x: np.append(x[0], x[:-1])),
    "voltages behind a filter of 5 Hz": on(VOLTAGES, low_pass(5.0)),
    "elevation late by 30 ms": on(ELEVATION, late(0.030)),
    "pitch late by 20 ms": on(PITCH, late(0.020)),
    "elevation behind a filter of 5 Hz": on(ELEVATION, low_pass(5.0)),
    "pitch of 2048 counts": on(PITCH, counted(2048)),
    "pitch of 256 counts": on(PITCH, counted(256)),
    "elevation of 256 counts": on(ELEVATION, counted(256)),
    "elevation with a play of 2 counts": on(ELEVATION, play(2.0 * COUNT)),
    "pitch with a play of 6 counts": on(PITCH, play(6.0 * COUNT)),
    "voltages cut to .1 V": on(VOLTAGES, lambda _, x: np.trunc(x / 0.1 + 1e-9) * 0.1),
    "voltages clipped at 80 %": clipped,
    "v_front times 1.1": on(FRONT, scaled(1.1)),
    "v_front with the other sign": on(FRONT, scaled(-1.0)),
    "pitch with the other sign": on(PITCH, scaled(-1.0)),
    "pitch twice as large": on(PITCH, scaled(2.0)),
    "pitch slips by 12 counts": on(PITCH, slipped(12.0 * COUNT)),
    "elevation slips by 24 counts": on(ELEVATION, slipped(24.0 * COUNT)),
    "clock jitters by 2 ms": on(ANGLES, jittered(0.002)),
    "clock fast by 2 %": stretched,
    "travel a copy of the elevation": lambda _, voltages, angles: (voltages, np.take(angles, [0, 1, 1], axis=1)),
    "pitch in radians under [deg]": on(PITCH, scaled(DEGREE)),
    "angles in radians under [deg]": on(ANGLES, scaled(DEGREE)),
    "elevation in degrees under [rad]": on(ELEVATION, scaled(1.0 / DEGREE)),
    "travel folded at half a turn": on(TRAVEL, lambda _, x: (x + np.pi) % (2.0 * np.pi) - np.pi),
}


STREAMS = ("loss", "stuck", "stop", "jitter", "all")
"""Faults of a stream: 5 % of the samples lost, an encoder stuck for 4 s, nothing for 5 s, samples that arrive with a
jitter and 5 % lost, all of them."""

FAULTY = "faulty"
"""All faults all along, stuck and stopped once a minute."""

LATE = ("jitter", "all", FAULTY)
"""Faults in which the samples that are left travel for a random time as well, which is not done here."""

RATE, LOST, STUCK, STOPPED = 100.0, 0.05, 4.0, 5.0
"""Samples in a second, share of them that are lost [1], and the times of a stuck encoder and of a stop [s]."""


def interrupted(kind: str, rows: Array, start: float, rng: np.random.Generator) -> Array:
    """Put the fault of a stream into ``rows`` (N, 5), two voltages and three angles that are heard; give 1 for what
    comes in, else 0; in its place stands the sample before.

    An encoder is stuck, and the stream stops, 20 s before a change of the rig at ``start`` [s], or 5 or 40 s after it.
    """
    fresh = np.ones(len(rows))

    def times(kinds: tuple[str, str], after: float, before: float) -> Iterator[float]:
        if kind in kinds:
            yield start + float(rng.choice([-20.0, 5.0, 40.0]))
        for minute in range(int(len(rows) / RATE / 60.0) if kind == FAULTY else 0):
            yield 60.0 * minute + rng.uniform(after, before)

    for time in times(("stuck", "all"), 15.0, 35.0):
        at, column = round(RATE * time), int(rng.integers(2, 5))
        rows[at : at + round(RATE * STUCK), column] = rows[at - 1, column]
    if kind in ("loss", *LATE):
        fresh[1:][rng.random(len(rows))[1:] < LOST] = 0.0
    for time in times(("stop", "all"), 40.0, 54.0):
        fresh[round(RATE * time) :][: round(RATE * STOPPED)] = 0.0
    for k in () if kind in LATE else np.flatnonzero(fresh == 0.0):
        rows[k] = rows[k - 1]
    return fresh
