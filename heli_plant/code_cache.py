"""The disk cache of compiled code: what numba keeps there, sealed, and dropped where it is damaged.

numba unpickles what it finds in its cache, so that whoever can write there can run code, and a file that a full disk
cut short breaks every later run. Here every file begins with a seal (HMAC-SHA256 over its name and content). A file
whose seal is wrong is never unpickled: it is removed and the function compiled again. The key is in the user's home,
readable by nobody else; it follows that a cache on a shared disk serves its owner only.

The folder is ``HELI_CACHE_DIR``, or else ``~/.cache/heli-twin``, or else, where that cannot be written or there is no
home, one that is removed when the process ends.
"""

import atexit
import fcntl
import hmac
import os
import pickle
import secrets
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.caching import FunctionCache, IndexDataCacheFile

from .errors import PlantError

VARIABLE = "HELI_CACHE_DIR"
_SEAL = 32  # bytes of a SHA-256
_DRAFT = ".heli-draft-"  # what the commands sweep away if the process was killed


class SealedFile(IndexDataCacheFile):
    """The files of one function; numba asks for an entry with ``load`` and gives one with ``save``."""

    def _load_index(self) -> dict[Any, str]:
        try:
            version, stamp, overloads = pickle.loads(_unsealed(Path(self._index_path)))
        except (OSError, _Broken):
            return {}
        return overloads if (version, stamp) == (self._version, self._source_stamp) else {}

    def _save_index(self, overloads: dict[Any, str]) -> None:
        self._write(Path(self._index_path), self._dump((self._version, self._source_stamp, overloads)))

    def _load_data(self, name: str) -> Any:
        try:
            return pickle.loads(_unsealed(Path(self._data_path(name))))
        except _Broken as problem:
            raise FileNotFoundError(str(problem)) from problem  # as if it had never been there

    def _save_data(self, name: str, data: Any) -> None:
        self._write(Path(self._data_path(name)), self._dump(data))

    def _write(self, path: Path, content: bytes) -> None:
        with self._open_for_write(path) as file:
            file.write(_seal(path.name, content) + content)


class SealedCache(FunctionCache):
    """The cache of one function. Nothing that is wrong with it reaches the caller."""

    def __init__(self, function: Callable) -> None:
        super().__init__(function)
        old = self._cache_file
        self._cache_file = SealedFile(self._cache_path, old._index_name.removesuffix(".nbi"), old._source_stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Give compiled code, or None if there is none that can be used."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # code of another machine or library under the same key; numba raises what it meets
            with suppress(OSError):
                self._cache_file.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep compiled code if there is room for it."""
        with suppress(OSError):
            super().save_overload(sig, data)


class _Broken(Exception):
    """A file's seal is not that of its content."""


def _unsealed(path: Path) -> bytes:
    """Content of a file.

    Raises
    ------
    _Broken
        It is not what was written; it was removed.
    OSError
        It cannot be read.
    """
    sealed = path.read_bytes()
    content = sealed[_SEAL:]
    if not hmac.compare_digest(sealed[:_SEAL], _seal(path.name, content)):
        with suppress(OSError):
            path.unlink()
        raise _Broken(f"{path} was damaged")
    return content


def _seal(name: str, content: bytes) -> bytes:
    return hmac.digest(_key(), name.encode() + b"\0" + content, "sha256")


@cache
def _key() -> bytes:
    """Secret of this user, made when it is first needed."""
    for folder in (_home(), cache_folder()):
        if folder is None:
            continue
        path = folder / "key"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if not _is_private(path):
                path.unlink(missing_ok=True)
                draft = folder / f".key-{secrets.token_hex(8)}"
                with open(os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
                    file.write(secrets.token_bytes(_SEAL))
                with suppress(FileExistsError):  # another process was faster
                    os.link(draft, path)
                draft.unlink()
            if _is_private(path):
                return path.read_bytes()
        except OSError:
            continue
    return secrets.token_bytes(_SEAL)  # nothing can be kept: what this process writes, only it can read


def _is_private(path: Path) -> bool:
    try:
        status = path.lstat()
    except OSError:
        return False
    return status.st_size == _SEAL and status.st_uid == os.geteuid() and not status.st_mode & 0o077


def _home() -> Path | None:
    try:
        return Path.home() / ".cache" / "heli-twin"
    except RuntimeError:  # there is no home
        return None


def cache_folder() -> Path:
    """Folder of all compiled code.

    Raises
    ------
    PlantError
        ``HELI_CACHE_DIR`` names one that cannot be made.
    """
    named = os.environ.get(VARIABLE)
    if named:
        try:
            Path(named).mkdir(parents=True, exist_ok=True)
        except OSError as problem:
            raise PlantError(
                f"compiled code cannot be kept in {named}: {problem.strerror}; "
                f"set {VARIABLE} to a folder that can be written"
            ) from problem
        return Path(named)
    home = _home()
    if home is not None:
        with suppress(OSError):
            home.mkdir(parents=True, exist_ok=True)
            if os.access(home, os.W_OK | os.X_OK):
                return home
    return _temporary_folder()


@cache
def _temporary_folder() -> Path:
    """Make a folder that ends with this process; processes that it starts use it too."""
    while True:
        folder = Path(tempfile.mkdtemp(prefix=_DRAFT))
        with suppress(FileNotFoundError):  # a command has swept it, which was not locked yet
            held = os.open(folder, os.O_RDONLY)
            break
    with suppress(OSError):
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    os.environ[VARIABLE] = str(folder)
    atexit.register(_remove, folder, os.getpid())
    return folder


def _remove(folder: Path, owner: int) -> None:
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)
