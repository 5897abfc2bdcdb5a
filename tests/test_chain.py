"""The measurement chain: faults undone, defects seen, slips found, and damaged logs named as such."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.rigs import damage_log, log_of, windy_log, windy_logs
from heli_identifier.chain import (
    FAULTS,
    describe_events,
    find_slips,
    is_counted,
    passages_left_out,
    undo_delays,
    undo_faults,
    undo_slips,
)
from heli_identifier.chain.inspection import estimate_jitter, inspect_logs
from heli_identifier.errors import LogError
from heli_identifier.records import Event, Log, quantisation_step
from heli_identifier.results import diagnose
from heli_identifier.results.determination import parameter_reports
from heli_identifier.tracing import identify_plant
from heli_identifier.tracing.settings import SETTLING
from heli_plant.effects import AXES
from heli_plant.parameters import TABLE_2
from tests.blind.damage import DAMAGES, jittered, low_pass
from tests.blind.generator import make_rig, simulate_log
from tests.blind.windy import windy_rig
from tests.simulated import drive, noisy_log

H, COUNTS = 0.01, (4096, 4096, 8192)
TIME = H * np.arange(3000)
RNG = np.random.default_rng(7)
VOLTAGES = np.column_stack([np.repeat(RNG.uniform(1.0, 3.0, 600), 5) for _ in range(2)])
ANGLES = np.column_stack([0.2 * np.sin((0.7 + k) * TIME) for k in range(3)])
CLEAN = make_rig(9001, "clean")
BY_FIELD = {fault.field: fault for fault in FAULTS}


@pytest.mark.parametrize("damage, field, size, channel, tolerance", [
    ("voltages late by a sample", "log_late_voltages", 0.01, 0, 1e-12),
    ("voltages behind a filter of 5 Hz", "log_low_pass_voltages", None, 0, 1e-9),
    ("v_front times 1.1", "log_scale_v_front", 1.0 / 1.1 - 1.0, 0, 1e-12),
    ("pitch late by 20 ms", "log_late_pitch", 0.02, 2, 1e-12),
    ("elevation drifts 1 degree in 90 s", "log_drift_elevation", np.pi / 180.0 / 90.0, 3, 1e-12),
])  # fmt: skip
def test_a_fault_is_undone_by_its_own_size_and_one_of_size_0_changes_nothing(damage, field, size, channel, tolerance):
    """Damage made by other code, undone: the true signals but for the last samples, which a late channel has lost."""
    true = np.hstack([VOLTAGES, ANGLES])
    for fault in FAULTS:
        np.testing.assert_allclose(np.hstack(undo_faults({fault: 0.0}, VOLTAGES, ANGLES, H)), true, atol=1e-15)
    v, y = DAMAGES[damage](TIME, VOLTAGES, ANGLES)
    if size is None:  # a = exp(-2 pi 5 h) of the damage's filter: size = h a / (1 - a)
        a = np.exp(-2.0 * np.pi * 5.0 * H)
        size = H * a / (1.0 - a)
    found = np.hstack(undo_faults({BY_FIELD[field]: size}, v, y, H))
    np.testing.assert_allclose(found[2:-2, channel], true[2:-2, channel], atol=tolerance)


def test_play_is_undone_but_for_the_passage_from_one_side_to_the_other():
    """Errors are a tenth of the gap where they were half of it. Sines turn back under a torque that is almost even;
    before its first reversal, and behind its last, a log does not say on which side its encoder is pushed."""
    gap = 12.0 * np.pi / 4096.0
    v, y = DAMAGES["pitch with a play of 6 counts"](TIME, VOLTAGES, ANGLES)
    _, angles = undo_faults({BY_FIELD["log_backlash_pitch"]: gap}, v, y, H)
    inner = slice(500, -500)
    assert np.abs(y[inner, 0] - ANGLES[inner, 0]).max() == pytest.approx(0.5 * gap, rel=0.01)
    assert np.abs(angles[inner, 0] - ANGLES[inner, 0]).max() < 0.1 * gap


@pytest.mark.parametrize("vibration", [0.0, 1e-3])
def test_a_jitter_is_measured_and_neither_an_encoder_that_errs_nor_a_vibration_is_one(vibration):
    """Encoders' errors, uniform within a count, and .5 mrad of noise have nothing in common on three axes; a bench that
    vibrates by a milliradian moves all of them, at any rate."""
    count = 2.0 * np.pi / 4096.0
    shaken = ANGLES + vibration * np.sin(140.0 * TIME)[:, None]
    noisy = np.round((shaken + 5e-4 * RNG.standard_normal(ANGLES.shape)) / count) * count
    for damage, true in (("none", 0.0), ("clock jitters by 2 ms", 0.002)):
        tau, error = estimate_jitter(DAMAGES[damage](TIME, VOLTAGES, noisy)[1], H)
        assert abs(tau - true) < 4.0 * max(error, 1e-4)


def logs_of(damage: str, count: int = 3) -> list[Log]:
    return [damage_log(log_of(f"log {i}", 100.0, log), damage) for i, log in enumerate(CLEAN.train[:count])]


@pytest.mark.parametrize("damage, said", [
    ("travel a copy of the elevation", "same numbers"),
    ("pitch in radians under [deg]", "read as degrees"),
    ("travel folded at half a turn", "jumps by a whole turn"),
    ("v_front with the other sign", "one of the two has the wrong sign"),
])  # fmt: skip
def test_what_no_plant_can_explain_is_refused_by_name(damage, said):
    logs = logs_of(damage)
    if "folded" in damage:  # this rig stays within half a turn: turn it until it does not
        (log, *_) = logs_of("none")
        logs = [damage_log(replace(log, angles=log.angles + [0.0, 0.0, np.pi - log.angles[:, 2].max() + 0.05]), damage)]
    with pytest.raises(LogError, match=said):
        inspect_logs(logs, COUNTS, 5.0)


@pytest.mark.parametrize("damage, defects", [
    ("none", []),
    ("pitch of 256 counts", [("counts", "pitch")]),
    ("voltages cut to .1 V", [("rounded", "voltages")]),
    ("voltages clipped at 80 %", [("clipped", "voltages")]),
    ("elevation behind a filter of 5 Hz", [("filtered", "elevation")]),
    ("clock jitters by 2 ms", [("jitter", "clock")]),
])  # fmt: skip
def test_a_defect_that_a_log_shows_of_itself_is_named(damage, defects):
    assert [(d.name, d.channel) for d in inspect_logs(logs_of(damage), COUNTS, 5.0)] == defects


def test_angles_that_were_all_filtered_or_rounded_are_named_and_fine_noise_without_steps_is_neither():
    """A filter of 5 Hz leaves a tenth of an encoder's noise; three decimals are steps of 1 mrad, a count is 1.5."""
    count = 2.0 * np.pi / np.array(COUNTS)
    for change, defects in (
        (lambda y: np.column_stack([low_pass(5.0)(TIME, one) for one in y.T]), [("filtered", "angles")]),
        (lambda y: y + 0.3 * count * RNG.standard_normal(y.shape), []),
        (lambda y: y.round(3), [("rounded", "pitch"), ("rounded", "elevation")]),
    ):
        logs = [replace(log, angles=change(log.angles[:3000]), voltages=log.voltages[:3000]) for log in logs_of("none")]
        assert [(d.name, d.channel) for d in inspect_logs(logs, COUNTS, 5.0)] == defects


def test_the_steps_of_a_converter_of_eight_bits_are_voltages_and_not_digits_of_a_text():
    logs = [replace(log, voltages=np.round(log.voltages * 25.6) / 25.6) for log in logs_of("none")]
    assert inspect_logs(logs, COUNTS, 5.0) == ()


@pytest.mark.parametrize("counts", [1024, 4096, 16384])
def test_an_encoder_is_seen_where_no_value_comes_twice_and_not_behind_a_filter(counts):
    """A travel that never turns round, in degrees of three decimals; means of radians show the digits of a text."""
    step = 360.0 / counts
    read = (step * np.round((60.0 * TIME + 9.0 * np.sin(0.9 * TIME)) / step)).round(3)
    assert len(np.unique(read)) == len(read)
    assert quantisation_step(read) == pytest.approx(step, rel=1e-5)
    assert quantisation_step(low_pass(5.0)(TIME, read)) == quantisation_step(jittered(0.002)(TIME, read)) == 0.0
    assert quantisation_step(np.radians(np.convolve(read, np.ones(5) / 5.0, "valid")).round(3)) == pytest.approx(1e-3)
    (log, *_) = logs_of("none")
    turning = log_of("turning", 100.0, np.column_stack([TIME, log.voltages[:3000], log.angles[:3000, :2], read]))
    with pytest.raises(LogError, match="the travel moves .* its column is in degrees and was read as radians"):
        inspect_logs([turning], (4096, 4096, counts), 5.0)


def test_a_slip_of_an_encoder_is_found_and_shifted_back():
    """By its size: to a count, since what moves within a sample is seen in counts, and a digit of the log."""
    sound, damaged = logs_of("none"), logs_of("elevation slips by 24 counts")
    events = find_slips(damaged)
    for event, log in zip(events, damaged, strict=True):
        assert (event.log, event.axis, event.kind) == (log.name, "elevation", "slip")
        assert event.start == pytest.approx(0.4 * log.duration, abs=2.0 * H)
        assert event.size == pytest.approx(48.0 * np.pi / 4096.0, abs=0.003)  # two counts
    found, notes = undo_slips(damaged, events)
    assert len(notes) == len(damaged) and "elevation slips by" in notes[0]
    assert describe_events(damaged, events) == ()  # nothing but the encoder's coupling acted
    for one, other in zip(sound, found, strict=True):
        np.testing.assert_allclose(other.angles, one.angles, atol=2.0 * np.pi / 4096.0 + 1e-6)


def test_rows_that_a_log_lacks_are_no_slips_of_its_encoders():
    """All axes jump at once, each by its rate; six rows are lost where pitch and travel move fastest."""
    (log, *_) = logs_of("none", 1)
    pace = np.abs(np.gradient(log.angles[:, [0, 2]], axis=0)).min(1)
    first = 1000 + int(pace[1000:-1000].argmax())
    kept = np.delete(np.arange(log.samples), np.arange(first, first + 6))
    short = replace(log, angles=log.angles[kept], voltages=log.voltages[kept])
    gaps = find_slips([short])
    assert gaps and {event.kind for event in gaps} == {"gap"}
    ((same,), (note,)) = undo_slips([short], gaps)
    assert same is short and f"at {log.start + H * first:.2f} s" in note


def test_a_stop_that_turns_a_rate_round_is_no_slip():
    logs = logs_of("none", 3)
    angles = logs[1].angles.copy()
    angles[:, 2] = np.abs(angles[:, 2] - angles[4321, 2])  # the travel is thrown back there
    assert find_slips((logs[0], replace(logs[1], angles=angles), logs[2])) == ()


def test_an_angle_that_is_twice_too_large_is_refused_and_a_coarse_encoder_is_not():
    """Their steps are alike; gravity and thrust turn with the true pitch."""
    with pytest.raises(LogError, match="the pitch is 2 times too large"):
        identify_plant(logs_of("pitch twice as large", 2))
    found = identify_plant(logs_of("pitch of 2048 counts", 2))
    assert [(d.name, d.channel) for d in found.defects] == [("counts", "pitch")]
    assert found.plant.likelihood.rig.resolution[0] == pytest.approx(2.0 * np.pi / 2048)  # it rests by these


def test_commands_ahead_of_the_amplifiers_limit_are_refused_and_a_rig_with_a_higher_limit_is_not():
    """2 % of the voltages lie beyond 5 V: the rotors get 5 V of them, or the whole."""
    limited, free = (
        [noisy_log(TABLE_2._replace(v_max=limit), 2.5 * drive(60.0, k), k, name=f"{k}") for k in range(2)]
        for limit in (5.0, 24.0)
    )
    with pytest.raises(LogError, match="they are commands ahead of that limit"):
        identify_plant(limited)
    assert identify_plant(free).plant.estimate("k_x") == pytest.approx(TABLE_2.k_x, rel=0.01)


@pytest.mark.parametrize("axis", ["pitch", "elevation"])
def test_a_training_log_that_is_a_mirror_image_of_the_others_is_refused(axis):
    logs = logs_of("none", 3)
    logs[1] = replace(logs[1], angles=logs[1].angles * [-1.0 if axis == own else 1.0 for own in AXES])
    with pytest.raises(LogError, match=f"{logs[1].name} fits the rest with the sign of the {axis} changed"):
        identify_plant(logs)


def test_mirror_images_are_named_where_a_fit_to_all_logs_lies_between_them():
    """Two and two logs in windy air: the fit to all four makes front and rear exchanged look likelier, of one log."""
    logs = windy_logs(windy_rig(6, "ou", counts={"a": 4}), "a")
    mirrored = [replace(log, angles=log.angles * [-1.0, 1.0, 1.0]) for log in logs[2:]]
    with pytest.raises(LogError, match="the training logs a3, a4 fit the rest with the sign of the pitch changed"):
        identify_plant([*logs[:2], *mirrored])


@pytest.mark.slow
@pytest.mark.parametrize("factor, sign, said", [(1.1, 1, "its gains"), (1.0, -1, "it fits with the sign of the pitch")])
def test_a_log_of_a_rig_with_other_gains_and_a_mirrored_held_out_one_do_not_belong_to_the_others(factor, sign, said):
    """Gains 10 % larger; they drift by 1.5 % from log to log where a supply does."""
    base = CLEAN.truth.base
    other = CLEAN.truth._replace(base=base._replace(**{k: factor * getattr(base, k) for k in ("k_x", "k_z", "k_y")}))
    strange = log_of("strange", 100.0, simulate_log(other, CLEAN.train[2][:, 1:3], 5) * [1, 1, 1, sign, 1, 1])
    logs = [*logs_of("none", 2), strange]
    held = log_of("held", 100.0, CLEAN.held)
    found = diagnose(logs, held_out=held) if sign > 0 else diagnose(logs[:2], held_out=strange)
    assert found.effects == ()
    (note,) = (note for note in found.notes if "does not belong" in note)
    assert note.startswith(f"the log strange does not belong to the others: {said}")


def test_voltages_that_are_late_are_named_and_no_effect_is():
    """The plant of the damaged logs is that of the sound ones, and nothing is said against the rig."""
    sound, found = identify_plant(logs_of("none", 2)), identify_plant(logs_of("voltages late by a sample", 2))
    ((fault, size),) = found.plant.likelihood.faults.items()
    assert (fault.name, fault.channel) == ("late", "voltages")
    assert size == pytest.approx(0.01, abs=0.002)  # a fifth of a sample, what lag and delay trade against each other
    assert [f for f in found.selection.findings if f.effect.fault is None and f.established] == []
    for name in ("k_x", "k_z", "k_y"):  # within the interval of the sound logs
        one, other = (parameter_reports(one)[name].estimate for one in (sound, found))
        assert abs(one.value - other.value) < 1.96 * (one.standard_error or 0.0)


def test_a_controller_tells_by_how_much_an_angle_is_late_and_which_are_not_and_without_one_nothing_does():
    """Damage made by other code. Voltages that are late as well only look like a controller that takes its time."""
    flown = windy_rig(500, "ou", False, 100.0, "bare", True, {"a": 2, "b": 0, "t": 0, "c": 0})
    logs = [windy_log(name, own) for name, own in flown.logs.items()]
    assert undo_delays(logs) == (tuple(logs), (), frozenset(("pitch", "elevation", "travel")))
    for damage, channel, samples in (
        ("elevation late by 30 ms", 1, 3), ("pitch late by 20 ms", 0, 2), ("voltages late by a sample", None, 0),
    ):  # fmt: skip
        used, found, _ = undo_delays([damage_log(log, damage) for log in logs])
        said = [] if channel is None else [("late", ("pitch", "elevation")[channel])]
        assert [(own.name, own.channel) for own in found] == said
        for sound, own in zip(logs, used, strict=True):
            kept = slice(samples, sound.samples - samples)  # a late channel begins with what it never had
            if channel is not None:
                np.testing.assert_allclose(own.angles[kept], sound.angles[kept], atol=1e-12)
    assert undo_delays(logs_of("none", 2))[1:] == ((), frozenset())  # in open loop nobody answers


def test_what_is_left_out_is_the_event_with_its_margins_and_what_the_filter_then_needs_to_settle():
    log = logs_of("none", 1)[0]

    def pushed(start, end):
        return [Event(log.name, "pitch", start, end, log.start + start, log.start + end, "force", 1.0)]

    ((start, end),) = passages_left_out(pushed(30.0, 31.0))
    assert start < 30.0 - 0.2 and end > 31.0 + 0.2  # the edges of an event are known to .2 s
    used = is_counted(log.time, pushed(30.0, 31.0)).sum() * log.step
    assert used == pytest.approx(log.duration - SETTLING - (end - start) - SETTLING, abs=3 * log.step)
    assert not is_counted(log.time, pushed(0.0, 90.0)).any()
    doubts = ["of another rig" in describe_events([log], pushed(*ends))[0] for ends in ((30.0, 31.0), (10.0, 80.0))]
    assert doubts == [False, True]
