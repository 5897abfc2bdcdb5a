"""A log as a value, and its round trip through a file."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from heli_identifier.errors import LogError
from heli_identifier.records import Log, read_log, write_log


def some_log(samples=600, rate_hz=100.0, seed=0):
    random = np.random.default_rng(seed)
    # Within +-1.5 rad no sample leaps by half a turn from the one before, which would be refused on reading.
    angles = 0.01 * np.cumsum(random.uniform(-1.0, 1.0, (samples, 3)), axis=0)
    return Log("some", rate_hz, random.uniform(-5.0, 5.0, (samples, 2)), angles)


def test_a_log_derives_step_samples_and_duration_from_its_rate():
    log = some_log(samples=600, rate_hz=50.0)
    assert log.step == 0.02
    assert log.samples == 600
    assert log.duration == 12.0


def test_the_arrays_of_a_log_cannot_be_written_to():
    log = some_log()
    for array in (log.time, log.voltages, log.angles):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_a_log_does_not_follow_later_changes_of_the_arrays_it_was_made_from():
    angles = np.zeros((600, 3))
    log = Log("still", 100.0, np.zeros((600, 2)), angles)
    angles[0, 0] = 1.0
    assert log.angles[0, 0] == 0.0


def test_signals_are_found_by_name():
    log = some_log()
    assert np.array_equal(log.signal("v_rear"), log.voltages[:, 1])
    assert np.array_equal(log.signal("pitch"), log.angles[:, 0])
    with pytest.raises(LogError, match="yaw"):
        log.signal("yaw")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"voltages": np.zeros((600, 3))}, r"voltages has shape \(600, 3\), \(600, 2\)"),
        ({"angles": np.full((600, 3), np.nan)}, "angles is not finite at sample 0"),
        ({"rate_hz": 0.0}, "rate_hz = 0.0 Hz must be positive"),
        ({"voltages": np.zeros((1, 2)), "angles": np.zeros((1, 3))}, "it has 1 sample, 2 are needed"),
        ({"extra": {"current [A]": np.zeros(3)}}, r"'current \[A\]' has shape \(3,\)"),
    ],
)
def test_a_log_that_contradicts_itself_is_refused(change, words):
    good = some_log()
    fields = {name: getattr(good, name) for name in Log.__dataclass_fields__}
    with pytest.raises(LogError, match=words):
        Log(**fields | change)


def test_a_log_travels_between_processes():
    log = some_log()
    twin = pickle.loads(pickle.dumps(log))
    assert twin.rate_hz == log.rate_hz
    assert np.array_equal(twin.angles, log.angles)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), rate_hz=st.sampled_from([50.0, 62.5, 100.0, 300.0, 500.0, 2000.0]))
def test_a_written_log_reads_back_as_it_was(tmp_path_factory, seed, rate_hz):
    log = some_log(samples=int(6 * rate_hz), rate_hz=rate_hz, seed=seed)
    path = write_log(log, tmp_path_factory.mktemp("log") / "log.csv")
    twin = read_log(path)
    # Older pandas parses a decimal to within one unit in the last place, newer exactly.
    assert np.allclose(twin.voltages, log.voltages, rtol=3e-16, atol=0.0)
    assert np.allclose(twin.angles, log.angles, rtol=3e-16, atol=0.0)
    assert twin.rate_hz == pytest.approx(rate_hz, rel=1e-12)
    assert twin.notes == ()


def test_columns_kept_aside_survive_the_round_trip_with_their_holes(tmp_path):
    log = some_log()
    current = np.linspace(0.0, 1.0, log.samples)
    current[7] = np.nan
    fields = {name: getattr(log, name) for name in Log.__dataclass_fields__}
    path = write_log(Log(**fields | {"extra": {"current, total [A]": current}}), tmp_path / "log.csv")
    twin = read_log(path).extra["current, total [A]"]
    assert np.isnan(twin[7])
    assert np.allclose(twin, current, rtol=3e-16, atol=0.0, equal_nan=True)


def test_a_log_that_cannot_be_written_leaves_nothing_behind(tmp_path):
    (tmp_path / "taken").mkdir()
    with pytest.raises(LogError, match="cannot be written"):
        write_log(some_log(), tmp_path / "taken")
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]
