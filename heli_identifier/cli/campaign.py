"""``heli campaign``: many rigs diagnosed, on all cores of this machine or on a cluster of machines."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from heli_identifier.cli.options import Config, Json

if TYPE_CHECKING:
    from heli_identifier.tools import Progress, Row, Source, Summary

LINES = 20
"""Number of lines that a whole campaign writes on its progress where there is no terminal."""

FAILED = 1
"""Exit code where a rig could not be diagnosed."""


def campaign(
    folder: Annotated[
        Path | None,
        typer.Argument(
            metavar="FOLDER",
            help="Folder with a sub-folder for each rig, with its logs, CSV or MATLAB, as for `heli fleet`.",
            show_default=False,
        ),
    ] = None,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="DIR", help="Folder of the results; it is continued if it has any."),
    ] = Path("campaign"),
    generator: Annotated[
        str,
        typer.Option(
            metavar="MODULE:FUNCTION",
            help="Function that makes a heli_identifier.tools.Rig of a seed, in place of FOLDER.",
            show_default=False,
        ),
    ] = "",
    rigs: Annotated[
        int | None, typer.Option(metavar="N", help="Rigs that the generator makes.", show_default=False)
    ] = None,
    first_seed: Annotated[
        int | None, typer.Option(metavar="SEED", help="Seed of the first of them; 0 by default.", show_default=False)
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(metavar="N", help="Processes on this machine; one per core by default.", show_default=False),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Dask scheduler of a cluster of machines, tcp://host:8786.", show_default=False
        ),
    ] = None,
    config: Config = None,
    json: Json = False,
) -> None:
    """Diagnose many rigs; started again, it continues where it stopped.

    Writes campaign.parquet, one row per rig, and beside it the single rows. Exit 1 if a rig could not be diagnosed.
    """
    from heli_identifier.cli.logs import found_configuration
    from heli_identifier.cli.terminal import note, print_json
    from heli_identifier.tracing import DiagnosisSettings

    configuration = found_configuration(config)
    sources = _sources(folder, config, generator, rigs, first_seed)
    # These take a second or two to import: the words of the command are checked before.
    from heli_identifier.tools import CONSOLIDATED, run_campaign, summarised

    settings = DiagnosisSettings.from_rig(configuration)
    with rigs_done() as progress:
        rows = run_campaign(sources, output, settings, scheduler=scheduler, workers=workers, progress=progress)
    summary = summarised(rows)
    if json:
        print_json(asdict(summary) | {"coverage": summary.coverage})
    else:
        print_summary(summary)
        note(f"written: {output / CONSOLIDATED}")
    if summary.failures:
        raise typer.Exit(FAILED)


@contextmanager
def rigs_done() -> "Iterator[Progress]":
    """Show how many rigs are done on the error stream: a bar on a terminal, some twenty lines elsewhere."""
    from heli_identifier.cli.terminal import progress_bar

    failed = 0
    with progress_bar() as bar:

        def show(done: int, total: int, row: "Row | None") -> None:
            nonlocal failed
            failed += bool(row and row.get("error"))
            bar(f"{done} of {total} rigs done" + (f", {failed} failed" if failed else ""), done / total)
            if not sys.stderr.isatty() and (row is None or done == total or done % max(1, total // LINES) == 0):
                typer.echo(f"{done} of {total} rigs done", err=True)

        yield show


def _sources(
    folder: Path | None, config: Path | None, generator: str, rigs: int | None, first_seed: int | None
) -> "list[Source]":
    """Give the rigs of a folder or of a generator, whichever was named."""
    from heli_identifier.cli.logs import shared_configuration
    from heli_identifier.errors import ConfigurationError
    from heli_identifier.tools import generated_rigs, rigs_below

    if (folder is None) == (generator == ""):
        raise ConfigurationError("name either a folder of rigs or a --generator.")
    if folder is not None:
        if rigs is not None:
            raise ConfigurationError(f"--rigs {rigs} is for a --generator; all rigs of a folder are diagnosed.")
        if first_seed is not None:
            raise ConfigurationError(f"--first-seed {first_seed} is for a --generator; the rigs of a folder have none.")
        return [*rigs_below(folder, shared_configuration(config))]
    if rigs is None:
        raise ConfigurationError("--rigs is missing: the number of rigs that the generator makes.")
    # The generator is looked for in this folder as well, as `python -m` does; workers here inherit that.
    sys.path.insert(0, os.getcwd())
    return [*generated_rigs(generator, rigs, first_seed or 0)]


def print_summary(summary: "Summary") -> None:
    """Print what was found and how much of it is true where that is known, coverage, times and failures."""
    from heli_identifier.cli.terminal import counted, print_table

    known = any(kind.kind for kind in summary.kinds)
    columns = ["rigs >", "effects shown >", "model adequate >", "unknown effect >"]
    judged = ["named first >", "with a false one >", "unknown recognised >", "found as it is >"]
    print_table(
        "Campaign",
        ["kind", *columns, *judged] if known else columns,
        [
            (
                *([kind.kind or "truth not known"] if known else []),
                *(str(count) for count in (kind.rigs, kind.shown, kind.adequate, kind.unknown)),
                *(
                    str(count) if kind.kind else ""
                    for count in ((kind.named_first, kind.false, kind.recognised, kind.right) if known else ())
                ),
            )
            for kind in summary.kinds
        ],
    )
    if summary.effects:
        print_table("Effects found", ("effect", "rigs >"), [(name, str(count)) for name, count in summary.effects])
    if summary.coverage is not None:
        share, count = 100.0 * summary.coverage, counted(summary.intervals, "interval")
        typer.echo(f"{share:.1f} % of {count} of 95 % hold the true value")
    if summary.seconds is not None:
        median, high, most = summary.seconds
        typer.echo(
            f"one diagnosis on one core: median {median:.1f} s, 95 % quantile {high:.1f} s, longest {most:.1f} s"
        )
    for rig, error in summary.failures:
        typer.echo(f"failed: {rig}: {error}")
