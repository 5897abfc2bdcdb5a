"""The stream of a following twin: stops, encoders that stand still, samples that are lost, and what is said of them."""

import numpy as np
import pytest

from heli_identifier.following import (
    MODES,
    FollowSettings,
    Sample,
    Told,
    correct,
    parameters_in_use,
    prepare_following,
    start_correcting,
)
from heli_identifier.following.events import BACK, FROZEN, WHY
from heli_identifier.following.stream import discounted, doubtful, first_stream, watched
from heli_plant.observer import Torque
from heli_plant.parameters import TABLE_2
from heli_plant.state import start_state
from tests.following import COUNT, documents, followed, record


def test_a_stop_of_the_stream_is_said_and_changes_nothing():
    rows = record(60.0, seed=6)
    fresh = [0.0 if 3000 <= k < 3500 else 1.0 for k in range(len(rows))]
    state, events, outputs, plan = followed(rows, fresh)
    assert [one["what"] for one in documents(events, plan)] == ["stream", "stream"]
    assert [event.time for event in events] == pytest.approx([30.19, 35.0])
    assert MODES[outputs[3200].mode] == "suspended"
    assert parameters_in_use(state, plan) == TABLE_2


def test_an_encoder_that_stands_still_while_the_rig_moves_is_said():
    rows = record(50.0, seed=7)
    for k in range(3000, 3300):
        rows[k] = [*rows[k][:2], rows[3000][2], *rows[k][3:]]
    state, events, _, plan = followed(rows)
    said = documents(events, plan)
    assert {one["what"] for one in said} == {"stream"}
    assert 30.0 < said[0]["time_s"] < 31.0
    assert parameters_in_use(state, plan) == TABLE_2


def test_an_encoder_at_fault_is_said_once_however_long_it_stands():
    """The observer is not corrected meanwhile: the acceleration with which it held the axis fades within a second."""
    rows = record(50.0, seed=7)
    for k in range(3000, 3600):
        rows[k] = [*rows[k][:2], rows[3000][2], *rows[k][3:]]
    _, events, _, plan = followed(rows)
    assert [(WHY[event.why], event.time < 36.0) for event in events] == [(WHY[FROZEN], True), (WHY[BACK], False)]


def test_an_encoder_that_jumps_after_it_stood_still_was_at_fault():
    """The travel is held at rest, then its encoder stands for 3 s while the rig wanders by 6 mrad, 18 deviations."""
    rows = record(50.0, seed=7)
    rng = np.random.default_rng(3)
    for k in range(len(rows)):
        drift = 0.002 * min(max(k - 3000, 0), 300) / 100
        shown = 0.0 if 3000 <= k < 3300 else drift
        rows[k] = [*rows[k][:4], 0.5 * COUNT * round(shown / COUNT * 2 + 0.5 * rng.standard_normal())]
        if 3000 <= k < 3300:
            rows[k][4] = rows[2999][4]
    # a travel that nothing drives: the others' motion is a rig's with k_y = 0
    parameters = TABLE_2._replace(k_y=1e-6, a_lt=0.0)
    state, events, _, plan = followed(rows, parameters=parameters)
    said = [(WHY[event.why], event.time) for event in events]
    assert said == [(WHY[FROZEN], pytest.approx(33.0)), (WHY[BACK], pytest.approx(33.01))]


def test_what_an_encoder_says_that_stands_for_half_a_second_does_not_count():
    rows = record(32.0, seed=7)
    plan = prepare_following(FollowSettings())
    state = start_correcting(plan, Sample(*rows[0]))
    for row in rows[1:3121]:
        state, _ = correct(state, Sample(*row), Told(), plan)
    # an axis that turned back when it came to rest: nothing says that it should have moved since
    rest = state.stream._replace(still=(0, 0, 48), rates=(0.0, 0.0, 0.0), torques=tuple(state.torque))
    state = state._replace(stream=rest)
    for stands in (False, True):
        state, _ = correct(state, Sample(*rows[3121][:4], rows[3120][4]), Told(), plan)
        assert [sums.spoiled for sums in state.sums] == [False, False, stands]
        assert discounted(state.stream, 2, plan) == stands


def test_what_came_in_from_an_encoder_before_it_had_stood_for_half_a_second_is_withdrawn():
    """The travel, held at rest, stands from 20 samples before the end of a block until 30 samples into the next."""
    rows = record(34.0, seed=7)
    rng = np.random.default_rng(3)
    for k in range(len(rows)):
        shown = rng.choice([0.0, COUNT]) if k < 3080 else 0.0
        rows[k] = [*rows[k][:4], shown if k % 2 else COUNT - shown]
    for k in range(3080, len(rows)):
        rows[k][4] = rows[3080][4]
    # a travel that nothing drives: the others' motion is a rig's with k_y = 0
    plan = prepare_following(FollowSettings(parameters=TABLE_2._replace(k_y=1e-6, a_lt=0.0)))
    state = start_correcting(plan, Sample(*rows[0]))
    states = [state]
    for row in rows[1:3132]:
        state, _ = correct(state, Sample(*row), Told(), plan)
        states.append(state)
    after = next(k for k in range(3080, 3132) if discounted(states[k].stream, 2, plan))
    assert 3100 < after < 3132
    assert states[after - 1].pages != states[3099].pages
    assert states[after].pages == states[3099].pages
    assert len(states[after].blocks) == len(states[3100].blocks)
    assert {x for row in (*state.blocks[-1].information, *state.blocks[-1].response) for x in row} == {0.0}


def test_an_encoder_that_moves_again_does_not_count_until_the_observer_has_settled():
    plan = prepare_following(FollowSettings())
    noise, rest = (6e-4, 6e-4, 3e-4), start_state(0.0, 0.0, 0.0)
    stream = first_stream((0.0, 0.0, 0.0))
    for _ in range(plan.stuck):
        stream = watched(stream, (0.0, 0.0, 0.0), True, rest, Torque(), noise, plan)
    counted = []
    for k in range(plan.settling + 1):
        stream = watched(stream, (0.0, 0.0, COUNT * (1 + k % 2)), True, rest, Torque(), (1.0, 1.0, 1.0), plan)
        counted.append(not discounted(stream, 2, plan))
    assert counted == [False] * plan.settling + [True]


def test_an_alarm_waits_while_an_encoder_stands_that_should_have_moved():
    plan = prepare_following(FollowSettings())
    noise = (6e-4, 6e-4, 3e-4)
    stream = first_stream((0.0, 0.0, 0.0))
    assert not doubtful(stream, noise, plan)
    # .1 rad/s in 20 ms are 2 mrad, 3.3 deviations; in 10 ms 1.7
    moving = stream._replace(rates=(0.1, 0.0, 0.0))
    assert doubtful(moving._replace(still=(2, 0, 0)), noise, plan)
    assert not doubtful(moving._replace(still=(1, 50, 50)), noise, plan)


def test_an_alarm_waits_while_an_encoder_stands_from_which_the_observer_sets_off():
    """From rest the rate at which the encoder stopped is 0; .05 rad/s since are .5 mrad a sample, .8 deviations."""
    plan = prepare_following(FollowSettings())
    noise = (6e-4, 6e-4, 3e-4)
    stream = first_stream((0.0, 0.0, 0.0))
    rest, moving = start_state(0.0, 0.0, 0.0), start_state(0.0, 0.0, 0.0)._replace(pitch_rate=-0.05)
    stream = watched(stream, (0.0, 0.0, 0.0), True, rest, Torque(), noise, plan)
    seen = []
    for _ in range(3):
        stream = watched(stream, (0.0, 0.0, 0.0), True, moving, Torque(), noise, plan)
        seen.append(doubtful(stream, noise, plan))
    assert seen == [False, False, True]
    # as soon as the encoder moves there is no doubt
    assert not doubtful(watched(stream, (-0.0015, 0.0, 0.0), True, rest, Torque(), noise, plan), noise, plan)


def test_a_twentieth_of_the_samples_lost_hides_no_change():
    after = TABLE_2._replace(k_x=0.75 * TABLE_2.k_x)
    rows = record(70.0, after, 30.0, seed=8)
    lost = np.random.default_rng(9).random(len(rows)) < 0.05
    state, events, _, plan = followed(rows, [0.0 if one else 1.0 for one in lost])
    assert [one["name"] for one in documents(events, plan) if one["what"] == "adopted"][:1] == ["pitch.gain"]
