"""What a command is given is looked at before anything runs, and a refusal says what to give instead."""

import json
import signal
import subprocess
import sys
import time

import pytest
from typer.testing import CliRunner

from fmu_src.wiring import SCENARIOS
from heli_identifier.cli.app import app
from heli_identifier.online.parameters import ModelParameters
from heli_identifier.records import demo_logs
from heli_identifier.report.parameter_set import SCHEMA
from heli_plant.parameters import BY_FIELD
from tests.test_cli_app import _refused as refused


def run(*words):
    return CliRunner().invoke(app, list(map(str, words)))


@pytest.fixture
def no_run(monkeypatch):
    """Make the master fail the test if it is asked to run."""

    def never(*_arguments, **_options):
        pytest.fail("a scenario was run")

    monkeypatch.setattr("fmu_src.master.run_apart", never)


@pytest.mark.parametrize("axis", ["pitch", "elevation", "travel"])
def test_an_axis_that_stands_still_can_serve_no_diagnosis(tmp_path, axis):
    (log, *_), (held,) = demo_logs("rig-b")
    lines = log.read_text().splitlines()[:2000]
    column = lines[0].split(",").index(f"{axis} [rad]")
    rows = [",".join([*(c := line.split(","))[:column], "0.1", *c[column + 1 :]]) for line in lines[1:]]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([lines[0], *rows, ""]))
    said = f"{axis} never changes: a clamped axis or a dead encoder"
    refused(tmp_path, said, "diagnose", path, "--validate", held, "--output", tmp_path / "out")
    refused(tmp_path, said, "diagnose", path, "--output", tmp_path / "out")


def test_a_figure_that_cannot_be_drawn_is_refused_before_anything_runs(tmp_path, no_run):
    words = ("simulate", "open_loop", "--output", tmp_path / "run.csv", "--plot", tmp_path / "run.docx")
    refused(tmp_path, "must end in one of .svg, .pdf, .png", *words)


@pytest.mark.parametrize("option", ["--step", "--duration"])
def test_nothing_is_simulated_in_steps_or_a_time_of_zero(tmp_path, option):
    refused(tmp_path, f"{option[2:]} = 0 s", "simulate", "open_loop", option, 0)


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("plant.pitch.damping=abc", "plant.pitch.damping = 'abc' must be a number"),
        ("exciter.excitation.experiment=1.5", "exciter.excitation.experiment = 1.5 must be a whole number"),
    ],
)
def test_a_setting_of_the_wrong_type_is_named_with_what_is_wanted(tmp_path, setting, said):
    sentence = refused(tmp_path, said, "simulate", "open_loop", "--duration", 1, "--set", setting)
    assert len(sentence.splitlines()) == 1


def parameter_file(folder, unit="HelicopterPlant", change=lambda document: None):
    names = [BY_FIELD[field].name for field in ModelParameters._fields]
    values = {name: {"value": 0.1, "standard_error": 0.01, "unit": "1"} for name in names}
    figures = {"prediction_1s_rad": {"value": 1e-3, "low": 9e-4, "high": 2e-3}, "noise_floor_rad": 1e-3}
    expected = {axis: dict(figures) for axis in ("pitch", "elevation", "travel")}
    document = {"schema": SCHEMA, "unit": unit, "values": values, "expected": expected, "provenance": {}}
    change(document)
    path = folder / "parameters.json"
    path.write_text(json.dumps(document))
    return path


DAMAGES = {
    "a section is lost": (lambda d: d.pop("expected"), "lacks 'expected'"),
    "a section is no object": (lambda d: d.update(values=[]), "values must be an object, it is []"),
    "a value is lost": (lambda d: d["values"]["pitch.damping"].pop("value"), "values.pitch.damping lacks value"),
    "a value is a word": (
        lambda d: d["values"]["pitch.damping"].update(value="abc"),
        "values.pitch.damping.value = 'abc' must be a number",
    ),
    "an error is lost": (
        lambda d: d["expected"]["pitch"].pop("noise_floor_rad"),
        "expected.pitch lacks noise_floor_rad",
    ),
    "a bound is nothing": (
        lambda d: d["expected"]["pitch"]["prediction_1s_rad"].update(low=None),
        "expected.pitch.prediction_1s_rad.low = None must be a number",
    ),
}


@pytest.mark.parametrize("case", DAMAGES)
@pytest.mark.parametrize("command", ["check", "simulate"])
def test_a_damaged_parameter_file_is_named_with_the_entry_that_is_damaged(tmp_path, no_run, command, case):
    change, said = DAMAGES[case]
    file = parameter_file(tmp_path, change=change)
    what = demo_logs("rig-c")[1][0] if command == "check" else "open_loop"
    sentence = refused(tmp_path, said, command, what, "--parameters", file)
    assert "Error(" not in sentence
    assert "parameters.json" in sentence


def test_values_under_another_unit_s_name_are_refused_with_both_units(tmp_path, no_run):
    file = parameter_file(tmp_path, "PidController")
    said = "is of the unit PidController, which has no parameter 'pitch.damping'; its values are of the HelicopterPlant"
    refused(tmp_path, said, "simulate", "closed_loop", "--parameters", file)


def test_init_makes_the_folders_above_the_configuration(tmp_path):
    assert run("init", tmp_path / "rigs" / "north-lab.toml").exit_code == 0
    assert (tmp_path / "rigs" / "north-lab.toml").is_file()


@pytest.mark.parametrize("command", ["simulate", "ssp"])
def test_the_help_lists_every_scenario(command):
    said = " ".join(run(command, "--help").stdout.replace("│", " ").split())
    assert all(name in said for name in SCENARIOS)


def test_a_diagnosis_that_is_asked_to_end_leaves_nothing_behind(tmp_path):
    (log, *_), (held,) = demo_logs("rig-b")
    code = "from heli_identifier.cli import main; main()"
    words = ["diagnose", str(log), "--validate", str(held), "--output", str(tmp_path / "out")]
    child = subprocess.Popen([sys.executable, "-c", code, *words], stderr=subprocess.DEVNULL)
    try:
        deadline = time.monotonic() + 60.0
        while not list(tmp_path.iterdir()) and time.monotonic() < deadline:
            time.sleep(0.02)
        assert list(tmp_path.glob(".out-*"))
        time.sleep(0.5)  # into the reading and searching, which take seconds
        child.send_signal(signal.SIGTERM)
        assert child.wait(60.0) == 128 + signal.SIGTERM
    finally:
        child.kill()
    assert list(tmp_path.iterdir()) == []
