"""Write files whole or not at all, read files that may be anything, and make temporary folders (drafts).

A regular file is replaced by a rename, so that a reader finds the old content or the new one, never a part. A link is
followed. A device, a pipe or standard output cannot be replaced, so the data is written into it.

A draft folder is removed when its block ends; SIGKILL and a loss of power leave one behind.

A few kilobytes of zip can hold a petabyte, and an entry's name can lead out of the folder that it is unpacked into. So
the table of contents of an archive is checked before it is unpacked.
"""

import os
import secrets
import shutil
import stat
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from os import PathLike
from pathlib import Path, PurePosixPath

from heli_identifier.processes import undo_at_end

_PREFIX = ".heli-draft-"  # of the names of drafts

LARGEST_ARCHIVE = 2_000_000_000
"""Bytes that an archive may hold unpacked. The largest FMUs, with tables in them, have some hundred megabytes."""

PROTECTED: list[Path] = []
"""Files that the command of this process reads; no result may replace one of them."""

_DISK_BLOCK = 4096  # least size of an entry on a disk [bytes]


def is_protected(path: Path) -> bool:
    """Whether a file is one of :data:`PROTECTED`."""
    return path.is_file() and any(other.is_file() and path.samefile(other) for other in PROTECTED)


def write_atomically(path: str | PathLike[str], content: str | bytes) -> Path:
    """Write a file so that a reader finds the old content or the new one, never a part; make the folders above it.

    The path may also be a device or a pipe. Text is written as UTF-8 with unchanged line ends; a character that UTF-8
    cannot hold becomes a question mark. An OSError names the file, which is then unchanged.
    """
    target = Path(path)
    data = content.encode("utf-8", "replace") if isinstance(content, str) else content
    try:
        present, is_output = None, False
        with suppress(FileNotFoundError, NotADirectoryError):
            present = target.stat()  # follows links; a link to itself is an error
        with suppress(OSError):  # standard output may be closed
            is_output = present is not None and os.path.samestat(present, os.fstat(1))
        if present is None or (stat.S_ISREG(present.st_mode) and not is_output):
            _replace(Path(os.path.realpath(target)), present, data)
        else:
            # `-o /dev/stdout >> FILE` must keep the content of FILE
            with open(os.dup(1) if is_output else target, "wb") as file:
                file.write(data)
    except OSError as error:
        # The error of a write, such as a full disk, names no file, and that of a draft names the draft.
        raise OSError(error.errno, error.strerror, str(path)) from error
    return target


def _replace(target: Path, present: os.stat_result | None, data: bytes) -> None:
    """Write a draft in the same folder, because a rename is atomic only within one file system, and rename it."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with draft_folder(target.parent) as folder:
        draft = folder / "draft"
        draft.write_bytes(data)
        if present is not None:
            draft.chmod(stat.S_IMODE(present.st_mode))
        draft.replace(target)


def read_limited(
    path: Path, largest: float, kind: type[Exception], missing: str = "", folder: str = "", large: str = ""
) -> bytes:
    """Read a file that a user named, which may be anything, up to a size of ``largest`` [MB].

    An error of ``kind`` says in a sentence why the file cannot be read; ``missing``, ``folder`` and ``large`` tell the
    user what to do if it is missing, a folder, or too large.
    """
    try:
        # Its status is read before it is opened: opening a pipe without a writer would wait for ever.
        status = path.stat()
        if folder and stat.S_ISDIR(status.st_mode):
            problem = f"is a folder; {folder}"
        elif not stat.S_ISREG(status.st_mode):
            problem = "cannot be read: it is a folder, a pipe or a device; save it as a file and name that"
        elif status.st_size > largest * 1e6:
            problem = f"cannot be read: it has {status.st_size / 1e6:.4g} MB, more than {largest:g} MB{large}"
        else:
            with open(path, "rb") as file:
                return file.read(status.st_size)  # ignores what is appended meanwhile; a file of /proc has no size
    except FileNotFoundError:
        problem = f"does not exist{missing}"
    except OSError as error:
        problem = f"cannot be read: {error.strerror or error}"
    raise kind(f"{path} {problem}.")


@contextmanager
def draft_folder(folder: str | PathLike[str] | None = None) -> Iterator[Path]:
    """Make a folder in ``folder``, by default that of temporary files, for the block; an OSError names ``folder``."""
    # gettempdir tries to write a file, which fails if the disk is full
    parent = Path(tempfile.gettempdir() if folder is None else folder)
    path = parent / f"{_PREFIX}{secrets.token_hex(8)}"
    with undo_at_end(lambda: shutil.rmtree(path, ignore_errors=True)):
        try:
            path.mkdir(0o700)
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(parent)) from error
        yield path


def check_zip(path: Path) -> None:
    """Refuse a zip that cannot be unpacked safely; zipfile refuses encrypted ones and unpacks a link as a file.

    A ValueError says that it is no zip, holds more than :data:`LARGEST_ARCHIVE`, or has an entry outside of its folder.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
    except (zipfile.BadZipFile, NotImplementedError, ValueError) as error:
        raise ValueError(f"it is no zip archive ({error})") from error
    for entry in entries:
        name = PurePosixPath(entry.filename.replace("\\", "/"))
        if name.is_absolute() or ".." in name.parts or ":" in (name.parts or ("",))[0]:
            raise ValueError(f"its entry {entry.filename!r} lies outside of the archive")
    if (unpacked := sum(max(entry.file_size, _DISK_BLOCK) for entry in entries)) > LARGEST_ARCHIVE:
        most = f"at most {LARGEST_ARCHIVE / 1e9:g} GB are unpacked"
        raise ValueError(f"it holds {unpacked / 1e9:.3g} GB unpacked, {most}")
