"""Standard output and error stream of a command that outlives their readers.

`heli check | head` ends the pipe before the command is done. The command then goes on without it: its files are
written, and its exit code is its answer. The same holds for a stream that is closed from the start, and a character
that the stream's encoding lacks becomes a question mark.
"""

import io
import os
import sys
from typing import Any


class _Outlet(io.FileIO):
    """A stream whose reader may leave; what is written after that goes nowhere."""

    def write(self, data):
        """Write to the reader, or to nobody."""
        try:
            return super().write(data)
        except BrokenPipeError:
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
    """Write what is still to be written; give what the system says if it cannot be."""
    problem = None
    for descriptor, stream in ((1, sys.stdout), (2, sys.stderr)):
        try:
            stream.flush()
        except OSError as error:
            problem = error.strerror
            _point_to_nothing(descriptor)  # so that the interpreter's own flush at the end says nothing
    return problem


def _stream(descriptor: int, old: Any) -> io.TextIOWrapper:
    outlet = _Outlet(descriptor, "w", closefd=False)
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
