"""The section of the blind battery in docs/results.md, and its misses as lines for the terminal."""

import os
import platform
from collections.abc import Mapping
from datetime import UTC, datetime

import numpy as np

from benchmarks.blind_figures import (
    BASE,
    TOLD_NEEDED,
    Bar,
    Share,
    bars,
    coverage_share,
    is_miss,
    quantiles,
    share,
    testable,
    told,
)
from heli_identifier.tools.campaign_rows import Row, false_entries, named_first, right
from tests.blind.battery import Case

Rows = Mapping[str, list[Row]]
"""Rows by group."""


def section(rows: Rows, kinds: Mapping[str, Case], command: str) -> str:
    """Give the section: how it was made, bars, kinds, prediction, coverage by parameter, times.

    Parameters
    ----------
    rows : mapping of str to list of dict
        By group.
    kinds : mapping of str to Case
        The case of every rig.
    command : str
        That made it.
    """
    everything = [row for group in rows.values() for row in group]
    failed = [row for row in everything if row["error"] is not None]
    seconds = quantiles([row["seconds"] for row in everything if row["error"] is None], 0.5, 0.95, 1.0)
    parts = [
        "## Blind battery",
        f"{datetime.now(UTC):%Y-%m-%d}, {_machine()}; `{command}`; {len(everything)} rigs, {len(failed)} of which "
        "could not be diagnosed. Shares with their 95 % interval (Wilson).",
        _table(("what", "found", "of", "asked", "met"), [_bar_line(bar) for bar in bars(dict(rows))]),
        "### By kind",
        f"*Told*: median score of a test that is told which effect to look for, and how many rigs it would find "
        f"(above {TOLD_NEEDED:g} nats); only those are judged in the group of weak effects. *Nats*: what the held-out "
        "log gains by the correction, median.",
        _table(
            ("group", "kind", "rigs", "told", "named first", "with a false one", "as it is", "nats"),
            _kind_lines(rows, kinds),
        ),
        "### 95 % intervals by parameter",
        _table(("parameter", "holds the truth", "where the structure is right"), _coverage_lines(everything)),
        f"One diagnosis on one core: median {seconds[0]:.1f} s, 95 % quantile {seconds[1]:.1f} s, "
        f"longest {seconds[2]:.1f} s.",
    ]
    return "\n\n".join(parts)


def misses(rows: Rows) -> list[str]:
    """Give one line for every rig that counts against its bar: its truth and what was found."""
    return [_miss(row) for group, found in rows.items() for row in found if is_miss(group, row)]


def _miss(row: Row) -> str:
    true = [f"{e['name']} {e['axis']} {e['coefficient'] or 0.0:.3g}" for e in row["true_effects"] or ()]
    if row["true_unknown"]:
        true.append(f"unknown {row['true_unknown']['axis']} by {row['true_unknown']['variable']}")
    found = [
        f"{e['name']} {e['axis']} "
        + (f"by {e['variable']}" if e["coefficient"] is None else f"{e['coefficient']:.3g}")
        + f" (score {e['score']:.1f}"
        + (f", ambiguous with {', '.join(e['alternatives'])})" if e["alternatives"] else ")")
        for e in row["effects"] or ()
    ]
    return (
        f"{row['rig']}: true {'; '.join(true) or 'nothing'} (told {told(row):.1f}) | found "
        f"{row['error'] or '; '.join(found) or 'nothing'}"
    )


def _bar_line(bar: Bar) -> tuple[str, ...]:
    met = {True: "yes", False: "**no**", None: ""}[bar.met]
    return bar.what, _shown(bar.share), str(bar.share.count), bar.asked, met


def _kind_lines(rows: Rows, kinds: Mapping[str, Case]) -> list[tuple[str, ...]]:
    lines = []
    for group, members in rows.items():
        for kind in dict.fromkeys(kinds[row["rig"]].kind for row in members):
            own = [row for row in members if kinds[row["rig"]].kind == kind]
            judged = testable(own) if group == "weak" else own
            scores = quantiles([told(row) for row in own], 0.5)[0]
            nats = quantiles([row["held_out_nats"] for row in own if row["error"] is None], 0.5)[0]
            lines.append(
                (
                    group, kind, str(len(own)),
                    f"{scores:.1f} ({len(testable(own))})" if np.isfinite(scores) else "",
                    _count(share(judged, named_first)) if group not in ("clean", "unknown") else "",
                    _count(share(judged, false_entries)),
                    _count(share(judged, right)),
                    f"{nats:.0f}" if np.isfinite(nats) else "",
                )
            )  # fmt: skip
    return lines


def _coverage_lines(rows: list[Row]) -> list[tuple[str, ...]]:
    good = [row for row in rows if right(row)]
    return [(name, *(_shown(coverage_share(some, name.__eq__)) for some in (rows, good))) for name in BASE]


def _shown(found: Share) -> str:
    if not found.count:
        return ""
    low, high = found.interval
    return f"{100 * found.value:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def _count(found: Share) -> str:
    return f"{found.hits}/{found.count}" if found.count else ""


def _machine() -> str:
    cores, python = os.cpu_count() or 1, platform.python_version()
    return f"{platform.system()} {platform.machine()}, {cores} core{'s' if cores > 1 else ''}, Python {python}"


def _table(head: tuple[str, ...], lines: list[tuple[str, ...]]) -> str:
    rows = [head, ("---",) * len(head), *lines]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)
