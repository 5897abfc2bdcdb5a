"""Logs without their events: the passages that are cut out, and the pieces that remain."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from heli_identifier.records import Log
from heli_identifier.tracing.events.equation import WINDOW
from heli_identifier.tracing.events.event import Event
from heli_identifier.tracing.events.finding import find_events
from heli_identifier.tracing.prediction.problem import MEMORY, SETTLING

MARGIN = WINDOW
"""Time [s] that is cut beside an event: the residual that finds it is blurred by half of the window, and its edges are
known to .2 s."""

LEFT_TO_FIT = 2.0
"""A piece holds this many times the memory of the whitener, beyond the observer's settling."""


@dataclass(frozen=True)
class WithoutEvents:
    """Logs of one rig without their events.

    Attributes
    ----------
    training, held_out : tuple of Log
        The logs and the pieces of logs that remain. A piece keeps its log's name and says from when on it lasts,
        unless it begins with the log; its ``start`` is its first sample's in the time of the file.
    events : tuple of Event
    notes : tuple of str
        What was cut and what was left out, one sentence each.
    left_out : tuple of Log
        Whole logs of which no piece remains.
    """

    training: tuple[Log, ...]
    held_out: tuple[Log, ...]
    events: tuple[Event, ...] = ()
    notes: tuple[str, ...] = ()
    left_out: tuple[Log, ...] = ()


def shortest_piece(bandwidth: float) -> float:
    """Length [s] that a piece needs for an observer of ``bandwidth`` [rad/s]: settling and memory of the whitener."""
    return SETTLING / bandwidth + LEFT_TO_FIT * MEMORY


def without_events(
    training: Sequence[Log], held_out: Sequence[Log], voltage_limit: float, bandwidth: float, keep: bool = False
) -> WithoutEvents:
    """Find the events in all logs of a rig and cut them out.

    Parameters
    ----------
    training, held_out : sequence of Log
    voltage_limit : float
        Saturation of both voltages [V].
    bandwidth : float
        Lowest filter frequency [rad/s] that the pieces are to serve.
    keep : bool
        List the events, and leave the logs whole.

    Returns
    -------
    WithoutEvents
        If nothing of the training logs or nothing of the held-out logs would remain, these are whole.
    """
    events = find_events((*training, *held_out), voltage_limit)
    if keep:
        return WithoutEvents(tuple(training), tuple(held_out), events)
    notes = []
    kept, left_out = [], []
    for logs, what in ((training, "training"), (held_out, "held-out")):
        pieces, nothing_left, said = [], [], []
        for log in logs:
            own = [event for event in events if event.log == log.name]
            left = cut(log, own, shortest_piece(bandwidth))
            pieces += left
            if not left:
                nothing_left.append(log)
            if own:
                said.append(_note(log, own, left))
        if not pieces and logs:
            said = [
                f"events leave no {what} log of {shortest_piece(bandwidth):.3g} s: the {what} logs are used as they are"
            ]
        notes += said
        kept.append(tuple(pieces) or tuple(logs))
        left_out += nothing_left if pieces else []
    return WithoutEvents(kept[0], kept[1], events, tuple(notes), tuple(left_out))


def cut(log: Log, events: Sequence[Event], shortest: float) -> list[Log]:
    """Give the pieces of a log outside of its events that last ``shortest`` [s] and in which every axis moves.

    A log without an event is given as it is.
    """
    if not events:
        return [log]
    free = np.ones(log.samples, dtype=bool)
    for event in events:
        first, last = (event.start - MARGIN) * log.rate_hz, (event.end + MARGIN) * log.rate_hz
        free[max(0, int(first)) : max(0, int(last) + 1)] = False
    edges = np.flatnonzero(np.diff(np.concatenate(([False], free, [False])).astype(np.int8)))
    pieces = []
    for begin, stop in edges.reshape(-1, 2):
        if (stop - begin) * log.step >= shortest and np.ptp(log.angles[begin:stop], axis=0).all():
            pieces.append(_piece(log, int(begin), int(stop)))
    return pieces


def events_beside(log: Log, events: Sequence[Event]) -> tuple[Event, ...]:
    """Give the events inside of a log or piece, and those that it was cut at."""
    reach = 2.0 * MARGIN
    return tuple(
        event
        for event in events
        if (log.name == event.log or log.name.startswith(f"{event.log} from "))
        and log.start - reach <= event.end_in_file
        and event.start_in_file <= log.start + log.duration + reach
    )


def _piece(log: Log, begin: int, stop: int) -> Log:
    start = log.start + begin * log.step
    return replace(
        log,
        name=log.name if begin == 0 else f"{log.name} from {start:.4g} s",
        voltages=log.voltages[begin:stop],
        angles=log.angles[begin:stop],
        extra={name: values[begin:stop] for name, values in log.extra.items()},
        references={axis: values[begin:stop] for axis, values in log.references.items()},
        start=start,
    )


def _note(log: Log, events: Sequence[Event], pieces: Sequence[Log]) -> str:
    """Say what was cut out of a log and how much of it is used."""
    cut_out = ", ".join(f"{e.axis} {e.start_in_file:.1f} to {e.end_in_file:.1f} s" for e in events)
    used = sum(piece.duration for piece in pieces)
    rest = f"{used:.1f} of {log.duration:.1f} s are used" if pieces else "what remains is too short and is left out"
    return f"{log.name}: something other than the plant acted on it ({cut_out}); {rest} (--keep-events keeps them)"
