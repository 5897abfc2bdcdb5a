"""The field battery diagnosed: what is shown falsely, what is found, what is only predictive.

Usage: python -m benchmarks.field [--groups clean,...] [--limit RIGS] [--workers N]. Each half of a rig's logs is
diagnosed by itself. Printed are the halves with something false shown, and per group the counts. False is an effect
of whose family the rig has none, and an unknown torque on a rig that has only effects of the catalogue. What counts as
detectable, covered and within 1.1 of the true structure is in :mod:`benchmarks.field_measures`. The Jaccard index of
what is detectable says how far two halves agree for a test that is told the structure.
"""

import argparse
import sys
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from multiprocessing import Pool
from typing import NamedTuple, TypeVar

from benchmarks.deals import Groups, family_named, group_jaccard, groups, jaccard
from benchmarks.field_measures import measured
from benchmarks.field_rigs import FIELD_GROUPS, field_sources
from heli_identifier.errors import IdentifierError
from heli_identifier.tracing import diagnose, use_threads
from heli_identifier.workbench.campaign import GeneratedRig

NEAR_TRUTH = 1.1
"""Ratio of errors up to which a plant predicts as well as the true structure."""


Named = TypeVar("Named", set[str], Groups)


class Outcome(NamedTuple):
    """One half: effects shown that the rig lacks, families shown, true and detectable, all groups named, refusal."""

    name: str
    group: str
    false: list[str]
    shown: set[str]
    true: set[str]
    named: Groups
    detectable: set[str]
    covered: dict[str, bool]
    over_truth: dict[str, float]
    refused: str = ""


def diagnosed(job: tuple[str, str, GeneratedRig]) -> Outcome:
    """Diagnose one half."""
    name, group, source = job
    use_threads(1)
    rig = source.load()
    assert rig.truth is not None
    true = {(effect.name, effect.axis) for effect in rig.truth.effects}
    true_families = {family_named(*effect) for effect in true}
    try:
        found = diagnose(rig.training, held_out=rig.held_out)
    except IdentifierError as error:
        return Outcome(name, group, [], set(), true_families, {}, set(), {}, {}, str(error))
    shown = {(effect.name, effect.axis) for effect in found.effects}
    unknown_expected = rig.truth.unknown is not None
    false = [
        f"{effect.name} {effect.axis} (score {effect.score:.1f})"
        for effect in found.effects
        if family_named(effect.name, effect.axis) not in true_families
        and not (effect.name == "unknown" and unknown_expected)
    ]
    measures = measured(rig, found)
    return Outcome(
        name,
        group,
        false,
        {family_named(*effect) for effect in shown},
        true_families,
        groups((*found.effects, *found.predictive)),
        {family_named(*effect) for effect in measures.detectable},
        measures.covered,
        measures.over_truth,
    )


def main(arguments: Sequence[str]) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.field", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--groups", default=",".join(FIELD_GROUPS), help=f"of {', '.join(FIELD_GROUPS)}")
    parser.add_argument("--limit", type=int, default=3, help="most rigs of each case")
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args(arguments)
    groups = asked.groups.split(",")
    rigs = field_sources(groups, dict.fromkeys(groups, asked.limit))
    jobs = [(name, case.group, source) for name, (case, source) in rigs.items()]
    by_group: dict[str, list[Outcome]] = defaultdict(list)
    with Pool(asked.workers) as pool:
        for outcome in pool.imap(diagnosed, jobs):
            by_group[outcome.group].append(outcome)
            missed = outcome.detectable - outcome.shown
            if outcome.false or outcome.refused or missed:
                said = [*outcome.false, *(f"missed: {name}" for name in sorted(missed))]
                print(f"{outcome.name}: {'; '.join(said) or outcome.refused}", flush=True)
    for group, outcomes in by_group.items():
        done = [outcome for outcome in outcomes if not outcome.refused]
        accused = sum(bool(outcome.false) for outcome in done)
        found = sum(len(outcome.shown & outcome.true) for outcome in done)
        predictive = [outcome.named.keys() - outcome.shown for outcome in done]
        counted = Counter(name for families in predictive for name in families).most_common(5)
        most = ", ".join(f"{name} {count}" for name, count in counted) or "none"
        detected = sum(len(outcome.shown & outcome.detectable) for outcome in done)
        ratios = [ratio for outcome in done for ratio in outcome.over_truth.values()]
        near, better = (sum(ratio <= limit for ratio in ratios) for limit in (NEAR_TRUTH, 1.0 / NEAR_TRUTH))
        covered = [hit for outcome in done for hit in outcome.covered.values()]
        print(
            f"{group}: {len(done)} of {len(outcomes)} halves diagnosed; something false shown in {accused}; "
            f"{found} of {sum(len(outcome.true) for outcome in done)} true families shown, {detected} of "
            f"{sum(len(outcome.detectable) for outcome in done)} detectable ones; Jaccard index of halves: shown "
            f"{_agreement(done, lambda o: o.shown):.2f}, with predictive "
            f"{_agreement(done, lambda o: set(o.named)):.2f}, of groups {_agreement(done, _named, group_jaccard):.2f}, "
            f"of what is detectable {_agreement(done, lambda o: o.detectable):.2f}; 1 s error within {NEAR_TRUTH} of "
            f"the true structure's: {near} of {len(ratios)} axes, and better by as much: {better}; "
            f"intervals cover {sum(covered)} of {len(covered)}; "
            f"predictive effects in {sum(map(bool, predictive))}: {most}"
        )


def _named(outcome: Outcome) -> Groups:
    return outcome.named


def _agreement(
    outcomes: Sequence[Outcome], named: Callable[[Outcome], Named], index: Callable[[list[Named]], float] = jaccard
) -> float:
    """Mean Jaccard index of the two halves of a rig, where either names something."""
    rigs: dict[str, list[Named]] = defaultdict(list)
    for outcome in outcomes:
        rigs[outcome.name.rpartition(" ")[0]].append(named(outcome))
    found = [index(halves) for halves in rigs.values()]
    known = [value for value in found if value == value]
    return sum(known) / len(known) if known else float("nan")


if __name__ == "__main__":
    main(sys.argv[1:])
