"""Good files, from which the faults are made by one change each."""

import io
import json
import os
from pathlib import Path

import numpy as np
import pytest

from heli_identifier.records import demo_files
from heli_identifier.results import ErrorFigure, to_json_value
from heli_identifier.results.parameters import PLANT, Expectation, ParameterSet, plant_values
from heli_plant.effects import AXES
from heli_plant.parameters import TABLE_2

_LINES = demo_files("rig-c")[1][0].read_text().splitlines()[:2001]
HEADER, ROWS = _LINES[0], _LINES[1:]
IDENTIFY = "heli identify log.csv -o out"
CHECK = "heli check log.csv -p parameters.json --factor 1000"
DESIGN = "heli design reverse_thrust_loss"


def columns():
    """Return 20 s of a good log, shape (6, 2000)."""
    return np.loadtxt(io.StringIO("\n".join(ROWS)), delimiter=",").T


def write(content, name="log.csv"):
    data = content.encode() if isinstance(content, str) else content
    return lambda folder: (folder / name).write_bytes(data)


good = write("\n".join([HEADER, *ROWS, ""]))


def nothing(folder):
    """Make no file."""


def pipe(path: Path):
    """Make a named pipe; skip the test where there are none."""
    if not hasattr(os, "mkfifo"):
        pytest.skip("this system has no named pipes")
    os.mkfifo(path)


def configured(toml, make=good):
    def both(folder):
        make(folder)
        (folder / "heli.toml").write_text(toml)

    return both


def as_struct():
    names = ("time_s", "v_front_V", "v_rear_V", "pitch_rad", "elevation_rad", "travel_rad")
    return dict(zip(names, columns(), strict=True))


def document(change=lambda d: None):
    """Return the content of a plant's parameters.json after a change."""
    expected = {axis: Expectation(ErrorFigure(1e-2, 9e-3, 2e-2), 1e-3) for axis in AXES}
    content = to_json_value(ParameterSet(PLANT, plant_values(TABLE_2, {}), expected).to_dict())
    change(content)
    return content


def parameters(change=lambda d: None, more=good):
    def make(folder):
        more(folder)
        (folder / "parameters.json").write_text(json.dumps(document(change)))

    return make
