"""What there is to see of a twin that follows, at one instant: for the terminal and for the page alike."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from heli_identifier.following import MODES, Follower, FollowOutput, Sample
from heli_identifier.live.listening import Status
from heli_identifier.results import unit_text
from heli_plant.effects import AXES
from heli_plant.parameter_table import BY_FIELD

EVENTS_SHOWN = 50
"""Events that a view holds, the latest ones."""


class Due(NamedTuple):
    """An instant [s] for which predictions fell due.

    Measured angles (None where no sample came in), and what the following twin and the one left alone predicted 1 s
    before; root-mean-square errors of both over the window before (None where there is none yet) [rad]. Three values
    each: pitch, elevation, travel.
    """

    time: float
    measured: tuple[float, ...] | None
    predicted: tuple[float, ...]
    predicted_alone: tuple[float, ...]
    error: tuple[float | None, ...]
    error_alone: tuple[float | None, ...]


def due_at(sample: Sample, output: FollowOutput) -> Due:
    """Return what fell due at a sample."""
    now = output.corrector
    return Due(
        round(now.time, 9),
        (sample.pitch, sample.elevation, sample.travel) if sample.fresh > 0.5 else None,
        now.predicted,
        now.predicted_alone,
        tuple(error or None for error in now.error),
        tuple(error or None for error in now.error_alone),
    )


class AxisView(NamedTuple):
    """One axis, at the last instant for which predictions fell due; see :class:`Due`.

    ``declared`` is the error that the parameters declare [rad]. None where there is none yet.
    """

    axis: str
    measured: float | None
    predicted: float | None
    predicted_alone: float | None
    error: float | None
    error_alone: float | None
    declared: float | None


class ValueView(NamedTuple):
    """One value of the twin: at the start, in use, and what the on-line identifier says with half its 95 % band."""

    name: str
    unit: str
    start: float
    used: float
    estimate: float | None
    band: float | None


class View(NamedTuple):
    """Everything at one instant.

    ``alarm`` is the largest sum of the detector over its threshold [1]; ``events`` are the latest ones; ``notice`` is
    about the controller; ``due`` is what
    fell due since the view before.
    """

    time: float
    mode: str
    fresh: bool
    alarm: float
    suspect: str
    axes: tuple[AxisView, ...]
    values: tuple[ValueView, ...]
    number_of_events: int
    events: tuple[Mapping[str, Any], ...]
    notice: str
    stream: Status | None
    due: tuple[Due, ...]

    def document(self) -> dict[str, Any]:
        """Give the view as a document for JSON."""
        return {
            **self._asdict(),
            "axes": [axis._asdict() for axis in self.axes],
            "values": [value._asdict() for value in self.values],
            "stream": stream_document(self.stream),
            "due": [due._asdict() for due in self.due],
        }


def stream_document(status: Status | None) -> dict[str, Any] | None:
    """Give the state of a stream as a document for JSON."""
    return None if status is None else {**status._asdict(), "counts": status.counts._asdict()}


def view_of(
    sample: Sample,
    output: FollowOutput,
    last: Due | None,
    due: Sequence[Due],
    plan: Follower,
    declared: Mapping[str, float],
    events: Sequence[Mapping[str, Any]],
    notice: str,
    stream: Status | None,
) -> View:
    """Return the view after a sample; ``last`` fell due last, ``due`` since the view before."""
    now = output.corrector
    axes = tuple(_axis(i, axis, last, declared.get(axis)) for i, axis in enumerate(AXES))
    bank = plan.corrector.changes
    suspect = bank[now.suspect].name if now.suspect >= 0 else ""
    shown = tuple(events[-EVENTS_SHOWN:])
    return View(
        now.time,
        MODES[now.mode],
        sample.fresh > 0.5,
        now.alarm,
        suspect,
        axes,
        _values(output, plan),
        len(events),
        shown,
        notice,
        stream,
        tuple(due),
    )


def _axis(i: int, axis: str, last: Due | None, declared: float | None) -> AxisView:
    if last is None:
        return AxisView(axis, None, None, None, None, None, declared)
    measured = None if last.measured is None else last.measured[i]
    return AxisView(
        axis, measured, last.predicted[i], last.predicted_alone[i], last.error[i], last.error_alone[i], declared
    )


def _values(output: FollowOutput, plan: Follower) -> tuple[ValueView, ...]:
    """Return the identified parameters, and whatever else the twin has changed."""
    corrector, start = plan.corrector, plan.corrector.settings.parameters
    used = dict(zip(corrector.changeable, output.corrector.values, strict=True))
    first = dict(zip(corrector.changeable, corrector.first_values, strict=True))
    rows = []
    estimates = zip(output.estimates.parameters._fields, output.estimates.parameters, strict=True)
    for (field, estimate), error in zip(estimates, output.estimates.standard_errors, strict=True):
        row = BY_FIELD[field]
        at_start = getattr(start, field)
        known = output.estimates.adapting
        rows.append(
            ValueView(
                row.name,
                unit_text(row.unit) or "1",
                at_start,
                used.pop(row.name, at_start),
                estimate if known else None,
                1.96 * error if known else None,
            )
        )
    units = {row.name: unit_text(row.unit) for row in BY_FIELD.values()}
    rows += [
        ValueView(name, units.get(name) or "1", first[name], value, None, None)
        for name, value in used.items()
        if value != first[name]
    ]
    return tuple(rows)
