"""Errors of a command as one sentence on the error stream and the exit code 2."""

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

import typer

from fmu_src.errors import FmuError
from heli_identifier.errors import IdentifierError
from heli_plant.errors import PlantError

P = ParamSpec("P")
R = TypeVar("R")

BAD_INPUT = 2
"""Exit code of bad usage and of data that cannot be used."""


def guarded(command: Callable[P, R]) -> Callable[P, R]:
    """Make a command answer an error raised on purpose with its sentence; a mistake in the code shows in full."""

    @wraps(command)
    def run(*arguments: P.args, **options: P.kwargs) -> R:
        try:
            return command(*arguments, **options)
        except (IdentifierError, PlantError, FmuError) as error:
            raise fail(str(error)) from error
        except OSError as error:
            if error.filename is None:
                raise
            raise fail(f"{error.filename}: {error.strerror}") from error

    return run


def fail(sentence: str) -> typer.Exit:
    """Say what is wrong and give the exit to raise."""
    text = " ".join(sentence.split())
    typer.secho(f"heli: {text}" if text.endswith((".", "?")) else f"heli: {text}.", err=True, fg="red")
    return typer.Exit(BAD_INPUT)
