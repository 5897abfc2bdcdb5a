"""The blind battery: every rig diagnosed and held against its truth, as a campaign that goes on where it stopped.

    python -m benchmarks blind [--groups single,weak] [--limit RIGS] [--workers N] [--output FOLDER]
                              [--strength FILE]

All results are computed again after a change to the code of a diagnosis, to the generator or to the measures.
``--limit`` is the most rigs of each case of the battery. Bars: clean rigs accused 0, single effects named first .98 and
without a false one .98, weak effects that a test that is told the structure sees .95, pairs .97, unknown torques .95,
95 % intervals that hold the truth .93 to .98.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

from scipy.stats import binomtest

from benchmarks.harness import ROOT, Strength, measured_at, table, write_strength
from benchmarks.rigs import DETECTABLE, GROUPS, TOLD, blind_sources, measured_rig
from heli_identifier.cli.on_rigs import rigs_done
from heli_identifier.online import ModelParameters
from heli_identifier.tools.campaign import run_campaign
from heli_identifier.tools.campaign_rows import UNKNOWN, Judgement, Row, campaign_tables, judged, summarised

BASE = ModelParameters._fields

Counted = tuple[str, list[bool], float, float]
"""What is counted, whether it is so in each case, and the least and the most share that is asked."""


def told(row: Row) -> float:
    """Score of a test that is told which effect to look for [nats]; NaN where there is none."""
    return float((row["measures"] or {}).get(TOLD, "nan"))


def seen(group: str, rows: Sequence[Row]) -> list[Row]:
    """Leave out the weak effects that a test that is told which effect to look for does not find."""
    return [row for row in rows if group != "weak" or told(row) > DETECTABLE]


def wrongly_named(judgement: Judgement) -> bool:
    """Whether an entry of the catalogue was named that the rig does not have."""
    return any(name != UNKNOWN for name, _ in judgement.false)


def bars(groups: Mapping[str, Sequence[Row]]) -> list[Counted]:
    """Count in every group that was run."""
    own = {group: [judged(row) for row in seen(group, rows)] for group, rows in groups.items()}
    clean, single, weak, pair, unknown = (own.get(n, []) for n in ("clean", "single", "weak", "pair", "unknown"))
    every = [judged(row) for rows in groups.values() for row in rows]
    held = [(name in BASE, hit) for one in every for name, hit in one.covered.items()]
    found: list[Counted] = [
        ("clean rigs accused of anything", [bool(one.found) for one in clean], 0.0, 0.0),
        ("single effects named first", [one.named_first for one in single], 0.98, 1.0),
        ("single effects without a false one", [not one.false for one in single], 0.98, 1.0),
        (f"weak effects (told: above {DETECTABLE:g}) named first", [one.named_first for one in weak], 0.95, 1.0),
        ("weak effects with a false one", [bool(one.false) for one in weak], 0.0, 0.05),
        ("pairs: both named, nothing else", [one.right for one in pair], 0.97, 1.0),
        ("unknown torques: right axis and variable", [one.recognised for one in unknown], 0.95, 1.0),
        ("unknown torques wrongly named", [wrongly_named(one) for one in unknown], 0.0, 0.05),
        ("95 % intervals of parameters that hold the truth", [hit for base, hit in held if base], 0.93, 0.98),
        ("the same of coefficients", [hit for base, hit in held if not base], 0.93, 0.98),
    ]
    return [bar for bar in found if bar[1]]


def share(hits: Sequence[bool]) -> str:
    """Give a share with its 95 % interval (Wilson); two counts of one rig are correlated, which widens it somewhat."""
    low, high = binomtest(sum(hits), len(hits)).proportion_ci(method="wilson")
    return f"{100 * sum(hits) / len(hits):.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def is_miss(group: str, row: Row) -> bool:
    """Whether the result on a rig counts against the bar of its group."""
    own = judged(row)
    if row["error"] is not None or group in ("clean", "pair", "unknown"):
        return not own.right
    return bool(own.false) or (not own.named_first and bool(seen(group, [row])))


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


def blind(
    groups: str = ",".join(GROUPS), limit: int | None = None, workers: int | None = None,
    output: Path = ROOT / "build/blind", strength: Path | None = None,
) -> None:  # fmt: skip
    """Run the battery; print the rigs that are missed, the bars, what was found by group; write ``strength``."""
    rigs = blind_sources(groups.split(","), limit)
    with rigs_done() as progress:
        sources = [source for _, source in rigs.values()]
        rows = run_campaign(sources, output, workers=workers, progress=progress, work=measured_rig)
    found: dict[str, list[Row]] = {}
    for row in rows:
        found.setdefault(rigs[row["rig"]][0].group, []).append(row)
    print(*(miss(row) for group, own in found.items() for row in own if is_miss(group, row)), sep="\n")
    lines = [
        (what, share(hits), len(hits), f"{100 * low:g} to {100 * high:g} %",
         "yes" if low <= sum(hits) / len(hits) <= high else "**no**")
        for what, hits, low, high in bars(found)
    ]  # fmt: skip
    print(f"\n{table(('what', 'found', 'of', 'asked', 'met'), lines)}\n\n{len(rows)} rigs; {measured_at('numpy')}")
    if strength:  # of single and weak effects, as the score of a pair is that of its stronger effect
        alone = [row for group in ("single", "weak") for row in found.get(group, ())]
        write_strength((Strength("blind", row["rig"], row["true_kind"], told(row), int(judged(row).all_named))
                        for row in alone), strength)  # fmt: skip
    for group, own in found.items():
        (first, *_), said = campaign_tables(summarised(seen(group, own)))
        print(f"\n{group}\n\n{table(first.columns, first.rows)}", *said, sep="\n")
