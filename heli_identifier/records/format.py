"""How one rig writes its logs: column names, units, signs, cut, encoders, voltage limit."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations
from math import isfinite

from heli_identifier.errors import ConfigurationError
from heli_identifier.records.units import ANGLES, NAMED, SI_UNIT, known_units, understood

LOWEST_LIMIT, HIGHEST_LIMIT = 0.1, 100.0
"""Limits of an amplifier [V] below which no rotor turns and above which no bench motor runs."""

MOST_COUNTS = 2**32
"""Counts of an encoder per turn; the finest that are made have 2^32."""


@dataclass(frozen=True)
class LogFormat:
    """Where a log's signals stand, and how they become SI units with the project's signs.

    The default is the contract: header ``time [s],v_front [V],...``, no sign changed, nothing cut.

    Attributes
    ----------
    columns : Mapping[str, str]
        Header of a signal's column, for signals whose header differs from the contract's; v_sum and v_difference
        stand in place of v_front and v_rear in a log that holds their sum and difference.
    units : Mapping[str, str]
        Unit of a signal; overrides the unit in the header.
    signs : Mapping[str, int]
        +1 or -1 of a voltage or angle; signals that are not named keep their sign.
    references : Mapping[str, str]
        Header of the column that holds what the pilot asked of an axis, where it is not ``pitch_reference [rad]`` or
        alike; unit and sign are the axis's where the header states no unit.
    swap_rotors : bool
        Front and rear voltage change places, after columns and signs were applied.
    start, end : float or None
        First and last instant kept, in the file's own time [s].
    decimal : str
        Decimal mark of a text file, "." or ",".
    encoder_counts : tuple[int, int, int]
        Counts per turn of the pitch, elevation and travel encoders.
    voltage_limit : float
        Limit of the amplifiers' voltage [V]. A log that exceeds it is read, and a note says so.
    clip : bool
        Whether the file holds voltages before the amplifiers limit them; they are then limited on reading.
    largest_file : float
        Size up to which a file is read [MB].

    Raises
    ------
    ConfigurationError
        If a field names no signal, an unknown unit, or a value out of bounds. The message names the key of heli.toml.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    signs: Mapping[str, int] = field(default_factory=dict)
    references: Mapping[str, str] = field(default_factory=dict)
    swap_rotors: bool = False
    start: float | None = None
    end: float | None = None
    decimal: str = "."
    encoder_counts: tuple[int, int, int] = (4096, 4096, 8192)
    voltage_limit: float = 5.0
    clip: bool = False
    largest_file: float = 1000.0

    def __post_init__(self) -> None:
        for name in ("columns", "units", "signs"):
            for signal in getattr(self, name):
                if signal not in NAMED:
                    raise ConfigurationError(f"log.{name}.{signal} is not a signal; choose one of {', '.join(NAMED)}.")
        for axis in self.references:
            if axis not in ANGLES:
                raise ConfigurationError(f"log.references.{axis} is no axis; choose one of {', '.join(ANGLES)}.")
        for signal, unit in self.units.items():
            if understood(signal, unit) is None:
                raise ConfigurationError(
                    f"log.units.{signal} = {unit!r} is unknown; choose one of {', '.join(known_units(signal))}."
                )
        for signal, other in combinations(self.columns, 2):
            if self.columns[signal] == self.columns[other]:
                raise ConfigurationError(
                    f"log.columns.{signal} and log.columns.{other} both name the column {self.columns[signal]!r}; "
                    "give each signal a column of its own."
                )
        for signal, sign in self.signs.items():
            if signal == "time" or sign not in (-1, 1):
                raise ConfigurationError(
                    f"log.signs.{signal} = {sign} is refused; voltages and angles take 1 or -1, time takes no sign."
                )
        for name, instant in (("start", self.start), ("end", self.end)):
            if instant is not None and not isfinite(instant):
                raise ConfigurationError(f"log.{name} = {instant} s must be finite.")
        if self.start is not None and self.end is not None and self.end <= self.start:
            raise ConfigurationError(f"log.end = {self.end:g} s must come after log.start = {self.start:g} s.")
        if self.decimal not in (".", ","):
            raise ConfigurationError(f"log.decimal = {self.decimal!r} is unknown; choose '.' or ','.")
        if len(self.encoder_counts) != len(ANGLES) or not all(
            1 <= count <= MOST_COUNTS for count in self.encoder_counts
        ):
            raise ConfigurationError(
                f"rig.encoder_counts = {self.encoder_counts} must be counts per turn in [1, {MOST_COUNTS}] of "
                f"{', '.join(ANGLES)}."
            )
        if not LOWEST_LIMIT <= self.voltage_limit <= HIGHEST_LIMIT:
            raise ConfigurationError(
                f"rig.voltage_limit = {self.voltage_limit:g} V must lie in [{LOWEST_LIMIT:g}, {HIGHEST_LIMIT:g}] V."
            )
        if not self.largest_file > 0.0:
            raise ConfigurationError(f"log.largest_file = {self.largest_file:g} MB must be positive.")

    def sign(self, signal: str) -> int:
        """Give +1 or -1, the factor from the file's sign to the project's."""
        return self.signs.get(signal, 1)

    def counts_per_turn(self, signal: str) -> int:
        """Give the counts per turn of an angle's encoder; 1 for a signal without an encoder."""
        return self.encoder_counts[ANGLES.index(signal)] if SI_UNIT[signal] == "rad" else 1


CONTRACT = LogFormat()
