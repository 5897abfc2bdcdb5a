"""The blind battery: every rig diagnosed and held against its truth, as a campaign that goes on where it stopped.

    python -m benchmarks blind [--groups single,weak] [--limit RIGS] [--workers N] [--output FOLDER]
                              [--strength FILE]

All results are computed again after a change to the code of a diagnosis, to the generator or to the measures.
``--limit`` is the most rigs of each case of the battery. Bars: clean rigs accused 0, single effects named first .98 and
without a false one .98, weak effects that a test that is told the structure sees .95, pairs .97, unknown torques .95,
95 % intervals that hold the truth .93 to .98.
"""

from pathlib import Path
from typing import Any

import pandas

from benchmarks.harness import ROOT, measured_at, share, table, write_strength
from benchmarks.rigs import DETECTABLE, GROUPS, blind_sources, measured_rig
from heli_identifier.cli.terminal import progress_bar
from heli_identifier.online import ModelParameters
from heli_identifier.tools.campaign import Row, judged, run_campaign
from tests.blind.generator import Case

BASE = ModelParameters._fields

Counted = tuple[str, list[bool], float, float]
"""What is counted, whether it is so in each case, and the least and the most share that is asked."""


def verdict(case: Case, row: Row) -> dict[str, Any]:
    """Say what was found on a rig of a case, and what of it is true.

    ``told``: the score of a test that is told which effect to look for [nats]; ``seen``: whether the rig counts, of
    weak effects those that such a test finds; ``first``: the strongest entry is true; ``right``: everything that the
    rig has is found, and nothing else; ``missed``: it counts against the bar of its group.
    """
    own, told, failed = judged(row), float(row.get("told", "nan")), row["error"] is not None
    seen, first = case.group != "weak" or told > DETECTABLE, own.found[:1] != () and own.found[0] not in own.false
    right = not failed and own.all_named and not own.false
    if case.group == "unknown":  # of a torque its variable as well; the axis is drawn rig by rig, a detent lies on it
        torque = case.rig(int(row["rig"].split()[-1])).truth.unknown
        named = {one["variable"] for one in row["effects"] or () if one["name"] == "unknown"}
        right = not own.false and torque is not None and torque.variable in named
    whole = failed or case.group in ("clean", "pair", "unknown")
    missed = not right if whole else bool(own.false) or (not first and seen)
    return {"group": case.group, "kind": case.kind, "rig": row["rig"], "told": told, "seen": seen, "first": first,
            "right": right, "missed": missed, "named": own.all_named, "found": own.found, "false": bool(own.false),
            "covered": own.covered, "line": line(row, told)}  # fmt: skip


def line(row: Row, told: float) -> str:
    """Give the truth and what was found as a line."""
    true = [f"{e['name']} {e['value'] or 0.0:.3g}" for e in row["truth"] or () if e["name"] not in BASE]
    found = [
        f"{e['name']} {e['axis']} {e['variable'] or ''}{(e['coefficient'] or {}).get('value', 0.0):.3g} "
        f"(score {e['score']:.1f})"
        for e in row["effects"] or ()
    ]
    said = row["error"] or "; ".join(found) or "nothing"
    return f"{row['rig']}: true {'; '.join(true) or 'nothing'} (told {told:.1f}) | found {said}"


def bars(results: pandas.DataFrame) -> list[Counted]:
    """Count in every group that was run."""
    clean, single, weak, pair, unknown = (
        results[results.seen & (results.group == group)] for group in ("clean", "single", "weak", "pair", "unknown")
    )
    held = [(name in BASE, hit) for covered in results.covered for name, hit in covered.items()]
    named = [any(not entry.startswith("unknown") for entry in found) for found in unknown.found]
    found: list[Counted] = [
        ("clean rigs accused of anything", [bool(found) for found in clean.found], 0.0, 0.0),
        ("single effects named first", [*single["first"]], 0.98, 1.0),
        ("single effects without a false one", [*~single.false], 0.98, 1.0),
        (f"weak effects (told: above {DETECTABLE:g}) named first", [*weak["first"]], 0.95, 1.0),
        ("weak effects with a false one", [*weak.false], 0.0, 0.05),
        ("pairs: both named, nothing else", [*pair.right], 0.97, 1.0),
        ("unknown torques: right axis and variable", [*unknown.right], 0.95, 1.0),
        ("unknown torques wrongly named", named, 0.0, 0.05),
        ("95 % intervals of parameters that hold the truth", [hit for base, hit in held if base], 0.93, 0.98),
        ("the same of coefficients", [hit for base, hit in held if not base], 0.93, 0.98),
    ]
    return [bar for bar in found if bar[1]]


def blind(
    groups: str = ",".join(GROUPS), limit: int | None = None, workers: int | None = None,
    output: Path = ROOT / "build/blind", strength: Path | None = None,
) -> None:  # fmt: skip
    """Run the battery; print the rigs that are missed and the bars; write ``strength``."""
    rigs = blind_sources(groups.split(","), limit)
    with progress_bar(lines=True) as progress:
        sources = [source for _, source in rigs.values()]
        rows = run_campaign(sources, output, workers=workers, progress=progress, work=measured_rig)
    results = pandas.DataFrame([verdict(rigs[row["rig"]][0], row) for row in rows])
    print(*results.line[results.missed], sep="\n")
    lines = []
    for what, hits, low, high in bars(results):
        found, *ends = share(hits)
        said = f"{100 * found:.1f} % ({100 * ends[0]:.1f} to {100 * ends[1]:.1f})"
        asked, met = f"{100 * low:g} to {100 * high:g} %", "yes" if low <= found <= high else "**no**"
        lines.append((what, said, len(hits), asked, met))
    print(f"\n{table(('what', 'found', 'of', 'asked', 'met'), lines)}\n\n{len(rows)} rigs; {measured_at('numpy')}")
    if strength:  # of single and weak effects, as the score of a pair is that of its stronger effect
        alone = results[results.group.isin(("single", "weak"))]
        own = alone[["rig", "kind", "told", "named"]].itertuples(index=False, name=None)
        write_strength((("blind", *row) for row in own), strength)
