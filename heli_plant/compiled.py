"""The plant's scalar functions, compiled by numba from the same source that an FMU interprets.

:func:`compile_function` looks up the globals that a function names, compiles those that are functions of the plant, and
puts the compiled ones in their place. Parameters are passed as a NumPy record whose fields are those of
:class:`heli_plant.parameters.PlantParameters` (:func:`parameter_record`).

numba's disk cache notices a change only in the function's own file, not in the functions that it calls. Therefore the
name of the cache folder depends on all sources of the function's package. numba unpickles the files there, so whoever
can write to the folder can run code: it has to belong to the user, and nobody else may write to it. It is in
``HELI_CACHE_DIR``, or else in ``~/.cache/heli-twin``; if that cannot be used, every process compiles for itself.
Damaged files are deleted and compiled again.
"""

import hashlib
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache, lru_cache
from pathlib import Path
from types import FunctionType
from typing import Any

import numba
import numpy as np
from numba.core.caching import FunctionCache
from numpy.typing import ArrayLike, NDArray

from .errors import PlantError
from .laws import has_tables
from .models import general_accelerations, simplified_accelerations
from .parameters import PlantParameters
from .tabulated_torque import table_variable, tabulated_torque

PARAMETER_DTYPE = np.dtype([(field, np.float64) for field in PlantParameters._fields])  # record type of a parameter set
VARIABLE = "HELI_CACHE_DIR"


@lru_cache(maxsize=256)
def parameter_record(parameters: PlantParameters) -> np.void:
    """Return the parameter set as a NumPy record, which compiled functions read by field."""
    return np.array([tuple(parameters)], dtype=PARAMETER_DTYPE)[0]


def read_only(values: ArrayLike) -> NDArray[np.float64]:
    """Return ``values`` as a contiguous array that cannot be written to; numba compiles for each kind of array."""
    view = np.ascontiguousarray(values, dtype=float).view()
    view.flags.writeable = False
    return view


def compile_function(function: Callable, *parameters: PlantParameters) -> Callable:
    """Return ``function``, with every function of the plant that it calls, compiled by numba and kept on disk.

    It releases the interpreter's lock, and divides by zero as IEEE 754 does. If none of the ``parameters`` that it
    will be called with uses the general model or a table, it is compiled without them, in half of the time.
    """
    return _entry(function, bool(parameters) and not any(p.general_model > 0.5 or has_tables(p) for p in parameters))


_PLAIN: dict[Any, Any] = {
    general_accelerations: simplified_accelerations,
    table_variable: lambda number, first, time, th, ep, la, w1, w2, w3, mu_s, mu_d: 0.0,
    tabulated_torque: lambda x, first, spacing, y: 0.0,
}
"""Functions that a plant without the general model and tables never calls, and their replacements."""


@cache
def _entry(function: Any, is_plain: bool) -> Any:
    """Return the dispatcher of a function that Python calls; its machine code is kept in :func:`cache_folder`."""
    dispatcher, folder = _jit(function, is_plain), cache_folder()
    if folder is not None and hasattr(dispatcher, "py_func"):  # it is a plain function under NUMBA_DISABLE_JIT
        version = _sources_digest(function.__module__.partition(".")[0])
        config: Any = numba.config
        usual_folder, config.CACHE_DIR = config.CACHE_DIR, str(folder / f"numba-{version}")
        with suppress(RuntimeError):  # a generated function has no file; it is compiled by each process
            dispatcher._cache = _PatientCache(dispatcher.py_func)  # looks for its folder now
        config.CACHE_DIR = usual_folder
    return dispatcher


@cache
def _callee(function: Any, is_plain: bool) -> Any:
    """Return the dispatcher of a function that only compiled functions call, never Python."""
    # one function without calls is a fifth faster: a call would pass all arguments through memory
    function = _PLAIN.get(function, function) if is_plain else function
    return _jit(function, is_plain, no_cpython_wrapper=True, no_cfunc_wrapper=True, forceinline=True)


def _jit(function: Any, is_plain: bool, **options: Any) -> Any:
    """Compile ``function``, which then calls the compiled forms of the plant's functions."""
    names = dict(function.__globals__)
    for name in function.__code__.co_names:
        value = names.get(name)
        if isinstance(value, FunctionType) and value.__module__.partition(".")[0] == __package__:
            names[name] = _callee(value, is_plain)
    copy = FunctionType(function.__code__, names, function.__name__, function.__defaults__)
    # numba names files and machine code by this name and by a number
    copy.__qualname__ = f"{function.__qualname__}{'_plain' * is_plain}"
    return numba.njit(nogil=True, error_model="numpy", **options)(copy)


@cache
def _sources_digest(package: str) -> str:
    """Return a hash of all sources of a package."""
    digest = hashlib.sha256()
    for folder in sys.modules[package].__path__:
        for file in sorted(Path(folder).rglob("*.py")):
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


class _PatientCache(FunctionCache):
    """numba's cache of one function, whose faults never reach the caller."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return compiled code, or None if there is none that can be used."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # a damaged file, or code of another machine, makes numba raise anything
            with suppress(OSError):
                self.flush()

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save compiled code if there is room for it."""
        with suppress(Exception):
            super().save_overload(sig, data)


def cache_folder() -> Path | None:
    """Return the folder of all compiled code, or None if ``HELI_CACHE_DIR`` is not set and the usual one is unusable.

    PlantError if the folder in ``HELI_CACHE_DIR`` cannot be made, or others can write to it.
    """
    named = os.environ.get(VARIABLE)
    try:
        folder = Path(named or Path.home() / ".cache" / "heli-twin")
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        status = folder.stat()
        if hasattr(os, "getuid") and (status.st_uid != os.getuid() or status.st_mode & 0o022):
            raise OSError("others can write to it, so what is loaded need not be yours")
        return folder if named or os.access(folder, os.W_OK | os.X_OK) else None
    except (RuntimeError, OSError) as problem:  # RuntimeError: there is no home
        if not named:
            return None
        reason = getattr(problem, "strerror", None) or str(problem)
        remedy = f"set {VARIABLE} to a folder that can be written, by you alone"
        raise PlantError(f"compiled code cannot be kept in {named}: {reason}; {remedy}") from problem
