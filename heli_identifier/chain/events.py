"""Events: passages of a log in which something other than the plant acts, and the samples to leave out around them.

A push by a hand is found in the innovations of a fit (:mod:`heli_identifier.tracing.pushes`). A slip of an encoder is
found here: a change from one sample to the next that lies outside the range of the rates before and after it, by more
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
"""Time [s] at the start of a log in which its filter settles, left out: five correlation times of the air."""

MARGIN = 0.3
"""Time [s] to leave out on either side of an event, whose edges are known to .2 s; also the length of the local cubics
in the search for slips."""

RATE = 100.0
"""Rate [Hz] to which faster logs are reduced in the search for slips."""

SURE = 3.0
"""Evidence [nats] from which rows are lost, odds of 20 to 1; less is a slip where the logs lack no other rows."""

RATE_WINDOW, NOISE_QUANTILE, NOISE_FACTOR = 0.1, 0.995, 3.0
"""Time [s] before and after a sample over which its rate is a median of differences. A slip exceeds the range of its
neighbours by this factor times this quantile of all such excesses."""


def find_slips(logs: Sequence[Log]) -> tuple[Event, ...]:
    """Find the slips of the encoders in logs of one rig, and the gaps where a log lacks rows, in order of time.

    In a gap all axes jump, each by its rate.
    """
    factors = [max(1, int(log.rate_hz / RATE + 0.5)) for log in logs]
    reduced = [(log.angles[::factor], 1.0 / (log.rate_hz / factor)) for log, factor in zip(logs, factors, strict=True)]
    rates, excesses = zip(*(_excess_over_neighbours(angles, step) for angles, step in reduced), strict=True)
    noise = NOISE_FACTOR * np.quantile(np.concatenate([abs(e) for e in excesses]), NOISE_QUANTILE, axis=0)
    curvatures = [
        abs(local_cubic(angles, step, MARGIN, 2)).max(axis=0)
        for angles, step in reduced
        if len(angles) > 2 * _window_length(step, MARGIN)
    ]
    largest = np.max(curvatures, axis=0) if curvatures else np.inf
    jumps = list[tuple[Event, float]]()
    for log, (_, step), rate, excess in zip(logs, reduced, rates, excesses, strict=True):
        allowed = noise + largest * step * RATE_WINDOW
        for column, axis in enumerate(ANGLES):
            for index in np.flatnonzero(abs(excess[:, column]) > allowed[column]):
                at = (int(index) + 1) * step
                in_file, size = log.start + at, float(excess[index, column])
                slip = Event(log.name, axis, at, at, in_file, in_file, "slip", size)
                jumps.append((slip, _evidence_of_lost_rows(excess[index], rate[index], noise, column)))
    lost = -SURE if any(nats > SURE for _, nats in jumps) else SURE  # where some rows are lost, others are
    return tuple(replace(jump, kind="gap") if nats > lost else jump for jump, nats in jumps)


def _evidence_of_lost_rows(excess: Array, rate: Array, noise: Array, column: int) -> float:
    """Return by how much [nats] lost rows explain the other axes better: they jump by as many samples of their rate."""
    samples = excess[column] / rate[column] if rate[column] else 0.0
    if samples < 0.5:  # against the motion
        return -np.inf
    sigma = noise / (3.0 * NOISE_FACTOR)  # the quantile of a Gaussian lies at three deviations, nearly
    nats = (excess**2 - (excess - samples * rate) ** 2) / (2.0 * sigma**2)
    return float(np.delete(nats, column).sum())


def mark_events(logs: Sequence[Log], events: Sequence[Event]) -> tuple[Log, ...]:
    """Add events to the logs that they belong to, in order of time."""
    marked = list[Log]()
    for log in logs:
        of_log = [*log.events, *(event for event in events if event.log == log.name)]
        marked.append(replace(log, events=tuple(sorted(of_log, key=lambda event: event.start))))
    return tuple(marked)


def passages_left_out(events: Sequence[Event]) -> list[tuple[float, float]]:
    """Return the passages to leave out around the events of a log: start and end [s] since its first sample."""
    return [(event.start - MARGIN, event.end + MARGIN) for event in events]


def undo_slips(logs: Sequence[Log], events: Sequence[Event]) -> tuple[tuple[Log, ...], tuple[str, ...]]:
    """Shift back the readings after each slip of an encoder; return the logs, and a sentence for each slip and log."""
    corrected, notes = list[Log](), list[str]()
    for log in logs:
        angles = log.angles.copy()
        slips = [event for event in events if event.kind == "slip" and event.log == log.name]
        for event in slips:
            angles[round(event.start * log.rate_hz) :, ANGLES.index(event.axis)] -= event.size
            notes.append(
                f"{log.name}: the reading of its {event.axis} slips by {1e3 * event.size:.3g} mrad at "
                f"{event.start_in_file:.2f} s, and what follows was shifted back; fasten the encoder's coupling, if no "
                "row of the log is missing there"
            )
        if gaps := [event.start_in_file for event in events if event.kind == "gap" and event.log == log.name]:
            notes.append(
                f"{log.name}: at {min(gaps):.2f} s all axes jump as far as they move in some samples, so the log lacks "
                f"rows there{' and elsewhere' * (len({*gaps}) > 1)}; log the time with every row"
            )
        corrected.append(replace(log, angles=angles) if slips else log)
    return tuple(corrected), tuple(notes)


def is_counted(time: Array, events: Sequence[Event], settled: bool = False) -> NDArray[np.bool_]:
    """Whether instants [s] of a log count: neither within an event nor while the filter settles after it.

    The start of a log does not count either: while the filter settles, or the motors only if the filter is ``settled``.
    """
    counts = time > (MARGIN if settled else SETTLING)
    for start, end in passages_left_out(events):
        counts &= (time < start) | (time > end + SETTLING)
    return counts


def describe_events(logs: Sequence[Log], events: Sequence[Event]) -> tuple[str, ...]:
    """Say which passages of each log were left out and how much of it is used, one sentence per log.

    Slips have sentences of their own, by `undo_slips`.
    """
    notes = []
    for log in logs:
        of_log = sorted((event for event in events if event.log == log.name), key=lambda event: event.start)
        if forces := [event for event in of_log if event.kind == "force"]:
            listed = ", ".join(f"{e.axis} {e.start_in_file:.1f} to {e.end_in_file:.1f} s" for e in forces)
            used = float(is_counted(log.time, of_log).sum() * log.step)
            rest = f"{used:.1f} of {log.duration:.1f} s are used" if used else "nothing remains of it"
            rest += ", so little that it may be a log of another rig" if 2.0 * used < log.duration else ""
            notes.append(
                f"{log.name}: something other than the plant acted on it ({listed}); {rest} "
                "(`heli diagnose --keep-events` keeps them)"
            )
    return tuple(notes)


def local_cubic(values: Array, step: float, window: float, order: int = 0, ends: str = "interp") -> Array:
    """Return the derivative of ``order`` of a signal (N, ...) by local cubics over ``window`` [s].

    By default the ``ends`` are those of the first and last cubic; "nearest" is faster and enough if nobody reads them.
    """
    length = min(_window_length(step, window), (len(values) - 1) // 2 * 2 + 1)
    return np.asarray(savgol_filter(values, length, 3, order, step, axis=0, mode=ends))


def smooth_motion(angles: Array, step: float, window: float) -> Array:
    """Return angles (N, a) [rad] and their rates [rad/s] by local cubics over ``window`` [s], shape (N, 2a)."""
    return np.hstack([local_cubic(angles, step, window, order) for order in (0, 1)])


def _window_length(step: float, window: float) -> int:
    """Count the samples of a local cubic, an odd number."""
    return max(int(window / step) | 1, 5)


def _excess_over_neighbours(angles: Array, step: float) -> tuple[Array, Array]:
    """Return the rate around each change of the angles, and by how much it lies outside the range of rates [rad]."""
    width, change = int(RATE_WINDOW / step) | 1, np.diff(angles, axis=0)
    near, excess = np.zeros((2, *change.shape))
    if len(change) > 2 * width:
        rate, shift = median_filter(change, (width, 1)), width // 2 + 1  # shift to the centre of a neighbouring median
        before, after = rate[width - shift : len(rate) - width - shift], rate[width + shift : len(rate) - width + shift]
        inner = change[width:-width]
        excess[width:-width] = inner - inner.clip(np.minimum(before, after), np.maximum(before, after))
        near[width:-width] = 0.5 * (before + after)
    return near, excess
