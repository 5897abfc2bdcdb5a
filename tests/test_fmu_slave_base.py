"""The common base of the units, driven as the binary drives it, without a binary."""

import json
import math

import pytest

from fmu_src import Refusal
from fmu_src.slave_base import SlaveBase
from fmu_src.variables import output, parameter, real_input


class Integrator(SlaveBase):
    """dx/dt = gain u, with the sum of all inputs hidden from the variables."""

    variables = (
        real_input("u", "V", 10.0, 1.0, "input"),
        output("x", "V", "integral", ("initial.x",)),
        parameter("initial.x", 0.5, "x at the start", "V", -100.0, 100.0),
        parameter("gain", 2.0, "gain", "1/s", 0.0, 5.0, tunable=True),
        parameter("order", 1, "an integer", None, 1, 4),
        parameter("enabled", True, "a boolean"),
        parameter("note", "none", "a text"),
    )
    hidden = {"x": float, "seen": float}

    def initialise(self, time):
        if self.values[6] == "broken":
            raise Refusal("the note is broken")
        self.x = self.values[1] = self.values[2]
        self.seen = 0.0

    def advance(self, time, step_size):
        if self.values[0] == 7.0:
            raise ZeroDivisionError("seven")
        self.seen += self.values[0]
        self.x += self.values[3] * self.values[0] * step_size
        self.values[1] = self.x


U, X, INITIAL, GAIN, ORDER, ENABLED, NOTE = range(7)


@pytest.fixture
def unit():
    slave = Integrator(instance_name="unit", resources="")
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    return slave


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


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 10.5])
def test_a_bad_input_is_named_with_value_and_bound_and_steps_are_refused_until_it_is_corrected(unit, bad):
    unit.set_real([U], [1.0])
    assert unit.do_step(0.0, 0.1)
    unit.set_real([U], [bad])
    text = said(unit)
    assert "u = " in text and repr(bad) in text and "[-10, 10]" in text
    before = unit.get_real([X])
    assert not unit.do_step(0.1, 0.1)
    assert "u = " in said(unit)
    assert unit.get_real([X]) == before
    unit.set_real([U], [1.0])
    assert unit.do_step(0.1, 0.1)


def test_an_exception_in_a_step_is_logged_with_its_traceback_and_refused(unit):
    unit.set_real([U], [7.0])
    assert not unit.do_step(0.0, 0.1)
    text = said(unit)
    assert "ZeroDivisionError: seven" in text and "advance" in text
    unit.set_real([U], [1.0])
    assert unit.do_step(0.0, 0.1)


@pytest.mark.parametrize("step", [0.0, -0.1, math.nan, math.inf])
def test_a_communication_step_that_is_not_positive_and_finite_is_refused(unit, step):
    assert not unit.do_step(0.0, step)
    assert f"communication step = {step!r} s" in said(unit)


def test_a_fixed_parameter_is_refused_after_initialisation_and_a_tunable_one_is_taken(unit):
    unit.set_real([INITIAL], [9.0])
    assert "initial.x is fixed once initialisation has ended; the value 9.0 was ignored" in said(unit)
    assert unit.get_real([INITIAL]) == [0.5]
    unit.set_real([GAIN], [4.0])
    assert unit.get_real([GAIN]) == [4.0]
    assert unit.do_step(0.0, 0.1)


def test_outputs_and_unknown_references_cannot_be_set_and_an_unknown_one_reads_as_nan(unit):
    unit.set_real([X], [1.0])
    assert "x is an output" in said(unit)
    unit.set_real([99], [1.0])
    assert "no Real variable has value reference 99" in said(unit)
    assert math.isnan(unit.get_real([99])[0])
    assert "99" in said(unit)


@pytest.mark.parametrize("references", [[U, X], [X, U], [GAIN, U, X, INITIAL], [X], [U, U], []])
def test_values_are_read_in_the_order_asked_for_whether_neighbours_or_not(unit, references):
    shown = {U: 3.0, X: 0.5, INITIAL: 0.5, GAIN: 2.0}
    unit.set_real([U], [3.0])
    for _ in range(2):  # the second time by the picker that was kept
        assert unit.get_real(references) == [shown[reference] for reference in references]


@pytest.mark.parametrize("reference", [-1, ORDER, NOTE])
def test_a_reference_of_another_type_or_below_zero_is_no_real(unit, reference):
    # the binary hands references over as signed numbers, and a list has an element at -1
    assert math.isnan(unit.get_real([reference])[0])
    unit.set_real([reference], [1.0])
    assert f"no Real variable has value reference {reference}" in said(unit)
    assert unit.get_string([NOTE]) == ["none"]
    assert unit.do_step(0.0, 0.1)


def test_good_values_that_come_with_a_bad_one_are_taken(unit):
    unit.set_real([GAIN, U, X], [4.0, 99.0, 1.0])
    assert unit.get_real([GAIN, U, X]) == [4.0, 0.0, 0.5]
    assert "u = 99.0" in said(unit)


def test_a_get_call_always_gives_as_many_values_as_were_asked_for(unit):
    # the binary reads that many list elements, whatever the unit returns
    assert len(unit.get_real([U, 99, X])) == 3
    assert len(unit.get_integer([99, ORDER])) == 2
    assert len(unit.get_boolean([99, U])) == 2
    assert unit.get_string([U, NOTE]) == ["", "none"]


def test_integers_booleans_and_texts_are_checked_as_well():
    slave = Integrator(instance_name="unit", resources="")
    slave.set_integer([ORDER], [7])
    assert "order = 7 must lie in [1, 4]" in said(slave)
    slave.set_integer([ORDER], [3])
    slave.set_boolean([ENABLED], [False])
    slave.set_string([NOTE], ["kept"])
    assert (slave.get_integer([ORDER]), slave.get_boolean([ENABLED]), slave.get_string([NOTE])) == (
        [3],
        [False],
        ["kept"],
    )


def test_a_failed_initialisation_gives_its_reason_again_with_every_step():
    slave = Integrator(instance_name="unit", resources="")
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    slave.set_string([NOTE], ["broken"])
    slave.exit_initialization_mode()
    assert "the note is broken" in said(slave)
    assert not slave.do_step(0.0, 0.1)
    assert "the note is broken" in said(slave)


def test_a_step_before_initialisation_or_after_termination_is_refused():
    slave = Integrator(instance_name="unit", resources="")
    assert not slave.do_step(0.0, 0.1)
    assert "the unit is instantiated and cannot step" in said(slave)
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    slave.terminate()
    assert not slave.do_step(0.0, 0.1)
    assert "the unit is terminated and cannot step" in said(slave)


def test_a_rollback_takes_the_hidden_state_back_and_shares_nothing(unit):
    unit.set_real([U], [0.3])
    unit.do_step(0.0, 0.1)
    saved = unit._get_fmu_state()
    frozen = json.dumps(saved)
    unit.do_step(0.1, 0.1)
    first = unit.get_real([U, X]), (unit.x, unit.seen)
    assert json.dumps(saved) == frozen
    unit.set_real([U], [9.0])
    unit.do_step(0.2, 0.1)
    unit._set_fmu_state(saved)
    unit.do_step(0.1, 0.1)
    assert (unit.get_real([U, X]), (unit.x, unit.seen)) == first


def test_a_state_survives_serialisation_to_the_bit_also_with_a_tuned_parameter(unit):
    unit.set_real([U, GAIN], [1.0 / 3.0, math.pi])
    unit.do_step(0.0, 0.1)
    raw = unit._fmu_state_to_bytes(unit._get_fmu_state())
    other = Integrator(instance_name="other", resources="")
    other._set_fmu_state(other._fmu_state_from_bytes(raw))
    assert (other.x, other.seen) == (unit.x, unit.seen)
    assert other.get_real([U, X, INITIAL, GAIN]) == unit.get_real([U, X, INITIAL, GAIN])
    assert other.do_step(0.1, 0.1)
    other.set_real([INITIAL], [1.0])
    assert "is fixed" in said(other)


def test_a_state_is_kept_and_taken_back_before_the_initialisation_as_well():
    slave = Integrator(instance_name="unit", resources="")
    slave.set_real([INITIAL], [3.0])
    saved = slave._get_fmu_state()
    slave.set_real([INITIAL], [4.0])
    slave._set_fmu_state(saved)
    slave.enter_initialization_mode()
    assert slave.get_real([X]) == [3.0] and said(slave) == ""


@pytest.mark.parametrize("raw", [b"", b"\xff\xfe", b"[]", b'{"unit": ["Other", 3]}'])
def test_bytes_that_are_no_state_of_the_unit_are_refused_and_change_nothing(unit, raw):
    unit.set_real([U], [1.0])
    unit.do_step(0.0, 0.1)
    before = unit._get_fmu_state()
    unit._set_fmu_state(unit._fmu_state_from_bytes(raw))
    assert "nothing was changed" in said(unit)
    assert unit._get_fmu_state() == before


def test_messages_cannot_be_taken_for_printf_formats_or_break_utf8(unit):
    unit.log("50 % of \udcff")
    assert unit.log_queue[-1].msg == "50 %% of \\udcff"
