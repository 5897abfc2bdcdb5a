"""A log as a value and through a file; from stated instants to a uniform rate; several logs, and flights they share."""

import pickle
import shutil
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks import rigs
from benchmarks.rigs import windy_logs
from fmu_src.units.signals import VOLTAGE_BOUND
from heli_identifier import records
from heli_identifier.errors import IdentifierError, LogError
from heli_identifier.records.configuration import HIGHEST_VOLTAGE
from heli_identifier.records.plausibility import why_still
from heli_identifier.records.timing import GAP_STEPS, find_sampling, mean_of_held
from heli_identifier.tools import RigLogs, diagnose_rigs
from tests.blind.generator import make_rig, simulate_log
from tests.blind.windy import windy_rig


def some_log(samples=600, rate_hz=100.0, seed=0):
    random = np.random.default_rng(seed)
    # Within +-1.5 rad no sample leaps by half a turn from the one before, which would be refused on reading.
    angles = 0.01 * np.cumsum(random.uniform(-1.0, 1.0, (samples, 3)), axis=0)
    return records.Log("some", rate_hz, random.uniform(-5.0, 5.0, (samples, 2)), angles)


def test_a_log_is_a_value_that_derives_step_samples_and_duration_from_its_rate():
    angles = np.zeros((600, 3))
    log = records.Log("some", 50.0, np.ones((600, 2)), angles)
    angles[0, 0] = 1.0
    assert (log.step, log.samples, log.duration, log.angles[0, 0]) == (0.02, 600, 12.0, 0.0)
    for array in (log.time, log.voltages, log.angles):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    assert np.array_equal(pickle.loads(pickle.dumps(log)).angles, log.angles)
    assert HIGHEST_VOLTAGE == VOLTAGE_BOUND  # what is read can be flown by the units


PUSH = (records.Event("some", "pitch", 2.0, 3.0, 2.0, 3.0, "force", 0.1),)


@pytest.mark.parametrize(("change", "words"), [
    ({"voltages": np.zeros((600, 3))}, r"voltages has shape \(600, 3\), \(600, 2\)"),
    ({"angles": np.full((600, 3), np.nan)}, "angles, sample 0: not finite, or beyond 10000 rad"),
    ({"angles": np.full((600, 3), -1e6)}, "angles, sample 0: not finite, or beyond 10000 rad"),
    ({"rate_hz": 0.0}, "rate_hz = 0.0 Hz must be positive"),
    ({"voltages": np.zeros((1, 2)), "angles": np.zeros((1, 3))}, "it has 1 sample, 2 are needed"),
    ({"references": {"yaw": np.zeros(600)}}, "'yaw' is no axis"),
    ({"name": "other", "events": PUSH}, "an event of log 'some' is not of this log"),
    ({"events": [replace(*PUSH, end=1.0)]}, "an event from 2 s to 1 s is no passage"),
])  # fmt: skip
def test_a_log_that_contradicts_itself_is_refused(change, words):
    with pytest.raises(LogError, match=words):
        replace(some_log(), **change)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), rate_hz=st.sampled_from([50.0, 62.5, 100.0, 300.0, 500.0, 2000.0]))
def test_a_written_log_reads_back_as_it_was(tmp_path_factory, seed, rate_hz):
    log = some_log(samples=int(6 * rate_hz), rate_hz=rate_hz, seed=seed)
    log = replace(log, references={"pitch": 0.1 * log.time})
    twin = records.read_log(records.write_log(log, tmp_path_factory.mktemp("log") / "log.csv"))
    assert np.array_equal(twin.voltages, log.voltages) and np.array_equal(twin.angles, log.angles)
    assert np.array_equal(twin.references["pitch"], log.references["pitch"])
    assert twin.rate_hz == pytest.approx(rate_hz, rel=1e-12) and twin.notes == ()


def test_logs_of_one_name_are_told_apart_by_their_folders_or_numbered(tmp_path):
    log = some_log()
    again = records.read_logs([log, replace(log, events=PUSH), replace(log, name="other")])
    assert [own.name for own in again] == ["some", "some (2)", "other"] and again[1].events[0].log == "some (2)"
    paths = [records.write_log(log, tmp_path / day / "logs" / "run.csv") for day in ("monday", "tuesday")]
    (seen,), (judge,) = records.read_data_set(paths[:1], paths[1:])
    assert (seen.name, judge.name) == ("monday/logs/run", "tuesday/logs/run")


def test_no_log_may_count_twice_even_under_another_name_or_if_it_is_short(tmp_path):
    first, second, _ = records.demo_files("rig-a")[0]
    copy = shutil.copy(second, tmp_path / "copy.csv")
    with pytest.raises(LogError, match=r"copy.csv is held out for validation but shares samples with .*train2.csv"):
        records.check_held_out_is_new(*records.read_data_set([first, second], [copy], end=6.0))
    with pytest.raises(LogError, match=r"copy.csv is held out .* shares samples with .*train2.csv \(6 s from .*; give"):
        records.check_held_out_is_new(*records.read_data_set([first], [second, copy], end=6.0))
    logs = records.read_logs([first, second, copy], end=6.0)
    assert len(records.drop_excerpts(logs)[0]) == 2
    records.check_held_out_is_new(records.read_logs(second, end=6.0), records.read_logs(second, start=6.01, end=12.0))


def test_a_demonstration_rig_that_does_not_exist_is_refused_by_those_that_do():
    with pytest.raises(LogError, match="no demonstration rig 'rig-x'; choose one of rig-a"):
        records.demo_files("rig-x")


COUNT = 2.0 * np.pi / 4096
TIME = np.arange(3000) / 100.0
NOISE = np.random.default_rng(16).standard_normal(len(TIME))


def encoded(angle, shake=0.25):
    """What an encoder shows whose lines are shaken by a share of a count."""
    return COUNT * np.round(angle / COUNT + shake * NOISE)


def test_what_moves_is_told_from_flicker_and_a_voltage_that_never_does_is_refused():
    quiet_hover = encoded(1.5 * COUNT * np.sin(0.7 * TIME), 0.5)
    assert [why_still(angle) for angle in (encoded(0.1 * np.sin(1.3 * TIME)), quiet_hover)] == [None, None]
    assert "no more than an encoder flickers" in why_still(encoded(np.full(3000, 0.5 * COUNT)))
    # a voltage that is constant in every log leaves nothing to identify
    moving, angles = np.sin(np.arange(1000) / 50.0), np.zeros((1000, 3))
    front, rear = (records.Log("run", 100.0, np.outer(moving, own), angles) for own in ([1.0, 0.0], [0.0, 1.0]))
    records.check_excitation([front, rear])
    with pytest.raises(LogError, match="v_rear is constant in every log, so there is nothing to identify"):
        records.check_excitation([front, front])
    with pytest.raises(LogError, match="name at least one file"):
        records.check_excitation([])


RIG = make_rig(9001, "clean")
TWO_COUNTS = 4.0 * np.pi / 4096.0 * np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])


def log_of(samples, name="log"):
    rate = (len(samples) - 1) / (samples[-1, 0] - samples[0, 0])
    return rigs.log_of(name, round(rate, 6), samples)


def at(samples, time):
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
    assert records.find_shared_flight(one, other) is not None
    assert records.find_shared_flight(other, one) is not None


def test_the_stretch_that_two_logs_share_is_found():
    """Pieces are 8 s: the stretch is known to that, its place to the sample of the common grid."""
    samples = RIG.train[2]
    one, other = log_of(samples[:6000]), log_of(samples[3000:])
    first, second, length = records.find_shared_flight(one, other)
    assert first - second == pytest.approx(30.0, abs=0.05) and 22.0 <= length <= 30.0


def test_flights_of_the_same_voltages_or_under_one_controller_or_at_rest_are_not_one_flight():
    """The calmest room of the generated rigs; the air of each flight is its own."""
    for samples in (RIG.train[0], RIG.train[2]):
        again = [log_of(simulate_log(RIG.truth, samples[:, 1:3], seed)) for seed in (1, 2)]
        for one, other in combinations([log_of(samples), *again], 2):
            assert records.find_shared_flight(one, other) is None
    # at rest angles are noise alone, in which every recording is like every other one
    logs = windy_logs(windy_rig(501, quiet=True, effects="bare", counts={"a": 4}), "a")
    rng = np.random.default_rng(0)
    logs += [records.Log("rest", 100.0, np.zeros((6000, 2)), rng.normal(0.0, 3e-4, (6000, 3))) for _ in range(2)]
    assert not any(records.find_shared_flight(one, other) for one, other in combinations(logs, 2))


def test_a_flight_that_is_given_twice_counts_once_and_is_refused_in_two_rigs_of_a_fleet():
    logs = [log_of(COPIES["cut to 20 s"](RIG.train[2]), "part"), log_of(RIG.train[0]), log_of(RIG.train[2], "whole")]
    kept, (note,) = records.drop_excerpts(logs)
    assert kept == (logs[1], logs[2])  # the longer one stays
    assert note.startswith("part is left out: ") and "the same flight as whole" in note
    one = RigLogs((log_of(RIG.train[2], "a"),), (log_of(RIG.held, "b"),))
    other = RigLogs((log_of(COPIES["noise of two counts added"](RIG.train[2]), "c"),), (log_of(RIG.train[0], "d"),))
    with pytest.raises(IdentifierError, match="rig first: it shares a flight with rig second: a and c are one"):
        diagnose_rigs({"first": one, "second": other})


def test_a_held_out_log_that_is_hardly_excited_is_noted():
    hover = RIG.held * np.array([1.0, 0.0, 0.0, 1.0, 1.0, 1.0]) + np.array([0.0, 1.5, 1.5, 0.0, 0.0, 0.0])
    training = [log_of(RIG.train[2]), log_of(RIG.train[0])]
    elevation, pitch = records.excitation_notes(training, [log_of(hover, "hover")])
    assert "hover is held out and hardly excited" in elevation and "little on the elevation" in elevation
    assert "pitch and travel" in pitch
    assert records.excitation_notes(training, [log_of(RIG.held)]) == ()


def sampling_of(time):
    return find_sampling(time, "log.csv", 2)


@pytest.mark.parametrize("rate_hz", [50.0, 62.5, 99.5, 100.0, 2000.0])
def test_an_even_time_keeps_its_samples_and_is_not_commented_on(rate_hz):
    found, grid, notes = sampling_of(3.0 + np.arange(12000) / rate_hz)
    assert (grid, notes) == (None, []) and found == pytest.approx(rate_hz, rel=1e-12)


@pytest.mark.parametrize("rate_hz", [60, 256, 300, 333])
@pytest.mark.parametrize("printed", [np.round, np.floor], ids=["rounded", "cut off"])
def test_a_time_of_too_few_digits_is_uneven_but_shows_the_rate_of_the_clock(rate_hz, printed):
    found, grid, notes = sampling_of(printed(1e3 * np.arange(7000) / rate_hz) / 1e3)
    # the ends are known to a digit: 1 ms of some 10 s
    assert found == pytest.approx(rate_hz, rel=1.5e-4) and grid is not None and "uneven" in notes[0]


TENTH = np.flatnonzero(np.random.default_rng(3).random(9_990) < 0.1) + 5


@pytest.mark.parametrize(
    ("rate_hz", "count", "lost", "seen"),
    [(1e3, 10_000, TENTH, 1e3), (100.0, 2000, np.arange(4, 1990, 3), 100.0), (300.0, 7000, 700, 300.0)]
    + [(700.0, 7000, at, 1000.0) for at in (3500, 6300)],  # steps of 1 and 2 ms look like 1 kHz
)
def test_lost_samples_are_lost_and_no_coarse_print(rate_hz, count, lost, seen):
    """All instants behind a loss are a step late: off any line by half a step and half a digit, more than a digit."""
    found, grid, notes = sampling_of(np.delete(np.round(np.arange(count) / rate_hz, 3), lost))
    assert grid is not None and "uneven" in notes[0]
    assert found == pytest.approx(seen, rel=1.5e-4)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), spread=st.floats(0.05, 0.2))
def test_jitter_of_either_sign_still_shows_the_rate_of_the_clock(seed, spread):
    # Up to a fifth of a step either way no interval rounds to another number of steps than one.
    random = np.random.default_rng(seed)
    samples = np.arange(2000) + random.uniform(-spread, spread, 2000)
    found, grid, notes = sampling_of(samples / 100.0)
    assert grid is not None and "uneven" in notes[0] and found == 100.0
    # It need not be whole: over 2000 steps the ends tell .05 Hz, and by jitter they are off by .02 Hz.
    assert sampling_of(samples / 100.08)[0] == pytest.approx(100.08, abs=0.021)


def test_the_longest_bridged_gap_is_five_steps_and_a_longer_one_names_its_row():
    whole = np.arange(2000) / 100.0
    bridged = GAP_STEPS - 1
    assert sampling_of(np.delete(whole, slice(100, 100 + bridged)))[1] is not None
    # Samples 100 .. 104 are lost, so the first row after the gap is that of sample 100 in what is left.
    with pytest.raises(LogError, match=r"log.csv, row 102: no samples for 0.06 s before 1.05 s"):
        sampling_of(np.delete(whole, slice(100, 101 + bridged)))
    with pytest.raises(LogError, match="^log.csv: 4.9995 s of log are shorter than 5 s"):
        sampling_of(np.arange(9999) / 2000.0)  # a little too short: the length that is said is below the bound


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_resampling_a_held_voltage_keeps_its_impulse(seed):
    random = np.random.default_rng(seed)
    time = 3.0 + np.concatenate(([0.0], np.cumsum(random.uniform(0.005, 0.02, 199))))
    voltage = random.uniform(-5.0, 5.0, 200)
    grid = np.linspace(3.0, time[-1] - 0.003, 150)
    step = grid[1] - grid[0]
    resampled = mean_of_held(time, voltage, grid)
    # The impulse is a sum of rectangles, exact to rounding; the last voltage is held to the end of the last step.
    assert step * resampled.sum() == pytest.approx(np.sum(voltage * np.diff(time, append=grid[-1] + step)), abs=1e-10)
    assert np.abs(resampled).max() <= np.abs(voltage).max() + 1e-9
