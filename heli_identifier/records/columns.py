"""The columns of a file: their cells as numbers, and which column holds which signal in which unit.

A header reads ``name [unit]``, in any case, with blanks or hyphens in place of underscores. ``name (unit)`` means the
same, and so do ``name_unit`` and ``name_unit_`` for MATLAB, whose names hold no brackets; MATLAB itself makes
``name_unit_`` of the contract's header. A vector in a struct has its path before its name, as in ``run.pitch_rad``, and
a row of an unnamed matrix is called as MATLAB calls it: ``ans(4,:)``.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import HELI_TOML, LogError
from heli_plant.errors import did_you_mean

from .configuration import LogFormat
from .units import ANGLES, COMBINED, NAMED, REFERENCES, STAMP, VOLTAGES, factor_to_si, guess_unit, header, parse_unit

Array = NDArray[np.float64]

_LONGEST = 60  # characters of a cell that a message shows
_WHOLE = 1e-6  # what a whole number may be off, as a print or an interpolation leaves it
DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?")
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


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of one file."""

    file: str  # as messages name it
    headers: tuple[str, ...]
    columns: tuple[NDArray[Any], ...]  # shape (N,) each; of type object where a cell is not a number
    first_row: int = 1  # of the first sample as an editor counts: 2 below a header line, 1 in a MATLAB array
    notes: tuple[str, ...] = ()  # what was left out of the file, or cannot be known of it

    def numbers(self, column: Column, kept: slice) -> Array:
        """Give the kept cells of a signal in SI units, shape (N,), with the file's sign.

        A LogError names the first cell that is empty, not a number or not finite, and counts that are not whole.
        """
        header, values = repr(self.headers[column.index]), self.values(column)[kept]
        broken = ~np.isfinite(values)
        if broken.any():
            sample = kept.start + int(broken.argmax())
            text = str(self.columns[column.index][sample]).strip()
            what, advice = "the cell is empty or NaN", "correct the cell, or cut the stretch away with --from and --to"
            if text not in ("", "nan", "NaT"):  # NaN is what stands for an empty cell
                shown = repr(text if len(text) <= _LONGEST else f"{text[:_LONGEST]}...")
                wanted = "no time stamp like 2026-03-01T12:00:00.010" if column.unit == STAMP else "not a finite number"
                what = f"the cell holds {shown}, which is {wanted}"
            if DECIMAL_COMMA.fullmatch(text):
                advice = f"set decimal = ',' under [log] of {HELI_TOML}; if it is set, write all numbers with one mark"
            raise LogError(f"{self.file}, row {self.first_row + sample}, column {header}: {what}; {advice}.")
        counts = values / column.factor
        if column.unit == "counts" and (off := np.abs(counts - np.round(counts)) > _WHOLE).mean() > 0.5:
            raise LogError(
                f"{self.file}, column {header}: counts are whole numbers, and most of these are not, "
                f"{counts[off.argmax()]:.12g} for one; state another unit under [log.units] of {HELI_TOML}."
            )
        return values

    def values(self, column: Column) -> Array:
        """Give all cells of a signal in SI units, shape (N,), with NaN where a cell holds no number and no instant."""
        cells = self.columns[column.index]
        if column.unit == STAMP:
            return read_stamps(cells)
        if cells.dtype.kind != "f":
            import pandas

            cells = pandas.to_numeric(pandas.Series(cells).astype(str), errors="coerce").to_numpy(dtype=float)
        return cells * column.factor


def as_numbers(values: Any) -> NDArray[Any]:
    """Give integers and floats as float, instants as they are, everything else as objects."""
    array = np.asarray(values)
    if array.dtype.kind == "M":
        return array
    return array.astype(float, copy=False) if array.dtype.kind in "iuf" else array.astype(object)


def read_stamps(cells: NDArray[Any]) -> Array:
    """Give time stamps as seconds since the first one, shape (N,); NaN where a cell is none."""
    import pandas

    found = pandas.Series(cells)
    if cells.dtype.kind != "M":
        texts = found.astype(str).str.strip()
        for day in ("", "2000-01-01T"):  # the second one before an hour of the day alone
            found = pandas.to_datetime(day + texts, format="ISO8601", errors="coerce", utc=True)
            if found.notna().any():
                break
    return (found - found.bfill().iloc[:1].min()).dt.total_seconds().to_numpy(dtype=float)


def find_columns(table: Table, format: LogFormat) -> list[Column]:
    """Find the six signals and the references among the columns of a file.

    The signals come in the contract's order, or with sum and difference in place of the two voltages; then the axes
    that have a reference, whose unit is the axis's where its header states none. A LogError says that a signal has no
    column or several, that two have the same one, that a unit is missing or unknown, or that columns differ in length,
    as only vectors of MATLAB can.
    """
    file, headers = table.file, table.headers
    named = {**format.columns, **{f"{axis}_reference": name for axis, name in format.references.items()}}
    places = {signal: _find_places(signal, named.get(signal), headers) for signal in (*NAMED, *REFERENCES)}
    summed = any(signal in named for signal in COMBINED) or (
        all(places[signal] for signal in COMBINED) and not any(places[signal] for signal in VOLTAGES)
    )
    wanted = ["time", *(COMBINED if summed else VOLTAGES), *ANGLES, *(axis for axis in REFERENCES if axis in named)]
    if missing := [signal for signal in wanted if not places[signal]]:
        raise LogError(_say_missing(file, missing, named, headers, {i for signal in wanted for i in places[signal]}))
    columns, unknown = list[Column](), dict[str, str]()
    for signal in (*wanted, *(axis for axis in REFERENCES if axis not in named and len(places[axis]) == 1)):
        index, axis = places[signal][0], signal.removesuffix("_reference")
        problem = ""
        if len(places[signal]) > 1:
            both = ", ".join(repr(headers[place]) for place in places[signal])
            problem = f"{signal} stands in {len(places[signal])} columns ({both}); keep one, or name it"
        elif owner := next((column.signal for column in columns if column.index == index), None):
            problem = f"column {headers[index]!r} is taken for {owner} and for {signal}; name the column of each"
        if problem:
            raise LogError(f"{file}: {problem} under [log.columns] of {HELI_TOML}.")
        stated = format.units.get(signal) or name_and_unit(headers[index])[1]
        if stated is None:
            cells = table.columns[index]
            is_stamp = signal == "time" and cells.dtype.kind in "OM" and np.isfinite(read_stamps(cells[:1])).any()
            stated = STAMP if is_stamp else format.units.get(axis)
        if unit := parse_unit(signal, stated or ""):
            columns.append(Column(signal, index, unit, factor_to_si(signal, unit, format.counts_per_turn(axis))))
        elif signal in wanted:
            said = f"unit {stated!r} is unknown" if stated else "the unit is missing"
            unknown[axis] = f"column {headers[index]!r}: {said}, {guess_unit(signal, stated or '')}"
    if unknown:
        raise LogError(
            f"{file}, {'; '.join(unknown.values())}; set {', '.join(unknown)} under [log.units] of {HELI_TOML} to the "
            f"unit in which the file holds {'it' if len(unknown) == 1 else 'them'}."
        )
    (time, count), *others = ((repr(headers[column.index]), len(table.columns[column.index])) for column in columns)
    for text, length in others:
        if length != count:
            raise LogError(f"{file}: {text} has {length} samples, {time} has {count}; save vectors of one length.")
    return columns


def _find_places(signal: str, name: str | None, headers: Sequence[str]) -> list[int]:
    """Find the columns of the name that a configuration states, to the letter or else alike; by default the signal's.

    Names are alike but for their units, in any case, and with blanks or hyphens for underscores.
    """
    wanted = signal if name is None else name
    exact = [index for index, text in enumerate(headers) if name is not None and text == name.strip()]
    return exact or [index for index, text in enumerate(headers) if plain_name(text) == plain_name(wanted)]


def _say_missing(
    file: str, missing: Sequence[str], named: Mapping[str, str], headers: Sequence[str], taken: set[int]
) -> str:
    """Say which columns of the wanted signals are missing, what was found in their place, and the way out."""
    texts = [named.get(signal, header(signal)) for signal in missing]
    columns, them = ("column", "it") if len(missing) == 1 else ("columns", "them")
    section = "[log.references]" if missing[0] in REFERENCES else "[log.columns]"
    unused = [text for index, text in enumerate(headers) if index not in taken]
    proposal = (did_you_mean(texts[0], unused) if len(missing) == 1 else "") or "."
    if not taken:
        proposal = f"; `heli init {file}` looks into the log and writes one."
    shown = ", ".join(repr(text[:60]) for text in headers[:_LISTED])
    more = f" and {len(headers) - _LISTED} more" if len(headers) > _LISTED else ""
    return (
        f"{file}: {columns} {', '.join(map(repr, texts))} missing, found {shown}{more}; rename the {columns} or map "
        f"{them} under {section} of {HELI_TOML}{proposal}"
    )


def name_and_unit(text: str) -> tuple[str, str | None]:
    """Split a header into the name, without the path of a struct, and the unit; None where it states none."""
    whole = text.strip()
    last = whole.rpartition(".")[2] or whole
    if _INDEX.search(whole):
        return whole, None
    if found := _BRACKETED.match(whole):
        return found["name"].strip(), found["unit"].strip()
    if (found := _UNDERSCORED.match(last)) and parse_unit(found["name"].lower(), found["unit"]):
        return found["name"], found["unit"]
    return last, None


def plain_name(text: str) -> str:
    """Give the name in a header, without the path of a struct, in small letters, with underscores for blanks."""
    return re.sub(r"[\s-]+", "_", name_and_unit(text)[0].strip().rpartition(".")[2].lower())
