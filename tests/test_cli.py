"""The command line answers at once, shows an example for everything, and refuses bad input in one sentence."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from typer import Typer
from typer.main import get_command
from typer.testing import CliRunner

from fmu_src import check_start_values, unit_class
from heli_identifier.cli.app import app
from heli_identifier.cli.arguments import Group, scenario_values, spread_options
from heli_identifier.cli.terminal import print_table
from heli_identifier.results import Table
from tests.commands import heli, run_program, run_python

COMMANDS = sorted(get_command(app).commands)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_examples_whose_options_exist(command):
    said = heli(command, "--help")
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
    assert run_program([script], env={**os.environ, **words}).stdout.split() == [offered]


@pytest.mark.skipif(sys.platform == "win32", reason="pipes of Windows always wait")
def test_nothing_is_lost_in_a_pipe_that_does_not_wait_for_its_reader():
    """A shell whose parent reads without waiting hands on such pipes; they hold 64 KiB."""
    script = """
from heli_identifier.cli.terminal import open_streams
flush = open_streams()
print("x" * 300_000)
flush()
"""
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    with subprocess.Popen([sys.executable, "-c", script], stdout=writer) as child, open(reader, "rb") as pipe:
        os.close(writer)
        first = pipe.read(1)  # it is full by then, or soon
        assert len(first + pipe.read()) == 300_001
    assert child.returncode == 0


def test_validate_takes_all_files_up_to_the_next_option():
    for typed, taken in (
        ("diagnose a b --validate c d --output x e", "diagnose a b --validate c --validate d --output x e"),
        ("--validate a --validate b c -v d", "--validate a --validate b --validate c -v d"),
        ("a --validate=b c d --json e", "a --validate=b --validate c --validate d --json e"),
    ):
        assert spread_options(typed.split()) == taken.split()


def test_on_a_narrow_terminal_figures_stand_without_their_intervals_unless_they_are_asked_for(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "60")
    rows = [("pitch gain of the model as it was", "0.2930 ± 0.0057 rad/s²/V", "5.00 (4.50 to 5.50)")]
    table, printed = Table("Gains (± 1.96 standard errors)", ("parameter", "value", "error [mrad]"), rows), []
    for terminal, intervals in ((False, False), (True, True), (True, False)):
        monkeypatch.setattr(sys.stdout, "isatty", lambda told=terminal: told)
        print_table(table, intervals)
        printed.append(re.sub(r"\x1b\[\d*m", "", capsys.readouterr().out))
    assert all(cell in printed[0] for cell in rows[0])
    assert max(map(len, printed[1].splitlines())) <= 60
    assert set(" ".join(rows[0]).split()) <= set(printed[1].split())  # cells break at spaces
    assert "0.2930 rad/s²/V" in printed[2] and "±" not in printed[2] and "4.50" not in printed[2]
    # of a table of many columns some stand below the others, and no cell is cut
    monkeypatch.setenv("COLUMNS", "80")
    heads, cells = [f"log-{k}" for k in range(12)], [f"0.{k}00" for k in range(12)]
    print_table(Table("Parameters", ("parameter", "meaning", *heads), [("k_x", "gain", *cells)], ["below"]))
    lines = re.sub(r"\x1b\[\d*m", "", capsys.readouterr().out).splitlines()
    assert max(map(len, lines)) <= 80 and all(cell in "".join(lines) for cell in (*heads, *cells))
    assert sum("k_x" in line for line in lines) == sum("parameter" in line for line in lines) == 2
    assert lines.count("below") == 1


@pytest.mark.parametrize("error, code, said", [
    (ZeroDivisionError("nobody thought of this"), 70, "ZeroDivisionError: nobody thought"),
    (OSError(28, "No space left on device"), 2, "heli: No space left on device."),
    (OSError("timed out"), 2, "heli: timed out."),
    (MemoryError(), 2, "heli: there is not enough memory"),
])  # fmt: skip
def test_a_command_that_could_not_do_its_work_has_another_exit_code_than_one_with_a_bad_answer(error, code, said):
    """Exit code 1 is an answer of a check: the model no longer explains the log."""

    def fails():
        raise error

    one = Typer(cls=Group)
    one.command()(fails)
    one.callback()(lambda: None)
    result = CliRunner().invoke(one, ["fails"])
    assert (result.exit_code, result.stdout) == (code, "")
    assert said in result.stderr and ("Traceback" in result.stderr) == (code == 70)


ENDED = """
import pathlib, signal, sys, time, weakref
from heli_identifier.cli import app, main
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
app.app.command()(command)
sys.argv.append("command")
main()
"""


@pytest.mark.parametrize("case", ["dropped", "changed", "stuck"])
def test_a_command_that_is_asked_to_end_does_and_leaves_nothing_whatever_a_library_makes_of_it(tmp_path, case):
    done = run_python(ENDED, case, exit_code=128 + signal.SIGTERM, timeout=300, cwd=tmp_path)
    assert (done.stdout, done.stderr) == ("", "")
    assert list(tmp_path.iterdir()) == []


def test_a_text_parameter_takes_a_text_that_looks_like_a_number_and_a_foreign_fmu_what_is_given():
    assert check_start_values(unit_class("LogPlayer"), {"log.path": "3"}) == {"log.path": "3"}
    # a unit from a file may have parameters that this project's unit of the same name does not
    assert scenario_values("open_loop", None, ["plant.mass=2_000"], foreign=("plant",)) == {"plant.mass": 2000.0}
