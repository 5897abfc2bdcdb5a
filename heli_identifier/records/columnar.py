"""Binary formats that hold named columns: Parquet, TDMS of LabVIEW, MF4 and MDF of measurement systems.

Units that such a file states beside a name are written behind it in brackets, as in a header.
"""

import io
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import LogError
from heli_identifier.records.apart import check_survives
from heli_identifier.records.table import Table, as_numbers, needed

_TRIED_BY_OTHERS = (".parquet",)
"""Endings whose reader needs no process of its own: Arrow's is fuzzed all the time, and its threads survive no fork."""

_Columns = dict[str, NDArray[Any]]


def read_columnar(path: Path, data: bytes, file: str) -> Table:
    """Read a file by its ending.

    Raises
    ------
    LogError
        It is not of its format, holds no columns, or the package that reads it is not installed.
    """
    what, module, package, read = FORMATS[path.suffix.lower()]
    library = needed(module, package, "formats", file, what)
    if path.suffix.lower() not in _TRIED_BY_OTHERS:
        check_survives(lambda: read(library, data), len(data), file)
    try:
        columns = read(library, data)
    except Exception as error:  # each library raises what its parser does on a damaged file
        said = re.sub(r"<_io\.BytesIO[^>]*>", file, str(error)).strip().splitlines() or [type(error).__name__]
        raise LogError(f"{file} is not readable as {what} ({said[0][:200]}); save it again.") from error
    if len(columns) < 2:
        raise LogError(f"{file} holds {len(columns)} columns, a log has six.")
    values = tuple(columns.values())
    return Table(file, tuple(columns), values, 1, lambda sample, column: str(values[column][sample]))


def _parquet(library: Any, data: bytes) -> _Columns:
    table = library.read_table(io.BytesIO(data))
    return {name: _numbers(table.column(name).to_numpy()) for name in table.column_names}


def _tdms(library: Any, data: bytes) -> _Columns:
    """Channels of all groups; a time from the waveform's increment where no channel is one."""
    found: _Columns = {}
    file = library.TdmsFile.read(io.BytesIO(data))
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


def _mdf(library: Any, data: bytes) -> _Columns:
    """Channels of the group with the most of them, and its master as the time."""
    with library.MDF(io.BytesIO(data)) as file:
        groups = [list(file.virtual_groups[index].groups) for index in file.virtual_groups]
        members = max(groups, key=lambda group: sum(len(file.groups[index].channels) for index in group))
        found: _Columns = {}
        for index in members:
            for number, channel in enumerate(file.groups[index].channels):
                if number == file.masters_db.get(index):
                    continue
                signal = file.get(group=index, index=number)
                if "time [s]" not in found:
                    found["time [s]"] = np.asarray(signal.timestamps, dtype=float)
                found[_named(channel.name, signal.unit.strip())] = _numbers(signal.samples)
    return found


def _numbers(values: NDArray[Any]) -> NDArray[Any]:
    array = np.asarray(values)
    return array if array.dtype.kind == "M" else as_numbers(array)


def _named(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit and "[" not in name else name


FORMATS: dict[str, tuple[str, str, str, Callable[[Any, bytes], _Columns]]] = {
    ".parquet": ("a Parquet file", "pyarrow.parquet", "pyarrow", _parquet),
    ".tdms": ("a TDMS file", "nptdms", "npTDMS", _tdms),
    ".mf4": ("an MDF file", "asammdf", "asammdf", _mdf),
    ".mdf": ("an MDF file", "asammdf", "asammdf", _mdf),
}
"""What a file of each ending is, the module and package that read it, and how."""
