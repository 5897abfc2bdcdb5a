"""LogPlayer: what it plays when, and the files that it refuses."""

import math
import re

import pytest

from fmu_src import Refusal
from fmu_src.units.log_player import LogPlayer, read_recording
from tests.units import initialised

HEADER = "time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]"
ROWS = ["4.00,1,2,.1,.2,.3", "4.01,3,4,.4,.5,.6", "4.02,5,-5,.7,.8,.9"]


def write(tmp_path, *lines):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


def playing(path, start=0.0):
    return initialised(LogPlayer, {"log.path": path, "log.start": start})


def test_row_k_shows_at_its_own_time_counted_from_the_first_row_and_holds(tmp_path):
    path = write(tmp_path, HEADER, *ROWS)
    assert playing(path, start=0.01).get_real([0]) == [3.0]
    unit, outputs = playing(path), list(range(5))
    assert unit.get_real(outputs) == [1.0, 2.0, 0.1, 0.2, 0.3]
    assert unit.do_step(0.0, 0.005) and unit.get_real([0]) == [1.0]
    assert unit.do_step(0.005, 0.005) and unit.get_real([0]) == [3.0]
    assert unit.do_step(0.01, 50.0)
    assert unit.get_real(outputs) == [5.0, -5.0, 0.7, 0.8, 0.9]


def test_every_row_of_a_long_log_shows_at_its_own_communication_point(tmp_path):
    """Times in the file and k H are rounded differently; no row may be missed or come a step early."""
    lines = [f"{k * 0.01:.2f},{k},0,0,0,0" for k in range(9001)]
    unit = playing(write(tmp_path, HEADER, *lines))
    for k in range(9000):
        assert unit.do_step(k * 0.01, 0.01)
        assert unit.get_real([0]) == [k + 1.0]


def test_degrees_column_order_further_columns_and_a_byte_order_mark_are_taken(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(
        "\ufefftravel [deg],note,time [s],pitch [deg],elevation [rad],v_rear [V],v_front [V]\n"
        "180,start,0,-7.8,.1,2,1\n".encode()
    )
    recording = read_recording(str(path))
    assert recording.rows[0] == pytest.approx((1.0, 2.0, math.radians(-7.8), 0.1, math.pi), rel=1e-15)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ((HEADER.replace("pitch [rad]", "pitch [grad]"), *ROWS), "no column 'pitch [rad]' or 'pitch [deg]'"),
        ((HEADER.replace("v_rear [V],", ""), *ROWS), "no column 'v_rear [V]'"),
        ((HEADER + ",pitch [deg]", *ROWS), "2 columns 'pitch [rad]' or 'pitch [deg]'"),
        ((HEADER, ROWS[0], "4.01,3,nan,.4,.5,.6"), "row 3, column 'v_rear [V]': 'nan' is not a finite number"),
        ((HEADER, ROWS[0], "4.01,3,,.4,.5,.6"), "row 3, column 'v_rear [V]': '' is not a finite number"),
        ((HEADER, ROWS[0], "4.01,3"), "row 3, column 'v_rear [V]': '' is not a finite number"),
        ((HEADER, ROWS[0], ROWS[0]), "row 3: time = 4 s must be greater than 4 s"),
        ((HEADER, ROWS[1], ROWS[0]), "row 3: time = 4 s must be greater than 4.01 s"),
        ((HEADER,), "no rows below its header"),
        (("\x89PNG\r", "\0"), "holds a NUL byte"),
    ],
)
def test_a_file_that_cannot_be_played_is_refused_with_row_and_column(tmp_path, lines, message):
    with pytest.raises(Refusal, match=re.escape(message)):
        read_recording(write(tmp_path, *lines))


def test_a_missing_file_and_an_empty_path_discard_every_step_with_the_reason(tmp_path):
    for path, reason in ((str(tmp_path / "none.csv"), "none.csv cannot be read"), ("", "log.path is empty")):
        unit = playing(path)
        assert reason in unit.log_queue[-1].msg
        assert not unit.do_step(0.0, 0.01)
        assert reason in unit.log_queue[-1].msg
