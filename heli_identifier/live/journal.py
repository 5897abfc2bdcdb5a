"""Files that grow while a command runs, so that what was written outlives the command however it ends.

Every row is handed to the system as it comes: a command that is killed loses none. Once a second the system is asked to
put them on the disk, so that a loss of power costs a second.
"""

import os
from collections.abc import Sequence
from pathlib import Path
from time import monotonic

from heli_identifier.errors import ConfigurationError

SYNCED_EVERY = 1.0
"""Time between two requests to put rows on the disk [s]."""


class Journal:
    """A CSV file that only grows.

    Parameters
    ----------
    path : Path
        File to make.
    columns : sequence of str
        Its header.

    Raises
    ------
    ConfigurationError
        The file is there already: it holds what was measured before, and is never replaced.
    """

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        self.path = path
        self.rows = 0
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | os.O_CLOEXEC, 0o666)
        except FileExistsError as error:
            raise ConfigurationError(
                f"{path} is there already and is not replaced, it holds what was recorded before; name another folder."
            ) from error
        self._pending = [",".join(columns) + "\n"]
        self._synced = monotonic()
        self.flush()

    def add(self, row: Sequence[float]) -> None:
        """Add a row; :meth:`flush` writes it. Numbers read back as the same double."""
        self._pending.append(",".join(map(repr, row)) + "\n")
        self.rows += 1

    def flush(self) -> None:
        """Hand the rows that were added to the system.

        Raises
        ------
        OSError
            The disk is full, or gone; it names the file.
        """
        if not self._pending:
            return
        rest = memoryview("".join(self._pending).encode())
        self._pending.clear()
        try:
            while rest:
                rest = rest[os.write(self._file, rest) :]
            if monotonic() - self._synced > SYNCED_EVERY:
                self._synced = monotonic()
                os.fsync(self._file)
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(self.path)) from error

    def close(self) -> None:
        """Write what is left and close the file."""
        try:
            self.flush()
            os.fsync(self._file)
        finally:
            os.close(self._file)
