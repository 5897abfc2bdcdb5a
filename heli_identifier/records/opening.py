"""From a log's file to a table: who reads it, by the ending of its name, and what is looked at before.

A damaged binary file can make the library that reads it crash the process (scipy's reader of MATLAB files, for one),
run without end, or ask for all memory: zeros pack to a thousandth. So a process of its own reads it, within bounds, and
hands over what it found.
"""

import faulthandler
import gzip
import hashlib
import io
import os
import pickle
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from heli_identifier.errors import LogError
from heli_identifier.files import draft_folder, given_bytes
from heli_identifier.processes import bound_memory, python_command

from .binary import LARGER, READERS, read_binary
from .columns import Table
from .configuration import LogFormat
from .text import read_text

PATIENCE, PATIENCE_PER_MB, MEMORY = 30.0, 3.0, 8_000_000_000
"""Longest time that a reader may take [s], and its growth with the size of the file [s/MB]: some 30 times what readers
need, because a machine that does other things, or a slow disk, is no defect. Memory that it may take beyond what its
process has [bytes]; Windows sets no bound."""


def open_table(path: Path, format: LogFormat) -> tuple[Table, str]:
    """Read a log as a table, and the SHA-256 of its bytes; a LogError if it is no file, too large or no table."""
    inside = "name the log files in it"
    data = given_bytes(path, format.largest_file, LogError, "; check the path", inside, LARGER)
    digest, name = hashlib.sha256(data).hexdigest(), path.name.lower()
    if name.endswith(".gz"):
        data, name = _unpacked(data, path, format.largest_file), name.removesuffix(".gz")
    ending = Path(name).suffix
    if ending not in READERS:
        return read_text(data, str(path), format), digest
    with draft_folder() as folder:  # what is read is what was hashed, whatever happens to the file
        copy = folder / f"log{ending}"
        copy.write_bytes(data)
        size = len(data)
        del data
        return apart(read_binary, (copy, str(path), format), size, str(path)), digest


def _unpacked(data: bytes, path: Path, largest: float) -> bytes:
    """Give the content of a gzip file of at most ``largest`` MB."""
    content = bytearray()
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(data)) as file:
            while len(content) <= 1e6 * largest and (piece := file.read(1 << 20)):
                content += piece
    except (OSError, EOFError, zlib.error) as error:
        raise LogError(f"{path} is not readable as gzip ({error}); pack it again.") from error
    if len(content) > 1e6 * largest:
        raise LogError(f"{path} cannot be read: it has more than {largest:g} MB unpacked{LARGER}.")
    return bytes(content)


def apart(read: Callable[..., Any], arguments: tuple[Any, ...], size: int, file: str) -> Any:
    """Call ``read`` with ``arguments`` in a process of its own, which may crash, and raise the LogError that it raises.

    A LogError names ``file``, of ``size`` [bytes], if that process gives no answer.
    """
    patience = PATIENCE + PATIENCE_PER_MB * 1e-6 * size
    command = python_command(f"from {__name__} import _answer; _answer()")
    done = subprocess.run(command, input=pickle.dumps((read, arguments, patience, MEMORY)), capture_output=True)
    if done.returncode != 0:
        most = f"{MEMORY / 1e9:g} GB of memory"
        reasons = f"its reader crashes, comes to no end within {patience:.3g} s, or asks for more than {most}"
        raise LogError(f"{file} is not readable: {reasons}; save it again.")
    answer = pickle.loads(done.stdout)
    if isinstance(answer, LogError):
        raise answer
    return answer


def _answer() -> None:
    """Read in the process apart, which ends without an answer behind its bounds; what libraries print goes nowhere."""
    read, arguments, patience, memory = pickle.load(sys.stdin.buffer)
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)
        faulthandler.dump_traceback_later(patience, exit=True)
        bound_memory(memory)
        try:
            answer = read(*arguments)
        except LogError as error:
            answer = error
        pickle.dump(answer, out, protocol=pickle.HIGHEST_PROTOCOL)
