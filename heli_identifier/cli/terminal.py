"""What a command prints: tables and sentences for people, JSON for machines; and streams that outlive their readers.

`heli check | head` ends the pipe before the command is done. The command then goes on without it: its files are
written, and its exit code is its answer. The same holds for a stream that is closed from the start, and a character
that the stream's encoding lacks becomes one like it, or a question mark. Where the stream leads to a full disk the
command goes on as well, and says so at its end.
"""

import codecs
import io
import os
import re
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from json import dumps
from pathlib import Path
from typing import Any, Literal

import typer

import heli_identifier as hi
from heli_identifier import records, results
from heli_identifier.errors import printable
from heli_identifier.processes import undo_at_end

_ALIKE = {"−": "-", "–": "-", "→": "->", "²": "^2", "±": "+-", "Γ": "Gamma"}
"""What stands for a character in an encoding without it: a minus that became a question mark would be a lost sign."""


def _alike(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeEncodeError)
    return "".join(_ALIKE.get(letter, "?") for letter in error.object[error.start : error.end]), error.end


codecs.register_error("alike", _alike)


class _Outlet(io.FileIO):
    """A stream whose reader may leave, or whose disk may be full; what is written after that goes nowhere."""

    problem: str | None = None
    """What the system said then; None while all is well, and after a reader has left."""

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
    """Replace ``sys.stdout`` and ``sys.stderr``; give what flushes them and says what kept them from being written."""
    while (nothing := os.open(os.devnull, os.O_RDWR)) < 3:
        pass  # takes the place of a stream that is closed, which the next file would take, and receive what is printed
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
    """Say something beside the result, on the error stream."""
    typer.secho(printable(text), err=True, dim=True)


def warn(text: str) -> None:
    """Say on the error stream what puts the result in doubt, so that nobody misses it."""
    typer.secho(printable(results.typeset(f"warning: {text}")), err=True, fg="yellow", bold=True)


def note_written(folder: Path, names: Iterable[str], how: str = "") -> None:
    """Say which files were written into a folder."""
    note(f"written{how}: {', '.join(str(folder / name) for name in names)}")


def print_notes(logs: "Sequence[hi.Log]") -> None:
    """Print what was converted or repaired on reading, and what is probably wrong with columns and signs."""
    for log in logs:
        if log.notes:
            note(f"{log.path}: {results.typeset('; '.join(log.notes))}")
    for log in logs:
        for text in records.suspicions(log):
            warn(f"{log.path}: {text}: `heli init LOG` writes a heli.toml with the columns and signs that fit")


_INTERVAL = re.compile(r" ± [^ ]+| \([^()]* to [^()]*\)| \(±[^()]*\)")

UNBOUNDED = 10_000
"""Width of a table that goes to a file or a pipe: no cell is broken in two, which would spoil a search in it."""


def print_table(table: "results.Table", intervals: bool = True) -> None:
    """Print a table with what there is to say of it; a column of figures stands at the right.

    On a terminal too narrow for it, figures stand without their intervals, unless these are asked for; then heads and
    prose break at spaces; then columns stand in parts, each behind the first ones, by which rows are told apart.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table as Printed

    console = Console(highlight=False, markup=False, width=None if sys.stdout.isatty() else UNBOUNDED)
    title, columns = table.title, list(zip(table.columns, *table.rows, strict=True))
    if not intervals and _width([max(map(len, own)) for own in columns]) > console.width:
        title, columns = _INTERVAL.sub("", title), [tuple(_INTERVAL.sub("", cell) for cell in own) for own in columns]
    least = []  # widths at which no figure and no word is broken
    for (head, *cells), figure in zip(columns, table.figures, strict=True):
        words = [*head.split(), *(cells if figure else " ".join(cells).split())]
        least.append(min(max(map(len, words), default=0), console.width // 2))
    first = 1 if len(set(columns[0][1:])) == len(table.rows) else 2
    console.print(results.typeset(title), style="bold")
    for part in _parts(least, first, console.width):
        printed = Printed(box=box.SIMPLE_HEAD, pad_edge=False)
        widths = {k: max(map(len, columns[k])) for k in part}
        while _width(widths.values()) > console.width and (wide := [k for k in part if widths[k] > least[k]]):
            widths[max(wide, key=widths.__getitem__)] -= 1
        for k, width in widths.items():
            justify: Literal["right", "left"] = "right" if table.figures[k] else "left"
            printed.add_column(columns[k][0], justify=justify, width=width, overflow="fold")
        for row in zip(*(columns[k][1:] for k in part), strict=True):
            printed.add_row(*row)
        console.print(printed)
    for text in table.remarks:
        typer.echo(results.typeset(text))


def _parts(widths: Sequence[int], first: int, room: int) -> list[list[int]]:
    """Divide columns into parts that are at most ``room`` wide; each has the ``first`` columns in front."""
    parts = [[*range(first)]]
    for k in range(first, len(widths)):
        if len(parts[-1]) > first and _width([widths[own] for own in (*parts[-1], k)]) > room:
            parts.append([*range(first)])
        parts[-1].append(k)
    return parts


def _width(columns: Collection[int]) -> int:
    """Width of a printed table whose columns have these widths."""
    return sum(columns) + 3 * (len(columns) - 1) + 2


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
    """Print a result as JSON, or as heading, tables, remarks, and which files were written into which folder.

    What puts it in doubt comes last, as what stands last on a terminal is seen.
    """
    if json:
        # A stream of another encoding cannot show every character; JSON can escape it, so that nothing is lost.
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
    found: "results.Tabular", json: bool, intervals: bool = True, written: tuple[Path, Iterable[str]] | None = None
) -> None:
    """Print a value that shows itself as a table."""
    document, tables = found.to_dict(), [found.table]
    print_answer(json, document, tables, found.remarks, written, intervals=intervals, warnings=found.warnings)


def print_diagnosis(diagnosis: "hi.Diagnosis", reasons: bool = False, json: bool = False) -> None:
    """Print the verdict, the effects, the parameters and the errors; with ``reasons`` the catalogue and intervals."""
    tables, heading = results.diagnosis_tables(diagnosis, reasons), results.verdict_line(diagnosis)
    doubts = results.typeset_notes(diagnosis.notes)
    print_answer(json, diagnosis.to_dict(), tables, heading=heading, intervals=reasons, warnings=doubts)


@contextmanager
def progress_bar(lines: bool = False) -> Iterator[Callable[[str, float], None]]:
    """Give what is called with what is being done and the share that is done, 0 to 1: a bar, where it can be seen.

    Elsewhere nothing is shown, or some twenty ``lines``.
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
