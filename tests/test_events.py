"""Events: pushes by a hand and slips of an encoder are found where they are, clean logs hold none, cuts are right."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from heli_identifier.records import Log
from heli_identifier.tracing.diagnosis.diagnose import diagnose
from heli_identifier.tracing.diagnosis.result import RigVerdict
from heli_identifier.tracing.diagnosis.settings import DiagnosisSettings
from heli_identifier.tracing.events.cutting import MARGIN, cut, shortest_piece, without_events
from heli_identifier.tracing.events.event import Event
from heli_identifier.tracing.events.finding import find_events
from heli_identifier.workbench.delivery.diagnosis_document import diagnosis_document
from tests.blind.field.draw import draw_field_rig
from tests.blind.field.generator import fly_log

VOLTAGE_LIMIT = 5.0

WITHIN = 0.2
"""How close [s] to its true start an event has to be found: the project's bar."""


@cache
def flown(kind, seed, logs=6, touched=None):
    """Logs of one field rig and the touches that are in them."""
    truth = draw_field_rig(seed, kind, touched=touched)
    made = []
    for number in range(min(logs, len(truth.logs))):
        samples = fly_log(truth, number).log
        made.append(Log(f"log{number}", truth.rate, samples[:, 1:3], samples[:, 3:]))
    return tuple(made), tuple(own.touches for own in truth.logs[:logs])


@pytest.mark.parametrize("seed", [11, 12])
def test_a_touch_in_open_loop_is_found_at_its_start_and_on_its_axis_and_nothing_else_is(seed):
    logs, touches = flown("open_touched", seed)
    events = find_events(logs, VOLTAGE_LIMIT)
    assert [(event.log, event.axis) for event in events] == [
        (log.name, touch.axis) for log, own in zip(logs, touches, strict=True) for touch in own
    ]
    for event, (touch,) in zip(events, touches, strict=True):
        assert event.start == pytest.approx(touch.start, abs=WITHIN)
        assert event.end == pytest.approx(touch.end, abs=WITHIN)


def test_touches_in_closed_loop_are_told_from_the_answer_of_the_controller():
    """The controller answers a push within its loop's delay, so that a slow push of the elevation may hide in it."""
    found, put_in = 0, 0
    for seed in (2, 4):
        logs, touches = flown("field", seed, 16, touched=True)
        pushes = {(log.name, touch.axis): touch for log, own in zip(logs, touches, strict=True) for touch in own}
        for event in find_events(logs, VOLTAGE_LIMIT):
            assert event.start == pytest.approx(pushes[event.log, event.axis].start, abs=WITHIN)
            found += 1
        put_in += len(pushes)
    assert put_in - 1 <= found <= put_in


@pytest.mark.parametrize(
    "kind, seed", [("open_clean", 11), ("clean", 1), ("clean_loop", 2), ("dry_friction:pitch", 3), ("input_delay", 4)]
)
def test_clean_logs_hold_no_event(kind, seed):
    logs, _ = flown(kind, seed, 10, touched=False)
    assert find_events(logs, VOLTAGE_LIMIT) == ()


def test_a_slip_of_an_encoder_is_found_as_one_at_its_sample():
    logs, _ = flown("open_clean", 11)
    angles = logs[1].angles.copy()
    angles[4321:, 2] += 0.03  # twenty counts
    slipped = (logs[0], replace(logs[1], angles=angles), *logs[2:])
    (event,) = find_events(slipped, VOLTAGE_LIMIT)
    assert (event.log, event.axis, event.kind) == (logs[1].name, "travel", "slip")
    assert event.start == pytest.approx(43.21)
    assert event.size == pytest.approx(0.03, abs=0.003)  # two counts


def test_a_stop_that_turns_a_rate_round_is_no_slip():
    logs, _ = flown("open_clean", 11)
    angles = logs[1].angles.copy()
    angles[:, 2] = np.abs(angles[:, 2] - angles[4321, 2])  # the travel is thrown back there
    events = find_events((logs[0], replace(logs[1], angles=angles), *logs[2:]), VOLTAGE_LIMIT)
    assert {event.kind for event in events} <= {"force"}


def test_the_time_of_an_event_is_that_of_the_file():
    logs, touches = flown("open_touched", 11)
    late = tuple(replace(log, start=6.0) for log in logs)
    for event, (touch,) in zip(find_events(late, VOLTAGE_LIMIT), touches, strict=True):
        assert event.start_in_file == pytest.approx(6.0 + touch.start, abs=WITHIN)


def event_at(log, start, end):
    return Event(log.name, "pitch", start, end, log.start + start, log.start + end, "force", 1.0)


def test_pieces_hold_everything_outside_of_the_margins_under_the_log_s_own_time():
    log = replace(flown("open_clean", 11)[0][0], start=5.0)
    before, behind = cut(log, [event_at(log, 30.0, 31.0)], 5.0)
    assert (before.name, before.start, behind.start) == (log.name, 5.0, pytest.approx(36.0 + MARGIN, abs=2 * log.step))
    assert behind.name == f"{log.name} from {behind.start:.4g} s"
    assert before.duration == pytest.approx(30.0 - MARGIN, abs=2 * log.step)
    assert before.duration + behind.duration == pytest.approx(log.duration - 1.0 - 2 * MARGIN, abs=4 * log.step)
    np.testing.assert_array_equal(behind.angles, log.angles[-behind.samples :])


def test_pieces_that_are_too_short_are_left_out():
    log = flown("open_clean", 11)[0][0]
    (piece,) = cut(log, [event_at(log, 3.0, 4.0)], 5.0)
    assert piece.start == pytest.approx(4.0 + MARGIN, abs=2 * log.step)
    assert cut(log, [event_at(log, 0.0, 90.0)], 5.0) == []


def test_cut_logs_hold_no_event_any_more_and_clean_ones_stay_as_they_are():
    logs, touches = flown("open_touched", 11)
    clean = replace(flown("open_clean", 11)[0][0], name="clean")
    found = without_events(logs[:4], (*logs[4:], clean), VOLTAGE_LIMIT, 2.0)
    assert len(found.events) == sum(map(len, touches))
    assert len(found.notes) == len(logs)
    assert found.held_out[-1] is clean
    assert all(piece.duration >= shortest_piece(2.0) for piece in (*found.training, *found.held_out))
    assert find_events((*found.training, *found.held_out), VOLTAGE_LIMIT) == ()


def test_logs_of_which_events_leave_nothing_are_used_as_they_are():
    logs, _ = flown("open_touched", 11)
    found = without_events(logs, (), VOLTAGE_LIMIT, 0.11)  # an observer that takes 91 s to settle
    assert found.training == logs
    assert "as they are" in found.notes[-1]


def test_logs_too_short_for_a_regression_hold_no_event():
    log = flown("open_touched", 11)[0][0]
    short = replace(log, voltages=log.voltages[:20], angles=log.angles[:20])
    assert find_events([short, replace(short, name="other")], VOLTAGE_LIMIT) == ()


@pytest.mark.slow
def test_a_diagnosis_cuts_events_out_lists_them_and_keeps_them_if_asked():
    logs, touches = flown("open_touched", 11)
    training, held_out = logs[:3], logs[3:4]
    put_in = [(log.name, touch.axis) for log, own in zip(logs[:4], touches, strict=False) for touch in own]
    found = diagnose(training, held_out=held_out)
    assert [(event.log, event.axis) for event in found.events] == put_in
    assert (found.verdict, found.effects) == (RigVerdict.MODEL_ADEQUATE, ())
    assert {series.log.name.partition(" from ")[0] for series in found.series} == {held_out[0].name}
    assert all(series.events for series in found.series)
    assert [row["axis"] for row in diagnosis_document(found, {})["events"]] == [axis for _, axis in put_in]
    kept = diagnose(training, held_out=held_out, settings=DiagnosisSettings(keep_events=True))
    assert kept.events == found.events
    assert [series.log.name for series in kept.series] == [held_out[0].name]


@pytest.mark.slow
def test_a_log_of_which_nothing_remains_is_asked_whether_it_belongs():
    """A push leaves it 55 s, where a filter of .15 rad/s needs 69 s; its pitch counts the other way."""
    logs, _ = flown("open_touched", 11)
    flipped = replace(logs[0], angles=logs[0].angles * np.array([-1.0, 1.0, 1.0]))
    training, held_out = (logs[1], flipped), logs[3:4]
    assert without_events(training, held_out, VOLTAGE_LIMIT, 0.15).left_out == (flipped,)
    found = diagnose(training, held_out=held_out, settings=DiagnosisSettings(bandwidth=0.15))
    strangers = {own.log: own.why for own in found.logs if not own.belongs}
    assert strangers == {flipped.name: "the sign of its pitch is flipped"}
