"""Logs that share flight are recognised by their samples; flights of the same voltages are not taken for one."""

from itertools import combinations

import numpy as np
import pytest

from heli_identifier.errors import IdentifierError
from heli_identifier.records import (
    Log,
    counted_once,
    excitation_notes,
    shared_flight,
)
from heli_identifier.tools import Rig, diagnose_rigs
from tests.blind.generator import make_rig, simulate_log
from tests.blind.windy import windy_rig

RIG = make_rig(9001, "clean")
TWO_COUNTS = 4.0 * np.pi / 4096.0 * np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])


def log_of(samples: np.ndarray, name: str = "log", start: float = 0.0) -> Log:
    rate = (len(samples) - 1) / (samples[-1, 0] - samples[0, 0])
    return Log(name, round(rate, 6), samples[:, 1:3].copy(), samples[:, 3:6].copy(), start=start)


def at(samples: np.ndarray, time: np.ndarray) -> np.ndarray:
    """A recording at other instants."""
    return np.column_stack([time, *(np.interp(time, samples[:, 0], column) for column in samples.T[1:])])


COPIES = {
    "as it is": lambda s: s,
    "resampled to 73 Hz, between its samples": lambda s: at(s, 0.0037 + np.arange(0.0, s[-1, 0] - 0.02, 1 / 73.0)),
    "resampled to 20 Hz": lambda s: at(s, np.arange(0.0, s[-1, 0], 1 / 20.0)),
    "cut to 20 s": lambda s: s[700:2700],
    "zeroed elsewhere": lambda s: s + np.array([0.0, 0.0, 0.0, 0.1, -0.2, 3.0]),
    "voltages and angles rounded to three decimals": lambda s: np.hstack([s[:, :1], s[:, 1:].round(3)]),
    "noise of two counts added": lambda s: s + np.random.default_rng(3).normal(0.0, TWO_COUNTS, s.shape),
    "angles late by 30 ms": lambda s: np.hstack([s[:, :3], at(s, s[:, 0] - 0.03)[:, 3:]]),
    "other voltages": lambda s: s * np.array([1.0, 1.3, -1.0, 1.0, 1.0, 1.0]),
}


@pytest.mark.parametrize("done", COPIES)
def test_a_copy_of_a_flight_is_recognised_whatever_was_done_to_it(done):
    one, other = log_of(RIG.train[2]), log_of(COPIES[done](RIG.train[2]))
    assert shared_flight(one, other) is not None
    assert shared_flight(other, one) is not None


def test_the_stretch_that_two_logs_share_is_found():
    """Pieces are 8 s: the stretch is known to that, its place to the sample of the common grid."""
    samples = RIG.train[2]
    one, other = log_of(samples[:6000]), log_of(samples[3000:])
    first, second, length = shared_flight(one, other)
    assert first - second == pytest.approx(30.0, abs=0.05)
    assert 22.0 <= length <= 30.0


def test_flights_of_the_same_voltages_are_not_one_flight():
    """The calmest room of the generated rigs; the air of each flight is its own."""
    for samples in (RIG.train[0], RIG.train[2]):
        again = [log_of(simulate_log(RIG.truth, samples[:, 1:3], seed)) for seed in (1, 2)]
        for one, other in combinations([log_of(samples), *again], 2):
            assert shared_flight(one, other) is None


def test_flights_of_one_rig_under_its_controller_or_at_rest_are_not_one_flight():
    """At rest angles are noise alone, in which every recording is like every other one."""
    flown = windy_rig(501, "ou", True, 100.0, "bare", True, {"a": 4, "b": 0, "t": 0, "c": 0}).logs
    logs, rng = [Log(name, 100.0, own.voltages, own.angles) for name, own in flown.items()], np.random.default_rng(0)
    logs += [Log("rest", 100.0, np.zeros((6000, 2)), rng.normal(0.0, 3e-4, (6000, 3))) for _ in range(2)]
    assert not any(shared_flight(one, other) for one, other in combinations(logs, 2))


def test_a_flight_that_is_given_twice_counts_once():
    logs = [log_of(COPIES["cut to 20 s"](RIG.train[2]), "part"), log_of(RIG.train[0]), log_of(RIG.train[2], "whole")]
    kept, (note,) = counted_once(logs)
    assert kept == (logs[1], logs[2])  # the longer one stays
    assert note.startswith("part is left out: ") and "the same flight as whole" in note


def test_a_held_out_log_that_is_hardly_excited_is_noted():
    hover = RIG.held * np.array([1.0, 0.0, 0.0, 1.0, 1.0, 1.0]) + np.array([0.0, 1.5, 1.5, 0.0, 0.0, 0.0])
    training = [log_of(RIG.train[2]), log_of(RIG.train[0])]
    elevation, pitch = excitation_notes(training, [log_of(hover, "hover")])
    assert "hover is held out and hardly excited" in elevation and "little on the elevation" in elevation
    assert "pitch and travel" in pitch
    assert excitation_notes(training, [log_of(RIG.held)]) == ()


def test_rigs_of_a_fleet_that_share_a_flight_are_refused():
    one = Rig((log_of(RIG.train[2], "a"),), (log_of(RIG.held, "b"),))
    other = Rig((log_of(COPIES["noise of two counts added"](RIG.train[2]), "c"),), (log_of(RIG.train[0], "d"),))
    with pytest.raises(IdentifierError, match="rig first: it shares a flight with rig second: a and c are one"):
        diagnose_rigs({"first": one, "second": other})
