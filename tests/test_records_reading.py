"""Logs of every accepted shape, read from files."""

import hashlib
import io
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from heli_identifier.errors import LogError
from heli_identifier.records import LogFormat, RigConfiguration, demo_logs, read_log
from heli_identifier.records.units import CONTRACT_HEADERS

HELD = demo_logs("rig-c")[1][0]
LINES = HELD.read_text().splitlines()[:1002]


@pytest.fixture(scope="module")
def truth():
    """Give the first 10 s of the demonstration log, parsed by NumPy instead."""
    return np.loadtxt(io.StringIO("\n".join(LINES)), delimiter=",", skiprows=1)


def written(folder, lines, name="log.csv", end="\n"):
    path = folder / name
    path.write_bytes(end.join([*lines, ""]).encode())
    return path


def rewritten(columns, headers):
    """Print columns, shape (6, N), under headers with every digit."""
    return [",".join(headers), *(",".join(map(repr, row)) for row in np.transpose(columns).tolist())]


def test_the_contract_is_read_without_a_word(tmp_path, truth):
    path = written(tmp_path, LINES)
    log = read_log(path)
    assert (log.name, log.path, log.rate_hz, log.samples, log.notes) == ("log", str(path), 100.0, 1001, ())
    assert log.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    # Older pandas parses a decimal to within one unit in the last place, newer exactly.
    assert np.allclose(log.voltages, truth[:, 1:3], rtol=3e-16, atol=0.0)
    assert np.allclose(log.angles, truth[:, 3:], rtol=3e-16, atol=0.0)
    assert np.array_equal(log.time, np.arange(1001) / 100.0)


@pytest.mark.parametrize("since", [0.0, 1.7e9], ids=["from zero", "of the day"])
def test_a_logger_of_700_hertz_that_prints_milliseconds_keeps_its_samples_and_says_so(tmp_path, since):
    time = np.arange(4200) / 700.0
    angles = 0.3 * np.sin(time), 0.2 * np.cos(time), 0.1 * time
    columns = np.round(since + time, 3), np.sign(np.sin(9.0 * time)), np.sign(np.cos(7.0 * time)), *angles
    log = read_log(written(tmp_path, rewritten(columns, CONTRACT_HEADERS)))
    assert (log.rate_hz, log.samples) == (700.0, 4200)
    assert np.array_equal(log.angles, np.transpose(angles))
    assert "time column printed to 1 ms; sampling interval taken as the mean, 1.4286 ms (700 Hz)" in log.notes


@settings(max_examples=20, deadline=None)
@given(order=st.permutations(range(6)), units=st.tuples(*[st.sampled_from(["rad", "deg"])] * 3))
def test_neither_column_order_nor_the_unit_of_an_angle_matters(tmp_path_factory, truth, order, units):
    columns, headers = truth.T.copy(), list(CONTRACT_HEADERS)
    for index, unit in enumerate(units, start=3):
        if unit == "deg":
            columns[index] = np.degrees(columns[index])
            headers[index] = headers[index].replace("rad", "deg")
    lines = rewritten(columns[list(order)], [headers[index] for index in order])
    log = read_log(written(tmp_path_factory.mktemp("log"), lines))
    # To degrees and back are two roundings of the value and two of pi/180, each of half a unit in the last place.
    assert np.allclose(log.angles, truth[:, 3:], rtol=1e-15, atol=0.0)
    assert np.allclose(log.voltages, truth[:, 1:3], rtol=3e-16, atol=0.0)
    assert len(log.notes) == units.count("deg")


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_line_ends_separators_and_blank_lines_at_the_end_do_not_matter(tmp_path, end, separator):
    lines = [line.replace(",", separator) for line in LINES]
    log = read_log(written(tmp_path, [*lines, "", ""], end=end))
    assert (log.samples, log.notes) == (1001, ())


def test_a_byte_order_mark_and_a_separator_at_the_end_of_each_line_do_not_matter(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(b"\xef\xbb\xbf" + "\n".join(f"{line}," for line in LINES).encode())
    assert read_log(path).samples == 1001


def test_a_decimal_comma_is_read_when_the_configuration_says_so(tmp_path, truth):
    lines = [LINES[0].replace(",", ";"), *(line.replace(",", ";").replace(".", ",") for line in LINES[1:])]
    log = read_log(written(tmp_path, lines), LogFormat(decimal=","))
    assert np.allclose(log.angles, truth[:, 3:], rtol=3e-16, atol=0.0)


def test_further_columns_are_kept_aside_and_texts_are_said_to_be_left_out(tmp_path):
    lines = [LINES[0] + ",current [A],remark", *(f"{line},{i}.5,fine" for i, line in enumerate(LINES[1:]))]
    log = read_log(written(tmp_path, lines))
    assert list(log.extra) == ["current [A]"]
    assert np.array_equal(log.extra["current [A]"], np.arange(1001) + 0.5)
    assert log.notes == ("left out 'remark': not one number per sample",)


def test_a_foreign_log_is_read_through_its_configuration(tmp_path, truth):
    t, front, rear, pitch, elevation, travel = truth.T
    counts = 2000 / (2.0 * np.pi)
    columns = [1e3 * t, 1e3 * rear, front, np.degrees(-pitch), np.round(elevation * counts), travel]
    lines = rewritten(columns, ["ms", "u1 [mV]", "u2", "theta (deg)", "eps [rad]", "travel [rad]"])
    log = read_log(
        written(tmp_path, lines),
        LogFormat(
            columns={
                "time": "ms",
                "v_front": "u1 [mV]",
                "v_rear": "u2",
                "pitch": "theta (deg)",
                "elevation": "eps [rad]",
            },
            units={"time": "ms", "v_rear": "V", "elevation": "counts"},
            signs={"pitch": -1},
            swap_rotors=True,
            encoder_counts=(4096, 2000, 8192),
        ),
    )
    assert np.allclose(log.voltages, truth[:, 1:3], rtol=1e-14)
    assert np.allclose(log.signal("pitch"), pitch, rtol=1e-14)
    assert np.abs(log.signal("elevation") - elevation).max() <= 0.5 / counts + 1e-12  # half a count, by rounding
    said = " | ".join(log.notes)
    for words in (
        "time converted from ms to s",
        "v_front converted from mV to V",
        "elevation converted from counts to rad",
        "sign of pitch flipped",
        "front and rear voltage swapped",
    ):
        assert words in said


def test_a_cut_keeps_the_stretch_counts_its_time_from_zero_and_says_so(tmp_path, truth):
    log = read_log(written(tmp_path, LINES), start=2.0, end=8.5)
    assert (log.samples, log.start) == (651, 2.0)
    assert log.time[0] == 0.0
    assert np.array_equal(log.angles, truth[200:851, 3:])
    assert log.notes == (
        "kept 2 s to 8.5 s of the file (651 of 1001 rows)",
        "time counts from 0, which the file calls 2 s",
    )


def test_the_cut_of_a_call_outranks_that_of_the_configuration(tmp_path):
    log = read_log(written(tmp_path, LINES), LogFormat(start=1.0, end=9.0), start=3.0)
    assert (log.start, log.samples) == (3.0, 601)


def test_what_is_cut_away_may_be_broken(tmp_path):
    lines = [*LINES[:5], "0.04,,x,nan,1,2", "0.02,0,0,9,0,0", *LINES[7:]]
    assert read_log(written(tmp_path, lines), start=1.0).samples == 901


def test_a_jittering_time_is_resampled_and_said_to_be(tmp_path):
    instants = np.arange(1001) / 100.0 + np.random.default_rng(2).uniform(0.0, 0.002, 1001)
    lines = rewritten(
        [instants, np.full(1001, 1.25), np.full(1001, 1.5), np.sin(instants), instants / 10.0, instants**2 / 100.0],
        CONTRACT_HEADERS,
    )
    log = read_log(written(tmp_path, lines))
    file_time = log.start + log.time
    assert log.rate_hz == 100.0
    assert any("uneven" in note and "resampled to 100 Hz" in note for note in log.notes)
    assert np.allclose(log.voltages, [1.25, 1.5], rtol=1e-12)
    # Interpolation is off by at most h^2/8 times the second derivative, with steps of up to 12 ms.
    assert np.abs(log.signal("pitch") - np.sin(file_time)).max() <= 0.012**2 / 8.0
    assert np.allclose(log.signal("elevation"), file_time / 10.0, rtol=1e-12)


def test_an_angle_folded_into_one_turn_is_unfolded(tmp_path, truth):
    columns = truth.T.copy()
    columns[5] = 0.02 * np.arange(1001)  # 20 rad in all
    folded = columns.copy()
    folded[5] = (columns[5] + np.pi) % (2.0 * np.pi) - np.pi
    log = read_log(written(tmp_path, rewritten(folded, CONTRACT_HEADERS)))
    assert np.allclose(log.signal("travel"), columns[5], atol=1e-12)
    assert log.notes == ("travel unwrapped at 3 jumps of whole turns",)


def test_odd_values_are_accepted_and_pointed_out(tmp_path, truth):
    columns = truth.T.copy()
    columns[1, :10] = 6.0
    columns[3] = 4.0 * np.sin(columns[0])
    columns[4] = 0.25
    log = read_log(written(tmp_path, rewritten(columns, CONTRACT_HEADERS)))
    assert log.notes[0].startswith("v_front exceeds +-5 V in 10 of 1001 samples (up to 6 V)")
    assert log.notes[1].startswith("pitch reaches 4 rad, more than half a turn: are these degrees?")
    assert log.notes[2].startswith("elevation never changes")
    assert read_log(tmp_path / "log.csv", LogFormat(voltage_limit=6.0)).notes == log.notes[1:]


IMPOSSIBLE = {
    "degrees called radians": (
        slice(3, 5),
        np.degrees,
        r"pitch reaches .*elevation reaches 1\d\.\d+ rad .*elevation = \"deg\" or \"counts\"",
    ),
    "turns in degrees called radians": (5, lambda v: 17.0 * np.arange(len(v)) / 100.0, "travel turns within .* 17 rad"),
    "millivolts called volts": (2, lambda volts: 1e3 * volts, r"v_rear reaches \d+ V .*v_rear = \"mV\""),
}


@pytest.mark.parametrize("case", IMPOSSIBLE)
def test_values_that_no_rig_reaches_are_refused_and_the_unit_is_asked_for(tmp_path, truth, case):
    column, mistaken, words = IMPOSSIBLE[case]
    columns = truth.T.copy()
    columns[column] = mistaken(columns[column])
    with pytest.raises(LogError, match=words):
        read_log(written(tmp_path, rewritten(columns, CONTRACT_HEADERS)))


def test_a_rig_s_configuration_may_stand_for_the_format_of_its_logs(tmp_path, truth):
    path = written(tmp_path, rewritten(truth.T, CONTRACT_HEADERS))
    rig = RigConfiguration(format=LogFormat(signs={"pitch": -1}))
    assert np.array_equal(read_log(path, rig).signal("pitch"), -read_log(path).signal("pitch"))


def test_all_units_that_are_missing_are_named_at_once(tmp_path, truth):
    lines = rewritten(truth.T, ["time [s]", "v_front", "v_rear", "pitch [grad]", "elevation [rad]", "travel [rad]"])
    with pytest.raises(LogError) as caught:
        read_log(written(tmp_path, lines))
    for part in ("'v_front': the unit is missing", "'v_rear': the unit is missing", "unit 'grad' is unknown"):
        assert part in str(caught.value)
    assert "set v_front, v_rear, pitch under [log.units]" in str(caught.value)


CUT = {
    "within its last number": ("10.00,1.1,1.2,0.1,0.2,0.12", 1000, "row 1002 is left out"),
    "behind a separator": ("10.00,1.1,1.2,0.1,0.2,", 1000, "row 1002 is left out"),
    "before its last column": ("10.00,1.1,1.2,0.1", 1000, "row 1002 is left out"),
    "nowhere": ("10.00,1.1,1.2,0.1,0.2,0.123456", 1001, None),
}


@pytest.mark.parametrize("case", CUT)
def test_a_last_line_that_was_cut_is_left_out_and_that_is_said(tmp_path, case):
    last, samples, said = CUT[case]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([*LINES[:1001], last]))
    log = read_log(path)
    assert log.samples == samples
    assert [note[: len(said)] for note in log.notes] == [said] if said else log.notes == ()


def test_a_last_number_that_may_have_been_cut_is_kept_and_that_is_said(tmp_path, truth):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(rewritten(truth.T, CONTRACT_HEADERS)))
    log = read_log(path)
    assert log.samples == 1001
    assert "cannot be known" in log.notes[0]


def as_matlab(truth, **change):
    names = ("time_s", "v_front_V", "v_rear_V", "pitch_rad", "elevation_rad", "travel_rad")
    return dict(zip(names, truth.T, strict=True)) | change


@pytest.mark.parametrize("wrap", [lambda variables: variables, lambda variables: {"run": variables}])
def test_a_matlab_file_reads_as_the_csv_does_at_top_level_or_in_a_struct(tmp_path, truth, wrap):
    variables = as_matlab(truth, Ts=0.01, name="a run", gains=np.eye(3))
    variables["pitch_deg"] = np.degrees(variables.pop("pitch_rad"))
    variables["travel_rad_"] = variables.pop("travel_rad")
    savemat(tmp_path / "log.mat", wrap(variables))
    log = read_log(tmp_path / "log.mat")
    assert np.allclose(log.angles, truth[:, 3:], rtol=1e-15, atol=0.0)
    assert np.array_equal(log.voltages, truth[:, 1:3])
    assert log.notes == ("pitch converted from deg to rad",)


def test_a_matlab_vector_of_another_length_is_left_out_unless_it_is_a_signal(tmp_path, truth):
    savemat(tmp_path / "log.mat", as_matlab(truth, gains=np.arange(4.0), counter=np.arange(1001)))
    log = read_log(tmp_path / "log.mat")
    assert list(log.extra) == ["counter"]
    assert log.notes == ("left out 'gains': not one number per sample",)


def test_importing_the_records_loads_neither_pandas_nor_scipy():
    code = "import sys, heli_identifier.records; print(sorted({'pandas', 'scipy'} & set(sys.modules)))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=300)
    assert result.stdout.strip() == "[]"
