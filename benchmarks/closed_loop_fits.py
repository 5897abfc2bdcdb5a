"""Base parameters of rigs under a controller: by prediction errors, by likelihood, and the intervals that span both.

Usage: python -m benchmarks.closed_loop_fits [--groups clean,field] [--limit RIGS]. The true structure is given for each
half of the field battery's rigs. Printed are, for each parameter and each estimate, how often the 95 % interval covers
and the quantiles of the estimate over the truth.
"""

import argparse
import sys
from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.blind_measures import with_true_effects
from benchmarks.field_rigs import field_sources
from heli_identifier.online import Estimate
from heli_identifier.tracing.multistep.fit import fit_multistep
from heli_identifier.tracing.multistep.horizons import Starts
from heli_identifier.tracing.multistep.problem import Multistep
from heli_identifier.tracing.prediction.fit import BASE, fit
from heli_identifier.tracing.prediction.problem import Problem, reduce_log
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.prediction.workers import use_threads
from heli_identifier.tracing.search.model import free_fields
from heli_identifier.tracing.validation.disagreement import disagree, spanning
from heli_identifier.tracing.validation.plants import RATE
from heli_identifier.workbench.campaign import Rig
from heli_plant.effects import effect
from heli_plant.parameters import TABLE_2

FIELDS = ("k_x", "k_z", "k_y", "a_th", "a_e", "a_wx", "a_wz", "a_wy", "a_1")


class Estimates(NamedTuple):
    """A parameter's estimates on one half: ``errors``, ``likelihood`` and what a diagnosis would state."""

    errors: Estimate
    likelihood: Estimate
    stated: Estimate


def estimates(rig: Rig) -> dict[str, Estimates]:
    """Estimate the parameters of one half, its effects known."""
    assert rig.truth is not None
    entries = [effect(true.name, true.axis) for true in rig.truth.effects]
    problem = Problem(tuple(reduce_log(log) for log in rig.training))
    start = with_true_effects(rig, first_estimate(problem.records, TABLE_2))
    likely = fit(problem, start, free_fields(entries))
    records = tuple(Starts(reduce_log(log, RATE)) for log in rig.training)
    best = fit_multistep(Multistep(records, likely.parameters), (*BASE, *(entry.field for entry in entries)))
    found = {}
    for field in FIELDS:
        pair = best.estimate(field), likely.estimate(field)
        found[field] = Estimates(*pair, spanning(*pair) if disagree(*pair) else pair[0])
    return found


def main(arguments: Sequence[str]) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.closed_loop_fits", description=__doc__)
    parser.add_argument("--groups", default="clean,field")
    parser.add_argument("--limit", type=int, default=4, help="most rigs of each case")
    asked = parser.parse_args(arguments)
    use_threads(1)
    groups = asked.groups.split(",")
    hits, ratios = defaultdict(list), defaultdict(list)
    sources = field_sources(groups, dict.fromkeys(groups, asked.limit))
    for _, source in sources.values():
        rig = source.load()
        assert rig.truth is not None
        for field, found in estimates(rig).items():
            true = rig.truth.parameters[field]
            for name, estimate in found._asdict().items():
                low, high = estimate.interval
                hits[name, field].append(low <= true <= high)
                ratios[name, field].append(estimate.value / true)
    print(f"{len(sources)} halves")
    for name in Estimates._fields:
        for field in FIELDS:
            low, middle, high = np.quantile(ratios[name, field], (0.1, 0.5, 0.9))
            covered = np.mean(hits[name, field])
            print(f"{name:10s} {field:4s} covers {covered:.2f}, over truth {middle:.2f} ({low:.2f} to {high:.2f})")
        print(f"{name:10s} all  covers {np.mean([np.mean(hits[name, field]) for field in FIELDS]):.3f}")


if __name__ == "__main__":
    main(sys.argv[1:])
