"""Which column of a file holds which signal, and in which unit.

A header reads ``name [unit]``. ``name (unit)`` means the same, and so do ``name_unit`` and ``name_unit_`` for MATLAB,
whose names hold no brackets; MATLAB itself makes ``name_unit_`` of the contract's header.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from heli_identifier.errors import HELI_TOML, LogError
from heli_identifier.records.format import LogFormat
from heli_identifier.records.units import SIGNALS, factor_to_si, header, known_units
from heli_plant.errors import did_you_mean

_BRACKETED = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]$")
_UNDERSCORED = re.compile(rf"^(?P<name>{'|'.join(SIGNALS)})_(?P<unit>[A-Za-z]+)_?$")


@dataclass(frozen=True)
class Column:
    """Place and meaning of one signal.

    Attributes
    ----------
    signal : str
        One of the six signals.
    index : int
        Which column of the file.
    unit : str
        Unit in the file.
    factor : float
        From the file's unit to SI; without the sign.
    """

    signal: str
    index: int
    unit: str
    factor: float


def find_columns(headers: Sequence[str], format: LogFormat, file: str) -> tuple[Column, ...]:
    """Find the six signals among the headers of a file.

    Parameters
    ----------
    headers : Sequence[str]
        The file's headers.
    format : LogFormat
        Names and units that differ from the contract.
    file : str
        Name of the file for messages.

    Returns
    -------
    tuple[Column, ...]
        One per signal, in the contract's order.

    Raises
    ------
    LogError
        If a signal has no column or several, or its unit is missing or unknown.
    """
    stated = [_name_and_unit(text) for text in headers]
    places = {
        signal: [
            index
            for index, text in enumerate(headers)
            if (text == format.columns[signal] if signal in format.columns else stated[index][0] == signal)
        ]
        for signal in SIGNALS
    }
    missing = [format.columns.get(signal, header(signal)) for signal in SIGNALS if not places[signal]]
    if missing:
        taken = {index for found in places.values() for index in found}
        raise LogError(_missing(file, missing, headers, [h for i, h in enumerate(headers) if i not in taken]))
    for signal, found in places.items():
        if len(found) > 1:
            both = ", ".join(repr(headers[index]) for index in found)
            raise LogError(
                f"{file}: {signal} stands in {len(found)} columns ({both}); keep one, or name it under "
                f"[log.columns] of {HELI_TOML}."
            )
    columns, unknown = [], {}
    for signal, (index,) in places.items():
        unit = format.units.get(signal) or stated[index][1]
        if unit is None or unit not in known_units(signal):
            unknown[signal] = (headers[index], unit)
        else:
            columns.append(Column(signal, index, unit, factor_to_si(signal, unit, format.counts_per_turn(signal))))
    if unknown:
        raise LogError(_unknown_units(file, unknown))
    return tuple(columns)


def _name_and_unit(text: str) -> tuple[str, str | None]:
    """Split a header; the unit is None where the header states none."""
    found = _BRACKETED.match(text.strip()) or _UNDERSCORED.match(text.strip())
    return (found["name"].strip(), found["unit"].strip()) if found else (text.strip(), None)


def _missing(file: str, missing: Sequence[str], headers: Sequence[str], unused: Sequence[str]) -> str:
    columns, them = ("column", "it") if len(missing) == 1 else ("columns", "them")
    proposal = did_you_mean(missing[0], unused) if len(missing) == 1 else ""
    return (
        f"{file}: {columns} {', '.join(map(repr, missing))} missing, found {', '.join(map(repr, headers))}; rename the "
        f"{columns} or map {them} under [log.columns] of {HELI_TOML}{proposal or '.'}"
    )


def _unknown_units(file: str, columns: Mapping[str, tuple[str, str | None]]) -> str:
    """Name every signal whose unit is missing or unknown; ``columns`` holds header and unit of each."""
    stated = [
        f"column {text!r}: {f'unit {unit!r} is unknown' if unit else 'the unit is missing'}, "
        f"{' or '.join(known_units(signal))} is needed"
        for signal, (text, unit) in columns.items()
    ]
    heads = ", ".join(repr(header(signal)) for signal in columns)
    return (
        f"{file}, {'; '.join(stated)}; rename the column{'' if len(columns) == 1 else 's'} to {heads}, or set "
        f"{', '.join(columns)} under [log.units] of {HELI_TOML}."
    )
