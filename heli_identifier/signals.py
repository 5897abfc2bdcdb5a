"""Signals that ask a command to end, and what has to be undone before it does.

Where :func:`handled_here` has been called, SIGTERM, SIGHUP and Ctrl-C end the process from within their handler: its
child processes are ended, what :func:`undone` names is undone, and the exit code is 128 and the signal's number, as a
shell gives it. An exception would not do. Python drops one that a signal raises within the callback of a weak reference
or a ``__del__``, and a library may drop it or make another one of it.
"""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import current_thread, main_thread
from types import FrameType

from heli_identifier.platform import ENDING

_PATIENCE = 3.0
"""How long a child process may take to clean up [s]."""

_to_undo: list[tuple[int, Callable[[], object]]] = []


@contextmanager
def undone(undo: Callable[[], object]) -> Iterator[None]:
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
    if current_thread() is not main_thread():  # Python handles signals only there
        yield
        return
    before = {number: signal.getsignal(number) for number in ENDING}
    heard = {number: own for number, own in before.items() if own not in (signal.SIG_IGN, None)}
    for number in heard:
        signal.signal(number, _end)
    try:
        yield
    finally:
        for number, own in heard.items():
            signal.signal(number, own)


def _end(number: int, _frame: FrameType | None) -> None:
    for other in ENDING:  # a second one would end the cleaning up
        signal.signal(other, signal.SIG_IGN)
    processes = sys.modules.get("multiprocessing")
    children = processes.active_children() if processes else []
    for child in children:
        child.terminate()
    for child in children:
        child.join(_PATIENCE)
        child.kill()
    for process, undo in reversed(_to_undo):
        if process == os.getpid():
            with suppress(Exception):
                undo()
    os._exit(128 + number)
