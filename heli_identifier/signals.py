"""Signals that ask a command to end, and how they are held back for a moment."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import current_thread, main_thread
from types import FrameType

ENDING = (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)
"""Signals that ask a command to end. Its exit code is then 128 and the signal's number, as a shell gives it."""


Handler = Callable[[int, FrameType | None], object]


@contextmanager
def handled(handler: Handler) -> Iterator[None]:
    """Let ``handler`` answer the signals that ask a command to end while the block runs.

    A signal that is ignored stays so: SIGHUP under nohup, Ctrl-C in the background.
    """
    if current_thread() is not main_thread():  # Python handles signals only there
        yield
        return
    before = {number: signal.getsignal(number) for number in ENDING}
    heard = {number: own for number, own in before.items() if own not in (signal.SIG_IGN, None)}
    for number in heard:
        signal.signal(number, handler)
    try:
        yield
    finally:
        for number, own in heard.items():
            signal.signal(number, own)


@contextmanager
def deferred() -> Iterator[None]:
    """Let this process hear the signals that ask it to end only after the block.

    A mask of the thread would not do: the system then gives the signal to another thread, and Python handles it here.
    """
    came: list[int] = []
    try:
        with handled(lambda number, _frame: came.append(number)):
            yield
    finally:
        for number in came:
            signal.raise_signal(number)


def alarmed(handler: Handler, first: float, interval: float = 0.0) -> None:
    """Have ``handler`` called in ``first`` seconds, and then every ``interval`` seconds unless that is 0."""
    signal.signal(signal.SIGALRM, handler)
    signal.setitimer(signal.ITIMER_REAL, first, interval)


@contextmanager
def unheard(number: signal.Signals) -> Iterator[None]:
    """Hold a signal back in the block; processes that are started in it never hear it."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [number])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
