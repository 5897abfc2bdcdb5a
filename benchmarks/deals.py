"""Deals of a rig's logs at random: half to fit, a quarter held out, a quarter that nobody saw, several times.

Usage: python -m benchmarks.deals RIG... [--deals 3] [--seed 0] [--from 6] [--as-read]. A RIG is a folder of logs or a
pattern of files ("logs/ntnu-*.csv"), with :data:`OPPOSITE` behind it if its pitch counts the other way. Every deal is
diagnosed. Printed are the errors of its plants 1 s and 2 s ahead on the unseen quarter over those of the null model
fitted by the one-step likelihood (pitch / elevation / travel), and per rig the mean Jaccard index of what is named,
shown and predictive together, over the pairs of deals of which at least one names something: of families, and of
groups, a group being a family with the alternatives that the diagnosis gives of it.
"""

import argparse
import glob
import sys
from collections.abc import Sequence
from functools import partial
from itertools import combinations
from pathlib import Path
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from heli_identifier.records import Log, LogFormat, read_logs
from heli_identifier.tracing import DiagnosisSettings, FoundEffect, PossibleEffect, diagnose
from heli_identifier.tracing.alignment.aligned import aligned
from heli_identifier.tracing.diagnosis.diagnose import model_before
from heli_identifier.tracing.multistep.horizons import Starts, root_mean_squares
from heli_identifier.tracing.prediction.ahead import SPACING
from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import Problem, reduce_log
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.prediction.workers import use_threads
from heli_identifier.tracing.predictive.families import family_of
from heli_plant.parameters import PlantParameters

Groups = dict[str, set[str]]
"""Families named, each with those that the diagnosis says could stand in its place, and itself."""

OPPOSITE = ":pitch=-1"
"""Behind a rig's name: its pitch counts opposite to the project's, as ``pitch = -1`` in its heli.toml would say."""

MODELS = ("before", "with shown", "after", "everything")


def deal(count: int, random: np.random.Generator) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Split ``count`` logs into training half, held-out quarter and unseen quarter, at least one each."""
    order, half = random.permutation(count), min((count + 1) // 2, count - 2)
    quarter = half + (count - half) // 2
    return order[:half], order[half:quarter], order[quarter:]


def rig_logs(rig: str, first: float) -> list[Log]:
    """Read the logs of a rig, a folder or a pattern of files, from ``first`` [s] on."""
    signs = {"pitch": -1} if rig.endswith(OPPOSITE) else {}
    rig = rig.removesuffix(OPPOSITE)
    files = sorted(glob.glob(rig if glob.has_magic(rig) else str(Path(rig) / "*.csv")))
    return list(read_logs(files, LogFormat(signs=signs), start=first or None))


def voltage_limit(logs: Sequence[Log]) -> float:
    """Saturation [V] that none of the logs exceeds, 5 V at least."""
    return max(5.0, max(float(np.abs(log.voltages).max()) for log in logs))


def add_deal_options(parser: argparse.ArgumentParser) -> None:
    """Add what every benchmark on dealt logs asks for."""
    parser.add_argument("rig", nargs="+", help="folder of logs, or a pattern of files")
    parser.add_argument("--deals", type=int, default=3)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--from", dest="first", type=float, default=6.0, help="first instant kept [s]")


def one_deal(
    logs: Sequence[Log], random: np.random.Generator, as_read: bool = False
) -> tuple[NDArray[np.float64], Groups, list[str]]:
    """Ratios (4 models, 2 horizons, 3 axes) over the one-step null model, the groups named, and what to print.

    An unseen log whose elevation was zeroed in another position is shifted as a held-out log is, unless ``as_read``.
    """
    training, held_out, unseen = ([logs[i] for i in part] for part in deal(len(logs), random))
    limit = voltage_limit(logs)
    observed = Problem(tuple(reduce_log(log) for log in training))
    one_step = fit(observed, first_estimate(observed.records, PlantParameters(v_max=limit)))
    settings = DiagnosisSettings(voltage_limit=limit)
    notes: tuple[str, ...] = ()
    if not as_read:
        together = aligned(training, (*held_out, *unseen), partial(model_before, settings=settings))
        notes, unseen = together.notes, list(together.held_out.logs[len(held_out) :])
    judges = [Starts(reduce_log(log), SPACING) for log in unseen]
    began = perf_counter()
    found = diagnose(training, held_out=held_out, settings=settings)
    seconds = perf_counter() - began
    plants = (found.plant_before, found.plant_shown, found.plant_after, found.plant_everything or found.plant_after)
    reference = root_mean_squares(judges, one_step.parameters)[1:]
    ratios = np.array([root_mean_squares(judges, plant)[1:] / reference for plant in plants])
    lines = [f"    {name:10s} 1 s {triple(r[0])}   2 s {triple(r[1])}" for name, r in zip(MODELS, ratios, strict=True)]
    lines += [
        f"    shown: {_named(found.effects)}",
        f"    predictive: {_named(found.predictive)}",
        f"    possible: {_named(found.possible)}",
        f"    {seconds:.1f} s, logs that do not belong: {[log.log for log in found.logs if not log.belongs]}",
        *(f"    {note}" for note in notes),
    ]
    return ratios, groups((*found.effects, *found.predictive)), lines


def _named(effects: Sequence[FoundEffect] | Sequence[PossibleEffect]) -> str:
    return "; ".join(f"{e.name} {e.axis} ({e.stability:.2f})" for e in effects) or "nothing"


def groups(effects: Sequence[FoundEffect]) -> Groups:
    """Give the groups of effects that are named."""
    found: Groups = {}
    for effect in effects:
        family = family_named(effect.name, effect.axis)
        found.setdefault(family, {family}).update(family_named(*other) for other in effect.alternatives)
    return found


def family_named(name: str, axis: str) -> str:
    """Family of an effect of the catalogue, or the effect itself where it is of none."""
    return family_of(f"{name}_{axis}") or f"{name} {axis}"


def jaccard(sets: Sequence[set[str]]) -> float:
    """Mean Jaccard index over pairs of which not both are empty; not a number without such a pair."""
    pairs = [(a, b) for a, b in combinations(sets, 2) if a | b]
    return float(np.mean([len(a & b) / len(a | b) for a, b in pairs])) if pairs else float("nan")


def group_jaccard(named: Sequence[Groups]) -> float:
    """Mean Jaccard index over the same pairs, where two groups agree if either names what the other one is named for.

    A group agrees with one group at most; of all ways to pair them the one with most agreements counts.
    """
    pairs = [(a, b) for a, b in combinations(named, 2) if a or b]
    return float(np.mean([_agreeing(a, b) for a, b in pairs])) if pairs else float("nan")


def _agreeing(a: Groups, b: Groups) -> float:
    agree = np.array([[one in b[other] or other in a[one] for other in b] for one in a], dtype=float)
    both = agree[linear_sum_assignment(agree, maximize=True)].sum() if a and b else 0.0
    return float(both / (len(a) + len(b) - both))


def triple(values: NDArray[np.float64]) -> str:
    return " / ".join(f"{value:.2f}" for value in values)


def main(arguments: Sequence[str]) -> None:
    asked = _parsed(arguments)
    use_threads(1)
    of_rig, agreed, as_groups = [], [], []
    for rig in asked.rig:
        logs = rig_logs(rig, asked.first)
        ratios, dealt = [], []
        for number in range(asked.deals):
            ratio, named, lines = one_deal(logs, np.random.default_rng((asked.seed, number)), asked.as_read)
            print(f"{rig}, deal {number}", *lines, sep="\n", flush=True)
            ratios.append(ratio)
            dealt.append(named)
        of_rig.append(np.array(ratios))
        agreed.append(jaccard([set(named) for named in dealt]))
        as_groups.append(group_jaccard(dealt))
        print(f"{rig}: {len(logs)} logs, Jaccard {agreed[-1]:.2f}, of groups {as_groups[-1]:.2f}", flush=True)
        _summary([of_rig[-1]])
    of_families, of_groups = _median_known(agreed), _median_known(as_groups)
    print(f"all rigs, median of the rigs' medians; Jaccard {of_families:.2f}, of groups {of_groups:.2f}")
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
    add_deal_options(parser)
    parser.add_argument("--as-read", action="store_true", help="shift no unseen log whose zero is in another position")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    main(sys.argv[1:])
