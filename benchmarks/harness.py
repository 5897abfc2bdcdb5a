"""What all benchmarks share: jobs in other processes, figures beside their bars, sections of docs/benchmarks.md.

A benchmark that judges rigs makes jobs, each of which gives rows; :func:`run_jobs` runs them and prints the ``line`` of
each row when it arrives. What is asked of the rows is a list of :class:`Bar`.
"""

import os
import platform
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from datetime import UTC, datetime
from functools import partial
from math import inf, isfinite
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import pandas
import typer
from scipy.stats import binomtest
from threadpoolctl import threadpool_limits

from heli_identifier.files import write_atomically
from heli_identifier.provenance import installed_version
from heli_identifier.results import to_digits

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "benchmarks.md"

Row = dict[str, Any]
"""What was found on a rig, a half of its logs, a flight: values by name."""

Words = Annotated[list[str], typer.Argument(default_factory=list, show_default=False)]
"""Words of a command, of which there may be none."""

STRENGTH = ["battery", "rig", "effect", "told", "shown"]
"""Columns of the table that the figure of the detection is drawn from; told: the score of a told fit [nats]."""

From = Annotated[float, typer.Option("--from")]
"""Time from which measured logs are read [s]."""


def span(words: str) -> range:
    """Give the range of "first:behind the last" or "first:behind the last:step"."""
    return range(*map(int, words.split(":")))


def apart(function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function in a new process, whose interpreter may abort when it ends: pythonfmu's library lets it."""
    os.environ["LD_LIBRARY_PATH"] = f"{sys.prefix}/lib{os.pathsep}{os.environ.get('LD_LIBRARY_PATH', '')}"
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        return pool.submit(function, *arguments).result()


def run_jobs(jobs: Iterable["partial[list[Row]]"], workers: int = 1) -> pandas.DataFrame:
    """Run jobs, with one thread of linear algebra in each process; print their lines, give their rows, in order."""
    rows: list[Row] = []
    with get_context("fork").Pool(workers, threadpool_limits, (1,)) as pool:
        for own in pool.imap(partial.__call__, jobs):
            print(*(row.pop("line") for row in own), sep="\n", flush=True)
            rows += own
    return pandas.DataFrame(rows)


def resident_memory() -> float:
    """Give the memory of this process [MB]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE") / 1e6


class Bar(NamedTuple):
    """Requirement on a figure in ``unit``, or on the share [%] of some that are true: from ``least`` to ``most``."""

    what: str
    found: float | Iterable[bool]
    most: float = inf
    unit: str = ""
    least: float = -inf


def bar_table(bars: Iterable[Bar]) -> str:
    """Give bars as a table: what, measured, asked, met; NaN does not meet its bar, and a share of none has none."""
    rows = []
    for what, found, most, unit, least in bars:
        if isinstance(found, float):
            value, said = found, f"{to_digits(found)} {unit}".strip()
        elif hits := list(found):
            value, low, high = (100.0 * end for end in share(hits))
            said, unit = f"{count(hits)}, {value:.1f} % ({low:.1f} to {high:.1f})", "%"
        else:
            continue
        ends = (("at least", least), ("at most", most))
        asked = ", ".join(f"{word} {end:g} {unit}".strip() for word, end in ends if isfinite(end))
        met = "yes" if least <= value <= most else "**no**"
        rows.append((what, said, asked, met if asked else ""))
    return table(("what", "measured", "asked", "met"), rows)


def table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Give a Markdown table; a bar in a cell is escaped."""
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(str(cell).replace('|', '&#124;') for cell in line)} |" for line in lines)


def print_frame(frame: pandas.DataFrame, csv: Path | None) -> None:
    """Print a frame as a table, its numbers with three digits, and write it to a file, if there is one, with four."""
    cells = frame.map(lambda cell: to_digits(cell) if isinstance(cell, float) else cell)
    print(table([*frame.columns], cells.to_numpy().tolist()))
    if csv:
        frame.to_csv(csv, index=False, float_format="%.4g", na_rep="nan")


def count(flags: Iterable[bool]) -> str:
    """Say how many of some are true."""
    flags = list(flags)
    return f"{sum(flags)} of {len(flags)}"


def share(hits: Sequence[bool]) -> tuple[float, float, float]:
    """Give a share and its 95 % interval (Wilson); two counts of one rig are correlated, which widens it somewhat."""
    low, high = binomtest(sum(hits), len(hits)).proportion_ci(method="wilson")
    return sum(hits) / len(hits), low, high


def section(title: str, *parts: str, packages: Sequence[str]) -> str:
    """Give a section of the page; at its foot are date, machine, load now, and the versions of some packages."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    processor = next(line.partition(": ")[2] for line in lines if line.startswith("model name"))
    foot = (
        f"{datetime.now(UTC):%Y-%m-%d}; {processor}, {os.cpu_count()} cores, {platform.system()} "
        f"{platform.machine()}, Python {platform.python_version()}; load {os.getloadavg()[0]:.1f}; "
        f"{', '.join(f'{name} {installed_version(name)}' for name in packages)}."
    )
    return "\n\n".join((f"## {title}", *parts, foot))


def write_section(name: str, text: str) -> None:
    """Put a section between its markers, or at the end of the page; the others stay as they are."""
    first, last = f"<!-- {name}:begin -->\n", f"\n<!-- {name}:end -->"
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(first)
    write_atomically(PAGE, f"{before}{first}{text}{last}{rest.partition(last)[2]}")
