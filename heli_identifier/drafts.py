"""Drafts: files and folders that exist only while a command runs.

A draft is removed when its block ends, however it ends. Only SIGKILL and a loss of power leave one. So each draft is
locked (flock) by the process that made it, and whoever makes the next draft in the same folder removes those that
nobody holds. The system drops a lock when its process ends, in containers and after a reuse of process ids as well.
Signals that ask the process to end wait while a draft is made: between a folder's birth and the block that removes it
they would leave the folder.
"""

import fcntl
import os
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import IO

from heli_identifier.signals import deferred, undone

PREFIX = ".heli-draft-"
"""Beginning of the name of every draft."""


@contextmanager
def draft_file(folder: Path) -> Iterator[tuple[Path, IO[bytes]]]:
    """Give path and file object of a new file in ``folder``; it is removed unless the block renames it."""
    sweep(folder)
    with ExitStack() as stack:
        with deferred():
            path, descriptor = _new_file(folder)
            stack.enter_context(undone(lambda: path.unlink(missing_ok=True)))
        with open(descriptor, "wb") as file:
            yield path, file


@contextmanager
def draft_folder(folder: str | os.PathLike[str] | None = None) -> Iterator[Path]:
    """Give a new folder within ``folder``, by default that of temporary files; it is removed when the block ends.

    Raises
    ------
    OSError
        The folder cannot be made; it names the folder in which.
    """
    with ExitStack() as stack:
        with deferred():
            path, descriptor = _new_folder(folder)
            stack.callback(os.close, descriptor)
            stack.enter_context(undone(lambda: shutil.rmtree(path, ignore_errors=True)))
        yield path


def _new_file(folder: Path) -> tuple[Path, int]:
    """Make a file and lock it; give its path and descriptor."""
    while True:
        path = folder / _name()
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
        if _lock(descriptor, path) is not False:
            return path, descriptor
        os.close(descriptor)


def _new_folder(folder: str | os.PathLike[str] | None) -> tuple[Path, int]:
    """Make a folder and lock it; give its path and descriptor."""
    try:
        # the place of temporary files is looked for by writing one, and in vain where the disk is full
        parent = Path(tempfile.gettempdir() if folder is None else folder)
        sweep(parent)
        while True:
            path = parent / _name()
            path.mkdir(mode=0o700)
            with suppress(FileNotFoundError):  # another process has swept it, which was not locked yet
                descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
                if _lock(descriptor, path) is not False:
                    return path, descriptor
                os.close(descriptor)
    except OSError as error:
        where = error.filename if folder is None and isinstance(error, FileNotFoundError) else parent
        raise OSError(error.errno, error.strerror, str(where)) from error


def sweep(folder: Path) -> None:
    """Remove the drafts in ``folder`` that a process of this user has left behind."""
    try:
        with os.scandir(folder) as entries:
            left = [entry.path for entry in entries if entry.name.startswith(PREFIX)]
    except OSError:  # it does not exist or cannot be listed; whoever writes there will say so
        return
    for path in left:
        with suppress(OSError):  # somebody else's, or gone meanwhile
            _remove_unheld(path)


def _remove_unheld(path: str) -> None:
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        if os.fstat(descriptor).st_uid == os.geteuid() and _lock(descriptor, path):
            if os.path.isdir(path):
                shutil.rmtree(path, ignore_errors=True)
            else:
                os.unlink(path)
    finally:
        os.close(descriptor)


def _lock(descriptor: int, path: str | Path) -> bool | None:
    """Lock a draft.

    False if another process holds it or has removed it before the lock was there; None where files have no locks.
    """
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    try:
        return os.path.samestat(os.fstat(descriptor), os.lstat(path))
    except FileNotFoundError:
        return False


def _name() -> str:
    return f"{PREFIX}{secrets.token_hex(8)}"
