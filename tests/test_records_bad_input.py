"""Bad input gets one clear sentence that names the file, the place, the value and the way out.

What a laboratory meets most stands in tests/faults/logs.py, through the commands; here is the rest.
"""

import numpy as np
import pytest
from scipy.io import savemat

from heli_identifier.errors import LogError
from heli_identifier.records import demo_logs, read_log
from heli_identifier.records.plausibility import still
from heli_identifier.records.units import CONTRACT_HEADERS

LINES = demo_logs("rig-c")[1][0].read_text().splitlines()
HEADER, ROWS = LINES[0], LINES[1:]
SHORT = LINES[:1002]
ROW_18 = 17  # index of what an editor calls row 18


def with_header(text, rows=SHORT[1:]):
    return [text, *rows]


def with_row(text):
    return [*SHORT[:ROW_18], text, *SHORT[ROW_18 + 1 :]]


def with_time(instants):
    return [HEADER, *(f"{t},{row.split(',', 1)[1]}" for t, row in zip(instants, ROWS, strict=False))]


CASES = {
    "several missing columns": (with_header("t,a,b,c,d,e"), r"columns 'time \[s\]', 'v_front \[V\]'.*found 't', 'a'"),
    "a voltage in degrees": (
        with_header(HEADER.replace("v_front [V]", "v_front [deg]")),
        "unit 'deg' is unknown, V or mV",
    ),
    "an empty cell": (with_row("0.16,,1,0,0,0"), r"row 18, column 'v_front \[V\]': the cell is empty"),
    "a short row": (with_row("0.16,1,1"), r"row 18, column 'pitch \[rad\]': the cell is empty"),
    "a word": (with_row("0.16,1,on,0,0,0"), r"row 18, column 'v_rear \[V\]': the cell holds 'on'"),
    "a word where time stands": (with_row("later,1,1,0,0,0"), r"row 18, column 'time \[s\]': the cell holds 'later'"),
    "a slow log": (with_time(np.arange(2000) / 40.0), "the rate of 40 Hz is below 50 Hz"),
    "a fast log": (with_time(np.arange(9000) / 2500.0), "the rate of 2500 Hz is above 2000 Hz"),
    "one sample": (SHORT[:2], "1 sample"),
    "a header alone": (SHORT[:1], "holds a header but no rows"),
}


@pytest.mark.parametrize("case", CASES)
def test_a_bad_log_gets_one_sentence_that_says_what_is_wrong_and_where(tmp_path, case):
    lines, words = CASES[case]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines))
    with pytest.raises(LogError, match=words) as caught:
        read_log(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert message.endswith((".", "?"))
    assert "\n" not in message


def test_text_that_begins_like_utf_16_and_is_none_is_refused(tmp_path):
    (tmp_path / "log.csv").write_bytes("\n".join(SHORT).encode("utf-16")[:-1])
    with pytest.raises(LogError, match="begins like UTF-16 text but is none"):
        read_log(tmp_path / "log.csv")


@pytest.mark.parametrize(
    ("cut", "words"),
    [
        ({"start": 20.0}, "start = 20 s lies after the log's end, 10 s"),
        ({"end": -1.0}, "end = -1 s lies before the log's start at 0 s"),
        ({"start": 8.0, "end": 3.0}, "end = 3 s must come after start = 8 s"),
        ({"start": 7.0}, "3.01 s of log are shorter than 5 s"),
    ],
)
def test_a_cut_that_leaves_too_little_is_refused(tmp_path, cut, words):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(SHORT))
    with pytest.raises(LogError, match=words):
        read_log(path, **cut)


def test_the_row_is_that_of_the_file_even_behind_a_cut(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("\n".join([*SHORT[:517], "5.16,1,,0,0,0", *SHORT[518:]]))
    with pytest.raises(LogError, match="row 518, column"):
        read_log(path, start=2.0)


def matlab(**change):
    names = [header.replace(" [", "_").rstrip("]") for header in CONTRACT_HEADERS]
    variables = dict(zip(names, np.genfromtxt(SHORT[1:], delimiter=",").T, strict=True))
    return variables | change


@pytest.mark.parametrize(
    ("variables", "words"),
    [
        ({"gain": 3.0, "who": "me"}, "holds no vector of numbers, found gain, who"),
        (matlab(pitch_rad=np.zeros(30)), "'pitch_rad' has 30 samples, 'time_s' has 1001"),
        (matlab(pitch_rad=np.append(np.zeros(1000), np.nan)), "row 1001, column 'pitch_rad': the cell holds 'nan'"),
        (matlab(pitch_rad=np.full(1001, 1j)), "row 1, column 'pitch_rad': the cell holds"),
        ({name: value for name, value in matlab().items() if name != "time_s"}, r"column 'time \[s\]' missing"),
    ],
)
def test_a_matlab_file_that_holds_no_log_says_why(tmp_path, variables, words):
    savemat(tmp_path / "log.mat", variables)
    with pytest.raises(LogError, match=words):
        read_log(tmp_path / "log.mat")


def test_a_matlab_vector_of_another_length_is_left_out_unless_it_is_a_signal(tmp_path):
    savemat(tmp_path / "log.mat", matlab(gains=np.arange(4.0), counter=np.arange(1001), name="a run", Ts=0.01))
    log = read_log(tmp_path / "log.mat")
    assert list(log.extra) == ["counter"]
    assert log.notes == ("left out 'gains': not one number per sample",)


COUNT = 2.0 * np.pi / 4096
TIME = np.arange(3000) / 100.0
NOISE = np.random.default_rng(16).standard_normal(len(TIME))


def read(angle, shake=0.25):
    """What an encoder shows whose lines are shaken by a share of a count."""
    return COUNT * np.round(angle / COUNT + shake * NOISE)


ANGLES = {
    "a flight": (read(0.1 * np.sin(1.3 * TIME)), False),
    "a quiet hover that flicker outweighs": (read(0.5 * COUNT * np.sin(0.7 * TIME), 0.5), False),
    "a clamped axis on a count": (read(0.0 * TIME), True),
    "a clamped axis between two counts": (read(0.0 * TIME + 0.5 * COUNT), True),
    "noise of many counts": (read(5.0 * COUNT * NOISE), True),
    "noise without counts": (0.01 * NOISE, True),
}


@pytest.mark.parametrize("angle", ANGLES)
def test_what_moves_is_told_from_flicker_and_noise(angle):
    values, is_still = ANGLES[angle]
    assert (still(values) is not None) == is_still
