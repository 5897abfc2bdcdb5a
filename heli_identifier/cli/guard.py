"""Rules for every command.

An error that the program raises on purpose is printed as one sentence, with exit code 2; any other error with its
traceback and 70. Exit code 1 is the answer of some commands. A command that is asked to end (SIGTERM, SIGHUP, Ctrl-C)
leaves no draft files and no processes. A command does not write over a file that it reads.
"""

import os
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import wraps
from inspect import signature
from pathlib import Path
from typing import Any, cast

import typer

from fmu_src.errors import FmuError
from heli_identifier.errors import CONFIGURATION_NAME, IdentifierError, refuse
from heli_identifier.files import PROTECTED, is_protected
from heli_identifier.processes import clean_up_on_signals
from heli_plant.errors import PlantError

FAILED, BAD_INPUT, PROGRAM_ERROR, INTERRUPTED = 1, 2, 70, 130
"""Exit codes: the model no longer explains a log, or a rig could not be diagnosed; bad usage, or data that cannot be
used; a programming error (EX_SOFTWARE of sysexits.h); Ctrl-C, as every command that it ends gives it."""


@contextmanager
def report_errors() -> Iterator[None]:
    """Turn an error in the block into a message and an exit code; let signals end the block."""
    try:
        with clean_up_on_signals():
            yield
    except typer.Exit:
        raise
    except Exception as error:
        sentence = error_sentence(error)
        if sentence is None:
            traceback.print_exc()
            typer.secho("heli: a programming error in heli; please report it with the lines above.", err=True, fg="red")
            raise SystemExit(PROGRAM_ERROR) from error
        text = f"heli: {' '.join(sentence.split())}"
        typer.secho(text if text.endswith((".", "?")) else f"{text}.", err=True, fg="red")
        raise SystemExit(BAD_INPUT) from error
    finally:
        PROTECTED.clear()


def check_command(command: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a command: it begins only with options that have an effect, and with output files that it does not read."""

    @wraps(command)
    def run(**options: Any) -> Any:
        with report_errors():  # inside the parser, which handles a broken pipe in its own way
            refuse_idle(command, options)
            check_files(options)
            return command(**options)

    return run


def error_sentence(error: Any) -> str | None:
    """Return the sentence for an error; None for an error of the program itself."""
    if hasattr(error, "format_message"):  # only a usage error has it; the module of its class depends on the version
        sentence = error.format_message().rstrip(".")
        for wrong in getattr(error.__cause__, "errors", tuple)():  # of pydantic, which leaves out the value
            value = repr(str(wrong["input"]))
            sentence += "" if value in sentence else f", not {value}"
        command = error.ctx.command_path if error.ctx else "heli"  # an option without its value has no context
        return sentence if sentence.endswith("?") else f"{sentence}; see {command} --help"
    if isinstance(error, MemoryError):
        return "there is not enough memory for this; give less data or ask for less of it"
    if not isinstance(error, IdentifierError | PlantError | FmuError | OSError):
        return None
    try:
        os.getcwd()
    except OSError:  # this causes every other error
        return "the folder in which this command runs is gone; change to another one"
    if not isinstance(error, OSError):
        return str(error)
    sentence = error.strerror or str(error) or type(error).__name__
    return sentence if error.filename is None else f"{error.filename}: {sentence}"


def only_with(**others: str) -> Callable[[Callable[..., Any]], Any]:
    """Say of options of the command below with which others they have an effect; ``not x``: where x is not given."""

    def mark(command: Any) -> Any:
        command.only_with = others
        return command

    return mark


def refuse_idle(command: Any, options: Mapping[str, object]) -> None:
    """Refuse an option that has no effect with the others, as :func:`only_with` says."""
    declared = {name: parameter.default for name, parameter in signature(command).parameters.items()}
    given = {name for name, value in options.items() if value != declared[name].default}
    for name, rule in getattr(command, "only_with", {}).items():
        *ruled_out, other = rule.split()
        shown = [(declared[key].param_decls or [f"--{key.replace('_', '-')}"])[0] for key in (name, other)]
        wording = "{} has no effect with {}." if ruled_out else "{} has an effect only with {}."
        refuse(name in given and (other in given) == bool(ruled_out), wording.format(*shown))


_WRITTEN = ("output", "junit", "plot")
"""Options that name a file to write."""


def check_files(options: Mapping[str, object]) -> None:
    """Refuse to write over a file that the command reads, such as a measured log."""
    written = [path for key in _WRITTEN if isinstance(path := options.get(key), Path)]
    values = [value if isinstance(value, list) else [value] for key, value in options.items() if key not in _WRITTEN]
    PROTECTED.extend(path for several in values for path in several if isinstance(path, Path))
    PROTECTED.extend(Path(word.partition("=")[2].strip()) for word in cast(list[str], options.get("fmu", [])))
    if "config" in options and options["config"] is None:
        PROTECTED.append(Path(CONFIGURATION_NAME))  # of this folder, which is read where none is named
    for path in written:
        refuse(is_protected(path), f"{path} is read by this command and not written over; name another.")
