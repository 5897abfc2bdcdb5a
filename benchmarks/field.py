"""The field battery diagnosed: what is shown falsely, what is found, what only is possible.

Usage: python -m benchmarks.field [--groups clean,...] [--limit RIGS] [--workers N]. Each half of a rig's logs is
diagnosed by itself. Printed are the halves with something false shown, and per group the counts. False is an effect
of whose family the rig has none, and an unknown torque on a rig that has only effects of the catalogue. What counts as
detectable and covered is in :mod:`benchmarks.field_measures`. The Jaccard index of what is detectable says how far two
halves agree for a test that is told the structure.
"""

import argparse
import sys
from collections import defaultdict
from collections.abc import Callable, Sequence
from multiprocessing import Pool
from typing import NamedTuple

from threadpoolctl import threadpool_limits

from benchmarks.field_measures import measured
from benchmarks.field_rigs import FIELD_GROUPS, field_sources
from heli_identifier.errors import IdentifierError
from heli_identifier.tools import GeneratedRig
from heli_identifier.tracing import diagnose
from heli_identifier.tracing.helicopter import family_of


class Outcome(NamedTuple):
    """One half: effects shown that the rig lacks, families shown, true and detectable, intervals, nats, refusal."""

    name: str
    group: str
    false: list[str]
    shown: set[str]
    true: set[str]
    detectable: set[str]
    covered: dict[str, bool]
    nats: float
    refused: str = ""


def family(name: str, axis: str) -> str:
    """Family of an effect, also of one that the catalogue lacks."""
    return f"unknown on {axis}" if name == "unknown" else family_of(f"{name}_{axis}")


def diagnosed(job: tuple[str, str, GeneratedRig]) -> Outcome:
    """Diagnose one half."""
    name, group, source = job
    rig = source.load()
    assert rig.truth is not None
    true = {family(effect.name, effect.axis) for effect in rig.truth.effects}
    if rig.truth.unknown is not None:
        true.add(f"unknown on {rig.truth.unknown.axis}")
    try:
        with threadpool_limits(1):
            found = diagnose(rig.training, held_out=rig.held_out)
            measures = measured(rig, found)
    except IdentifierError as error:
        return Outcome(name, group, [], set(), true, set(), {}, 0.0, str(error))
    shown = {family(effect.name, effect.axis): effect for effect in found.effects}
    false = [f"{effect.name} {effect.axis} (score {effect.score:.1f})" for f, effect in shown.items() if f not in true]
    detectable = {family(*effect) for effect in measures.detectable}
    return Outcome(
        name, group, false, set(shown), true, detectable, measures.covered, found.held_out.gain.value
    )  # fmt: skip


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
        detected = sum(len(outcome.shown & outcome.detectable) for outcome in done)
        covered = [hit for outcome in done for hit in outcome.covered.values()]
        print(
            f"{group}: {len(done)} of {len(outcomes)} halves diagnosed; something false shown in "
            f"{sum(bool(outcome.false) for outcome in done)}; {sum(len(o.shown & o.true) for o in done)} of "
            f"{sum(len(outcome.true) for outcome in done)} true families shown, {detected} of "
            f"{sum(len(outcome.detectable) for outcome in done)} detectable ones; Jaccard index of halves: shown "
            f"{_agreement(done, lambda o: o.shown):.2f}, of what is detectable "
            f"{_agreement(done, lambda o: o.detectable):.2f}; held-out logs likelier in "
            f"{sum(outcome.nats > 0.0 for outcome in done)}; intervals cover {sum(covered)} of {len(covered)}"
        )


def _agreement(outcomes: Sequence[Outcome], named: Callable[[Outcome], set[str]]) -> float:
    """Mean Jaccard index of the two halves of a rig, where either names something."""
    rigs: dict[str, list[set[str]]] = defaultdict(list)
    for outcome in outcomes:
        rigs[outcome.name.rpartition(" ")[0]].append(named(outcome))
    pairs = [halves for halves in rigs.values() if len(halves) == 2 and halves[0] | halves[1]]
    found = [len(a & b) / len(a | b) for a, b in pairs]
    return sum(found) / len(found) if found else float("nan")


if __name__ == "__main__":
    main(sys.argv[1:])
