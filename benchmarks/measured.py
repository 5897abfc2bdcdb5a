"""Measured logs of three rigs of one make, fetched from where their owners published them, as logs of the contract.

Public student work, Quanser 3-DOF helicopters at NTNU, 500 Hz, closed loop. The repositories carry no licence, so this
project holds citations only: ``measured_sources.csv`` names repository, commit, path and SHA-256 of every file.

A file holds one matrix, one signal a row, with the commanded difference V_d and sum V_s of the voltages. One rig has
the opposite sign of the pitch, and of V_d.
"""

import sys
from hashlib import sha256
from http.client import HTTPException
from pathlib import Path
from urllib.parse import quote
from urllib.request import urlopen

import pandas

from heli_identifier.files import write_atomically
from heli_identifier.records import Log, LogFormat, read_log, read_logs, write_log
from heli_plant.effects import AXES

SOURCES = Path(__file__).with_name("measured_sources.csv")


def matrix_format(matrix: str, difference: int, unit: str = "rad", sign: int = 1) -> LogFormat:
    """Return the format of a rig's files: the row of V_d (V_s is the next row), unit of the angles, sign of pitch."""
    numbers = {"time": 1, "travel": 2, "pitch": 4, "elevation": 6, "v_difference": difference, "v_sum": difference + 1}
    units = {"time": "s", "v_difference": "V", "v_sum": "V", **dict.fromkeys(AXES, unit)}
    columns = {name: f"{matrix}({row},:)" for name, row in numbers.items()}
    return LogFormat(columns=columns, units=units, signs={"pitch": sign}, swap_rotors=sign < 0, clip=True)


FORMATS = {
    "ntnu-05": matrix_format("SimData", 10),
    "ntnu-08a": matrix_format("state", 8, "deg"),
    "ntnu-01b": matrix_format("var", 8, sign=-1),
}


def download_logs(folder: Path) -> list[Path]:
    """Fetch missing files into ``folder``/raw, each the cited one, and return the folders of the rigs' logs."""
    rigs = {}
    for source in pandas.read_csv(SOURCES, dtype=str).to_dict("records"):
        raw, rig = folder / "raw" / f"{source['rig']}-{source['log']}.mat", folder / source["rig"]
        if not raw.is_file() or sha256(raw.read_bytes()).hexdigest() != source["sha256"]:
            path = f"{source['repository']}/{source['commit']}/{quote(source['path'])}"
            address = f"https://raw.githubusercontent.com/{path}"
            try:
                with urlopen(address, timeout=60.0) as answer:
                    content = answer.read(int(source["bytes"]) + 1)  # one byte more shows that it is too long
            except (OSError, HTTPException) as error:
                sys.exit(f"{address} cannot be fetched: {error}.")
            if sha256(content).hexdigest() != source["sha256"]:
                sys.exit(f"{address} is not the file that was cited; nothing of it was kept.")
            write_atomically(raw, content)
        rigs[rig] = write_log(read_log(raw, FORMATS[rig.name]), rig / f"{source['log']}.csv")
    return list(rigs)


def measured_rig(rig: str, start: float) -> tuple[str, list[Log]]:
    """Return the name of a folder and its logs from ``start`` [s] on; ``FOLDER:-pitch`` if its pitch counts down."""
    folder, _, mirrored = rig.partition(":")
    files = sorted(path for path in Path(folder).iterdir() if path.name.endswith((".csv", ".csv.gz", ".mat")))
    signs = LogFormat(signs={"pitch": -1} if mirrored else {})
    return Path(folder).name, list(read_logs(files, signs, start=start or None))
