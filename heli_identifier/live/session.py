"""One flight that a twin follows: its steps, and its files, which are written while it flies.

Every row of a journal is handed to the system at once: a command that is killed loses none. Once a second the system is
asked to put the rows on the disk, so that a loss of power costs a second.
"""

import os
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from statistics import fmean
from time import monotonic
from typing import Any, NamedTuple

from heli_identifier import following
from heli_identifier.errors import refuse
from heli_identifier.files import write_atomically
from heli_identifier.following import DIGITS, SAMPLE_TIME, CorrectorState, FollowPlan, FollowSettings, Sample, TwinEvent
from heli_identifier.live.listening import Listening, Status
from heli_identifier.live.sources import Player
from heli_identifier.online import Estimate
from heli_identifier.records import CONTRACT_HEADERS
from heli_identifier.results import PLANT, ParameterSet, document_text, plant_values, unit_text, write_whole_folder
from heli_plant.effects import AXES
from heli_plant.observer import FIELDS
from heli_plant.parameters import BY_FIELD, PARAMETERS

RECORDED, PREDICTIONS, EVENTS, IN_USE = "recorded.csv", "predictions.csv", "events.json", "following.json"
"""Files of a flight: its samples, predictions, events, and the parameters that the twin uses."""

DIAGNOSED = "diagnosis.json"
"""File of an earlier diagnosis."""

SYNC_INTERVAL, WRITE_INTERVAL, VIEW_INTERVAL = 1.0, 0.05, 0.2
"""Time between two requests to put rows on the disk, two writes to the journals, and two views [s]."""

_PAST = 300  # comparisons in a view: a minute of flight, five a second


class Journal:
    """A CSV file that is created with its header and only grows, by whole rows; an existing file is never replaced."""

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        self.path, self.rows, self._synced = path, 0, monotonic()
        self._file = path.open("xb", buffering=0)
        self._pending = [",".join(columns) + "\n"]
        self.flush()

    def add(self, row: Sequence[float]) -> None:
        """Add a row, which :meth:`flush` writes; a number that is read back is the same double."""
        self._pending.append(",".join(map(repr, row)) + "\n")
        self.rows += 1

    def flush(self) -> None:
        """Hand the added rows to the system; an OSError names the file, which then ends with a whole row."""
        data, written, begin = "".join(self._pending).encode(), 0, self._file.tell()
        self._pending.clear()
        try:
            while written < len(data):
                written += self._file.write(data[written:])
            if data and monotonic() - self._synced > SYNC_INTERVAL:
                self._synced = monotonic()
                os.fsync(self._file)
        except OSError as error:
            self._file.truncate(self._file.seek(begin + data.rfind(b"\n", 0, written) + 1))
            raise OSError(error.errno, error.strerror, str(self.path)) from error

    def close(self) -> None:
        """Write the remaining rows and close the file."""
        with self._file:
            self.flush()
            os.fsync(self._file)


class View(NamedTuple):
    """The state of a flight, as the terminal and the page show it.

    ``time`` [s], ``mode``; ``alarm``: the largest CUSUM over its threshold [1]; ``suspect``: the likeliest change;
    status of the ``stream``; ``events`` as in their file. ``past``: the last instants with a comparison: angles
    ``measured``, ``predicted`` 1 s before and by the twin left alone, and rms errors of both over the window, None
    before the first [rad]; ``declared``: the errors that the diagnosis expects [rad]. ``values``: of each parameter at
    the ``start`` and as ``used``, with the half-width of its 95 % interval (``band``), 0 if unknown; empty before the
    first step.
    """

    time: float = 0.0
    mode: str = "waiting"
    alarm: float = 0.0
    suspect: str = ""
    stream: Status = Status()
    events: Sequence[dict[str, Any]] = ()
    past: Sequence[dict[str, Any]] = ()
    declared: Sequence[float | None] = (None, None, None)
    values: Sequence[dict[str, Any]] = ()


Show = Callable[[View], None]


class Session:
    """A twin and the files of its flight, in a folder that must not hold an earlier recording.

    ``parameters`` are the plant's, as a diagnosis delivers them.
    """

    def __init__(self, folder: Path, parameters: ParameterSet) -> None:
        self.plant = parameters.plant()
        self.folder, self.provenance = folder, dict(parameters.provenance)
        declared = {axis: expected.prediction_1s_rad.value for axis, expected in parameters.expected.items()}
        self.declared = tuple(declared.get(axis) for axis in AXES)
        self.errors = {name: value.standard_error or 0.0 for name, value in parameters.values.items()}
        with write_whole_folder(folder):  # creates it
            for name in (RECORDED, PREDICTIONS, DIAGNOSED):
                reason = "is there already and is not replaced, it holds what was recorded before; name another folder."
                refuse(os.path.lexists(folder / name), f"{folder / name} {reason}")
        self.events: list[dict[str, Any]] = []  # as in their file
        self._write_events()
        angles = [f"{twin}{axis} [rad]" for twin in ("", "predicted.", "predicted_alone.") for axis in AXES]
        self.predictions = Journal(folder / PREDICTIONS, ["time [s]", *angles])
        self.recorded = Journal(folder / RECORDED, CONTRACT_HEADERS)
        self.twin: tuple[FollowPlan, CorrectorState] | None = None  # from the first instant on
        self._samples: list[Sample] = []  # that the twin takes as one
        self.past: deque[dict[str, Any]] = deque(maxlen=_PAST)
        self.last_time = 0.0  # of a sample [s]
        self._time = 0.0  # of the last step [s]

    @property
    def time(self) -> float:
        """Time of the last instant [s]."""
        return self._time or self.last_time

    def keep(self, time: float, signals: tuple[float, ...]) -> None:
        """Record a sample: its time [s], voltages [V] and angles [rad]."""
        self.last_time = round(time, DIGITS)
        self.recorded.add((self.last_time, *signals))

    def run(self, source: Listening | Player, stopped: Callable[[], bool], show: Show) -> None:
        """Follow the samples of a ``source`` until it ends or the flight has ``stopped``; show five views a second.

        The faults of the stream become an event at the end.
        """
        written = shown = monotonic()
        for sample in source.instants(self.keep, stopped):
            if sample is not None:
                self._step(sample, source.sample_time)
            now = monotonic()
            if sample is None or now - written > WRITE_INTERVAL:
                self.write()
                written = now
            if now - shown > VIEW_INTERVAL:
                shown = now
                show(self.view(source.status))
        self.write()
        status = source.status
        show(self.view(status))
        if status.faults:
            self.add_event(TwinEvent(self.time, "stream", why=status.faults))

    def _step(self, sample: Sample, sample_time: float) -> None:
        self._samples.append(sample)
        if len(self._samples) < (count := max(1, round(SAMPLE_TIME / sample_time))):
            return
        front, rear = (fmean(voltages) for voltages in list(zip(*self._samples, strict=True))[:2])
        sample, sample_time = self._samples[0]._replace(v_front=front, v_rear=rear), count * sample_time
        self._samples.clear()
        if self.twin is None:
            plan = FollowPlan(FollowSettings(sample_time=sample_time, parameters=self.plant))
            self.twin = plan, following.start_correcting(plan, sample)
            return
        plan, state = self.twin
        state, events = following.correct(state, sample, plan)
        self.twin = plan, state
        self._time = round(state.instants * sample_time, DIGITS)
        twins, window = state.predictions, plan.window
        if twins.compared:
            used, alone = twins.used, twins.alone
            self.past.append({
                "time": self.time, "measured": sample[2:5],
                "predicted": used.predicted, "predicted_alone": alone.predicted,
                "error": [error or None for error in used.rms(window)],
                "error_alone": [error or None for error in alone.rms(window)],
            })  # fmt: skip
            self.predictions.add((self.time, *sample[2:5], *used.predicted, *alone.predicted))
        for event in events:
            self.add_event(event)

    def add_event(self, event: TwinEvent) -> None:
        """Add an event to its file; after an adoption or a roll back write the parameters in use as well."""
        self.events.append(event._asdict())
        self._write_events()
        if event.what in ("adopted", "rolled back"):
            self.in_use().write(self.folder / IN_USE)

    def _write_events(self) -> None:
        write_atomically(self.folder / EVENTS, document_text(self.events))

    def write(self) -> None:
        """Hand the rows of both journals to the system."""
        self.recorded.flush()
        self.predictions.flush()

    def close(self) -> None:
        """Write the remaining rows and close the files."""
        self.recorded.close()
        self.predictions.close()

    def view(self, stream: Status) -> View:
        """Return the view of the flight."""
        view = View(stream=stream, events=tuple(self.events), declared=self.declared)
        if self.twin is None or self._time == 0.0:
            return view
        plan, now = self.twin
        return view._replace(
            time=self.time,
            mode=now.shown_mode,
            alarm=now.alarm,
            suspect=plan.changes[now.finding.change].name if now.finding.change >= 0 else "",
            past=tuple(self.past),
            values=_values(now, plan, self.errors),
        )

    def in_use(self) -> ParameterSet:
        """Return the parameters that the twin uses; adopted values have the standard error of their adoption."""
        plant, errors = self.plant, self.errors
        if self.twin is not None:
            state = self.twin[1]
            adopted = {BY_FIELD[field].name: error for field, error in zip(FIELDS, state.errors, strict=True) if error}
            plant, errors = state.twin, {**errors, **adopted}
        known = {
            row.field: Estimate(getattr(plant, row.field), errors[row.name], row.unit)
            for row in PARAMETERS
            if errors.get(row.name)
        }
        return ParameterSet(PLANT, plant_values(plant, known), {}, self.provenance)


def _values(state: CorrectorState, plan: FollowPlan, known: Mapping[str, float]) -> list[dict[str, Any]]:
    """Return the values that are not 0; ``known``: standard errors of those that were not adopted."""
    rows = []
    for field, error in zip(FIELDS, state.errors, strict=True):
        name, unit = BY_FIELD[field].name, BY_FIELD[field].unit
        start, used = getattr(plan.alone, field), getattr(state.twin, field)
        if start != 0.0 or used != 0.0:
            band = 1.96 * (error or known.get(name, 0.0))
            rows.append({"name": name, "start": start, "used": used, "band": band, "unit": unit_text(unit) or "1"})
    return rows
