"""What all benchmarks share: jobs in other processes, tables of figures and bars, sections of docs/benchmarks.md.

A benchmark that judges rigs makes jobs, each of which returns rows; :func:`run_jobs` runs them and prints the ``line``
of each row when it arrives. The requirements on the rows are a list of :class:`Bar`.
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
"""Results of a rig, of a half of its logs, or of a flight: values by name."""

Words = Annotated[list[str], typer.Argument(default_factory=list, show_default=False)]
"""Arguments of a command, any number of words."""

STRENGTH = ["battery", "rig", "effect", "told", "shown"]
"""Columns of the table from which the figure of the detection is drawn; told: the score of a told fit [nats]."""

StartTime = Annotated[float, typer.Option("--from")]
"""Time from which measured logs are read [s]."""


def parse_range(words: str) -> range:
    """Return the range "start:stop" or "start:stop:step"."""
    return range(*map(int, words.split(":")))


def call_in_process(function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function in a new process, because pythonfmu's library may abort the interpreter when it ends."""
    os.environ["LD_LIBRARY_PATH"] = f"{sys.prefix}/lib{os.pathsep}{os.environ.get('LD_LIBRARY_PATH', '')}"
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        return pool.submit(function, *arguments).result()


def run_jobs(jobs: Iterable["partial[list[Row]]"], workers: int = 1) -> pandas.DataFrame:
    """Run jobs, with one thread of linear algebra in each process; print their lines, return their rows, in order."""
    rows: list[Row] = []
    with get_context("fork").Pool(workers, threadpool_limits, (1,)) as pool:
        for rows_of_job in pool.imap(partial.__call__, jobs):
            print(*(row.pop("line") for row in rows_of_job), sep="\n", flush=True)
            rows += rows_of_job
    return pandas.DataFrame(rows)


def resident_memory() -> float:
    """Return the memory of this process [MB]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE") / 1e6


class Bar(NamedTuple):
    """Requirement on a figure in ``unit``, or on the share of true flags [%]: from ``least`` to ``most``."""

    name: str
    figure: float | Iterable[bool]
    most: float = inf
    unit: str = ""
    least: float = -inf


def bar_table(bars: Iterable[Bar]) -> str:
    """Return bars as a Markdown table; NaN does not meet its bar, and a bar on no flags is left out."""
    rows = []
    for name, figure, most, unit, least in bars:
        if isinstance(figure, float):
            value, measured = figure, f"{to_digits(figure)} {unit}".strip()
        elif flags := list(figure):
            value, low, high = (100.0 * end for end in share(flags))
            measured, unit = f"{count(flags)}, {value:.1f} % ({low:.1f} to {high:.1f})", "%"
        else:
            continue
        bounds = (("at least", least), ("at most", most))
        required = ", ".join(f"{word} {bound:g} {unit}".strip() for word, bound in bounds if isfinite(bound))
        met = "yes" if least <= value <= most else "**no**"
        rows.append((name, measured, required, met if required else ""))
    return table(("what", "measured", "asked", "met"), rows)


def table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Return a Markdown table; the character | in a cell is escaped."""
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(str(cell).replace('|', '&#124;') for cell in line)} |" for line in lines)


def print_frame(frame: pandas.DataFrame, csv: Path | None) -> None:
    """Print a frame as a table, numbers with three digits, and write it with four digits to a file, if one is given."""
    cells = frame.map(lambda cell: to_digits(cell) if isinstance(cell, float) else cell)
    print(table([*frame.columns], cells.to_numpy().tolist()))
    if csv:
        frame.to_csv(csv, index=False, float_format="%.4g", na_rep="nan")


def count(flags: Iterable[bool]) -> str:
    """Return how many flags are true, as "3 of 5"."""
    flags = list(flags)
    return f"{sum(flags)} of {len(flags)}"


def share(flags: Sequence[bool]) -> tuple[float, float, float]:
    """Return the share of true flags and its 95 % interval (Wilson), which is too short for correlated flags."""
    low, high = binomtest(sum(flags), len(flags)).proportion_ci(method="wilson")
    return sum(flags) / len(flags), low, high


def section(title: str, *parts: str, packages: Sequence[str]) -> str:
    """Return a section of the page; its foot has date, machine, present load, and the versions of some packages."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    processor = next(line.partition(": ")[2] for line in lines if line.startswith("model name"))
    foot = (
        f"{datetime.now(UTC):%Y-%m-%d}; {processor}, {os.cpu_count()} cores, {platform.system()} "
        f"{platform.machine()}, Python {platform.python_version()}; load {os.getloadavg()[0]:.1f}; "
        f"{', '.join(f'{name} {installed_version(name)}' for name in packages)}."
    )
    return "\n\n".join((f"## {title}", *parts, foot))


def write_section(name: str, text: str) -> None:
    """Put a section between its markers, or at the end of the page; other sections do not change."""
    begin, end = f"<!-- {name}:begin -->\n", f"\n<!-- {name}:end -->"
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(begin)
    write_atomically(PAGE, f"{before}{begin}{text}{end}{rest.partition(end)[2]}")
