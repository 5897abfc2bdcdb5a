"""The plant's scalar functions, compiled by numba from the same source that an FMU interprets.

:func:`compiled` walks the globals that a function names, compiles those that are functions of this project, and
binds the compiled twins in their place; nothing is written twice. Parameters are handed over as a NumPy record whose
fields are those of :class:`heli_plant.parameters.PlantParameters` (:func:`parameter_record`).

numba's disk cache notices a change in a function's own file only, not in the functions it calls; the cache folder
is therefore named by the content of all sources that could take part.
"""

import hashlib
import os
from functools import cache
from pathlib import Path
from types import FunctionType

import numba
import numpy as np

from .parameters import PlantParameters

PARAMETER_DTYPE = np.dtype([(field, np.float64) for field in PlantParameters._fields])
"""Record type of a parameter set."""

_ROOTS = ("heli_plant", "heli_identifier")


def parameter_record(parameters):
    """Return the parameter set as a NumPy record, which compiled functions read by field."""
    return np.array([tuple(parameters)], dtype=PARAMETER_DTYPE)[0]


def _project_functions(function):
    """Return the project's functions that ``function`` names among its globals, by name."""
    named = {name: function.__globals__.get(name) for name in function.__code__.co_names}
    return {
        name: value
        for name, value in named.items()
        if isinstance(value, FunctionType) and value.__module__.split(".")[0] in _ROOTS
    }


def _sources(function) -> set[str]:
    """Files of ``function`` and of everything it calls in this project."""
    files = {function.__code__.co_filename}
    for callee in _project_functions(function).values():
        files |= _sources(callee)
    return files


def _cache_directory(function) -> str:
    """Folder of the disk cache, named by the content of every source that takes part and of the parameter set."""
    digest = hashlib.sha256(repr(PARAMETER_DTYPE.names).encode())
    for source in sorted(_sources(function)):
        digest.update(Path(source).read_bytes())
    base = os.environ.get("HELI_CACHE_DIR") or Path.home() / ".cache" / "heli-twin"
    return str(Path(base) / f"numba-{digest.hexdigest()[:16]}")


@cache
def compiled(function):
    """Return ``function`` compiled by numba, with every project function it calls.

    Parameters
    ----------
    function : FunctionType
        A function of plain floats, tuples and records that uses ``math`` and other such functions only.
    """
    bindings = dict(function.__globals__)
    bindings.update({name: compiled(callee) for name, callee in _project_functions(function).items()})
    twin = FunctionType(
        function.__code__, bindings, function.__name__, function.__defaults__, function.__closure__
    )
    twin.__qualname__ = function.__qualname__
    outer = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = _cache_directory(function)
    try:
        return numba.njit(cache=True, nogil=True, error_model="numpy")(twin)
    finally:
        numba.config.CACHE_DIR = outer
