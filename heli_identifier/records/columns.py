"""Which column of a file holds which signal, and in which unit.

A header reads ``name [unit]``, in any case, with blanks or hyphens in place of underscores. ``name (unit)`` means the
same, and so do ``name_unit`` and ``name_unit_`` for MATLAB, whose names hold no brackets; MATLAB itself makes
``name_unit_`` of the contract's header. A vector in a struct has its path before its name, as in ``run.pitch_rad``, and
a row of an unnamed matrix is called as MATLAB calls it: ``ans(4,:)``.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from heli_identifier.errors import HELI_TOML, LogError
from heli_identifier.records.configuration import LogFormat
from heli_identifier.records.units import (
    ANGLES,
    COMBINED,
    NAMED,
    SIGNALS,
    VOLTAGES,
    factor_to_si,
    header,
    probably,
    understood,
)
from heli_plant.errors import did_you_mean

_BRACKETED = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]$")
_UNDERSCORED = re.compile(rf"^(?P<name>{'|'.join(NAMED)})_(?P<unit>[A-Za-z]+)_?$", re.IGNORECASE)
_INDEX = re.compile(r"\((\d+,:|:,\d+)\)$")
_LISTED = 20  # headers that a message shows of a file that has hundreds


@dataclass(frozen=True)
class Column:
    """Place and meaning of one signal: which column of the file, its unit there, and the factor to SI without sign."""

    signal: str
    index: int
    unit: str
    factor: float


def find_columns(headers: Sequence[str], format: LogFormat, file: str) -> tuple[Column, ...]:
    """Find the six signals among the headers of a file.

    Returns
    -------
    tuple[Column, ...]
        One per signal, in the contract's order, or with sum and difference in place of the two voltages.

    Raises
    ------
    LogError
        If a signal has no column or several, two signals have the same one, or a unit is missing or unknown.
    """
    places = {signal: _places(signal, headers, format) for signal in NAMED}
    summed = any(signal in format.columns for signal in COMBINED) or (
        all(places[signal] for signal in COMBINED) and not any(places[signal] for signal in VOLTAGES)
    )
    wanted = ("time", *(COMBINED if summed else VOLTAGES), *ANGLES)
    missing = [format.columns.get(signal, header(signal)) for signal in wanted if not places[signal]]
    if missing:
        taken = {index for signal in wanted for index in places[signal]}
        raise LogError(_missing(file, missing, headers, [h for i, h in enumerate(headers) if i not in taken]))
    owner: dict[int, str] = {}
    for signal in wanted:
        index, *others = places[signal]
        if others:
            both = ", ".join(repr(headers[place]) for place in places[signal])
            raise LogError(
                f"{file}: {signal} stands in {len(others) + 1} columns ({both}); keep one, or name it under "
                f"[log.columns] of {HELI_TOML}."
            )
        if index in owner:
            raise LogError(
                f"{file}: column {headers[index]!r} is taken for {owner[index]} and for {signal}; name the "
                f"column of each under [log.columns] of {HELI_TOML}."
            )
        owner[index] = signal
    columns, unknown = [], {}
    for index, signal in owner.items():
        stated = format.units.get(signal) or name_and_unit(headers[index])[1]
        unit = understood(signal, stated) if stated is not None else None
        if unit is None:
            said = f"unit {stated!r} is unknown" if stated else "the unit is missing"
            unknown[signal] = f"column {headers[index]!r}: {said}, {probably(signal, stated or '')}"
        else:
            columns.append(Column(signal, index, unit, factor_to_si(signal, unit, format.counts_per_turn(signal))))
    if unknown:
        raise LogError(
            f"{file}, {'; '.join(unknown.values())}; set {', '.join(unknown)} under [log.units] of {HELI_TOML} to the "
            f"unit in which the file holds {'it' if len(unknown) == 1 else 'them'}."
        )
    return tuple(columns)


def find_references(headers: Sequence[str], format: LogFormat, file: str) -> tuple[Column, ...]:
    """Find the columns of what the pilot asked of an axis.

    Returns
    -------
    tuple[Column, ...]
        One for each axis that has a reference; unit and factor are the axis's where the header states no unit, and the
        factor has the axis's sign.

    Raises
    ------
    LogError
        If a column that the configuration names is missing, or its unit is missing or unknown.
    """
    found = []
    for axis in ANGLES:
        named = format.references.get(axis, f"{axis}_reference")
        places = _called(named, headers)
        stated = name_and_unit(headers[places[0]])[1] if places else None
        unit = understood(axis, stated or format.units.get(axis, "")) if places else None
        if axis in format.references and len(places) != 1:
            raise LogError(
                f"{file}: {len(places)} columns are called {named!r}, which [log.references] of {HELI_TOML} names for "
                f"the {axis}; the file has {', '.join(map(repr, headers))}."
            )
        if axis in format.references and unit is None:
            raise LogError(
                f"{file}: the unit of {headers[places[0]]!r} is missing or unknown; state the unit of the {axis} under "
                f"[log.units] of {HELI_TOML}."
            )
        if unit is not None and len(places) == 1:
            factor = factor_to_si(axis, unit, format.counts_per_turn(axis))
            found.append(Column(axis, places[0], unit, factor * format.sign(axis)))
    return tuple(found)


def name_and_unit(text: str) -> tuple[str, str | None]:
    """Split a header into the name, without the path of a struct, and the unit; None where it states none."""
    last = text.strip()
    if _INDEX.search(last):
        return last, None
    if found := _BRACKETED.match(last):
        return found["name"].strip(), found["unit"].strip()
    last = last.rpartition(".")[2] or last
    found = _UNDERSCORED.match(last)
    if found and understood(found["name"].lower(), found["unit"]):
        return found["name"], found["unit"]
    return last, None


def _places(signal: str, headers: Sequence[str], format: LogFormat) -> list[int]:
    """Columns of a signal: those of the name that the configuration states, else those that are called like it."""
    if signal not in format.columns:
        return [i for i, text in enumerate(headers) if _plain(name_and_unit(text)[0]) == signal]
    return _called(format.columns[signal].strip(), headers)


def _called(name: str, headers: Sequence[str]) -> list[int]:
    """Columns of a name: to the letter, without its unit, then in any case and with blanks for underscores."""
    for alike in (
        lambda text: text == name,
        lambda text: name_and_unit(text)[0] == name,
        lambda text: _plain(text) == _plain(name),
        lambda text: _plain(name_and_unit(text)[0]) == _plain(name),
    ):
        if found := [index for index, text in enumerate(headers) if alike(text)]:
            return found
    return []


def _plain(name: str) -> str:
    return re.sub(r"[\s-]+", "_", name.strip().rpartition(".")[2].lower())


def _missing(file: str, missing: Sequence[str], headers: Sequence[str], unused: Sequence[str]) -> str:
    columns, them = ("column", "it") if len(missing) == 1 else ("columns", "them")
    proposal = (did_you_mean(missing[0], unused) if len(missing) == 1 else "") or "."
    if len(missing) == len(SIGNALS):
        proposal = f"; `heli init {file}` looks into the log and writes one."
    shown = ", ".join(repr(text[:60]) for text in headers[:_LISTED])
    more = f" and {len(headers) - _LISTED} more" if len(headers) > _LISTED else ""
    return (
        f"{file}: {columns} {', '.join(map(repr, missing))} missing, found {shown}{more}; rename the {columns} or map "
        f"{them} under [log.columns] of {HELI_TOML}{proposal}"
    )
