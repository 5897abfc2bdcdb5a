"""Rigs whose logs are dealt into two halves, each diagnosed by itself: against the truth, and against one another.

*windy*: generated rigs in the air of measured ones, by its colour, under students' controllers. Odd seeds report, even
ones serve to choose rules (``--choose``). ``--quiet`` and ``--unlogged`` add rigs with references a fifth as large, or
not logged. ``--rate`` is 100 or 500 Hz, ``--effects`` are bare, coupled or those of the generator, drawn if not given.
Encoders are ``--finer`` times finer, and their lines ``--shake`` [counts]. ``--pushed``: a hand pushes four logs of a
half, and one held out.

*measured*: folders of logs, ``RIG:-pitch`` if its pitch counts down; every second log makes a half, after a shuffle in
each of ``--deals`` but 0, with ``--few`` logs at most. ``--download`` first fetches logs of three rigs into a folder.

Behind a gain stands ``*`` if it rests on the noise model and ``?`` if it is not determined. Its truth is the slope at
the logs' median voltage, that of all logs for measured rigs, whose held-out logs are the other half. It is *wrong*
outside of its interval and off by more than 15 %. A family of effects is *detectable* if a fit that is told the
structure gives it more than 8 nats. The Jaccard index of two halves is 1 where neither shows anything. *Lost* is the
log-likelihood of a second controller's logs under the true plant less that under the corrected one.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pandas

from benchmarks.harness import STRENGTH, Bar, Row, StartTime, Words, bar_table, parse_range, print_frame, run_jobs
from benchmarks.measured import download_logs, measured_rig
from benchmarks.rigs import DETECTABLE, compare, told_scores, windy_logs, windy_plant
from heli_identifier.errors import IdentifierError
from heli_identifier.online import GAINS
from heli_identifier.records import Log
from heli_identifier.results import Determination, Diagnosis, diagnose
from heli_identifier.results.held_out import log_likelihood
from heli_identifier.tracing.helicopter import LAG_FIELD, helicopter
from heli_plant.effects import AXES, effect_of
from tests.blind.air import COLOURS
from tests.blind.plant import Push
from tests.blind.windy import WindyRig, windy_rig

MARKS = {Determination.OUTSIDE: "", Determination.NOISE_MODEL: "*", Determination.NOT_DETERMINED: "?"}
"""Behind a gain in a line, by what it rests on."""

FIGURES = {"ahead_200ms": ".2 s ahead", "prediction_1s": "1 s ahead", "closed_loop_3s": "closed loop over 3 s"}
"""Errors that are printed of measured rigs, by their names in a diagnosis."""


def draw_pushes(seed: int) -> dict[str, Push]:
    """Draw a push for every log: its axis, a length of .3 to 1.2 s, a size of .15 to 1.5 rad/s^2 of either sign."""
    rng, names = np.random.default_rng(7000 + seed), ("a1", "a2", "a3", "a4", "b1", "b2", "b3", "b4", "t1")
    starts, lengths = rng.uniform(8.0, 22.0, len(names)), rng.uniform(0.3, 1.2, len(names))
    sizes = 0.15 * 10.0 ** rng.uniform(size=len(names)) * rng.choice((-1.0, 1.0), len(names))
    values = zip(rng.choice(AXES, len(names)).tolist(), starts, starts + lengths, sizes, strict=True)
    return {name: Push(*push) for name, push in zip(names, values, strict=True)}


def diagnose_half(
    kind: str, rig: str, name: str, training: Sequence[Log], held_out: Sequence[Log], truth: WindyRig | None = None,
    pushes: Mapping[str, Push] = {},
) -> Row:  # fmt: skip
    """Diagnose one half of a rig's logs, and compare it with the truth if that is known.

    ``gains``: each over the truth, and what it rests on; ``told``: scores [nats] of true families in a told fit.
    """
    row: Row = {"kind": kind, "rig": rig, "half": name, "refused": False}
    try:
        diagnosis = diagnose(training, held_out=held_out)
    except IdentifierError as error:
        return row | {"refused": True, "line": f"{rig} {name}: refused: {error}"}
    shown = {effect.family for effect in diagnosis.effects}
    point = diagnosis.settings["operating_point"]
    slopes = truth.truth.slopes(point) if truth else slope_ratios(diagnosis, (*training, *held_out))
    gains = [{"gain": gain, **compare(diagnosis.parameters[gain].estimate, slopes[gain]),
              "rests": diagnosis.parameters[gain].determination} for gain in GAINS]  # fmt: skip
    words = [f"{gain['gain']} {gain['ratio']:.3g}±{gain['half_width']:.2g}{MARKS[gain['rests']]}" for gain in gains]
    words.append(f"shown {', '.join(sorted(shown)) or 'nothing'}")
    row |= {"shown": shown, "gains": gains, "nats": diagnosis.held_out.gain.value, "axes": diagnosis.axes,
            "agreement": diagnosis.agreement.expected if diagnosis.agreement else np.nan}  # fmt: skip
    events = [event for event in diagnosis.events if event.kind == "force"]
    true_pushes = {log.name: pushes[log.name] for log in (*training, *held_out) if log.name in pushes}
    matches = [[e for e in events if e.log == log and e.start < push.end + 0.3 and e.end > push.start - 0.3]
               for log, push in true_pushes.items()]  # fmt: skip
    row |= {"pushed": [any(event.axis == push.axis for event in of_push)
                       for of_push, push in zip(matches, true_pushes.values(), strict=True)],
            "untouched": len(events) - sum(map(len, matches))}  # fmt: skip
    if truth:
        fields, told = [effect.replace("/", "_") for effect in truth.truth.effects], dict[str, float]()
        for field, score in told_scores(training, fields).items():
            family = effect_of(field).family
            told[family] = max(score, told.get(family, score))
        true = {effect_of(field).family for field in (*fields, LAG_FIELD)}  # every rig has its own lag of the motors
        false, other_logs = shown - true, windy_logs(truth, "c")
        loss = log_likelihood(windy_plant(truth), other_logs) - log_likelihood(diagnosis.plant_after, other_logs)
        row |= {"told": told, "false": bool(false), "loss": loss}
        missed = {family for family, score in told.items() if score > DETECTABLE} - shown
        for word, families in (("FALSE", false), ("missed", missed)):
            words += [f"{word} {', '.join(sorted(families))}"] if families else []
        words.append(f"loss {loss:.1f}")
    return row | {"line": f"{rig} {name}: {'; '.join(words)}; held out {row['nats']:.0f} nats"}


def slope_ratios(diagnosis: Diagnosis, logs: Sequence[Log]) -> dict[str, float]:
    """Return the slopes of the gains at a diagnosis' operating point over those at the median voltage of ``logs``."""
    at_median = helicopter(logs)
    at_point, p = replace(at_median, operating_point=diagnosis.settings["operating_point"]), diagnosis.plant_after
    return {gain: at_point.read(p, gain) / at_median.read(p, gain) for gain in GAINS}


def windy_halves(
    colour: str, quiet: bool, rate: float, effects: str | None, finer: int, pushed: bool, shake: float, logged: bool,
    seed: int,
) -> list[Row]:  # fmt: skip
    """Make a windy rig and diagnose its halves a and b; logs t are held out, logs c have the second controller."""
    pushes, counts = draw_pushes(seed) if pushed else {}, {"a": 5, "b": 5, "t": 2, "c": 4}
    by_log = {name: (push,) for name, push in pushes.items()}
    rig = windy_rig(seed, colour, quiet, rate, effects, logged, counts, by_log, finer, shake)
    words = (colour, f"{rate:g} Hz", "quiet" * quiet, "not logged" * (not logged), effects or "",
        f"encoders finer by {finer}" * (finer > 1), f"shaking by {shake:g} counts" * (shake != 0.25), "pushed" * pushed,
    )  # fmt: skip
    kind, title, held_out = " ".join(filter(None, words)), f"{colour} {seed}", windy_logs(rig, "t")
    return [diagnose_half(kind, title, name, windy_logs(rig, name), held_out, rig, pushes) for name in "ab"]


def measured_halves(rig: str, start: float, few: int | None, deal: int) -> list[Row]:
    """Diagnose each half of a measured rig's logs, the other half held out, shuffled for a ``deal`` above 0."""
    name, logs = measured_rig(rig, start)
    order = np.random.default_rng(deal).permutation(len(logs)) if deal else np.arange(len(logs))
    halves = [[logs[i] for i in sorted(order[k::2][:few])] for k in (0, 1)]
    name += f" deal {deal}" * bool(deal)
    return [diagnose_half("measured", name, "ab"[k], halves[k], halves[1 - k]) for k in (0, 1)]


def gains_of(rows: pandas.DataFrame) -> pandas.DataFrame:
    """Return a row per half and gain, over the truth if that is known."""
    heads = rows[["kind", "rig", "half"]].to_dict("records")
    return pandas.DataFrame([{**head, **gain} for head, gains in zip(heads, rows.gains, strict=True) for gain in gains])


def errors_of(rows: pandas.DataFrame) -> pandas.DataFrame:
    """Return a row per half and axis: errors [mrad] .2 s and 1 s ahead and of the closed loop on the held-out logs."""
    lines = []
    for (_, row), axis, (figure, title) in product(rows.iterrows(), AXES, FIGURES.items()):
        stages = [getattr(getattr(row["axes"][axis], stage), figure) for stage in ("before", "after", "noise_floor")]
        errors = [1e3 * error.value if error and error.is_known else np.nan for error in stages]
        lines.append((row.rig, row.half, axis, title, *errors))
    return pandas.DataFrame(lines, columns=["rig", "half", "axis", "error", "before", "after", "floor"])


def bars(done: pandas.DataFrame) -> Iterator[Bar]:
    """Yield the bars of the halves of one kind of rig."""
    gains, truth_known = gains_of(done), "told" in done
    if truth_known:
        for (gain, rows), widest in zip(gains.groupby("gain", sort=False), (0.15, 0.13, 0.05), strict=True):
            yield Bar(f"{gain} over the truth, median", rows.ratio.median(), 1.03, least=0.97)
            yield Bar(f"half-width of {gain} over the truth, median", rows.half_width.median(), widest)
        yield Bar("gains over the truth, least", gains.ratio.min(), least=0.84)
        yield Bar("gains over the truth, largest", gains.ratio.max(), 1.18)
        yield Bar("intervals of gains that cover", gains.covers, 99.0, least=92.0)
        wrong = ~gains.covers & ((gains.ratio - 1.0).abs() > 0.15)
        for rests, flags in wrong.groupby(gains.rests, sort=False):
            yield Bar(f"gains that are wrong: {rests}", flags, np.inf if rests == Determination.NOT_DETERMINED else 2.0)
        if pushes := [is_found for of_half in done.pushed for is_found in of_half]:
            yield Bar("pushes that are found", pushes)
        yield Bar("halves with a push that nobody gave", done.untouched > 0)
        yield Bar("lost under a second controller, median", done.loss.median(), 6.0, "nats")
        yield Bar("lost under a second controller, largest", done.loss.max(), unit="nats")
        yield Bar("halves with something false shown", done.false, 2.0)
        shown = [family in row.shown for _, row in done.iterrows() for family, score in row.told.items()
                 if score > DETECTABLE]  # fmt: skip
        yield Bar("detectable effects that are shown", shown, least=92.0)
    pairs = [halves.shown for _, halves in done.groupby("rig") if len(halves) == 2]
    if pairs:
        overlaps = [len(a & b) / len(a | b) for a, b in pairs if a | b]
        index = (sum(overlaps) + len(pairs) - len(overlaps)) / len(pairs)
        yield Bar(f"Jaccard index of two halves, {len(pairs)} rigs", index, least=0.8 if truth_known else -np.inf)
        yield Bar("the same, expected from sampling", done.agreement.mean(), index + 0.1)
        yield Bar(f"the index of the {len(overlaps)} rigs that show anything", float(np.mean(overlaps or [np.nan])))
    determined = gains[gains.rests != Determination.NOT_DETERMINED.value].groupby(["rig", "gain"])
    agree = [abs(pair.ratio.diff().iloc[1]) <= np.hypot(*pair.half_width) for _, pair in determined if len(pair) == 2]
    yield Bar("gains that both halves determine within their joint interval", agree, least=95.0)
    yield Bar("gain of the held-out logs above -3 nats", done.nats > -3.0, least=95.0)
    yield Bar("gain of the held-out logs, median", done.nats.median(), least=-np.inf if truth_known else 40.0)


def run_and_print(jobs: Sequence[partial[list[Row]]], workers: int) -> pandas.DataFrame:
    """Run jobs; print a line for each half and a table for each kind; return the halves that were not refused."""
    rows = run_jobs(jobs, workers)
    done = rows[~rows.refused]
    for kind, halves in done.groupby("kind", sort=False):
        print(f"\n{kind}: {len(halves)} of {sum(rows.kind == kind)} halves diagnosed\n\n{bar_table(bars(halves))}")
    return done


def windy(
    seeds: str = "0:16", choose: bool = False, colours: str = ",".join(COLOURS), quiet: bool = False,
    unlogged: bool = False, rate: float = 100.0, effects: str | None = None, finer: int = 1,
    pushed: bool = False, shake: float = 0.25, workers: int = 1, csv: Path | None = None, strength: Path | None = None,
) -> None:  # fmt: skip
    """Diagnose windy rigs; write the gains over the truth to ``csv``, told scores and what is shown to ``strength``."""
    kinds = product(colours.split(","), (False, True)[: 1 + quiet], (True, False)[: 1 + unlogged])
    jobs = [partial(windy_halves, colour, calm, rate, effects, finer, pushed, shake, logged, seed)
            for colour, calm, logged in kinds for seed in parse_range(seeds) if seed % 2 == (not choose)]  # fmt: skip
    done = run_and_print(jobs, workers)
    if csv:
        gains_of(done).drop(columns=["covers", "determined"]).to_csv(csv, index=False, float_format="%.4f")
    if strength:
        rows = [("windy", f"{row.kind} {row.rig} {row.half}", family, score, int(family in row.shown))
                for _, row in done.iterrows() for family, score in row.told.items()]  # fmt: skip
        pandas.DataFrame(rows, columns=STRENGTH).to_csv(strength, index=False, float_format="%.4g")


def measured(
    rigs: Words, start: StartTime = 6.0, deals: str = "0:1", few: int | None = None, workers: int = 1,
    csv: Path | None = None, download: Path | None = None,
) -> None:  # fmt: skip
    """Diagnose measured rigs; write the errors to the file ``csv``."""
    rigs += map(str, download_logs(download) if download else ())
    jobs = [partial(measured_halves, rig, start, few, deal) for rig, deal in product(rigs, parse_range(deals))]
    errors = errors_of(run_and_print(jobs, workers))
    print("\nErrors on the other half [mrad]\n")
    print_frame(errors, csv)
