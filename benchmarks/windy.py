"""Windy rigs diagnosed: gains over the truth, intervals, names, and what the plant is worth under another controller.

Usage: python -m benchmarks.windy [--seeds 0:16] [--choose] [--colours ou,slow,swirl] [--quiet] [--rate 100]
[--unlogged] [--effects KIND] [--workers N] [--tracer MODULE]. The odd seeds report; rules are chosen on the even ones,
``--choose``. ``--quiet`` adds rigs that fly quietly, ``--unlogged`` those whose references are not logged. Each half of
a rig (5 logs) is diagnosed by itself, the logs t held out. Printed is a line for each half, then for each kind of rig:

* *gains*: k_x, k_z, k_y over the truth, median and range; the truth is the slope at the logs' mean voltage;
* *cover*: share of their 95 % intervals that hold the truth, and the intervals' median half-widths;
* *wrong*: gains outside their interval and by more than 15 %, of those stated as determined from outside, of those
  that rest on the noise model; then how many are not determined;
* *false*: halves that show a family of effects that the rig lacks;
* *found*: families shown, of those detectable: where a fit that is told the structure has an effect with S > 8;
* *agree*: Jaccard index of the families that two halves show, where either shows any; behind it what was expected;
* *loss*: log-likelihood of the second controller's logs under the true plant less that under the delivered one [nats],
  median and largest.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from itertools import product
from multiprocessing import Pool
from time import perf_counter
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from heli_identifier.errors import IdentifierError
from tests.blind.air import COLOURS
from tests.blind.windy import WindyRig, windy_rig

GAINS = ("k_x", "k_z", "k_y")

DETECTABLE = 8.0
"""Score of an effect in the fit that is told the structure, from which the search has to show it [nats]."""

FAR = 0.15
"""A gain that is stated as determined and outside its interval counts as wrong from this error on [1]."""

LOGS = {"a": 5, "b": 5, "t": 2, "c": 4}
"""Logs of a rig by letter: two halves, held out, of the second controller."""

HALVES = ("a", "b")


class Kind(NamedTuple):
    """A kind of rig: colour of its air, quiet references, rate [Hz], references logged, effects by the generator."""

    colour: str
    quiet: bool
    rate: float
    logged: bool
    effects: str | None

    def __str__(self) -> str:
        said = [self.colour, f"{self.rate:g} Hz", "quiet" if self.quiet else "", "" if self.logged else "not logged"]
        return " ".join(word for word in (*said, self.effects or "") if word)


@dataclass(frozen=True)
class Half:
    """One half of one rig against the truth; arrays are over k_x, k_z and k_y.

    Attributes
    ----------
    ratio, half_width
        Gain and half-width of its interval over the truth [1].
    status
        "outside", "noise" or "open".
    shown, true, detectable
        Families of effects.
    loss
        [nats].
    expected
        Agreement of halves by the diagnosis itself, nan if not said.
    refused
        Why nothing was diagnosed; the rest is then empty.
    """

    name: str
    seconds: float
    ratio: Any = ()
    half_width: Any = ()
    status: tuple[str, ...] = ()
    shown: frozenset[str] = frozenset()
    possible: frozenset[str] = frozenset()
    true: frozenset[str] = frozenset()
    detectable: frozenset[str] = frozenset()
    loss: float = float("nan")
    expected: float = float("nan")
    refused: str = ""

    @property
    def outside_interval(self) -> Any:
        """Gains whose interval does not hold the truth."""
        return np.abs(self.ratio - 1.0) > self.half_width

    @property
    def wrong(self) -> Any:
        """Gains that are outside their interval and far off."""
        return self.outside_interval & (np.abs(self.ratio - 1.0) > FAR)

    def line(self) -> str:
        """Say it in a line."""
        if self.refused:
            return f"{self.name}: refused: {self.refused}"
        gains = " ".join(
            f"{r:.2f}+-{h:.2f}{'!' if w else ''}({s})"
            for r, h, w, s in zip(self.ratio, self.half_width, self.wrong, self.status, strict=True)
        )
        false, missed = (", ".join(sorted(s)) for s in (self.shown - self.true, self.detectable - self.shown))
        said = f"; FALSE {false}" * bool(false) + f"; missed {missed}" * bool(missed)
        return f"{self.name}: {gains}; shown {len(self.shown)}{said}; loss {self.loss:.1f}; {self.seconds:.1f} s"


def halves_of(job: tuple[Kind, int, str]) -> tuple[Kind, list[Half]]:
    """Make a rig and diagnose its halves."""
    kind, seed, module = job
    tracer = import_module(module)
    rig = windy_rig(seed, kind.colour, kind.quiet, kind.rate, kind.effects, kind.logged, LOGS)
    return kind, [_half(tracer, rig, letter, f"{kind} {seed} {letter}") for letter in HALVES]


def _half(tracer: ModuleType, rig: WindyRig, letter: str, name: str) -> Half:
    """Diagnose one half and hold it against the truth."""
    training, held, other = ([tracer.log_of(n, log) for n, log in rig.part(p).items()] for p in (letter, "t", "c"))
    began = perf_counter()
    try:
        found = tracer.diagnosed(training, held)
    except IdentifierError as error:
        return Half(name, perf_counter() - began, refused=str(error))
    seconds = perf_counter() - began
    slopes = rig.truth.slopes(float(np.mean(np.concatenate([log.voltages for log in training]))))
    effects = tuple(rig.truth.effects)
    scores = tracer.scores_told(training, effects) if effects else {}
    loss = tracer.log_likelihood(tracer.true_plant(rig.truth), other) - tracer.log_likelihood(found.plant, other)
    return Half(
        name=name,
        seconds=seconds,
        ratio=np.array([found.gains[gain][0] / slopes[gain] for gain in GAINS]),
        half_width=np.array([found.gains[gain][1] / abs(slopes[gain]) for gain in GAINS]),
        status=tuple(found.status[gain] for gain in GAINS),
        shown=found.shown,
        possible=found.possible,
        true=tracer.families(effects),
        detectable=tracer.families(effect for effect, score in scores.items() if score > DETECTABLE),
        loss=loss,
        expected=float("nan") if found.expected is None else found.expected,
    )


def summary(kind: str, rigs: Sequence[Sequence[Half]]) -> str:
    """Lines of the table for one kind of rig, halves rig by rig."""
    halves = [half for rig in rigs for half in rig if not half.refused]
    count = sum(map(len, rigs))
    if not halves:
        return f"{kind}: none of {count} halves diagnosed"
    ratio, width = np.array([half.ratio for half in halves]), np.array([half.half_width for half in halves])
    status, wrong = np.array([half.status for half in halves]), np.array([half.wrong for half in halves])
    covered = 1.0 - np.mean([half.outside_interval for half in halves])
    gains = " ".join(f"{m:.3f}" for m in np.median(ratio, axis=0))
    stated = ", ".join(f"{wrong[status == s].sum()} of {(status == s).sum()} {s}" for s in ("outside", "noise"))
    pairs = [(rig[0].shown, rig[1].shown) for rig in rigs if not any(half.refused for half in rig)]
    index = [len(a & b) / len(a | b) for a, b in pairs if a | b]
    expected = [half.expected for half in halves if half.expected == half.expected]
    loss = np.array([half.loss for half in halves])
    false = sum(bool(half.shown - half.true) for half in halves)
    found = sum(len(half.shown & half.detectable) for half in halves)
    detectable = sum(len(half.detectable) for half in halves)
    return "\n".join((
        f"{kind}: {len(halves)} of {count} halves diagnosed in {np.median([half.seconds for half in halves]):.1f} s",
        f"  gains {gains}; {ratio.min():.2f}-{ratio.max():.2f}; by gain "
        + " ".join(f"{low:.2f}-{high:.2f}" for low, high in zip(ratio.min(axis=0), ratio.max(axis=0), strict=True)),
        f"  cover {covered:.3f} of {ratio.size}; half-widths " + " ".join(f"{w:.3f}" for w in np.median(width, axis=0)),
        f"  wrong {stated}; not determined {(status == 'open').sum()} ({wrong[status == 'open'].sum()} wrong)",
        f"  false {false} of {len(halves)}; found {found} of {detectable} detectable; "
        f"possible {_mean([len(half.possible) for half in halves])} a half",
        f"  agree {_mean(index)} ({_mean(expected)} expected) of {len(index)} rigs",
        f"  loss {np.median(loss):.1f}, at most {loss.max():.1f}",
    ))  # fmt: skip


def _mean(values: Sequence[float]) -> str:
    """Mean, or a dash of nothing."""
    return f"{np.mean(values):.2f}" if len(values) else "-"


def main(arguments: Sequence[str]) -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.windy", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", default="0:16", help="first:behind the last")
    parser.add_argument("--choose", action="store_true", help="even seeds, to choose rules on; else the odd ones")
    parser.add_argument("--colours", default=",".join(COLOURS), help=f"of {', '.join(COLOURS)}")
    parser.add_argument("--quiet", action="store_true", help="quiet rigs as well")
    parser.add_argument("--unlogged", action="store_true", help="rigs whose references are not logged as well")
    parser.add_argument("--rate", type=float, default=100.0, choices=(100.0, 500.0), help="of the controller [Hz]")
    parser.add_argument("--effects", help="bare, coupled or effects of the generator; default: drawn")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--tracer", default="benchmarks.windy_tracer", help="module to measure")
    asked = parser.parse_args(arguments)
    first, last = (int(word) for word in asked.seeds.split(":"))
    seeds = [seed for seed in range(first, last) if seed % 2 == (0 if asked.choose else 1)]
    quiet, logged = ((False, True)[: 1 + asked.quiet], (True, False)[: 1 + asked.unlogged])
    kinds = [
        Kind(colour, still, asked.rate, kept, asked.effects)
        for colour, still, kept in product(asked.colours.split(","), quiet, logged)
    ]
    jobs = [(kind, seed, asked.tracer) for kind in kinds for seed in seeds]
    done: dict[Kind, list[list[Half]]] = {kind: [] for kind in kinds}
    with Pool(asked.workers) as pool:
        for kind, halves in pool.imap(halves_of, jobs) if asked.workers > 1 else map(halves_of, jobs):
            done[kind].append(halves)
            print(*(half.line() for half in halves), sep="\n", flush=True)
    print(f"\n{'even' if asked.choose else 'odd'} seeds of {asked.seeds}, {len(seeds)} rigs of each kind")
    print(*(summary(str(kind), rigs) for kind, rigs in done.items()), sep="\n")


if __name__ == "__main__":
    main(sys.argv[1:])
