"""The tape of a communication step: order, time, and what stops it."""

import pytest

from fmu_src import MasterError
from fmu_src.master.tape import Call, Clock, Tape
from fmu_src.master.unit_log import UnitLog


def test_calls_are_played_in_order_at_the_time_given_and_a_warning_stops_nothing():
    clock, alarm, seen = Clock(0.01), [], []
    a, b = UnitLog("a", alarm), UnitLog("b", alarm)

    def at(name, status):
        return lambda: seen.append((name, clock.time.value, clock.step.value)) or status

    calls = [Call(a, "setReal", at("a", 0)), Call(b, "doStep", at("b", 1)), Call(a, "getReal", at("c", 0))]
    Tape(calls, clock, alarm).play(0.07)
    assert seen == [("a", 0.07, 0.01), ("b", 0.07, 0.01), ("c", 0.07, 0.01)]


def test_a_discarded_call_stops_the_tape_and_is_named():
    done, alarm = [], []
    calls = [
        Call(UnitLog("a", alarm), "doStep", lambda: 2),
        Call(UnitLog("b", alarm), "doStep", lambda: done.append(1) or 0),
    ]
    with pytest.raises(MasterError, match=r"a.doStep at t = 0.5 s answered discard: the unit gives no reason"):
        Tape(calls, Clock(0.01), alarm).play(0.5)
    assert not done


def test_a_set_call_that_answers_ok_but_logs_a_refusal_stops_the_tape():
    alarm = []
    log = UnitLog("a", alarm)

    def refused():
        log.hear(2, "v = nan V must lie in [-30, 30] V")
        return 0

    with pytest.raises(MasterError, match=r"a.setReal at t = 0.5 s answered discard: v = nan V"):
        Tape([Call(log, "setReal", refused)], Clock(0.01), alarm).play(0.5)
