"""Which column of a file holds which signal, and in which unit.

A header reads ``name [unit]``, in any case, with blanks or hyphens in place of underscores. ``name (unit)`` means the
same, and so do ``name_unit`` and ``name_unit_`` for MATLAB, whose names hold no brackets; MATLAB itself makes
``name_unit_`` of the contract's header. A vector in a struct has its path before its name, as in ``run.pitch_rad``, and
a row of an unnamed matrix is called as MATLAB calls it: ``ans(4,:)``.
"""

import re
from collections.abc import Sequence

from heli_identifier.errors import HELI_TOML, LogError
from heli_identifier.records.configuration import LogFormat
from heli_identifier.records.table import Column, Table
from heli_identifier.records.units import (
    ANGLES,
    COMBINED,
    NAMED,
    REFERENCES,
    SIGNALS,
    STAMP,
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


def find_columns(table: Table, format: LogFormat) -> list[Column]:
    """Find the six signals and the references among the columns of a file.

    Returns
    -------
    list[Column]
        One per signal, in the contract's order, or with sum and difference in place of the two voltages; then one for
        each axis that has a reference, whose unit is the axis's where its header states none.

    Raises
    ------
    LogError
        If a signal has no column or several, two signals have the same one, a unit is missing or unknown, or the
        columns differ in length, as only vectors of MATLAB can.
    """
    file, headers = table.file, table.headers
    named = {**format.columns, **{f"{axis}_reference": name for axis, name in format.references.items()}}
    places = {
        signal: _called(named[signal].strip(), headers) if signal in named else _alike(signal, headers)
        for signal in (*NAMED, *REFERENCES)
    }
    summed = any(signal in named for signal in COMBINED) or (
        all(places[signal] for signal in COMBINED) and not any(places[signal] for signal in VOLTAGES)
    )
    signals = ("time", *(COMBINED if summed else VOLTAGES), *ANGLES)
    wanted = (*signals, *(signal for signal in REFERENCES if signal in named))
    if missing := [signal for signal in wanted if not places[signal]]:
        taken = {index for signal in wanted for index in places[signal]}
        unused = [text for index, text in enumerate(headers) if index not in taken]
        section = "[log.columns]" if missing[0] in signals else "[log.references]"
        raise LogError(_missing(file, [named.get(one, header(one)) for one in missing], headers, unused, section))
    columns, unknown = list[Column](), dict[str, str]()
    for signal in (*wanted, *(signal for signal in REFERENCES if signal not in named and len(places[signal]) == 1)):
        index, *others = places[signal]
        if others:
            both = ", ".join(repr(headers[place]) for place in places[signal])
            raise LogError(
                f"{file}: {signal} stands in {len(others) + 1} columns ({both}); keep one, or name it under "
                f"[log.columns] of {HELI_TOML}."
            )
        if owner := next((column.signal for column in columns if column.index == index), None):
            raise LogError(
                f"{file}: column {headers[index]!r} is taken for {owner} and for {signal}; name the "
                f"column of each under [log.columns] of {HELI_TOML}."
            )
        axis = signal.removesuffix("_reference")
        stated = format.units.get(signal) or name_and_unit(headers[index])[1]
        if stated is None:
            stated = STAMP if signal == "time" and table.holds_stamps(index) else format.units.get(axis)
        unit = understood(signal, stated or "")
        if unit is not None:
            columns.append(Column(signal, index, unit, factor_to_si(signal, unit, format.counts_per_turn(axis))))
        elif signal in wanted:
            said = f"unit {stated!r} is unknown" if stated else "the unit is missing"
            unknown[axis] = f"column {headers[index]!r}: {said}, {probably(signal, stated or '')}"
    if unknown:
        raise LogError(
            f"{file}, {'; '.join(unknown.values())}; set {', '.join(unknown)} under [log.units] of {HELI_TOML} to the "
            f"unit in which the file holds {'it' if len(unknown) == 1 else 'them'}."
        )
    lengths = {headers[column.index]: len(table.columns[column.index]) for column in columns}
    (time, count), *_ = lengths.items()
    for text, length in lengths.items():
        if length != count:
            raise LogError(
                f"{file}: {text!r} has {length} samples, {time!r} has {count}; save vectors of one length."
            )
    return columns


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


def plain(name: str) -> str:
    """Give a name without the path of a struct, in small letters, with underscores for blanks and hyphens."""
    return re.sub(r"[\s-]+", "_", name.strip().rpartition(".")[2].lower())


def _alike(signal: str, headers: Sequence[str]) -> list[int]:
    return [index for index, text in enumerate(headers) if plain(name_and_unit(text)[0]) == signal]


def _called(name: str, headers: Sequence[str]) -> list[int]:
    """Columns of a name: to the letter, without its unit, then in any case and with blanks for underscores."""
    for alike in (
        lambda text: text == name,
        lambda text: name_and_unit(text)[0] == name,
        lambda text: plain(text) == plain(name),
        lambda text: plain(name_and_unit(text)[0]) == plain(name),
    ):
        if found := [index for index, text in enumerate(headers) if alike(text)]:
            return found
    return []


def _missing(
    file: str, missing: Sequence[str], headers: Sequence[str], unused: Sequence[str], section: str
) -> str:
    columns, them = ("column", "it") if len(missing) == 1 else ("columns", "them")
    proposal = (did_you_mean(missing[0], unused) if len(missing) == 1 else "") or "."
    if len(missing) == len(SIGNALS):
        proposal = f"; `heli init {file}` looks into the log and writes one."
    shown = ", ".join(repr(text[:60]) for text in headers[:_LISTED])
    more = f" and {len(headers) - _LISTED} more" if len(headers) > _LISTED else ""
    return (
        f"{file}: {columns} {', '.join(map(repr, missing))} missing, found {shown}{more}; rename the {columns} or map "
        f"{them} under {section} of {HELI_TOML}{proposal}"
    )
