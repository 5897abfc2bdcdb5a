"""Events of a rig's logs: pushes by a hand, landings, contact with a table or a stop, slips of an encoder.

A force from outside is an acceleration that no term of the axis's equation explains: an event is where the residual
exceeds :data:`THRESHOLD` times its scale at like motion (:mod:`heli_identifier.tracing.events.equation`). It lasts
from where the residual passes half of its peak to where it falls below half again; a rectangle that passed through a
symmetric kernel has its edges there.

A slip is a step of the angle from one sample to the next: the difference of two samples lies outside the range that is
spanned by the rates before and after it, by more than the encoder's resolution and the acceleration allow.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, median_filter

from heli_identifier.records import Log
from heli_identifier.tracing.events.equation import EVALUATED_STEP, WINDOW, residuals
from heli_identifier.tracing.events.event import Event, Kind
from heli_identifier.tracing.prediction.problem import reduce_log
from heli_identifier.tracing.prediction.start import smoothed
from heli_plant.effects import AXES

THRESHOLD = 7.5
"""Residual over its scale from which a passage is an event.

It lies between the largest value in 20 hours of generated logs without a touch (6.3; with effects and without, in open
and in closed loop) and the smallest among 95 pushes by a hand (8.9). `benchmarks/events.py` measures both anew.
"""

RATE_WINDOW = 0.1
"""Time [s] before and after a sample over which its rate is taken, as a median of differences."""

NOISE_QUANTILE, NOISE_FACTOR = 0.995, 3.0
"""A slip is this many times larger than the quantile of what differences exceed their neighbours' range by."""


def find_events(logs: Sequence[Log], voltage_limit: float) -> tuple[Event, ...]:
    """Find the events in logs of one rig.

    Parameters
    ----------
    logs : sequence of Log
        All of one rig: they share coefficients and scale. Their order and their use as training or held-out logs play
        no role.
    voltage_limit : float
        Saturation of both voltages [V].

    Returns
    -------
    tuple of Event
        Log by log, axis by axis, in order of time.
    """
    records = [reduce_log(log) for log in logs]
    steps = _steps(records)
    limited = [replace(record, voltages=record.voltages.clip(-voltage_limit, voltage_limit)) for record in records]
    events = []
    for log, slips, (time, r, standardised) in zip(logs, steps, residuals(limited), strict=True):
        for axis, name in enumerate(AXES):
            own = [_event(log, name, at, at, "slip", size) for at, size in slips[axis]]
            for start, end, size in _passages(time, r[:, axis], standardised[:, axis]):
                if not any(start - WINDOW <= slip.start <= end + WINDOW for slip in own if slip.kind == "slip"):
                    own.append(_event(log, name, start, end, "force", size))
            events += sorted(own, key=lambda event: event.start)
    return tuple(events)


def _event(log: Log, axis: str, start: float, end: float, kind: Kind, size: float) -> Event:
    return Event(log.name, axis, start, end, log.start + start, log.start + end, kind, size)


def _passages(
    time: NDArray[np.float64], r: NDArray[np.float64], standardised: NDArray[np.float64]
) -> list[tuple[float, float, float]]:
    """Start and end [s] and largest residual [rad/s^2] of the passages of one log and axis.

    Peaks closer than :data:`WINDOW` belong together.
    """
    if not len(time):
        return []
    reach = 2 * round(WINDOW / EVALUATED_STEP) + 1
    near = maximum_filter1d(abs(standardised), reach) > THRESHOLD
    inside = near & (abs(r) >= 0.5 * maximum_filter1d(abs(r), reach))
    found: list[tuple[float, float, float]] = []
    for i in np.flatnonzero(inside):
        t, size = float(time[i]), abs(float(r[i]))
        if found and t - found[-1][1] <= WINDOW:
            found[-1] = (found[-1][0], t, max(found[-1][2], size))
        else:
            found.append((t, t, size))
    return found


def _steps(records: Sequence[Log]) -> list[list[list[tuple[float, float]]]]:
    """Instants [s] and sizes [rad] of the slips, per record and axis."""
    excesses = [_beyond_neighbours(record) for record in records]
    moving = [record for record in records if record.samples > _width(record) * 4]
    if not moving:
        return [[[] for _ in AXES] for _ in records]
    noise = NOISE_FACTOR * np.quantile(np.concatenate([abs(e) for e in excesses]), NOISE_QUANTILE, axis=0)
    largest = np.max([abs(smoothed(record.angles, record.step, 2, WINDOW)).max(axis=0) for record in moving], axis=0)
    out = []
    for record, excess in zip(records, excesses, strict=True):
        allowed = noise + largest * record.step * RATE_WINDOW
        out.append(
            [
                [((int(i) + 1) * record.step, float(excess[i, axis])) for i in np.flatnonzero(beyond[:, axis])]
                for beyond in [abs(excess) > allowed]
                for axis in range(len(AXES))
            ]
        )
    return out


def _width(record: Log) -> int:
    """Count the samples, an odd number, of the median that a rate is taken by."""
    return max(int(RATE_WINDOW / record.step), 1) | 1


def _beyond_neighbours(record: Log) -> NDArray[np.float64]:
    """Differences of successive angles [rad] less the nearest of what lies between the rates before and after."""
    width = _width(record)
    difference = np.diff(record.angles, axis=0)
    excess = np.zeros_like(difference)
    if len(difference) > 2 * width:
        rate = median_filter(difference, (width, 1))
        offset = width // 2 + 1  # from a difference to the centres of the medians on either side
        inner = slice(width, len(difference) - width)
        before, behind = (rate[inner.start + by : inner.stop + by] for by in (-offset, offset))
        excess[inner] = difference[inner] - difference[inner].clip(
            np.minimum(before, behind), np.maximum(before, behind)
        )
    return excess
