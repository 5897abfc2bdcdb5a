"""A campaign's progress on the error stream: a bar on a terminal, a line every now and then elsewhere."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from heli_identifier.workbench.campaign.row import Row
from heli_identifier.workbench.campaign.run import Progress as Tell

LINES = 20
"""Lines that a whole campaign writes into a file."""


@contextmanager
def progress_bar() -> Iterator[Tell]:
    """Give what :func:`heli_identifier.workbench.campaign.run.run_campaign` tells its progress to."""
    if not sys.stderr.isatty():
        yield _told_in_lines
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

        def tell(done: int, total: int, row: Row | None) -> None:
            nonlocal failed
            failed += bool(row and row.get("error"))
            bar.update(task, completed=done, total=total, description=f"{failed} failed" if failed else "")

        yield tell


def _told_in_lines(done: int, total: int, row: Row | None) -> None:
    if row is None or done == total or done % max(1, total // LINES) == 0:
        sys.stderr.write(f"{done} of {total} rigs done\n")
        sys.stderr.flush()
