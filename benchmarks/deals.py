"""Deals of a rig's logs at random: half to fit, a quarter held out, a quarter that nobody saw, several times.

Usage: python -m benchmarks.deals RIG... [--deals 3] [--seed 0] [--from 6]. A RIG is a folder of logs or a pattern of
files ("logs/ntnu-*.csv"). For every deal four plants are fitted to the same training logs: the null model by the
one-step likelihood ("today"), the null model by multi-step errors, everything at once, and the selected families.
Printed are their errors 1 s and 2 s ahead on the unseen quarter over today's (pitch / elevation / travel), and per rig
the mean Jaccard index of the selected families over the pairs of deals of which at least one names something.
"""

import argparse
import glob
import sys
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from benchmarks.joint.selection import fit_everything, select_predictive
from heli_identifier.records import Log, read_logs
from heli_identifier.tracing.multistep.fit import fit_multistep
from heli_identifier.tracing.multistep.horizons import Starts, root_mean_squares
from heli_identifier.tracing.multistep.problem import Multistep
from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import Problem, reduce_log
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.prediction.workers import use_threads
from heli_plant.parameters import PlantParameters

FIT_RATE = 25.0
"""Rate [Hz] of the records that multi-step fits simulate."""

MODELS = ("null", "everything", "selected")


def deal(count: int, random: np.random.Generator) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Split ``count`` logs into training half, held-out quarter and unseen quarter, at least one each."""
    order, half = random.permutation(count), min((count + 1) // 2, count - 2)
    quarter = half + (count - half) // 2
    return order[:half], order[half:quarter], order[quarter:]


def one_deal(logs: Sequence[Log], random: np.random.Generator) -> tuple[NDArray[np.float64], set[str], list[str]]:
    """Ratios (3 models, 2 horizons, 3 axes) over today's null model, the families selected, and what to print."""
    training, _, unseen = ([logs[i] for i in part] for part in deal(len(logs), random))
    base = PlantParameters(v_max=max(5.0, max(float(np.abs(log.voltages).max()) for log in logs)))
    observed = Problem(tuple(reduce_log(log) for log in training))
    today = fit(observed, first_estimate(observed.records, base))
    judges = [Starts(reduce_log(log)) for log in unseen]
    records = tuple(reduce_log(log, FIT_RATE) for log in training)
    problem = Multistep(tuple(Starts(record) for record in records), first_estimate(observed.records, base))
    began = perf_counter()
    null = fit_multistep(problem)
    everything = fit_everything(problem)
    selection = select_predictive(everything)
    plants = [null.parameters, everything.parameters, selection.fit.parameters]
    reference = root_mean_squares(judges, today.parameters)[1:]
    ratios = np.array([root_mean_squares(judges, plant)[1:] / reference for plant in plants])
    named = [f"{f.family.name} ({f.stability:.2f}, {100 * f.worth:.0f} %)" for f in selection.predictive]
    lines = [f"    {name:10s} 1 s {triple(r[0])}   2 s {triple(r[1])}" for name, r in zip(MODELS, ratios, strict=True)]
    possible = [f"{f.family.name} ({f.stability:.2f})" for f in selection.possible]
    lines += [f"    named: {'; '.join(named) or 'nothing'}", f"    possible: {'; '.join(possible) or 'nothing'}"]
    lines += [f"    {perf_counter() - began:.0f} s, {len(everything.normal.scores)} blocks"]
    return ratios, {f.family.name for f in selection.predictive}, lines


def jaccard(sets: Sequence[set[str]]) -> float:
    """Mean Jaccard index over pairs of which not both are empty; not a number without such a pair."""
    pairs = [(a, b) for a, b in combinations(sets, 2) if a | b]
    return float(np.mean([len(a & b) / len(a | b) for a, b in pairs])) if pairs else float("nan")


def triple(values: NDArray[np.float64]) -> str:
    return " / ".join(f"{value:.2f}" for value in values)


def main(arguments: Sequence[str]) -> None:
    asked = _parsed(arguments)
    use_threads(1)
    of_rig, agreed = [], []
    for rig in asked.rig:
        files = sorted(glob.glob(rig if glob.has_magic(rig) else str(Path(rig) / "*.csv")))
        logs = read_logs(files, start=asked.first or None)
        ratios, sets = [], []
        for number in range(asked.deals):
            ratio, named, lines = one_deal(logs, np.random.default_rng((asked.seed, number)))
            print(f"{rig}, deal {number}", *lines, sep="\n", flush=True)
            ratios.append(ratio)
            sets.append(named)
        of_rig.append(np.array(ratios))
        agreed.append(jaccard(sets))
        print(f"{rig}: {len(logs)} logs, Jaccard {agreed[-1]:.2f}", flush=True)
        _summary([of_rig[-1]])
    print(f"all rigs, median of the rigs' medians; Jaccard {_median_known(agreed):.2f}")
    _summary(of_rig)


def _median_known(values: Sequence[float]) -> float:
    known = [value for value in values if np.isfinite(value)]
    return float(np.median(known)) if known else float("nan")


def _summary(rigs: Sequence[NDArray[np.float64]]) -> None:
    median = np.median([np.median(ratios, axis=0) for ratios in rigs], axis=0)
    over_null = np.median([np.median(ratios / ratios[:, :1], axis=0) for ratios in rigs], axis=0)
    worst = np.max([ratios.max(axis=0) for ratios in rigs], axis=0)
    for i, name in enumerate(MODELS):
        one, two = triple(median[i, 0]), triple(median[i, 1])
        print(f"  {name:10s} 1 s {one}, worst {triple(worst[i, 0])}, over null {triple(over_null[i, 0])}; 2 s {two}")


def _parsed(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.deals", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("rig", nargs="+", help="folder of logs, or a pattern of files")
    parser.add_argument("--deals", type=int, default=3)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--from", dest="first", type=float, default=6.0, help="first instant kept [s]")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    main(sys.argv[1:])
