"""Units in Python: what they add to the library that they wrap; what the LogPlayer plays when, and what it refuses."""

import math
import re

import numpy as np
import pytest

from fmu_src import Refusal
from fmu_src.units.adaptive_identifier import AdaptiveIdentifier
from fmu_src.units.controllers import PidController, StateFeedback
from fmu_src.units.corrector import Corrector
from fmu_src.units.exciter import Exciter
from fmu_src.units.helicopter_plant import HelicopterPlant
from fmu_src.units.log_player import LogPlayer, read_recording
from heli_identifier.online import IdentifierSettings, ModelParameters
from heli_identifier.online.excitation import Excitation, Multisine, paper_channels, voltages
from heli_plant.parameters import TABLE_2
from tests.simulated import closed_loop_log, run_identifier
from tests.units import get_values, initialise, set_value


def started(kind, **parameters):
    """A unit after a good initialisation; parameters by their name with __ for the dot."""
    unit = initialise(kind, {name.replace("__", "."): value for name, value in parameters.items()})
    assert unit.log_queue == []
    return unit


@pytest.mark.parametrize("experiment", [1, 2])
@pytest.mark.parametrize(("number", "channel"), enumerate(["both", "difference", "total"]))
def test_the_exciter_plays_the_papers_experiments_and_the_librarys_multisines(experiment, number, channel):
    unit = started(Exciter, excitation__experiment=experiment, excitation__channel=number, excitation__base=0.7)
    expected = Excitation(0.7, *paper_channels(experiment, channel))
    assert tuple(get_values(unit, "v_front", "v_rear")) == voltages(0.0, expected)
    for time in (0.0, 3.3, 17.25, 39.99):
        unit.do_step(time, 0.01)
        assert tuple(get_values(unit, "v_front", "v_rear")) == voltages(time + 0.01, expected)
    unit = started(Exciter, excitation__experiment=3, multisine__seed=5, multisine__rms_sum=0.3, excitation__base=1.2)
    unit.do_step(1.0, 0.5)
    multisines = Excitation(1.2, Multisine(seed=5), Multisine(rms=0.3, seed=6))  # two seeds
    assert tuple(get_values(unit, "v_front", "v_rear")) == voltages(1.5, multisines)


def test_the_controller_starts_at_its_trim_adds_the_excitation_within_its_limit_and_follows_a_reference():
    unit = started(PidController, trim=3.0)
    assert get_values(unit, "v_front", "v_rear") == [1.5, 1.5]
    unit.do_step(0.0, 0.01)
    assert get_values(unit, "v_front", "v_rear") == [1.5, 1.5]  # no error, no rate
    for name, value in {"reference.pitch": 0.1, "excitation_front": 9.0, "excitation_rear": 0.4}.items():
        set_value(unit, name, value)
    unit.do_step(0.01, 0.01)
    # trim, excitation and the law's proportional part alone: the integral has not moved yet; the front is at the limit
    assert get_values(unit, "v_front", "v_rear") == [5.0, pytest.approx(1.9 - 0.5 * 8.35 * 0.1, rel=1e-12)]


def test_no_sample_is_missed_where_an_importer_adds_up_its_steps_and_is_early():
    for kind in (StateFeedback, Corrector):
        unit = started(kind)
        assert unit.do_step(0.0, 0.01) and unit.do_step(0.01 - 5e-6, 0.01)
        assert (unit.held.samples - 1 if kind is StateFeedback else unit.state.instants) == 1
    # errors of an encoder are alike from one such sample to the next, which would raise false alarms
    too_fast = initialise(Corrector, {"sample.time": 0.002})
    assert "sample.time = 0.002 s must lie in [0.005, 0.1] s" in too_fast.log_queue[0].msg


def motion(t):
    """A smooth motion with its voltages, and what an identifier takes at time ``t`` [s]."""
    pitch, elevation, travel = 0.2 * np.sin(1.1 * t), 0.1 * np.sin(0.7 * t), 0.3 * t + 0.05 * np.sin(0.9 * t)
    return (1.0 + 0.3 * np.sin(t), 1.0 - 0.2 * np.sin(1.3 * t), pitch, elevation, travel)


def fed(unit, times, step_size):
    for time in times:
        for name, value in zip(("v_front", "v_rear", "pitch", "elevation", "travel"), motion(time), strict=True):
            set_value(unit, name, float(value))
        assert unit.do_step(time, step_size), unit.log_queue[-1].msg


def test_the_identifier_takes_its_own_samples_and_bridges_a_longer_communication_step_by_straight_lines():
    """Communication at half its period must not change a thing: every second point carries a sample."""
    names = ModelParameters._fields
    usual, fine = (started(AdaptiveIdentifier, adaptation__hold_time=1.0) for _ in range(2))
    fed(usual, [k * 0.01 for k in range(1000)], 0.01)
    fed(fine, [k * 0.005 for k in range(1999)], 0.005)
    assert get_values(usual, *names) == get_values(fine, *names)
    # at H = .02 s and h = .01 s every second angle is the mean of its neighbours, the voltage the earlier one
    unit = started(AdaptiveIdentifier, adaptation__hold_time=0.0)
    fed(unit, [k * 0.02 for k in range(500)], 0.02)
    rows = np.repeat([motion(k * 0.02) for k in range(500)], 2, axis=0)[:-1]
    rows[1::2, 2:] += 0.5 * (rows[2::2, 2:] - rows[1::2, 2:])
    _, estimate = run_identifier(rows[:, :2], rows[:, 2:], IdentifierSettings(hold_time=0.0))
    # the share of a point k H between two others is .5 to rounding, which the regression hardly notices
    assert get_values(unit, *ModelParameters._fields) == pytest.approx(estimate.parameters, rel=1e-6, abs=1e-9)


def test_a_voltage_delay_with_uneven_communication_steps_shifts_the_motion_by_just_that():
    """A step of voltage that arrives .05 s late: the delayed plant does .05 s later what the prompt one does."""

    def driven(delay, steps):
        unit = started(HelicopterPlant, effects__input_delay__rotors=delay, solver__step=0.001)
        time = 0.0
        for size in steps:
            set_value(unit, "v_front", 0.0 if time < 0.0995 else 2.0)
            unit.do_step(time, size)
            time += size
        return get_values(unit, "pitch")[0] - get_values(unit, "initial.pitch")[0], time

    uneven = [0.02, 0.03, 0.05] + [0.013, 0.007, 0.01, 0.02] * 8
    late, end = driven(0.05, uneven)
    prompt, _ = driven(0.0, [0.02, 0.03, 0.05, *[0.01] * round((end - 0.15) / 0.01)])
    # Runge-Kutta of order 4 at .001 s: 1e-12; at rest before the step the plant sits in its equilibrium to 1e-17
    assert late == pytest.approx(prompt, rel=1e-9)


def test_a_plant_that_would_leave_the_finite_range_refuses_the_step_and_is_where_it_was():
    unit = started(HelicopterPlant, pitch__damping=-10.0, solver__step=0.1)
    set_value(unit, "v_front", 1.0)
    assert not unit.do_step(0.0, 90.0) and "leaves the finite range in the step from t = 0 s" in unit.log_queue[-1].msg
    assert unit.do_step(0.0, 1.0) and 1.0 < get_values(unit, "pitch")[0] < 1e6  # exp(10)


def test_an_estimate_that_is_not_finite_is_refused():
    unit = started(AdaptiveIdentifier, adaptation__hold_time=0.0)
    fed(unit, [0.0], 0.01)
    state = unit.sampled.state
    broken = state._replace(signals=state.signals._replace(lagged=(math.nan, math.nan)))  # as of a damaged memory
    unit.sampled = unit.sampled._replace(state=broken)
    assert not all(unit.do_step(0.01 * k, 0.01) for k in range(1, 9)) and "no longer finite" in unit.log_queue[-1].msg


def test_the_identifier_warns_once_where_a_controller_flies_and_the_method_is_the_papers():
    flight = closed_loop_log(TABLE_2, 45.0, 1)
    said = {}
    for method in ("adaptation", "prediction_error"):
        unit = started(AdaptiveIdentifier, method=method)
        for k, (voltages_k, angles_k) in enumerate(zip(flight.voltages, flight.angles, strict=True)):
            names = ("v_front", "v_rear", "pitch", "elevation", "travel")
            unit.set_real([unit.references[name] for name in names], [*voltages_k.tolist(), *angles_k.tolist()])
            assert unit.do_step(0.01 * k, 0.01)
        assert get_values(unit, "closed_loop") == [1.0]
        said[method] = [message for message in unit.log_queue if "controller closes the loop" in message.msg]
    assert len(said["adaptation"]) == 1 and said["prediction_error"] == []


def test_a_method_that_is_not_known_is_refused_with_the_reason_and_no_step_is_taken_nor_one_of_days():
    unit, said = initialise(AdaptiveIdentifier, {"method": "kalman"}), "'kalman' must be one of adaptation, prediction"
    assert said in unit.log_queue[-1].msg
    assert not unit.do_step(0.0, 0.01) and said in unit.log_queue[-1].msg
    unit = initialise(AdaptiveIdentifier)  # which takes its samples with the step after
    assert not (unit.do_step(0.0, 1e6) and unit.do_step(1e6, 0.01))
    assert "at most 10000 are taken" in unit.log_queue[-1].msg


HEADER = "time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]"
ROWS = ["4.00,1,2,.1,.2,.3", "4.01,3,4,.4,.5,.6", "4.02,5,-5,.7,.8,.9"]


def write(tmp_path, *lines):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


def playing(path, start=0.0):
    return initialise(LogPlayer, {"log.path": path, "log.start": start})


def test_every_row_shows_at_its_own_time_counted_from_the_first_one_and_the_last_holds(tmp_path):
    """Times in a long file and k H are rounded differently; no row may be missed or come a step early."""
    path = write(tmp_path, HEADER, *ROWS)
    assert playing(path, start=0.01).get_real([0]) == [3.0]
    unit, outputs = playing(path), list(range(5))
    assert unit.get_real(outputs) == [1.0, 2.0, 0.1, 0.2, 0.3]
    assert unit.do_step(0.0, 0.005) and unit.get_real([0]) == [1.0]
    assert unit.do_step(0.005, 0.005) and unit.get_real([0]) == [3.0]
    assert unit.do_step(0.01, 50.0) and unit.get_real(outputs) == [5.0, -5.0, 0.7, 0.8, 0.9]
    lines = [f"{k * 0.01:.2f},{k},0,0,0,0" for k in range(9001)]
    unit = playing(write(tmp_path, HEADER, *lines))
    for k in range(9000):
        assert unit.do_step(k * 0.01, 0.01) and unit.get_real([0]) == [k + 1.0]
    assert unit.do_step(0.0, 4.9995) and unit.get_real([0]) == [499.0]  # no row comes early by much of its own interval


def test_no_row_and_no_step_of_a_reference_is_late_where_a_host_adds_up_its_steps(tmp_path):
    """After 8 million steps their sum is .0011 steps short."""
    before, time = np.add.accumulate(np.full(8_000_000, 0.0008))[-2:].tolist()
    assert 0.001 < (6400.0 - time) / 0.0008
    player = playing(write(tmp_path, HEADER, *(f"{at},{at},0,0,0,0" for at in (0, 6399, 6400))))
    assert player.do_step(before, 0.0008) and player.get_real([0]) == [6400.0]
    controller = started(PidController, reference__step_pitch=0.1, reference__step_time=6400.0)
    controller.reached = time
    assert controller.do_step(time, 0.0008) and get_values(controller, "v_front") != [-0.45]


def test_degrees_column_order_further_columns_and_a_byte_order_mark_are_taken(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(
        "\ufefftravel [deg],note,time [s],pitch [deg],elevation [rad],v_rear [V],v_front [V]\n"
        "180,start,0,-7.8,.1,2,1\n".encode()
    )
    _, rows = read_recording(str(path))
    assert rows[0] == pytest.approx((1.0, 2.0, math.radians(-7.8), 0.1, math.pi), rel=1e-15)


@pytest.mark.parametrize(("lines", "message"), [
    ((HEADER.replace("pitch [rad]", "pitch [grad]"), *ROWS), "no column 'pitch [rad]' or 'pitch [deg]'"),
    ((HEADER.replace("v_rear [V],", ""), *ROWS), "no column 'v_rear [V]'"),
    ((HEADER + ",pitch [deg]", *ROWS), "2 columns 'pitch [rad]' or 'pitch [deg]'"),
    ((HEADER, ROWS[0], "4.01,3,nan,.4,.5,.6"), "row 3, column 'v_rear [V]': 'nan' is not a finite number"),
    ((HEADER, ROWS[0], "4.01,3"), "row 3, column 'v_rear [V]': '' is not a finite number"),
    ((HEADER, ROWS[0], ROWS[0]), "row 3: time = 4 s must be greater than 4 s"),
    ((HEADER,), "no rows below its header"),
    (("\x89PNG\r", "\0"), "holds a NUL byte"),
])  # fmt: skip
def test_a_file_that_cannot_be_played_is_refused_with_row_and_column(tmp_path, lines, message):
    with pytest.raises(Refusal, match=re.escape(message)):
        read_recording(write(tmp_path, *lines))
