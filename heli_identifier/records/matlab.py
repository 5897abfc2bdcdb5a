"""A MATLAB file as a table.

| in the file | column |
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
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import LogError
from heli_identifier.records.apart import check_survives
from heli_identifier.records.table import Table, as_numbers, needed

_HDF5 = b"\x89HDF"
_MOST_ROWS = 200
"""Signals in a matrix; a matrix with more rows and columns is no log."""
_FEWEST_SAMPLES = 100
"""Samples in a matrix; one that has fewer rows and columns holds gains or the like."""
_DEPTH = 6
"""Structs within structs that are looked into."""


def read_matlab_table(path: Path, file: str) -> Table:
    """Read a MATLAB file.

    Parameters
    ----------
    path : Path
        Where it is.
    file : str
        Name of the file for messages.

    Returns
    -------
    Table
        One column per vector; vectors may differ in length.

    Raises
    ------
    LogError
        If the bytes are not a MATLAB file, hold no vector, or need a package that is not installed.
    """
    variables = _variables(path, file)
    found = {name: value for name, value in variables.items() if not str(name).startswith("__")}
    vectors: dict[str, NDArray[Any]] = {}
    objects: list[str] = []
    for name, value in found.items():
        _collect(str(name), value, vectors, objects)
    if not vectors:
        what = (
            f"the MATLAB object{'s' if len(objects) > 1 else ''} {', '.join(objects)}" if objects else ", ".join(found)
        )
        raise LogError(
            f"{file} holds no vector of numbers, found {what or 'nothing'}; save "
            "time_s, v_front_V, v_rear_V, pitch_rad, elevation_rad and travel_rad as vectors or as fields of a struct "
            "(table2struct with ToScalar makes one of a table, struct(ts) one of a timeseries)."
        )
    columns = tuple(vectors.values())
    return Table(file, tuple(vectors), columns, 1, lambda sample, column: str(columns[column][sample]))


def _variables(path: Path, file: str) -> dict[str, Any]:
    from scipy.io import loadmat

    size = path.stat().st_size
    with open(path, "rb") as stream:
        head = stream.read(516)
    hdf5 = _HDF5 in (head[:4], head[512:])  # MATLAB puts a header of its own before it
    try:
        if not hdf5:
            check_survives(lambda: loadmat(path, squeeze_me=True, appendmat=False), size, file)
            variables = loadmat(path, squeeze_me=True, appendmat=False)
            if "__function_workspace__" not in variables:
                return variables
        matio = needed(
            "matio", "mat-io", "formats", file, "a MATLAB 7.3 file" if hdf5 else "a MATLAB file with objects"
        )
        check_survives(lambda: matio.load_from_mat(str(path)), size, file)
        return matio.load_from_mat(str(path))
    except LogError:
        raise
    except Exception as error:  # the readers raise whatever their parsers do on foreign or truncated bytes
        said = str(error).strip().splitlines() or [type(error).__name__]
        raise LogError(f"{file} is not a readable MATLAB file ({said[0][:200]}); save it again.") from error


def _collect(name: str, value: Any, vectors: dict[str, NDArray[Any]], objects: list[str], depth: int = 0) -> None:
    """Add the columns of a variable under its name."""
    if depth > _DEPTH:
        return
    if hasattr(value, "columns") and hasattr(value, "index"):  # a table, which mat-io gives as a data frame
        _collect_table(name, value, vectors)
        return
    properties = getattr(value, "properties", None)
    if isinstance(properties, dict) and properties:  # an object, such as a timeseries with its Time and Data
        objects.append(name)
        value = properties
    if isinstance(value, dict):
        value = np.array(tuple(value.values()), dtype=[(str(key), object) for key in value]) if value else None
    array = np.squeeze(np.asarray(value))
    if array.ndim == 0 and array.dtype == object and isinstance(array.item(), np.ndarray | dict):
        _collect(name, array.item(), vectors, objects, depth + 1)
        return
    fields = array.dtype.names
    if fields and array.ndim == 0:
        inner = {field: array[field].item() if array[field].dtype == object else array[field] for field in fields}
        for field, content in (_labelled(inner) or inner).items():
            _collect(f"{name}.{field}", content, vectors, objects, depth + 1)
    elif fields and array.ndim == 1 and len(array) <= _MOST_ROWS:
        for index, element in enumerate(array, start=1):
            _collect(f"{name}({index})", element, vectors, objects, depth + 1)
    elif type(value).__name__ in ("MatlabOpaque", "MatlabObject", "MatlabFunction"):
        objects.append(name)
    elif array.dtype.kind in "iufcb" and array.ndim == 1 and array.size > 1:
        vectors[name] = as_numbers(array)
    elif (
        array.dtype.kind in "iuf"
        and array.ndim == 2
        and min(array.shape) <= _MOST_ROWS
        and max(array.shape) >= _FEWEST_SAMPLES
    ):
        rows = array.shape[0] < array.shape[1]
        for index, row in enumerate(array if rows else array.T, start=1):
            vectors[f"{name}({index},:)" if rows else f"{name}(:,{index})"] = as_numbers(row)


def _labelled(fields: dict[str, Any]) -> dict[str, Any] | None:
    """Fields of a structure with time, or of dSPACE's structure, by the labels of their signals; None of any other."""
    if {"time", "signals"} <= fields.keys():
        time, signals, label, content = ("time", fields["time"]), fields["signals"], "label", "values"
    elif {"X", "Y"} <= fields.keys():
        time, signals, label, content = ("X", _field(fields["X"], "Data")), fields["Y"], "Name", "Data"
    else:
        return None
    elements = np.atleast_1d(np.squeeze(np.asarray(signals)))
    if elements.dtype.names is None or content not in elements.dtype.names:
        return None
    out = {time[0]: time[1]}
    for index, element in enumerate(elements, start=1):
        text = str(np.squeeze(_field(element, label))) if label in elements.dtype.names else ""
        name = text.strip("[]'\" ") or f"signals({index})"
        out[name if name not in out else f"{name}({index})"] = _field(element, content)
    return out


def _field(value: Any, name: str) -> Any:
    array = np.squeeze(np.asarray(value))
    if array.dtype.names is None or name not in array.dtype.names:
        return value
    content = array[name]
    return content.item() if content.dtype == object and content.ndim == 0 else content


def _collect_table(name: str, frame: Any, vectors: dict[str, NDArray[Any]]) -> None:
    """Columns of a table, and the row times of a timetable [s]."""
    if frame.index.dtype.kind == "m":
        vectors[f"{name}.time_s"] = frame.index.to_numpy().astype("timedelta64[ns]").astype(float) * 1e-9
    for column in frame.columns:
        values = frame[column].to_numpy()
        if values.dtype.kind == "m":
            vectors[f"{name}.{column}_s"] = values.astype("timedelta64[ns]").astype(float) * 1e-9
        elif values.dtype.kind in "iufb":
            vectors[f"{name}.{column}"] = as_numbers(values)
