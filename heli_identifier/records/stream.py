"""The bytes of a log, in pieces, as often as they are needed.

A log may be as large as the memory, so it is never held as a whole beside the arrays that it becomes. A text is gone
through twice, first to find the table in it and then to read it. Both times the same bytes must come: the file's
size is that at the beginning, so that a log may still grow, and its hash must be the same at the end.
"""

import errno
import gzip
import hashlib
import io
import zlib
from codecs import getincrementaldecoder
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from heli_identifier.archives import ArchiveError, check_size
from heli_identifier.errors import HELI_TOML, LogError
from heli_identifier.files import regular_size

PIECE = 1 << 20
"""Bytes that are read at once."""

_ADVICE = {
    errno.EFBIG: f"; cut it, or set largest_file under [log] of {HELI_TOML}",
    errno.EINVAL: "; save the log as a file and name that",
}
"""What to do about a file that :func:`heli_identifier.files.regular_size` refuses, by the error's number."""

Pieces = Callable[[], Iterator[bytes]]
"""Gives the content from its beginning, each time it is called."""


@dataclass(eq=False)
class LogFile:
    """A file on the disk.

    Attributes
    ----------
    path : Path
        Where it is.
    size : int
        Its size when it was looked at first [bytes].
    largest : float
        Bytes up to which it may be unpacked.
    sha256 : str
        Hash of its bytes; empty until they have been read to the end.
    """

    path: Path
    size: int
    largest: float
    sha256: str = field(default="", init=False)

    def pieces(self) -> Iterator[bytes]:
        """Give the bytes; unlike those of the last time they are refused.

        Raises
        ------
        LogError
            The file changed, or cannot be read any more.
        """
        digest, left = hashlib.sha256(), self.size
        try:
            with open(self.path, "rb", buffering=0) as file:
                while left and (piece := file.read(min(PIECE, left))):
                    digest.update(piece)
                    left -= len(piece)
                    yield piece
        except OSError as error:
            raise LogError(f"{self.path} cannot be read: {error.strerror or error}.") from error
        if left or self.sha256 not in ("", digest.hexdigest()):
            raise LogError(f"{self.path} changed while it was read; wait until it is complete, or copy it.")
        self.sha256 = digest.hexdigest()

    def unpacked(self) -> Iterator[bytes]:
        """Give the bytes of a gzip file unpacked, as long as that is safe.

        Raises
        ------
        LogError
            It is no gzip file, is damaged or larger than it may be.
        """
        source = self.pieces()
        try:
            size = 0
            with gzip.GzipFile(fileobj=as_file(source), mode="rb") as file:
                while piece := file.read(PIECE):
                    size += len(piece)
                    check_size(size, self.size)
                    if size > self.largest:
                        raise ArchiveError(f"it holds more than {self.largest / 1e6:g} MB unpacked")
                    yield piece
            for _ in source:  # what follows the last member belongs to the hash
                pass
        except ArchiveError as error:
            raise LogError(f"{self.path} is not unpacked: {error}.") from error
        except (OSError, EOFError, zlib.error) as error:
            raise LogError(f"{self.path} is not readable as gzip ({error}); pack it again.") from error


def log_file(path: Path, largest: float) -> LogFile:
    """Look at a log without reading it.

    Parameters
    ----------
    path : Path
        The file.
    largest : float
        Size up to which it is read [MB].

    Raises
    ------
    LogError
        There is no such file, it is a folder, a device or a pipe, or it is too large.
    """
    if path.is_dir():
        raise LogError(f"{path} is a folder; name the log files in it.")
    try:
        return LogFile(path, regular_size(path, largest), 1e6 * largest)
    except FileNotFoundError:
        raise LogError(f"{path} does not exist; check the path.") from None
    except OSError as error:
        advice = _ADVICE.get(error.errno or 0, "")
        raise LogError(f"{path} cannot be read: {error.strerror or error}{advice}.") from error


def in_memory(data: bytes) -> Pieces:
    """Give bytes that are there already."""
    return lambda: (data[begin : begin + PIECE] for begin in range(0, len(data), PIECE))


def recoded(pieces: Pieces, encoding: str, errors: str) -> Pieces:
    """Give text in another encoding as UTF-8."""

    def again() -> Iterator[bytes]:
        decoder = getincrementaldecoder(encoding)(errors)
        for piece in pieces():
            yield decoder.decode(piece).encode("utf-8", "replace")
        yield decoder.decode(b"", final=True).encode("utf-8", "replace")

    return again


def until(pieces: Pieces, end: int) -> Iterator[bytes]:
    """Give the first ``end`` bytes; the others are gone through as well, so that the hash of all is compared."""
    left = end
    for piece in pieces():
        if left > 0:
            yield piece[:left]
        left -= len(piece)


def as_file(pieces: Iterator[bytes]) -> io.BufferedReader:
    """Give pieces as a file that can be read once."""
    return io.BufferedReader(_Stream(pieces), PIECE)


class _Stream(io.RawIOBase):
    def __init__(self, pieces: Iterator[bytes]) -> None:
        self.pieces, self.rest = pieces, memoryview(b"")

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
        while not self.rest:
            piece = next(self.pieces, None)
            if piece is None:
                return 0
            self.rest = memoryview(piece)
        count = min(len(buffer), len(self.rest))
        buffer[:count] = self.rest[:count]
        self.rest = self.rest[count:]
        return count
