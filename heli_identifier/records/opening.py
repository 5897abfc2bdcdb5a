"""From a log's file to a table: who reads it, by the ending of its name, and what is looked at before.

The libraries that read MATLAB, HDF5, TDMS or MDF files are written for honest ones. A damaged or hostile file makes
some of them crash the process (scipy's reader of MATLAB files, for one), run without end, or ask for all memory. So a
process of its own reads the file first. If it comes through, or ends with an exception, this process may do
the same.
"""

import errno
import gzip
import hashlib
import io
import zlib
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from heli_identifier.archives import ArchiveError, check_size
from heli_identifier.errors import HELI_TOML, LogError
from heli_identifier.files import draft_folder, regular_bytes, regular_size
from heli_identifier.platform import run_bounded
from heli_identifier.records.columnar import read_mdf, read_parquet, read_tdms, read_workbook
from heli_identifier.records.configuration import LogFormat
from heli_identifier.records.matlab import read_matlab
from heli_identifier.records.table import Table, need
from heli_identifier.records.text import read_text

PATIENCE, PATIENCE_PER_MB = 10.0, 0.1
"""Longest time that a parser may compute [s], and its growth with the size [s/MB], ten times what readers need."""

BUSY = 30.0
"""How many times as long it may take by the clock: a machine that does other things, or a slow disk, is no defect."""

MEMORY = 8_000_000_000
"""Memory that a parser may take beyond what this process has [bytes]."""


class _Reader(NamedTuple):
    """Who reads a binary format."""

    what: str
    module: str
    package: str
    read: Callable[[Any, Path, str, frozenset[str]], Table]
    is_hardened: bool = False  # Arrow's is fuzzed all the time, and its threads survive no fork; a zip is looked at


_READERS = {
    ".mat": _Reader("a MATLAB file", "scipy.io", "scipy", read_matlab),
    ".xlsx": _Reader("an Excel workbook", "openpyxl", "openpyxl", read_workbook, is_hardened=True),
    ".parquet": _Reader("a Parquet file", "pyarrow.parquet", "pyarrow", read_parquet, is_hardened=True),
    ".tdms": _Reader("a TDMS file", "nptdms", "npTDMS", read_tdms),
    ".mf4": _Reader("an MDF file", "asammdf", "asammdf", read_mdf),
    ".mdf": _Reader("an MDF file", "asammdf", "asammdf", read_mdf),
}


def open_table(path: Path, format: LogFormat) -> tuple[Table, str]:
    """Read a log as a table; give the SHA-256 of its bytes as well.

    Raises
    ------
    LogError
        There is no such file, it is a folder, a device or a pipe, too large, changes meanwhile, or is no table.
    """
    if path.is_dir():
        raise LogError(f"{path} is a folder; name the log files in it.")
    packed = path.suffix.lower() == ".gz"
    reader = _READERS.get(Path(path.stem if packed else path.name).suffix.lower())
    mapped = frozenset(format.columns.values())
    try:
        if reader and not packed:
            before = path.stat()
            regular_size(path, format.largest_file)
            with open(path, "rb") as file:
                digest = hashlib.file_digest(file, "sha256").hexdigest()
            table = _read_binary(reader, path, str(path), mapped)
            after = path.stat()
            if (before.st_size, before.st_mtime_ns, before.st_ino) != (after.st_size, after.st_mtime_ns, after.st_ino):
                raise LogError(f"{path} changed while it was read; wait until it is complete, or copy it.")
            return table, digest
        data = regular_bytes(path, format.largest_file)
    except FileNotFoundError:
        raise LogError(f"{path} does not exist; check the path.") from None
    except OSError as error:
        advice = {
            errno.EFBIG: f"; cut it, or set largest_file under [log] of {HELI_TOML}",
            errno.EINVAL: "; save the log as a file and name that",
        }.get(error.errno or 0, "")
        raise LogError(f"{path} cannot be read: {error.strerror or error}{advice}.") from error
    digest = hashlib.sha256(data).hexdigest()
    if packed:
        data = b"".join(_unpacked(data, path, format.largest_file))
    if reader is None:
        return read_text(data, str(path), format.decimal, mapped), digest
    with draft_folder() as folder:
        (folder / "log").write_bytes(data)
        return _read_binary(reader, folder / "log", str(path), mapped), digest


def _read_binary(reader: _Reader, path: Path, file: str, mapped: frozenset[str]) -> Table:
    read = partial(_read_by, reader, path, file, mapped)
    need(reader.module, reader.package, file, reader.what)
    if not reader.is_hardened:
        check_survives(read, path.stat().st_size, file)
    try:
        return read()
    except LogError:
        raise
    except Exception as error:  # each library raises what its parser does on a damaged file
        said = str(error).replace(str(path), file).strip().splitlines() or [type(error).__name__]
        raise LogError(f"{file} is not readable as {reader.what} ({said[0][:200]}); save it again.") from error


def _read_by(reader: _Reader, path: Path, file: str, mapped: frozenset[str]) -> Table:
    return reader.read(need(reader.module, reader.package, file, reader.what), path, file, mapped)


def _unpacked(data: bytes, path: Path, largest: float) -> Iterator[bytes]:
    """Give the content of a gzip file, as long as that is safe."""
    size = 0
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(data)) as file:
            while piece := file.read(1 << 20):
                size += len(piece)
                check_size(size, len(data))
                if size > 1e6 * largest:
                    raise ArchiveError(f"it holds more than {largest:g} MB unpacked")
                yield piece
    except ArchiveError as error:
        raise LogError(f"{path} is not unpacked: {error}.") from error
    except (OSError, EOFError, zlib.error) as error:
        raise LogError(f"{path} is not readable as gzip ({error}); pack it again.") from error


def check_survives(read: Callable[[], object], size: int, file: str) -> None:
    """Refuse a file that ends the process that reads it, or does not let it end.

    Parameters
    ----------
    read : callable
        Reads the file; what it gives or raises does not matter here. It can be pickled, on Windows.
    size : int
        Size of the file [bytes].
    file : str
        Name of the file for messages.

    Raises
    ------
    LogError
        The reader crashed, took longer than `PATIENCE` or more than `MEMORY`.
    """
    patience = PATIENCE + PATIENCE_PER_MB * 1e-6 * size
    problem = {
        "no end": f"its reader came to no end within {patience:.3g} s",
        "crash": "it is damaged so that its reader crashes",
        "out of memory": f"it asks for more than {MEMORY / 1e9:g} GB of memory",
    }.get(run_bounded(read, patience, BUSY * patience, MEMORY))
    if problem is not None:
        raise LogError(f"{file} is not readable: {problem}; save it again.")
