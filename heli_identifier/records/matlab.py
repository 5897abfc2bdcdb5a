"""A MATLAB file (version 7 or older) as a table.

Column and row vectors are read at the top level and as fields of a struct (``log.pitch_rad``). A name in MATLAB holds
no brackets; ``time_s``, ``v_front_V``, ``pitch_rad`` or ``pitch_deg`` stand for the contract's headers, and
`find_columns` splits them.
"""

import io
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import LogError
from heli_identifier.records.table import Table, as_numbers

_HDF5 = (b"MATLAB 7.3", b"\x89HDF")


def read_matlab_table(data: bytes, file: str) -> Table:
    """Read the bytes of a MATLAB file.

    Parameters
    ----------
    data : bytes
        Content of the file.
    file : str
        Name of the file for messages.

    Returns
    -------
    Table
        One column per vector; vectors may differ in length.

    Raises
    ------
    LogError
        If the bytes are not a MATLAB file, are of version 7.3 (HDF5), or hold no vector.
    """
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    if data.startswith(_HDF5):
        raise LogError(f"{file} is a MATLAB 7.3 file (HDF5); save it with save(..., '-v7') and try again.")
    try:
        variables = loadmat(io.BytesIO(data), squeeze_me=True)
    # The reader raises any of these on foreign or truncated bytes.
    except (MatReadError, ValueError, TypeError, KeyError, IndexError, OSError, EOFError, zlib.error) as error:
        raise LogError(
            f"{file} is not a readable MATLAB file ({str(error).strip() or type(error).__name__}); save it again."
        ) from error
    found = {name: value for name, value in variables.items() if not name.startswith("__")}
    vectors = _vectors(found)
    if not vectors:
        raise LogError(
            f"{file} holds no vector of numbers, found {', '.join(found) or 'nothing'}; save "
            "time_s, v_front_V, v_rear_V, pitch_rad, elevation_rad and travel_rad as vectors or as fields of a struct "
            "(table2struct with ToScalar makes one of a table)."
        )
    columns = tuple(vectors.values())
    return Table(file, tuple(vectors), columns, 1, lambda sample, column: str(columns[column][sample]))


def _vectors(variables: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """Collect vectors at the top level and one level down in structs."""
    vectors: dict[str, NDArray[Any]] = {}
    for name, value in variables.items():
        array = np.asarray(value)
        if array.dtype.names and array.ndim == 0:
            vectors |= _vectors({field: array[field].item() for field in array.dtype.names})
        elif array.ndim == 1 and array.size > 1 and array.dtype.kind in "iufcb":
            vectors[name] = as_numbers(array)
    return vectors
