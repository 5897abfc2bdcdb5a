"""Errors of a command: those raised on purpose as one sentence with exit code 2, any other with its traceback and 70.

Exit code 1 is left to commands that give it as an answer. A command that is asked to end (SIGTERM, SIGHUP, Ctrl-C)
leaves no files and no processes behind.
"""

import os
import signal
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial, wraps
from multiprocessing import parent_process
from pathlib import Path
from typing import NoReturn, ParamSpec, TypeVar

import typer

from fmu_src.errors import FmuError
from heli_identifier.cli.memory import is_of_memory, require_memory
from heli_identifier.errors import ConfigurationError, IdentifierError
from heli_identifier.files import keeping
from heli_identifier.signals import ENDING, alarmed, handled
from heli_plant.errors import PlantError

P = ParamSpec("P")
R = TypeVar("R")

BAD_INPUT = 2
"""Exit code of bad usage and of data that cannot be used."""

NO_MEMORY = "there is not enough memory for this; give less data or ask for less of it"

MISTAKE = 70
"""Exit code of a programming error: EX_SOFTWARE of sysexits.h."""


def guarded(command: Callable[P, R]) -> Callable[P, R]:
    """Make a command print the sentence of an error that is raised on purpose; any other error prints its traceback.

    What is printed to a closed pipe is no error (:mod:`heli_identifier.cli.streams`).
    """

    @wraps(command)
    def run(*arguments: P.args, **options: P.kwargs) -> R:
        try:
            with terminable():
                require_memory()
                with keeping(_read(options)):
                    return command(*arguments, **options)
        except (IdentifierError, PlantError, FmuError) as error:
            raise fail(_without_folder() or str(error)) from error
        except (typer.Exit, typer.Abort):
            raise
        except OSError as error:
            if is_of_memory(error):
                raise fail(NO_MEMORY) from error
            said = error.strerror or str(error) or type(error).__name__
            named = said if error.filename is None else f"{error.filename}: {said}"
            raise fail(_without_folder() or named) from error
        except Exception as error:
            if is_of_memory(error):
                raise fail(NO_MEMORY) from error
            traceback.print_exc()
            typer.secho("heli: a programming error in heli; please report it with the lines above.", err=True, fg="red")
            raise typer.Exit(MISTAKE) from error

    return run


def _without_folder() -> str:
    """Say so if the folder in which the command runs is gone, which is behind every other error then."""
    try:
        os.getcwd()
    except OSError:
        return "the folder in which this command runs is gone; change to another one"
    return ""


_WRITTEN = ("output", "junit", "plot")
"""Options that name a file to write."""


def _read(options: Mapping[str, object]) -> list[Path]:
    """Give the files that a command reads, such as a measured log; refuse to write over one of them, or one twice.

    Raises
    ------
    ConfigurationError
        Names the file.
    """
    named = [Path(os.path.realpath(path)) for key in _WRITTEN if isinstance(path := options.get(key), Path)]
    if twice := [path for path in named if named.count(path) > 1 and (path.is_file() or not path.exists())]:
        raise ConfigurationError(f"two results are to be written to {twice[0].name}; name one file for each.")
    paths = {key: value if isinstance(value, list) else [value] for key, value in options.items()}
    read = [path for key, given in paths.items() if key not in _WRITTEN for path in given if isinstance(path, Path)]
    for written in (path for key in _WRITTEN for path in paths.get(key, ()) if isinstance(path, Path)):
        for path in read:
            with suppress(OSError):  # one of them is not there
                if written.is_file() and written.samefile(path):
                    raise ConfigurationError(f"{written} is read by this command and not written over; name another.")
    return read


AGAIN = 0.05
"""Time after which a command that was asked to end, and goes on, is asked again [s]."""


@contextmanager
def terminable() -> Iterator[None]:
    """Let SIGTERM, SIGHUP and Ctrl-C end the block as an exception does, so that drafts of results are removed.

    Python drops an exception that is raised within the callback of a weak reference, as every import has one, or in a
    ``__del__``; a library may drop it or make another one of it. While the block goes on as if nothing had been asked,
    the exception is therefore raised again, and the block's end remembers that it was asked for.
    """
    asked: list[int] = []
    outer, alarm = sys.unraisablehook, signal.getsignal(signal.SIGALRM)

    def dropped(what: "sys.UnraisableHookArgs") -> None:
        if not (asked and isinstance(what.exc_value, SystemExit)):
            outer(what)

    sys.unraisablehook = dropped
    try:
        with handled(partial(_leave, asked)):
            yield
    except Exception as error:
        if asked:
            raise SystemExit(128 + asked[0]) from error
        raise
    finally:
        if asked:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, alarm)
        sys.unraisablehook = outer
    if asked:
        raise SystemExit(128 + asked[0])


def _leave(asked: list[int], number: int, _frame: object) -> NoReturn:
    """End the processes that were started, which others may be waiting for, and leave; note the signal in ``asked``."""
    asked.append(number)
    for other in ENDING:  # a second one would end the cleaning up
        signal.signal(other, signal.SIG_IGN)
    processes = sys.modules.get("multiprocessing")
    for child in processes.active_children() if processes else ():
        child.terminate()
    alarmed(partial(_leave_again, number), AGAIN, AGAIN)
    raise SystemExit(128 + number)


def _leave_again(number: int, _alarm: int, _frame: object) -> None:
    """Leave if the exception has been dropped; while it is on its way, the block is cleaning up."""
    error = sys.exception()
    while error is not None:
        if isinstance(error, SystemExit):
            return
        error = error.__context__
    raise SystemExit(128 + number)


def bound_to_parent() -> None:
    """Let a process that was started for a command end with it, however it ends."""
    from fmu_src.master import die_with_parent

    die_with_parent()
    parent = parent_process()
    if parent is not None and not parent.is_alive():  # it ended before that was arranged
        os._exit(0)


def fail(sentence: str) -> typer.Exit:
    """Print what is wrong, and give the exit to raise."""
    text = " ".join(sentence.split())
    typer.secho(f"heli: {text}" if text.endswith((".", "?")) else f"heli: {text}.", err=True, fg="red")
    return typer.Exit(BAD_INPUT)
