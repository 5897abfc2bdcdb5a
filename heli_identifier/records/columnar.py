"""Binary formats that hold named columns: Parquet, TDMS of LabVIEW, MF4 and MDF of measurement systems.

Units that such a file states beside a name are written behind it in brackets, as in a header.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.archives import check_size
from heli_identifier.errors import LogError
from heli_identifier.records.apart import check_survives
from heli_identifier.records.table import Table, as_numbers, needed

_TRIED_BY_OTHERS = (".parquet",)
"""Endings whose reader needs no process of its own: Arrow's is fuzzed all the time, and its threads survive no fork."""

_BATCH = 100_000
"""Rows of a Parquet file that are held besides the columns."""

_Columns = dict[str, NDArray[Any]]


def read_columnar(path: Path, file: str) -> Table:
    """Read a file by its ending.

    Parameters
    ----------
    path : Path
        Where it is.
    file : str
        Name of the file for messages.

    Raises
    ------
    LogError
        It is not of its format, holds no columns, or the package that reads it is not installed.
    """
    what, module, package, read = FORMATS[path.suffix.lower()]
    library = needed(module, package, "formats", file, what)
    if path.suffix.lower() not in _TRIED_BY_OTHERS:
        check_survives(lambda: read(library, path), path.stat().st_size, file)
    try:
        columns = read(library, path)
    except Exception as error:  # each library raises what its parser does on a damaged file
        said = str(error).replace(str(path), file).strip().splitlines() or [type(error).__name__]
        raise LogError(f"{file} is not readable as {what} ({said[0][:200]}); save it again.") from error
    if len(columns) < 2:
        raise LogError(f"{file} holds {len(columns)} columns, a log has six.")
    values = tuple(columns.values())
    return Table(file, tuple(columns), values, 1, lambda sample, column: str(values[column][sample]))


def _parquet(library: Any, path: Path) -> _Columns:
    """Columns, filled batch by batch; those that hold no numbers are objects."""
    with library.ParquetFile(path, pre_buffer=False) as file:
        schema, rows = file.schema_arrow, file.metadata.num_rows
        check_size(8 * rows * len(schema.names), path.stat().st_size)  # runs of equal values take no room in the file
    if len({*schema.names}) < len(schema.names):
        raise ValueError("two of its columns have the same name")
    texts = [field.name for field in schema if str(field.type) in ("string", "large_string")]
    found: _Columns = {}
    begin = 0
    with library.ParquetFile(path, pre_buffer=False, read_dictionary=texts) as file:
        for batch in file.iter_batches(_BATCH, use_threads=False):
            for name in schema.names:
                values = _of_arrow(batch.column(name))
                if name not in found:
                    found[name] = np.empty(rows, values.dtype)
                elif found[name].dtype != values.dtype:
                    found[name] = found[name].astype(object)
                found[name][begin : begin + len(values)] = values
            begin += len(batch)
    return found


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


def _tdms(library: Any, path: Path) -> _Columns:
    """Channels of all groups; a time from the waveform's increment where no channel is one."""
    found: _Columns = {}
    with library.TdmsFile.open(path) as file:
        groups = [group for group in file.groups() if group.channels()]
        for group in groups:
            for channel in group.channels():
                name = channel.name if len(groups) == 1 else f"{group.name}.{channel.name}"
                unit = str(channel.properties.get("unit_string", "")).strip()
                found[_named(name, unit)] = _numbers(channel[:])
            first = group.channels()[0]
            if not any("time" in channel.name.lower() for channel in group.channels()) and (
                "wf_increment" in first.properties
            ):
                prefix = "" if len(groups) == 1 else f"{group.name}."
                found[f"{prefix}time [s]"] = np.asarray(first.time_track(), dtype=float)
    return found


def _mdf(library: Any, path: Path) -> _Columns:
    """Channels of the group with the most of them, and its master as the time; an invalid sample is not a number."""
    with library.MDF(path) as file:
        groups = [list(file.virtual_groups[index].groups) for index in file.virtual_groups]
        members = max(groups, key=lambda group: sum(len(file.groups[index].channels) for index in group))
        found: _Columns = {}
        for index in members:
            for number, channel in enumerate(file.groups[index].channels):
                if number == file.masters_db.get(index):
                    continue
                if "time [s]" not in found:
                    found["time [s]"] = np.array(file.get_master(index), dtype=float)
                unit = file.get(group=index, index=number, record_offset=0, record_count=1).unit
                samples, invalid = file.get(group=index, index=number, samples_only=True)
                values = _numbers(np.array(samples))  # a copy: the samples may be a part of all records
                if invalid is not None:
                    values = np.where(np.asarray(invalid, dtype=bool), np.nan, values)
                found[_named(channel.name, unit.strip())] = values
    return found


def _numbers(values: NDArray[Any]) -> NDArray[Any]:
    array = np.asarray(values)
    return array if array.dtype.kind == "M" else as_numbers(array)


def _named(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit and "[" not in name else name


FORMATS: dict[str, tuple[str, str, str, Callable[[Any, Path], _Columns]]] = {
    ".parquet": ("a Parquet file", "pyarrow.parquet", "pyarrow", _parquet),
    ".tdms": ("a TDMS file", "nptdms", "npTDMS", _tdms),
    ".mf4": ("an MDF file", "asammdf", "asammdf", _mdf),
    ".mdf": ("an MDF file", "asammdf", "asammdf", _mdf),
}
"""What a file of each ending is, the module and package that read it, and how."""
