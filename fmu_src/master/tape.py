"""A communication step as a tape of calls that are made ready once and played at every step.

fmpy's methods make new ctypes arrays with every call. Here function, component, references and values are bound
before the first step, in the form to which ctypes would convert them; time and step length lie in two C doubles that
all calls share. Every status is looked at, and so is the log: a pythonfmu unit cannot refuse a set call by its status.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from ctypes import c_double
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from .instance import Instance

OK, WARNING, DISCARD = 0, 1, 2


class Clock:
    """Time and step length [s], as C doubles that every unit's calls read."""

    def __init__(self, step: float) -> None:
        self.time = c_double(0.0)
        self.step = c_double(step)


class Call(NamedTuple):
    """A ready call: the ``unit`` and the ``name`` of its function, for messages, and what to ``run`` for a status."""

    unit: Instance
    name: str
    run: Callable[[], int]


class Tape:
    """Calls in the order in which they are played.

    Parameters
    ----------
    calls : iterable of Call
    clock : Clock
        The one that the calls were made ready with.
    alarm : list
        Units append themselves when their log tells of a refusal; empty as long as all is well.
    """

    def __init__(self, calls: Iterable[Call], clock: Clock, alarm: list[Instance]) -> None:
        self.clock, self.alarm = clock, alarm
        self.origins = {call.run: call for call in calls}
        self.runs = tuple(self.origins)

    def play(self, time: float) -> None:
        """Play all calls at ``time`` [s].

        Raises
        ------
        MasterError
            A unit answers worse than a warning, or its log tells of a refusal: unit, call, time and reason.
        """
        self.clock.time.value = time
        alarm = self.alarm
        for run in self.runs:
            if (status := run()) or alarm:
                self._judge(self.origins[run], time, status)

    def _judge(self, call: Call, time: float, status: int) -> None:
        """Raise for anything worse than a warning."""
        if status > WARNING:
            call.unit.fail(call.name, time, status)
        call.unit.check_messages(call.name, time)
