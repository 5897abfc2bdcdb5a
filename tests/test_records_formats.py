"""Logs as laboratories have them: every layout reads as the same record."""

import gzip

import numpy as np
import pytest
from scipy.io import savemat

from heli_identifier.errors import LogError
from heli_identifier.records import LogFormat, demo_logs, read_log

TRUE = read_log(demo_logs("rig-c")[1][0], end=20.0)
NAMES = ("time", "v_front", "v_rear", "pitch", "elevation", "travel")
UNITS = ("s", "V", "V", "rad", "rad", "rad")
HEADERS = [f"{name} [{unit}]" for name, unit in zip(NAMES, UNITS, strict=True)]
COLUMNS = np.column_stack((TRUE.time, TRUE.voltages, TRUE.angles)).T
FIELDS = dict(
    zip(("time_s", "v_front_V", "v_rear_V", "pitch_rad", "elevation_rad", "travel_rad"), COLUMNS, strict=True)
)


def rows(separator=",", values=COLUMNS):
    return [separator.join(map(repr, row)) for row in np.transpose(values).tolist()]


def same(log):
    """Whether a log is the true one, but for the rounding of a decimal number to degrees and back."""
    return (
        (log.samples, log.rate_hz) == (TRUE.samples, TRUE.rate_hz)
        and np.allclose(log.voltages, TRUE.voltages, rtol=1e-13, atol=1e-13)
        and np.allclose(log.angles, TRUE.angles, rtol=1e-13, atol=1e-13)
    )


TEXTS = {
    "comments above the header": ["# rig: north", "% 3 August", ",".join(HEADERS), *rows()],
    "a header in a comment": ["# " + ",".join(HEADERS), *rows()],
    "a row of units": [",".join(NAMES), ",".join(UNITS), *rows()],
    "a row of units in brackets": [",".join(NAMES), ",".join(f"[{unit}]" for unit in UNITS), *rows()],
    "Excel's separator": ["sep=;", ";".join(HEADERS), *rows(";")],
    "blanks between cells": ["  ".join(HEADERS), *rows("  ")],
    "tabs and names in capitals": ["\t".join(header.title() for header in HEADERS), *rows("\t")],
    "names with blanks": [",".join(header.replace("_", " ") for header in HEADERS), *rows()],
    "plain words for units": [
        "Time [sec],V_Front (Volt),V_Rear (volts),Pitch (radians),Elevation [Rad],Travel [RAD]",
        *rows(),
    ],
    "a LabVIEW measurement": [
        "LabVIEW Measurement\t",
        "Writer_Version\t2",
        "Separator\tTab",
        "***End_of_Header***\t",
        "Channels\t5",
        f"Samples{5 * chr(9)}2001",
        "Y_Unit_Label\tV\tV\trad\trad\trad",
        "X0\t0\t0\t0\t0\t0",
        "Delta_X\t0.01\t0.01\t0.01\t0.01\t0.01",
        "***End_of_Header***\t",
        "X_Value\tv_front\tv_rear\tpitch\televation\ttravel",
        *rows("\t"),
    ],
    "a dSPACE export": [
        "type,Recording",
        "date,2026-03-01",
        "path,Model Root",
        "",
        "," + ",".join(NAMES),
        "unit," + ",".join(UNITS),
        *("," + row for row in rows()),
    ],
}


@pytest.mark.parametrize("case", TEXTS)
def test_a_text_with_lines_above_its_table_reads_as_the_table(tmp_path, case):
    path = tmp_path / "log.csv"
    path.write_text("\n".join([*TEXTS[case], ""]))
    mapped = {"time": "X_Value"} if "LabVIEW" in case else {}
    assert same(read_log(path, LogFormat(columns=mapped)))


def test_a_file_without_headers_reads_by_the_numbers_of_its_columns(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("\n".join([*rows(), ""]))
    numbered = {name: f"column {index}" for index, name in enumerate(NAMES, start=1)}
    assert same(read_log(path, LogFormat(columns=numbered, units=dict(zip(NAMES, UNITS, strict=True)))))
    with pytest.raises(LogError, match="has no header.*'column 1' to 'column 6'"):
        read_log(path)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig", "cp1252"])
def test_the_degree_sign_is_read_in_every_encoding(tmp_path, encoding):
    values = COLUMNS.copy()
    values[3:] = np.degrees(values[3:])
    header = ",".join(header.replace("[rad]", "[°]") for header in HEADERS)
    path = tmp_path / "log.csv"
    path.write_bytes("\n".join([header, *rows(values=values), ""]).encode(encoding))
    assert same(read_log(path))


@pytest.mark.parametrize("stamp", ["2026-03-01T12:00:{:06.3f}", "2026-03-01 12:00:{:06.3f}+01:00", "12:00:{:06.3f}"])
def test_time_stamps_count_from_the_first(tmp_path, stamp):
    path = tmp_path / "log.csv"
    lines = [f"{stamp.format(t)},{row.split(',', 1)[1]}" for t, row in zip(TRUE.time, rows(), strict=True)]
    path.write_text("\n".join([",".join(["time", *HEADERS[1:]]), *lines, ""]))
    assert same(read_log(path))
    lines[70] = "noon," + lines[70].split(",", 1)[1]
    path.write_text("\n".join([",".join(["time", *HEADERS[1:]]), *lines, ""]))
    with pytest.raises(LogError, match="row 72, column 'time': the cell holds 'noon', which is no time stamp"):
        read_log(path)


def test_a_packed_log_reads_as_the_unpacked_one(tmp_path):
    path = tmp_path / "log.csv.gz"
    path.write_bytes(gzip.compress("\n".join([",".join(HEADERS), *rows(), ""]).encode()))
    assert same(read_log(path))


def test_sum_and_difference_of_the_voltages_are_taken_apart(tmp_path):
    front, rear = TRUE.voltages.T
    values = np.vstack((COLUMNS[:1], front + rear, rear - front, COLUMNS[3:]))
    path = tmp_path / "log.csv"
    path.write_text(
        "\n".join(["time [s],Vs [V],Vd [V],pitch [rad],elevation [rad],travel [rad]", *rows(values=values)])
    )
    form = LogFormat(columns={"v_sum": "Vs", "v_difference": "Vd"}, signs={"v_difference": -1})
    assert same(read_log(path, form))


def test_voltages_before_the_limit_of_the_amplifiers_are_limited_where_that_is_stated(tmp_path):
    values = COLUMNS.copy()
    values[1, 100:110] = 2050.0
    path = tmp_path / "log.csv"
    path.write_text("\n".join([",".join(HEADERS), *rows(values=values), ""]))
    with pytest.raises(LogError, match="v_front reaches 2050 V .* set clip = true"):
        read_log(path)
    log = read_log(path, LogFormat(clip=True))
    assert log.voltages[100:110, 0].tolist() == [5.0] * 10
    assert "v_front clipped to +-5 V in 10 samples" in log.notes


def structure_with_time():
    """Simulink's structure with time: one signal of two columns, and three of one."""
    signals = np.zeros(4, dtype=[("values", object), ("label", object), ("dimensions", object)])
    for index, (label, content) in enumerate((("volts", COLUMNS[1:3].T), *zip(NAMES[3:], COLUMNS[3:], strict=True))):
        signals[index] = (content, label, float(np.ndim(content)))
    return {"simout": {"time": COLUMNS[0], "signals": signals, "blockName": "rig/scope"}}


def dspace():
    """The structure that dSPACE writes: X with Data, and Y with Name and Data."""
    y = np.zeros(5, dtype=[("Name", object), ("Data", object)])
    for index in range(5):
        y[index] = (NAMES[index + 1], COLUMNS[index + 1])
    return {"run": {"X": {"Name": "time", "Data": COLUMNS[0]}, "Y": y}}


PLAIN_UNITS = dict(zip(NAMES, UNITS, strict=True))
MATLABS = {
    "a matrix of rows": ({"ans": COLUMNS}, {name: f"ans({i},:)" for i, name in enumerate(NAMES, 1)}),
    "a matrix of columns": ({"log": COLUMNS.T}, {name: f"log(:,{i})" for i, name in enumerate(NAMES, 1)}),
    "a matrix in a struct": ({"run": {"data": COLUMNS}}, {n: f"run.data({i},:)" for i, n in enumerate(NAMES, 1)}),
    "a structure with time": (structure_with_time(), {"v_front": "simout.volts(:,1)", "v_rear": "simout.volts(:,2)"}),
    "dSPACE's structure": (dspace(), {"time": "run.X"}),
}


@pytest.mark.parametrize("case", MATLABS)
def test_a_matlab_file_of_any_layout_reads_by_the_names_of_matlab(tmp_path, case):
    variables, columns = MATLABS[case]
    savemat(tmp_path / "log.mat", variables)
    assert same(read_log(tmp_path / "log.mat", LogFormat(columns=columns, units=PLAIN_UNITS)))


def test_two_structs_of_six_signals_are_refused_with_both_names(tmp_path):
    savemat(tmp_path / "log.mat", {"monday": FIELDS, "tuesday": FIELDS})
    with pytest.raises(LogError, match="'monday.time_s', 'tuesday.time_s'"):
        read_log(tmp_path / "log.mat")
    chosen = {name: f"tuesday.{field}" for name, field in zip(NAMES, FIELDS, strict=True)}
    assert same(read_log(tmp_path / "log.mat", LogFormat(columns=chosen)))


@pytest.mark.parametrize("version", ["v7", "v7.3"])
def test_structs_and_tables_of_either_version_are_read(tmp_path, version):
    matio = pytest.importorskip("matio")
    pandas = pytest.importorskip("pandas")
    for name, variables in (("struct", {"run": FIELDS}), ("table", {"run": pandas.DataFrame(FIELDS)})):
        matio.save_to_mat(str(tmp_path / f"{name}.mat"), variables, version=version)
        assert same(read_log(tmp_path / f"{name}.mat"))


def test_an_excel_sheet_with_lines_above_its_table_is_read(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["north lab"])
    book.active.append([])
    book.active.append(list(NAMES))
    book.active.append(list(UNITS))
    for row in COLUMNS.T.tolist():
        book.active.append(row)
    book.save(tmp_path / "log.xlsx")
    assert same(read_log(tmp_path / "log.xlsx"))


def test_a_parquet_file_is_read(tmp_path):
    arrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    parquet.write_table(arrow.table(dict(zip(HEADERS, COLUMNS, strict=True))), tmp_path / "log.parquet")
    assert same(read_log(tmp_path / "log.parquet"))


def test_a_tdms_file_is_read_with_its_units_and_the_time_of_its_waveforms(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    channels = [
        nptdms.ChannelObject(
            "run", name, values, properties={"unit_string": unit, "wf_increment": 0.01, "wf_start_offset": 0.0}
        )
        for name, unit, values in zip(NAMES[1:], UNITS[1:], COLUMNS[1:], strict=True)
    ]
    with nptdms.TdmsWriter(str(tmp_path / "log.tdms")) as file:
        file.write_segment(channels)
    assert same(read_log(tmp_path / "log.tdms"))


def test_an_mdf_file_is_read_with_its_units_and_its_master(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF() as file:
        file.append(
            [
                asammdf.Signal(samples=values, timestamps=COLUMNS[0], name=name, unit=unit)
                for name, unit, values in zip(NAMES[1:], UNITS[1:], COLUMNS[1:], strict=True)
            ]
        )
        file.save(tmp_path / "log.mf4")
    assert same(read_log(tmp_path / "log.mf4"))


def test_a_rate_beside_an_angle_is_no_second_column_of_it(tmp_path):
    path = tmp_path / "log.csv"
    extended = np.vstack((COLUMNS, np.gradient(COLUMNS[3], 0.01)))
    path.write_text("\n".join([",".join([*HEADERS, "pitch_rate"]), *rows(values=extended), ""]))
    log = read_log(path)
    assert same(log)
    assert list(log.extra) == ["pitch_rate"]
