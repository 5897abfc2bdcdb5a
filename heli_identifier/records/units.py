"""The six signals of a log, the units that a log may use for them, and the factors to SI units.

A unit may be written in upper or lower case and by its common names (`degrees`, `°`, `sec`, `Volt`), but for ambiguous
ones: `Grad` is a degree in German and a 400th of a turn in English.

Instead of the two voltages a log may hold their sum v_front + v_rear and their difference v_front - v_rear.
"""

import math

SIGNALS = ("time", "v_front", "v_rear", "pitch", "elevation", "travel")
VOLTAGES = SIGNALS[1:3]
ANGLES = SIGNALS[3:]
COMBINED = ("v_sum", "v_difference")
NAMED = (*SIGNALS, *COMBINED)
"""All signals for which a configuration may name a column."""
REFERENCES = tuple(f"{angle}_reference" for angle in ANGLES)
"""Reference values (setpoints) of the angles, which a log may hold as well."""

SI_UNIT = {
    "time": "s", **dict.fromkeys((*VOLTAGES, *COMBINED), "V"), **dict.fromkeys((*ANGLES, *REFERENCES), "rad"),
}  # fmt: skip

_UNITS = {  # for each SI unit: the units with their factor to it and their names
    "s": {
        "s": (1.0, "s sec secs second seconds sekunde sekunden seconde secondes"),
        "ms": (1e-3, "ms msec msecs millisecond milliseconds millisekunde millisekunden"),
        "us": (1e-6, "us µs μs usec microsecond microseconds mikrosekunden"),
        "ns": (1e-9, "ns nsec nanosecond nanoseconds"),
        "min": (60.0, "min minute minutes minuten"),
    },
    "V": {"V": (1.0, "v volt volts"), "mV": (1e-3, "mv millivolt millivolts")},
    "rad": {
        "rad": (1.0, "rad rads radian radians"),
        "deg": (math.pi / 180.0, "deg degs degree degrees ° º ˚"),
        "counts": (math.nan, "counts count cnt cnts ticks tick pulses increments inkremente"),
        "rev": (2.0 * math.pi, "rev revs revolution revolutions turn turns"),
        "mrad": (1e-3, "mrad milliradian milliradians"),
    },
}
_UNIT_BY_NAME = {
    si: {name: unit for unit, (_, names) in units.items() for name in (unit.lower(), *names.split())}
    for si, units in _UNITS.items()
}


def header(signal: str) -> str:
    """Return the standard column header of a signal, such as ``pitch [rad]``."""
    return f"{signal} [{SI_UNIT[signal]}]"


CONTRACT_HEADERS = tuple(header(signal) for signal in SIGNALS)


def known_units(signal: str) -> tuple[str, ...]:
    """List the units in which a signal is read, SI first."""
    return tuple(_UNITS[SI_UNIT[signal]])


def parse_unit(signal: str, text: str) -> str | None:
    """Return the unit that a text names, one of `known_units` of the signal; None if it is unknown or ambiguous."""
    return _UNIT_BY_NAME[SI_UNIT[signal]].get(text.strip().lower())


def factor_to_si(signal: str, unit: str, counts_per_turn: int) -> float:
    """Return the factor to SI from `unit`, one of `known_units(signal)`; counts are those of the signal's encoder."""
    return 2.0 * math.pi / counts_per_turn if unit == "counts" else _UNITS[SI_UNIT[signal]][unit][0]
