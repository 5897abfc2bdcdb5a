"""Memory that reading a large log takes: ``python -m benchmarks.large_logs [ROWS]``, ten million by default.

Every format is written and read in processes of their own. The peak is the largest resident memory while the log is
read, less that of a log of 6 s in the same format, in multiples of the six columns' own size, 48 bytes a row. MATLAB,
TDMS and MF4 files are tried first by a process that shares nothing with the reader; its peak stands beside.
"""

import json
import resource
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.tables import table

NAMES = ("time [s]", "v_front [V]", "v_rear [V]", "pitch [rad]", "elevation [rad]", "travel [rad]")
FIELDS = ("time_s", "v_front_V", "v_rear_V", "pitch_rad", "elevation_rad", "travel_rad")
RATE = 500.0
SHORT = 3000
"""Rows of the log that shows what a process needs for anything but the log."""
_BLOCK = 500_000
FORMATS = ("csv", "csv.gz", "parquet", "mat", "mat of version 7.3", "tdms", "mf4")


def columns(begin: int, end: int) -> list[NDArray[np.float64]]:
    """Give rows of a flight with the digits of an encoder."""
    t = np.arange(begin, end) / RATE
    volts = (1.5 + 0.5 * np.sign(np.sin(0.7 * t)), 1.4 + 0.4 * np.sin(0.9 * t))
    angles = (0.3 * np.sin(0.8 * t), 0.2 * np.sin(0.5 * t), 0.4 * np.sin(0.1 * t) + 1e-4 * t)
    return [t, *(np.round(v, 4) for v in volts), *(np.round(a / 0.001534) * 0.001534 for a in angles)]


def blocks(rows: int) -> Iterator[list[NDArray[np.float64]]]:
    return (columns(begin, min(begin + _BLOCK, rows)) for begin in range(0, rows, _BLOCK))


def write(kind: str, path: Path, rows: int) -> None:
    if kind.startswith("csv"):
        import pyarrow
        import pyarrow.csv

        with pyarrow.output_stream(path) as out:  # packed by the ending of its name
            for number, block in enumerate(blocks(rows)):
                lines = pyarrow.table(block, names=list(NAMES))
                options = pyarrow.csv.WriteOptions(include_header=number == 0, quoting_style="none")
                pyarrow.csv.write_csv(lines, out, options)
    elif kind == "parquet":
        import pyarrow
        import pyarrow.parquet

        schema = pyarrow.schema([(name, pyarrow.float64()) for name in NAMES])
        with pyarrow.parquet.ParquetWriter(path, schema) as out:
            for block in blocks(rows):
                out.write_table(pyarrow.table(block, names=list(NAMES)))
    elif kind == "mat":
        from scipy.io import savemat

        savemat(path, dict(zip(FIELDS, columns(0, rows), strict=True)))
    elif kind == "mat of version 7.3":
        import h5py

        with h5py.File(path, "w", userblock_size=512) as out:
            for name, values in zip(FIELDS, columns(0, rows), strict=True):
                out.create_dataset(name, data=values[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
        with path.open("r+b") as head:
            head.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM")
    elif kind == "tdms":
        import nptdms

        with nptdms.TdmsWriter(path) as out:
            for block in blocks(rows):
                named = zip(NAMES, block, strict=True)
                out.write_segment([nptdms.ChannelObject("run", name, values) for name, values in named])
    else:
        import asammdf

        with asammdf.MDF(version="4.10") as out:
            time, *others = columns(0, rows)
            parts = [name.rstrip("]").split(" [") for name in NAMES[1:]]
            named = zip(others, parts, strict=True)
            out.append([asammdf.Signal(values, time, name=name, unit=unit) for values, (name, unit) in named])
            out.save(path)


def read(path: str) -> dict[str, Any]:
    """Read a log in this process; give its rows and the memory [bytes]."""
    from heli_identifier.records import read_log

    log = read_log(path)
    kib = [resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return {"rows": log.samples, "peak": 1024 * kib[0], "trial": 1024 * kib[1]}


def measured(kind: str, rows: int) -> tuple[str, ...]:
    """Write and read a short and a long log."""
    found = []
    with TemporaryDirectory() as folder:
        for count in (SHORT, rows):
            path = Path(folder) / f"{count}.{kind.partition(' ')[0]}"
            for words in (("write", kind, str(path), str(count)), ("read", str(path))):
                command = [sys.executable, "-m", "benchmarks.large_logs", *words]
                done = subprocess.run(command, check=True, capture_output=True, text=True)
            found.append(json.loads(done.stdout))
            size = path.stat().st_size
    short, long = found
    assert long["rows"] == rows
    own, trial = ((long[key] - short[key]) / (48.0 * rows) for key in ("peak", "trial"))
    sizes = (f"{size / 1e6:.0f}", f"{48e-6 * rows:.0f}", f"{own:.2f}")
    return kind, *sizes, f"{trial:.2f}" if trial > 0.01 else ""


def main(words: list[str]) -> None:
    match words:
        case ["write", kind, path, rows]:
            write(kind, Path(path), int(rows))
        case ["read", path]:
            print(json.dumps(read(path)))
        case _:
            head = ("format", "file [MB]", "arrays [MB]", "peak, in arrays", "peak of the trial, in arrays")
            print(table(head, [measured(kind, int(words[0]) if words else 10_000_000) for kind in FORMATS]))


if __name__ == "__main__":
    main(sys.argv[1:])
