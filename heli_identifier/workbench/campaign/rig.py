"""One rig of a campaign: its logs, and the truth where the maker of the logs knows it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from heli_identifier.errors import ConfigurationError
from heli_identifier.records import Log, RigConfiguration
from heli_plant.effects import CATALOGUE


@dataclass(frozen=True)
class TrueEffect:
    """An effect of the catalogue that a rig really has.

    Attributes
    ----------
    name, axis : str
        As in the catalogue.
    coefficient : float or None
        In the catalogue's unit; None where it cannot be compared with an estimate.
    shape : mapping of str to float
        Values of the law's shape parameters by their fields in
        :class:`heli_plant.parameters.PlantParameters`, as far as they are known.

    Raises
    ------
    ConfigurationError
        The catalogue has no such entry.
    """

    name: str
    axis: str
    coefficient: float | None
    shape: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if (self.name, self.axis) not in {(entry.name, entry.axis) for entry in CATALOGUE}:
            raise ConfigurationError(
                f"truth names {self.name!r} on {self.axis!r}, which is not in the catalogue that `heli effects` "
                "lists; a torque that is not in it is a TrueUnknown."
            )


@dataclass(frozen=True)
class TrueUnknown:
    """A torque that is not in the catalogue: the axis it acts on and the variable it depends on."""

    axis: str
    variable: str


@dataclass(frozen=True)
class Truth:
    """The true structure of a rig.

    Attributes
    ----------
    kind : str
        Word by which a summary counts the rig.
    parameters : mapping of str to float
        Values of the simplified model by the paper's symbols, as far as they are known.
    effects : tuple of TrueEffect
        One entry per axis.
    unknown : TrueUnknown or None
    """

    kind: str
    parameters: Mapping[str, float] = field(default_factory=dict)
    effects: tuple[TrueEffect, ...] = ()
    unknown: TrueUnknown | None = None


@dataclass(frozen=True)
class Rig:
    """The data set of one rig.

    Attributes
    ----------
    training, held_out : tuple of Log
        Logs to fit and search in, and held-out logs.
    truth : Truth or None
        Not given to the diagnosis; a result row compares it with what was found.
    configuration : RigConfiguration or None
        What else is known of the rig; with None the campaign's settings apply.

    Raises
    ------
    ConfigurationError
        One kind of log is missing.
    """

    training: tuple[Log, ...]
    held_out: tuple[Log, ...]
    truth: Truth | None = None
    configuration: RigConfiguration | None = None

    def __post_init__(self) -> None:
        for name in ("training", "held_out"):
            logs = tuple(getattr(self, name))
            if not logs or not all(isinstance(log, Log) for log in logs):
                raise ConfigurationError(f"rig.{name} = {logs!r} must hold one or more logs.")
            object.__setattr__(self, name, logs)
