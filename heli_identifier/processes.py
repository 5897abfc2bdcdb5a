"""Processes: the signals that end one, its clean-up, its child processes, and the memory that they may take.

Within a block of :func:`clean_up_on_signals`, SIGTERM, SIGHUP and Ctrl-C end the process from within their handler: it
kills the child processes, calls what :func:`undo_at_end` has registered, and exits with 128 plus the signal's number,
as a shell does. An exception would not be enough: Python drops one that a signal raises within the callback of a weak
reference or a ``__del__``, and a library may swallow or replace it.

All differences between POSIX and Windows are in this module. Windows has no resource, fork and SIGHUP, and an open file
can be neither removed nor replaced there.
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
"""Options of Popen for a process that does not receive Ctrl-C."""

LONGEST_WAIT = None if _IS_POSIX else 0.5
"""Longest single wait for another process [s]: on Windows Ctrl-C has no effect before a wait is over."""

_ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGINT", "SIGBREAK") if hasattr(signal, name))

_to_undo: list[tuple[int, Callable[[], object]]] = []


@contextmanager
def undo_at_end(undo: Callable[[], object]) -> Iterator[None]:
    """Call ``undo`` when the block ends or a signal ends the process within it; calling it twice must do no harm."""
    entry = (os.getpid(), undo)  # a forked process must not undo what its parent has registered
    _to_undo.append(entry)
    try:
        yield
    finally:
        undo()
        _to_undo.remove(entry)


@contextmanager
def clean_up_on_signals() -> Iterator[None]:
    """While the block runs, let the signals that ask a command to end clean up and end the process at once.

    A signal that is ignored stays ignored: SIGHUP under nohup, Ctrl-C in the background.
    """
    previous = {}
    if current_thread() is main_thread():  # Python handles signals only there
        handlers = {number: signal.getsignal(number) for number in _ENDING}
        previous = {number: handler for number, handler in handlers.items() if handler not in (signal.SIG_IGN, None)}
    for number in previous:
        signal.signal(number, _end)
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


def _end(number: int, _frame: FrameType | None) -> None:
    for ending in _ENDING:  # a second signal would interrupt the clean-up
        signal.signal(ending, signal.SIG_IGN)
    processes = sys.modules.get("multiprocessing")
    for child in processes.active_children() if processes else []:
        child.kill()
        child.join()  # it may write until it has ended
    for process, undo in reversed(_to_undo):
        if process == os.getpid():
            with suppress(Exception):
                undo()
    os._exit(128 + number)


def python_command(code: str, *arguments: str) -> list[str]:
    """Return the command that runs ``code`` in another Python with the same module search path."""
    # without the working folder, "", which is the user's: a file there may have the name of a module
    folders = [folder for folder in sys.path if folder]
    return [sys.executable, "-P", "-c", f"import sys; sys.path[:] = {folders!r}; {code}", *arguments]


def end_process(process: "Popen[bytes]") -> None:
    """Kill a process and wait for its end; on POSIX Popen.wait would deadlock if a signal had interrupted it."""
    process.kill()
    if _IS_POSIX:
        with suppress(ChildProcessError):
            os.waitpid(process.pid, 0)
    else:
        process.wait()


def bound_memory(more: int) -> None:
    """Let this process take at most ``more`` bytes beyond its present memory and no core dump; not on Windows."""
    if not _IS_POSIX:
        return
    present = 0  # without /proc, as on macOS: it is small compared with the bound
    with suppress(OSError):
        present = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    for kind, bound in ((resource.RLIMIT_AS, present + more), (resource.RLIMIT_CORE, 0)):
        soft, hard = resource.getrlimit(kind)
        with suppress(ValueError, OSError):  # macOS may refuse to bound the memory
            resource.setrlimit(kind, (bound if soft == resource.RLIM_INFINITY else min(soft, bound), hard))
