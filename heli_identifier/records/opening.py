"""From a path to a table: what kind of file it is, whether it may be read, and who reads it."""

import errno
import gzip
import io
import zlib
from pathlib import Path

from heli_identifier.archives import ArchiveError, unpacked
from heli_identifier.errors import HELI_TOML, LogError
from heli_identifier.files import regular_bytes
from heli_identifier.records.columnar import FORMATS, read_columnar
from heli_identifier.records.format import LogFormat
from heli_identifier.records.matlab import read_matlab_table
from heli_identifier.records.spreadsheet import read_spreadsheet
from heli_identifier.records.table import Table
from heli_identifier.records.text import read_text_table

_ADVICE = {
    errno.EFBIG: f"; cut it, or set largest_file under [log] of {HELI_TOML}",
    errno.EINVAL: "; save the log as a file and name that",
}
"""What to do about a file that :func:`heli_identifier.files.regular_bytes` refuses, by the error's number."""


def log_bytes(path: Path, largest: float) -> bytes:
    """Read the bytes of a log.

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
        return regular_bytes(path, largest)
    except FileNotFoundError:
        raise LogError(f"{path} does not exist; check the path.") from None
    except OSError as error:
        advice = _ADVICE.get(error.errno or 0, "")
        raise LogError(f"{path} cannot be read: {error.strerror or error}{advice}.") from error


def table_of(path: Path, data: bytes, format: LogFormat) -> Table:
    """Read the bytes of a log as a table, by the ending of its name.

    Raises
    ------
    LogError
        They are no table.
    """
    file, ending = str(path), path.suffix.lower()
    mapped = frozenset(format.columns.values())
    if ending == ".gz":
        try:
            data = unpacked(gzip.open(io.BytesIO(data)), len(data), int(1e6 * format.largest_file))
        except ArchiveError as error:
            raise LogError(f"{file} is not unpacked: {error}.") from error
        except (OSError, EOFError, zlib.error) as error:
            raise LogError(f"{file} is not readable as gzip ({error}); pack it again.") from error
        ending = Path(path.stem).suffix.lower()
    if ending == ".mat":
        return read_matlab_table(data, file)
    if ending == ".xlsx":
        return read_spreadsheet(path, data, file, mapped)
    if ending in FORMATS:
        return read_columnar(Path(path.stem) if path.suffix.lower() == ".gz" else path, data, file)
    return read_text_table(data, file, format.decimal, mapped)
