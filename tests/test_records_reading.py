"""Text logs of every accepted shape read as the same record; what is wrong gets one sentence that says where. What a
laboratory meets most stands in tests/faults/logs.py, through the commands."""

import gzip
import hashlib
import io

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from heli_identifier.errors import LogError
from heli_identifier.records import LogFormat, RigConfiguration, demo_files, read_log
from heli_identifier.records.units import CONTRACT_HEADERS, SIGNALS

HELD = demo_files("rig-c")[1][0]
LINES = HELD.read_text().splitlines()[:1002]
# parsed by NumPy instead
TRUTH = np.loadtxt(io.StringIO("\n".join(LINES)), delimiter=",", skiprows=1)
UNITS = ("s", "V", "V", "rad", "rad", "rad")


def written(folder, lines, name="log.csv", end="\n", encoding="utf-8"):
    path = folder / name
    path.write_bytes(end.join([*lines, ""]).encode(encoding))
    return path


def rows(columns=TRUTH.T, separator=","):
    """Print columns with every digit."""
    return [separator.join(map(repr, row)) for row in np.transpose(columns).tolist()]


def rewritten(columns, headers=CONTRACT_HEADERS):
    return [",".join(headers), *rows(columns)]


def same(log, rtol=0.0):
    return np.allclose(np.column_stack((log.time, log.voltages, log.angles)), TRUTH, rtol=rtol, atol=rtol)


@settings(max_examples=30, deadline=None)
@given(
    order=st.permutations(range(6)),
    units=st.tuples(*[st.sampled_from(["rad", "deg"])] * 3),
    end=st.sampled_from(["\n", "\r\n", "\r"]),
    separator=st.sampled_from([",", ";", "\t", "  "]),
    behind=st.sampled_from([[], [""], ["", ""]]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]),
    place=st.sampled_from(["", ",Köln"]),
)
def test_order_units_of_angles_line_ends_separators_and_encodings_do_not_matter(
    tmp_path_factory, order, units, end, separator, behind, encoding, place
):
    columns, headers = TRUTH.T.copy(), list(CONTRACT_HEADERS)
    for index, unit in enumerate(units, start=3):
        if unit == "deg":
            columns[index] = np.degrees(columns[index])
            headers[index] = headers[index].replace("rad", "deg")
    lines = rewritten(columns[list(order)], [headers[index] for index in order])
    lines = [(line + (place if i else place and ",Ort")).replace(",", separator) for i, line in enumerate(lines)]
    log = read_log(written(tmp_path_factory.mktemp("log"), [*lines, *behind], end=end, encoding=encoding))
    # To degrees and back are two roundings of the value and two of pi/180, each of half a unit in the last place.
    assert same(log, rtol=1e-15) and (log.rate_hz, log.samples, log.configuration) == (100.0, 1001, None)
    assert len(log.notes) == units.count("deg")


TEXTS = {
    "no header": rows(),
    "comments above the header": ["# rig: north", "% 3 August", LINES[0], *rows()],
    "a header in a comment": ["# " + LINES[0], *rows()],
    "a row of units in brackets": [",".join(SIGNALS), ",".join(f"[{unit}]" for unit in UNITS), *rows()],
    "Excel's separator": ["sep=;", LINES[0].replace(",", ";"), *rows(separator=";")],
    "names in quotation marks between blanks": [
        " ".join(f'"{name}"' for name in CONTRACT_HEADERS), *rows(separator=" "),
    ],
    "a separator at the end of each line": [f"{line}," for line in LINES],
    "separators at the end of each row, but of the header": [LINES[0], *(f"{line},,," for line in LINES[1:])],
    "decimal commas beside words": [line.replace(",", ";").replace(".", ",") + ";Köln, West" for line in LINES],
    "plain words in capitals": [
        "Time [sec],V Front (Volt),V-Rear (volts),Pitch (radians),Elevation [Rad],Travel [RAD]", *rows(),
    ],
    "a LabVIEW measurement": [
        "LabVIEW Measurement\t", "Separator\tTab", "***End_of_Header***\t", "Channels\t5",
        "Y_Unit_Label\tV\tV\trad\trad\trad", "X0\t0\t0\t0\t0\t0", "***End_of_Header***\t",
        "X_Value\tv_front\tv_rear\tpitch\televation\ttravel", *rows(separator="\t"),
    ],
    "a dSPACE export": [
        "type,Recording", "path,Model Root", "", "," + ",".join(SIGNALS), "unit," + ",".join(UNITS),
        *("," + row for row in rows()),
    ],
}  # fmt: skip


FORMATS = {
    "a LabVIEW measurement": LogFormat(columns={"time": "X_Value"}),
    "no header": LogFormat(
        columns={name: f"column {index}" for index, name in enumerate(SIGNALS, start=1)},
        units=dict(zip(SIGNALS, UNITS, strict=True)),
    ),
}


@pytest.mark.parametrize("case", TEXTS)
def test_a_text_with_lines_above_its_table_reads_as_the_table(tmp_path, case):
    assert same(read_log(written(tmp_path, TEXTS[case]), FORMATS.get(case, LogFormat())))


@pytest.mark.parametrize("stamp", ["2026-03-01T12:00:{:06.3f}", "2026-03-01 12:00:{:06.3f}+01:00", "12:00:{:06.3f}"])
def test_time_stamps_count_from_the_first(tmp_path, stamp):
    header = ",".join(["time", *CONTRACT_HEADERS[1:]])
    lines = [f"{stamp.format(t)},{row.split(',', 1)[1]}" for t, row in zip(TRUTH[:, 0], rows(), strict=True)]
    assert same(read_log(written(tmp_path, [header, *lines])), rtol=1e-12)
    lines[70] = "noon," + lines[70].split(",", 1)[1]
    with pytest.raises(LogError, match=r"row 72, column 'time \[s\]': the cell is empty or NaN or no time stamp"):
        read_log(written(tmp_path, [header, *lines]))


def test_a_packed_log_of_several_members_reads_as_the_unpacked_one(tmp_path):
    data = "\n".join([*LINES, ""]).encode()
    members = gzip.compress(data[:1000]) + gzip.compress(data[1000:])  # as `cat a.gz b.gz` makes them
    (tmp_path / "log.csv.gz").write_bytes(members)
    log = read_log(tmp_path / "log.csv.gz")
    assert same(log) and log.sha256 == hashlib.sha256(members).hexdigest()


def test_a_foreign_log_is_read_through_its_configuration(tmp_path):
    t, front, rear, pitch, elevation, travel = TRUTH.T
    counts = 2000 / (2.0 * np.pi)
    columns = [1e3 * t, 1e3 * rear, front, np.degrees(-pitch), np.round(elevation * counts), travel]
    lines = rewritten(columns, ["ms", "u1 [mV]", "u2", "theta (deg)", "eps [rad]", "travel [rad]"])
    named = {"time": "ms", "v_front": "u1 [mV]", "v_rear": "u2", "pitch": "theta (deg)", "elevation": "eps [rad]"}
    units, encoders = {"time": "ms", "v_rear": "V", "elevation": "counts"}, (4096, 2000, 8192)
    form = LogFormat(named, units, {"pitch": -1}, swap_rotors=True, encoder_counts=encoders)
    rig = RigConfiguration(format=form)
    log = read_log(written(tmp_path, [line.replace(",", ";").replace(".", ",") for line in lines]), rig)
    assert log.configuration == rig
    assert np.allclose(log.voltages, TRUTH[:, 1:3], rtol=1e-14)
    assert np.allclose(log.angles[:, 0], pitch, rtol=1e-14)
    assert np.abs(log.angles[:, 1] - elevation).max() <= 0.5 / counts + 1e-12  # half a count, by rounding
    changes = "time converted from ms to s; v_front converted from mV to V; pitch converted from deg to rad"
    more = "elevation converted from counts to rad; sign of pitch flipped; front and rear voltage swapped"
    assert "; ".join(log.notes) == f"{changes}; {more}"


def test_voltages_before_the_limit_of_the_amplifiers_are_limited_where_that_is_stated(tmp_path):
    columns = TRUTH.T.copy()
    columns[1, 100:110] = 2050.0
    path = written(tmp_path, rewritten(columns))
    log = read_log(path, LogFormat(clip=True))
    assert log.voltages[100:110, 0].tolist() == [5.0] * 10
    assert "v_front clipped to ±5 V in 10 samples" in log.notes


def test_a_cut_keeps_the_stretch_outranks_the_configuration_and_lets_the_rest_be_broken(tmp_path):
    lines = [*LINES[:5], "0.04,,x,nan,1,2", "0.02,0,0,9,0,0", *LINES[7:]]
    log = read_log(written(tmp_path, lines), LogFormat(start=1.0, end=9.0), start=2.0, end=8.5)
    assert (log.start, log.samples) == (2.0, 651)
    assert np.array_equal(log.angles, TRUTH[200:851, 3:])
    kept = "kept 2 s to 8.5 s of the file (651 of 1001 rows)"
    assert log.notes == (kept, "time counts from 0, which the file calls 2 s")


def test_a_jittering_time_is_resampled_and_said_to_be(tmp_path):
    instants = np.arange(1001) / 100.0 + np.random.default_rng(2).uniform(0.0, 0.002, 1001)
    level = np.ones(1001)
    columns = [instants, 1.25 * level, 1.5 * level, np.sin(instants), instants / 10.0, instants**2 / 100.0]
    log = read_log(written(tmp_path, rewritten(columns)))
    assert any("uneven" in note and "resampled to 100 Hz" in note for note in log.notes)
    assert np.allclose(log.voltages, [1.25, 1.5], rtol=1e-12)
    # Interpolation is off by at most h^2/8 times the second derivative, with steps of up to 12 ms.
    assert np.abs(log.angles[:, 0] - np.sin(log.start + log.time)).max() <= 0.012**2 / 8.0


def test_odd_values_are_accepted_and_pointed_out(tmp_path):
    columns = TRUTH.T.copy()
    columns[1, :10] = 6.0
    columns[4] = 0.25
    turned = 0.02 * np.arange(1001)  # 20 rad in all, folded into one turn
    columns[5] = (turned + np.pi) % (2.0 * np.pi) - np.pi
    asked = (turned - 0.1 + np.pi) % (2.0 * np.pi) + np.pi  # begins on the other side of the seam
    log = read_log(written(tmp_path, rewritten([*columns, asked], [*CONTRACT_HEADERS, "travel_reference"])))
    assert np.allclose(log.angles[:, 2], turned, atol=1e-12)
    assert np.allclose(log.references["travel"], turned - 0.1, atol=1e-12)
    assert log.notes[:2] == ("travel unwrapped at 3 jumps of whole turns", "travel_reference taken from the same turns")
    assert log.notes[2].startswith("v_front exceeds ±5 V in 10 of 1001 samples (up to 6 V)")
    assert log.notes[3].startswith("elevation never changes")
    assert read_log(tmp_path / "log.csv", LogFormat(voltage_limit=6.0)).notes == (*log.notes[:2], *log.notes[3:])


def test_a_last_line_without_a_line_break_may_be_cut_and_is_left_out(tmp_path):
    (tmp_path / "log.csv").write_text("\n".join([*LINES[:1001], "10.00,1.1,1.2,0.1,0.2,0.12"]))
    log = read_log(tmp_path / "log.csv")
    assert log.samples == 1000
    assert log.notes == ("row 1002 is left out: the file ends within it, after '10.00,1.1,1.2,0.1,0.2,0.12'",)
    (tmp_path / "log.csv").write_bytes("\n".join([*LINES, "10.01"]).encode("utf-16")[:-1])  # within a character
    assert same(read_log(tmp_path / "log.csv"))


def test_references_are_found_by_name_or_configuration_in_radians_and_are_cut_with_their_log(tmp_path):
    headers, asked = [*CONTRACT_HEADERS, "Elevation Reference [deg]", "wanted [rad]"], np.arange(1001) * 0.01
    path = written(tmp_path, rewritten([*TRUTH.T, asked, asked], headers))
    log = read_log(path, LogFormat(signs={"elevation": -1}, references={"travel": "wanted"}), start=0.5)
    np.testing.assert_allclose(log.references["elevation"], -np.radians(asked[50:]), rtol=1e-12)
    np.testing.assert_allclose(log.references["travel"], asked[50:], rtol=1e-12)
    assert len(log.references) == 2


def test_the_name_of_a_file_cannot_command_a_terminal(tmp_path):
    path = written(tmp_path, LINES, name="a\x1b[2J.csv")
    assert read_log(path).name == "a?[2J"
    path.write_bytes(b"")
    with pytest.raises(LogError, match="is empty") as caught:
        read_log(path)
    assert str(caught.value).isprintable()
