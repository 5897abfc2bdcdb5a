"""What all benchmarks share: their options, work in other processes, tables with bars, sections of a page."""

import json
import os
import platform
import subprocess
import sys
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from multiprocessing import Pool
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from heli_identifier.files import write_atomically
from heli_identifier.provenance import installed
from heli_identifier.results import significant

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "benchmarks.md"
FIGURES = ROOT / "docs" / "figures"


def options(
    arguments: Sequence[str], benchmark: str, doc: str | None, rest: str = "", **known: tuple[Any, str]
) -> Namespace:
    """Read the options of a benchmark, and words for the ``rest``.

    Each option has its default, or for none its type, and what it means. One that is False is a flag; ``from_`` is
    ``--from``.
    """
    program = f"python -m benchmarks {benchmark}"
    parser = ArgumentParser(program, description=doc, formatter_class=RawDescriptionHelpFormatter)
    for name, (default, meaning) in known.items():
        option = f"--{name.rstrip('_')}"
        if default is False:
            parser.add_argument(option, dest=name, action="store_true", help=meaning)
        elif isinstance(default, type):
            parser.add_argument(option, dest=name, type=default, help=meaning)
        else:
            parser.add_argument(option, dest=name, type=type(default), default=default, help=f"{meaning}; {default}")
    if rest:
        parser.add_argument(rest, nargs="*", metavar=rest.upper())
    return parser.parse_args(arguments)


def span(words: str) -> range:
    """Give the range of "first:behind the last" or "first:behind the last:step"."""
    return range(*map(int, words.split(":")))


# --- processes ---------------------------------------------------------------------------------------------------

_CHILD = """
import json, os, sys
from importlib import import_module
module, function, arguments = sys.argv[1], sys.argv[2], json.loads(sys.argv[3])
print("\\n" + json.dumps(getattr(import_module(module), function)(*arguments)), flush=True)
os._exit(0)  # pythonfmu's library may abort while the interpreter ends
"""


def apart(function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function of a module in a process of its own; arguments and result pass as JSON.

    Raises
    ------
    RuntimeError
        If it fails.
    """
    libraries = os.pathsep.join([str(Path(sys.prefix) / "lib"), os.environ.get("LD_LIBRARY_PATH", "")])
    command = [sys.executable, "-c", _CHILD, function.__module__, function.__name__, json.dumps(arguments)]
    told = {**os.environ, "PYTHONPATH": str(ROOT), "LD_LIBRARY_PATH": libraries}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=told)
    if done.returncode:
        raise RuntimeError(f"{function.__name__}{arguments} failed: {done.stdout[-500:]}{done.stderr[-1500:]}")
    return json.loads(done.stdout.splitlines()[-1])


def resident_memory() -> float:
    """Give the memory of this process [MB]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE") / 1e6


def in_parallel(function: Callable[[Any], Any], jobs: Iterable[Any], workers: int) -> Iterator[Any]:
    """Give the results in the order of the jobs, with one thread of linear algebra in each process."""
    with threadpool_limits(1):
        if workers == 1:
            yield from map(function, jobs)
        else:
            with Pool(workers, threadpool_limits, (1,)) as pool:
                yield from pool.imap(function, jobs)


# --- figures, tables and bars ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Bar:
    """Requirement on a figure: ``value`` at most, or at least, ``bound``, both in ``unit``."""

    what: str
    value: float
    bound: float
    unit: str
    at_least: bool = False

    @property
    def met(self) -> bool:
        """Whether the figure meets its bar; NaN does not."""
        return self.value >= self.bound if self.at_least else self.value <= self.bound


def bar_table(bars: Iterable[Bar]) -> str:
    """Give bars as a table: what, measured, asked, met."""
    rows = [
        (
            bar.what,
            f"{significant(bar.value)} {bar.unit}".strip(),
            f"{'at least' if bar.at_least else 'at most'} {bar.bound:g} {bar.unit}".strip(),
            "yes" if bar.met else "**no**",
        )
        for bar in bars
    ]
    return table(("what", "measured", "asked", "met"), rows)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Give a Markdown table; a bar in a cell is escaped. A row of another length than the head is a ValueError."""
    lines = [tuple(head), ("---",) * len(head)]
    for row in rows:
        if len(row) != len(head):
            raise ValueError(f"row {tuple(row)} has {len(row)} cells, the head {len(head)}.")
        lines.append(tuple(row))
    return "\n".join(f"| {' | '.join(cell.replace('|', '&#124;') for cell in line)} |" for line in lines)


def seconds(value: float) -> str:
    """Give a time in the unit that suits it."""
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if value >= size:
            return f"{significant(value / size)} {unit}"
    return f"{significant(value / 1e-6)} us"


# --- page --------------------------------------------------------------------------------------------------------


def section(title: str, *parts: str, packages: Sequence[str] = ()) -> str:
    """Give a section of the page, with the versions of some packages at its foot."""
    return "\n\n".join((f"## {title}", *parts, measured_at(*packages)))


def measured_at(*packages: str) -> str:
    """Give the line at the foot of a section: date, machine, load now, packages."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    return (
        f"{datetime.now(UTC):%Y-%m-%d}; {_processor()}, {os.cpu_count()} cores, {platform.system()} "
        f"{platform.machine()}, Python {platform.python_version()}; load {load:.1f}; "
        f"{', '.join(f'{name} {installed(name)}' for name in packages)}."
    )


def _processor() -> str:
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.exists() else []
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.processor() or platform.machine())


def write_section(page: Path, name: str, section: str) -> None:
    """Put a section between its markers, or at the end of the page; the others stay as they are."""
    text = page.read_text(encoding="utf-8") if page.exists() else "# Results\n"
    first, last = f"<!-- {name}:begin -->", f"<!-- {name}:end -->"
    before, begin, rest = text.partition(first)
    _, end, after = rest.partition(last)
    own = f"{first}\n{section.strip()}\n{last}"
    write_atomically(page, f"{before}{own}{after}" if begin and end else f"{text.rstrip()}\n\n{own}\n")
