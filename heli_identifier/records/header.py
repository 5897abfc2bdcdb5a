"""Which column of a file is which signal, and in which unit.

A header reads ``name [unit]``. The same is meant by ``name (unit)`` and, for MATLAB where brackets cannot stand
in a name, by ``name_unit`` or by ``name_unit_``, which MATLAB itself makes of the contract's header.
"""

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from heli_identifier.errors import LogError
from heli_identifier.records.format import LogFormat
from heli_identifier.records.units import SIGNALS, factor_to_si, header, known_units

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


def split_header(text: str) -> tuple[str, str | None]:
    """Split a header into name and unit; the unit is None where the header states none."""
    found = _BRACKETED.match(text.strip()) or _UNDERSCORED.match(text.strip())
    return (found["name"].strip(), found["unit"].strip()) if found else (text.strip(), None)


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
        If a signal is missing or stands there twice, or its unit is missing or unknown.
    """
    names = [split_header(text)[0] for text in headers]
    places = {
        signal: [
            index
            for index, text in enumerate(headers)
            if (text == format.columns[signal] if signal in format.columns else names[index] == signal)
        ]
        for signal in SIGNALS
    }
    missing = [format.columns.get(signal, header(signal)) for signal in SIGNALS if not places[signal]]
    if missing:
        raise LogError(_missing(file, missing, headers))
    for signal, found in places.items():
        if len(found) > 1:
            both = ", ".join(repr(headers[index]) for index in found)
            raise LogError(
                f"{file}: {signal} stands in {len(found)} columns ({both}); keep one, or name it under "
                "[log.columns] in the rig's configuration."
            )
    found_at = {signal: place[0] for signal, place in places.items()}
    units = {signal: format.units.get(signal) or split_header(headers[found_at[signal]])[1] for signal in SIGNALS}
    unknown = [signal for signal in SIGNALS if units[signal] not in known_units(signal)]
    if unknown:
        raise LogError(_unknown_units(file, {signal: (headers[found_at[signal]], units[signal]) for signal in unknown}))
    return tuple(
        Column(signal, found_at[signal], unit, factor_to_si(signal, unit, format.counts_per_turn(signal)))
        for signal, unit in units.items()
        if unit is not None
    )


def _missing(file: str, missing: Sequence[str], headers: Sequence[str]) -> str:
    near = {wanted: difflib.get_close_matches(wanted, headers, n=1, cutoff=0.7) for wanted in missing}
    hints = [f"is {found[0]!r} meant for {wanted!r}" for wanted, found in near.items() if found]
    return (
        f"{file}: column{'s' if len(missing) > 1 else ''} {', '.join(map(repr, missing))} missing, found "
        f"{', '.join(map(repr, headers))}"
        + (f" ({'; '.join(hints)}?)" if hints else "")
        + "; rename the columns or map them under [log.columns] in the rig's configuration."
    )


def _unknown_units(file: str, columns: Mapping[str, tuple[str, str | None]]) -> str:
    """Say of all signals at once which unit they lack; ``columns`` holds header and unit of each."""
    stated = [
        f"column {text!r}: {f'unit {unit!r} is unknown' if unit else 'the unit is missing'}, "
        f"{' or '.join(known_units(signal))} is needed"
        for signal, (text, unit) in columns.items()
    ]
    heads = ", ".join(repr(header(signal)) for signal in columns)
    return (
        f"{file}, {'; '.join(stated)}; head {'it' if len(columns) == 1 else 'them'} {heads}, or set "
        f"{', '.join(columns)} under [log.units] in the rig's configuration."
    )
