"""Rigs whose logs are dealt into two halves, each diagnosed by itself: against the truth, and against one another.

    python -m benchmarks windy [--seeds 0:16] [--choose] [--colours ou,slow,swirl] [--quiet] [--unlogged] [--rate 100]
                               [--effects KIND] [--workers N] [--csv FILE]
    python -m benchmarks measured RIG... [--from SECONDS] [--workers N] [--download FOLDER] [--csv FILE]
                                  [--online]

*windy*: generated rigs in the air of measured ones, under students' controllers. The odd seeds report; rules are chosen
on the even ones, ``--choose``. *measured*: a folder of logs each, ``RIG:-pitch`` if its
pitch counts down; every second log makes a half, and ``--download`` fetches public logs of three rigs. ``--online``
compares the 95 % intervals of `heli identify` with those of the diagnosis' plant, all logs together (9 of 10 overlap).

Printed is a line for each half, then for each kind of rig a table with its bars:

* gains over the truth, median and range (.97 to 1.03, .84 to 1.18); the truth is the slope at the logs' mean voltage;
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

import csv
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from pathlib import Path
from time import process_time

import numpy as np

from benchmarks.harness import in_parallel, options, span, table
from benchmarks.measured import DownloadError, download
from benchmarks.rigs import DETECTABLE, likelihood_of, told_scores, windy_logs, windy_plant
from heli_identifier.errors import IdentifierError
from heli_identifier.online import PREDICTION_ERROR
from heli_identifier.records import Log, LogFormat, read_logs
from heli_identifier.tools.identification import identify
from heli_identifier.tracing import Determination, Diagnosis, diagnose, fit, identify_plant
from heli_identifier.tracing.helicopter import family_of
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters
from tests.blind.air import COLOURS
from tests.blind.windy import windy_rig

GAINS = ("k_x", "k_z", "k_y")

FAR = 0.15
"""A gain that is stated as determined and outside its interval counts as wrong from this error on [1]."""

WINDY_LOGS = {"a": 5, "b": 5, "t": 2, "c": 4}
"""Logs of a windy rig by letter: two halves, held out, of the second controller."""


@dataclass(frozen=True)
class Known:
    """What is known of a generated rig.

    ``effects`` by field; ``slopes`` of the gains, ``plant`` and ``other``, logs of a second controller, where given.
    """

    effects: tuple[str, ...]
    families: frozenset[str]
    slopes: Mapping[str, float] = field(default_factory=dict)
    plant: PlantParameters | None = None
    other: Sequence[Log] = ()


@dataclass(frozen=True)
class Half:
    """One half of a rig's logs, diagnosed; ``found`` is None where it was refused."""

    kind: str
    rig: str
    name: str
    truth: Known | None
    found: Diagnosis | None
    refused: str = ""
    detectable: frozenset[str] = frozenset()
    loss: float = float("nan")
    seconds: float = 0.0

    @property
    def shown(self) -> frozenset[str]:
        """Families of the effects that are shown."""
        return frozenset(effect.family for effect in self.found.effects) if self.found else frozenset()

    def gain(self, name: str) -> tuple[float, float, Determination]:
        """Give a gain, half its 95 % interval, and what it rests on."""
        assert self.found is not None
        report = self.found.parameters[name]
        return report.estimate.value, 1.96 * (report.estimate.standard_error or 0.0), report.determination

    @property
    def false(self) -> frozenset[str]:
        """Families shown that the rig lacks."""
        return self.shown - self.truth.families if self.truth else frozenset()

    def line(self) -> str:
        """Say it in a line; ``*`` behind a gain that rests on the noise model, ``?`` behind one not determined."""
        if self.found is None:
            return f"{self.rig} {self.name}: refused: {self.refused}"
        marks = {Determination.OUTSIDE: "", Determination.NOISE_MODEL: "*", Determination.NOT_DETERMINED: "?"}
        slopes = self.truth.slopes if self.truth else {}
        gains = [
            f"{name} {value / slopes.get(name, 1.0):.3g}±{half / abs(slopes.get(name, 1.0)):.2g}{marks[rests]}"
            for name, (value, half, rests) in ((name, self.gain(name)) for name in GAINS)
        ]
        said = [f"FALSE {', '.join(sorted(self.false))}"] if self.false else []
        said += [f"missed {', '.join(sorted(self.detectable - self.shown))}"] if self.detectable - self.shown else []
        said += [f"loss {self.loss:.1f}"] if np.isfinite(self.loss) else []
        words = (*gains, f"shown {', '.join(sorted(self.shown)) or 'nothing'}", *said,
                 f"held out {self.found.held_out.gain.value:.0f} nats", f"{self.seconds:.1f} s")  # fmt: skip
        return f"{self.rig} {self.name}: {'; '.join(words)}"


def half_of(
    kind: str, rig: str, name: str, training: Sequence[Log], held_out: Sequence[Log], truth: Known | None
) -> Half:
    """Diagnose one half and hold it against the truth."""
    began = process_time()
    try:
        found = diagnose(training, held_out=held_out)
    except IdentifierError as error:
        return Half(kind, rig, name, truth, None, str(error))
    half = Half(kind, rig, name, truth, found, seconds=process_time() - began)
    if truth is None:
        return half
    scores = told_scores(training, truth.effects)
    half = replace(half, detectable=frozenset(family_of(f) for f, score in scores.items() if score > DETECTABLE))
    if truth.plant is None:
        return half
    return replace(half, loss=nats_under(truth.plant, truth.other) - nats_under(found.plant_after, truth.other))


def nats_under(plant: PlantParameters, logs: Sequence[Log]) -> float:
    """Log-likelihood of logs under a plant, air and offsets fitted to them [nats]."""
    likelihood = likelihood_of(logs)
    rig = replace(likelihood.rig, parameters=plant, base=())
    return -fit(type(likelihood)(rig, likelihood.records), ()).value


# --- where the rigs come from ------------------------------------------------------------------------------------


def windy_halves(colour: str, quiet: bool, rate: float, effects: str | None, logged: bool, seed: int) -> list[Half]:
    """Make a windy rig and diagnose its halves."""
    rig = windy_rig(seed, colour, quiet, rate, effects, logged, WINDY_LOGS)
    fields = tuple(name.replace("/", "_") for name in rig.truth.effects)
    plant, held_out, other = windy_plant(rig), windy_logs(rig, "t"), windy_logs(rig, "c")
    words = (colour, f"{rate:g} Hz", "quiet" * quiet, "not logged" * (not logged), effects or "")
    kind, halves = " ".join(filter(None, words)), []
    for letter in "ab":
        training = windy_logs(rig, letter)
        slopes = rig.truth.slopes(float(np.mean(np.concatenate([log.voltages for log in training]))))
        known = Known(fields, frozenset(map(family_of, fields)), slopes, plant, other)
        halves.append(half_of(kind, f"{colour} {seed}", letter, training, held_out, known))
    return halves


def rig_logs(rig: str, start: float) -> list[Log]:
    """Read the logs of a measured rig from ``start`` [s] on."""
    folder, _, mirrored = rig.partition(":")
    files = sorted(path for path in Path(folder).iterdir() if path.name.endswith((".csv", ".csv.gz", ".mat")))
    return list(read_logs(files, LogFormat(signs={"pitch": -1} if mirrored else {}), start=start or None))


def measured_halves(rig: str, start: float) -> list[Half]:
    """Diagnose each half of a measured rig's logs, the other half held out."""
    logs, name = rig_logs(rig, start), Path(rig.partition(":")[0]).name
    return [half_of("measured", name, "ab"[k], logs[k::2], logs[1 - k :: 2], None) for k in (0, 1)]


def online(rig: str, start: float) -> tuple[str, int, int, str]:
    """Count the parameters whose intervals overlap on line and off line; give rig, overlapping, all, and the others."""
    logs = rig_logs(rig, start)
    found = identify(logs, method=PREDICTION_ERROR).estimates
    plant = {name: report.estimate for name, report in identify_plant(logs).parameters.items() if name in found}
    apart = [
        f"{name} {found[name].value:.3g} for {own.value:.3g}"
        for name, own in plant.items()
        if max(own.interval[0], found[name].interval[0]) > min(own.interval[1], found[name].interval[1])
    ]
    return Path(rig).name, len(plant) - len(apart), len(plant), "; ".join(apart)


# --- tables ------------------------------------------------------------------------------------------------------


def summary(halves: Sequence[Half]) -> str:
    """Give the table of one kind of rig."""
    done = [half for half in halves if half.found]
    rows = [("diagnosed, s each", f"{len(done)} of {len(halves)}, {np.median([half.seconds for half in done]):.1f}")]
    known = [half for half in done if half.truth]
    rows += _of_gains([half for half in known if half.truth and half.truth.slopes]) + _of_names(known)
    pairs = [(a, b) for a, b in zip(done[:-1], done[1:], strict=True) if a.rig == b.rig]
    either = [(a, b) for a, b in pairs if a.shown | b.shown]
    if either:
        index = np.mean([len(a.shown & b.shown) / len(a.shown | b.shown) for a, b in either])
        expected = [half.found.agreement.expected for half in done if half.found and half.found.agreement]
        said = f"{index:.2f}; {np.mean(expected or [np.nan]):.2f} ({len(either)} rigs)"
        rows.append(("halves agree; expected", said))
    agree = [
        abs(a.gain(name)[0] - b.gain(name)[0]) <= np.hypot(a.gain(name)[1], b.gain(name)[1])
        for (a, b), name in product(pairs, GAINS)
        if Determination.NOT_DETERMINED not in (a.gain(name)[2], b.gain(name)[2])
    ]
    rows.append(("gains within their joint interval", f"{sum(agree)} of {len(agree)}"))
    nats = [half.found.held_out.gain.value for half in done if half.found]
    count = f"{sum(n > -3.0 for n in nats)} of {len(nats)}; {np.median(nats):.0f}"
    rows.append(("held-out gain above -3 nats; median", count))
    return table(("what", halves[0].kind), rows)


def _of_gains(halves: Sequence[Half]) -> list[tuple[str, str]]:
    if not halves:
        return []
    slopes = np.array([[half.truth.slopes[name] for name in GAINS] for half in halves if half.truth])
    gains = np.array([[half.gain(name)[:2] for name in GAINS] for half in halves]) / np.abs(slopes)[..., None]
    ratio, width = gains[..., 0] * np.sign(slopes), gains[..., 1]
    rests = np.array([[half.gain(name)[2].value for name in GAINS] for half in halves])
    missed = np.abs(ratio - 1.0) > width
    wrong = missed & (np.abs(ratio - 1.0) > FAR)
    medians, widths = (" ".join(f"{m:.3f}" for m in np.median(values, axis=0)) for values in (ratio, width))
    stated = "; ".join(f"{wrong[rests == d].sum()} of {(rests == d).sum()} {d.value}" for d in Determination)
    loss = [half.loss for half in halves]
    return [
        ("gains over the truth; range", f"{medians}; {ratio.min():.2f} to {ratio.max():.2f}"),
        ("intervals cover; half-widths", f"{1.0 - missed.mean():.3f} of {missed.size}; {widths}"),
        ("wrong gains", stated),
        ("loss, median; largest [nats]", f"{np.median(loss):.1f}; {np.max(loss):.1f}"),
    ]


def _of_names(halves: Sequence[Half]) -> list[tuple[str, str]]:
    if not halves:
        return []
    found, detectable = (sum(len(names) for names in own) for own in zip(
        *((half.shown & half.detectable, half.detectable) for half in halves), strict=True))  # fmt: skip
    return [
        ("halves with something false", f"{sum(bool(half.false) for half in halves)} of {len(halves)}"),
        ("detectable effects shown", f"{found} of {detectable}"),
    ]


def errors(half: Half, axis: str) -> tuple[float, float, float]:
    """Give the errors 1 s ahead on the held-out logs [mrad]: before, after, noise floor; NaN if that is not known."""
    assert half.found is not None
    report = half.found.axes[axis]
    found = [1e3 * own.prediction_1s.value for own in (report.before, report.after, report.noise_floor)]
    return found[0], found[1], found[2] or float("nan")


def errors_table(halves: Sequence[Half]) -> str:
    """Give these errors as a table [mrad]."""
    cell = "{:.3g}, {:.3g} ({:.3g})"
    rows = [(f"{half.rig} {half.name}", *(cell.format(*errors(half, axis)) for axis in AXES)) for half in halves]
    return table(("half", *(f"{axis}, before, after (floor) [mrad]" for axis in AXES)), rows)


def closed_loop_table(halves: Sequence[Half]) -> str:
    """Give the closed-loop errors over 3 s before and after [mrad], where the controller's laws were recovered."""
    rows = []
    for half in halves:
        assert half.found is not None
        pairs = [
            (half.found.axes[axis].before.closed_loop_3s, half.found.axes[axis].after.closed_loop_3s) for axis in AXES
        ]
        cells = [f"{1e3 * old.value:.3g}, {1e3 * new.value:.3g}" if old and new else "" for old, new in pairs]
        rows.append((f"{half.rig} {half.name}", *cells))
    return table(("half", *(f"{axis}, closed loop over 3 s, before, after [mrad]" for axis in AXES)), rows)


def write_gains(path: Path, halves: Sequence[Half]) -> None:
    """Write the gains over the truth."""
    rows = []
    for half, name in product(halves, GAINS):
        assert half.truth is not None
        (value, width, rests), slope = half.gain(name), half.truth.slopes[name]
        cells = (f"{value / slope:.4f}", f"{width / abs(slope):.4f}", rests.value)
        rows.append((half.kind, half.rig, half.name, name, *cells))
    _write(path, ("kind", "rig", "half", "gain", "ratio", "half_width", "rests"), rows)


def write_errors(path: Path, halves: Sequence[Half]) -> None:
    """Write the errors 1 s ahead [mrad]."""
    rows = [
        (half.rig, half.name, axis, *(f"{value:.4g}" for value in errors(half, axis)))
        for half, axis in product(halves, AXES)
    ]
    _write(path, ("rig", "half", "axis", "before", "after", "floor"), rows)


def _write(path: Path, head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([head, *rows])


def _run(jobs: Sequence[partial[list[Half]]], workers: int) -> dict[str, list[Half]]:
    kinds: dict[str, list[Half]] = {}
    for halves in in_parallel(partial.__call__, jobs, workers):
        for half in halves:
            kinds.setdefault(half.kind, []).append(half)
            print(half.line(), flush=True)
    print(*("\n" + summary(halves) for halves in kinds.values()), sep="\n")
    return kinds


# --- commands ----------------------------------------------------------------------------------------------------


def windy(arguments: Sequence[str]) -> None:
    """Windy rigs."""
    asked = options(
        arguments, "windy", __doc__,
        seeds=("0:16", "first:behind the last"),
        choose=(False, "even seeds, to choose rules on; else the odd ones"),
        colours=(",".join(COLOURS), "kinds of air"),
        quiet=(False, "quiet rigs as well"),
        unlogged=(False, "rigs whose references are not logged as well"),
        rate=(100.0, "of the controller [Hz], 100 or 500"),
        effects=(str, "bare, coupled or effects of the generator; default: drawn"),
        workers=(1, "processes"),
        csv=(Path, "file that gets the gains over the truth"),
    )  # fmt: skip
    seeds = [seed for seed in span(asked.seeds) if seed % 2 == (0 if asked.choose else 1)]
    kinds = product(asked.colours.split(","), (False, True)[: 1 + asked.quiet], (True, False)[: 1 + asked.unlogged])
    jobs = [partial(windy_halves, colour, quiet, asked.rate, asked.effects, logged, seed)
            for colour, quiet, logged in kinds for seed in seeds]  # fmt: skip
    done = [half for halves in _run(jobs, asked.workers).values() for half in halves]
    if asked.csv:
        write_gains(asked.csv, [half for half in done if half.found])


def measured(arguments: Sequence[str]) -> None:
    """Measured rigs."""
    asked = options(
        arguments, "measured", __doc__, "rigs",
        from_=(6.0, "leave out what is earlier [s]"),
        workers=(1, "processes"),
        csv=(Path, "file that gets the errors"),
        online=(False, "compare the on-line identifier as well"),
        download=(Path, "folder that gets public logs of three rigs first"),
    )  # fmt: skip
    try:
        rigs = [*asked.rigs, *(map(str, download(asked.download)) if asked.download else ())]
    except DownloadError as error:
        sys.exit(str(error))
    done = _run([partial(measured_halves, rig, asked.from_) for rig in rigs], asked.workers).get("measured", [])
    for own in (errors_table, closed_loop_table):
        print("\n" + own([half for half in done if half.found]))
    if asked.csv:
        write_errors(asked.csv, [half for half in done if half.found])
    if asked.online:
        for name, overlapping, count, apart in in_parallel(partial(online, start=asked.from_), rigs, asked.workers):
            print(f"{name}: {overlapping} of {count} intervals on line and off line overlap; not {apart or 'one'}")
