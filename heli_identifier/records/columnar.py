"""Binary formats that hold named columns: Parquet, TDMS of LabVIEW, MF4 and MDF of measurement systems, and Excel.

Units that such a file states beside a name are written behind it in brackets, as in a header. Of a workbook the first
sheet that holds a table is read; its rows are laid out like the lines of a text file, so they are read as such.
"""

import csv
import io
from datetime import date, datetime, time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.archives import check_size, check_zip
from heli_identifier.errors import LogError
from heli_identifier.records.table import Table, as_numbers, table_of
from heli_identifier.records.text import read_text

_BATCH = 100_000
"""Rows of a Parquet file that are held besides the columns."""

_Columns = dict[str, NDArray[Any]]


def read_parquet(library: Any, path: Path, file: str, mapped: frozenset[str]) -> Table:
    """Read a Parquet file, filled batch by batch; columns that hold no numbers are objects."""
    with library.ParquetFile(path, pre_buffer=False) as source:
        schema, rows = source.schema_arrow, source.metadata.num_rows
        check_size(8 * rows * len(schema.names), path.stat().st_size)  # runs of equal values take no room in the file
    if len({*schema.names}) < len(schema.names):
        raise ValueError("two of its columns have the same name")
    texts = [field.name for field in schema if str(field.type) in ("string", "large_string")]
    found: _Columns = {}
    begin = 0
    with library.ParquetFile(path, pre_buffer=False, read_dictionary=texts) as source:
        for batch in source.iter_batches(_BATCH, use_threads=False):
            for name in schema.names:
                values = _of_arrow(batch.column(name))
                if name not in found:
                    found[name] = np.empty(rows, values.dtype)
                elif found[name].dtype != values.dtype:
                    found[name] = found[name].astype(object)
                found[name][begin : begin + len(values)] = values
            begin += len(batch)
    return _table(file, found)


def read_tdms(library: Any, path: Path, file: str, mapped: frozenset[str]) -> Table:
    """Read the channels of all groups; a time from the waveform's increment where no channel is one."""
    found: _Columns = {}
    with library.TdmsFile.open(path) as source:
        groups = [group for group in source.groups() if group.channels()]
        for group in groups:
            prefix = "" if len(groups) == 1 else f"{group.name}."
            for channel in group.channels():
                unit = str(channel.properties.get("unit_string", "")).strip()
                found[_named(prefix + channel.name, unit)] = _numbers(channel[:])
            first = group.channels()[0]
            is_timed = any("time" in channel.name.lower() for channel in group.channels())
            if not is_timed and "wf_increment" in first.properties:
                found[f"{prefix}time [s]"] = np.asarray(first.time_track(), dtype=float)
    return _table(file, found)


def read_mdf(library: Any, path: Path, file: str, mapped: frozenset[str]) -> Table:
    """Read the group with the most channels, its master as the time; an invalid sample is not a number."""
    with library.MDF(path) as source:
        groups = [list(source.virtual_groups[index].groups) for index in source.virtual_groups]
        members = max(groups, key=lambda group: sum(len(source.groups[index].channels) for index in group))
        found: _Columns = {}
        for index in members:
            for number, channel in enumerate(source.groups[index].channels):
                if number == source.masters_db.get(index):
                    continue
                if "time [s]" not in found:
                    found["time [s]"] = np.array(source.get_master(index), dtype=float)
                unit = source.get(group=index, index=number, record_offset=0, record_count=1).unit
                samples, invalid = source.get(group=index, index=number, samples_only=True)
                values = _numbers(np.array(samples))  # a copy: the samples may be a part of all records
                if invalid is not None:
                    values = np.where(np.asarray(invalid, dtype=bool), np.nan, values)
                found[_named(channel.name, unit.strip())] = values
    return _table(file, found)


def read_workbook(library: Any, path: Path, file: str, mapped: frozenset[str]) -> Table:
    """Read the first sheet of an Excel workbook that holds a table."""
    check_zip(path)
    with path.open("rb") as stream:
        book = library.load_workbook(stream, read_only=True, data_only=True, keep_links=False)
        titles = [sheet.title for sheet in book.worksheets]
        for sheet in book.worksheets:
            text = _sheet_text(sheet)
            if text.count(b"\n") > 2:
                named = file if len(titles) == 1 else f"{file}, sheet {sheet.title!r}"
                return read_text(text, named, ".", mapped)
    raise LogError(f"{file} holds no table in any of its sheets ({', '.join(map(repr, titles))}).")


def _table(file: str, columns: _Columns) -> Table:
    if len(columns) < 2:
        raise LogError(f"{file} holds {len(columns)} columns, a log has six.")
    return table_of(file, columns)


def _of_arrow(column: Any) -> NDArray[Any]:
    """Values of a column of Arrow: floats, instants, or objects."""
    kind = str(column.type)
    if kind.startswith("dictionary"):  # a text that is repeated is held once
        places = column.indices.fill_null(len(column.dictionary)).to_numpy(zero_copy_only=False)
        return np.array([*column.dictionary.to_pylist(), None], dtype=object)[places]
    if kind.startswith("decimal"):
        column = column.cast("float64")
    elif kind.startswith(("list", "large_list", "fixed_size_list", "struct", "map")):
        return np.full(len(column), None)
    return _numbers(column.to_numpy(zero_copy_only=False))


def _numbers(values: Any) -> NDArray[Any]:
    array = np.asarray(values)
    return array if array.dtype.kind == "M" else as_numbers(array)


def _named(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit and "[" not in name else name


def _sheet_text(sheet: Any) -> bytes:
    """Give a sheet as text: digits that make the same numbers again, separated by tabs."""
    out = io.StringIO()
    rows = csv.writer(out, delimiter="\t", lineterminator="\n")
    for row in sheet.iter_rows(values_only=True):
        rows.writerow([_cell(value) for value in row])
    return (out.getvalue().rstrip() + "\n").encode()


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, date | datetime | time):
        return value.isoformat()
    return repr(value) if isinstance(value, float) else str(value)
