"""From a log's file to a table: who reads it, by the ending of its name."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from heli_identifier.errors import LogError
from heli_identifier.files import draft_folder
from heli_identifier.records.columnar import FORMATS, read_columnar
from heli_identifier.records.format import LogFormat
from heli_identifier.records.matlab import read_matlab_table
from heli_identifier.records.spreadsheet import read_spreadsheet
from heli_identifier.records.stream import LogFile
from heli_identifier.records.table import Table
from heli_identifier.records.text import read_text_table


def table_of(log: LogFile, format: LogFormat) -> Table:
    """Read a log as a table; its hash is known afterwards.

    Raises
    ------
    LogError
        It is no table.
    """
    file, name = str(log.path), log.path
    packed = name.suffix.lower() == ".gz"
    if packed:
        name = Path(name.stem)
    ending = name.suffix.lower()
    mapped = frozenset(format.columns.values())
    if ending not in (".mat", ".xlsx", *FORMATS):
        return read_text_table(log.unpacked if packed else log.pieces, file, format.decimal, mapped)
    with _on_disk(log, packed, ending) as path:
        if ending == ".mat":
            return read_matlab_table(path, file)
        if ending == ".xlsx":
            return read_spreadsheet(path, file, mapped)
        return read_columnar(path, file)


@contextmanager
def _on_disk(log: LogFile, packed: bool, ending: str) -> Iterator[Path]:
    """Give a binary log as a file that libraries can read from the disk, unpacked where it is packed.

    Raises
    ------
    LogError
        It changed while it was read.
    """
    if packed:
        with draft_folder() as folder:
            path = folder / f"log{ending}"
            with open(path, "wb") as out:
                for piece in log.unpacked():
                    out.write(piece)
            yield path
        return
    for _ in log.pieces():  # for the hash
        pass
    before = log.path.stat()
    yield log.path
    after = log.path.stat()
    if (before.st_size, before.st_mtime_ns, before.st_ino) != (after.st_size, after.st_mtime_ns, after.st_ino):
        raise LogError(f"{log.path} changed while it was read; wait until it is complete, or copy it.")
