"""Reading logs: memory that a large one takes, and how often wrong columns and signs are noticed.

``python -m benchmarks large_logs [ROWS]`` takes every format, of a million rows if no other number is given.
``python -m benchmarks suspicion LOG...`` takes measured logs as they stand, and with each mistake put into them.
"""

import resource
from collections import Counter
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import asammdf
import nptdms
import numpy as np
import pandas
import typer
from scipy.io import savemat

from benchmarks.harness import apart, table
from heli_identifier.errors import LogError
from heli_identifier.records import Log, read_log, suspicions

NAMES = ("time [s]", "v_front [V]", "v_rear [V]", "pitch [rad]", "elevation [rad]", "travel [rad]")
FORMATS = ("csv", "csv.gz", "parquet", "mat", "tdms", "mf4")
RATE, SHORT = 500.0, 3000
"""Sampling rate [Hz], and rows of the log that shows what a process needs for anything but the log."""


def write_flight(path: str, rows: int) -> None:
    """Write a flight with the digits of an encoder, in the format of the name's ending."""
    t = np.arange(rows) / RATE
    volts = (1.5 + 0.5 * np.sign(np.sin(0.7 * t)), 1.4 + 0.4 * np.sin(0.9 * t))
    angles = (0.3 * np.sin(0.8 * t), 0.2 * np.sin(0.5 * t), 0.4 * np.sin(0.1 * t) + 1e-4 * t)
    columns = [t, *(np.round(v, 4) for v in volts), *(np.round(a / 0.001534) * 0.001534 for a in angles)]
    named = dict(zip(NAMES, columns, strict=True))
    parts = [name.rstrip("]").split(" [") for name in NAMES]
    match path.rpartition(".")[2]:
        case "parquet":
            pandas.DataFrame(named).to_parquet(path)
        case "mat":
            savemat(path, {"_".join(part): values for part, values in zip(parts, columns, strict=True)})
        case "tdms":
            with nptdms.TdmsWriter(path) as out:
                out.write_segment([nptdms.ChannelObject("run", *one) for one in named.items()])
        case "mf4":
            with asammdf.MDF(version="4.10") as out:
                signals = zip(columns[1:], parts[1:], strict=True)
                out.append([asammdf.Signal(values, t, name=name, unit=unit) for values, (name, unit) in signals])
                out.save(path)
        case _:
            pandas.DataFrame(named).to_csv(path, index=False)  # packed by the ending of its name


def peaks(path: str) -> tuple[int, float, float]:
    """Read a log; give its rows and the largest memory of this process and of the reader apart."""
    log = read_log(path)
    kib = [resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return log.samples, 1024.0 * kib[0], 1024.0 * kib[1]


def large_logs(rows: Annotated[int, typer.Argument()] = 1_000_000) -> None:
    """Print the peak while a log is read, less that of a log of 6 s, in multiples of the columns' 48 bytes a row."""
    lines = []
    for ending in FORMATS:
        with TemporaryDirectory() as folder:
            short, long = (f"{folder}/{count}.{ending}" for count in (SHORT, rows))
            for path, count in ((short, SHORT), (long, rows)):
                apart(write_flight, path, count)
            size = Path(long).stat().st_size
            (_, *before), (_, *after) = apart(peaks, short), apart(peaks, long)
        own, trial = ((b - a) / (48.0 * rows) for a, b in zip(before, after, strict=True))
        lines.append((ending, f"{size / 1e6:.0f}", f"{48e-6 * rows:.0f}", f"{own:.2f}", f"{trial:.2f}"))
    print(table(("format", "file [MB]", "arrays [MB]", "peak, in arrays", "of the reader apart"), lines))


def suspicion(logs: list[Path]) -> None:
    """Print the counts; a log whose pitch is suspected is counted with its pitch mirrored, if that clears it."""
    found: Counter[str] = Counter()
    mirrored, lowered = np.array([-1.0, 1.0, 1.0]), np.array([1.0, -1.0, 1.0])

    def is_wrong(log: Log) -> bool:
        return any("WRONG" in text for text in suspicions(log))

    for path in logs:
        try:
            log = read_log(path, start=6.0)
        except LogError as error:
            print(f"left out: {error}")
            continue
        found["logs"] += 1
        if is_wrong(log):
            log = replace(log, angles=log.angles * mirrored)
            found["suspected either way" if is_wrong(log) else "pitch of the other sign"] += 1
        found["too calm to show it"] += any("too calm" in text for text in suspicions(log))
        for mistake, changed in {
            "rotors exchanged": replace(log, voltages=log.voltages[:, ::-1]),
            "pitch mirrored": replace(log, angles=log.angles * mirrored),
            "elevation mirrored": replace(log, angles=log.angles * lowered),
            "voltages of another time": replace(log, voltages=np.roll(log.voltages, log.samples // 3, axis=0)),
        }.items():
            found[mistake] += bool(suspicions(changed))
    print(table(("what", "logs"), found.items()))
