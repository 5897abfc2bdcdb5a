"""What differs between POSIX and Windows; no other module asks which system this is.

On Windows resource does not exist, nor do fork, SIGHUP and masks of signals, and a file that is open can be
neither removed nor replaced. Each function here has an equal there, or says what is missing.
"""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Thread
from time import sleep
from typing import TYPE_CHECKING, Any

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

_PR_SET_PDEATHSIG = 1  # of Linux' <sys/prctl.h>


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


def _wait_for_end(parent: int) -> None:
    """Wait for the end of the parent, then end this process."""
    if sys.platform == "win32":
        import ctypes

        kernel = ctypes.WinDLL("kernel32")
        kernel.OpenProcess.restype = ctypes.c_void_p
        kernel.WaitForSingleObject.argtypes = (ctypes.c_void_p, ctypes.c_uint32)
        if process := kernel.OpenProcess(0x00100000, False, parent):  # SYNCHRONIZE
            kernel.WaitForSingleObject(process, 0xFFFFFFFF)
    else:
        while os.getppid() == parent:
            sleep(0.5)
    os._exit(0)


def memory_limits() -> list[tuple[int, str]]:
    """Give the limits of this process's memory [bytes] with the commands that set them; Windows has none."""
    if not _IS_POSIX:
        return []
    kinds = ((resource.RLIMIT_AS, "ulimit -v"), (resource.RLIMIT_DATA, "ulimit -d"))
    found = [(resource.getrlimit(kind)[0], name) for kind, name in kinds]
    return [(limit, name) for limit, name in found if limit != resource.RLIM_INFINITY]


def bound_memory(more: int) -> None:
    """Let this process take at most ``more`` bytes beyond its memory, and leave no image of it; not on Windows."""
    if not _IS_POSIX:
        return
    held = 0  # where there is no /proc, as on macOS, it is little beside the bound
    with suppress(OSError):
        held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    for kind, bound in ((resource.RLIMIT_AS, held + more), (resource.RLIMIT_CORE, 0)):
        now, hard = resource.getrlimit(kind)
        with suppress(ValueError, OSError):  # macOS may refuse to bound the memory
            resource.setrlimit(kind, (bound if now == resource.RLIM_INFINITY else min(now, bound), hard))
