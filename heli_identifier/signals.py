"""Signals that ask a command to end, and how they are held back for a moment."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from threading import current_thread, main_thread

ENDING = (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)
"""Signals that ask a command to end. Its exit code is then 128 and the signal's number, as a shell gives it."""


@contextmanager
def deferred() -> Iterator[None]:
    """Let this process hear the signals that ask it to end only after the block.

    A mask of the thread would not do: the system then gives the signal to another thread, and Python handles it here.
    """
    if current_thread() is not main_thread():  # Python handles signals only there
        yield
        return
    came: list[int] = []
    handlers = {number: signal.getsignal(number) for number in ENDING}
    heard = {number: handler for number, handler in handlers.items() if handler not in (signal.SIG_IGN, None)}
    for number in heard:
        signal.signal(number, lambda signum, _frame: came.append(signum))
    try:
        yield
    finally:
        for number, handler in heard.items():
            signal.signal(number, handler)
        for late in came:
            signal.raise_signal(late)


@contextmanager
def unheard(number: signal.Signals) -> Iterator[None]:
    """Hold a signal back in the block; processes that are started in it never hear it."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [number])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
