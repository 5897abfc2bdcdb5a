"""Good files, of which the faults are made by one change each."""

import io
import json
import os
from pathlib import Path

import numpy as np
import pytest

from fmu_src import build
from heli_identifier.records import demo_files
from heli_identifier.results.parameters import plant_values
from heli_plant.parameters import TABLE_2

_LINES = demo_files("rig-c")[1][0].read_text().splitlines()[:2001]
HEADER, ROWS = _LINES[0], _LINES[1:]


def columns():
    """Give 20 s of a good log, shape (6, 2000)."""
    return np.loadtxt(io.StringIO("\n".join(ROWS)), delimiter=",").T


def write(content, name="log.csv"):
    """Give a function that writes a file."""
    data = content.encode() if isinstance(content, str) else content
    return lambda folder: (folder / name).write_bytes(data)


def good(folder: Path):
    """Write a good log."""
    (folder / "log.csv").write_text("\n".join([HEADER, *ROWS, ""]))


def nothing(folder):
    """Make no file."""


def pipe(path: Path):
    """Make a named pipe, where there are any."""
    if not hasattr(os, "mkfifo"):
        pytest.skip("this system has no named pipes")
    os.mkfifo(path)


def configured(toml, make=good):
    """Give a function that writes a heli.toml beside a log."""

    def both(folder):
        make(folder)
        (folder / "heli.toml").write_text(toml)

    return both


def as_struct():
    """Give the six signals as a struct."""
    names = ("time_s", "v_front_V", "v_rear_V", "pitch_rad", "elevation_rad", "travel_rad")
    return dict(zip(names, columns(), strict=True))


def document(change=lambda d: None):
    """Give a parameters.json of a plant, changed."""
    values = {
        name: {"value": e.value, "standard_error": None, "unit": e.unit}
        for name, e in plant_values(TABLE_2, {}).items()
    }
    figures = {"prediction_1s_rad": {"value": 1e-2, "low": 9e-3, "high": 2e-2}, "noise_floor_rad": 1e-3}
    expected = {axis: dict(figures) for axis in ("pitch", "elevation", "travel")}
    found = {"schema": "heli-parameters/1", "unit": "HelicopterPlant", "values": values, "expected": expected, "provenance": {}}
    change(found)
    return found


def parameters(change=lambda d: None, more=good):
    """Give a function that writes a parameters.json, and a log."""

    def make(folder):
        more(folder)
        (folder / "parameters.json").write_text(json.dumps(document(change)))

    return make


def plant_unit(folder: Path) -> Path:
    """Build the plant's unit."""
    return build("HelicopterPlant", folder)
