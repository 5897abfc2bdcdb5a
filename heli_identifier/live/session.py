"""One flight that a twin follows: its steps, with all that they say on disk as it is said.

Every row of a journal is handed to the system as it comes: a command that is killed loses none. Once a second the
system is asked to put them on the disk, so that a loss of power costs a second.
"""

import os
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple

from heli_identifier import following
from heli_identifier.errors import refuse
from heli_identifier.files import write_atomically
from heli_identifier.following import CorrectorState, Event, FollowPlan, FollowSettings, Sample
from heli_identifier.live.listening import Listening, Status
from heli_identifier.live.sources import Player
from heli_identifier.online import Estimate
from heli_identifier.records import CONTRACT_HEADERS
from heli_identifier.results import PLANT, ParameterSet, document_text, plant_values, unit_text, whole_folder
from heli_plant.effects import AXES
from heli_plant.observer import CORRECTED
from heli_plant.parameters import PARAMETERS, PlantParameters

RECORDED, PREDICTIONS, EVENTS, IN_USE = "recorded.csv", "predictions.csv", "events.json", "following.json"
"""Files of a flight: what came in, predictions, events, and the parameters that the twin uses."""

ADVICE, GAINS = "control_advice.json", "controller.json"
"""Files: how the margins stand, and the gains that are offered, as parameters of the PidController."""

DIAGNOSED = "diagnosis.json"
"""File of a diagnosis, which a flight ends with."""

SYNCED_EVERY, WRITTEN_EVERY, SHOWN_EVERY = 1.0, 0.05, 0.2
"""Time between two requests to put rows on the disk, two writes to the journals, and two views [s]."""

_PAST = 300  # comparisons that a view holds: a minute of flight, five a second
_DIGITS = 9  # of times [s] in a file: k h in floats has a tail that means nothing

Changed = Callable[[PlantParameters, Mapping[str, float], float], None]


class Journal:
    """A CSV file that is made with its header and only grows, by whole rows.

    One that is there already holds what was measured before, and is never replaced.
    """

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        self.path, self.rows, self._synced = path, 0, monotonic()
        self._file = path.open("xb", buffering=0)
        self._pending = [",".join(columns) + "\n"]
        self.flush()

    def add(self, row: Sequence[float]) -> None:
        """Add a row; :meth:`flush` writes it. Numbers read back as the same double."""
        self._pending.append(",".join(map(repr, row)) + "\n")
        self.rows += 1

    def flush(self) -> None:
        """Hand the rows that were added to the system.

        Where the disk is full or gone the OSError names the file, which ends with a whole row.
        """
        data, written, begin = "".join(self._pending).encode(), 0, self._file.tell()
        self._pending.clear()
        try:
            while written < len(data):
                written += self._file.write(data[written:])
            if data and monotonic() - self._synced > SYNCED_EVERY:
                self._synced = monotonic()
                os.fsync(self._file)
        except OSError as error:
            self._file.truncate(self._file.seek(begin + data.rfind(b"\n", 0, written) + 1))
            raise OSError(error.errno, error.strerror, str(self.path)) from error

    def close(self) -> None:
        """Write what is left and close the file."""
        with self._file:
            self.flush()
            os.fsync(self._file)


class View(NamedTuple):
    """What there is to see at one instant, on the terminal and on the page alike.

    ``time`` [s], ``mode``; ``alarm``: the detector's largest sum over its threshold [1], and the likeliest change as
    ``suspect``; how the ``stream`` is doing; ``notice`` about the controller; ``events`` as they stand in their file.
    ``past``: instants for which predictions fell due, with the angles ``measured``, ``predicted`` 1 s before and by the
    twin left alone, and rms errors of both over the window (None where there is none yet) [rad]; ``declared``: those of
    the parameters [rad]. ``values``: each at the ``start`` and as ``used``, with half the 95 % ``band`` of the latter,
    0 where it is not known; none before the first step.
    """

    time: float = 0.0
    mode: str = "waiting"
    alarm: float = 0.0
    suspect: str = ""
    stream: Status = Status()
    notice: str = ""
    events: Sequence[dict[str, Any]] = ()
    past: Sequence[dict[str, Any]] = ()
    declared: Sequence[float | None] = (None, None, None)
    values: Sequence[dict[str, Any]] = ()


Show = Callable[[View], None]


def check_unused(folder: Path) -> None:
    """Refuse a folder that holds an earlier flight or diagnosis: a ConfigurationError that names the file."""
    for name in (RECORDED, PREDICTIONS, DIAGNOSED):
        said = f"{folder / name} is there already and is not replaced, it holds what was recorded before"
        refuse(os.path.lexists(folder / name), f"{said}; name another folder.")


class Session:
    """A twin and the files of its flight, in a folder that must not hold an earlier recording.

    ``parameters`` are the plant's, as a diagnosis delivers them. ``changed`` is called when a change was adopted or
    taken back, with the plant's parameters, their standard errors by structured name, and the elevation [rad].
    """

    def __init__(self, folder: Path, parameters: ParameterSet, changed: Changed = lambda *_: None) -> None:
        self.plant, self.changed = parameters.plant(), changed
        self.folder, self.provenance = folder, dict(parameters.provenance)
        declared = {axis: expected.prediction_1s_rad.value for axis, expected in parameters.expected.items()}
        self.declared = tuple(declared.get(axis) for axis in AXES)
        self.errors = {name: value.standard_error or 0.0 for name, value in parameters.values.items()}
        with whole_folder(folder):  # it is made, or said why not
            check_unused(folder)
        self.events: list[dict[str, Any]] = []  # as they stand in their file
        self._write_events()
        angles = [f"{twin}{axis} [rad]" for twin in ("", "predicted.", "predicted_alone.") for axis in AXES]
        self.predictions = Journal(folder / PREDICTIONS, ["time [s]", *angles])
        self.recorded = Journal(folder / RECORDED, CONTRACT_HEADERS)
        self.twin: tuple[FollowPlan, CorrectorState] | None = None  # from the first instant on
        self.past: deque[dict[str, Any]] = deque(maxlen=_PAST)
        self.last_time = 0.0  # of a sample [s]
        self._time = self._elevation = 0.0  # of the last step [s], [rad]
        self._noted: set[str] = set()

    @property
    def time(self) -> float:
        """Time of the last instant [s]."""
        return self._time or self.last_time

    def keep(self, time: float, signals: tuple[float, ...]) -> None:
        """Record a sample: its time [s], voltages [V] and angles [rad]."""
        self.last_time = round(time, _DIGITS)
        self.recorded.add((self.last_time, *signals))

    def run(self, source: Listening | Player, stopped: Callable[[], bool], show: Show) -> None:
        """Follow what comes from a ``source`` until it ends or has ``stopped``, and show it five times a second.

        What there is to say about the stream becomes an event.
        """
        written = shown = monotonic()
        for sample in source.instants(self.keep, stopped):
            if sample is not None:
                self._step(sample, source.sample_time)
            now = monotonic()
            if sample is None or now - written > WRITTEN_EVERY:
                self.write()
                written = now
            if now - shown > SHOWN_EVERY:
                shown = now
                show(self.view(source.status))
        self.write()
        last = source.status
        show(self.view(last))
        if last.faults:
            self.say(Event(self.time, "stream", why=last.faults))

    def _step(self, sample: Sample, sample_time: float) -> None:
        if self.twin is None:
            plan = FollowPlan(FollowSettings(sample_time=sample_time, parameters=self.plant))
            self.twin = plan, following.start_correcting(plan, sample)
            return
        plan, state = self.twin
        state, events = following.correct(state, sample, plan)
        self.twin = plan, state
        self._time, self._elevation = state.instants * sample_time, sample.elevation
        twins, window = state.predictions, plan.window
        if twins.compared:
            used, alone = twins.used, twins.alone
            time = round(self.time, _DIGITS)
            self.past.append({
                "time": time, "measured": sample[2:5],
                "predicted": used.predicted, "predicted_alone": alone.predicted,
                "error": [error or None for error in used.rms(window)],
                "error_alone": [error or None for error in alone.rms(window)],
            })  # fmt: skip
            self.predictions.add((time, *sample[2:5], *used.predicted, *alone.predicted))
        for event in events:
            self.say(event)

    def say(self, event: Event) -> None:
        """Add an event to the file of events; an adoption or its end writes the parameters in use as well."""
        self.events.append(event.document())
        self._write_events()
        if event.what in ("adopted", "rolled back"):
            self.in_use().write(self.folder / IN_USE)
            self.changed(*self._plant_in_use(), self._elevation)

    def _write_events(self) -> None:
        write_atomically(self.folder / EVENTS, document_text(self.events))

    def write(self) -> None:
        """Hand everything that came in to the system."""
        self.recorded.flush()
        self.predictions.flush()

    def close(self) -> None:
        """Write what is left and close the files."""
        self.recorded.close()
        self.predictions.close()

    def view(self, stream: Status) -> View:
        """Return what there is to see; what the ``stream`` notes becomes an event first."""
        for note in stream.notes:
            if note not in self._noted:
                self._noted.add(note)
                self.say(Event(self.time, "stream", why=note))
        view = View(stream=stream, events=tuple(self.events), declared=self.declared)
        if self.twin is None or self._time == 0.0:
            return view
        plan, now = self.twin
        return view._replace(
            time=self.time,
            mode=now.mode,
            alarm=now.alarm,
            suspect=plan.changes[now.finding.change].name if now.finding.change >= 0 else "",
            past=tuple(self.past),
            values=_values(now, plan, self.errors),
        )

    def in_use(self) -> ParameterSet:
        """Return the parameters that the twin uses; what was adopted has the standard error of its adoption."""
        plant, errors = self._plant_in_use()
        rows = [(row, errors[row.name]) for row in PARAMETERS if errors.get(row.name)]
        known = {row.field: Estimate(getattr(plant, row.field), error, row.unit) for row, error in rows}
        return ParameterSet(PLANT, plant_values(plant, known), {}, self.provenance)

    def _plant_in_use(self) -> tuple[PlantParameters, dict[str, float]]:
        """Return the plant in use, and the standard errors of its parameters that are known."""
        if self.twin is None:
            return self.plant, self.errors
        plan, state = self.twin
        plant, adopted = following.parameters_in_use(state)
        return plant, {**self.errors, **adopted}


def _values(state: CorrectorState, plan: FollowPlan, known: Mapping[str, float]) -> list[dict[str, Any]]:
    """Return what is on of what the twin may change; standard errors are ``known`` where nothing was adopted."""
    found = []
    for (name, unit), start, used, error in zip(
        CORRECTED, plan.alone.values, state.twin.values, state.errors, strict=True
    ):
        if start != 0.0 or used != 0.0:
            band = 1.96 * (error or known.get(name, 0.0))
            found.append({"name": name, "start": start, "used": used, "band": band, "unit": unit_text(unit) or "1"})
    return found
