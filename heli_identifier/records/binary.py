"""Read binary formats: MATLAB, Parquet, TDMS of LabVIEW, MF4 and MDF of measurement systems, and Excel.

If a file states the unit of a signal, it is added to the name in brackets, as in a header. Of a workbook the sheet with
the most rows is read, and its rows are treated like the lines of a text file.

| in a MATLAB file | column |
|---|---|
| vector ``pitch_rad``, column or row | ``pitch_rad`` |
| the same in a struct ``run``, to any depth | ``run.pitch_rad`` |
| matrix ``ans`` with a signal in each row, as Simulink's To File and QUARC write it | ``ans(1,:)``, ``ans(2,:)``, ... |
| matrix ``log`` with a signal in each column | ``log(:,1)``, ... |
| element i of an array of structs | ``run(i).pitch_rad`` |
| struct with a ``label`` and ``values``, as in Simulink's structure with time | ``simout.signals(i).<label>`` |
| struct with a ``Name`` and ``Data``, as dSPACE writes it | ``run.Y(i).<Name>`` |
| table or timetable | ``run.<variable>`` |

Files of version 7.3 (HDF5) and objects (tables) are read by mat-io.

A damaged file can make the library that reads it crash (such as scipy's reader of MATLAB files), run for ever, or ask
for all memory: zeros compress to a thousandth. So a separate process with limits reads it and returns the table.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import LogError
from heli_identifier.files import check_zip, draft_folder
from heli_identifier.processes import NoAnswer, call_apart

from .columns import Table, make_table, with_unit
from .text import read_text

LARGEST_MB = 1000.0
"""Size up to which a file is read, and unpacked [MB]."""

PATIENCE, PATIENCE_PER_MB, MEMORY = 30.0, 3.0, 8_000_000_000
"""Longest time that a reader may take [s], and its growth with the size of the file [s/MB]: some 30 times what readers
need, because a busy machine or a slow disk is no defect. Memory that the reader may take beyond that of its process
[bytes]; not limited on Windows."""

_MOST_SIGNALS = 200  # in a matrix; a matrix with more rows and more columns is no log
_FEWEST_SAMPLES = 100  # in a matrix; one with fewer rows and fewer columns holds gains or the like

_Columns = dict[str, NDArray[Any]]


def read_binary(data: bytes, ending: str, file: str) -> Table:
    """Read the bytes of a file with one of the endings of `READERS`; a LogError calls an unreadable one ``file``."""
    with draft_folder() as folder:
        copy = folder / f"log{ending}"
        copy.write_bytes(data)
        patience = PATIENCE + PATIENCE_PER_MB * 1e-6 * len(data)
        try:
            return call_apart(folder, _read, copy, file, error=LogError, patience=patience, memory=MEMORY)
        except NoAnswer as end:
            raise LogError(f"{file} is not readable: its reader {': '.join(end.args)}; save it again.") from end


def _read(path: Path, file: str) -> Table:
    kind, package, read = READERS[path.suffix]
    try:
        content = read(path, file)
    except (LogError, MemoryError):
        raise
    except ImportError as error:
        advice = f"the package {package} is needed to read it: `pip install 'heli-twin[formats]'`"
        raise LogError(f"{file} is {kind}; {advice}.") from error
    except Exception as error:  # parsers raise errors of any type on a damaged file
        reason = str(error).replace(str(path), file).strip().splitlines() or [type(error).__name__]
        raise LogError(f"{file} is not readable as {kind} ({reason[0][:200]}); save it again.") from error
    if isinstance(content, Table):
        return content
    return make_table(file, [*content], content.values())


def _read_parquet(path: Path, file: str) -> _Columns:
    from pyarrow.parquet import ParquetFile

    with ParquetFile(path) as source:
        size = 8e-6 * source.metadata.num_rows * source.metadata.num_columns  # it may be compressed to almost nothing
        if size > LARGEST_MB:
            problem = f"it has {size:.4g} MB unpacked, more than {LARGEST_MB:g} MB"
            raise LogError(f"{file} cannot be read: {problem}; cut it.")
        table = source.read(use_threads=False)
    return {name: table[name].to_pandas().to_numpy() for name in table.schema.names}


def _read_tdms(path: Path, file: str) -> _Columns:
    """Read the channels of all groups, and a time from the waveform's increment if no channel is one."""
    from nptdms import TdmsFile

    columns: _Columns = {}
    with TdmsFile.open(path) as source:
        for group in source.groups():
            channels = group.channels()
            for channel in channels:
                unit = str(channel.properties.get("unit_string", ""))
                columns[with_unit(f"{group.name}.{channel.name}", unit)] = channel[:]
            is_timed = any("time" in channel.name.lower() for channel in channels)
            if channels and not is_timed and "wf_increment" in channels[0].properties:
                columns[f"{group.name}.time [s]"] = channels[0].time_track()
    return columns


def _read_mdf(path: Path, file: str) -> _Columns:
    """Read the group with the most channels, its master channel as the time; invalid samples become NaN."""
    import asammdf

    columns: _Columns = {}
    with asammdf.MDF(path) as source:
        groups = [group.groups for group in source.virtual_groups.values()]
        for index in max(groups, key=lambda group: sum(len(source.groups[member].channels) for member in group)):
            for number in range(len(source.groups[index].channels)):
                if number == source.masters_db.get(index):
                    continue
                signal = source.get(group=index, index=number, ignore_invalidation_bits=True)
                values, invalid = signal.samples, signal.invalidation_bits
                columns.setdefault("time [s]", signal.timestamps)
                columns[with_unit(signal.name, signal.unit)] = (
                    values if invalid is None else np.where(np.asarray(invalid, dtype=bool), np.nan, values)
                )
    return columns


def _read_workbook(path: Path, file: str) -> Table:
    """Read the sheet of an Excel workbook that has the most rows."""
    import pandas

    check_zip(path)
    with path.open("rb") as stream:
        sheets = pandas.read_excel(
            stream, sheet_name=None, header=None, dtype=object, na_filter=False, engine="openpyxl"
        )
    title, frame = max(sheets.items(), key=lambda sheet: len(sheet[1]))
    if len(frame) < 3:
        raise LogError(f"{file} holds no table in any of its sheets ({', '.join(map(repr, sheets))}).")
    table = read_text(frame.to_csv(sep="\t", header=False, index=False).encode(), file)
    return table if len(sheets) == 1 else replace(table, notes=(f"sheet {title!r} is read", *table.notes))


def _read_matlab(path: Path, file: str) -> _Columns:
    """Read a MATLAB file by scipy.io, or by mat-io if it is needed; the vectors may differ in length."""
    from scipy.io import loadmat

    try:
        variables = loadmat(path, squeeze_me=True, appendmat=False)
        is_plain = "__function_workspace__" not in variables  # where objects are
    except NotImplementedError:  # scipy's answer to HDF5
        is_plain = False
    if not is_plain:
        from matio import load_from_mat

        variables = load_from_mat(str(path))
    variables = {str(name): value for name, value in variables.items() if not str(name).startswith("__")}
    vectors = {path: values for name, value in variables.items() for path, values in _find_vectors(name, value)}
    if not vectors:
        raise LogError(
            f"{file} holds no vector of numbers, found {', '.join(variables) or 'nothing'}; save "
            "time_s, v_front_V, v_rear_V, pitch_rad, elevation_rad and travel_rad as vectors or as fields of a struct "
            "(table2struct with ToScalar makes one of a table, struct(ts) one of a timeseries)."
        )
    return vectors


def _find_vectors(name: str, value: Any) -> Iterator[tuple[str, NDArray[Any]]]:
    """Return the columns of a variable, each with its name."""
    if hasattr(value, "columns") and hasattr(value, "index"):  # a table, which mat-io reads as a data frame
        value = {"time": value.index.to_series(), **value} if value.index.dtype.kind == "m" else dict(value.items())
    properties = getattr(value, "properties", None)
    if isinstance(properties, dict) and properties:  # an object, such as a timeseries with its Time and Data
        value = properties
    structs = _list_structs(value)
    for index, struct in enumerate(structs[:_MOST_SIGNALS], start=1):
        path = name if len(structs) == 1 else f"{name}({index})"
        if label := str(np.squeeze(struct.get("label", struct.get("Name", "")))).strip("[]'\" "):
            path = f"{path}.{label}"
        for field, content in struct.items():
            is_signal = label and field in ("values", "Data")
            yield from _find_vectors(path if is_signal else f"{path}.{field}", content)
    array = np.squeeze(np.asarray(value))
    kind, shape = array.dtype.kind, array.shape
    if kind in "iufcb" and array.ndim == 1 and array.size > 1:
        yield name, array
    elif kind == "m" and array.ndim == 1:
        yield f"{name}_s", array / np.timedelta64(1, "s")
    elif kind in "iuf" and array.ndim == 2 and min(shape) <= _MOST_SIGNALS and max(shape) >= _FEWEST_SAMPLES:
        in_rows = shape[0] < shape[1]
        for index, signal in enumerate(array if in_rows else array.T, start=1):
            yield f"{name}({index},:)" if in_rows else f"{name}(:,{index})", signal


def _list_structs(value: Any) -> list[dict[str, Any]]:
    """Return a struct, or each of an array of structs, as a dictionary of its fields; nothing for other values."""
    if isinstance(value, dict):
        return [value]
    array = np.squeeze(np.asarray(value))
    if array.ndim == 0 and isinstance(array.item(), np.ndarray | dict):
        return _list_structs(array.item())
    names = array.dtype.names or ()
    return [dict(zip(names, row, strict=True)) for row in np.atleast_1d(array).ravel()] if names else []


READERS: dict[str, tuple[str, str, Callable[[Path, str], _Columns | Table]]] = {
    ".mat": ("a MATLAB file", "mat-io", _read_matlab),
    ".xlsx": ("an Excel workbook", "openpyxl", _read_workbook),
    ".parquet": ("a Parquet file", "pyarrow", _read_parquet),
    ".tdms": ("a TDMS file", "npTDMS", _read_tdms),
    ".mf4": ("an MDF file", "asammdf", _read_mdf),
    ".mdf": ("an MDF file", "asammdf", _read_mdf),
}
"""For each ending of a file name: the kind of file, the package that reads it, and the function that reads it."""
