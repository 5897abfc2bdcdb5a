"""One measured log: uniform time, SI units, the project's signs; and writing it as a CSV file."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from heli_identifier.errors import LogError
from heli_identifier.files import write_atomically

from .columns import Array
from .configuration import HIGHEST_VOLTAGE, RigConfiguration
from .units import ANGLES, CONTRACT_HEADERS

FARTHEST_TRAVEL = 1e4
"""Largest travel in either direction [rad]: 1600 turns, an hour of flight at half a turn a second."""


@dataclass(frozen=True)
class Event:
    """A passage of a log in which something other than the plant acts."""

    log: str
    """Name of the log."""
    axis: str
    """Pitch, elevation or travel."""
    start: float
    end: float
    """Start and end since the log's first sample [s]."""
    start_in_file: float
    end_in_file: float
    """Start and end in the time of the log's file [s]."""
    kind: Literal["force", "slip", "gap"]
    """`force` for an external force, `slip` for a step of the encoder's reading, `gap` for rows that the log lacks."""
    size: float
    """The acceleration of a force [rad/s^2], or the step of the reading [rad], with its sign."""


@dataclass(frozen=True, eq=False, repr=False)
class Log:
    """One run of one rig, sampled uniformly.

    A LogError says that shapes disagree, that a value is not finite or impossible on a bench helicopter, or that the
    rate is not positive.
    """

    name: str
    """Short name for tables and figures, unique within a data set."""
    rate_hz: float
    """Sampling rate [Hz]."""
    voltages: Array
    """Front and rear voltage [V], shape (N, 2), each constant from its sample to the next."""
    angles: Array
    """Pitch, elevation and travel [rad] at the samples, shape (N, 3)."""
    path: str = ""
    sha256: str = ""
    """File of the log, and the hash of its bytes; empty if the log was computed."""
    notes: tuple[str, ...] = ()
    """All conversions and repairs on reading, one sentence each."""
    start: float = 0.0
    """Time in the file of the instant time = 0 [s]."""
    references: Mapping[str, Array] = field(default_factory=dict)
    """References of the controller by axis (pitch, elevation, travel), shape (N,) each [rad]."""
    configuration: RigConfiguration | None = None
    """Configuration of the rig, if the log was read with one."""
    events: tuple[Event, ...] = ()
    """Passages in which something other than the plant acts; a diagnosis and `identify` leave them out."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "rate_hz", float(self.rate_hz))
        for name in ("voltages", "angles"):
            object.__setattr__(self, name, _freeze(getattr(self, name)))
        object.__setattr__(self, "references", {axis: _freeze(values) for axis, values in self.references.items()})
        object.__setattr__(self, "notes", tuple(self.notes))
        count, inf = len(self.angles), float("inf")
        references = {f"the {axis} reference": values for axis, values in self.references.items()}
        shapes = {"voltages": (count, 2), "angles": (count, 3)}
        for name, values in {"voltages": self.voltages, "angles": self.angles, **references}.items():
            shape = shapes.get(name, (count,))
            bound, unit = (HIGHEST_VOLTAGE, "V") if name == "voltages" else (FARTHEST_TRAVEL, "rad")
            self._require(values.shape == shape, f"{name} has shape {values.shape}, {shape} is needed")
            wrong = np.argwhere(~(np.abs(values) <= bound))  # NaN as well
            problem = f"{name}, sample {wrong[0][0] if len(wrong) else 0}: not finite, or beyond {bound:g} {unit}"
            self._require(not len(wrong), f"{problem}; give them in {unit}, or leave that out")
        axes = (*self.references, *(event.axis for event in self.events))
        unknown = next((axis for axis in axes if axis not in ANGLES), None)
        self._require(unknown is None, f"{unknown!r} is no axis; choose one of {', '.join(ANGLES)}")
        for event in self.events:
            self._require(event.log == self.name, f"an event of log {event.log!r} is not of this log; rename it")
            is_passage = -inf < event.start <= event.end < inf
            self._require(is_passage, f"an event from {event.start:g} s to {event.end:g} s is no passage; correct it")
        self._require(0.0 < self.rate_hz < inf, f"rate_hz = {self.rate_hz} Hz must be positive")
        self._require(count >= 2, f"it has {count} sample{'' if count == 1 else 's'}, 2 are needed")

    def _require(self, holds: bool, sentence: str) -> None:
        if not holds:
            raise LogError(f"log {self.name}: {sentence}.")

    def __repr__(self) -> str:
        source = f", read from {self.path}" if self.path else ""
        return f"<Log {self.name}: {self.duration:g} s, {self.samples} samples at {self.rate_hz:g} Hz{source}>"

    @cached_property
    def time(self) -> Array:
        """Time since the first sample, i/rate_hz [s], shape (N,)."""
        return _freeze(np.arange(self.samples) / self.rate_hz)

    @property
    def step(self) -> float:
        """Sampling interval [s]."""
        return 1.0 / self.rate_hz

    @property
    def samples(self) -> int:
        """Number of samples N."""
        return len(self.angles)

    @property
    def duration(self) -> float:
        """N sampling intervals [s]: the voltages of the last sample last for one as well."""
        return self.samples / self.rate_hz

    @property
    def columns(self) -> dict[str, Array]:
        """The six signals by their standard headers, each of shape (N,)."""
        values = (self.time, *self.voltages.T, *self.angles.T)
        return dict(zip(CONTRACT_HEADERS, values, strict=True))


def write_log(log: Log, path: str | PathLike[str]) -> Path:
    """Write a log as CSV with the standard header and all digits of its numbers; make the folders above the file."""
    columns = log.columns | {f"{axis}_reference [rad]": values for axis, values in log.references.items()}
    rows = (map(repr, row) for row in np.column_stack([*columns.values()]).tolist())
    return write_atomically(path, "\n".join([*map(",".join, (columns, *rows)), ""]))


def _freeze(values: ArrayLike) -> Array:
    """Make a read-only array, a copy if needed; in C order, so that compiled loops see one type only."""
    array = np.asarray(values, dtype=float, order="C")
    if array.flags.writeable or not array.flags.owndata:
        array = array.copy()
        array.flags.writeable = False
    return array
