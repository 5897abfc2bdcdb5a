"""Errors of a command as one sentence and the exit code 2, mistakes in the code in full and the exit code 70.

Neither takes the exit code 1, which is an answer of the command. A request to end leaves nothing behind.
"""

import signal
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from threading import current_thread, main_thread
from typing import NoReturn, ParamSpec, TypeVar

import typer

from fmu_src.errors import FmuError
from heli_identifier.errors import IdentifierError
from heli_plant.errors import PlantError

P = ParamSpec("P")
R = TypeVar("R")

BAD_INPUT = 2
"""Exit code of bad usage and of data that cannot be used."""

MISTAKE = 70
"""Exit code of an error that nobody foresaw: EX_SOFTWARE of sysexits.h."""

TERMINATED = 128 + signal.SIGTERM
"""Exit code of a command that was asked to end, as a shell gives it."""


def guarded(command: Callable[P, R]) -> Callable[P, R]:
    """Make a command answer an error raised on purpose with its sentence; a mistake in the code shows in full.

    A closed pipe is left to the command line's own framework, which ends quietly.
    """

    @wraps(command)
    def run(*arguments: P.args, **options: P.kwargs) -> R:
        try:
            with terminable():
                return command(*arguments, **options)
        except (IdentifierError, PlantError, FmuError) as error:
            raise fail(str(error)) from error
        except (typer.Exit, typer.Abort, BrokenPipeError):
            raise
        except OSError as error:
            said = error.strerror or str(error) or type(error).__name__
            raise fail(said if error.filename is None else f"{error.filename}: {said}") from error
        except Exception as error:
            traceback.print_exc()
            typer.secho("heli: this is a mistake in heli; please report it with the lines above.", err=True, fg="red")
            raise typer.Exit(MISTAKE) from error

    return run


@contextmanager
def terminable() -> Iterator[None]:
    """Let SIGTERM end the block as an exception does, so that drafts of results are taken away on the way out."""
    if current_thread() is not main_thread():  # only there a signal can be heard
        yield
        return
    before = signal.signal(signal.SIGTERM, _leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _leave(_number: int, _frame: object) -> NoReturn:
    """Ask the processes that were started to end as well, for those who wait for them, and leave."""
    processes = sys.modules.get("multiprocessing")
    for child in processes.active_children() if processes else ():
        child.terminate()
    raise SystemExit(TERMINATED)


def fail(sentence: str) -> typer.Exit:
    """Say what is wrong and give the exit to raise."""
    text = " ".join(sentence.split())
    typer.secho(f"heli: {text}" if text.endswith((".", "?")) else f"heli: {text}.", err=True, fg="red")
    return typer.Exit(BAD_INPUT)
