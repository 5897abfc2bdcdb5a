"""What all benchmarks share: work in other processes, tables with bars, sections of docs/benchmarks.md."""

import os
import platform
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from datetime import UTC, datetime
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import pandas
import typer
from scipy.stats import binomtest
from threadpoolctl import threadpool_limits

from heli_identifier.files import write_atomically
from heli_identifier.provenance import installed
from heli_identifier.results import significant

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "benchmarks.md"

Words = Annotated[list[str], typer.Argument(default_factory=list, show_default=False)]
"""Words of a command, of which there may be none."""


def span(words: str) -> range:
    """Give the range of "first:behind the last" or "first:behind the last:step"."""
    return range(*map(int, words.split(":")))


# --- processes ---------------------------------------------------------------------------------------------------


def apart(function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function in a new process, whose interpreter may abort when it ends: pythonfmu's library lets it."""
    os.environ["LD_LIBRARY_PATH"] = f"{sys.prefix}/lib{os.pathsep}{os.environ.get('LD_LIBRARY_PATH', '')}"
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        return pool.submit(function, *arguments).result()


def in_parallel(function: Callable[[Any], Any], jobs: Iterable[Any], workers: int) -> Iterator[Any]:
    """Give the results in the order of the jobs, with one thread of linear algebra in each process."""
    with get_context("fork").Pool(workers, threadpool_limits, (1,)) as pool:
        yield from pool.imap(function, jobs)


def resident_memory() -> float:
    """Give the memory of this process [MB]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE") / 1e6


# --- tables ------------------------------------------------------------------------------------------------------


class Bar(NamedTuple):
    """Requirement on a figure: ``value`` at most, or at least, ``bound``, both in ``unit``."""

    what: str
    value: float
    bound: float
    unit: str
    at_least: bool = False


def bar_table(bars: Iterable[Bar]) -> str:
    """Give bars as a table: what, measured, asked, met; NaN does not meet its bar."""
    rows = []
    for what, value, bound, unit, at_least in bars:
        met = value >= bound if at_least else value <= bound
        asked = f"{'at least' if at_least else 'at most'} {bound:g} {unit}".strip()
        rows.append((what, f"{significant(value)} {unit}".strip(), asked, "yes" if met else "**no**"))
    return table(("what", "measured", "asked", "met"), rows)


def table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Give a Markdown table; a bar in a cell is escaped."""
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(str(cell).replace('|', '&#124;') for cell in line)} |" for line in lines)


def print_frame(frame: pandas.DataFrame, csv: Path | None = None) -> None:
    """Print a frame as a Markdown table, with three digits, and write it to a file, with four."""
    cells = frame.map(lambda cell: significant(cell) if isinstance(cell, float) else cell)
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


def write_strength(rows: Iterable[tuple[str, str, str, float, bool]], path: Path) -> None:
    """Write the table that the figure of the detection is drawn from: battery, rig, effect, told, shown.

    ``told``: the score [nats] of a fit that is told the structure; an effect without one is left out.
    """
    frame = pandas.DataFrame(rows, columns=["battery", "rig", "effect", "told", "shown"]).dropna()
    frame.astype({"shown": int}).to_csv(path, index=False, float_format="%.4g")


# --- page --------------------------------------------------------------------------------------------------------


def section(title: str, *parts: str, packages: Sequence[str] = ()) -> str:
    """Give a section of the page, with the versions of some packages at its foot."""
    return "\n\n".join((f"## {title}", *parts, measured_at(*packages)))


def measured_at(*packages: str) -> str:
    """Give the line at the foot of a section: date, machine, load now, packages."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    processor = next(line.partition(": ")[2] for line in lines if line.startswith("model name"))
    return (
        f"{datetime.now(UTC):%Y-%m-%d}; {processor}, {os.cpu_count()} cores, {platform.system()} "
        f"{platform.machine()}, Python {platform.python_version()}; load {os.getloadavg()[0]:.1f}; "
        f"{', '.join(f'{name} {installed(name)}' for name in packages)}."
    )


def write_section(name: str, text: str) -> None:
    """Put a section between its markers, or at the end of the page; the others stay as they are."""
    first, last = f"<!-- {name}:begin -->\n", f"\n<!-- {name}:end -->"
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(first)
    write_atomically(PAGE, f"{before}{first}{text}{last}{rest.partition(last)[2]}")
