"""Run the blind battery as a campaign: diagnose every rig, compare with its truth, write the figures.

Usage: python -m benchmarks.blind [--groups single,weak] [--limit RIGS] [--workers N]. It continues where it stopped.
After a change to the code of a diagnosis, to the generator or to the measures, all results are computed again. The
figures go into the section of docs/results.md, and one row per rig into benchmarks/results/blind.parquet.
"""

import argparse
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.blind_page import misses, section
from benchmarks.blind_rigs import GROUPS, sources
from benchmarks.page import write_section
from heli_identifier.cli.on_logs import rigs_done
from heli_identifier.errors import IdentifierError
from heli_identifier.tools.campaign import run_campaign
from heli_identifier.tools.campaign_rows import Row, write_rows

ROOT = Path(__file__).resolve().parent.parent


def main(arguments: Sequence[str]) -> None:
    asked = _parsed(arguments)
    rigs = sources(asked.groups, asked.limit)
    with rigs_done() as progress:
        rows = run_campaign(
            [source for _, source in rigs.values()],
            asked.output,
            measure="benchmarks.blind_measures:measured",
            scheduler=asked.scheduler,
            workers=asked.workers,
            progress=progress,
        )
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(rigs[row["rig"]][0].group, []).append(row)
    for line in misses(groups):
        print(line)
    command = shlex.join(["python", "-m", "benchmarks.blind", *arguments])
    asked.table.parent.mkdir(parents=True, exist_ok=True)
    write_rows(rows, asked.table)
    write_section(asked.page, "blind", section(groups, {name: case for name, (case, _) in rigs.items()}, command))
    print(f"{len(rows)} rigs; figures in {asked.page}, rows in {asked.table}", file=sys.stderr)


def _parsed(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.blind", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--groups", type=_groups, default=GROUPS, help=f"of {', '.join(GROUPS)}, separated by commas")
    parser.add_argument(
        "--limit",
        type=_limits,
        help="most rigs of each case, for all groups (5) or by group (clean=40,single=4); all if not given",
    )
    parser.add_argument("--workers", type=_positive, help="processes on this machine; one per core if not given")
    parser.add_argument("--scheduler", help="address of a Dask scheduler in place of processes on this machine")
    parser.add_argument("--output", type=Path, default=ROOT / "build/blind", help="folder of the single results")
    parser.add_argument("--page", type=Path, default=ROOT / "docs/results.md", help="page that gets the section")
    parser.add_argument(
        "--table", type=Path, default=ROOT / "benchmarks" / "results" / "blind.parquet", help="all rows"
    )
    return parser.parse_args(arguments)


def _groups(text: str) -> tuple[str, ...]:
    strange = set(text.split(",")) - set(GROUPS)
    if strange:
        raise argparse.ArgumentTypeError(f"{', '.join(sorted(strange))} is no group; choose from {', '.join(GROUPS)}")
    return tuple(text.split(","))


def _limits(text: str) -> dict[str, int]:
    if "=" not in text:
        return dict.fromkeys(GROUPS, _positive(text))
    pairs = (item.partition("=") for item in text.split(","))
    return {_groups(group)[0]: _positive(count) for group, _, count in pairs}


def _positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text} must be a whole number of at least 1")
    return int(text)


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except IdentifierError as error:
        sys.exit(str(error))
