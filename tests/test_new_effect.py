"""The new effect of the page, one function with its declaration: in a copy of the project it is at once everywhere."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from textwrap import dedent

import pytest

ROOT = Path(__file__).parent.parent

PAGE = (ROOT / "docs" / "reference" / "effects.md").read_text(encoding="utf-8")
LAW = "\n\n" + PAGE.partition("```python\n")[2].partition("```")[0]

SCRIPT = """
    import numpy as np
    from pathlib import Path

    from heli_identifier.records import Log
    from heli_identifier.tracing import DiagnosisSettings, diagnose
    from heli_identifier.results.report import report_page
    from heli_plant.compiled import compiled, parameter_record
    from heli_plant.laws import added_travel
    from heli_plant.parameters import TABLE_2, from_names
    from heli_plant.simulation import simulate
    from heli_plant.state import rest_state
    from fmu_src.builder import build
    from fmpy import read_model_description
    from tests.blind.signals import multisines

    tilted = from_names({"effects.table_tilt.travel": 0.15})
    motion = [0.0, 0.1, 0.2, 0.7, 0.3, 0.1, 0.2, 1.0, 0.5, 0.0]
    interpreted = added_travel(*motion, tilted)
    assert interpreted == 0.15 * np.sin(0.7) == compiled(added_travel)(*motion, parameter_record(tilted))
    print("compiled")

    def log(seed):
        random = np.random.default_rng(seed)
        voltages = multisines(60.0, random) + 0.8
        start = rest_state(TABLE_2, float(voltages[0].sum()))
        start = start._replace(nu_front=voltages[0, 0], nu_rear=voltages[0, 1])
        angles = simulate(voltages, 0.01, start, tilted)[1]
        step = 2 * np.pi / np.array([4096, 4096, 8192])
        read = step * np.round(angles / step + 0.25 * random.standard_normal(angles.shape))
        return Log(f"run{seed}", 100.0, voltages, read)

    diagnosis = diagnose([log(1), log(2)], held_out=log(3))
    found = diagnosis.effects[0]
    assert (found.name, found.axis) == ("table_tilt", "travel"), diagnosis.effects
    assert abs(found.coefficient.value - 0.15) < 0.01
    print("traced")
    page = report_page(diagnosis, "rig")
    assert "Table tilt on the travel" in page
    assert "c sin(λ)" in page
    print("reported")
    unit = build("HelicopterPlant", Path("units"), {"effects.table_tilt.travel": 0.15})
    names = {variable.name for variable in read_model_description(unit).modelVariables}
    assert "effects.table_tilt.travel" in names
    print("in the unit")
"""


def test_the_law_that_the_page_shows_passes_the_linter():
    file = ROOT / "heli_plant" / "effects" / "arm.py"
    ruff = [Path(sys.executable).with_name("ruff"), "check", "--stdin-filename", file, "-"]
    said = subprocess.run(ruff, input=file.read_text() + LAW, capture_output=True, text=True, cwd=ROOT)
    assert said.returncode == 0, said.stdout


@pytest.mark.slow
def test_new_effect_is_compiled_traced_reported_documented_and_in_the_unit(tmp_path):
    for package in ("heli_plant", "heli_identifier", "fmu_src", "tests", "docs"):
        ignored = shutil.ignore_patterns("__pycache__", "demo_logs", "figures")
        shutil.copytree(ROOT / package, tmp_path / package, ignore=ignored if package != "heli_identifier" else None)
    file = tmp_path / "heli_plant" / "effects" / "arm.py"
    file.write_text(file.read_text() + LAW)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "HELI_CACHE_DIR": str(tmp_path / "cache")}

    def python(*words):
        done = subprocess.run(
            [sys.executable, *words], capture_output=True, text=True, cwd=tmp_path, env=environment, timeout=300
        )
        assert done.returncode == 0, done.stdout + done.stderr[-3000:]
        return done.stdout

    said = python("-c", dedent(SCRIPT))
    assert said.split("\n")[:-1] == ["compiled", "traced", "reported", "in the unit"]
    documented = "from docs.hooks.effects import on_page_markdown as page; print(page('<!-- effects -->'))"
    assert "| `table_tilt` | travel |" in python("-c", documented)
