"""The blind battery: every rig diagnosed and held against its truth, as a campaign that goes on where it stopped.

    python -m benchmarks blind [--groups single,weak] [--limit RIGS] [--workers N] [--output FOLDER]
                              [--strength FILE]

All results are computed again after a change to the code of a diagnosis, to the generator or to the measures.
``--limit`` is the most rigs of each case of the battery. Bars: clean rigs accused 0, single effects named first .98 and
without a false one .98, weak effects that a test that is told the structure sees .95, pairs .97, unknown torques .95,
95 % intervals that hold the truth .93 to .98.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from scipy.stats import binomtest

from benchmarks.harness import ROOT, Strength, measured_at, table, write_strength
from benchmarks.rigs import DETECTABLE, GROUPS, blind_sources, measured_rig
from heli_identifier.cli.on_rigs import rigs_done
from heli_identifier.online import ModelParameters
from heli_identifier.tools.campaign import Judgement, Row, judged, run_campaign
from tests.blind.generator import Case

BASE = ModelParameters._fields

Counted = tuple[str, list[bool], float, float]
"""What is counted, whether it is so in each case, and the least and the most share that is asked."""


class Result(NamedTuple):
    """What was found on a rig of a case, and what of it is true."""

    case: Case
    row: Row
    own: Judgement

    @property
    def told(self) -> float:
        """Score of a test that is told which effect to look for [nats]; NaN where there is none."""
        return float(self.row.get("told", "nan"))

    @property
    def seen(self) -> bool:
        """Whether it counts: of weak effects those that a test finds which is told what to look for."""
        return self.case.group != "weak" or self.told > DETECTABLE

    @property
    def named_first(self) -> bool:
        """Whether the strongest entry is true."""
        return self.own.found[:1] != () and self.own.found[0] not in self.own.false

    @property
    def right(self) -> bool:
        """Whether everything that the rig has is found, and nothing else; of a torque its variable as well."""
        if self.case.group != "unknown":
            return self.row["error"] is None and self.own.all_named and not self.own.false
        # the axis is drawn rig by rig, and a detent lies on it
        torque = self.case.rig(int(self.row["rig"].split()[-1])).truth.unknown
        named = {one["variable"] for one in self.row["effects"] or () if one["name"] == "unknown"}
        return not self.own.false and torque is not None and torque.variable in named

    @property
    def missed(self) -> bool:
        """Whether it counts against the bar of its group."""
        if self.row["error"] is not None or self.case.group in ("clean", "pair", "unknown"):
            return not self.right
        return bool(self.own.false) or (not self.named_first and self.seen)

    def line(self) -> str:
        """Give the truth and what was found as a line."""
        true = [f"{e['name']} {e['value'] or 0.0:.3g}" for e in self.row["truth"] or () if e["name"] not in BASE]
        found = [
            f"{e['name']} {e['axis']} {e['variable'] or ''}{(e['coefficient'] or {}).get('value', 0.0):.3g} "
            f"(score {e['score']:.1f})"
            for e in self.row["effects"] or ()
        ]
        said = self.row["error"] or "; ".join(found) or "nothing"
        return f"{self.row['rig']}: true {'; '.join(true) or 'nothing'} (told {self.told:.1f}) | found {said}"


def bars(results: Sequence[Result]) -> list[Counted]:
    """Count in every group that was run."""
    clean, single, weak, pair, unknown = (
        [one for one in results if one.case.group == group and one.seen]
        for group in ("clean", "single", "weak", "pair", "unknown")
    )
    held = [(name in BASE, hit) for one in results for name, hit in one.own.covered.items()]
    named = [any(not entry.startswith("unknown") for entry in one.own.found) for one in unknown]
    found: list[Counted] = [
        ("clean rigs accused of anything", [bool(one.own.found) for one in clean], 0.0, 0.0),
        ("single effects named first", [one.named_first for one in single], 0.98, 1.0),
        ("single effects without a false one", [not one.own.false for one in single], 0.98, 1.0),
        (f"weak effects (told: above {DETECTABLE:g}) named first", [one.named_first for one in weak], 0.95, 1.0),
        ("weak effects with a false one", [bool(one.own.false) for one in weak], 0.0, 0.05),
        ("pairs: both named, nothing else", [one.right for one in pair], 0.97, 1.0),
        ("unknown torques: right axis and variable", [one.right for one in unknown], 0.95, 1.0),
        ("unknown torques wrongly named", named, 0.0, 0.05),
        ("95 % intervals of parameters that hold the truth", [hit for base, hit in held if base], 0.93, 0.98),
        ("the same of coefficients", [hit for base, hit in held if not base], 0.93, 0.98),
    ]
    return [bar for bar in found if bar[1]]


def share(hits: Sequence[bool]) -> str:
    """Give a share with its 95 % interval (Wilson); two counts of one rig are correlated, which widens it somewhat."""
    low, high = binomtest(sum(hits), len(hits)).proportion_ci(method="wilson")
    return f"{100 * sum(hits) / len(hits):.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def blind(
    groups: str = ",".join(GROUPS), limit: int | None = None, workers: int | None = None,
    output: Path = ROOT / "build/blind", strength: Path | None = None,
) -> None:  # fmt: skip
    """Run the battery; print the rigs that are missed and the bars; write ``strength``."""
    rigs = blind_sources(groups.split(","), limit)
    with rigs_done() as progress:
        sources = [source for _, source in rigs.values()]
        rows = run_campaign(sources, output, workers=workers, progress=progress, work=measured_rig)
    results = [Result(rigs[row["rig"]][0], row, judged(row)) for row in rows]
    print(*(one.line() for one in results if one.missed), sep="\n")
    lines = [
        (what, share(hits), len(hits), f"{100 * low:g} to {100 * high:g} %",
         "yes" if low <= sum(hits) / len(hits) <= high else "**no**")
        for what, hits, low, high in bars(results)
    ]  # fmt: skip
    print(f"\n{table(('what', 'found', 'of', 'asked', 'met'), lines)}\n\n{len(rows)} rigs; {measured_at('numpy')}")
    if strength:  # of single and weak effects, as the score of a pair is that of its stronger effect
        alone = [one for one in results if one.case.group in ("single", "weak")]
        write_strength((Strength("blind", one.row["rig"], one.case.kind, one.told, int(one.own.all_named))
                        for one in alone), strength)  # fmt: skip
