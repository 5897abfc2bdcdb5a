"""Binary formats: MATLAB, Parquet, TDMS of LabVIEW, MF4 and MDF of measurement systems, and Excel.

Units that such a file states beside a name are written behind it in brackets, as in a header. Of a workbook the first
sheet that holds a table is read; its rows are laid out like the lines of a text file, so they are read as such.

| in a MATLAB file | column |
|---|---|
| vector ``pitch_rad``, column or row | ``pitch_rad`` |
| the same in a struct ``run``, to any depth | ``run.pitch_rad`` |
| matrix ``ans`` with a signal in each row, as Simulink's To File and QUARC write it | ``ans(1,:)``, ``ans(2,:)``, ... |
| matrix ``log`` with a signal in each column | ``log(:,1)``, ... |
| Simulink's structure with time: ``time``, ``signals(i)`` with ``label`` | ``simout.time``, ``simout.<label>`` |
| dSPACE's structure, ``X.Data`` and ``Y(i)`` with ``Name`` and ``Data`` | ``run.X``, ``run.<Name>`` |
| table or timetable | ``run.<variable>`` |

A name in MATLAB holds no brackets; ``time_s``, ``v_front_V``, ``pitch_rad`` or ``pitch_deg`` stand for the contract's
headers, and `find_columns` splits them. Files of version 7.3 (HDF5) and objects (tables) are read by mat-io.

A damaged file can make the library that reads it crash the process (scipy's reader of MATLAB files, for one), run
without end, or ask for all memory: zeros pack to a thousandth. So a process of its own reads it, within bounds, and
hands over what it found.
"""

import faulthandler
import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import HELI_TOML, LogError
from heli_identifier.files import check_zip, draft_folder
from heli_identifier.processes import bound_memory, python_command

from .columns import Table, as_numbers
from .configuration import LogFormat
from .text import read_text
from .units import with_unit

LARGER = f"; cut it, or set largest_file under [log] of {HELI_TOML}"
"""What to do with a file that is too large."""

PATIENCE, PATIENCE_PER_MB, MEMORY = 30.0, 3.0, 8_000_000_000
"""Longest time that a reader may take [s], and its growth with the size of the file [s/MB]: some 30 times what readers
need, because a machine that does other things, or a slow disk, is no defect. Memory that it may take beyond what its
process has [bytes]; Windows sets no bound."""

_MOST_ROWS = 200  # signals in a matrix; a matrix with more rows and columns is no log
_FEWEST_SAMPLES = 100  # in a matrix; one that has fewer rows and columns holds gains or the like

_Columns = dict[str, NDArray[Any]]


def read_binary(data: bytes, ending: str, file: str, format: LogFormat) -> Table:
    """Read the bytes of a file with one of the endings of `READERS`; messages call it ``file``.

    A LogError says that it is damaged, holds no table, or needs a package that is not installed.
    """
    with draft_folder() as folder:
        copy = folder / f"log{ending}"
        copy.write_bytes(data)
        return read_apart(_read, (copy, file, format), len(data), file)


def read_apart(read: Callable[..., Any], arguments: tuple[Any, ...], size: int, file: str) -> Any:
    """Call ``read`` with ``arguments`` in a process of its own, which may crash, and raise the LogError that it raises.

    A LogError names ``file``, of ``size`` [bytes], if that process gives no answer.
    """
    patience = PATIENCE + PATIENCE_PER_MB * 1e-6 * size
    command = python_command(f"from {__name__} import _answer; _answer()")
    done = subprocess.run(command, input=pickle.dumps((read, arguments, patience, MEMORY)), capture_output=True)
    if done.returncode != 0:
        most = f"{MEMORY / 1e9:g} GB of memory"
        reasons = f"its reader crashes, comes to no end within {patience:.3g} s, or asks for more than {most}"
        raise LogError(f"{file} is not readable: {reasons}; save it again.")
    answer = pickle.loads(done.stdout)
    if isinstance(answer, LogError):
        raise answer
    return answer


def _answer() -> None:
    """Read in the process apart, which ends without an answer behind its bounds; what libraries print goes nowhere."""
    read, arguments, patience, memory = pickle.load(sys.stdin.buffer)
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)
        faulthandler.dump_traceback_later(patience, exit=True)
        bound_memory(memory)
        try:
            answer = read(*arguments)
        except LogError as error:
            answer = error
        pickle.dump(answer, out, protocol=pickle.HIGHEST_PROTOCOL)


def _read(path: Path, file: str, format: LogFormat) -> Table:
    what, package, read = READERS[path.suffix]
    try:
        found = read(path, file, format)
    except (LogError, MemoryError):
        raise
    except ImportError as error:
        advice = f"the package {package} is needed to read it: `pip install 'heli-twin[formats]'`"
        raise LogError(f"{file} is {what}; {advice}.") from error
    except Exception as error:  # each library raises what its parser does on a damaged file
        said = str(error).replace(str(path), file).strip().splitlines() or [type(error).__name__]
        raise LogError(f"{file} is not readable as {what} ({said[0][:200]}); save it again.") from error
    if isinstance(found, Table):
        return found
    return Table(file, tuple(found), tuple(map(as_numbers, found.values())))


def _read_parquet(path: Path, file: str, format: LogFormat) -> _Columns:
    from pyarrow.parquet import ParquetFile

    with ParquetFile(path) as source:
        size = 8e-6 * source.metadata.num_rows * source.metadata.num_columns  # runs of equal values take no room
        if size > format.largest_file:
            unpacked = f"it has {size:.4g} MB unpacked, more than {format.largest_file:g} MB"
            raise LogError(f"{file} cannot be read: {unpacked}{LARGER}.")
        table = source.read(use_threads=False)
    return {name: table[name].to_pandas().to_numpy() for name in table.schema.names}


def _read_tdms(path: Path, file: str, format: LogFormat) -> _Columns:
    """Read the channels of all groups; a time from the waveform's increment where no channel is one."""
    from nptdms import TdmsFile

    found: _Columns = {}
    with TdmsFile.open(path) as source:
        groups = [group for group in source.groups() if group.channels()]
        for group in groups:
            prefix, channels = "" if len(groups) == 1 else f"{group.name}.", group.channels()
            for channel in channels:
                found[with_unit(prefix + channel.name, str(channel.properties.get("unit_string", "")))] = channel[:]
            is_timed = any("time" in channel.name.lower() for channel in channels)
            if not is_timed and "wf_increment" in channels[0].properties:
                found[f"{prefix}time [s]"] = channels[0].time_track()
    return found


def _read_mdf(path: Path, file: str, format: LogFormat) -> _Columns:
    """Read the group with the most channels, its master as the time; an invalid sample is not a number."""
    import asammdf

    found: _Columns = {}
    with asammdf.MDF(path) as source:
        groups = [list(source.virtual_groups[index].groups) for index in source.virtual_groups]
        members = max(groups, key=lambda group: sum(len(source.groups[index].channels) for index in group))
        for index in members:
            master = source.masters_db.get(index)
            for number in (k for k, _ in enumerate(source.groups[index].channels) if k != master):
                signal = source.get(group=index, index=number, ignore_invalidation_bits=True)
                values, invalid = as_numbers(signal.samples), signal.invalidation_bits
                if invalid is not None:
                    values = np.where(np.asarray(invalid, dtype=bool), np.nan, values)
                found.setdefault("time [s]", np.array(signal.timestamps, dtype=float))
                found[with_unit(signal.name, signal.unit)] = values
    return found


def _read_workbook(path: Path, file: str, format: LogFormat) -> Table:
    """Read the first sheet of an Excel workbook that holds a table."""
    import pandas

    check_zip(path)
    with path.open("rb") as stream:
        sheets = pandas.read_excel(
            stream, sheet_name=None, header=None, dtype=object, na_filter=False, engine="openpyxl"
        )
    for title, frame in sheets.items():
        text = frame.to_csv(sep="\t", header=False, index=False)
        if text.count("\n") > 2:
            named = file if len(sheets) == 1 else f"{file}, sheet {title!r}"
            return read_text(text.encode(), named, LogFormat(columns=format.columns))
    raise LogError(f"{file} holds no table in any of its sheets ({', '.join(map(repr, sheets))}).")


def _read_matlab(path: Path, file: str, format: LogFormat) -> _Columns:
    """Read a MATLAB file by scipy.io, or by mat-io where it has to be; its vectors may differ in length."""
    from scipy.io import loadmat

    with open(path, "rb") as stream:
        head = stream.read(516)
    hdf5 = b"\x89HDF" in (head[:4], head[512:])  # MATLAB puts a header of its own before it
    variables = {} if hdf5 else loadmat(path, squeeze_me=True, appendmat=False)
    if hdf5 or "__function_workspace__" in variables:
        from matio import load_from_mat

        variables = load_from_mat(str(path))
    named = {str(name): value for name, value in variables.items() if not str(name).startswith("__")}
    vectors = {place: values for name, value in named.items() for place, values in _vectors(name, value)}
    if not vectors:
        raise LogError(
            f"{file} holds no vector of numbers, found {', '.join(named) or 'nothing'}; save "
            "time_s, v_front_V, v_rear_V, pitch_rad, elevation_rad and travel_rad as vectors or as fields of a struct "
            "(table2struct with ToScalar makes one of a table, struct(ts) one of a timeseries)."
        )
    return vectors


def _vectors(name: str, value: Any) -> Iterator[tuple[str, NDArray[Any]]]:
    """Give the columns of a variable, each under its name."""
    if hasattr(value, "columns") and hasattr(value, "index"):  # a table, which mat-io gives as a data frame
        times = {"time": value.index.to_series()} if value.index.dtype.kind == "m" else {}
        for column, series in (times | dict(value.items())).items():
            if series.dtype.kind == "m":
                yield f"{name}.{column}_s", series.dt.total_seconds().to_numpy()
            elif series.dtype.kind in "iufb":
                yield f"{name}.{column}", series.to_numpy()
        return
    properties = getattr(value, "properties", None)
    if isinstance(properties, dict) and properties:  # an object, such as a timeseries with its Time and Data
        value = properties
    structs = _structs(value)
    for index, struct in enumerate(structs[:_MOST_ROWS], start=1):
        place = name if len(structs) == 1 else f"{name}({index})"
        for field, content in _by_labels(struct).items():
            yield from _vectors(f"{place}.{field}", content)
    array = np.squeeze(np.asarray(value))
    kind, shape = array.dtype.kind, array.shape
    if kind in "iufcb" and array.ndim == 1 and array.size > 1:
        yield name, array
    elif kind in "iuf" and array.ndim == 2 and min(shape) <= _MOST_ROWS and max(shape) >= _FEWEST_SAMPLES:
        rows = shape[0] < shape[1]
        for index, row in enumerate(array if rows else array.T, start=1):
            yield f"{name}({index},:)" if rows else f"{name}(:,{index})", row


def _structs(value: Any) -> list[dict[str, Any]]:
    """Give a struct, or an array of structs, by their fields; none of anything else."""
    if isinstance(value, dict):
        return [value]
    array = np.squeeze(np.asarray(value))
    if array.ndim == 0 and isinstance(array.item(), np.ndarray | dict):
        return _structs(array.item())
    names = array.dtype.names or ()
    return [dict(zip(names, row, strict=True)) for row in np.atleast_1d(array).ravel()] if names else []


def _by_labels(fields: dict[str, Any]) -> dict[str, Any]:
    """Fields of a structure with time, or of dSPACE's structure, by the labels of their signals; others as they are."""
    if {"time", "signals"} <= fields.keys():
        found, signals, label, content = {"time": fields["time"]}, _structs(fields["signals"]), "label", "values"
    elif {"X", "Y"} <= fields.keys():
        (x, *_), signals, label, content = _structs(fields["X"]) or [{}], _structs(fields["Y"]), "Name", "Data"
        found = {"X": x.get("Data") if x else fields["X"]}
    else:
        return fields
    if not signals or content not in signals[0]:
        return fields
    for index, signal in enumerate(signals, start=1):
        name = str(np.squeeze(signal.get(label, ""))).strip("[]'\" ") or f"signals({index})"
        found[name if name not in found else f"{name}({index})"] = signal[content]
    return found


READERS: dict[str, tuple[str, str, Callable[[Path, str, LogFormat], _Columns | Table]]] = {
    ".mat": ("a MATLAB file", "mat-io", _read_matlab),
    ".xlsx": ("an Excel workbook", "openpyxl", _read_workbook),
    ".parquet": ("a Parquet file", "pyarrow", _read_parquet),
    ".tdms": ("a TDMS file", "npTDMS", _read_tdms),
    ".mf4": ("an MDF file", "asammdf", _read_mdf),
    ".mdf": ("an MDF file", "asammdf", _read_mdf),
}
"""By the ending of a name: what the file is, the package that reads it, and how."""
