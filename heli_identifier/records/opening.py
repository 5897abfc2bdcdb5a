"""From a log's file to a table: who reads it, by the ending of its name, and what is looked at before.

The libraries that read MATLAB, HDF5, TDMS or MDF files are written for honest ones. A damaged or hostile file makes
some of them crash the process (scipy's reader of MATLAB files, for one), run without end, or ask for all memory. So a
forked copy of this process reads the file first. If it comes through, or ends with an exception, this process may do
the same.
"""

import errno
import faulthandler
import gzip
import hashlib
import io
import os
import resource
import signal
import zlib
from collections.abc import Callable, Iterator
from math import ceil
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from heli_identifier.archives import ArchiveError, check_size
from heli_identifier.errors import HELI_TOML, LogError
from heli_identifier.files import draft_folder, regular_bytes, regular_size
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

_OUT_OF_MEMORY = 3


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
    library = need(reader.module, reader.package, file, reader.what)
    if not reader.is_hardened:
        check_survives(lambda: reader.read(library, path, file, mapped), path.stat().st_size, file)
    try:
        return reader.read(library, path, file, mapped)
    except LogError:
        raise
    except Exception as error:  # each library raises what its parser does on a damaged file
        said = str(error).replace(str(path), file).strip().splitlines() or [type(error).__name__]
        raise LogError(f"{file} is not readable as {reader.what} ({said[0][:200]}); save it again.") from error


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
        Reads the file; what it gives or raises does not matter here.
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
    child = os.fork()
    if child == 0:
        _read_and_leave(read, patience)
    _, status = os.waitpid(child, 0)
    refused = f"{file} is not readable: "
    if os.WIFSIGNALED(status) and os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGALRM):
        raise LogError(f"{refused}its reader came to no end within {patience:.3g} s; save it again.")
    if os.WIFSIGNALED(status):
        raise LogError(f"{refused}it is damaged so that its reader crashes; save it again.")
    if os.WEXITSTATUS(status) == _OUT_OF_MEMORY:
        raise LogError(f"{refused}it asks for more than {MEMORY / 1e9:g} GB of memory; save it again.")


def _read_and_leave(read: Callable[[], object], patience: float) -> NoReturn:
    """Read in the child, without a word, and end it without any of the parent's cleaning up."""
    code = 0
    try:
        faulthandler.disable()  # a crash of the reader is an answer here, not news
        for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT, signal.SIGXCPU, signal.SIGALRM):
            signal.signal(number, signal.SIG_DFL)
        nothing = os.open(os.devnull, os.O_RDWR)
        for descriptor in (0, 1, 2):
            os.dup2(nothing, descriptor)
        held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        _lower(resource.RLIMIT_CORE, 0)  # no image of a crashed reader is left behind
        _lower(resource.RLIMIT_CPU, ceil(patience))
        _lower(resource.RLIMIT_AS, held + MEMORY)
        signal.setitimer(signal.ITIMER_REAL, BUSY * patience)
        read()
    except MemoryError:
        code = _OUT_OF_MEMORY
    except BaseException:  # the parent meets it as well, and says it
        code = 0
    finally:
        os._exit(code)


def _lower(limit: int, bound: int) -> None:
    """Lower a limit of this process to ``bound`` unless it is lower."""
    now, hard = resource.getrlimit(limit)
    resource.setrlimit(limit, (bound if now == resource.RLIM_INFINITY else min(now, bound), hard))
