"""What a command prints: tables and sentences for people, JSON for machines."""

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import typer

Progress = Callable[[str, float], None]
"""Called with what is being done and the share that is done, 0 to 1."""


def counted(number: int, noun: str) -> str:
    """Give a number of things: ``1 log``, ``2 logs``."""
    return f"{number} {noun}{'s' if number != 1 else ''}"


def note(text: str) -> None:
    """Say something beside the result, on the error stream."""
    typer.secho(text, err=True, dim=True)


def warn(text: str) -> None:
    """Say on the error stream what puts the result in doubt, so that nobody misses it."""
    typer.secho(f"warning: {text}", err=True, fg="yellow", bold=True)


def print_json(document: Mapping[str, Any] | Sequence[Any]) -> None:
    """Print a document on standard output."""
    import json

    # A stream of another encoding cannot show every character; JSON can escape it, so that nothing is lost.
    escaped = (sys.stdout.encoding or "ascii").lower().replace("-", "") != "utf8"
    typer.echo(json.dumps(document, indent=1, ensure_ascii=escaped, allow_nan=False))


def print_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table; a column whose name ends in ``>`` is aligned to the right."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    for name in columns:
        table.add_column(name.removesuffix(">"), justify="right" if name.endswith(">") else "left")
    for row in rows:
        table.add_row(*row)
    # Without a terminal nobody's window bounds the width, and a cell broken in two would spoil a search in it.
    console = Console(highlight=False, markup=False, width=None if sys.stdout.isatty() else 160)
    console.print(table)


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """Show a bar on the error stream if that is a terminal."""
    if not sys.stderr.isatty():
        yield lambda what, share: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("starting", total=1.0)

        def show(what: str, share: float) -> None:
            bar.update(task, description=what, completed=share)

        yield show
