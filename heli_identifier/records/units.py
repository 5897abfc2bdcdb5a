"""The six signals of a log, the units in which it may state them, and their factors to SI: degrees become radians here.

A unit is understood in any case and by its plain names (`degrees`, `°`, `sec`, `Volt`). One that could be two things is
not: `Grad` is a degree in German and a 400th of a turn in English.

Instead of the two voltages a log may hold their sum v_front + v_rear and their difference v_front - v_rear.
"""

import math

SIGNALS = ("time", "v_front", "v_rear", "pitch", "elevation", "travel")
VOLTAGES = SIGNALS[1:3]
ANGLES = SIGNALS[3:]
COMBINED = ("v_sum", "v_difference")
NAMED = (*SIGNALS, *COMBINED)
"""All that a configuration may name a column of."""
REFERENCES = tuple(f"{angle}_reference" for angle in ANGLES)
"""What a pilot or a plan asked of an angle, which a log may hold as well."""

SI_UNIT = {
    "time": "s", **dict.fromkeys((*VOLTAGES, *COMBINED), "V"), **dict.fromkeys((*ANGLES, *REFERENCES), "rad"),
}  # fmt: skip

STAMP = "ISO 8601"
"""Unit of a time column that holds time stamps, such as 2026-03-01T12:00:00.010; instants count from the first."""

_UNITS = {  # by the SI unit: factor to it, and names
    "s": {
        "s": (1.0, "s sec secs second seconds sekunde sekunden seconde secondes"),
        "ms": (1e-3, "ms msec msecs millisecond milliseconds millisekunde millisekunden"),
        "us": (1e-6, "us µs μs usec microsecond microseconds mikrosekunden"),
        "ns": (1e-9, "ns nsec nanosecond nanoseconds"),
        "min": (60.0, "min minute minutes minuten"),
        STAMP: (1.0, "iso iso8601 datetime timestamp"),
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
_UNDERSTOOD = {
    si: {name: unit for unit, (_, names) in units.items() for name in (unit.lower(), *names.split())}
    for si, units in _UNITS.items()
}
_PROBABLY = {
    "grad": 'probably degrees, "deg": so German calls them; in English a grad is a 400th of a turn',
    **dict.fromkeys(("rad/s", "deg/s", "°/s", "rpm"), "a rate and no angle: name the column of the angle"),
}


def header(signal: str) -> str:
    """Give the contract's column header of a signal, such as ``pitch [rad]``."""
    return f"{signal} [{SI_UNIT[signal]}]"


def with_unit(name: str, unit: str) -> str:
    """Give a name with a unit that a file states beside it, where it states one and the name does not."""
    return f"{name} [{unit.strip()}]" if unit.strip() and "[" not in name else name


CONTRACT_HEADERS = tuple(header(signal) for signal in SIGNALS)


def known_units(signal: str) -> tuple[str, ...]:
    """List the units in which a signal is read, SI first."""
    return tuple(_UNITS[SI_UNIT[signal]])


def parse_unit(signal: str, text: str) -> str | None:
    """Give the unit that a text plainly means for a signal, one of `known_units`; None if it is not plain."""
    return _UNDERSTOOD[SI_UNIT[signal]].get(text.strip().lower())


def guess_unit(signal: str, text: str) -> str:
    """Say what a unit that is not understood probably is, or which ones are."""
    known = known_units(signal)
    return _PROBABLY.get(text.strip().lower(), f"{', '.join(known[:-1])} or {known[-1]} is needed")


def factor_to_si(signal: str, unit: str, counts_per_turn: int) -> float:
    """Give the factor to SI from `unit`, one of `known_units(signal)`; counts are those of the signal's encoder."""
    return 2.0 * math.pi / counts_per_turn if unit == "counts" else _UNITS[SI_UNIT[signal]][unit][0]
