"""The rows of a campaign, their table and summary.

A row holds plain values by column, which travel between processes and stand in a JSON file. The diagnosis never sees
the truth of a generated rig; rows are judged against it afterwards. An effect is called "name axis" there. One that
acts on several axes is true on each of them, and named if it is found on any. *Covered*: the 95 % interval of a
parameter or coefficient holds the true value.
"""

import io
import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from heli_identifier.errors import ConfigurationError
from heli_identifier.online import Estimate, ModelParameters
from heli_identifier.results import Table
from heli_identifier.tracing import RigVerdict

Row = dict[str, Any]
"""What :func:`.rigs.summary_of` gives of a diagnosis, or the text of an ``error``, with the key and the truth."""

KEYS = ("rig", "key", "error", "verdict", "effects", "parameters", "seconds", "truth")
"""Keys of every row; the value of one that a row lacks is None."""


def complete(row: Row) -> Row:
    """Return a row with every key."""
    return dict.fromkeys(KEYS) | row


def read_row(path: Path) -> Row:
    """Read a row of a campaign; ConfigurationError if the file is none."""
    try:
        return complete(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError) as error:
        raise ConfigurationError(f"{path} is not a result of a campaign: {error}; move it away.") from error


def parquet_bytes(rows: Sequence[Row]) -> bytes:
    """Return rows as a Parquet file, a column for every plain value: ``parameters_k_x_value`` of ``parameters``."""
    known = [{key: value for key, value in row.items() if value is not None} for row in rows]
    table, buffer = pd.json_normalize(known, sep="_"), io.BytesIO()
    table.reindex(columns=[*dict.fromkeys((*KEYS[:4], *table.columns))]).to_parquet(buffer)
    return buffer.getvalue()


class Judgement(NamedTuple):
    """What of a row is true: entries "name axis" that were ``found``, strongest evidence first, and those ``false``.

    ``all_named`` says whether every effect of the rig is named; ``covered`` has every parameter and coefficient of
    known value.
    """

    found: tuple[str, ...]
    false: tuple[str, ...]
    all_named: bool
    covered: dict[str, bool]


def judged(row: Row) -> Judgement:
    """Judge a row against the truth."""
    true = {own["name"]: own["value"] for own in row["truth"] or ()}
    effects = [(f"{own['name']} {own['axis']}", own) for own in row["effects"] or ()]
    found = tuple(entry for entry, _ in effects)
    wanted = {entry.partition(" ")[0] for entry in true if entry not in ModelParameters._fields}
    covered = {}
    for name, own in (*(row["parameters"] or {}).items(), *((entry, own["coefficient"]) for entry, own in effects)):
        if own and own["standard_error"] is not None and (truth := true.get(name)) is not None:
            low, high = Estimate(**own).interval
            covered[name] = low <= truth <= high
    named = {entry.partition(" ")[0] for entry in found if entry in true}
    return Judgement(found, tuple(entry for entry in found if entry not in true), named == wanted, covered)


def summarised(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the figures of rows.

    ``rigs`` that were diagnosed, and by verdict; of those whose truth is ``known``, how many have all effects
    ``named``, and how many have a ``false`` one. ``effects``: entries "name axis" and the number of rigs on which each
    was found, most frequent first. ``failures``: rig and error text. ``covered`` of so many ``intervals`` of known true
    value hold it, and their share ``coverage``. ``seconds``: median, 95 % quantile and largest of the times of one
    diagnosis [s], or None.
    """
    done = [(row, judged(row)) for row in rows if row["error"] is None]
    known, verdicts = [own for row, own in done if row["truth"] is not None], Counter(row["verdict"] for row, _ in done)
    held = [hit for own in known for hit in own.covered.values()]
    return {
        "rigs": len(done),
        "verdicts": {str(verdict): verdicts[verdict] for verdict in RigVerdict},
        "known": len(known),
        "named": sum(own.all_named for own in known),
        "false": sum(bool(own.false) for own in known),
        "effects": Counter(entry for _, own in done for entry in own.found).most_common(),
        "failures": [(row["rig"], row["error"]) for row in rows if row["error"] is not None],
        "covered": sum(held),
        "intervals": len(held),
        "coverage": sum(held) / len(held) if held else None,
        "seconds": np.quantile([row["seconds"] for row, _ in done], (0.5, 0.95, 1.0)).tolist() if done else None,
    }


def campaign_tables(summary: dict[str, Any]) -> tuple[list[Table], list[str]]:
    """Give tables and sentences of a summary: what was found, and how much of it is true where that is known."""
    counts, said = {"rigs": summary["rigs"], **summary["verdicts"]}, []
    tables = [Table("Campaign", [*counts], [[str(count) for count in counts.values()]])]
    if summary["effects"]:
        found = [(name, str(count)) for name, count in summary["effects"]]
        tables.append(Table("Effects found", ("effect", "rigs"), found))
    if known := summary["known"]:
        truths = f"of {known} rigs whose truth is known {summary['named']} have all effects named"
        said.append(f"{truths}, {summary['false']} have a false one")
    if summary["coverage"] is not None:
        share = f"{100.0 * summary['coverage']:.1f} %"
        said.append(f"{share} of {summary['intervals']} intervals of 95 % hold the true value")
    if summary["seconds"] is not None:
        times = "one diagnosis on one core: median {:.1f} s, 95 % quantile {:.1f} s, longest {:.1f} s"
        said.append(times.format(*summary["seconds"]))
    return tables, [*said, *(f"failed: {rig}: {error}" for rig, error in summary["failures"])]
