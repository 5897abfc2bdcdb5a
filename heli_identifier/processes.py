"""Processes: signals that ask one to end, what it undoes before, its children, and the memory that it may take.

Where :func:`handled_here` has been called, SIGTERM, SIGHUP and Ctrl-C end the process from within their handler: its
child processes are ended, what :func:`undo_at_end` names is undone, and the exit code is 128 and the signal's number,
as a shell gives it. An exception would not do. Python drops one that a signal raises within the callback of a weak
reference or a ``__del__``, and a library may drop it or make another one of it.

What differs between POSIX and Windows stands here; no other module asks which system this is. On Windows resource does
not exist, nor do fork and SIGHUP, and an open file can be neither removed nor replaced.
"""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import current_thread, main_thread
from types import FrameType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from subprocess import Popen

try:
    import resource

    _IS_POSIX = True
except ImportError:
    _IS_POSIX = False

NEW_GROUP: dict[str, Any] = (
    {"creationflags": 0x200} if sys.platform == "win32" else {"start_new_session": True}  # CREATE_NEW_PROCESS_GROUP
)
"""Options of Popen for a process that does not hear Ctrl-C."""

LONGEST_WAIT = None if _IS_POSIX else 0.5
"""Longest wait for another process at a time [s]: on Windows Ctrl-C is not heard before a wait is over."""

NO_WAIT = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0)
"""Flags to open a pipe without a wait for its other end, and a terminal without becoming its process."""

_ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGINT", "SIGBREAK") if hasattr(signal, name))

_to_undo: list[tuple[int, Callable[[], object]]] = []


@contextmanager
def undo_at_end(undo: Callable[[], object]) -> Iterator[None]:
    """Call ``undo`` at the end of the block, or when a signal ends the process within it; twice must do no harm."""
    entry = (os.getpid(), undo)  # a forked process leaves its parent's things alone
    _to_undo.append(entry)
    try:
        yield
    finally:
        undo()
        _to_undo.remove(entry)


@contextmanager
def handled_here() -> Iterator[None]:
    """Let the signals that ask a command to end do so at once, and clean up, while the block runs.

    A signal that is ignored stays so: SIGHUP under nohup, Ctrl-C in the background.
    """
    heard = {}
    if current_thread() is main_thread():  # Python handles signals only there
        before = {number: signal.getsignal(number) for number in _ENDING}
        heard = {number: own for number, own in before.items() if own not in (signal.SIG_IGN, None)}
    for number in heard:
        signal.signal(number, _end)
    try:
        yield
    finally:
        for number, own in heard.items():
            signal.signal(number, own)


def _end(number: int, _frame: FrameType | None) -> None:
    for other in _ENDING:  # a second one would end the cleaning up
        signal.signal(other, signal.SIG_IGN)
    processes = sys.modules.get("multiprocessing")
    for child in processes.active_children() if processes else []:
        child.kill()
        child.join()  # it may write until it is gone
    for process, undo in reversed(_to_undo):
        if process == os.getpid():
            with suppress(Exception):
                undo()
    os._exit(128 + number)


def python_command(code: str, *arguments: str) -> list[str]:
    """Give the command of a Python that runs ``code`` and finds modules where this one does.

    The working folder is left out: it is the user's, and a file there may have the name of a module.
    """
    places = [place for place in sys.path if place]
    return [sys.executable, "-P", "-c", f"import sys; sys.path[:] = {places!r}; {code}", *arguments]


def end_process(process: "Popen[bytes]") -> None:
    """End a process and wait for its end; on POSIX Popen.wait would wait for itself where a signal interrupted it."""
    process.kill()
    if _IS_POSIX:
        with suppress(ChildProcessError):
            os.waitpid(process.pid, 0)
    else:
        process.wait()


def memory_limits() -> list[tuple[int, str]]:
    """Give the limits of this process's memory [bytes] with the commands that set them; Windows has none."""
    kinds = ((resource.RLIMIT_AS, "ulimit -v"), (resource.RLIMIT_DATA, "ulimit -d")) if _IS_POSIX else ()
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
