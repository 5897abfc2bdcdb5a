"""The command line answers at once, shows an example for everything, and refuses bad input in one sentence."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from heli_identifier.cli.app import app
from heli_identifier.cli.arguments import spread
from heli_identifier.cli.terminal import print_table
from heli_identifier.results import Table

COMMANDS = sorted(get_command(app).commands)


def run(*words, **options):
    return CliRunner().invoke(app, list(map(str, words)), **options)


def test_linear_algebra_runs_on_one_thread_unless_the_user_wants_otherwise():
    code = (
        "import sys, os; sys.argv = ['heli', '--version']\n"
        "try:\n import heli_identifier.cli as c; c.main()\n"
        "finally:\n print(os.environ['OPENBLAS_NUM_THREADS'])"
    )
    for given, expected in ((None, "1"), ("3", "3")):
        environment = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
        environment |= {"OPENBLAS_NUM_THREADS": given} if given else {}
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
        assert done.stdout.split()[-1] == expected


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_examples_whose_options_exist(command):
    said = run(command, "--help")
    assert said.exit_code == 0
    known = get_command(app).commands[command]
    options = {word for parameter in known.params for word in (*parameter.opts, *parameter.secondary_opts)}
    examples = [line for line in known.epilog.splitlines() if line.startswith("heli ")]
    assert examples
    for example in examples:
        assert example.split()[1] == command
        assert set(re.findall(r" (--?[a-z][a-z-]*)", example)) <= options


@pytest.mark.parametrize(
    ("typed", "offered"),
    [("heli sim", "simulate"), ("heli simulate clo", "closed_loop"), ("heli build Log", "LogPlayer")],
)
def test_the_shell_completes_commands_scenarios_and_units(typed, offered):
    words = {"_HELI_COMPLETE": "complete_bash", "COMP_WORDS": typed, "COMP_CWORD": str(len(typed.split()) - 1)}
    script = Path(sys.executable).parent / "heli"
    done = subprocess.run([script], capture_output=True, text=True, env={**os.environ, **words}, check=False)
    assert done.stdout.split() == [offered]


def test_validate_takes_all_files_up_to_the_next_option():
    words = "diagnose a b --validate c d --output x e"
    assert spread(words.split()) == "diagnose a b --validate c --validate d --output x e".split()
    again = "--validate a --validate b c -v d".split()
    assert spread(again) == "--validate a --validate b --validate c -v d".split()
    joined = "a --validate=b c d --json e".split()
    assert spread(joined) == "a --validate=b --validate c --validate d --json e".split()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("build", "Helicopter"), "HelicopterPlant"),
        (("build", "HelicopterPlant", "--set", "effects.dry_friction.pich=.02"), "effects.dry_friction.pitch"),
        (("build", "HelicopterPlant", "--set", "pitch.damping"), "NAME=VALUE"),
        (("build", "--set", "pitch.damping=1"), "one unit"),
        (("simulate", "measured_data"), "--log"),
        (("simulate", "open_loop", "--log", "log.csv"), "plays no log"),
        (("simulate", "open_loop", "--fmu", "plant"), "UNIT=FILE"),
        (("effects", "--axis", "roll"), "pitch"),
        (("diagnose", "--validate", "a.csv"), "LOG"),
        (("diagnose", "a.csv", "--validate", "--output", "x"), "--validate names no log"),
        (("diagnose", "a.csv", "--no-such-option"), "--no-such-option"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else None,
)
def test_bad_usage_gets_one_sentence_and_exit_code_two(tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    _refused(tmp_path, said, *words)


def test_a_configuration_of_this_folder_is_taken_and_that_is_said(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run("init").exit_code == 0
    said = _refused(tmp_path, "does not exist", "diagnose", "nothing.csv")
    assert "configuration: heli.toml" in said


def test_on_a_narrow_terminal_figures_stand_without_their_intervals_unless_they_are_asked_for(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "60")
    rows = [("pitch gain of the model as it was", "0.2930 ± 0.0057 rad/s²/V", "5.00 (4.50 to 5.50)")]
    table = Table("Gains (± 1.96 standard errors)", ("parameter", "value", "error"), rows)
    printed = []
    for terminal, intervals in ((False, False), (True, True), (True, False)):
        monkeypatch.setattr(sys.stdout, "isatty", lambda told=terminal: told)
        print_table(table, intervals)
        printed.append(" ".join(capsys.readouterr().out.split()))
    assert "± 0.0057" in printed[0] and "to" in printed[1]
    assert "0.2930 rad/s²/V 5.00" in printed[2] and "±" not in printed[2]


def _refused(folder, said, *words):
    before = sorted(folder.rglob("*"))
    result = run(*words)
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    sentence = result.stderr
    assert said in " ".join(sentence.replace("│", " ").split())
    assert "Traceback" not in sentence
    assert sorted(folder.rglob("*")) == before
    return sentence
