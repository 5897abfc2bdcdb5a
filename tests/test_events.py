"""Events: pushes by a hand and slips of an encoder are found where they are, clean logs hold none, cuts are right."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmarks.rigs import log_of, windy_logs
from heli_identifier.chain import Event, find_events
from heli_identifier.chain.events import counted, passages
from heli_identifier.tracing import DiagnosisSettings, RigVerdict, diagnose
from heli_identifier.tracing.settings import SETTLING
from tests.blind.generator import simulate_log
from tests.blind.plant import Push
from tests.blind.rigs import draw_rig
from tests.blind.signals import multisines
from tests.blind.windy import windy_rig

VOLTAGE_LIMIT = 5.0

WITHIN = 0.2
"""How close [s] to its true start an event has to be found: the project's bar."""

OPEN = (Push("travel", 40.0, 40.6, 1.5), Push("pitch", 30.0, 30.4, -1.2), Push("elevation", 55.0, 55.5, 0.8))
"""Pushes of logs in open loop, one in each."""


@cache
def flown(seed, kind="clean", pushed=False):
    """Three logs of a rig in open loop; half the voltages' difference, so that a pushed pitch does not turn over."""
    rig, logs = draw_rig(seed, kind), []
    for number, push in enumerate(OPEN):
        v = multisines(90.0, np.random.default_rng(seed + number))
        samples = simulate_log(rig, v @ [[0.75, 0.25], [0.25, 0.75]], seed + number, (push,) if pushed else ())
        logs.append(log_of(f"log{number}", 100.0, samples))
    return tuple(logs)


@pytest.mark.parametrize("seed", [11, 12])
def test_a_push_in_open_loop_is_found_at_its_start_and_on_its_axis_and_nothing_else_is(seed):
    logs = flown(seed, pushed=True)
    events = find_events([replace(log, start=6.0) for log in logs], VOLTAGE_LIMIT)
    assert [(event.log, event.axis) for event in events] == [
        (log.name, push.axis) for log, push in zip(logs, OPEN, strict=True)
    ]
    for event, push in zip(events, OPEN, strict=True):
        assert event.start == pytest.approx(push.start, abs=WITHIN)
        assert event.end == pytest.approx(push.end, abs=WITHIN)
        assert event.start_in_file == pytest.approx(6.0 + event.start)


@pytest.mark.parametrize("seed, rate", [(0, 100.0), (3, 500.0)])
def test_pushes_in_closed_loop_are_told_from_the_answer_of_the_controller(seed, rate):
    """In the air of measured rigs, encoder zeros, gains and torques of each log its own."""
    pushes = {"a1": Push("travel", 20.0, 20.6, 1.5), "a2": Push("pitch", 15.0, 15.4, -1.2)}
    pushes["a3"] = Push("elevation", 12.0, 12.5, 1.0)
    rig = windy_rig(seed, rate=rate, counts={"a": 5}, pushes={name: (push,) for name, push in pushes.items()})
    events = find_events(windy_logs(rig, "a"), VOLTAGE_LIMIT)
    assert [(event.log, event.axis) for event in events] == [(name, push.axis) for name, push in pushes.items()]
    for event in events:
        assert event.start == pytest.approx(pushes[event.log].start, abs=WITHIN)


@pytest.mark.parametrize("rig", ["clean", "dry_friction:pitch", "input_delay", 2, 4, 5])
def test_logs_that_nobody_touched_hold_no_event(rig):
    """In open loop, and under a controller in rough air."""
    logs = flown(11, rig) if isinstance(rig, str) else windy_logs(windy_rig(rig, counts={"a": 5}), "a")
    assert find_events(logs, VOLTAGE_LIMIT) == ()


def test_a_stop_that_turns_a_rate_round_is_no_slip():
    logs = flown(11)
    angles = logs[1].angles.copy()
    angles[:, 2] = np.abs(angles[:, 2] - angles[4321, 2])  # the travel is thrown back there
    events = find_events((logs[0], replace(logs[1], angles=angles), *logs[2:]), VOLTAGE_LIMIT)
    assert {event.kind for event in events} <= {"force"}


def test_what_is_left_out_is_the_event_with_its_margins_and_what_the_filter_then_needs_to_settle():
    log = flown(11)[0]

    def left_out(start, end):
        event = Event(log.name, "pitch", start, end, log.start + start, log.start + end, "force", 1.0)
        return passages([event])[log.name]

    ((start, end),) = left_out(30.0, 31.0)
    assert start < 30.0 - 0.2 and end > 31.0 + 0.2  # the edges of an event are known to .2 s
    used = counted(log.time, left_out(30.0, 31.0)).sum() * log.step
    assert used == pytest.approx(log.duration - SETTLING - (end - start) - SETTLING, abs=3 * log.step)
    assert not counted(log.time, left_out(0.0, 90.0)).any()


def test_logs_too_short_for_a_regression_hold_no_event():
    log = flown(11, pushed=True)[0]
    short = replace(log, voltages=log.voltages[:20], angles=log.angles[:20])
    assert find_events([short, replace(short, name="other")], VOLTAGE_LIMIT) == ()


@pytest.mark.slow
def test_a_diagnosis_cuts_events_out_lists_them_and_keeps_them_if_asked():
    logs = flown(11, pushed=True)
    training, held_out = logs[:2], logs[2:]
    put_in = [(log.name, push.axis) for log, push in zip(logs, OPEN, strict=True)]
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
    logs = flown(11)
    flipped = replace(logs[0], angles=logs[0].angles * np.array([-1.0, 1.0, 1.0]))
    found = diagnose((logs[1], logs[2]), held_out=flipped)
    (note,) = [note for note in found.notes if "does not belong" in note]
    assert note.startswith(f"the log {flipped.name} does not belong to the others: it fits with the sign of its pitch")
