"""What differs between POSIX and Windows; no other module asks which system this is.

On Windows resource does not exist, nor do fork, SIGHUP and masks of signals, and a file that is open can be
neither removed nor replaced. Each function here has an equal there, or says what is missing.
"""

import faulthandler
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from math import ceil
from pathlib import Path
from platform import node
from threading import Thread
from time import process_time, sleep
from typing import TYPE_CHECKING, Any, Literal, NoReturn
from zlib import crc32

if TYPE_CHECKING:
    from subprocess import Popen

try:
    import resource

    _IS_POSIX = True
except ImportError:
    _IS_POSIX = False

ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGINT", "SIGBREAK") if hasattr(signal, name))
"""Signals that ask a command to end: SIGHUP on POSIX only, SIGBREAK (Ctrl-Break) on Windows only."""

NEW_GROUP: dict[str, Any] = (
    {"creationflags": 0x200} if sys.platform == "win32" else {"start_new_session": True}  # CREATE_NEW_PROCESS_GROUP
)
"""Options of Popen for a process that does not hear Ctrl-C."""

NO_WAIT = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0)
"""Flags to open a pipe without a wait for its other end, and a terminal without becoming its process."""

_OUT_OF_MEMORY, _NO_END = 3, 4  # exit codes of a process that reads

_PR_SET_PDEATHSIG = 1  # of Linux' <sys/prctl.h>


# --- processes -------------------------------------------------------------------------------------------------------


@contextmanager
def unheard(number: signal.Signals) -> Iterator[None]:
    """Hold a signal back in the block; processes that are started in it never hear it (Windows: see NEW_GROUP)."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [number])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def end_process(process: "Popen[bytes]") -> None:
    """End a process and wait for its end; on POSIX Popen.wait would wait for itself where a signal interrupted it."""
    process.kill()
    if _IS_POSIX:
        with suppress(ChildProcessError):
            os.waitpid(process.pid, 0)
    else:
        process.wait()


def end_with_parent(parent: int) -> None:
    """Let this process end when the process ``parent`` that started it ends, however that ends."""
    if _IS_POSIX and sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # it ended before that was arranged
            os._exit(0)
    else:
        Thread(target=_wait_for_end, args=(parent,), daemon=True).start()


def process_runs(number: int) -> bool:
    """Whether this machine runs a process of this number."""
    if sys.platform == "win32":
        return _waited(number, 0)
    try:
        os.kill(number, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:  # somebody else's
        pass
    return True


def machine() -> str:
    """Name where the numbers of processes hold: the machine, or a container with numbers of its own."""
    space = 0
    with suppress(OSError):
        space = os.stat("/proc/self/ns/pid").st_ino
    return f"{crc32(f'{node()} {space}'.encode()):08x}"


def _wait_for_end(parent: int) -> None:
    """Wait for the end of the parent, then end this process."""
    if sys.platform == "win32":
        _waited(parent, 0xFFFFFFFF)
    else:
        while os.getppid() == parent:
            sleep(0.5)
    os._exit(0)


def _waited(number: int, milliseconds: int) -> bool:
    """Wait for the end of a process on Windows; whether it still runs then."""
    if sys.platform != "win32":
        raise NotImplementedError
    import ctypes

    kernel = ctypes.WinDLL("kernel32", use_last_error=True)
    kernel.OpenProcess.restype = ctypes.c_void_p
    kernel.WaitForSingleObject.argtypes = (ctypes.c_void_p, ctypes.c_uint32)
    kernel.CloseHandle.argtypes = (ctypes.c_void_p,)
    process = kernel.OpenProcess(0x00100000, False, number)  # SYNCHRONIZE
    if not process:
        return ctypes.get_last_error() == 5  # access is denied: somebody else's
    try:
        return bool(kernel.WaitForSingleObject(process, milliseconds))
    finally:
        kernel.CloseHandle(process)


# --- bounds ----------------------------------------------------------------------------------------------------------


def memory_limits() -> list[tuple[int, str]]:
    """Give the limits of this process's memory [bytes] with the commands that set them; Windows has none."""
    if not _IS_POSIX:
        return []
    kinds = ((resource.RLIMIT_AS, "ulimit -v"), (resource.RLIMIT_DATA, "ulimit -d"))
    found = [(resource.getrlimit(kind)[0], name) for kind, name in kinds]
    return [(limit, name) for limit, name in found if limit != resource.RLIM_INFINITY]


def run_bounded(
    read: Callable[[], object], patience: float, waited: float, memory: int
) -> Literal["", "crash", "no end", "out of memory"]:
    """Run a reader in a process of its own, and say how that failed; an exception of the reader is no failure.

    POSIX: a forked copy of this process under limits of the system. Windows: a new process, to which `read` is pickled;
    it watches its own time, and its memory is not bounded.

    Parameters
    ----------
    read : callable
        What it gives or raises does not matter.
    patience, waited : float
        Longest time it may compute, and that may pass by the clock [s].
    memory : int
        What it may take beyond what this process has [bytes].
    """
    if _IS_POSIX:
        child = os.fork()
        if child == 0:
            _read_and_leave(read, lambda: _limit(patience, waited, memory))
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        no_end = code in (-signal.SIGXCPU, -signal.SIGALRM)
    else:
        from multiprocessing import get_context

        process = get_context("spawn").Process(target=_read_in_time, args=(read, patience), daemon=True)
        process.start()
        process.join(waited)
        no_end = process.is_alive()
        if no_end:
            process.kill()
            process.join()
        code = process.exitcode or 0
        no_end = no_end or code == _NO_END
    if no_end:
        return "no end"
    return "" if code == 0 else "out of memory" if code == _OUT_OF_MEMORY else "crash"


def _read_in_time(read: Callable[[], object], patience: float) -> NoReturn:
    """Read in a new process."""

    def watch() -> None:
        bound = process_time() + patience
        while process_time() < bound:
            sleep(min(0.1, patience))
        os._exit(_NO_END)

    _read_and_leave(read, Thread(target=watch, daemon=True).start)


def _read_and_leave(read: Callable[[], object], bound: Callable[[], object]) -> NoReturn:
    """Read in the child, without a word, and end it without any of the parent's cleaning up."""
    code = 0
    try:
        faulthandler.disable()  # a crash of the reader is an answer here, not news
        nothing = os.open(os.devnull, os.O_RDWR)
        for descriptor in (0, 1, 2):
            os.dup2(nothing, descriptor)
        bound()
        read()
    except MemoryError:
        code = _OUT_OF_MEMORY
    except BaseException:  # the parent meets it as well, and says it
        code = 0
    finally:
        os._exit(code)


def _limit(patience: float, waited: float, memory: int) -> None:
    """Bound a forked process."""
    for number in (*ENDING, signal.SIGXCPU, signal.SIGALRM):
        signal.signal(number, signal.SIG_DFL)
    held = 0  # where there is no /proc, as on macOS, it is little beside the bound
    with suppress(OSError):
        held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    _lower(resource.RLIMIT_CORE, 0)  # no image of a crashed reader is left behind
    _lower(resource.RLIMIT_CPU, ceil(patience))
    with suppress(ValueError, OSError):  # macOS may refuse to bound the memory
        _lower(resource.RLIMIT_AS, held + memory)
    signal.setitimer(signal.ITIMER_REAL, waited)


def _lower(limit: int, bound: int) -> None:
    """Lower a limit of this process to ``bound`` unless it is lower."""
    now, hard = resource.getrlimit(limit)
    resource.setrlimit(limit, (bound if now == resource.RLIM_INFINITY else min(now, bound), hard))
