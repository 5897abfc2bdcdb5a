"""The tape of a communication step: order, time, and what stops it."""

import pytest

from fmu_src.errors import MasterError
from fmu_src.master.tape import Call, Clock, Tape


class Unit:
    """What a tape asks of an instance."""

    def __init__(self, name):
        self.name, self.said = name, []

    def fail(self, call, time, status):
        raise MasterError(f"{self.name}.{call} at {time} answered {status}")

    def check_messages(self, call, time):
        if self.said:
            self.fail(call, time, 2)


def test_calls_are_played_in_order_at_the_time_given_and_a_warning_stops_nothing():
    clock, seen = Clock(0.01), []
    units = [Unit("a"), Unit("b")]

    def at(name, status):
        return lambda: seen.append((name, clock.time.value, clock.step.value)) or status

    calls = [
        Call(units[0], "setReal", at("a", 0)),
        Call(units[1], "doStep", at("b", 1)),
        Call(units[0], "x", at("c", 0)),
    ]
    Tape(calls, clock, []).play(0.07)
    assert seen == [("a", 0.07, 0.01), ("b", 0.07, 0.01), ("c", 0.07, 0.01)]


def test_a_discarded_call_stops_the_tape_and_is_named():
    done = []
    calls = [Call(Unit("a"), "doStep", lambda: 2), Call(Unit("b"), "doStep", lambda: done.append(1) or 0)]
    with pytest.raises(MasterError, match=r"a.doStep at 0.5 answered 2"):
        Tape(calls, Clock(0.01), []).play(0.5)
    assert not done


def test_a_set_call_that_answers_ok_but_logs_a_refusal_stops_the_tape():
    unit, alarm = Unit("a"), []

    def refused():
        unit.said.append("v = nan")
        alarm.append(unit)
        return 0

    with pytest.raises(MasterError, match=r"a.setReal at 0.5"):
        Tape([Call(unit, "setReal", refused)], Clock(0.01), alarm).play(0.5)
