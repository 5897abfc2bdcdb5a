"""The six signals of a log, the units in which it may state them, and their factors to SI: degrees become radians here.

| quantity | SI | also read |
|---|---|---|
| time | s | ms, us |
| voltage | V | mV |
| angle | rad | deg, counts (of the encoder: 2π/counts per turn) |
"""

import math
from collections.abc import Mapping
from types import MappingProxyType

SIGNALS = ("time", "v_front", "v_rear", "pitch", "elevation", "travel")
VOLTAGES = SIGNALS[1:3]
ANGLES = SIGNALS[3:]

SI_UNIT: Mapping[str, str] = MappingProxyType(
    {"time": "s", **dict.fromkeys(VOLTAGES, "V"), **dict.fromkeys(ANGLES, "rad")}
)

_FACTORS = {
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6},
    "V": {"V": 1.0, "mV": 1e-3},
    "rad": {"rad": 1.0, "deg": math.pi / 180.0},
}
ENCODER_UNIT = "counts"


def header(signal: str) -> str:
    """Give the contract's column header of a signal, such as ``pitch [rad]``."""
    return f"{signal} [{SI_UNIT[signal]}]"


CONTRACT_HEADERS = tuple(header(signal) for signal in SIGNALS)


def known_units(signal: str) -> tuple[str, ...]:
    """List the units in which a signal is read, SI first."""
    units = tuple(_FACTORS[SI_UNIT[signal]])
    return (*units, ENCODER_UNIT) if signal in ANGLES else units


def factor_to_si(signal: str, unit: str, counts_per_turn: int) -> float:
    """Give the factor from `unit` to SI.

    Parameters
    ----------
    signal : str
        One of `SIGNALS`.
    unit : str
        One of `known_units(signal)`.
    counts_per_turn : int
        Counts per turn of the signal's encoder, for the unit ``counts``.

    Raises
    ------
    KeyError
        If the unit is not one of `known_units(signal)`; `find_columns` checks first and names the file.
    """
    if unit == ENCODER_UNIT and signal in ANGLES:
        return 2.0 * math.pi / counts_per_turn
    return _FACTORS[SI_UNIT[signal]][unit]
