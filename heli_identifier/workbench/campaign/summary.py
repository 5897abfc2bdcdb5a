"""The figures of a campaign: by kind of rig what was found and how often rightly, coverage, times."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from heli_identifier.tracing import RigVerdict
from heli_identifier.workbench.campaign.against_truth import (
    coverage,
    false_entries,
    named_first,
    right,
    unknown_recognised,
)
from heli_identifier.workbench.campaign.row import Row


@dataclass(frozen=True)
class Kind:
    """Rigs of one kind.

    Attributes
    ----------
    kind : str
        As the truth calls it; empty where the truth is not known.
    rigs : int
        That were diagnosed.
    shown, adequate, unknown : int
        Rigs of each verdict.
    named_first, false, recognised, right : int
        Rigs whose strongest effect is true; that are accused of what they do not hold; whose unknown torque is
        called so; that were found as they are. All 0 where the truth is not known.
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
        Entries "name axis" and on how many rigs each was found, most frequent first.
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
    """Give the figures of rows, kinds in the order of their first rig."""
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
