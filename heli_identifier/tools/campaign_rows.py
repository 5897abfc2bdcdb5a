"""The rows of a campaign: what was found and, in columns that begin with ``true_``, what is true; and their figures.

A row holds plain values by column, which travel between processes and stand in a JSON file. The diagnosis never sees
the truth; rows are judged against it afterwards.

*Named first*: the strongest entry is an effect of the rig, on an axis on which it acts; an effect that acts on several
axes is true on each of them. *False*: an entry that the rig does not have; an "unknown" entry is false on every rig
without an unknown torque. *Right*: everything that the rig has is found, and nothing else. *Covered*: the 95 % interval
of a parameter or coefficient holds the true value.
"""

import io
import json
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from heli_identifier.errors import ConfigurationError
from heli_identifier.online import Estimate, ModelParameters
from heli_identifier.results import Table, plain
from heli_identifier.tools.rigs import Truth
from heli_identifier.tracing import Diagnosis, FoundEffect, NamedShape, PeriodicShape, RigVerdict
from heli_plant.effects import AXES

Row = dict[str, Any]  # values by column
Entry = tuple[str, str]  # name and axis
BASE = ModelParameters._fields  # parameters of the simplified model, by the paper's symbols
UNKNOWN = "unknown"  # name of an entry for a torque that is no effect of the catalogue

ERRORS = {f"{axis}_1s_{stage}_rad": (axis, stage) for axis in AXES for stage in ("before", "after", "noise_floor")}
"""Columns of the 1 s prediction errors [rad]: their axis, and of what."""

COLUMNS = (
    "rig", "key", "error", "verdict", "effects", "possible", "closed_loop", "held_out_nats",
    *(f"{axis}_use" for axis in AXES),
    *(column for symbol in BASE for column in (symbol, f"{symbol}_se")),
    *ERRORS, "seconds", "measures", "true_kind", "true_effects", "true_unknown",
    *(f"true_{symbol}" for symbol in BASE),
)  # fmt: skip
"""All columns; the value of one that a row lacks is None."""


def complete(row: Row) -> Row:
    """Return a row with every column."""
    return dict.fromkeys(COLUMNS) | row


def read_row(path: Path) -> Row:
    """Read a row of a campaign; ConfigurationError if the file is none."""
    try:
        return complete(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError) as error:
        raise ConfigurationError(f"{path} is not a result of a campaign: {error}; move it away.") from error


def parquet_bytes(rows: Sequence[Row]) -> bytes:
    """Return rows as a Parquet file."""
    buffer = io.BytesIO()
    pd.DataFrame(rows, columns=COLUMNS).to_parquet(buffer)
    return buffer.getvalue()


def diagnosis_columns(diagnosis: Diagnosis) -> Row:
    """Return what was found: verdict, effects, parameters after with standard errors, errors, seconds."""
    row: Row = {
        "verdict": diagnosis.verdict,
        "effects": [_effect(found) for found in diagnosis.effects],
        "possible": [
            {key: getattr(own, key) for key in ("name", "axis", "score", "in_plant")} for own in diagnosis.possible
        ],
        "closed_loop": diagnosis.closed_loop,
        "held_out_nats": diagnosis.held_out.gain.value,
        "seconds": diagnosis.seconds,
    }
    for axis, report in diagnosis.axes.items():
        row[f"{axis}_use"] = report.use
    for symbol in BASE:
        estimate = diagnosis.parameters_after[symbol]
        row[symbol], row[f"{symbol}_se"] = estimate.value, estimate.standard_error
    for column, (axis, stage) in ERRORS.items():
        row[column] = getattr(diagnosis.axes[axis], stage).prediction_1s.value
    return plain(row)


def _effect(found: FoundEffect) -> Row:
    shape, known = found.shape, found.coefficient
    return {
        **{key: getattr(found, key) for key in ("name", "axis", "score", "verdict")},
        "coefficient": known.value if known else None,
        "standard_error": known.standard_error if known else None,
        "alternatives": [" ".join(entry) for entry in found.alternatives],
        "variable": None if isinstance(shape, NamedShape) else shape.variable,
        "frequency_hz": shape.frequency_hz if isinstance(shape, PeriodicShape) else None,
    }


def truth_columns(truth: Truth | None) -> Row:
    """Return what is true; no columns where it is not known."""
    if truth is None:
        return {}
    return {
        "true_kind": truth.kind,
        "true_effects": [asdict(effect) for effect in truth.effects],
        "true_unknown": truth.unknown._asdict() if truth.unknown else None,
        **{f"true_{symbol}": truth.parameters[symbol] for symbol in BASE if symbol in truth.parameters},
    }


class Judgement(NamedTuple):
    """What of a row is true, with the words of the module's head.

    ``found`` are the entries found, unknown effects included, strongest evidence first. ``all_named`` says whether
    every effect of the rig is named, on at least one of its axes; ``recognised`` whether the verdict is an unknown
    effect, on the true axis and of the true variable. ``covered`` has every parameter and coefficient of known value.
    """

    verdict: str | None
    found: tuple[Entry, ...]
    false: tuple[Entry, ...]
    named_first: bool
    all_named: bool
    recognised: bool
    right: bool
    covered: dict[str, bool]


def judged(row: Row) -> Judgement:
    """Judge a row against the truth."""
    true = {(own["name"], own["axis"]): own["coefficient"] for own in row["true_effects"] or ()}
    effects, unknown = row["effects"] or (), row["true_unknown"]
    found = tuple((own["name"], own["axis"]) for own in effects)
    false = tuple(entry for entry in found if entry not in true and not (entry[0] == UNKNOWN and unknown))
    all_named = {name for name, _ in true} == {entry[0] for entry in found if entry in true}
    wanted = (UNKNOWN, unknown["axis"], unknown["variable"]) if unknown else None
    recognised = row["verdict"] == RigVerdict.UNKNOWN_EFFECT and wanted in [
        (own["name"], own["axis"], own["variable"]) for own in effects
    ]
    right = row["error"] is None and (recognised if unknown else all_named) and not false
    figures = [(symbol, row[symbol], row[f"{symbol}_se"], row[f"true_{symbol}"]) for symbol in BASE]
    for own, entry in zip(effects, found, strict=True):
        figures.append((" ".join(entry), own["coefficient"], own["standard_error"], true.get(entry)))
    covered = {}
    for name, value, error, truth in figures:
        if None not in (value, error, truth):
            low, high = Estimate(value, error, "").interval
            covered[name] = low <= truth <= high
    first = found[:1] != () and found[0] in true
    return Judgement(row["verdict"], found, false, first, all_named, recognised, right, covered)


COUNTED: dict[str, tuple[str, Callable[[Judgement], object]]] = {
    "shown": ("effects shown", lambda own: own.verdict == RigVerdict.EFFECTS_SHOWN),
    "adequate": ("model adequate", lambda own: own.verdict == RigVerdict.MODEL_ADEQUATE),
    "unknown": ("unknown effect", lambda own: own.verdict == RigVerdict.UNKNOWN_EFFECT),
    "named_first": ("named first", lambda own: own.named_first),
    "false": ("with a false one", lambda own: own.false),
    "recognised": ("unknown recognised", lambda own: own.recognised),
    "right": ("found as it is", lambda own: own.right),
}
"""What is counted: title, and of which rows; from the fourth on the truth has to be known."""

VERDICTS = [*COUNTED][:3]


def summarised(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the figures of rows.

    ``kinds``: in the order of their first rig, the number of diagnosed ``rigs`` of the ``kind`` (empty where the truth
    is not known), and of what is :data:`COUNTED`. ``effects``: entries "name axis" and the number of rigs on which each
    was found, most frequent first. ``failures``: rig and error text. ``covered`` of so many ``intervals`` of known true
    value hold it, and their share ``coverage``. ``seconds``: median, 95 % quantile and largest of the times of one
    diagnosis [s], or None.
    """
    done = [(row, judged(row)) for row in rows if row["error"] is None]
    held = [hit for _, own in done for hit in own.covered.values()]
    kinds = []
    for kind in dict.fromkeys(row["true_kind"] for row, _ in done):
        own = [judgement for row, judgement in done if row["true_kind"] == kind]
        counts = {
            key: sum(bool(hit(one)) for one in own) if kind or key in VERDICTS else 0
            for key, (_, hit) in COUNTED.items()
        }
        kinds.append({"kind": kind or "", "rigs": len(own), **counts})
    return {
        "kinds": kinds,
        "effects": Counter(" ".join(entry) for _, own in done for entry in own.found).most_common(),
        "failures": [(row["rig"], row["error"]) for row in rows if row["error"] is not None],
        "covered": sum(held),
        "intervals": len(held),
        "coverage": sum(held) / len(held) if held else None,
        "seconds": np.quantile([row["seconds"] for row, _ in done], (0.5, 0.95, 1.0)).tolist() if done else None,
    }


def campaign_tables(summary: dict[str, Any]) -> tuple[list[Table], list[str]]:
    """Give tables and sentences of a summary: what was found, and how much of it is true where that is known."""
    known, said, rows = any(kind["kind"] for kind in summary["kinds"]), [], []
    columns = [*COUNTED] if known else VERDICTS
    for kind in summary["kinds"]:
        shown = [str(kind[key]) if kind["kind"] or key in VERDICTS else "–" for key in columns]
        rows.append([*([kind["kind"] or "truth not known"] if known else []), str(kind["rigs"]), *shown])
    heads = [*(["kind"] if known else []), "rigs", *(COUNTED[key][0] for key in columns)]
    tables = [Table("Campaign", heads, rows)]
    if summary["effects"]:
        found = [(name, str(count)) for name, count in summary["effects"]]
        tables.append(Table("Effects found", ("effect", "rigs"), found))
    if summary["coverage"] is not None:
        share = f"{100.0 * summary['coverage']:.1f} %"
        said.append(f"{share} of {summary['intervals']} intervals of 95 % hold the true value")
    if summary["seconds"] is not None:
        times = "one diagnosis on one core: median {:.1f} s, 95 % quantile {:.1f} s, longest {:.1f} s"
        said.append(times.format(*summary["seconds"]))
    return tables, [*said, *(f"failed: {rig}: {error}" for rig, error in summary["failures"])]
