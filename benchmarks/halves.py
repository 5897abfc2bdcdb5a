"""Rigs whose logs are dealt into two halves, each diagnosed by itself: against the truth, and against one another.

    python -m benchmarks windy [--seeds 0:16] [--choose] [--colours ou,slow,swirl] [--quiet] [--unlogged] [--rate 100]
                               [--effects KIND] [--finer N] [--workers N] [--csv FILE] [--strength FILE]
    python -m benchmarks measured RIG... [--from SECONDS] [--workers N] [--download FOLDER] [--csv FILE]

*windy*: generated rigs in the air of measured ones, by its colour, under students' controllers. The odd seeds report;
rules are chosen on the even ones, ``--choose``. ``--quiet`` and ``--unlogged`` add rigs whose references are a fifth as
large, or are not logged; the controller's rate is 100 or 500 Hz; KIND is bare, coupled or effects of the generator,
drawn if not given. *measured*: a folder of logs each, ``RIG:-pitch`` if its pitch counts down; every second log makes a
half, and ``--download`` first fetches public logs of three rigs into a folder.

Printed is a line for each half, then for each kind of rig a table with its bars:

* gains over the truth, median and range (.97 to 1.03, .84 to 1.18); the truth is the slope at the logs' median voltage;
* share of the gains' 95 % intervals that hold the truth (.92 to .99), and their median half-widths over the truth;
* gains outside their interval and off by more than 15 %, of those determined from outside, and of those that rest on
  the noise model (1 in 50 each);
* halves that show a family of effects that the rig lacks (2 %);
* families shown, of those detectable (92 %): a fit that is told the structure gives them more than 8 nats;
* Jaccard index of the families that two halves show, where either shows any (.80), beside what sampling alone allows;
* gains of two halves within their joint 95 % interval, where both determine them (95 %);
* nats that the held-out logs gain by the correction; on measured rigs these are the logs of the other half;
* log-likelihood of a second controller's logs under the true plant less that under the delivered one [nats] (6).
"""

import sys
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise, product
from pathlib import Path
from time import process_time
from typing import Annotated, Any

import numpy as np
import pandas
import typer

from benchmarks.harness import Words, count, in_parallel, print_frame, span, table, write_strength
from benchmarks.measured import DownloadError
from benchmarks.measured import download as download_logs
from benchmarks.rigs import DETECTABLE, told_scores, windy_logs, windy_plant
from heli_identifier.errors import IdentifierError
from heli_identifier.online import GAINS
from heli_identifier.records import Log, LogFormat, read_logs
from heli_identifier.tracing import Determination, Diagnosis, diagnose
from heli_identifier.tracing.held_out import log_likelihood
from heli_identifier.tracing.helicopter import family_of
from heli_plant.effects import AXES
from tests.blind.air import COLOURS
from tests.blind.windy import windy_rig

FAR = 0.15
"""A gain that is stated as determined and outside its interval counts as wrong from this error on [1]."""

WINDY_LOGS = {"a": 5, "b": 5, "t": 2, "c": 4}
"""Logs of a windy rig by letter: two halves, held out, of the second controller."""

MARKS = {Determination.OUTSIDE: "", Determination.NOISE_MODEL: "*", Determination.NOT_DETERMINED: "?"}
"""Behind a gain in a line, by what it rests on."""

FIGURES = {"ahead_200ms": ".2 s ahead", "prediction_1s": "1 s ahead", "closed_loop_3s": "closed loop over 3 s"}
"""Errors that are printed of measured rigs, by their names in a diagnosis."""


Row = dict[str, Any]
"""One half of a rig's logs, and what was found in it."""


def half_of(
    kind: str, rig: str, name: str, training: Sequence[Log], held_out: Sequence[Log],
    judge: Callable[[Diagnosis], Row] | None = None,
) -> Row:  # fmt: skip
    """Diagnose one half; ``judge`` adds what follows from a truth that is known.

    ``gains``: of each its value and half its 95 % interval, over the size of a known truth, and what it rests on.
    """
    row: Row = {"kind": kind, "rig": rig, "half": name, "refused": "", "gains": []}
    began = process_time()
    try:
        found = diagnose(training, held_out=held_out)
    except IdentifierError as error:
        return {**row, "refused": str(error)}
    row |= {"seconds": process_time() - began, "nats": found.held_out.gain.value, "axes": found.axes}
    row |= {"shown": {effect.family for effect in found.effects}, "slopes": {}} | (judge(found) if judge else {})
    row["agreement"] = found.agreement.expected if found.agreement else np.nan
    for gain, report in ((gain, found.parameters[gain]) for gain in GAINS):
        slope, half = row["slopes"].get(gain, 1.0), 1.96 * (report.estimate.standard_error or 0.0)
        row["gains"].append((gain, report.estimate.value / slope, half / abs(slope), report.determination))
    return row


def line(row: Row) -> str:
    """Say a half in a line; ``*`` behind a gain that rests on the noise model, ``?`` behind one not determined."""
    if row["refused"]:
        return f"{row['rig']} {row['half']}: refused: {row['refused']}"
    words = [f"{gain} {value:.3g}±{half:.2g}{MARKS[rests]}" for gain, value, half, rests in row["gains"]]
    words.append(f"shown {', '.join(sorted(row['shown'])) or 'nothing'}")
    if row["slopes"]:
        for word, families in (("FALSE", row["shown"] - row["true"]), ("missed", row["detectable"] - row["shown"])):
            words += [f"{word} {', '.join(sorted(families))}"] if families else []
        words.append(f"loss {row['loss']:.1f}")
    return f"{row['rig']} {row['half']}: {'; '.join(words)}; held out {row['nats']:.0f} nats; {row['seconds']:.1f} s"


def windy_halves(
    colour: str, quiet: bool, rate: float, effects: str | None, finer: int, logged: bool, seed: int
) -> list[Row]:
    """Make a windy rig, diagnose its halves, and hold them against the truth.

    That are families of its effects; the scores [nats] of those in a fit that is told the structure; slopes of the
    gains; the log-likelihood that a second controller's logs lose under the delivered plant.
    """
    rig = windy_rig(seed, colour, quiet, rate, effects, logged, WINDY_LOGS, finer=finer)
    fields = tuple(name.replace("/", "_") for name in rig.truth.effects)
    plant, other = windy_plant(rig), windy_logs(rig, "c")
    words = (
        colour, f"{rate:g} Hz", "quiet" * quiet, "not logged" * (not logged), effects or "",
        f"encoders {finer} times finer" * (finer > 1),
    )  # fmt: skip

    def judge(found: Diagnosis) -> Row:
        told: dict[str, float] = {}
        for field, score in told_scores(training, fields).items():
            told[family_of(field)] = max(score, told.get(family_of(field), score))
        return {
            "slopes": rig.truth.slopes(float(np.median(np.concatenate([log.voltages for log in training])))),
            "true": {*map(family_of, fields)}, "told": told,
            "detectable": {family for family, score in told.items() if score > DETECTABLE},
            "loss": log_likelihood(plant, other) - log_likelihood(found.plant_after, other),
        }  # fmt: skip

    rows = []
    for letter in "ab":
        training = windy_logs(rig, letter)
        kind = " ".join(filter(None, words))
        rows.append(half_of(kind, f"{colour} {seed}", letter, training, windy_logs(rig, "t"), judge))
    return rows


def rig_logs(rig: str, start: float) -> list[Log]:
    """Read the logs of a measured rig from ``start`` [s] on."""
    folder, _, mirrored = rig.partition(":")
    files = sorted(path for path in Path(folder).iterdir() if path.name.endswith((".csv", ".csv.gz", ".mat")))
    return list(read_logs(files, LogFormat(signs={"pitch": -1} if mirrored else {}), start=start or None))


def measured_halves(rig: str, start: float) -> list[Row]:
    """Diagnose each half of a measured rig's logs, the other half held out."""
    logs, name = rig_logs(rig, start), Path(rig.partition(":")[0]).name
    return [half_of("measured", name, "ab"[k], logs[k::2], logs[1 - k :: 2]) for k in (0, 1)]


# --- tables ------------------------------------------------------------------------------------------------------


def gains_of(rows: Sequence[Row]) -> pandas.DataFrame:
    """Give a row per half and gain, over the truth where that is known."""
    found = [(row["kind"], row["rig"], row["half"], *own[:-1], own[-1].value) for row in rows for own in row["gains"]]
    return pandas.DataFrame(found, columns=["kind", "rig", "half", "gain", "ratio", "half_width", "rests"])


def errors_of(rows: Sequence[Row]) -> pandas.DataFrame:
    """Give a row per half and axis: errors [mrad] .2 s and 1 s ahead and of the closed loop on the held-out logs."""
    found = []
    for row, axis in product((row for row in rows if not row["refused"]), AXES):
        report = row["axes"][axis]
        for figure, what in FIGURES.items():
            stages = [getattr(own, figure) for own in (report.before, report.after, report.noise_floor)]
            known = [1e3 * own.value if own and own.is_known else np.nan for own in stages]
            found.append((row["rig"], row["half"], axis, what, *known))
    return pandas.DataFrame(found, columns=["rig", "half", "axis", "error", "before", "after", "floor"])


def summary(rows: Sequence[Row]) -> str:
    """Give the table of one kind of rig."""
    done, gains = [row for row in rows if not row["refused"]], gains_of(rows)
    lines = [("diagnosed, s each", f"{len(done)} of {len(rows)}, {np.median([row['seconds'] for row in done]):.1f}")]
    if done and done[0]["slopes"]:
        off, missed = (gains.ratio - 1.0).abs(), (gains.ratio - 1.0).abs() > gains.half_width
        medians = gains.groupby("gain", sort=False)[["ratio", "half_width"]].median().map("{:.3f}".format)
        wrong = (missed & (off > FAR)).groupby(gains.rests, sort=False).agg(["sum", "size"])
        loss = [row["loss"] for row in done]
        found, told = (sum(len(own) for own in sets) for sets in zip(
            *((row["shown"] & row["detectable"], row["detectable"]) for row in done), strict=True))  # fmt: skip
        widths = " ".join(medians.half_width)
        lines += [
            ("gains over the truth", f"{' '.join(medians.ratio)}; {gains.ratio.min():.2f} to {gains.ratio.max():.2f}"),
            ("intervals cover; half-widths", f"{1.0 - missed.mean():.3f} of {missed.size}; {widths}"),
            ("wrong gains", "; ".join(f"{own['sum']} of {own['size']} {rests}" for rests, own in wrong.iterrows())),
            ("loss, median; largest [nats]", f"{np.median(loss):.1f}; {np.max(loss):.1f}"),
            ("halves with something false", count(bool(row["shown"] - row["true"]) for row in done)),
            ("detectable effects shown", f"{found} of {told}"),
        ]
    shown = [(a["shown"], b["shown"]) for a, b in pairwise(done) if a["rig"] == b["rig"] and a["shown"] | b["shown"]]
    if shown:
        index = np.mean([len(a & b) / len(a | b) for a, b in shown])
        expected = np.nanmean([row["agreement"] for row in done])
        lines.append(("halves agree; expected", f"{index:.2f}; {expected:.2f} ({len(shown)} rigs)"))
    sure = gains[gains.rests != Determination.NOT_DETERMINED.value].groupby(["rig", "gain"])
    both = [own for _, own in sure if len(own) == 2]
    agree = count(abs(own.ratio.diff().iloc[1]) <= np.hypot(*own.half_width) for own in both)
    nats = [row["nats"] for row in done]
    lines.append(("gains within their joint interval", agree))
    lines.append(("held-out gain above -3 nats; median", f"{count(n > -3.0 for n in nats)}; {np.median(nats):.0f}"))
    return table(("what", rows[0]["kind"]), lines)


def diagnosed(jobs: Sequence[partial[list[Row]]], workers: int) -> list[Row]:
    """Diagnose; print a line for each half and a table for each kind."""
    done: list[Row] = []
    for rows in in_parallel(partial.__call__, jobs, workers):
        done += rows
        print(*map(line, rows), sep="\n", flush=True)
    for kind in dict.fromkeys(row["kind"] for row in done):
        print("\n" + summary([row for row in done if row["kind"] == kind]))
    return done


# --- commands ----------------------------------------------------------------------------------------------------


def windy(
    seeds: str = "0:16", choose: bool = False, colours: str = ",".join(COLOURS), quiet: bool = False,
    unlogged: bool = False, rate: float = 100.0, effects: str | None = None, finer: int = 1, workers: int = 1,
    csv: Path | None = None, strength: Path | None = None,
) -> None:  # fmt: skip
    """Diagnose windy rigs; write the gains over the truth to ``csv``, told scores and what is shown to ``strength``."""
    chosen = [seed for seed in span(seeds) if seed % 2 == (not choose)]
    kinds = product(colours.split(","), (False, True)[: 1 + quiet], (True, False)[: 1 + unlogged])
    jobs = [partial(windy_halves, colour, calm, rate, effects, finer, logged, seed)
            for colour, calm, logged in kinds for seed in chosen]  # fmt: skip
    done = diagnosed(jobs, workers)
    if csv:
        gains_of(done).to_csv(csv, index=False, float_format="%.4f")
    if strength:
        write_strength((("windy", f"{row['kind']} {row['rig']} {row['half']}", family, score, family in row["shown"])
                        for row in done for family, score in row.get("told", {}).items()), strength)  # fmt: skip


def measured(
    rigs: Words,
    start: Annotated[float, typer.Option("--from")] = 6.0, workers: int = 1, csv: Path | None = None,
    download: Path | None = None,
) -> None:  # fmt: skip
    """Diagnose measured rigs; write the errors to the file ``csv``."""
    try:
        rigs += map(str, download_logs(download) if download else ())
    except DownloadError as error:
        sys.exit(str(error))
    errors = errors_of(diagnosed([partial(measured_halves, rig, start) for rig in rigs], workers))
    print("\nErrors on the other half [mrad]\n")
    print_frame(errors, csv)
