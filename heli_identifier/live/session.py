"""One flight that a twin follows: steps of the follower, with all that they say on disk as it is said."""

import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from time import monotonic
from typing import Any

from heli_identifier.errors import ConfigurationError
from heli_identifier.files import write_atomically
from heli_identifier.following import (
    Follower,
    FollowOutput,
    FollowSettings,
    FollowState,
    Sample,
    follow,
    parameters_in_use,
    prepare_follower,
    standard_errors_in_use,
    start_following,
)
from heli_identifier.live.journal import Journal
from heli_identifier.live.listening import Status
from heli_identifier.live.view import Due, View, due_at, view_of
from heli_identifier.online import Estimate
from heli_identifier.records import CONTRACT_HEADERS
from heli_identifier.results import PLANT, ParameterSet, plain, plant_values
from heli_plant.effects import AXES
from heli_plant.parameter_table import PARAMETERS
from heli_plant.parameters import PlantParameters

RECORDED, PREDICTIONS, EVENTS, IN_USE = "recorded.csv", "predictions.csv", "events.json", "following.json"
"""Files of a flight: what came in, predictions, events, and the parameters that the twin uses."""

DIAGNOSED = "diagnosis.json"
"""File of a diagnosis, which a flight ends with."""

Changed = Callable[[PlantParameters, Mapping[str, float], float], None]

WRITTEN_EVERY, SHOWN_EVERY = 0.05, 0.2
"""Time between two writes to the journals, and between two views [s]."""


def check_unused(folder: Path) -> None:
    """Refuse a folder that holds an earlier flight or diagnosis.

    Raises
    ------
    ConfigurationError
        Names the file that is there.
    """
    for name in (RECORDED, PREDICTIONS, DIAGNOSED):
        if (folder / name).exists():
            raise ConfigurationError(
                f"{folder / name} is there already and is not replaced, it is of an earlier flight or diagnosis; name "
                "another folder."
            )


class Session:
    """A twin and the files of its flight.

    Parameters
    ----------
    folder : Path
        Where the files go; it must not hold an earlier recording.
    parameters : ParameterSet
        Of the plant, as a diagnosis delivers them.
    changed : callable
        Called when a change was adopted or taken back with the plant's parameters, their standard errors by structured
        name, and the elevation [rad].

    Raises
    ------
    ConfigurationError
        The parameters are not a plant's, or the folder holds a recording or is none.
    """

    def __init__(self, folder: Path, parameters: ParameterSet, changed: Changed = lambda *_: None) -> None:
        self.plant, self.changed = parameters.plant(), changed
        self.folder, self.provenance = folder, dict(parameters.provenance)
        self.declared = {axis: expected.prediction.value for axis, expected in parameters.expected.items()}
        self.estimates = parameters.values
        _make(folder)
        self.recorded = Journal(folder / RECORDED, CONTRACT_HEADERS)
        angles = [f"{twin}{axis} [rad]" for twin in ("", "predicted.", "predicted_alone.") for axis in AXES]
        try:
            self.predictions = Journal(folder / PREDICTIONS, ["time [s]", *angles])
        except BaseException:
            self.recorded.close()
            (folder / RECORDED).unlink()
            raise
        self.events: list[dict[str, Any]] = []
        self._write_events()
        self.plan: Follower | None = None
        self.state: FollowState | None = None
        self.output: FollowOutput | None = None
        self.last: Due | None = None
        self.due: list[Due] = []  # since the last view
        self.last_time = 0.0
        self.notice = ""  # what is to be said about the controller
        self.sample = Sample(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    @property
    def time(self) -> float:
        """Time of the last instant [s]."""
        return self.last_time if self.output is None else self.output.corrector.time

    def keep(self, time: float, signals: tuple[float, ...]) -> None:
        """Record a sample: its time [s], voltages [V] and angles [rad]."""
        self.last_time = round(time, 9)
        self.recorded.add((self.last_time, *signals))

    def run(
        self,
        instants: Iterable[Sample | None],
        sample_time: Callable[[], float],
        stopped: Callable[[], bool],
        show: Callable[[View | None, Status | None], None],
        status: Callable[[], Status | None] = lambda: None,
    ) -> None:
        """Follow until the instants end or it is asked to stop.

        Parameters
        ----------
        instants : iterable of Sample or None
            The rig's samples; None while none is due.
        sample_time : callable
            Gives the time between two instants [s], once the first has come.
        stopped : callable
            Whether to stop.
        show : callable
            Called about five times a second with the view (None before the first instant) and the stream.
        status : callable
            Gives how the stream is doing.
        """
        written = shown = monotonic()
        for sample in instants:
            if sample is not None:
                if self.plan is None:
                    self._begin(sample, sample_time())
                else:
                    self._step(sample)
            now = monotonic()
            if sample is None or now - written > WRITTEN_EVERY:
                self.write()
                written = now
            if now - shown > SHOWN_EVERY:
                shown = now
                show(self.view(status()), status())
            if stopped():
                break
        self.write()
        show(self.view(status()), status())

    def _begin(self, sample: Sample, sample_time: float) -> None:
        self.plan = prepare_follower(FollowSettings(sample_time=sample_time, parameters=self.plant))
        self.state = start_following(self.plan, sample)

    def _step(self, sample: Sample) -> None:
        assert self.plan is not None and self.state is not None
        self.state, self.output = follow(self.state, sample, self.plan)
        now = self.output.corrector
        self.sample = sample
        if now.compared:
            self.last = due_at(sample, self.output)
            self.due.append(self.last)
            if self.last.measured is not None:
                self.predictions.add((self.last.time, *self.last.measured, *now.predicted, *now.predicted_alone))
        for event in now.events:
            self.say(event.document())

    def say(self, event: dict[str, Any]) -> None:
        """Add an event to the file of events; an adoption or its end writes the parameters in use as well."""
        self.events.append(event)
        self._write_events()
        if event["what"] in ("adopted", "rolled back"):
            self.in_use().write(self.folder / IN_USE)
            plant, errors = self._used()
            given = {name: value.standard_error or 0.0 for name, value in self.estimates.items()}
            self.changed(plant, {**given, **errors}, self.sample.elevation)

    def _write_events(self) -> None:
        write_atomically(
            self.folder / EVENTS, json.dumps(plain(self.events), indent=1, ensure_ascii=False, allow_nan=False) + "\n"
        )

    def write(self) -> None:
        """Hand everything that came in to the system."""
        self.recorded.flush()
        self.predictions.flush()

    def close(self) -> None:
        """Write what is left and close the files."""
        self.recorded.close()
        self.predictions.close()

    def view(self, status: Status | None) -> View | None:
        """Return what there is to see; None before the first step."""
        if self.plan is None or self.output is None:
            return None
        due, self.due = self.due, []
        return view_of(
            self.sample, self.output, self.last, due, self.plan, self.declared, self.events, self.notice, status
        )

    def in_use(self) -> ParameterSet:
        """Return the parameters that the twin uses; what was adopted has the standard error of its adoption."""
        fields = {row.name: row for row in PARAMETERS}
        known = {fields[name].field: value for name, value in self.estimates.items() if name in fields}
        plant, errors = self._used()
        for name, error in errors.items():
            row = fields[name]
            known[row.field] = Estimate(getattr(plant, row.field), error, row.unit)
        return ParameterSet(PLANT, plant_values(plant, known), {}, self.provenance)

    def _used(self) -> tuple[PlantParameters, dict[str, float]]:
        """Return the plant in use, and the standard errors of the parameters that were adopted."""
        if self.plan is None or self.state is None:
            return self.plant, {}
        plant = parameters_in_use(self.state.corrector, self.plan.corrector)
        errors = standard_errors_in_use(self.state.corrector, self.plan.corrector)
        names = {row.name for row in PARAMETERS}
        # A rotor's share is no parameter of the plant; its gains have it.
        return plant, {name: error for name, error in errors.items() if name in names}


def _make(folder: Path) -> None:
    """Make the folder of the results."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as error:
        raise ConfigurationError(
            f"{folder} is a file, a folder is needed there; name another output folder."
        ) from error
    except OSError as error:
        raise ConfigurationError(f"{folder} cannot be made: {error.strerror}; name another folder.") from error
