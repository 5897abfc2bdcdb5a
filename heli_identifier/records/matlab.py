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
from heli_identifier.records.table import Table, as_numbers, need, table_of

_HDF5 = b"\x89HDF"
_MOST_ROWS = 200  # signals in a matrix; a matrix with more rows and columns is no log
_FEWEST_SAMPLES = 100  # in a matrix; one that has fewer rows and columns holds gains or the like
_DEPTH = 6  # structs within structs that are looked into


def read_matlab(library: Any, path: Path, file: str, mapped: frozenset[str]) -> Table:
    """Read a MATLAB file by scipy.io, or by mat-io where it has to be; its vectors may differ in length.

    Raises
    ------
    LogError
        If the file holds no vector, or needs a package that is not installed.
    """
    with open(path, "rb") as stream:
        head = stream.read(516)
    hdf5 = _HDF5 in (head[:4], head[512:])  # MATLAB puts a header of its own before it
    variables = {} if hdf5 else library.loadmat(path, squeeze_me=True, appendmat=False)
    if hdf5 or "__function_workspace__" in variables:
        what = "a MATLAB 7.3 file" if hdf5 else "a MATLAB file with objects"
        variables = need("matio", "mat-io", file, what).load_from_mat(str(path))
    found = {str(name): value for name, value in variables.items() if not str(name).startswith("__")}
    vectors: dict[str, NDArray[Any]] = {}
    objects: list[str] = []
    for name, value in found.items():
        _collect(name, value, vectors, objects)
    if not vectors:
        those = f"the MATLAB object{'s' if len(objects) > 1 else ''} {', '.join(objects)}" if objects else None
        raise LogError(
            f"{file} holds no vector of numbers, found {those or ', '.join(found) or 'nothing'}; save "
            "time_s, v_front_V, v_rear_V, pitch_rad, elevation_rad and travel_rad as vectors or as fields of a struct "
            "(table2struct with ToScalar makes one of a table, struct(ts) one of a timeseries)."
        )
    return table_of(file, vectors)


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
    kind, fields = array.dtype.kind, array.dtype.names
    if array.ndim == 0 and array.dtype == object and isinstance(array.item(), np.ndarray | dict):
        _collect(name, array.item(), vectors, objects, depth + 1)
    elif fields and array.ndim == 0:
        inner = {field: array[field].item() if array[field].dtype == object else array[field] for field in fields}
        for field, content in (_labelled(inner) or inner).items():
            _collect(f"{name}.{field}", content, vectors, objects, depth + 1)
    elif fields and array.ndim == 1 and len(array) <= _MOST_ROWS:
        for index, element in enumerate(array, start=1):
            _collect(f"{name}({index})", element, vectors, objects, depth + 1)
    elif type(value).__name__ in ("MatlabOpaque", "MatlabObject", "MatlabFunction"):
        objects.append(name)
    elif kind in "iufcb" and array.ndim == 1 and array.size > 1:
        vectors[name] = as_numbers(array)
    elif kind in "iuf" and array.ndim == 2 and min(array.shape) <= _MOST_ROWS and max(array.shape) >= _FEWEST_SAMPLES:
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
