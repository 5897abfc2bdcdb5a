"""The output of commands: tables and sentences for people, JSON for machines, and streams whose reader may leave.

`heli check | head` closes the pipe before the command ends. The command then continues: it writes its files and gives
its exit code. It also continues if a stream is closed from the start. If the disk of a stream is full, it continues and
says so at its end. A character that the encoding lacks is replaced by a similar one or a question mark.
"""

import codecs
import io
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from json import dumps
from math import inf
from pathlib import Path
from shutil import get_terminal_size
from typing import Any

import typer

import heli_identifier as hi
from heli_identifier import records, results
from heli_identifier.errors import printable
from heli_identifier.processes import undo_at_end

_SIMILAR = {"−": "-", "–": "-", "→": "->", "²": "^2", "±": "+-", "Γ": "Gamma", "─": "-"}
"""Replacements of characters that an encoding lacks: a minus must not become a question mark."""


def _replace_characters(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeEncodeError)
    return "".join(_SIMILAR.get(letter, "?") for letter in error.object[error.start : error.end]), error.end


codecs.register_error("alike", _replace_characters)


class _Outlet(io.FileIO):
    """A stream whose reader may leave, or whose disk may be full; later output is then discarded."""

    problem: str | None = None
    """The system's message of an error of the disk; None without an error, and after a reader has left."""

    def write(self, data: Any) -> int | None:  # type: ignore[override]
        try:
            written = super().write(data)
            if written is None:  # a full pipe that does not wait for its reader
                os.set_blocking(self.fileno(), True)
                written = super().write(data)
            return written
        except OSError as error:
            if not isinstance(error, BrokenPipeError):
                self.problem = error.strerror
            with open(os.devnull, "wb") as nothing:
                os.dup2(nothing.fileno(), self.fileno())
            return super().write(data)


def open_streams() -> Callable[[], str | None]:
    """Replace ``sys.stdout`` and ``sys.stderr``; give a function that flushes them and returns a disk's error."""
    while (nothing := os.open(os.devnull, os.O_RDWR)) < 3:
        pass  # this file takes the number of a closed stream; else the next file would take it, and get all output
    os.close(nothing)
    outlets = [_Outlet(descriptor, "w", closefd=False) for descriptor in (1, 2)]
    for outlet, name in zip(outlets, ("stdout", "stderr"), strict=True):
        encoding, lines = getattr(getattr(sys, name), "encoding", "utf-8"), name == "stderr" or outlet.isatty()
        if sys.platform != "win32" or not outlet.isatty():  # Windows' console takes text, which Python's stream writes
            buffer = io.BufferedWriter(outlet)
            setattr(sys, name, io.TextIOWrapper(buffer, encoding=encoding, errors="alike", line_buffering=lines))

    def flush() -> str | None:
        sys.stdout.flush()
        sys.stderr.flush()
        return next((outlet.problem for outlet in outlets if outlet.problem is not None), None)

    return flush


def note(text: str) -> None:
    """Print a remark on the error stream."""
    typer.secho(printable(text), err=True, dim=True)


def warn(text: str) -> None:
    """Print on the error stream a reason to doubt the result."""
    typer.secho(printable(results.typeset(f"warning: {text}")), err=True, fg="yellow", bold=True)


def note_written(folder: Path, names: Iterable[str]) -> None:
    """Print which files were written into a folder."""
    note(f"written: {', '.join(str(folder / name) for name in names)}")


def print_notes(logs: "Sequence[hi.Log]") -> None:
    """Print what was converted or repaired on reading, and suspicions about columns and signs."""
    for log in logs:
        if log.notes:
            note(f"{log.path}: {results.typeset('; '.join(log.notes))}")
        for text in records.find_suspicions(log):
            warn(f"{log.path}: {text}: `heli init LOG` writes a heli.toml with the columns and signs that fit")


def print_table(table: "results.Table", intervals: bool = True) -> None:
    """Print a table with its remarks; on a terminal its cells break at spaces, in a file or a pipe nowhere.

    On a terminal that is too narrow, figures lose their intervals unless ``intervals``.
    """
    width = get_terminal_size().columns if sys.stdout.isatty() else inf
    if not intervals and max(map(len, table._replace(remarks=()).text().splitlines())) > width:
        table = table.without_intervals()
    typer.secho(results.typeset(table.title), bold=True)
    typer.echo(table.text(width))


def print_answer(
    json: bool,
    document: Any,
    tables: "Iterable[results.Table]",
    remarks: Iterable[str] = (),
    written: tuple[Path, Iterable[str]] | None = None,
    heading: str = "",
    intervals: bool = True,
    warnings: Iterable[str] = (),
) -> None:
    """Print a result as JSON, or as heading, tables, remarks, and the files that were ``written`` into a folder.

    Warnings come last, where a reader of a terminal sees them.
    """
    if json:
        # A stream of another encoding cannot show every character: JSON escapes them.
        escaped = (sys.stdout.encoding or "ascii").lower().replace("-", "") != "utf8"
        typer.echo(dumps(document, indent=1, ensure_ascii=escaped, allow_nan=False))
    else:
        if heading:
            typer.secho(heading, bold=True)
        for table in tables:
            print_table(table, intervals)
        for text in remarks:
            typer.echo(results.typeset(text))
        if written:
            note_written(*written)
    for text in warnings:
        warn(text)


def show(
    result: "results.Tabular", json: bool, intervals: bool = True, written: tuple[Path, Iterable[str]] | None = None
) -> None:
    """Print a value that has a table."""
    document, tables = result.to_dict(), [result.table]
    print_answer(json, document, tables, (), written, intervals=intervals, warnings=result.warnings)


def print_diagnosis(diagnosis: "hi.Diagnosis", reasons: bool = False, json: bool = False) -> None:
    """Print the verdict, the effects, the parameters and the errors; with ``reasons`` the catalogue and intervals."""
    tables, heading = results.diagnosis_tables(diagnosis, reasons), results.verdict_line(diagnosis)
    notes = results.typeset_notes(diagnosis.notes)
    print_answer(json, diagnosis.to_dict(), tables, heading=heading, intervals=reasons, warnings=notes)


@contextmanager
def progress_bar(lines: bool = False) -> Iterator[Callable[[str, float], None]]:
    """Return a function that shows the current work and the share that is done, 0 to 1: as a bar on a terminal.

    Without a terminal nothing is shown, or with ``lines`` about twenty lines.
    """
    if not sys.stderr.isatty():
        shown = -1.0

        def show_line(what: str, share: float) -> None:
            nonlocal shown
            if lines and (share > shown + 0.049 or share == 1.0):
                shown = share
                typer.echo(what, err=True)

        yield show_line
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar, undo_at_end(bar.stop):
        task = bar.add_task("starting", total=1.0)
        yield lambda what, share: bar.update(task, description=what, completed=share)
