"""Events: pushes by a hand and slips of an encoder are found where they are, clean logs hold none, cuts are right."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from heli_identifier.chain import Event, find_events
from heli_identifier.chain.events import passages, seconds_used
from heli_identifier.records import Log
from heli_identifier.tracing import DiagnosisSettings, RigVerdict, diagnose
from heli_identifier.tracing.settings import SETTLING
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
    events = find_events([replace(log, start=6.0) for log in logs], VOLTAGE_LIMIT)
    assert [(event.log, event.axis) for event in events] == [
        (log.name, touch.axis) for log, own in zip(logs, touches, strict=True) for touch in own
    ]
    for event, (touch,) in zip(events, touches, strict=True):
        assert event.start == pytest.approx(touch.start, abs=WITHIN)
        assert event.end == pytest.approx(touch.end, abs=WITHIN)
        assert event.start_in_file == pytest.approx(6.0 + event.start)


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


def event_at(log, start, end):
    return Event(log.name, "pitch", start, end, log.start + start, log.start + end, "force", 1.0)


def test_what_is_left_out_is_the_event_with_its_margins_and_what_the_filter_then_needs_to_settle():
    log = flown("open_clean", 11)[0][0]
    event = event_at(log, 30.0, 31.0)
    ((start, end),) = passages([event])[log.name]
    assert start < 30.0 - 0.2 and end > 31.0 + 0.2  # the edges of an event are known to .2 s
    used = seconds_used(log, passages([event]))
    assert used == pytest.approx(log.duration - SETTLING - (end - start) - SETTLING, abs=3 * log.step)
    assert seconds_used(log, passages([event_at(log, 0.0, 90.0)])) == 0.0


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
    assert [series.log.name for series in found.series] == [held_out[0].name]
    assert all(series.events for series in found.series)
    assert [row["axis"] for row in found.to_dict()["events"]] == [axis for _, axis in put_in]
    kept = diagnose(training, held_out=held_out, settings=DiagnosisSettings(keep_events=True))
    assert kept.events == found.events
    assert [series.log.name for series in kept.series] == [held_out[0].name]


@pytest.mark.slow
def test_a_mirrored_log_is_said_not_to_belong():
    logs, _ = flown("open_clean", 11)
    flipped = replace(logs[0], angles=logs[0].angles * np.array([-1.0, 1.0, 1.0]))
    found = diagnose((logs[1], logs[2]), held_out=flipped)
    (note,) = [note for note in found.notes if "does not belong" in note]
    assert note.startswith(f"the log {flipped.name} does not belong to the others: it fits with the sign of its pitch")
