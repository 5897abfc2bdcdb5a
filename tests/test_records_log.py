"""A log as a value, its round trip through a file, and several logs as one data set."""

import pickle
import shutil
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_src.units.signals import VOLTAGE_BOUND
from heli_identifier.errors import LogError
from heli_identifier.records import (
    Log,
    check_apart,
    check_excitation,
    counted_once,
    demo_files,
    read_data_set,
    read_log,
    read_logs,
    write_log,
)
from heli_identifier.records.configuration import HIGHEST_VOLTAGE
from heli_identifier.records.plausibility import still


def some_log(samples=600, rate_hz=100.0, seed=0):
    random = np.random.default_rng(seed)
    # Within +-1.5 rad no sample leaps by half a turn from the one before, which would be refused on reading.
    angles = 0.01 * np.cumsum(random.uniform(-1.0, 1.0, (samples, 3)), axis=0)
    return Log("some", rate_hz, random.uniform(-5.0, 5.0, (samples, 2)), angles)


def test_a_log_is_a_value_that_derives_step_samples_and_duration_from_its_rate():
    angles = np.zeros((600, 3))
    log = Log("some", 50.0, np.ones((600, 2)), angles)
    angles[0, 0] = 1.0
    assert (log.step, log.samples, log.duration, log.angles[0, 0]) == (0.02, 600, 12.0, 0.0)
    assert repr(log) == "<Log some: 12 s, 600 samples at 50 Hz>"
    for array in (log.time, log.voltages, log.angles):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    assert np.array_equal(pickle.loads(pickle.dumps(log)).angles, log.angles)
    assert HIGHEST_VOLTAGE == VOLTAGE_BOUND  # what is read can be flown by the units


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"voltages": np.zeros((600, 3))}, r"voltages has shape \(600, 3\), \(600, 2\)"),
        ({"angles": np.full((600, 3), np.nan)}, "angles is not finite at sample 0"),
        ({"angles": np.full((600, 3), -1e6)}, r"angles reach 1e\+06 rad, which no rig can \(at most 10000\)"),
        ({"rate_hz": 0.0}, "rate_hz = 0.0 Hz must be positive"),
        ({"voltages": np.zeros((1, 2)), "angles": np.zeros((1, 3))}, "it has 1 sample, 2 are needed"),
        ({"references": {"yaw": np.zeros(600)}}, "'yaw' is no axis"),
    ],
)
def test_a_log_that_contradicts_itself_is_refused(change, words):
    with pytest.raises(LogError, match=words):
        replace(some_log(), **change)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), rate_hz=st.sampled_from([50.0, 62.5, 100.0, 300.0, 500.0, 2000.0]))
def test_a_written_log_reads_back_as_it_was(tmp_path_factory, seed, rate_hz):
    log = some_log(samples=int(6 * rate_hz), rate_hz=rate_hz, seed=seed)
    log = replace(log, references={"pitch": 0.1 * log.time})
    twin = read_log(write_log(log, tmp_path_factory.mktemp("log") / "log.csv"))
    assert np.array_equal(twin.voltages, log.voltages)
    assert np.array_equal(twin.angles, log.angles)
    assert np.array_equal(twin.references["pitch"], log.references["pitch"])
    assert twin.rate_hz == pytest.approx(rate_hz, rel=1e-12)
    assert twin.notes == ()


def test_logs_of_one_name_are_told_apart_by_their_folders_or_numbered(tmp_path):
    log = some_log()
    assert [own.name for own in read_logs([log, log, replace(log, name="other")])] == ["some", "some (2)", "other"]
    paths = [write_log(log, tmp_path / day / "logs" / "run.csv") for day in ("monday", "tuesday")]
    (seen,), (judge,) = read_data_set(paths[:1], paths[1:])
    assert (seen.name, judge.name) == ("monday/logs/run", "tuesday/logs/run")


def test_a_voltage_that_is_constant_in_every_log_leaves_nothing_to_identify():
    moving, angles = np.sin(np.arange(1000) / 50.0), np.zeros((1000, 3))
    front, rear = (Log("run", 100.0, np.outer(moving, own), angles) for own in ([1.0, 0.0], [0.0, 1.0]))
    check_excitation([front, rear])
    with pytest.raises(LogError, match="v_rear is constant in every log, so there is nothing to identify"):
        check_excitation([front, front])
    with pytest.raises(LogError, match="name at least one file"):
        check_excitation([])


def test_no_log_may_count_twice_even_under_another_name_or_if_it_is_short(tmp_path):
    first, second, _ = demo_files("rig-a")[0]
    copy = shutil.copy(second, tmp_path / "copy.csv")
    with pytest.raises(LogError, match=r"copy.csv is held out for validation but shares samples with .*train2.csv"):
        check_apart(*read_data_set([first, second], [copy], end=6.0))
    with pytest.raises(LogError, match=r"copy.csv holds the same samples as .*train2.csv \(6 s from .*; give each log"):
        check_apart(*read_data_set([first], [second, copy], end=6.0))
    assert len(counted_once(read_logs([first, second, copy], end=6.0))[0]) == 2
    check_apart(read_logs(second, end=6.0), read_logs(second, start=6.01, end=12.0))


COUNT = 2.0 * np.pi / 4096
TIME = np.arange(3000) / 100.0
NOISE = np.random.default_rng(16).standard_normal(len(TIME))


def encoded(angle, shake=0.25):
    """What an encoder shows whose lines are shaken by a share of a count."""
    return COUNT * np.round(angle / COUNT + shake * NOISE)


def test_what_moves_is_told_from_flicker_and_noise():
    quiet_hover = encoded(0.5 * COUNT * np.sin(0.7 * TIME), 0.5)  # which flicker outweighs
    assert [still(angle) for angle in (encoded(0.1 * np.sin(1.3 * TIME)), quiet_hover)] == [None, None]
    for angle in (encoded(np.full(3000, 0.5 * COUNT)), encoded(5.0 * COUNT * NOISE), 0.01 * NOISE):
        assert still(angle) == "holds nothing but noise"
