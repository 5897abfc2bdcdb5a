"""The rows of a campaign: what was found and, in columns that begin with ``true_``, what is true; and their figures.

A row holds plain values by column, which travel between processes and fit a line of a Parquet table. The diagnosis
never sees the truth; rows are judged against it afterwards.

*Named first*: the strongest entry is an effect of the rig, on an axis on which it acts; an effect that acts on several
axes is true on each of them. *False*: an entry that the rig does not have; an "unknown" entry is false on every rig
without an unknown torque. *Right*: everything that the rig has is found, and nothing else. *Covered*: the 95 % interval
of a parameter or coefficient holds the true value.
"""

import io
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from heli_identifier.errors import ConfigurationError
from heli_identifier.files import write_atomically
from heli_identifier.online import Estimate, ModelParameters
from heli_identifier.results import Table
from heli_identifier.tools.rigs import Truth
from heli_identifier.tracing import Diagnosis, FoundEffect, NamedShape, PeriodicShape, RigVerdict
from heli_plant.effects import AXES

Row = dict[str, Any]
"""Values by column; a missing column is null."""

Entry = tuple[str, str]
"""Name and axis."""

BASE = ModelParameters._fields
"""Parameters of the simplified model, by the paper's symbols."""

UNKNOWN = "unknown"
"""Name of an entry for a torque that is no effect of the catalogue."""

ERRORS = {
    f"{axis}_1s_{stage}_rad": (axis, stage) for axis in AXES for stage in ("before", "after", "noise_floor")
}
"""Columns of the 1 s prediction errors [rad]: their axis, and of what."""

_TEXT, _NUMBER = pa.string(), pa.float64()
_EFFECT = {
    "name": _TEXT, "axis": _TEXT, "coefficient": _NUMBER, "standard_error": _NUMBER, "score": _NUMBER,
    "verdict": _TEXT, "alternatives": pa.list_(_TEXT), "variable": _TEXT, "frequency_hz": _NUMBER,
}  # fmt: skip
_POSSIBLE = {"name": _TEXT, "axis": _TEXT, "score": _NUMBER, "in_plant": pa.bool_()}
_TRUE_EFFECT = {"name": _TEXT, "axis": _TEXT, "coefficient": _NUMBER}
COLUMNS = {
    "rig": _TEXT,
    "key": _TEXT,
    "error": _TEXT,
    "verdict": _TEXT,
    "effects": pa.list_(pa.struct(list(_EFFECT.items()))),
    "possible": pa.list_(pa.struct(list(_POSSIBLE.items()))),
    "closed_loop": pa.bool_(),
    "held_out_nats": _NUMBER,
    **{f"{axis}_use": _TEXT for axis in AXES},
    **{column: _NUMBER for symbol in BASE for column in (symbol, f"{symbol}_se")},
    **dict.fromkeys(ERRORS, _NUMBER),
    "seconds": _NUMBER,
    "measures": pa.map_(_TEXT, _NUMBER),
    "true_kind": _TEXT,
    "true_effects": pa.list_(pa.struct(list(_TRUE_EFFECT.items()))),
    "true_unknown": pa.struct([("axis", _TEXT), ("variable", _TEXT)]),
    **{f"true_{symbol}": _NUMBER for symbol in BASE},
}
SCHEMA = pa.schema(list(COLUMNS.items()))
"""Columns and their types."""


def complete(row: Row) -> Row:
    """Return a row with every column, None in those that it lacks."""
    return dict.fromkeys(COLUMNS) | row


def read_rows(path: Path) -> list[Row]:
    """Read rows as :func:`write_rows` wrote them.

    Raises
    ------
    ConfigurationError
        The file is not a result of a campaign.
    """
    try:
        return pq.read_table(path, schema=SCHEMA).to_pylist(maps_as_pydicts="strict")
    except (pa.ArrowException, OSError) as error:
        raise ConfigurationError(f"{path} is not a result of a campaign: {error}; move it away.") from error


def write_rows(rows: Sequence[Row], path: Path) -> Path:
    """Write rows as a Parquet file, so that no reader ever sees half of it.

    Raises
    ------
    ConfigurationError
        The folder cannot be written to.
    """
    buffer, table = io.BytesIO(), pa.Table.from_pylist([complete(row) for row in rows], schema=SCHEMA)
    pq.write_table(table, buffer, compression="zstd")
    try:
        return write_atomically(path, buffer.getvalue())
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be written: {error}.") from error


def diagnosis_columns(diagnosis: Diagnosis) -> Row:
    """Return what was found: verdict, effects, parameters after with standard errors, errors, seconds."""
    row: Row = {
        "verdict": diagnosis.verdict.value,
        "effects": [_effect(found) for found in diagnosis.effects],
        "possible": [{name: getattr(found, name) for name in _POSSIBLE} for found in diagnosis.possible],
        "closed_loop": diagnosis.closed_loop,
        "held_out_nats": diagnosis.held_out.gain.value,
        "seconds": diagnosis.seconds,
        **{f"{axis}_use": diagnosis.axes[axis].use.value for axis in AXES},
    }
    for symbol in BASE:
        estimate = diagnosis.parameters_after[symbol]
        row[symbol], row[f"{symbol}_se"] = estimate.value, estimate.standard_error
    for column, (axis, stage) in ERRORS.items():
        row[column] = getattr(diagnosis.axes[axis], stage).prediction_1s.value
    return row


def _effect(found: FoundEffect) -> Row:
    coefficient = found.coefficient
    return {
        "name": found.name,
        "axis": found.axis,
        "coefficient": coefficient.value if coefficient else None,
        "standard_error": coefficient.standard_error if coefficient else None,
        "score": found.score,
        "verdict": found.verdict.value,
        "alternatives": [f"{name} {axis}" for name, axis in found.alternatives],
        "variable": None if isinstance(found.shape, NamedShape) else found.shape.variable,
        "frequency_hz": found.shape.frequency_hz if isinstance(found.shape, PeriodicShape) else None,
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


# --- rows judged against the truth -------------------------------------------------------------------------------


def true_entries(row: Row) -> set[Entry]:
    """Return the effects that the rig has."""
    return {(effect["name"], effect["axis"]) for effect in row["true_effects"] or ()}


def found_entries(row: Row) -> list[Entry]:
    """Return the entries found, unknown effects included, strongest evidence first."""
    return [(effect["name"], effect["axis"]) for effect in row["effects"] or ()]


def named_first(row: Row) -> bool:
    """Whether the strongest entry is true."""
    found = found_entries(row)
    return bool(found) and found[0] in true_entries(row)


def all_named(row: Row) -> bool:
    """Whether every effect of the rig is named, on at least one of its axes."""
    true = true_entries(row)
    return {name for name, _ in true} == {name for name, axis in found_entries(row) if (name, axis) in true}


def false_entries(row: Row) -> list[Entry]:
    """Return the found entries that the rig does not have."""
    true, holds_unknown = true_entries(row), row["true_unknown"] is not None
    return [entry for entry in found_entries(row) if entry not in true and not (entry[0] == UNKNOWN and holds_unknown)]


def unknown_recognised(row: Row) -> bool:
    """Whether the verdict is an unknown effect, on the true axis and of the true variable."""
    true = row["true_unknown"]
    if true is None or row["verdict"] != RigVerdict.UNKNOWN_EFFECT:
        return False
    wanted = (UNKNOWN, true["axis"], true["variable"])
    return any((found["name"], found["axis"], found["variable"]) == wanted for found in row["effects"])


def right(row: Row) -> bool:
    """Whether everything that the rig has is found, and nothing else."""
    if row["error"] is not None:
        return False
    found = all_named(row) if row["true_unknown"] is None else unknown_recognised(row)
    return found and not false_entries(row)


def coverage(row: Row) -> dict[str, bool]:
    """Return for every parameter and coefficient of known true value whether its 95 % interval holds that value."""
    figures = {symbol: (row[symbol], row[f"{symbol}_se"], row[f"true_{symbol}"]) for symbol in BASE}
    strengths = {(effect["name"], effect["axis"]): effect["coefficient"] for effect in row["true_effects"] or ()}
    for found in row["effects"] or ():
        true = strengths.get((found["name"], found["axis"]))
        figures[f"{found['name']} {found['axis']}"] = found["coefficient"], found["standard_error"], true
    held = {}
    for name, (value, error, true) in figures.items():
        if None not in (value, error, true):
            low, high = Estimate(value, error, "").interval
            held[name] = low <= true <= high
    return held


COUNTED: tuple[tuple[str, str, bool, Callable[[Row], object]], ...] = (
    ("shown", "effects shown", False, lambda row: row["verdict"] == RigVerdict.EFFECTS_SHOWN),
    ("adequate", "model adequate", False, lambda row: row["verdict"] == RigVerdict.MODEL_ADEQUATE),
    ("unknown", "unknown effect", False, lambda row: row["verdict"] == RigVerdict.UNKNOWN_EFFECT),
    ("named_first", "named first", True, named_first),
    ("false", "with a false one", True, false_entries),
    ("recognised", "unknown recognised", True, unknown_recognised),
    ("right", "found as it is", True, right),
)
"""What is counted: key, title, whether the truth has to be known, and which rows."""


def summarised(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the figures of rows.

    Returns
    -------
    dict
        ``kinds``: in the order of their first rig, the number of diagnosed ``rigs`` of the ``kind`` (empty where the
        truth is not known), and of what is :data:`COUNTED`. ``effects``: entries "name axis" and the number of rigs on
        which each was found, most frequent first. ``failures``: rig and error text. ``covered`` of so many
        ``intervals`` of known true value hold it, and their share ``coverage``. ``seconds``: median, 95 % quantile and
        largest of the times of one diagnosis [s], or None.
    """
    done = [row for row in rows if row["error"] is None]
    held = [hit for row in done for hit in coverage(row).values()]
    kinds = []
    for kind in dict.fromkeys(row["true_kind"] for row in done):
        own = [row for row in done if row["true_kind"] == kind]
        counts = {
            key: sum(bool(hit(row)) for row in own if kind is not None or not judged)
            for key, _, judged, hit in COUNTED
        }
        kinds.append({"kind": kind or "", "rigs": len(own), **counts})
    return {
        "kinds": kinds,
        "effects": Counter(" ".join(entry) for row in done for entry in found_entries(row)).most_common(),
        "failures": [(row["rig"], row["error"]) for row in rows if row["error"] is not None],
        "covered": sum(held),
        "intervals": len(held),
        "coverage": sum(held) / len(held) if held else None,
        "seconds": np.quantile([row["seconds"] for row in done], (0.5, 0.95, 1.0)).tolist() if done else None,
    }


def campaign_tables(summary: dict[str, Any]) -> tuple[list[Table], list[str]]:
    """Give tables and sentences of a summary: what was found, and how much of it is true where that is known."""
    kinds, said = summary["kinds"], []
    known = any(kind["kind"] for kind in kinds)
    counted = [own for own in COUNTED if known or not own[2]]
    rows = [
        (
            *([kind["kind"] or "truth not known"] if known else []),
            str(kind["rigs"]),
            *("–" if judged and not kind["kind"] else str(kind[key]) for key, _, judged, _ in counted),
        )
        for kind in kinds
    ]
    tables = [Table("Campaign", (*(["kind"] if known else []), "rigs", *(title for _, title, _, _ in counted)), rows)]
    if summary["effects"]:
        tables.append(
            Table("Effects found", ("effect", "rigs"), [(name, str(count)) for name, count in summary["effects"]])
        )
    if summary["coverage"] is not None:
        share = f"{100.0 * summary['coverage']:.1f} %"
        said.append(f"{share} of {summary['intervals']} intervals of 95 % hold the true value")
    if summary["seconds"] is not None:
        times = "one diagnosis on one core: median {:.1f} s, 95 % quantile {:.1f} s, longest {:.1f} s"
        said.append(times.format(*summary["seconds"]))
    return tables, [*said, *(f"failed: {rig}: {error}" for rig, error in summary["failures"])]
