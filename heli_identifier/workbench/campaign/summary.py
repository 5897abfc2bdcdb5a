"""The rows of a campaign judged against the truth, and the figures of all rows.

*Named first*: the strongest entry is an effect of the rig, on an axis on which it acts; an effect that acts on several
axes is true on each of them. *False*: an entry that the rig does not have; an "unknown" entry is false on every rig
without an unknown torque. *Right*: everything that the rig has is found, and nothing else. *Covered*: the 95 % interval
of a parameter or coefficient holds the true value.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from heli_identifier.online import Estimate
from heli_identifier.tracing import RigVerdict
from heli_identifier.workbench.campaign.row import BASE, Row

UNKNOWN = "unknown"
"""Name of an entry for a torque that is no effect of the catalogue."""

Entry = tuple[str, str]
"""Name and axis."""


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
    return (
        true is not None
        and row["verdict"] == RigVerdict.UNKNOWN_EFFECT
        and any(
            (found["name"], found["axis"], found["variable"]) == (UNKNOWN, true["axis"], true["variable"])
            for found in row["effects"]
        )
    )


def right(row: Row) -> bool:
    """Whether everything that the rig has is found, and nothing else."""
    if row["error"] is not None:
        return False
    found = all_named(row) if row["true_unknown"] is None else unknown_recognised(row)
    return found and not false_entries(row)


def coverage(row: Row) -> dict[str, bool]:
    """Return for every parameter and coefficient of known true value whether its 95 % interval holds that value."""
    held = {}
    for symbol in BASE:
        value, error, true = row[symbol], row[f"{symbol}_se"], row[f"true_{symbol}"]
        if None not in (value, error, true):
            held[symbol] = _holds(value, error, true)
    strengths = {(effect["name"], effect["axis"]): effect["coefficient"] for effect in row["true_effects"] or ()}
    for found in row["effects"] or ():
        value, error = found["coefficient"], found["standard_error"]
        true = strengths.get((found["name"], found["axis"]))
        if value is not None and error is not None and true is not None:
            held[f"{found['name']} {found['axis']}"] = _holds(value, error, true)
    return held


def _holds(value: float, standard_error: float, true: float) -> bool:
    low, high = Estimate(value, standard_error, "").interval
    return low <= true <= high


@dataclass(frozen=True)
class Kind:
    """Rigs of one kind.

    Attributes
    ----------
    kind : str
        As in the truth; empty where the truth is not known.
    rigs : int
        Number of diagnosed rigs.
    shown, adequate, unknown : int
        Rigs of each verdict.
    named_first, false, recognised, right : int
        Rigs whose strongest entry is true; with a false entry; whose unknown torque is recognised; that were found
        right. All 0 where the truth is not known.
    """

    kind: str
    rigs: int
    shown: int
    adequate: int
    unknown: int
    named_first: int
    false: int
    recognised: int
    right: int


@dataclass(frozen=True)
class Summary:
    """All rigs of a campaign.

    Attributes
    ----------
    kinds : tuple of Kind
    effects : tuple of (str, int)
        Entries "name axis" and the number of rigs on which each was found, most frequent first.
    failures : tuple of (str, str)
        Rig and error text of each diagnosis that failed.
    covered, intervals : int
        95 % intervals that hold the true value, and intervals whose true value is known.
    seconds : tuple of float or None
        Median, 95 % quantile and largest of the times of one diagnosis on one core [s]; None where there is none.
    """

    kinds: tuple[Kind, ...]
    effects: tuple[tuple[str, int], ...]
    failures: tuple[tuple[str, str], ...]
    covered: int
    intervals: int
    seconds: tuple[float, float, float] | None

    @property
    def coverage(self) -> float | None:
        """Share of the 95 % intervals that hold the true value; None where no truth is known."""
        return self.covered / self.intervals if self.intervals else None


def summarised(rows: Sequence[Row]) -> Summary:
    """Return the figures of rows, kinds in the order of their first rig."""
    done = [row for row in rows if row["error"] is None]
    kinds = list(dict.fromkeys(row["true_kind"] for row in done))
    held = [hit for row in done for hit in coverage(row).values()]
    found = Counter(f"{effect['name']} {effect['axis']}" for row in done for effect in row["effects"])
    return Summary(
        tuple(_kind(kind, [row for row in done if row["true_kind"] == kind]) for kind in kinds),
        tuple(found.most_common()),
        tuple((row["rig"], row["error"]) for row in rows if row["error"] is not None),
        sum(held),
        len(held),
        _spread([row["seconds"] for row in done]),
    )


def _spread(values: Sequence[float]) -> tuple[float, float, float] | None:
    if not values:
        return None
    median, high, most = np.quantile(values, (0.5, 0.95, 1.0))
    return float(median), float(high), float(most)


def _kind(kind: str | None, rows: Sequence[Row]) -> Kind:
    verdicts = Counter(row["verdict"] for row in rows)
    judged = rows if kind is not None else []
    return Kind(
        kind or "",
        len(rows),
        verdicts[RigVerdict.EFFECTS_SHOWN],
        verdicts[RigVerdict.MODEL_ADEQUATE],
        verdicts[RigVerdict.UNKNOWN_EFFECT],
        sum(named_first(row) for row in judged),
        sum(bool(false_entries(row)) for row in judged),
        sum(unknown_recognised(row) for row in judged),
        sum(right(row) for row in judged),
    )
