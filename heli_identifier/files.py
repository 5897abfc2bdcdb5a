"""Writing a file whole: the one way in which results, logs, configurations, figures and units reach the disk.

A regular file is replaced by a rename, so that a reader finds the old content or the new one, never a part. A link is
followed, so that the file it leads to changes and the link stays. What is no regular file (a device, a pipe, standard
output) cannot be replaced without destroying it: it is written through.
"""

import errno
import os
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from os import PathLike
from pathlib import Path

from heli_identifier.drafts import draft_file

_kept: ContextVar[tuple[Path, ...]] = ContextVar("_kept", default=())


@contextmanager
def keeping(paths: Iterable[Path]) -> Iterator[None]:
    """Let no folder of results replace one of these files while the block runs, which reads them."""
    token = _kept.set(tuple(paths))
    try:
        yield
    finally:
        _kept.reset(token)


def is_kept(path: Path) -> bool:
    """Whether a file is read by the block that runs (:func:`keeping`)."""
    return path.is_file() and any(other.is_file() and path.samefile(other) for other in _kept.get())


def write_atomically(path: str | PathLike[str], content: str | bytes) -> Path:
    """Write a file so that a reader finds the old content or the new one, never a part.

    Parameters
    ----------
    path : str or PathLike
        File to make or replace, or a device or pipe to write to. Missing folders above it are made.
    content : str or bytes
        Text is written as UTF-8 and keeps its line ends. What UTF-8 cannot hold, such as the name of a file that is no
        UTF-8, becomes a question mark.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OSError
        If the file cannot be written; it names the file. The old file is then untouched and no draft remains.
    """
    target = Path(path)
    data = content.encode("utf-8", "replace") if isinstance(content, str) else content
    try:
        present = _present(target)
        if present is not None and (_is_standard_output(present) or not stat.S_ISREG(present.st_mode)):
            _write_through(target, present, data)
        else:
            _replace(Path(os.path.realpath(target)), None if present is None else present.st_mode, data)
    except OSError as error:
        # An error of a write, such as a full disk, names no file, and one of the draft names the draft.
        raise OSError(error.errno, error.strerror, str(path)) from error
    return target


def regular_bytes(path: Path, largest: float) -> bytes:
    """Read a file that may be anything.

    Parameters
    ----------
    path : Path
        The file.
    largest : float
        Size up to which it is read [MB].

    Raises
    ------
    FileNotFoundError
        There is no such file.
    OSError
        It is a folder, a device or a pipe, is larger than `largest`, or cannot be read.
    """
    regular_size(path, largest)
    bound = int(1e6 * largest)
    with open(path, "rb") as file:
        data = file.read(bound + 1)  # a file of /proc has no size and no end
    if len(data) > bound:
        raise OSError(errno.EFBIG, f"it has more than {largest:g} MB", str(path))
    return data


def regular_size(path: Path, largest: float) -> int:
    """Give the size [bytes] of a file that may be anything; the errors are those of :func:`regular_bytes`."""
    # Looked at before it is opened: a pipe without a writer would be waited for without end.
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        kind = next((word for test, word in _KINDS if test(status.st_mode)), "no regular file")
        raise OSError(errno.EINVAL, f"it is {kind}", str(path))
    if status.st_size > largest * 1e6:
        raise OSError(errno.EFBIG, f"it has {status.st_size / 1e6:.4g} MB, more than {largest:g} MB", str(path))
    return status.st_size


_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def _present(target: Path) -> os.stat_result | None:
    """Status of what stands at the end of all links; None if nothing does."""
    try:
        return target.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None


def _is_standard_output(present: os.stat_result) -> bool:
    """Whether a file is the one that standard output goes to, as ``/dev/stdout`` is even where that is a file."""
    try:
        return os.path.samestat(present, os.fstat(1))
    except OSError:  # standard output is closed
        return False


def _write_through(target: Path, present: os.stat_result, data: bytes) -> None:
    """Write to what cannot be replaced."""
    if stat.S_ISDIR(present.st_mode):
        raise IsADirectoryError(errno.EISDIR, "it is a folder, a file is needed", str(target))
    if _is_standard_output(present):
        descriptor = os.dup(1)
    else:
        # Without O_NONBLOCK a pipe that nobody reads would be waited for without end.
        descriptor = os.open(target, os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY)
        os.set_blocking(descriptor, True)
    with open(descriptor, "wb", buffering=0) as file:
        rest = memoryview(data)
        while rest:
            rest = rest[file.write(rest) :]


def _replace(target: Path, mode: int | None, data: bytes) -> None:
    """Write a draft in the same folder, because a rename is atomic only within one file system, and rename it."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with draft_file(target.parent) as (draft, file):
        if mode is not None:
            os.fchmod(file.fileno(), stat.S_IMODE(mode))
        file.write(data)
        file.flush()
        draft.replace(target)
