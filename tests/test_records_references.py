"""Reference columns of a log: found by name or by configuration, in radians, with the axis's sign, cut with the log."""

import numpy as np
import pytest

from heli_identifier.errors import ConfigurationError, LogError
from heli_identifier.records import Log, LogFormat, read_log, write_log

COUNT = 600
HEADER = "time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]"


@pytest.fixture
def written(tmp_path):
    """Write a log of 6 s with one further column under a header; its values count up from zero."""

    def write(header, values=None):
        time = np.arange(COUNT) / 100.0
        further = np.arange(COUNT) * 0.01 if values is None else values
        rows = np.column_stack(
            (time, np.sin(time), np.cos(time), 0.1 * np.sin(3 * time), 0.1 * np.cos(time), time, further)
        )
        path = tmp_path / "log.csv"
        np.savetxt(path, rows, delimiter=",", header=f"{HEADER},{header}", comments="")
        return path

    return write


def test_a_column_called_like_the_contract_is_a_reference(written):
    log = read_log(written("pitch_reference [rad]"))
    assert list(log.references) == ["pitch"] and log.extra == {}
    np.testing.assert_allclose(log.references["pitch"], np.arange(COUNT) * 0.01, rtol=1e-12)


def test_degrees_become_radians_and_the_sign_is_that_of_the_axis(written):
    log = read_log(written("Elevation Reference [deg]"), LogFormat(signs={"elevation": -1}))
    np.testing.assert_allclose(log.references["elevation"], -np.radians(np.arange(COUNT) * 0.01), rtol=1e-12)


def test_a_configured_column_takes_the_unit_of_the_axis(written):
    format = LogFormat(references={"travel": "wanted"}, units={"travel": "deg"})
    assert read_log(written("wanted"), format).references["travel"][-1] == pytest.approx(np.radians(5.99), rel=1e-12)


def test_a_reference_is_cut_with_its_log_and_held_when_resampled(written):
    log = read_log(written("pitch_reference [rad]"), start=0.5)
    assert log.references["pitch"].shape == (log.samples,)
    assert log.references["pitch"][0] == pytest.approx(0.5, rel=1e-9)


def test_what_was_written_is_read_back(written, tmp_path):
    log = read_log(written("pitch_reference [rad]"))
    again = read_log(write_log(log, tmp_path / "again.csv"))
    np.testing.assert_array_equal(again.references["pitch"], log.references["pitch"])


def test_a_column_without_a_unit_stays_a_further_column(written):
    log = read_log(written("pitch_reference"))
    assert log.references == {} and list(log.extra) == ["pitch_reference"]


@pytest.mark.parametrize(
    "format, header, values, message",
    [
        (LogFormat(references={"pitch": "stick"}), "other", None, "0 columns are called 'stick'"),
        (LogFormat(references={"pitch": "stick"}), "stick", None, "unit of 'stick' is missing"),
        (LogFormat(), "pitch_reference [rad]", np.where(np.arange(COUNT) == 7, np.nan, 0.1), "not finite at sample 7"),
    ],
)
def test_bad_references_are_refused_with_the_column(written, format, header, values, message):
    with pytest.raises(LogError, match=message):
        read_log(written(header, values), format)


def test_a_reference_belongs_to_an_axis():
    with pytest.raises(ConfigurationError, match="log.references.yaw is no axis"):
        LogFormat(references={"yaw": "psi"})
    with pytest.raises(LogError, match="'yaw' is no axis"):
        Log("a", 100.0, np.zeros((10, 2)), np.zeros((10, 3)), references={"yaw": np.zeros(10)})
