"""Binary formats, as laboratories have them: every layout reads as the same record, packed or not. A reader that
crashes, hangs or asks for all memory does not take the command with it."""

import gzip
import os
import subprocess
import sys

import numpy as np
import pytest
from scipy.io import savemat

from heli_identifier.errors import LogError
from heli_identifier.processes import call_apart
from heli_identifier.records import LogFormat, binary, demo_files, read_log
from heli_identifier.records.text import read_text
from tests.faults.material import as_struct, columns

TRUE = read_log(demo_files("rig-c")[1][0], end=19.99)
NAMES = ("time", "v_front", "v_rear", "pitch", "elevation", "travel")
UNITS = ("s", "V", "V", "rad", "rad", "rad")
VOLTS = ((1, "v_front"), (2, "v_rear"))
HEADERS = [f"{name} [{unit}]" for name, unit in zip(NAMES, UNITS, strict=True)]
COLUMNS, FIELDS = columns(), as_struct()


def same(log):
    """Whether a log is the true one, but for the rounding of a decimal number to degrees and back."""
    pairs = ((log.voltages, TRUE.voltages), (log.angles, TRUE.angles))
    evenly = (log.samples, log.rate_hz) == (TRUE.samples, TRUE.rate_hz)
    return evenly and all(np.allclose(*pair, rtol=1e-13, atol=1e-13) for pair in pairs)


def structs(**fields):
    """An array of structs, of the values of each field."""
    return np.array([*zip(*fields.values(), strict=True)], dtype=[(name, object) for name in fields])


# Simulink's structure with time: one signal of two columns, and three of one
SCOPE = {"time": COLUMNS[0], "signals": structs(values=[COLUMNS[1:3].T, *COLUMNS[3:]], label=["volts", *NAMES[3:]])}
DSPACE = {"X": {"Name": "time", "Data": COLUMNS[0]}, "Y": structs(Name=NAMES[1:], Data=[*COLUMNS[1:]])}
MATLABS = {
    "a matrix of rows": ({"ans": COLUMNS}, {name: f"ans({i},:)" for i, name in enumerate(NAMES, 1)}),
    "columns in a struct": ({"run": {"log": COLUMNS.T}}, {name: f"run.log(:,{i})" for i, name in enumerate(NAMES, 1)}),
    "a structure with time": ({"simout": SCOPE}, {v: f"simout.signals(1).volts(:,{i})" for i, v in VOLTS}),
    "dSPACE's structure": ({"run": DSPACE}, {}),
}


@pytest.mark.parametrize("case", MATLABS)
def test_a_matlab_file_of_any_layout_reads_by_the_names_of_matlab(tmp_path, case):
    variables, columns = MATLABS[case]
    savemat(tmp_path / "log.mat", variables)
    assert same(read_log(tmp_path / "log.mat", LogFormat(columns=columns, units=dict(zip(NAMES, UNITS, strict=True)))))


@pytest.mark.parametrize("version", ["v7", "v7.3"])
def test_structs_and_tables_of_either_version_are_read(tmp_path, version):
    matio = pytest.importorskip("matio")
    pandas = pytest.importorskip("pandas")
    for name, variables in (("struct", {"run": FIELDS}), ("table", {"run": pandas.DataFrame(FIELDS)})):
        matio.save_to_mat(str(tmp_path / f"{name}.mat"), variables, version=version)
        assert same(read_log(tmp_path / f"{name}.mat"))
        (tmp_path / f"{name}.mat.gz").write_bytes(gzip.compress((tmp_path / f"{name}.mat").read_bytes()))
        assert same(read_log(tmp_path / f"{name}.mat.gz"))


def excel(path):
    """Write a sheet with lines above its table and a row of units below the names, behind a sheet of notes."""
    book = pytest.importorskip("openpyxl").Workbook()
    for row in (["north lab"], [], list(NAMES), list(UNITS), *COLUMNS.T.tolist()):
        book.active.append(row)
    book.create_sheet("notes", 0)["B9"] = "flown by hand"
    book.save(path)


def parquet(path):
    arrow = pytest.importorskip("pyarrow")
    pytest.importorskip("pyarrow.parquet").write_table(arrow.table(dict(zip(HEADERS, COLUMNS, strict=True))), path)


def tdms(path):
    """Write waveforms, whose increment is the time."""
    nptdms = pytest.importorskip("nptdms")
    timed = {"wf_increment": 0.01, "wf_start_offset": 0.0}
    channels = zip(NAMES[1:], UNITS[1:], COLUMNS[1:], strict=True)
    with nptdms.TdmsWriter(str(path)) as file:
        file.write_segment([nptdms.ChannelObject("run", n, v, {"unit_string": u, **timed}) for n, u, v in channels])


def mdf(path, invalid=()):
    """Write channels with a master; some samples of the pitch are invalid."""
    asammdf = pytest.importorskip("asammdf")
    bad = asammdf.signal.InvalidationArray(np.isin(np.arange(len(COLUMNS[0])), invalid)) if invalid else None
    channels = zip(NAMES[1:], UNITS[1:], COLUMNS[1:], strict=True)
    with asammdf.MDF() as file:
        file.append([
            asammdf.Signal(v, COLUMNS[0], unit, name, invalidation_bits=bad if name == "pitch" else None)
            for name, unit, v in channels
        ])  # fmt: skip
        file.save(path)


@pytest.mark.parametrize(("write", "ending"), [(excel, "xlsx"), (parquet, "parquet"), (tdms, "tdms"), (mdf, "mf4")])
def test_a_file_of_another_program_is_read_with_its_units_and_its_time(tmp_path, write, ending):
    write(tmp_path / f"log.{ending}")
    assert same(read_log(tmp_path / f"log.{ending}"))
    if write is mdf:  # which marks samples that are invalid
        mdf(tmp_path / "bad.mf4", invalid=(5,))
        with pytest.raises(LogError, match=r"row 6, column 'pitch \[rad\]': the cell is empty or NaN"):
            read_log(tmp_path / "bad.mf4")


def test_what_is_no_signal_may_have_another_length(tmp_path):
    savemat(tmp_path / "log.mat", {**FIELDS, "gains": np.arange(4.0), "counter": np.arange(2000), "name": "a run"})
    assert same(read_log(tmp_path / "log.mat"))


@pytest.mark.parametrize(
    "read, argument, how",
    [
        (os.abort, (), "ended"),
        (exec, ("while True: pass",), "gave no answer within 5 s and was ended"),
        (bytes, (2 * 10**9,), "ended with code 1 and no result: MemoryError"),
    ],
)
def test_a_reader_that_crashes_hangs_or_asks_for_all_memory_is_a_damaged_file(monkeypatch, read, argument, how):
    if read is bytes:
        pytest.importorskip("resource")  # Windows bounds no memory
    monkeypatch.setattr(binary, "PATIENCE", 5.0)
    monkeypatch.setattr(binary, "MEMORY", 10**9)
    monkeypatch.setattr(
        binary, "call_apart", lambda folder, *_, **options: call_apart(folder, read, *argument, **options)
    )
    with pytest.raises(LogError, match=f"log.mat is not readable: its reader .*{how}.*; save it again"):
        binary.read_binary(b"", ".mat", "log.mat")


def test_what_a_separate_process_gives_or_raises_arrives_and_what_it_prints_does_not(tmp_path, capfd):
    options = {"error": LogError, "patience": 60.0}
    assert call_apart(tmp_path, divmod, 7, 2, **options) == (3, 1)
    assert call_apart(tmp_path, print, "noise", **options) is None
    with pytest.raises(LogError, match="log.csv is empty"):
        call_apart(tmp_path, read_text, b"", "log.csv", **options)
    assert capfd.readouterr() == ("", "")


def test_a_file_beside_the_script_of_a_user_does_not_replace_a_module_of_the_reader(tmp_path):
    (tmp_path / "nt.py").write_text("import sys\nif sys.argv[0] == '-c':\n    sys.exit(3)\n")  # posix has no nt
    parquet(tmp_path / "log.parquet")
    (tmp_path / "script.py").write_text("from heli_identifier import read_log\nread_log('log.parquet')\n")
    assert subprocess.run([sys.executable, "script.py"], cwd=tmp_path).returncode == 0
