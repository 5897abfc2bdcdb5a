"""A log as the contract's CSV file."""

import csv
import io
from os import PathLike
from pathlib import Path

from heli_identifier.errors import LogError
from heli_identifier.files import write_atomically
from heli_identifier.records.log import Log


def write_log(log: Log, path: str | PathLike[str]) -> Path:
    """Write a log with the contract's header; further columns follow under their own.

    Numbers are printed with enough digits to read the same double back.

    Parameters
    ----------
    log : Log
        The log.
    path : str or PathLike
        File to make or replace. Missing folders above it are made.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    LogError
        If the file cannot be written.
    """
    references = {f"{axis}_reference [rad]": values for axis, values in log.references.items()}
    columns = {**log.columns, **references, **log.extra}
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(columns)
    # A missing value (NaN) of a further column is written as an empty cell, which reads back as NaN.
    cells = (["" if value != value else value for value in column.tolist()] for column in columns.values())
    rows.writerows(zip(*cells, strict=True))
    try:
        return write_atomically(path, text.getvalue())
    except OSError as error:
        raise LogError(f"{path} cannot be written: {error.strerror}.") from error
