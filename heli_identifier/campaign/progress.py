"""A campaign's progress on a terminal: a bar with what is done, what failed and when it will end."""

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from heli_identifier.campaign.row import Row
from heli_identifier.campaign.run import Progress as Tell


@contextmanager
def progress_bar(console: Console) -> Iterator[Tell]:
    """Give what :func:`heli_identifier.campaign.run.run_campaign` tells its progress to."""
    failed = 0
    with Progress(
        TextColumn("diagnosing"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.description}"),
        TimeElapsedColumn(), TimeRemainingColumn(), console=console,
    ) as bar:  # fmt: skip
        task = bar.add_task("", total=None)

        def tell(done: int, total: int, row: Row | None) -> None:
            nonlocal failed
            failed += bool(row and row.get("error"))
            bar.update(task, completed=done, total=total, description=f"{failed} failed" if failed else "")

        yield tell
