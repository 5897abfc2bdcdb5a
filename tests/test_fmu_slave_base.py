"""The common base of the units, driven as the binary drives it, without a binary. Steps and values that are refused,
and what is said then, are compared with the units in C call by call: by the random calls of
:mod:`tests.test_fmu_lifecycle`. Here is what no random call reaches."""

import json
import math

import pytest

from fmu_src import Refusal
from fmu_src.slave_base import SlaveBase
from fmu_src.variables import output, parameter, real_input
from tests.units import initialise


class Integrator(SlaveBase):
    """dx/dt = order gain u, with the sum of all inputs and the last step [s] hidden from the variables."""

    variables = (
        real_input("u", "V", 10.0, 1.0, "input"),
        output("x", "V", "integral", ("initial.x",)),
        parameter("initial.x", 0.5, "x at the start", "V", -100.0, 100.0),
        parameter("gain", 2.0, "gain", "1/s", 0.0, 5.0, tunable=True),
        parameter("order", 1, "an integer", None, 1, 4),
        parameter("enabled", True, "a boolean"),
        parameter("note", "none", "a text"),
    )
    hidden = {"x": float, "seen": tuple[float, float]}

    def initialise(self, time):
        if self.value("note") == "broken":
            raise Refusal("the note is broken")
        self.x, self.seen, self.order = self.value("initial.x"), (0.0, 0.0), self.value("order")
        self.show([self.x])

    def advance(self, time, step_size):
        if self.values[U] == 7.0:
            raise ZeroDivisionError("seven")
        self.seen = self.seen[0] + self.values[U], step_size
        self.x += self.order * self.values[GAIN] * self.values[U] * step_size
        self.show([self.x])


U, X, INITIAL, GAIN, ORDER, ENABLED, NOTE = range(7)


@pytest.fixture
def unit():
    return initialise(Integrator)


def said(unit):
    text = " | ".join(message.msg for message in unit.log_queue)
    del unit.log_queue[:]
    return text


def test_outputs_are_right_at_the_start_time_and_follow_a_parameter_set_in_initialisation():
    slave = Integrator(instance_name="unit", resources="")
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    assert slave.get_real([X]) == [0.5]
    slave.set_real([INITIAL], [3.0])
    assert slave.get_real([X]) == [3.0]
    slave.exit_initialization_mode()
    assert slave.get_real([X]) == [3.0]


def test_an_exception_in_a_step_is_logged_with_its_traceback_and_refused_and_so_is_a_bad_input(unit, capsys):
    unit.set_real([U], [7.0])
    assert not unit.do_step(0.0, 0.1)
    text = said(unit)
    assert "ZeroDivisionError: seven" in text and "advance" in text
    unit.set_real([GAIN, U, X], [4.0, math.nan, 1.0])  # the good value that comes with it is taken
    assert "u = nan V must lie in [-10, 10] V" in said(unit)
    assert not unit.do_step(0.0, 0.1) and unit.get_real([GAIN, U, X]) == [4.0, 7.0, 0.5]
    unit.set_real([U], [1.0])
    assert unit.do_step(0.0, 0.1) and not unit.do_step(7.0, 0.1) and not unit.do_step(8.25, 0.1)
    assert not unit.do_step(0.1, 0.0) and not unit.do_step(0.1, 1e9)  # neither no step nor an endless one
    printed = capsys.readouterr().err  # the first one, for hosts that show no log
    assert printed.startswith("Integrator.doStep: ZeroDivisionError") and printed.count("Integrator.doStep") == 1


@pytest.mark.parametrize("reference", [-1, ORDER, NOTE, 99])
def test_a_reference_of_another_type_or_of_no_variable_is_no_real(unit, reference):
    # the binary hands references over as signed numbers, and reads as many values as it asked for, whatever comes
    first, blank, last = unit.get_real([X, reference, X])
    assert math.isnan(blank) and (first, last) == (0.5, 0.5)
    unit.set_real([reference], [1.0])
    text = said(unit)
    assert all(f"{call}Real: " in text for call in ("get", "set"))
    assert f"no Real variable has value reference {reference}" in text
    assert unit.get_string([U, NOTE]) == ["", "none"]
    assert unit.do_step(0.0, 0.1)


def test_a_failed_initialisation_gives_its_reason_again_with_every_step_and_every_reading():
    slave = Integrator(instance_name="unit", resources="")
    assert not slave.do_step(0.0, 0.1)
    assert "the unit is instantiated and cannot step" in said(slave)
    slave.set_integer([ORDER], [3])
    slave.set_boolean([ENABLED], [False])
    slave.set_string([NOTE], ["broken"])
    assert (slave.get_integer([ORDER]), slave.get_boolean([ENABLED])) == ([3], [False])
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    assert "the note is broken" in said(slave)
    assert not slave.do_step(0.0, 0.1) and "the note is broken" in said(slave)
    assert slave.get_real([X]) == [0.0] and "the note is broken" in said(slave)


def test_a_saved_state_takes_unit_and_another_instance_back_to_the_bit_and_shares_nothing(unit):
    unit.set_real([U, GAIN], [1.0 / 3.0, math.pi])
    unit.do_step(0.0, 0.1)
    saved, other = unit._get_fmu_state(), initialise(Integrator, {"order": 3})  # what follows from it is made again
    frozen = json.dumps(saved)
    unit.do_step(0.1, 0.1)
    first = unit.get_real([X, U, INITIAL, GAIN]), (unit.x, unit.seen)
    unit.set_real([U], [9.0])
    unit.do_step(0.2, 0.1)
    assert json.dumps(saved) == frozen
    unit._set_fmu_state(saved)
    other._set_fmu_state(other._fmu_state_from_bytes(unit._fmu_state_to_bytes(saved)))
    for one in (unit, other):
        assert one.do_step(0.1, 0.1)
        assert (one.get_real([X, U, INITIAL, GAIN]), (one.x, one.seen)) == first
    other.set_real([INITIAL], [1.0])
    assert "is fixed" in said(other)
    before = unit._get_fmu_state()
    for raw in (b"", b"\xff\xfe", b"[]", b'{"unit": "Other"}'):
        unit._set_fmu_state(unit._fmu_state_from_bytes(raw))
        assert "nothing was changed" in said(unit) and unit._get_fmu_state() == before


def test_messages_cannot_be_taken_for_printf_formats_or_break_utf8(unit):
    unit.log("50 % of \udcff")
    assert unit.log_queue[-1].msg == "50 %% of \\udcff"
