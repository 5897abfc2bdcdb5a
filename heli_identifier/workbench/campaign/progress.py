"""A campaign's progress on the error stream: a bar on a terminal, some twenty lines elsewhere."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from heli_identifier.workbench.campaign.row import Row
from heli_identifier.workbench.campaign.run import Progress as Callback

LINES = 20
"""Number of lines that a whole campaign writes where there is no terminal."""


@contextmanager
def progress_bar() -> Iterator[Callback]:
    """Yield a ``progress`` for :func:`heli_identifier.workbench.campaign.run.run_campaign`."""
    if not sys.stderr.isatty():
        yield _write_line
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("diagnosing"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.description}"),
        TimeElapsedColumn(), TimeRemainingColumn(),
    )  # fmt: skip
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task, failed = bar.add_task("", total=None), 0

        def update(done: int, total: int, row: Row | None) -> None:
            nonlocal failed
            failed += bool(row and row.get("error"))
            bar.update(task, completed=done, total=total, description=f"{failed} failed" if failed else "")

        yield update


def _write_line(done: int, total: int, row: Row | None) -> None:
    if row is None or done == total or done % max(1, total // LINES) == 0:
        sys.stderr.write(f"{done} of {total} rigs done\n")
        sys.stderr.flush()
