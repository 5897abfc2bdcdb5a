"""Faults of a stream, put into a record after it was flown: the rig flew on, what came in of it is what changes.

* ``loss``: 5 % of the samples lost,
* ``stuck``: an encoder stuck for 4 s,
* ``stop``: nothing for 5 s,
* ``jitter``: samples that arrive with a jitter of 20 ms, 5 % lost,
* ``all``: all of them in one flight; ``faulty``: the same on an unchanged rig, stuck and stopped once a minute.
"""

import math

import numpy as np

from heli_identifier.live import Clock, ClockSettings, Timed, tick

STREAMS = ("loss", "stuck", "stop", "jitter", "all")
"""Faults that come with a change."""

FAULTY = "faulty"

RATE = 100
"""Samples in a second."""

LOST, STUCK, STOPPED = 0.05, 4.0, 5.0
"""Share of the samples that are lost [1], and the times of a stuck encoder and of a stop [s]."""

JITTER, DELAY, MAXIMUM_AGE = 0.02, 0.05, 0.2
"""Standard deviation of the time that a sample travels [s]; delay and maximum age of the units' link to a rig [s]."""


def broken(kind: str, rows: np.ndarray, start: float, rng: np.random.Generator) -> list[float]:
    """Put the fault of a stream into ``rows``.

    Parameters
    ----------
    kind : str
    rows : ndarray, shape (N, 5)
        Voltages [V] and angles [rad] every 10 ms; what the twin is shown afterwards.
    start : float
        Of the change [s]; a fault comes 20 s before it, or 5 or 40 s after it.
    rng : numpy.random.Generator

    Returns
    -------
    list
        1 for the samples that come in, else 0.
    """
    fresh = [1.0] * len(rows)
    if kind in ("stuck", "all"):
        _stand(rows, start + rng.choice([-20.0, 5.0, 40.0]), int(rng.integers(2, 5)))
    if kind == FAULTY:
        for minute in range(len(rows) // (60 * RATE)):
            _stand(rows, 60.0 * minute + rng.uniform(15.0, 35.0), int(rng.integers(2, 5)))
    if kind in ("loss", "jitter", "all", FAULTY):
        for k in np.flatnonzero(rng.random(len(rows)) < LOST):
            fresh[k] = 0.0 if k > 0 else 1.0
    if kind in ("stop", "all"):
        _silence(fresh, start + rng.choice([-20.0, 5.0, 40.0]))
    if kind == FAULTY:
        for minute in range(len(rows) // (60 * RATE)):
            _silence(fresh, 60.0 * minute + rng.uniform(40.0, 54.0))
    if kind in ("jitter", "all", FAULTY):
        return _late(rows, fresh, rng)
    for k in range(1, len(rows)):
        if not fresh[k]:
            rows[k] = rows[k - 1]
    return fresh


def _stand(rows: np.ndarray, time: float, column: int) -> None:
    """Let the encoder of a ``column`` stand still from ``time`` [s] on."""
    at = round(RATE * time)
    rows[at : at + round(RATE * STUCK), column] = rows[at - 1, column]


def _silence(fresh: list[float], time: float) -> None:
    at = round(RATE * time)
    count = round(RATE * STOPPED)
    fresh[at : at + count] = [0.0] * count


def _late(rows: np.ndarray, fresh: list[float], rng: np.random.Generator) -> list[float]:
    """Let the samples that are ``fresh`` travel for a random time, and put into ``rows`` what the units' link shows."""
    travelled = np.maximum(0.0, JITTER * (1.0 + rng.standard_normal(len(rows))))
    travelled[0] = 0.0
    arrivals: list[list[Timed]] = [[] for _ in rows]
    for k in range(len(rows)):
        at = k + math.ceil(RATE * travelled[k] - 1e-9)
        if fresh[k] and at < len(rows):
            arrivals[at].append(Timed(k / RATE, k, tuple(rows[k].tolist())))
    clock, settings, shown = Clock(), ClockSettings(DELAY, MAXIMUM_AGE, 1.0 / RATE), []
    for k in range(len(rows)):
        clock, seen = tick(clock, k / RATE, tuple(arrivals[k]), settings)
        shown.append(1.0 if seen.fresh else 0.0)
        rows[k] = rows[0] if seen.latest is None else seen.latest.signals
    return shown
