"""A log as the contract's CSV file; a file appears whole or not at all."""

import csv
import io
import os
from os import PathLike
from pathlib import Path

from heli_identifier.errors import LogError
from heli_identifier.records.log import Log


def write_whole(path: str | PathLike[str], text: str) -> Path:
    """Write a text file so that no reader ever sees half of it.

    Parameters
    ----------
    path : str or PathLike
        File to make or replace; its folder must exist.
    text : str
        Content, written as UTF-8 with the line ends it has.

    Raises
    ------
    OSError
        If the folder cannot be written to; then nothing is left behind.
    """
    target = Path(path)
    # In the same folder, as only there a rename is one step; the process id keeps two writers apart.
    draft = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        draft.write_text(text, encoding="utf-8", newline="")
        draft.replace(target)
    finally:
        draft.unlink(missing_ok=True)
    return target


def write_log(log: Log, path: str | PathLike[str]) -> Path:
    """Write a log with the contract's header; columns kept aside follow under their own.

    Numbers are printed with as many digits as bring the same double back.

    Parameters
    ----------
    log : Log
        What to write.
    path : str or PathLike
        File to make or replace.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    LogError
        If the file cannot be written.
    """
    columns = {**log.columns, **log.extra}
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(columns)
    # An empty cell is what a hole in a column kept aside is read back from.
    cells = (["" if value != value else value for value in column.tolist()] for column in columns.values())
    rows.writerows(zip(*cells, strict=True))
    try:
        return write_whole(path, text.getvalue())
    except OSError as error:
        raise LogError(f"{path} cannot be written: {error.strerror}.") from error
