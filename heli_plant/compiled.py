"""The plant's scalar functions, compiled by numba from the same source that an FMU interprets.

:func:`compiled` walks the globals that a function names, compiles those that are functions of this project, and
binds the compiled twins in their place; nothing is written twice. Parameters are handed over as a NumPy record whose
fields are those of :class:`heli_plant.parameters.PlantParameters` (:func:`parameter_record`).

numba's disk cache notices a change in a function's own file only, not in what the function calls or names; the cache
folder is therefore named by the content of everything that takes part (:mod:`.code_cache`). Two
thirds of a cold start go into Python's side of numba, a fixed share of that into the wrappers by which Python calls a
function: only the function that is asked for gets them (and a place in the cache), the functions it calls do not.
"""

import hashlib
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from threading import RLock
from types import FunctionType
from typing import Any

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from .code_cache import PatientCache, cache_folder
from .effects import AXES
from .parameters import PlantParameters
from .specialised import specialised
from .syntax import text_of

PARAMETER_DTYPE = np.dtype([(field, np.float64) for field in PlantParameters._fields])
"""Record type of a parameter set."""

_TABLES = tuple(f"table_variable_{axis}" for axis in AXES)
_ROOTS = ("heli_plant", "heli_identifier")
_LOCK = RLock()
_CONFIG: Any = numba.config


def parameter_record(parameters: PlantParameters) -> np.void:
    """Return the parameter set as a NumPy record, which compiled functions read by field."""
    return np.array([tuple(parameters)], dtype=PARAMETER_DTYPE)[0]


def read_only(values: ArrayLike) -> NDArray[np.float64]:
    """Return ``values`` as a contiguous array of floats that cannot be written to, without a copy where they are one.

    Whether an array can be written to is part of its type: without this a function is compiled once for frozen logs and
    once more for arrays that somebody has just made.
    """
    view = np.ascontiguousarray(values, dtype=float).view()
    view.flags.writeable = False
    return view


def compiled(function: Callable) -> Callable:
    """Return ``function`` compiled by numba, with every project function it calls.

    Parameters
    ----------
    function : FunctionType
        A function of plain floats, tuples, arrays and records that uses ``math`` and other such functions only. It
        releases the interpreter's lock, and divides by zero as IEEE 754 does.

    Raises
    ------
    PlantError
        ``HELI_CACHE_DIR`` names a folder that cannot be made.
    """
    with _LOCK:
        return _entry(function)


def compiled_for(function: Callable, parameters: PlantParameters) -> Callable:
    """Return ``function``, which steps a plant, compiled without model and tables that ``parameters`` do not choose.

    The general model is a quarter of what there is to compile, and logs are identified with the simplified one. Tables
    are left out together, so that there are not eight versions of a function.
    """
    general = parameters.general_model > 0.5
    tables = any(getattr(parameters, field) > 0.5 for field in _TABLES)
    with _LOCK:
        return _entry_for(function, general, tables)


@cache
def _entry_for(function, general: bool, tables: bool):
    """Dispatcher of a function for one of the models, with tables or without."""
    known = {"general_model": 1.0 if general else 0.0}
    if not tables:
        known |= dict.fromkeys(_TABLES, 0.0)
    return _entry(specialised(function, known))


def kept_on_disk(dispatcher: Any, key: str) -> Any:
    """Let a function of numba keep its machine code on the disk; return it.

    Parameters
    ----------
    dispatcher : numba dispatcher
        Without ``cache=True``, which would keep it beside the source. Under ``NUMBA_DISABLE_JIT`` it stays as it is.
    key : str
        Names everything that the machine code depends on.

    Raises
    ------
    PlantError
        ``HELI_CACHE_DIR`` names a folder that cannot be made.
    """
    if not hasattr(dispatcher, "py_func"):
        return dispatcher
    outer, _CONFIG.CACHE_DIR = _CONFIG.CACHE_DIR, str(cache_folder() / f"numba-{key}")
    try:
        dispatcher._cache = PatientCache(dispatcher.py_func)
        return dispatcher
    except (OSError, RuntimeError):  # numba finds no place for files: it compiles in every process
        return dispatcher
    finally:
        _CONFIG.CACHE_DIR = outer


@cache
def _entry(function):
    """Dispatcher of a function that Python calls, kept on disk."""
    return kept_on_disk(_jit(function), _digest(function))


@cache
def _callee(function):
    """Dispatcher of a function that only compiled functions call, never Python."""
    # one function without calls is a fifth faster: a call would pass all arguments through memory
    return _jit(function, no_cpython_wrapper=True, no_cfunc_wrapper=True, forceinline=True)


def _jit(function, **options):
    """Compile ``function`` over the compiled twins of the project functions it names."""
    named = _named(function).items()
    twins = {name: _callee(value) for name, value in named if isinstance(value, FunctionType)}
    code = function.__code__
    if not Path(code.co_filename).is_file():  # numba keys its cache by a file; a composed function has none of its own
        code = code.replace(co_filename=str(sys.modules[function.__module__].__file__))
    twin = FunctionType(code, {**function.__globals__, **twins}, function.__name__, function.__defaults__)
    # numba names machine code by this and by a count of its own; two functions of one name that two processes have
    # cached would be taken for each other by a third that loads both
    twin.__qualname__ = f"{function.__qualname__}_{_digest(function)}"
    return numba.njit(nogil=True, error_model="numpy", **options)(twin)


def _named(function) -> dict[str, Any]:
    """Return the project's functions and classes, and the constants, that ``function`` names among its globals."""
    named = {name: function.__globals__.get(name) for name in function.__code__.co_names}
    return {
        name: value
        for name, value in named.items()
        if isinstance(value, int | float | tuple)
        or (isinstance(value, FunctionType | type) and value.__module__.split(".")[0] in _ROOTS)
    }


def _ingredients(function) -> set[bytes]:
    """Everything that the machine code of ``function`` depends on: sources and the values of constants."""
    found = {text_of(function).encode()}
    for name, value in _named(function).items():
        if isinstance(value, FunctionType):
            found.add(f"{name} = {value.__qualname__}".encode())
            found |= _ingredients(value)
        elif isinstance(value, type):
            found.add(Path(str(sys.modules[value.__module__].__file__)).read_bytes())
        else:
            found.add(f"{name} = {value!r}".encode())
    return found


@cache
def _digest(function) -> str:
    """Name for all ingredients of a function and the fields of a parameter set."""
    digest = hashlib.sha256(repr(PARAMETER_DTYPE.names).encode())
    for ingredient in sorted(_ingredients(function)):
        digest.update(hashlib.sha256(ingredient).digest())
    return digest.hexdigest()[:16]
