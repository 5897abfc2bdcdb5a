"""How one rig writes its logs: column names, units, signs, cut, encoders, voltage limit."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite

from heli_identifier.errors import ConfigurationError
from heli_identifier.records.units import ANGLES, SI_UNIT, SIGNALS, known_units

DECIMAL_MARKS = (".", ",")


@dataclass(frozen=True)
class LogFormat:
    """Where a log's signals are and what turns them into the project's units and signs.

    The default is the contract: header ``time [s],v_front [V],...``, nothing flipped, nothing cut.

    Attributes
    ----------
    columns : Mapping[str, str]
        Header of a signal's column in the file, for signals that are not called as the contract calls them.
    units : Mapping[str, str]
        Unit of a signal; outranks the unit in the header.
    signs : Mapping[str, int]
        +1 or -1 per voltage and angle; signals not named keep their sign.
    swap_rotors : bool
        Front and rear voltage change places (after the columns were found).
    start, end : float or None
        First and last instant kept, in the file's own time [s].
    decimal : str
        Decimal mark of a text file, "." or ",".
    encoder_counts : tuple[int, int, int]
        Counts per turn of the pitch, elevation and travel encoders.
    voltage_limit : float
        Bound on the amplifiers' voltage [V]; a log that goes beyond is read and the fact is noted.

    Raises
    ------
    ConfigurationError
        If a field names no signal, an unknown unit, or a value out of bounds.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    signs: Mapping[str, int] = field(default_factory=dict)
    swap_rotors: bool = False
    start: float | None = None
    end: float | None = None
    decimal: str = "."
    encoder_counts: tuple[int, int, int] = (4096, 4096, 8192)
    voltage_limit: float = 5.0

    def __post_init__(self) -> None:
        for name in ("columns", "units", "signs"):
            for signal in getattr(self, name):
                if signal not in SIGNALS:
                    raise ConfigurationError(f"{name}.{signal} names no signal, choose one of {', '.join(SIGNALS)}.")
        for signal, unit in self.units.items():
            if unit not in known_units(signal):
                raise ConfigurationError(
                    f"units.{signal} = {unit!r} is unknown, choose one of {', '.join(known_units(signal))}."
                )
        for signal, sign in self.signs.items():
            if signal == "time" or sign not in (-1, 1):
                raise ConfigurationError(
                    f"signs.{signal} = {sign} is refused: a voltage or an angle takes 1 or -1, time takes none."
                )
        for name, instant in (("start", self.start), ("end", self.end)):
            if instant is not None and not isfinite(instant):
                raise ConfigurationError(f"{name} = {instant} s must be finite.")
        if self.start is not None and self.end is not None and self.end <= self.start:
            raise ConfigurationError(f"end = {self.end:g} s must come after start = {self.start:g} s.")
        if self.decimal not in DECIMAL_MARKS:
            raise ConfigurationError(f"decimal = {self.decimal!r} is unknown, choose '.' or ','.")
        if len(self.encoder_counts) != len(ANGLES) or min(self.encoder_counts) < 1:
            raise ConfigurationError(
                f"encoder_counts = {self.encoder_counts} must be counts per turn > 0 of {', '.join(ANGLES)}."
            )
        if not self.voltage_limit > 0.0:
            raise ConfigurationError(f"voltage_limit = {self.voltage_limit:g} V must be positive.")

    def sign(self, signal: str) -> int:
        """Give +1 or -1, the factor from the file's sign to the project's."""
        return self.signs.get(signal, 1)

    def counts_per_turn(self, signal: str) -> int:
        """Give the counts per turn of an angle's encoder; 1 for a signal without an encoder."""
        return self.encoder_counts[ANGLES.index(signal)] if SI_UNIT[signal] == "rad" else 1


CONTRACT = LogFormat()
