"""The disk cache of compiled code: numba's own, in a folder of the user alone.

numba unpickles what it finds in its cache, so whoever can write there can run code. So the folder has to belong to the
user, and nobody else may write to it. It is ``HELI_CACHE_DIR``, or else ``~/.cache/heli-twin``, or else, where that
cannot be used, one that is removed when the process ends. What a full disk or another library has damaged is dropped
and compiled again.
"""

import atexit
import os
import shutil
import stat
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.caching import FunctionCache

from .errors import PlantError

VARIABLE = "HELI_CACHE_DIR"


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
                f"compiled code cannot be kept in {named}: others can write to it, so what is loaded need not be yours; "
                f"set {VARIABLE} to a folder of your own (chmod go-w)"
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
