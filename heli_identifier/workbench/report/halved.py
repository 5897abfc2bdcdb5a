"""A list of equal pieces of work, half of it done by a copy of this process.

A copy made by fork has imported all that the work needs, so that it starts in a millisecond. It ends by itself once its
half is done, whatever becomes of this process.
"""

import os
import pickle
import sys
from collections.abc import Callable, Sequence
from typing import Any


def halved(work: Callable[[Any], str], items: Sequence[Any]) -> list[str]:
    """Do ``work`` for every item, every second one in a copy of this process.

    Only for a process without other threads, which a copy would not have. All is done here on a single core, where the
    system is not Linux, and where the copy did not finish.

    Parameters
    ----------
    work : callable
    items : sequence

    Returns
    -------
    list of str
        In the order of the items.
    """
    if sys.platform != "linux" or (os.cpu_count() or 1) < 2:
        return [work(item) for item in items]
    theirs = items[1::2]
    copy, answer = _begun(work, theirs)
    done = [""] * len(items)
    try:
        done[::2] = [work(item) for item in items[::2]]
    finally:
        with open(answer, "rb") as pipe:
            said = pipe.read()
        ended = os.waitpid(copy, 0)[1]
    done[1::2] = pickle.loads(said) if ended == 0 else [work(item) for item in theirs]
    return done


def _begun(work: Callable[[Any], str], items: Sequence[Any]) -> tuple[int, int]:
    """Start the copy; give its process number and the end of the pipe from which its answer is read."""
    answer, end = os.pipe()
    copy = os.fork()
    if copy:
        os.close(end)
        return copy, answer
    try:
        os.close(answer)  # the last end to read from is then the caller's: a write fails once that has ended
        with open(end, "wb") as pipe:
            pickle.dump([work(item) for item in items], pipe)
        os._exit(0)
    finally:
        os._exit(1)  # no traceback: the caller does this work again and says what is wrong with it
