"""Measured logs of three rigs of one make, fetched from where their owners published them, as logs of the contract.

Public student work, Quanser 3-DOF helicopters at NTNU, 500 Hz, closed loop. The repositories carry no licence, so this
project holds citations only: ``measured_sources.csv`` names repository, commit, path and SHA-256 of every file.

A file holds one matrix, one signal a row: time [s], travel, travel rate, pitch, pitch rate, elevation, elevation rate,
and further down the commanded difference V_d and sum V_s of the voltages. From these V_front = (V_s + V_d) / 2 and
V_rear = (V_s - V_d) / 2, clipped to the converter's +-5 V. One rig has the opposite sign of the pitch, and of V_d.
"""

import csv
from hashlib import sha256
from http.client import HTTPException
from pathlib import Path
from urllib.parse import quote
from urllib.request import urlopen

import numpy as np
from scipy.io import loadmat

from heli_identifier.files import write_atomically
from heli_identifier.records import Log, write_log

SOURCES = Path(__file__).with_name("measured_sources.csv")
PUBLIC = "https://raw.githubusercontent.com/{repository}/{commit}/{path}"
RATE = 500.0
"""Sampling rate of all files [Hz]."""

CONVERTER_LIMIT = 5.0
"""Voltage at which the converter clips the commands that the files hold [V]."""


class DownloadError(Exception):
    """A file cannot be fetched, or is not the one that was cited."""


LAYOUTS = {
    "ntnu-05": (9, 10, 1.0, 1),
    "ntnu-08a": (7, 8, np.pi / 180.0, 1),
    "ntnu-01b": (7, 8, 1.0, -1),
}
"""Rows of V_d and V_s, unit of the angles [rad], sign of pitch and V_d."""

TRAVEL, PITCH, ELEVATION = 1, 3, 5


def download(folder: Path) -> list[Path]:
    """Fetch every file that is not there yet into ``folder``/raw, and give the folders of the rigs' logs.

    Raises DownloadError if a file cannot be fetched or is not the one that was cited; what was fetched before stays and
    is not fetched again.
    """
    rigs = {}
    with SOURCES.open(encoding="utf-8", newline="") as file:
        for source in csv.DictReader(file):
            raw, rig = folder / "raw" / f"{source['rig']}-{source['log']}.mat", folder / source["rig"]
            if not raw.is_file() or sha256(raw.read_bytes()).hexdigest() != source["sha256"]:
                write_atomically(raw, fetched(source))
            rigs[rig] = write_log(converted(raw, source), rig / f"{source['log']}.csv")
    return list(rigs)


def fetched(source: dict[str, str]) -> bytes:
    """Give the content of one published file, if it is the one that was cited; DownloadError otherwise."""
    address = PUBLIC.format(**{**source, "path": quote(source["path"])})
    try:
        with urlopen(address, timeout=60.0) as answer:
            content: bytes = answer.read(int(source["bytes"]) + 1)  # no more than shows that it is too long
    except (OSError, HTTPException) as error:
        raise DownloadError(f"{address} cannot be fetched: {error}.") from error
    if sha256(content).hexdigest() != source["sha256"]:
        raise DownloadError(f"{address} is not the file that was cited; nothing of it was kept.")
    return content


def converted(raw: Path, source: dict[str, str]) -> Log:
    """Give a published file as a log with the contract's signals and signs."""
    difference, sum_, unit, sign = LAYOUTS[source["rig"]]
    (rows,) = [value for name, value in loadmat(raw).items() if not name.startswith("__")]
    V_d, V_s = sign * rows[difference], rows[sum_]
    voltages = np.clip(np.column_stack((V_s + V_d, V_s - V_d)) / 2.0, -CONVERTER_LIMIT, CONVERTER_LIMIT)
    angles = unit * np.column_stack((sign * rows[PITCH], rows[ELEVATION], rows[TRAVEL]))
    return Log(source["log"], RATE, voltages, angles)
