"""Threads for work that releases the interpreter's lock: compiled loops, filters, linear algebra."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from threading import local
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

_state = {"count": os.cpu_count() or 1}
_pools: dict[int, ThreadPoolExecutor] = {}
_inside = local()


def use_threads(count: int) -> None:
    """Let :func:`parallel` use ``count`` threads from now on, in this process; one for each core to begin with."""
    _state["count"] = count


def parallel(function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Return ``[function(item) for item in items]``, worked out on all threads.

    A call from one of the threads themselves runs in that thread: outer work is spread, inner work is not.
    """
    count = _state["count"]
    if count == 1 or getattr(_inside, "worker", False):
        return [function(item) for item in items]
    if count not in _pools:
        _pools[count] = ThreadPoolExecutor(count, initializer=_enter)
    return list(_pools[count].map(function, items))


def _enter() -> None:
    _inside.worker = True
