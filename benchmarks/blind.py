"""The blind battery: every rig diagnosed and held against its truth, as a campaign that goes on where it stopped.

    python -m benchmarks blind [--groups single,weak] [--limit RIGS] [--workers N] [--output FOLDER]

All results are computed again after a change to the code of a diagnosis, to the generator or to the measures. Bars:
clean rigs accused 0, single effects named first .98 and without a false one .98, weak effects that a test that is told
the structure sees .95, pairs .97, unknown torques .95, 95 % intervals that hold the truth .93 to .98.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest

from benchmarks.harness import ROOT, measured_at, options, table
from benchmarks.rigs import DETECTABLE, GROUPS, TOLD, blind_sources, measured_rig
from heli_identifier.cli.on_logs import rigs_done
from heli_identifier.online import ModelParameters
from heli_identifier.tools.campaign import run_campaign
from heli_identifier.tools.campaign_rows import UNKNOWN, Judgement, Row, judged

BASE = ModelParameters._fields

Rows = Mapping[str, list[Row]]
"""Rows by group."""


@dataclass(frozen=True)
class Share:
    """``hits`` of ``count``."""

    hits: int
    count: int

    def __str__(self) -> str:
        """Give it with its 95 % interval (Wilson); two counts of one rig are correlated, which widens it somewhat."""
        if not self.count:
            return ""
        low, high = binomtest(self.hits, self.count).proportion_ci(method="wilson")
        return f"{100 * self.hits / self.count:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def share(rows: Iterable[Row], hit: Callable[[Judgement], object]) -> Share:
    """Share of rows for whose judgement ``hit`` is true."""
    hits = [bool(hit(judged(row))) for row in rows]
    return Share(sum(hits), len(hits))


def told(row: Row) -> float:
    """Score of a test that is told which effect to look for [nats]; NaN where there is none."""
    return (row["measures"] or {}).get(TOLD, float("nan"))


def testable(rows: Iterable[Row]) -> list[Row]:
    """Rigs whose effect is found by a test that is told which effect to look for."""
    return [row for row in rows if told(row) > DETECTABLE]


def wrongly_named(judgement: Judgement) -> bool:
    """Whether an entry of the catalogue was named that the rig does not have."""
    return any(name != UNKNOWN for name, _ in judgement.false)


def covered(rows: Iterable[Row], kept: Callable[[str], bool]) -> Share:
    """Share of the 95 % intervals of the quantities ``kept`` that hold the true value."""
    held = [hit for row in rows for name, hit in judged(row).covered.items() if kept(name)]
    return Share(sum(held), len(held))


def bars(groups: Rows) -> list[tuple[str, Share, float, float]]:
    """Give what is counted in every group that was run, with the least and the most that is asked."""
    clean, single, weak, pair, unknown = (groups.get(n, []) for n in ("clean", "single", "weak", "pair", "unknown"))
    seen, everything = testable(weak), [row for rows in groups.values() for row in rows]
    found = [
        ("clean rigs accused of anything", share(clean, lambda own: own.found), 0.0, 0.0),
        ("single effects named first", share(single, lambda own: own.named_first), 0.98, 1.0),
        ("single effects without a false one", share(single, lambda own: not own.false), 0.98, 1.0),
        (f"weak effects (told: above {DETECTABLE:g}) named first", share(seen, lambda own: own.named_first), 0.95, 1.0),
        ("weak effects with a false one", share(seen, lambda own: own.false), 0.0, 0.05),
        ("pairs: both named, nothing else", share(pair, lambda own: own.right), 0.97, 1.0),
        ("unknown torques: right axis and variable", share(unknown, lambda own: own.recognised), 0.95, 1.0),
        ("unknown torques wrongly named", share(unknown, wrongly_named), 0.0, 0.05),
        ("95 % intervals of parameters that hold the truth", covered(everything, BASE.__contains__), 0.93, 0.98),
        ("the same of coefficients", covered(everything, lambda name: name not in BASE), 0.93, 0.98),
    ]
    return [bar for bar in found if bar[1].count]


def is_miss(group: str, row: Row) -> bool:
    """Whether the result on a rig counts against the bar of its group."""
    if row["error"] is not None:
        return True
    if group in ("clean", "pair", "unknown"):
        return not judged(row).right
    if group == "weak" and not told(row) > DETECTABLE:
        return bool(judged(row).false)
    return not judged(row).named_first or bool(judged(row).false)


def miss(row: Row) -> str:
    """Give a rig that counts against its bar as a line: its truth and what was found."""
    true = [f"{e['name']} {e['axis']} {e['coefficient'] or 0.0:.3g}" for e in row["true_effects"] or ()]
    if row["true_unknown"]:
        true.append(f"unknown {row['true_unknown']['axis']} by {row['true_unknown']['variable']}")
    found = [
        f"{e['name']} {e['axis']} {e['variable'] or ''}{e['coefficient'] or 0.0:.3g} (score {e['score']:.1f})"
        for e in row["effects"] or ()
    ]
    said = row["error"] or "; ".join(found) or "nothing"
    return f"{row['rig']}: true {'; '.join(true) or 'nothing'} (told {told(row):.1f}) | found {said}"


def report(groups: Rows, command: str) -> str:
    """Give the tables: bars, and every kind of rig."""
    everything = [row for rows in groups.values() for row in rows]
    failed = sum(row["error"] is not None for row in everything)
    seconds = [row["seconds"] for row in everything if row["error"] is None]
    lines = [
        (what, str(own), str(own.count), f"{100 * low:g} to {100 * high:g} %",
         "yes" if low <= own.hits / own.count <= high else "**no**")
        for what, own, low, high in bars(groups)
    ]  # fmt: skip
    kinds = []
    for group, rows in groups.items():
        for kind in dict.fromkeys(row["true_kind"] for row in rows):
            own = [row for row in rows if row["true_kind"] == kind]
            seen = testable(own) if group == "weak" else own
            hits = (lambda one: one.named_first, lambda one: one.false, lambda one: one.right)
            counts = [share(seen, hit) for hit in hits]
            score = np.median([told(row) for row in own])
            kinds.append(
                (group, str(kind), str(len(own)), f"{score:.1f}" if np.isfinite(score) else "")
                + tuple(f"{one.hits}/{one.count}" for one in counts)
            )
    intervals = [(name, str(covered(everything, name.__eq__))) for name in BASE]
    head = ("group", "kind", "rigs", "told, median [nats]", "named first", "with a false one", "as it is")
    return "\n\n".join(
        [
            f"`{command}`: {len(everything)} rigs, {failed} of which could not be diagnosed. Shares with their 95 % "
            f"interval (Wilson). One diagnosis on one core: median {np.median(seconds):.1f} s, longest "
            f"{max(seconds):.1f} s. {measured_at('numpy')}",
            table(("what", "found", "of", "asked", "met"), lines),
            table(head, kinds),
            table(("parameter", "95 % intervals that hold the truth"), intervals),
        ]
    )


def blind(arguments: Sequence[str]) -> None:
    """Run the battery; print the rigs that are missed and the tables."""
    asked = options(
        arguments, "blind", __doc__,
        groups=(",".join(GROUPS), "groups of the battery"),
        limit=(int, "most rigs of each case; all if not given"),
        workers=(int, "processes; one per core if not given"),
        output=(ROOT / "build/blind", "folder of the single results"),
    )  # fmt: skip
    rigs = blind_sources(asked.groups.split(","), asked.limit)
    groups: dict[str, list[Row]] = {}
    with rigs_done() as progress:
        sources = [source for _, source in rigs.values()]
        rows = run_campaign(sources, asked.output, workers=asked.workers, progress=progress, work=measured_rig)
    for row in rows:
        groups.setdefault(rigs[row["rig"]][0].group, []).append(row)
    print(*(miss(row) for group, own in groups.items() for row in own if is_miss(group, row)), sep="\n")
    print(report(groups, " ".join(("python -m benchmarks blind", *arguments))))
