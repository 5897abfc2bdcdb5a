"""Binary formats, as laboratories have them: every layout reads as the same record, packed or not.

A reader that crashes, hangs or asks for all memory does not take the command with it.
"""

import gzip
import os

import numpy as np
import pytest
from scipy.io import savemat

from heli_identifier.errors import LogError
from heli_identifier.records import LogFormat, demo_logs, opening, read_log
from heli_identifier.records.opening import apart

TRUE = read_log(demo_logs("rig-c")[1][0], end=20.0)
NAMES = ("time", "v_front", "v_rear", "pitch", "elevation", "travel")
UNITS = ("s", "V", "V", "rad", "rad", "rad")
HEADERS = [f"{name} [{unit}]" for name, unit in zip(NAMES, UNITS, strict=True)]
COLUMNS = np.column_stack((TRUE.time, TRUE.voltages, TRUE.angles)).T
FIELDS = dict(
    zip(("time_s", "v_front_V", "v_rear_V", "pitch_rad", "elevation_rad", "travel_rad"), COLUMNS, strict=True)
)


def same(log):
    """Whether a log is the true one, but for the rounding of a decimal number to degrees and back."""
    return (
        (log.samples, log.rate_hz) == (TRUE.samples, TRUE.rate_hz)
        and np.allclose(log.voltages, TRUE.voltages, rtol=1e-13, atol=1e-13)
        and np.allclose(log.angles, TRUE.angles, rtol=1e-13, atol=1e-13)
    )


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


@pytest.mark.parametrize("version", ["v7", "v7.3"])
def test_structs_and_tables_of_either_version_are_read(tmp_path, version):
    matio = pytest.importorskip("matio")
    pandas = pytest.importorskip("pandas")
    for name, variables in (("struct", {"run": FIELDS}), ("table", {"run": pandas.DataFrame(FIELDS)})):
        matio.save_to_mat(str(tmp_path / f"{name}.mat"), variables, version=version)
        assert same(read_log(tmp_path / f"{name}.mat"))
        (tmp_path / f"{name}.mat.gz").write_bytes(gzip.compress((tmp_path / f"{name}.mat").read_bytes()))
        assert same(read_log(tmp_path / f"{name}.mat.gz"))


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


def test_an_invalid_sample_of_an_mdf_file_is_no_number(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    bad = {"pitch": asammdf.signal.InvalidationArray(np.arange(len(COLUMNS[0])) == 5)}
    with asammdf.MDF() as file:
        columns = zip(NAMES[1:], UNITS[1:], COLUMNS[1:], strict=True)
        file.append([asammdf.Signal(v, COLUMNS[0], unit, n, invalidation_bits=bad.get(n)) for n, unit, v in columns])
        file.save(tmp_path / "log.mf4")
    with pytest.raises(LogError, match=r"row 6, column 'pitch \[rad\]': the cell holds 'nan'"):
        read_log(tmp_path / "log.mf4")


def test_a_reader_that_crashes_is_a_damaged_file():
    with pytest.raises(LogError, match="log.mat is not readable: it is damaged so that its reader crashes"):
        apart(os.abort, (), 1, "log.mat")


def test_a_reader_without_end_is_ended(monkeypatch):
    monkeypatch.setattr(opening, "PATIENCE", 5.0)
    with pytest.raises(LogError, match=r"its reader came to no end within 5 s"):
        apart(exec, ("while True: pass",), 1, "log.mat")


def test_a_reader_that_asks_for_all_memory_is_refused(monkeypatch):
    pytest.importorskip("resource")  # Windows bounds no memory
    monkeypatch.setattr(opening, "MEMORY", 10**9)
    with pytest.raises(LogError, match="log.mat is not readable: it asks for more than 1 GB of memory"):
        apart(bytes, (2 * 10**9,), 1, "log.mat")


def test_what_a_reader_gives_or_raises_arrives_and_what_it_prints_does_not(capfd):
    assert apart(divmod, (7, 2), 1, "log.mat") == (3, 1)
    assert apart(print, ("noise",), 1, "log.mat") is None
    with pytest.raises(ZeroDivisionError):
        apart(divmod, (1, 0), 1, "log.mat")
    assert capfd.readouterr() == ("", "")
