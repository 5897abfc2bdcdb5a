"""An event as a value: which log and axis, from when to when."""

from dataclasses import dataclass
from typing import Literal

Kind = Literal["force", "slip"]


@dataclass(frozen=True)
class Event:
    """A passage of a log in which something acts that is not the plant.

    Attributes
    ----------
    log : str
        Name of the log.
    axis : str
        Pitch, elevation or travel.
    start, end : float
        Since the log's first sample [s].
    start_in_file, end_in_file : float
        The same in the time of the log's file [s].
    kind : str
        "force" for a force from outside, "slip" for a step of the encoder's reading.
    size : float
        Largest unexplained acceleration [rad/s^2], or the step of a slip [rad].
    """

    log: str
    axis: str
    start: float
    end: float
    start_in_file: float
    end_in_file: float
    kind: Kind
    size: float
