"""A parser of a binary format, run first in a process of its own.

The libraries that read MATLAB, HDF5, TDMS or MDF files are written for honest ones. A damaged or hostile file makes
some of them crash the process (scipy's reader of MATLAB files, for one), run without end, or ask for all memory. So a
forked copy of this process reads the file first. If it comes through, or ends with an exception, this process may do
the same.
"""

import faulthandler
import os
import resource
import signal
import time
from collections.abc import Callable
from math import ceil

from heli_identifier.errors import LogError

PATIENCE, PATIENCE_PER_MB = 10.0, 0.1
"""Longest time that a parser may compute [s], and its growth with the size [s/MB], ten times what readers need."""

BUSY = 30.0
"""How many times as long it may take by the clock: a machine that does other things, or a slow disk, is no defect."""

MEMORY = 8_000_000_000
"""Memory that a parser may take beyond what this process has [bytes]."""

_OUT_OF_MEMORY = 3


def check_survives(read: Callable[[], object], size: int, file: str) -> None:
    """Refuse a file that ends the process that reads it.

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
        _read_and_leave(read, ceil(patience))
    ends, pause, late = time.monotonic() + BUSY * patience, 0.001, False
    while True:
        done, status = os.waitpid(child, 0 if late else os.WNOHANG)
        if done:
            break
        if time.monotonic() > ends:
            os.kill(child, signal.SIGKILL)
            late = True
        time.sleep(pause)
        pause = min(2.0 * pause, 0.05)
    if late or (os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGXCPU):
        raise LogError(f"{file} is not readable: its reader came to no end within {patience:.3g} s; save it again.")
    if os.WIFSIGNALED(status):
        raise LogError(f"{file} is not readable: it is damaged so that its reader crashes; save it again.")
    if os.WEXITSTATUS(status) == _OUT_OF_MEMORY:
        raise LogError(f"{file} is not readable: it asks for more than {MEMORY / 1e9:g} GB of memory; save it again.")


def _read_and_leave(read: Callable[[], object], patience: int) -> None:
    """Read in the child, without a word, and end it without any of the parent's cleaning up.

    The system ends it when it has computed for ``patience`` [s].
    """
    code = 0
    try:
        faulthandler.disable()  # a crash of the reader is an answer here, not news
        for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT, signal.SIGXCPU):
            signal.signal(number, signal.SIG_DFL)
        nothing = os.open(os.devnull, os.O_RDWR)
        for descriptor in (0, 1, 2):
            os.dup2(nothing, descriptor)
        with open("/proc/self/statm", encoding="ascii") as file:
            held = int(file.read().split()[0]) * resource.getpagesize()
        _lower(resource.RLIMIT_CORE, 0)  # no image of a crashed reader is left behind
        _lower(resource.RLIMIT_CPU, patience)
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        bound = held + MEMORY if hard == resource.RLIM_INFINITY else min(held + MEMORY, hard)
        resource.setrlimit(resource.RLIMIT_AS, (bound, hard))
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
