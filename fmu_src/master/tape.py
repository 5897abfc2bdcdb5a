"""A communication step as a tape: calls that are prepared once and played at every step.

fmpy's methods make new ctypes arrays with every call. Here function, component, references and values are bound
before the first step, in the form to which ctypes would convert them; time and step length are two C doubles that all
calls share.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from ctypes import c_double
from typing import NamedTuple

from .unit_log import UnitLog


class Clock:
    """Time and step length [s] as C doubles that the calls of every unit read."""

    def __init__(self, step: float) -> None:
        self.time = c_double(0.0)
        self.step = c_double(step)


class Call(NamedTuple):
    """A prepared call: ``run`` returns its status; ``log`` and ``name`` (``setReal``) serve the check."""

    log: UnitLog
    name: str
    run: Callable[[], int]


class Tape:
    """Prepared calls in the order in which they are played.

    Parameters
    ----------
    calls : iterable of Call
    clock : Clock
        The clock with which the calls were prepared.
    alarm : list of UnitLog
        The one that the logs of the calls share.
    """

    def __init__(self, calls: Iterable[Call], clock: Clock, alarm: list[UnitLog]) -> None:
        self.clock, self.alarm = clock, alarm
        self.calls = {call.run: call for call in calls}
        self.runs = tuple(self.calls)

    def play(self, time: float) -> None:
        """Play all calls at ``time`` [s].

        Raises
        ------
        MasterError
            A unit answers worse than a warning, or logs a refusal: unit, call, time and reason.
        """
        self.clock.time.value = time
        alarm = self.alarm
        for run in self.runs:
            if (status := run()) or alarm:
                call = self.calls[run]
                call.log.check(call.name, time, status)
