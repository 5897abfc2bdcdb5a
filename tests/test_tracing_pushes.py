"""What one log has that the others have not: pushes by a hand, and an elevation that was zeroed in another position."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmarks.rigs import likelihood_of, log_of, windy_logs
from heli_identifier.records import DiagnosisSettings, Event
from heli_identifier.results import RigVerdict, diagnose
from heli_identifier.tracing import Likelihood, fit, helicopter, identify_plant
from heli_identifier.tracing.pushes import find_pushes
from heli_identifier.tracing.select import select
from heli_identifier.tracing.unknown import search_unknown
from tests.blind.generator import simulate_log
from tests.blind.plant import Push
from tests.blind.rigs import draw_rig
from tests.blind.signals import multisines
from tests.blind.windy import windy_rig

WITHIN = 0.2
"""How close [s] to its true start and end a push has to be found: the project's bar."""

OPEN = (Push("travel", 40.0, 40.6, 1.5), Push("pitch", 30.0, 30.4, -1.2), Push("elevation", 55.0, 55.5, 0.8))
"""Pushes of logs in open loop, one in each."""


@cache
def flown(seed, kind="clean", pushed=False, heavier=0.0):
    """Three logs in open loop, half the voltages' difference: no pushed pitch turns over; the first arm is heavier."""
    rig, logs = draw_rig(seed, kind), []
    for number, push in enumerate(OPEN):
        v = multisines(90.0, np.random.default_rng(seed + number))
        own = rig._replace(base=rig.base._replace(a_1=rig.base.a_1 + heavier * (number == 0)))
        samples = simulate_log(own, v @ [[0.75, 0.25], [0.25, 0.75]], seed + number, (push,) if pushed else ())
        logs.append(log_of(f"log{number}", 100.0, samples))
    return tuple(logs)


def pushes_in(logs, beside=0):
    """Pushes beside the simplified model, fitted to all logs but the last ``beside``."""
    likelihood = Likelihood.of(logs[: len(logs) - beside], helicopter(logs))
    return find_pushes(fit(likelihood, likelihood.rig.base), logs)


def check_pushes(events, logs, pushes):
    """Each log has its push, and nothing else."""
    found = {event.log: event for event in events}
    assert len(events) == len(pushes)
    for log, push in zip(logs, pushes, strict=False):
        event = found[log.name]
        assert event.axis == push.axis and event.start == pytest.approx(push.start, abs=WITHIN)
        assert event.end == pytest.approx(push.end, abs=WITHIN)
        assert event.size == pytest.approx(push.acceleration, rel=0.3)  # the air of that half second is in it
        assert event.start_in_file == pytest.approx(log.start + event.start)


@pytest.mark.parametrize("beside", [0, 1])
def test_a_push_in_open_loop_is_found_with_its_edges_in_logs_of_the_fit_and_beside_it(beside):
    logs = [replace(log, start=6.0) for log in flown(11, pushed=True)]
    check_pushes(pushes_in(logs, beside), logs, OPEN)


@pytest.mark.parametrize("seed, rate", [(0, 100.0), (3, 500.0)])
def test_pushes_in_closed_loop_are_told_from_the_answer_of_the_controller(seed, rate):
    """In the air of measured rigs, encoder zeros, gains and torques of each log its own."""
    pushes = (
        Push("travel", 20.0, 20.6, 1.5), Push("pitch", 15.0, 15.4, -1.2), Push("elevation", 12.0, 12.5, 1.0),
        Push("elevation", 20.0, 21.0, 0.5),
    )  # fmt: skip
    own = {f"a{i + 1}": (push,) for i, push in enumerate(pushes)}
    logs = windy_logs(windy_rig(seed, rate=rate, counts={"a": 5}, pushes=own), "a")
    check_pushes(pushes_in(logs), logs, pushes)


@pytest.mark.parametrize("rig", ["clean", "dry_friction:pitch", "input_delay", 2, 4, 5])
def test_logs_that_nobody_touched_hold_no_push(rig):
    """In open loop, and under a controller in rough air."""
    assert pushes_in(flown(11, rig) if isinstance(rig, str) else windy_logs(windy_rig(rig, counts={"a": 5}), "a")) == ()


def test_what_an_effect_of_the_plant_does_is_no_push():
    """A dead zone that no law describes turns the rig as a hand would, whenever the voltages are small."""
    logs = flown(12, "dead_zone")
    assert pushes_in(logs) and identify_plant(logs).events == ()


def test_a_push_of_one_log_bends_no_curve_where_that_log_alone_has_been():
    """A hand turns one log by most of a turn; the others stay within a third of one."""
    push = Push("travel", 13.06, 13.85, 1.29)
    likelihood = likelihood_of(windy_logs(windy_rig(1, counts={"b": 5}, pushes={"b2": (push,)}), "b"))
    rig = likelihood.rig
    null = fit(likelihood, rig.base)
    assert search_unknown(select(null, rig.candidates), rig.candidates)[1] == ()


@pytest.mark.parametrize("kind", ["clean", "quadratic_thrust"])
def test_an_elevation_that_was_zeroed_elsewhere_is_shifted_and_a_curve_of_the_thrust_shifts_none(kind):
    logs = flown(13, kind)
    zeroed = [replace(logs[0], angles=logs[0].angles - [0.0, 0.6, 0.0]), *logs[1:]]
    found, other = identify_plant(logs), identify_plant(zeroed)
    assert not [note for note in found.notes if "reads" in note]
    (note,) = [note for note in other.notes if "reads" in note]
    assert note.startswith("log0: its elevation reads 0.6")
    read, zeroed_read = (np.median(one.plant.likelihood.records[0].angles[:, 1]) for one in (found, other))
    assert zeroed_read == pytest.approx(read, abs=0.05)  # what two digits of the note are known to
    for name in ("k_x", "k_z", "k_y"):  # a fortieth of the gain; the offset itself costs a little of what is known
        assert other.plant.estimate(name) == pytest.approx(found.plant.estimate(name), rel=0.025)


def test_a_log_whose_arm_was_balanced_otherwise_is_not_shifted():
    """The couplings' sines have the true elevation; in a linear plant another zero would look the same."""
    found = identify_plant(flown(13, "inertial_coupling+large_angle_gravity", heavier=1.2))
    (note,) = [note for note in found.notes if "reads" in note]
    assert note.startswith("log0: its elevation reads 0.") and "balanced otherwise" in note
    (own, *others) = (float(np.median(record.angles[:, 1])) for record in found.plant.likelihood.records)
    assert own < min(others) - 0.3


def test_an_event_that_comes_with_a_log_is_left_out_and_listed():
    logs = flown(11)
    known = Event("log0", "travel", 70.0, 90.0, 70.0, 90.0, "force", 0.0)
    found = identify_plant([replace(logs[0], events=(known,)), *logs[1:]])
    assert found.events == (known,)
    record = found.plant.likelihood.records[0]
    assert not record.weights[record.time > 70.0].any() and record.weights[record.time < 69.0].any()


def test_events_that_are_kept_are_listed_and_neither_left_out_nor_known_to_the_filter():
    """Nor where the catalogue is searched a second time, as a log was zeroed elsewhere."""
    logs = flown(11, pushed=True)
    zeroed = [replace(logs[0], angles=logs[0].angles - [0.0, 0.6, 0.0]), *logs[1:]]
    kept = identify_plant(zeroed, DiagnosisSettings(keep_events=True))
    assert len(kept.events) == 3 and any("reads" in note for note in kept.notes)
    assert not any(own.pushes or own.left_out for own in kept.plant.likelihood.records)


@pytest.mark.slow
def test_a_diagnosis_cuts_pushes_out_lists_them_and_keeps_them_if_asked():
    logs = flown(11, pushed=True)
    put_in = [(log.name, push.axis) for log, push in zip(logs, OPEN, strict=True)]
    found = diagnose(logs[:2], held_out=logs[2:])
    assert [(row["log"], row["axis"]) for row in found.to_dict()["events"]] == put_in
    assert (found.verdict, found.effects) == (RigVerdict.MODEL_ADEQUATE, ())
    kept = diagnose(logs[:2], held_out=logs[2:], settings=DiagnosisSettings(keep_events=True))
    assert [(event.log, event.axis) for event in kept.events] == put_in
    assert all(series.log.events for series in found.series)
