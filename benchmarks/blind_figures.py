"""Figures of the blind battery, computed from its rows, each with its bar."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from statsmodels.stats.proportion import proportion_confint

from benchmarks.blind_measures import TOLD
from heli_identifier.online import ModelParameters
from heli_identifier.tools.campaign_rows import (
    UNKNOWN,
    Row,
    coverage,
    false_entries,
    found_entries,
    named_first,
    right,
    unknown_recognised,
)

BASE = ModelParameters._fields

TOLD_NEEDED = 8.0
"""A weak effect counts if a test that is told which effect to look for scores more than this [nats]."""


@dataclass(frozen=True)
class Share:
    """``hits`` of ``count``."""

    hits: int
    count: int

    @property
    def value(self) -> float:
        """Share; NaN if nothing was counted."""
        return self.hits / self.count if self.count else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval (Wilson 1927). Coverages on one rig are correlated, which widens the true interval somewhat."""
        low, high = proportion_confint(self.hits, self.count, method="wilson") if self.count else (0.0, 1.0)
        return float(low), float(high)


@dataclass(frozen=True)
class Bar:
    """One bar: what is counted, what was counted, what is asked, and whether it is met (None: nothing to judge)."""

    what: str
    share: Share
    asked: str
    met: bool | None


def share(rows: Iterable[Row], hit: Callable[[Row], object]) -> Share:
    """Share of rows for which ``hit`` is true."""
    hits = [bool(hit(row)) for row in rows]
    return Share(sum(hits), len(hits))


def wrongly_named(row: Row) -> bool:
    """Whether an entry of the catalogue was named that the rig does not have."""
    return any(name != UNKNOWN for name, _ in false_entries(row))


def told(row: Row) -> float:
    """Score of a test that is told which effect to look for; NaN where there is none."""
    return (row["measures"] or {}).get(TOLD, float("nan"))


def testable(rows: Sequence[Row]) -> list[Row]:
    """Rigs whose effect is found by a test that is told which effect to look for."""
    return [row for row in rows if told(row) > TOLD_NEEDED]


def bars(groups: dict[str, list[Row]]) -> list[Bar]:
    """Shares of every group that was run, with their bars."""
    clean, single, pair, unknown = (groups.get(name, []) for name in ("clean", "single", "pair", "unknown"))
    weak = testable(groups.get("weak", []))
    everything = [row for rows in groups.values() for row in rows]
    found = [
        _at_most(0.0, "clean rigs accused of anything", share(clean, found_entries)),
        _at_least(0.98, "single effects named first", share(single, named_first)),
        _at_least(0.98, "single effects without a false one", share(single, lambda row: not false_entries(row))),
        _at_least(0.95, f"weak effects (told: above {TOLD_NEEDED:g}) named first", share(weak, named_first)),
        _at_most(0.05, "weak effects with a false one", share(weak, false_entries)),
        _at_least(0.97, "pairs: both named, nothing else", share(pair, right)),
        _at_least(0.95, "unknown torques: right axis and variable", share(unknown, unknown_recognised)),
        _at_most(0.05, "unknown torques wrongly named", share(unknown, wrongly_named)),
        *(
            _between(0.93, 0.98, f"95 % intervals of {what} that hold the truth{where}", coverage_share(rows, kept))
            for rows, where in ((everything, ""), ([row for row in everything if right(row)], ", structure right"))
            for what, kept in (("parameters", _is_parameter), ("coefficients", _is_coefficient))
        ),
    ]
    return [bar for bar in found if bar.share.count]


def coverage_share(rows: Iterable[Row], kept: Callable[[str], bool]) -> Share:
    """Share of the intervals of the quantities ``kept`` that hold the true value."""
    held = [hit for row in rows for name, hit in coverage(row).items() if kept(name)]
    return Share(sum(held), len(held))


def quantiles(values: Sequence[float] | np.ndarray, *levels: float) -> list[float]:
    """Quantiles of the finite values; NaN if there are none."""
    finite = np.asarray(values, dtype=float)
    finite = finite[np.isfinite(finite)]
    return [float(np.quantile(finite, level)) if finite.size else float("nan") for level in levels]


def is_miss(group: str, row: Row) -> bool:
    """Whether the result on a rig counts against the bar of its group."""
    if row["error"] is not None:
        return True
    if group in ("clean", "pair", "unknown"):
        return not right(row)
    if group == "weak" and not told(row) > TOLD_NEEDED:
        return bool(false_entries(row))
    return not named_first(row) or bool(false_entries(row))


def _is_parameter(name: str) -> bool:
    return name in BASE


def _is_coefficient(name: str) -> bool:
    return name not in BASE


def _at_least(bound: float, what: str, found: Share) -> Bar:
    return Bar(what, found, f"at least {100 * bound:g} %", found.value >= bound if found.count else None)


def _at_most(bound: float, what: str, found: Share) -> Bar:
    return Bar(what, found, f"at most {100 * bound:g} %", found.value <= bound if found.count else None)


def _between(low: float, high: float, what: str, found: Share) -> Bar:
    return Bar(what, found, f"{100 * low:g} to {100 * high:g} %", low <= found.value <= high if found.count else None)
