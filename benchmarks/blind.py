"""Generated rigs with truth, diagnosed: the blind battery, and damaged logs of clean rigs.

*blind*: every rig of the battery as a campaign that goes on where it stopped, unless the code has changed. ``--groups``
of the battery, ``--limit``: the most rigs of each of its cases; ``--strength``: a table of told scores and of what is
shown. A test that is *told* which effect to look for has a score [nats], from 8 on it sees the effect.

*damage*: whether a rig is accused, and whether the damage is named. The arguments are words of damages' names. Rigs of
the generator in open loop, clean (``--open``, a range of seeds) or with one of the battery's effects (``--both``), and
bare windy rigs under a controller whose references are logged (``--flown``); every damage of :mod:`tests.blind.damage`
strikes all logs of a rig. Printed are for each damage the rigs of which an effect is shown that they do not have; those
whose damage is named or refused by name, where a told test sees it; and with an effect those that get both names.
"""

import os
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pandas

from benchmarks.harness import ROOT, STRENGTH, Bar, Row, Words, bar_table, count, parse_range, run_jobs, table
from benchmarks.rigs import (
    DETECTABLE,
    blind_rig,
    damage_log,
    likelihood_of,
    log_of,
    told_scores,
    true_structure,
    windy_log,
)
from heli_identifier.chain import FAULTS
from heli_identifier.cli.terminal import progress_bar
from heli_identifier.errors import IdentifierError
from heli_identifier.online import Estimate, ModelParameters
from heli_identifier.records import Log
from heli_identifier.results import diagnose
from heli_identifier.tools import Source, diagnose_source, digest_files, run_campaign
from heli_identifier.tracing import fit
from heli_plant.effects import effect
from tests.blind.damage import DAMAGES
from tests.blind.generator import BATTERY, SINGLE, Case, make_rig
from tests.blind.windy import windy_rig

BASE = ModelParameters._fields
GROUPS = dict.fromkeys(case.group for case in BATTERY)


def diagnosed_and_told(source: Source) -> Row:
    """Diagnose a rig; add the largest ``told`` score of its effects to the row, if the catalogue has these effects."""
    rig: Any = source.load()  # a TrueRig
    row = diagnose_source(source._replace(load=lambda: rig))
    entries = [name.split() for name in rig.truth if " " in name and not name.startswith("unknown")]
    scores = told_scores(rig.training, [effect(name, axis).field for name, axis in entries])
    return row | ({"told": max(scores.values())} if scores else {})


def judge_row(row: Row, truth: Mapping[str, float | None]) -> Row:
    """Judge a row against the truth; an effect is called "name axis".

    ``found`` are the effects that were found, strongest evidence first; ``false``: of these that are false; ``named``:
    every effect of the rig is found, on any of its axes; ``covered``: by parameter and coefficient of known value
    whether the 95 % interval holds this value.
    """
    coefficients = [(f"{effect['name']} {effect['axis']}", effect["coefficient"]) for effect in row.get("effects", ())]
    covered = {}
    for name, estimate in (*row.get("parameters_after", {}).items(), *coefficients):
        if estimate and estimate["standard_error"] is not None and (value := truth.get(name)) is not None:
            low, high = Estimate(**estimate).interval
            covered[name] = low <= value <= high
    found = [entry for entry, _ in coefficients]
    existing, named = ({entry.partition(" ")[0] for entry in entries if entry not in BASE}
                       for entries in (truth, [entry for entry in found if entry in truth]))  # fmt: skip
    false = [entry for entry in found if entry not in truth]
    return {"found": found, "false": false, "named": named == existing, "covered": covered}


def judge_rig(case: Case, index: int, row: Row) -> Row:
    """Return what was found on a rig of a case, and what of it is true, as :func:`judge_row`.

    ``seen``: the rig counts; a weak effect counts only if a told fit finds it; ``first``: the strongest entry is true;
    ``right``: every effect of the rig is found, and nothing else.
    """
    rig = case.rig(index).truth
    judged, told = judge_row(row, true_structure(rig)), float(row.get("told", "nan"))
    seen = case.group != "weak" or told > DETECTABLE
    first = judged["found"] != [] and judged["found"][0] not in judged["false"]
    right = row["error"] is None and judged["named"] and not judged["false"]
    if case.group == "unknown":  # the variable of a torque has to be right too; its axis is drawn rig by rig
        variables = {own["shape"].get("variable") for own in row.get("effects", ()) if own["name"] == "unknown"}
        right = not judged["false"] and rig.unknown is not None and rig.unknown.variable in variables
    return judged | {"group": case.group, "kind": case.kind, "rig": row["rig"], "told": told, "seen": seen,
                     "first": first, "right": right, "false": bool(judged["false"]), "error": row["error"]}  # fmt: skip


def bars(results: pandas.DataFrame) -> list[Bar]:
    """Return the bars of every group that was run."""
    clean, single, weak, pair, unknown = (
        results[results.seen & (results.group == group)] for group in ("clean", "single", "weak", "pair", "unknown")
    )
    covers = [(name in BASE, hit) for covered in results.covered for name, hit in covered.items()]
    parameters, coefficients = ([hit for base, hit in covers if base == wanted] for wanted in (True, False))
    named = [any(not entry.startswith("unknown") for entry in found) for found in unknown.found]
    return [
        Bar("clean rigs accused of anything", [bool(found) for found in clean.found], 0.0),
        Bar("single effects named first", single["first"], least=98.0),
        Bar("single effects without a false one", ~single.false, least=98.0),
        Bar(f"weak effects (told: above {DETECTABLE:g}) named first", weak["first"], least=95.0),
        Bar("weak effects with a false one", weak.false, 5.0),
        Bar("pairs: both named, nothing else", pair.right, least=97.0),
        Bar("unknown torques: right axis and variable", unknown.right, least=95.0),
        Bar("unknown torques wrongly named", named, 5.0),
        Bar("95 % intervals of parameters that hold the truth", parameters, 98.0, least=93.0),
        Bar("the same of coefficients", coefficients, 98.0, least=93.0),
    ]


def blind(
    groups: str = ",".join(GROUPS), limit: int | None = None, workers: int | None = None,
    output: Path = ROOT / "build/blind", strength: Path | None = None,
) -> None:  # fmt: skip
    """Run the battery; print the rigs with a wrong result and the bars."""
    cases = {
        f"{case.group} {case.kind} {index}": (case, index)
        for case in BATTERY
        if case.group in groups.split(",")
        for index in range(min(case.count, limit or case.count))
    }
    code = digest_files([*sorted((ROOT / "tests/blind").glob("*.py")), *sorted((ROOT / "benchmarks").glob("*.py"))])
    sources = [
        Source(name, partial(blind_rig, case.kind, case.scale, index), partial(str, f"{case} {index} {code}"))
        for name, (case, index) in cases.items()
    ]
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # of every worker
    with progress_bar(lines=True) as progress:
        rows = run_campaign(sources, output, workers=workers, progress=progress, work=diagnosed_and_told)
    results = pandas.DataFrame([judge_rig(*cases[row["rig"]], row) for row in rows])
    for _, row in results[~results.right & (results.seen | results.false)].iterrows():
        print(f"{row.rig} (told {row.told:.1f}): {row.error or ', '.join(row.found) or 'nothing'}")
    print(f"\n{bar_table(bars(results))}\n\n{len(rows)} rigs")
    if strength:  # only single and weak effects: the score of a pair is that of its stronger effect
        alone = results[results.group.isin(("single", "weak"))].rename(columns={"kind": "effect"}).dropna(subset="told")
        alone = alone.assign(battery="blind", shown=alone.named.astype(int))[STRENGTH]
        alone.to_csv(strength, index=False, float_format="%.4g")


NAMING = {
    "drifts": "drift", "late": "late", "filter": "low pass|filtered|late", "play": "backlash", "slips": "slip",
    "counts": "counts|rest", "cut": "rounded", "clipped": "clipped", "copy": "same numbers",
    "twice": "too large|counts", "times": "scale|rotor_mismatch", "sign": "SIGN|wrong sign",
    "[deg]": "was read as", "[rad]": "was read as", "folded": "whole turn", "jitters": "jitter", "fast": "clock",
}  # fmt: skip
"""Texts of a diagnosis that name a damage, by a word of the damage's name."""


def logs_of(kind: str, seed: int, effect: str) -> list[Log]:
    """Make the logs of a rig; the last one is to be held out."""
    if kind != "flown":
        rig = make_rig(9000 + seed, effect)
        return [log_of(f"log {i}", 100.0, log) for i, log in enumerate((*rig.train, rig.held))]
    flown = windy_rig(500 + seed, "ou", False, 100.0, "bare", True, {"a": 4, "b": 0, "t": 1, "c": 0})
    return [windy_log(name, log) for name, log in flown.logs.items()]


def diagnose_damaged(kind: str, seed: int, damage: str) -> list[Row]:
    """Diagnose a rig with damaged logs; say which true and false effects are shown, and whether the damage is named."""
    # the effects take turns with the damages
    true_effect = SINGLE[(list(DAMAGES).index(damage) + 7 * seed) % len(SINGLE)] if kind == "both" else "clean"
    sound = logs_of(kind, seed, true_effect)
    damaged, shown = [damage_log(log, damage) for log in sound], set[str]()
    values = [fit(x, x.rig.base).value for x in map(likelihood_of, (sound[:-1], damaged[:-1]))]
    told = values[1] - values[0] > DETECTABLE
    try:
        diagnosis = diagnose(damaged[:-1], held_out=damaged[-1:])
    except IdentifierError as error:
        text = f"refused: {error}"
    else:
        alternatives = [(f"{entry.name}/{entry.axis}", dict(entry.alternatives)) for entry in diagnosis.effects]
        faults = {fault.name for fault in FAULTS}  # an effect with one of these as an alternative does not count
        shown = {name for name, others in alternatives if not faults & {*others}}
        words = [f"{fault.name}/{fault.channel}" for fault in diagnosis.faults]
        words += sorted({f"slip/{event.axis}" for event in diagnosis.events if event.kind == "slip"})
        words += [word for word in ("WRONG SIGN", "does not belong") if any(word in note for note in diagnosis.notes)]
        words += [f"or {other}/{axis}" for _, others in alternatives for other, axis in others.items()]
        text = ", ".join(words)
    true = {name for name in shown if name.split("/")[0] == true_effect}
    naming = next((words.split("|") for word, words in NAMING.items() if word in damage), [])
    named = told and any(word in text for word in naming)
    line = " | ".join((f"{kind} {seed}", damage, f"told {told}", f"shown {sorted(shown)}", text[:90]))
    return [{"kind": kind, "damage": damage, "told": told, "shown": shown, "text": text, "named": named,
             "false": bool(shown - true), "both": bool(true) and named, "line": line}]  # fmt: skip


def damage(damages: Words, open: str = "0:4", flown: str = "0:4", both: str = "0:4", workers: int = 1) -> None:
    """Run the benchmark."""
    kinds = {"open": open, "flown": flown, "both": both}
    names = [name for name in DAMAGES if not damages or any(word in name for word in damages)]
    jobs = [partial(diagnose_damaged, kind, seed, name)
            for name in names for kind, seeds in kinds.items() for seed in parse_range(seeds)]  # fmt: skip
    rows = run_jobs(jobs, workers)
    rows["pair"] = (rows.kind == "both") & rows.told & ~rows.text.str.startswith("refused")
    rows["alone"] = rows.kind != "both"
    lines = []
    for name, group in rows.groupby("damage", sort=False):
        told = group.alone & group.told
        counts = count(group.named[told]), count(group.both[group.pair])
        lines.append((name, group.alone.sum(), group.false.sum(), *counts))
    print("\n" + table(("damage", "rigs", "wrong effect shown", "named of those seen", "both named"), lines))
    sound = rows.damage == "none"
    bars = [
        Bar("damages that a told test sees are named", rows.named[rows.told & rows.alone], least=90.0),
        Bar("an effect of the plant shown", rows.false[~sound & rows.alone], 2.0),
        Bar("damage and a true effect both named", rows.both[rows.pair], least=80.0),
        Bar("undamaged rigs accused of an effect", rows.false[sound & rows.alone], 1.0),
        Bar("undamaged rigs accused of a damage", (rows.text != "")[sound & rows.alone], 1.0),
    ]
    print(f"\n{bar_table(bars)}")
