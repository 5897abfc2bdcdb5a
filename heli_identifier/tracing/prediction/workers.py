"""Threads for work that releases the interpreter's lock: compiled loops, filters, linear algebra."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache
from threading import local
from typing import ParamSpec, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
Arguments = ParamSpec("Arguments")

_state = {"count": os.cpu_count() or 1}
_inside = local()


def use_threads(count: int) -> None:
    """Let :func:`parallel` use ``count`` threads from now on, in this process; one for each core to begin with."""
    _state["count"] = count


def parallel(function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Return ``[function(item) for item in items]``, computed on all threads.

    A call from one of the threads themselves runs in that thread: outer work is spread, inner work is not.
    """
    count, given = _state["count"], tuple(items)
    if count == 1 or len(given) == 1 or getattr(_inside, "worker", False):
        return [function(item) for item in given]
    results: dict[int, Result] = {}
    left = iter(range(len(given)))  # a step of it is indivisible

    # Every thread takes the next item until none is left. An order for each would wake the caller after each, which
    # then keeps the interpreter from the threads: items of a millisecond are common here.
    def work() -> None:
        for i in left:
            results[i] = function(given[i])

    try:
        for thread in [_pool(count).submit(work) for _ in range(min(count, len(given)))]:
            thread.result()
    finally:
        for _ in left:  # a caller that leaves early wants no more of them: the process could not end before
            pass
    return [results[i] for i in range(len(given))]


def beside(
    function: Callable[Arguments, Result], *arguments: Arguments.args, **named: Arguments.kwargs
) -> "Future[Result]":
    """Start work that the caller needs later; its own calls of :func:`parallel` use the same threads.

    With one thread the work is done at once, and raises at once. There is one companion thread: work that runs in it
    must not call this function again.
    """
    if _state["count"] == 1:
        done: Future[Result] = Future()
        done.set_result(function(*arguments, **named))
        return done
    return _companion().submit(function, *arguments, **named)


def _forget() -> None:
    """Drop the executors: a forked process inherits them without their threads."""
    _pool.cache_clear()
    _companion.cache_clear()
    _inside.worker = False


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)


@cache
def _pool(count: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(count, initializer=_enter)


@cache
def _companion() -> ThreadPoolExecutor:
    """Executor of one thread beside the caller's, which is not one of the workers."""
    return ThreadPoolExecutor(1)


def _enter() -> None:
    _inside.worker = True
