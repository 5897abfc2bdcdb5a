"""Bad input gets one clear sentence that names the file, the place, the value and the way out."""

import numpy as np
import pytest
import scipy.io
from scipy.io import savemat

from heli_identifier.errors import LogError
from heli_identifier.records import LogFormat, demo_logs, read_log
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
    "a missing column": (
        with_header(HEADER.replace("pitch [rad]", "ptich [rad]")),
        r"column 'pitch \[rad\]' missing, found 'time \[s\]', .*did you mean 'ptich \[rad\]'\?",
    ),
    "several missing columns": (with_header("t,a,b,c,d,e"), r"columns 'time \[s\]', 'v_front \[V\]'.*found 't', 'a'"),
    "a signal in two columns": (
        with_header(HEADER + ",pitch [deg]", [row + ",1" for row in SHORT[1:]]),
        r"pitch stands in 2 columns \('pitch \[rad\]', 'pitch \[deg\]'\)",
    ),
    "an unknown unit": (
        with_header(HEADER.replace("pitch [rad]", "pitch [grad]")),
        r"column 'pitch \[grad\]': unit 'grad' is unknown, probably degrees, \"deg\"",
    ),
    "a missing unit": (
        with_header(HEADER.replace("v_front [V]", "v_front")),
        "column 'v_front': the unit is missing, V or mV",
    ),
    "a voltage in degrees": (
        with_header(HEADER.replace("v_front [V]", "v_front [deg]")),
        "unit 'deg' is unknown, V or mV",
    ),
    "no header": (SHORT[1:], "has no header: its first line holds numbers"),
    "an empty cell": (with_row("0.16,,1,0,0,0"), r"row 18, column 'v_front \[V\]': the cell is empty"),
    "a short row": (with_row("0.16,1,1"), r"row 18, column 'pitch \[rad\]': the cell is empty"),
    "a blank line": (with_row(""), r"row 18, column 'time \[s\]': the cell is empty"),
    "not a number": (with_row("0.16,1,1,NaN,0,0"), r"row 18, column 'pitch \[rad\]': the cell holds 'NaN'"),
    "infinity": (with_row("0.16,1,1,0,-inf,0"), r"row 18, column 'elevation \[rad\]': the cell holds '-inf'"),
    "a word": (with_row("0.16,1,on,0,0,0"), r"row 18, column 'v_rear \[V\]': the cell holds 'on'"),
    "a truth value": (with_row("0.16,1,True,0,0,0"), r"row 18, column 'v_rear \[V\]': the cell holds 'True'"),
    "a word where time stands": (with_row("later,1,1,0,0,0"), r"row 18, column 'time \[s\]': the cell holds 'later'"),
    "a cell too many": (with_row("0.16,1,1,0,0,0,0"), "row 18: 7 cells stand under 6 headers"),
    "cells too many": (with_row("0.16,1,1,0,0,0,0,0,0"), "row 18: 9 cells stand under 6 headers"),
    "a decimal comma": (
        [line.replace(",", ";").replace(".", ",") for line in SHORT],
        r"row 2, column 'time \[s\]': the cell holds '0,00'.*set decimal = ','",
    ),
    "time that stands still": (with_row("0.15,1,1,0,0,0"), "row 18: time stands still at 0.15 s"),
    "time that runs back": (with_row("0.05,1,1,0,0,0"), "row 18: time runs back from 0.15 s to 0.05 s"),
    "a hole": ([*SHORT[:400], *SHORT[410:]], "row 401: no samples for 0.11 s before 4.09 s, at most 5 steps"),
    "a leap": (with_row("0.16,1,1,4.2,0,0"), "row 18: pitch is 4.2 rad for one sample"),
    "a leap that lasts": (
        [*SHORT[:500], *(f"{row.rsplit(',', 3)[0]},4.2,0,0" for row in SHORT[500:])],
        "row 501: pitch jumps by 4.* rad from the row before",
    ),
    "a slow log": (with_time(np.arange(2000) / 40.0), "the rate of 40 Hz is below 50 Hz"),
    "a fast log": (with_time(np.arange(9000) / 2500.0), "the rate of 2500 Hz is above 2000 Hz"),
    "milliseconds called seconds": (with_time(np.arange(2000) * 10.0), "rate of 0.1 Hz is below 50 Hz.*unit of time"),
    "a short log": (SHORT[:400], "3.99 s of log are shorter than 5 s"),
    "one sample": (SHORT[:2], "1 sample"),
    "a header alone": (SHORT[:1], "holds a header but no rows"),
    "prose": (["It flew well today", "until it did not"], "is not a table: its first line is 'It flew well today'"),
    "nothing": ([], "is empty"),
    "blank lines alone": (["", "", ""], "is empty"),
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


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "is not a table: it holds binary data"),
        ("\n".join(SHORT).encode("utf-16")[:-1], "begins like UTF-16 text but is none"),
        (b"", "is empty"),
    ],
)
def test_bytes_that_are_no_table_are_refused(tmp_path, content, words):
    path = tmp_path / "log.csv"
    path.write_bytes(content)
    with pytest.raises(LogError, match=words):
        read_log(path)


def test_a_missing_file_and_a_folder_are_refused_by_name(tmp_path):
    with pytest.raises(LogError, match=r"none.csv does not exist"):
        read_log(tmp_path / "none.csv")
    with pytest.raises(LogError, match="is a folder"):
        read_log(tmp_path)


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


def test_a_cut_of_a_time_that_holds_no_numbers_still_names_the_cell(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("\n".join([HEADER, *(f"noon,{row.split(',', 1)[1]}" for row in SHORT[1:])]))
    with pytest.raises(LogError, match=r"row 2, column 'time \[s\]': the cell holds 'noon'"):
        read_log(path, start=2.0)


def test_a_mapped_column_that_is_not_there_is_named(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(SHORT))
    with pytest.raises(
        LogError, match=r"column 'theta' missing, found .*\[log.columns\] of heli.toml \(written by `heli init`\)"
    ):
        read_log(path, LogFormat(columns={"pitch": "theta"}))


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


@pytest.mark.parametrize(
    "content",
    [
        b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(600, b"\0"),
        b"time_s,v_front_V\n1,2\n",
        b"",
        bytes(500),
    ],
)
def test_bytes_that_are_no_matlab_file_are_refused(tmp_path, content):
    path = tmp_path / "log.mat"
    path.write_bytes(content)
    with pytest.raises(LogError, match="is not readable as a MATLAB file"):
        read_log(path)


def test_a_truncated_matlab_file_is_refused(tmp_path):
    path = tmp_path / "log.mat"
    savemat(path, matlab())
    for length in (20000, 200):
        path.write_bytes(path.read_bytes()[:length])
        with pytest.raises(LogError):
            read_log(path)


def test_a_matlab_vector_of_another_length_is_left_out_unless_it_is_a_signal(tmp_path):
    savemat(tmp_path / "log.mat", matlab(gains=np.arange(4.0), counter=np.arange(1001), name="a run", Ts=0.01))
    log = read_log(tmp_path / "log.mat")
    assert list(log.extra) == ["counter"]
    assert log.notes == ("left out 'gains': not one number per sample",)


def test_a_file_that_changes_while_it_is_read_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "log.mat"
    savemat(path, matlab())
    read = scipy.io.loadmat

    def growing(*arguments, **options):
        path.touch()
        return read(*arguments, **options)

    monkeypatch.setattr(scipy.io, "loadmat", growing)
    with pytest.raises(LogError, match="changed while it was read"):
        read_log(path)
