"""The plant's scalar functions, compiled by numba from the same source that an FMU interprets.

:func:`compiled` walks the globals that a function names, compiles those that are functions of this project, and
binds the compiled twins in their place; nothing is written twice. Parameters are handed over as a NumPy record whose
fields are those of :class:`heli_plant.parameters.PlantParameters` (:func:`parameter_record`).

numba's disk cache notices a change in a function's own file only, not in what the function calls or names; the folder
of a function is therefore named by the content of everything that takes part. numba unpickles what it finds there, so
whoever can write there can run code: the folder has to belong to the user, and nobody else may write to it. It stands
in ``HELI_CACHE_DIR``, or else in ``~/.cache/heli-twin``, or else, where that cannot be used, in one that is removed
when the process ends. What a full disk or another library has damaged is dropped and compiled again.

Two thirds of a cold start go into Python's side of numba, a fixed share of that into the wrappers by which Python
calls a function: only the function that is asked for gets them (and a place in the cache), those it calls do not.
"""

import atexit
import hashlib
import inspect
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from threading import RLock
from types import FunctionType
from typing import Any

import numba
import numpy as np
from numba.core.caching import FunctionCache
from numpy.typing import ArrayLike, NDArray

from .effects import AXES
from .errors import PlantError
from .general_model import general_accelerations
from .laws import table_elevation, table_pitch, table_travel
from .parameters import PlantParameters

PARAMETER_DTYPE = np.dtype([(field, np.float64) for field in PlantParameters._fields])
"""Record type of a parameter set."""

VARIABLE = "HELI_CACHE_DIR"
_ROOTS = ("heli_plant", "heli_identifier")
_Pairs = tuple[tuple[Callable, Callable], ...]
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

    They are half of what there is to compile, and most logs are identified with neither. Tables are left out together,
    so that there are not eight versions of a function.
    """
    instead: _Pairs = ()
    if parameters.general_model <= 0.5:
        instead += ((general_accelerations, _no_model),)
    if all(getattr(parameters, f"table_variable_{axis}") <= 0.5 for axis in AXES):
        instead += tuple((table, _no_table) for table in (table_pitch, table_elevation, table_travel))
    with _LOCK:
        return _entry(function, instead)


def _no_model(pitch, elevation, pitch_rate, elevation_rate, travel_rate, mu_diff, mu_sum, p):  # type: ignore[no-untyped-def]
    """Stand for the general model where it is not chosen; never called."""
    return 0.0, 0.0, 0.0


def _no_table(time, pitch, elevation, travel, pitch_rate, elevation_rate, travel_rate, mu_sum, mu_diff, travel_rest, p):  # type: ignore[no-untyped-def]
    """Stand for the tabulated torque of an axis that has none; never called."""
    return 0.0


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
def _entry(function: Any, instead: _Pairs = ()) -> Any:
    """Dispatcher of a function that Python calls, kept on disk; ``instead``: pairs of a callee and its stand-in."""
    return kept_on_disk(_jit(function, instead), _digest(function, instead))


@cache
def _callee(function: Any, instead: _Pairs) -> Any:
    """Dispatcher of a function that only compiled functions call, never Python."""
    # one function without calls is a fifth faster: a call would pass all arguments through memory
    return _jit(function, instead, no_cpython_wrapper=True, no_cfunc_wrapper=True, forceinline=True)


def _jit(function: Any, instead: _Pairs, **options: Any) -> Any:
    """Compile ``function`` over the compiled twins of the project functions it names."""
    named = _named(function, instead).items()
    twins = {name: _callee(value, instead) for name, value in named if isinstance(value, FunctionType)}
    code = function.__code__
    if not Path(code.co_filename).is_file():  # numba keys its cache by a file; a composed function has none of its own
        code = code.replace(co_filename=str(sys.modules[function.__module__].__file__))
    twin = FunctionType(code, {**function.__globals__, **twins}, function.__name__, function.__defaults__)
    # numba names machine code by this and by a count of its own; two functions of one name that two processes have
    # cached would be taken for each other by a third that loads both
    twin.__qualname__ = f"{function.__qualname__}_{_digest(function, instead)}"
    return numba.njit(nogil=True, error_model="numpy", **options)(twin)


def _named(function: Any, instead: _Pairs) -> dict[str, Any]:
    """Return the project's functions and classes, and the constants, that ``function`` names among its globals."""
    named = {name: function.__globals__.get(name) for name in function.__code__.co_names}
    named |= {name: other for name, value in named.items() for callee, other in instead if value is callee}
    return {
        name: value
        for name, value in named.items()
        if isinstance(value, int | float | tuple)
        or (isinstance(value, FunctionType | type) and value.__module__.split(".")[0] in _ROOTS)
    }


@cache
def _digest(function: Any, instead: _Pairs) -> str:
    """Name for everything that the machine code of ``function`` depends on: sources, constants, a set's fields."""
    digest = hashlib.sha256(repr(PARAMETER_DTYPE.names).encode())
    for ingredient in sorted(_ingredients(function, instead)):
        digest.update(hashlib.sha256(ingredient).digest())
    return digest.hexdigest()[:16]


def _ingredients(function: Any, instead: _Pairs) -> set[bytes]:
    """Return the sources and the values of constants that take part in ``function``."""
    found = {inspect.getsource(function).encode()}
    for name, value in _named(function, instead).items():
        if isinstance(value, FunctionType):
            found.add(f"{name} = {value.__qualname__}".encode())
            found |= _ingredients(value, instead)
        elif isinstance(value, type):
            found.add(Path(str(sys.modules[value.__module__].__file__)).read_bytes())
        else:
            found.add(f"{name} = {value!r}".encode())
    return found


class PatientCache(FunctionCache):
    """The cache of one function. Nothing that is wrong with it reaches the caller."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Give compiled code, or None if there is none that can be used."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # numba raises what it meets in a damaged file, or in code of another machine
            with suppress(OSError):
                self._cache_file.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep compiled code if there is room for it."""
        try:
            super().save_overload(sig, data)
        except Exception:  # to save, numba reads its index first, which may be damaged
            with suppress(Exception):
                self._cache_file.flush()
                super().save_overload(sig, data)


def cache_folder() -> Path:
    """Folder of all compiled code.

    Raises
    ------
    PlantError
        ``HELI_CACHE_DIR`` names one that cannot be made, or that somebody else can write to.
    """
    named = os.environ.get(VARIABLE)
    if named:
        folder = Path(named)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as problem:
            raise PlantError(
                f"compiled code cannot be kept in {named}: {problem.strerror}; "
                f"set {VARIABLE} to a folder that can be written"
            ) from problem
        if not _is_private(folder):
            raise PlantError(
                f"compiled code cannot be kept in {named}: others can write to it, so what is loaded need not be "
                f"yours; set {VARIABLE} to a folder of your own (chmod go-w)"
            )
        return folder
    with suppress(RuntimeError, OSError):  # there is no home, or it cannot be written
        home = Path.home() / ".cache" / "heli-twin"
        home.mkdir(parents=True, exist_ok=True, mode=0o700)
        if os.access(home, os.W_OK | os.X_OK) and _is_private(home):
            return home
    return _temporary_folder()


def _is_private(folder: Path) -> bool:
    """Whether a folder is the user's and nobody else may write to it; other systems than POSIX keep this themselves."""
    if not hasattr(os, "getuid"):
        return True
    status = folder.stat()
    return status.st_uid == os.getuid() and not stat.S_IMODE(status.st_mode) & 0o022


@cache
def _temporary_folder() -> Path:
    """Make a folder that ends with this process; processes that it starts use it too."""
    folder = Path(tempfile.mkdtemp(prefix=".heli-cache-"))
    os.environ[VARIABLE] = str(folder)
    atexit.register(_remove, folder, os.getpid())
    return folder


def _remove(folder: Path, owner: int) -> None:
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)
