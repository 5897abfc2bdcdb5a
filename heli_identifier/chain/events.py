"""Events: passages of a log in which something outside the plant acts; what is left out around them, and slips.

A push by a hand is found in the innovations of a fit (:mod:`heli_identifier.tracing.pushes`). A slip of an encoder is
found here: a step from one sample to the next that lies outside the range of the rates before and after it, by more
than resolution and acceleration allow.

Source of the local cubics: Savitzky and Golay 1964.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.signal import savgol_filter

from heli_identifier.records import ANGLES, Array, Event, Log

SETTLING = 2.0
"""Start of a log [s] that its filter needs to settle, left out: five times the correlation time of the air."""

MARGIN = 0.3
"""Time [s] that is left out on either side of an event, whose edges are known to .2 s; it is also the length of the
local cubics of a slip."""

RATE = 100.0
"""Rate [Hz] that faster logs are reduced to in the search for slips."""

RATE_WINDOW, NOISE_QUANTILE, NOISE_FACTOR = 0.1, 0.995, 3.0
"""Time [s] before and after a sample over which its rate is a median of differences; a slip is this many times larger
than this quantile of what differences exceed their neighbours' range by."""


def find_slips(logs: Sequence[Log]) -> tuple[Event, ...]:
    """Find the slips of the encoders in logs of one rig, log by log, axis by axis, in order of time."""
    records = [_reduce_log(log) for log in logs]
    return tuple(
        Event(log.name, axis, at, at, log.start + at, log.start + at, "slip", size)
        for log, slips in zip(logs, _find_slips(records), strict=True)
        for axis, own in zip(ANGLES, slips, strict=True)
        for at, size in own
    )


def mark_events(logs: Sequence[Log], events: Sequence[Event]) -> tuple[Log, ...]:
    """Give logs with those of the events that are theirs, beside those that they have, in order of time."""
    found = list[Log]()
    for log in logs:
        own = [event for event in events if event.log == log.name]
        found.append(replace(log, events=tuple(sorted((*log.events, *own), key=lambda event: event.start))))
    return tuple(found)


def passages(events: Sequence[Event]) -> list[tuple[float, float]]:
    """Give what is left out around the events of a log: start and end [s] since its first sample."""
    return [(event.start - MARGIN, event.end + MARGIN) for event in events]


def undo_slips(logs: Sequence[Log], events: Sequence[Event]) -> tuple[tuple[Log, ...], tuple[str, ...]]:
    """Shift back what follows the slips of an encoder; give the logs, and a sentence for each slip."""
    found, notes = list[Log](), list[str]()
    for log in logs:
        angles = log.angles.copy()
        own = [event for event in events if event.kind == "slip" and event.log == log.name]
        for event in own:
            angles[round(event.start * log.rate_hz) :, ANGLES.index(event.axis)] -= event.size
            notes.append(
                f"{log.name}: the reading of its {event.axis} slips by {1e3 * event.size:.3g} mrad at "
                f"{event.start_in_file:.2f} s, and what follows was shifted back; fasten the encoder's coupling"
            )
        found.append(replace(log, angles=angles) if own else log)
    return tuple(found), tuple(notes)


def is_counted(time: Array, events: Sequence[Event], settled: bool = False) -> NDArray[np.bool_]:
    """Whether instants [s] of a log count: outside of its events and of what the filter needs to settle behind them.

    So much does the start of a log not count either, but as long as the motors need where the filter is ``settled``.
    """
    counts = time > (MARGIN if settled else SETTLING)
    for start, end in passages(events):
        counts &= (time < start) | (time > end + SETTLING)
    return counts


def event_notes(logs: Sequence[Log], events: Sequence[Event]) -> tuple[str, ...]:
    """Say what was left out of each log and how much of it is used, one sentence a log."""
    notes = []
    for log in logs:
        own = sorted((event for event in events if event.log == log.name), key=lambda event: event.start)
        if own:
            said = ", ".join(f"{e.axis} {e.start_in_file:.1f} to {e.end_in_file:.1f} s" for e in own)
            used = float(is_counted(log.time, own).sum() * log.step)
            rest = f"{used:.1f} of {log.duration:.1f} s are used" if used else "nothing remains of it"
            rest += ", so little that the log may not be of the rig of the others" if 2.0 * used < log.duration else ""
            notes.append(
                f"{log.name}: something other than the plant acted on it ({said}); {rest} (--keep-events keeps them)"
            )
    return tuple(notes)


def _reduce_log(log: Log) -> Log:
    """Log at about :data:`RATE`: samples at the start of each step."""
    factor = max(1, int(log.rate_hz / RATE + 0.5))
    voltages, angles = log.voltages[::factor], log.angles[::factor]
    return replace(log, rate_hz=log.rate_hz / factor, voltages=voltages, angles=angles, references={})


def local_cubic(values: Array, step: float, window: float, order: int = 0, ends: str = "interp") -> Array:
    """Give the derivative of ``order`` of a signal (N, ...) by local cubics over ``window`` [s].

    Its ``ends`` are those of the first and last cubic; where nobody reads them "nearest" saves the time for these.
    """
    length = min(_window_length(step, window), (len(values) - 1) // 2 * 2 + 1)
    return np.asarray(savgol_filter(values, length, 3, order, step, axis=0, mode=ends))


def _window_length(step: float, window: float) -> int:
    """Count the samples of a local cubic, an odd number."""
    return max(int(window / step) | 1, 5)


def _find_slips(records: Sequence[Log]) -> list[list[list[tuple[float, float]]]]:
    """Instants [s] and sizes [rad] of the slips, per record and axis."""
    excesses = [_beyond_neighbours(record) for record in records]
    noise = NOISE_FACTOR * np.quantile(np.concatenate([abs(e) for e in excesses]), NOISE_QUANTILE, axis=0)
    curvatures = [
        abs(local_cubic(r.angles, r.step, MARGIN, 2)).max(axis=0)
        for r in records
        if r.samples > 2 * _window_length(r.step, MARGIN)
    ]
    largest = np.max(curvatures, axis=0) if curvatures else np.inf
    return [[[((int(i) + 1) * record.step, float(e[i])) for i in np.flatnonzero(abs(e) > allowed)]
             for e, allowed in zip(excess.T, noise + largest * record.step * RATE_WINDOW, strict=True)]
            for record, excess in zip(records, excesses, strict=True)]  # fmt: skip


def _beyond_neighbours(record: Log) -> Array:
    """Differences of successive angles [rad] less the nearest of what lies between the rates before and after."""
    width, difference = int(RATE_WINDOW / record.step) | 1, np.diff(record.angles, axis=0)
    excess = np.zeros_like(difference)
    if len(difference) > 2 * width:
        rate, by = median_filter(difference, (width, 1)), width // 2 + 1  # to the medians' centres on either side
        before, behind = rate[width - by : len(rate) - width - by], rate[width + by : len(rate) - width + by]
        own = difference[width:-width]
        excess[width:-width] = own - own.clip(np.minimum(before, behind), np.maximum(before, behind))
    return excess
