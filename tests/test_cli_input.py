"""What a command is given is looked at before anything runs, and a refusal says what to give instead."""

import json
import re
import signal
import subprocess
import sys

import pytest
from typer import Typer
from typer.testing import CliRunner

from heli_identifier.cli.app import app
from heli_identifier.cli.arguments import in_scenario, unit_value
from heli_identifier.cli.guard import guarded, is_of_memory
from heli_identifier.errors import ConfigurationError, IdentifierError
from heli_identifier.online import ModelParameters
from heli_identifier.records import demo_logs
from heli_identifier.results.parameters import read_parameters
from heli_plant.parameters import BY_FIELD
from tests.test_cli_app import _refused as refused


def run(*words):
    return CliRunner().invoke(app, list(map(str, words)))


UNFORESEEN = {
    "a mistake in the code": (ZeroDivisionError("nobody thought of this"), 70, "ZeroDivisionError: nobody thought"),
    "a full disk": (OSError(28, "No space left on device"), 2, "heli: No space left on device."),
    "a file that cannot be read": (OSError(13, "Permission denied", "a.csv"), 2, "heli: a.csv: Permission denied."),
    "no memory": (MemoryError(), 2, "heli: there is not enough memory for this"),
    "no memory for a library": (
        ImportError("numpy/_generator.so: failed to map segment from shared object"),
        2,
        "heli: there is not enough memory for this",
    ),
    "a library that is not there": (ImportError("No module named 'nonsense'"), 70, "No module named 'nonsense'"),
    "an error of the system without a number": (OSError("timed out"), 2, "heli: timed out."),
}


@pytest.mark.parametrize("case", UNFORESEEN)
def test_a_command_that_could_not_do_its_work_has_another_exit_code_than_one_with_a_bad_answer(case):
    """Exit code 1 is an answer of a check: the model no longer explains the log."""
    error, code, said = UNFORESEEN[case]

    def fails():
        raise error

    one = Typer()
    one.command()(guarded(fails))
    result = CliRunner().invoke(one)
    assert result.exit_code == code
    assert said in result.stderr
    assert ("Traceback" in result.stderr) == (code == 70)
    assert result.stdout == ""


def test_errors_that_lead_back_to_each_other_are_looked_at_once():
    first, second = OSError("no descriptor is left"), ImportError("cannot allocate memory in static TLS block")
    first.__context__, second.__context__ = second, first
    assert is_of_memory(first)
    third = OSError("nor another one")
    first.__context__, third.__context__ = third, first
    assert not is_of_memory(first)


ENDED = """
import pathlib, signal, sys, time, typer, weakref
from heli_identifier.cli import app, main
from heli_identifier.cli.guard import guarded, is_of_memory
from heli_identifier.files import draft_folder

class Thing:
    pass

def dropped():  # the interpreter drops an exception in the callback of a weak reference, as every import has one
    thing = Thing()
    kept = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGTERM))
    del thing
    time.sleep(600)

def changed():  # a library makes another error of it
    try:
        signal.raise_signal(signal.SIGTERM)
    except BaseException as end:
        raise RuntimeError from end

def stuck():  # a thread that never ends
    import threading
    threading.Thread(target=threading.Event().wait).start()
    signal.raise_signal(signal.SIGTERM)

def command():
    with draft_folder(".") as draft:
        (draft / "half.csv").write_text("1")
        globals()[case]()

case = sys.argv.pop()
app.app = typer.Typer()
app.app.command()(guarded(command))
main()
"""


@pytest.mark.parametrize("case", ["dropped", "changed", "stuck"])
def test_a_command_that_is_asked_to_end_does_and_leaves_nothing_whatever_a_library_makes_of_it(tmp_path, case):
    done = subprocess.run(
        [sys.executable, "-c", ENDED, case], capture_output=True, text=True, timeout=300, check=False, cwd=tmp_path
    )
    assert (done.returncode, done.stdout, done.stderr) == (128 + signal.SIGTERM, "", "")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("unit", "setting", "said"),
    [
        ("HelicopterPlant", "pitch.damping=abc", "pitch.damping = 'abc' must be a number in [-10, 10] 1/s."),
        ("HelicopterPlant", "pitch.damping=", "pitch.damping = '' must be a number in [-10, 10] 1/s."),
        ("HelicopterPlant", "pitch.damping=nan", "pitch.damping = nan 1/s must lie in [-10, 10] 1/s."),
        ("HelicopterPlant", "encoder.enabled=yes", "encoder.enabled = 'yes' must be 0 or 1."),
        ("HelicopterPlant", "pitch.dampin=1", "has no parameter 'pitch.dampin'; did you mean 'pitch.damping'?"),
        ("HelicopterPlant", "v_front=1", "the HelicopterPlant has no parameter 'v_front'"),
        ("Exciter", "excitation.experiment=1.5", "excitation.experiment = 1.5 must be a whole number in [0, 3]."),
    ],
)
def test_a_wrong_setting_is_refused_in_one_sentence(unit, setting, said):
    name, _, text = setting.partition("=")
    with pytest.raises(ConfigurationError, match=re.escape(said)):
        unit_value(unit, name, text, f"unit.{name}")


def test_every_command_says_the_same_of_a_wrong_setting(tmp_path):
    said, full = "pitch.damping = 'abc' must be a number in [-10, 10] 1/s.", "plant.pitch.damping=abc"
    refused(tmp_path, said, "build", "HelicopterPlant", "--output", tmp_path / "out", "--set", "pitch.damping=abc")
    run_ = refused(tmp_path, f"plant.{said}", "simulate", "open_loop", "--duration", 1, "--set", full)
    assert run_ == refused(tmp_path, said, "ssp", "open_loop", "--output", tmp_path / "out.ssp", "--set", full)


def test_a_setting_that_names_a_unit_alone_is_told_what_is_missing(tmp_path):
    refused(tmp_path, "--set plant=3 must name unit and parameter", "simulate", "open_loop", "--set", "plant=3")


def test_a_text_parameter_takes_a_text_that_looks_like_a_number():
    assert unit_value("LogPlayer", "log.path", "3", "log.path") == "3"


def test_what_a_foreign_fmu_takes_is_left_to_it():
    # a unit from a file may have parameters that this project's unit of the same name does not
    assert in_scenario("open_loop", None, ["plant.mass=2"], foreign=("plant",)) == {"plant.mass": 2.0}


def parameter_file(folder, unit="HelicopterPlant", change=lambda document: None):
    rows = [BY_FIELD[field] for field in (*ModelParameters._fields, "T_m", "v_max")]
    values = {row.name: {"value": 0.1, "standard_error": 0.01, "unit": row.unit} for row in rows}
    figures = {"prediction_1s_rad": {"value": 1e-3, "low": 9e-4, "high": 2e-3}, "noise_floor_rad": 1e-3}
    expected = {axis: dict(figures) for axis in ("pitch", "elevation", "travel")}
    document = {"schema": "heli-parameters/1", "unit": unit, "values": values, "expected": expected, "provenance": {}}
    change(document)
    path = folder / "parameters.json"
    path.write_text(json.dumps(document))
    return path


def test_a_damaged_parameter_file_gets_the_same_sentence_from_commands_and_in_python(tmp_path):
    file = parameter_file(tmp_path, change=lambda d: d.pop("values"))
    with pytest.raises(IdentifierError) as problem:
        read_parameters(file)
    for command, what in (("check", demo_logs("rig-c")[1][0]), ("simulate", "open_loop")):
        sentence = refused(tmp_path, "missing required field", command, what, "--parameters", file)
        assert sentence.strip() == f"heli: {problem.value}"


def test_values_under_another_unit_s_name_are_refused_with_both_units(tmp_path):
    file = parameter_file(tmp_path, "PidController")
    said = "is of the unit PidController, which has no parameter 'pitch.damping'; its values are of the HelicopterPlant"
    refused(tmp_path, said, "simulate", "closed_loop", "--parameters", file)
