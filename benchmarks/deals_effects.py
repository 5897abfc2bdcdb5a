"""Coefficients of chosen effects on a rig's logs dealt at random, all fitted together by multi-step errors.

Usage: python -m benchmarks.deals_effects RIG... --effects speed_stability_pitch,... [--deals 3] [--seed 0] [--from 6].
Deals and options are those of :mod:`benchmarks.deals`. Printed are the coefficients with their standard errors, and the
1 s error on the unseen quarter over that of the simplified model fitted in the same way.
"""

import argparse
import sys
from collections.abc import Sequence

import numpy as np

from benchmarks.deals import add_deal_options, deal, rig_logs, triple, voltage_limit
from heli_identifier.tracing.multistep.fit import fit_multistep
from heli_identifier.tracing.multistep.horizons import Starts, root_mean_squares
from heli_identifier.tracing.multistep.nested import with_fields
from heli_identifier.tracing.multistep.problem import Multistep
from heli_identifier.tracing.prediction.ahead import SPACING
from heli_identifier.tracing.prediction.problem import reduce_log
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.prediction.workers import use_threads
from heli_identifier.tracing.validation.plants import RATE
from heli_plant.parameters import PlantParameters


def main(arguments: Sequence[str]) -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.deals_effects", description=(__doc__ or "").split("\n")[0]
    )
    add_deal_options(parser)
    parser.add_argument("--effects", required=True, help="coefficients, separated by commas")
    asked = parser.parse_args(arguments)
    fields = asked.effects.split(",")
    use_threads(1)
    for rig in asked.rig:
        logs = rig_logs(rig, asked.first)
        for number in range(asked.deals):
            training, _, unseen = deal(len(logs), np.random.default_rng((asked.seed, number)))
            start = first_estimate([reduce_log(logs[i]) for i in training], PlantParameters(v_max=voltage_limit(logs)))
            null = fit_multistep(Multistep(tuple(Starts(reduce_log(logs[i], RATE)) for i in training), start))
            found = with_fields(null, fields)
            judges = [Starts(reduce_log(logs[i]), SPACING) for i in unseen]
            ratio = root_mean_squares(judges, found.parameters)[1] / root_mean_squares(judges, null.parameters)[1]
            estimates = [(field, found.estimate(field)) for field in fields]
            values = ", ".join(f"{field} {e.value:.4f} ± {e.standard_error:.4f}" for field, e in estimates)
            print(f"{rig}, deal {number}: 1 s {triple(ratio)}; {values}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
