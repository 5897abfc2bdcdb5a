"""Standard output and error stream of a command that outlives their readers.

`heli check | head` ends the pipe before the command is done. The command then goes on without it: its files are
written, and its exit code is its answer. The same holds for a stream that is closed from the start, and a character
that the stream's encoding lacks becomes a question mark. Where the stream leads to a full disk the command goes on as
well, and says so at its end.
"""

import io
import os
import sys
from select import select
from typing import Any


class _Outlet(io.FileIO):
    """A stream whose reader may leave, or whose disk may be full; what is written after that goes nowhere.

    ``problem`` is what the system said then; None while all is well, and after a reader has left.
    """

    problem: str | None = None

    def write(self, data):
        """Write to the reader, or to nobody."""
        try:
            written = super().write(data)
            while written is None:  # a pipe that does not wait for its reader, and is full
                select([], [self], [])
                written = super().write(data)
            return written
        except OSError as error:
            if not isinstance(error, BrokenPipeError):
                self.problem = error.strerror
            _point_to_nothing(self.fileno())
            return super().write(data)


def install() -> None:
    """Replace ``sys.stdout`` and ``sys.stderr``."""
    for descriptor, mode in ((0, os.O_RDONLY), (1, os.O_WRONLY), (2, os.O_WRONLY)):
        try:
            os.fstat(descriptor)
        except OSError:  # closed: the next file opened would take its place, and receive what is printed
            _point_to_nothing(descriptor, mode)
    sys.stdout = _stream(1, sys.stdout)
    sys.stderr = _stream(2, sys.stderr)


def flush() -> str | None:
    """Write what is still to be written; give what the system said if not everything could be."""
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    return next((outlet.problem for outlet in _outlets if outlet.problem is not None), None)


_outlets: list[_Outlet] = []


def _stream(descriptor: int, old: Any) -> io.TextIOWrapper:
    outlet = _Outlet(descriptor, "w", closefd=False)
    _outlets.append(outlet)
    return io.TextIOWrapper(
        io.BufferedWriter(outlet),
        encoding=old.encoding if old is not None else "utf-8",
        errors="replace",
        line_buffering=descriptor == 2 or outlet.isatty(),
    )


def _point_to_nothing(descriptor: int, mode: int = os.O_WRONLY) -> None:
    nothing = os.open(os.devnull, mode)
    if nothing != descriptor:
        os.dup2(nothing, descriptor)
        os.close(nothing)
