"""What a unit answers: the status of each call, and the messages of its log.

The log counts as much as the status, because a pythonfmu unit cannot refuse a set call by its status.
"""

from __future__ import annotations

from ..errors import MasterError

OK, WARNING, DISCARD = 0, 1, 2
_WORDS = ("ok", "warning", "discard", "error", "fatal", "pending")


class UnitLog:
    """The messages of one unit.

    Parameters
    ----------
    unit : str
        The unit's name in the scenario.
    alarm : list
        The log appends itself when its unit logs a refusal; the logs of a run share one list, which is empty as long
        as all is well.
    """

    def __init__(self, unit: str, alarm: list[UnitLog]) -> None:
        self.unit, self.alarm = unit, alarm
        self.messages: list[str] = []
        self.worst = OK

    def hear(self, status: int, message: str) -> None:
        """Keep a message of the unit."""
        self.messages.append(message)
        self.worst = max(self.worst, status)
        if status >= DISCARD:
            self.alarm.append(self)

    def clear(self) -> None:
        """Forget all messages."""
        self.messages.clear()
        self.worst = OK

    def check(self, call: str, time: float, status: int = OK) -> None:
        """Check the answer to ``call`` at ``time`` [s].

        Raises
        ------
        MasterError
            The status, or one in the log, is worse than a warning: unit, call, time, status and the unit's messages.
        """
        worst = status if status > WARNING else self.worst
        if worst > WARNING:
            word = _WORDS[worst] if worst < len(_WORDS) else f"status {worst}"
            reason = "; ".join(self.messages) or "the unit gives no reason"
            raise MasterError(f"{self.unit}.{call} at t = {time:g} s answered {word}: {reason}")
