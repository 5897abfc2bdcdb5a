"""The columns of a file: their cells as numbers, and which column holds which signal in which unit.

A header reads ``name [unit]`` or ``name (unit)``, in upper or lower case, with blanks or hyphens for underscores.
MATLAB's names hold no brackets, so ``name_unit`` means the same, and ``name_unit_``, which MATLAB makes of
``name [unit]``. A vector in a struct has its path before its name, as in ``run.pitch_rad``, and a row of an unnamed
matrix has MATLAB's name for it: ``ans(4,:)``.

Time stamps of ISO 8601, such as 2026-03-01T12:00:00.010, become seconds since the first one.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import HELI_TOML, LogError
from heli_plant.errors import did_you_mean

from .configuration import LogFormat
from .units import ANGLES, COMBINED, NAMED, REFERENCES, VOLTAGES, factor_to_si, header, known_units, parse_unit

Array = NDArray[np.float64]

_LONGEST_CELL = 60  # characters of a cell that a message shows
_BRACKETED = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]$")
_UNDERSCORED = re.compile(rf"^(?P<name>{'|'.join(NAMED)})_(?P<unit>[A-Za-z]+)_?$", re.IGNORECASE)
_INDEX = re.compile(r"\((\d+,:|:,\d+)\)$")
_MOST_HEADERS = 20  # headers that a message shows, of a file that may have hundreds


@dataclass(frozen=True)
class Column:
    """The column of one signal."""

    signal: str
    index: int  # of the column in the file
    unit: str  # in the file
    factor: float  # to SI, without the sign


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of one file."""

    file: str  # as messages name it
    headers: tuple[str, ...]
    columns: tuple[NDArray[Any], ...]  # shape (N,) each; float if the cells are numbers or time stamps, else object
    first_row: int = 1  # row of the first sample as an editor counts: 2 below a header line, 1 in a MATLAB array
    notes: tuple[str, ...] = ()  # what was left out of the file

    def numbers(self, column: Column, rows: slice) -> Array:
        """Return the cells of a signal within ``rows`` in SI units, shape (N,), with the file's sign.

        A LogError names the first cell that is empty, not a number or not finite.
        """
        header, values = repr(self.headers[column.index]), self.values(column)[rows]
        invalid = ~np.isfinite(values)
        if invalid.any():
            sample = rows.start + int(invalid.argmax())
            text = str(self.columns[column.index][sample]).strip()
            cell = repr(text if len(text) <= _LONGEST_CELL else f"{text[:_LONGEST_CELL]}...")
            problem = f"the cell holds {cell}, which is not a finite number"
            if text in ("", "nan"):  # an empty cell, or one among time stamps that is none, has become NaN
                problem = "the cell is empty or NaN" + (" or no time stamp" if column.signal == "time" else "")
            advice = "correct the cell, or cut the stretch away with --from and --to"
            if column.signal == "time" and ":" in text:
                advice = "write time stamps like 2026-03-01T12:00:00.010 (ISO 8601)"
            raise LogError(f"{self.file}, row {self.first_row + sample}, column {header}: {problem}; {advice}.")
        return values

    def values(self, column: Column) -> Array:
        """Return all cells of a signal in SI units, shape (N,); NaN where a cell holds no number."""
        cells = self.columns[column.index]
        if cells.dtype.kind != "f":
            import pandas

            cells = pandas.to_numeric(pandas.Series(cells).astype(str), errors="coerce").to_numpy(dtype=float)
        return cells * column.factor


def make_table(
    file: str, headers: Sequence[str], columns: Iterable[Any], first_row: int = 1, notes: tuple[str, ...] = ()
) -> Table:
    """Make a table of columns, shape (N,) each; one of time stamps gets the unit s."""
    titles, arrays = list(headers), list[NDArray[Any]]()
    for index, values in enumerate(columns):
        array = np.asarray(values)
        if (seconds := _read_stamps(array)) is not None:
            titles[index], array = with_unit(titles[index], "s"), seconds
        arrays.append(array.astype(float if array.dtype.kind in "iuf" else object, copy=False))
    return Table(file, tuple(titles), tuple(arrays), first_row, notes)


def _read_stamps(cells: NDArray[Any]) -> Array | None:
    """Convert time stamps, shape (N,), to seconds since the first one, others to NaN; None if the first one is none."""
    first = str(cells[0]).strip() if len(cells) else ""
    if cells.dtype.kind != "M" and ":" not in first:
        return None
    import pandas

    stamps = pandas.Series(cells)
    if cells.dtype.kind != "M":
        day = "" if "-" in first else "2000-01-01T"  # completes a time of day without a date
        stamps = pandas.to_datetime(day + stamps.astype(str).str.strip(), format="ISO8601", errors="coerce", utc=True)
    seconds = (stamps - stamps.iloc[0]).dt.total_seconds().to_numpy(dtype=float)
    return seconds if np.isfinite(seconds[0]) else None


def find_columns(table: Table, format: LogFormat) -> list[Column]:
    """Find the six signals and the references among the columns of a file.

    The signals come in the order of `SIGNALS`, or with sum and difference in place of the two voltages; then the
    references in the file. A reference without a unit in its header has that of its axis. A LogError says that a signal
    has no column or several, that two signals have the same column, that a unit is missing or unknown, or that columns
    differ in length, as vectors of MATLAB can.
    """
    file, headers = table.file, table.headers
    names = {**format.columns, **{f"{axis}_reference": name for axis, name in format.references.items()}}
    places = {signal: _find_places(signal, names.get(signal), headers) for signal in (*NAMED, *REFERENCES)}
    has_sum = any(signal in names for signal in COMBINED) or (
        all(places[signal] for signal in COMBINED) and not any(places[signal] for signal in VOLTAGES)
    )
    required = ["time", *(COMBINED if has_sum else VOLTAGES), *ANGLES, *(name for name in REFERENCES if name in names)]
    if missing := [signal for signal in required if not places[signal]]:
        taken = {index for signal in required for index in places[signal]}
        raise LogError(_describe_missing(file, missing, names, headers, taken))
    columns, unknown, units = list[Column](), dict[str, str](), dict(format.units)
    for signal in (*required, *(name for name in REFERENCES if name not in names and len(places[name]) == 1)):
        index, axis = places[signal][0], signal.removesuffix("_reference")
        problem = ""
        if len(places[signal]) > 1:
            titles = [repr(headers[place]) for place in places[signal]]
            first = "" if len(set(titles)) > 1 else "give it a header of its own and "
            problem = f"{signal} stands in {len(titles)} columns ({', '.join(titles)}); keep one, or {first}name it"
        elif owner := next((column.signal for column in columns if column.index == index), None):
            problem = f"column {headers[index]!r} is taken for {owner} and for {signal}; name the column of each"
        if problem:
            raise LogError(f"{file}: {problem} under [log.columns] of {HELI_TOML}.")
        unit_text = units.get(signal) or name_and_unit(headers[index])[1] or units.get(axis)
        if unit := parse_unit(signal, unit_text or ""):
            units[signal] = unit
            columns.append(Column(signal, index, unit, factor_to_si(signal, unit, format.counts_per_turn(axis))))
        elif signal in required:
            reason = f"unit {unit_text!r} is unknown" if unit_text else "the unit is missing"
            *known, last = known_units(signal)
            unknown[axis] = f"column {headers[index]!r}: {reason}, {', '.join(known)} or {last} is needed"
    if unknown:
        raise LogError(
            f"{file}, {'; '.join(unknown.values())}; set {', '.join(unknown)} under [log.units] of {HELI_TOML} to the "
            f"unit in which the file holds {'it' if len(unknown) == 1 else 'them'}."
        )
    (time, samples), *others = ((repr(headers[column.index]), len(table.columns[column.index])) for column in columns)
    for title, length in others:
        if length != samples:
            raise LogError(f"{file}: {title} has {length} samples, {time} has {samples}; save vectors of one length.")
    return columns


def _find_places(signal: str, name: str | None, headers: Sequence[str]) -> list[int]:
    """Find the columns with the configured header, exactly or by `plain_name`; by default those with the signal's."""
    exact = [index for index, text in enumerate(headers) if name is not None and text == name.strip()]
    plain = plain_name(signal if name is None else name)
    return exact or [index for index, text in enumerate(headers) if plain_name(text) == plain]


def _describe_missing(
    file: str, missing: Sequence[str], names: Mapping[str, str], headers: Sequence[str], taken: set[int]
) -> str:
    """Say which columns are missing, which columns the file has, and what to do."""
    texts = [names.get(signal, header(signal)) for signal in missing]
    columns, them = ("column", "it") if len(missing) == 1 else ("columns", "them")
    section = "[log.references]" if missing[0] in REFERENCES else "[log.columns]"
    unused = [text for index, text in enumerate(headers) if index not in taken]
    proposal = f"; `heli init {file}` looks into the log and writes one."
    if len(missing) == 1:
        proposal = did_you_mean(texts[0], unused) or "."
    listed = ", ".join(repr(text[:60]) for text in headers[:_MOST_HEADERS])
    more = f" and {len(headers) - _MOST_HEADERS} more" if len(headers) > _MOST_HEADERS else ""
    return (
        f"{file}: {columns} {', '.join(map(repr, texts))} missing, found {listed}{more}; rename the {columns} or map "
        f"{them} under {section} of {HELI_TOML}{proposal}"
    )


def with_unit(name: str, unit: str) -> str:
    """Append the unit that a file states beside a name, if there is one and the name holds none."""
    return f"{name} [{unit.strip()}]" if unit.strip() and "[" not in name else name


def name_and_unit(text: str) -> tuple[str, str | None]:
    """Split a header into the name and the unit; without a unit give None and drop the path of a struct."""
    text = text.strip()
    last = text.rpartition(".")[2] or text
    if _INDEX.search(text):
        return text, None
    if match := _BRACKETED.match(text):
        return match["name"].strip(), match["unit"].strip()
    if (match := _UNDERSCORED.match(last)) and parse_unit(match["name"].lower(), match["unit"]):
        return match["name"], match["unit"]
    return last, None


def plain_name(text: str) -> str:
    """Return the name in a header, without the path of a struct, in lower case, with underscores for blanks."""
    return re.sub(r"[\s-]+", "_", name_and_unit(text)[0].strip().rpartition(".")[2].lower())
