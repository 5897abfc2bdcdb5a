"""What the truth of a field rig says of a diagnosis: scores of tests that are told, covering intervals, errors.

The true structure is fitted twice, as a diagnosis does with its own: by the likelihood, whose score tells whether an
effect can be detected at all, and by multi-step errors, whose predictions a diagnosis cannot beat but by chance.
"""

from typing import NamedTuple

import numpy as np

from benchmarks.blind_measures import with_true_effects
from heli_identifier.tracing import Diagnosis
from heli_identifier.tracing.multistep.fit import fit_multistep
from heli_identifier.tracing.multistep.horizons import Starts
from heli_identifier.tracing.multistep.problem import Multistep
from heli_identifier.tracing.prediction.fit import BASE, fit
from heli_identifier.tracing.prediction.problem import Problem, reduce_log
from heli_identifier.tracing.search.model import effect_score, free_fields
from heli_identifier.tracing.validation.plants import RATE
from heli_identifier.tracing.validation.prediction import prediction_errors
from heli_identifier.workbench.campaign import Rig
from heli_plant.effects import AXES, effect

DETECTABLE = 6.0
"""Score of a test that is told the structure from which an effect can be detected."""

DETERMINED = 0.5
"""Standard error over the true value up to which a parameter counts as determined."""


class Measures(NamedTuple):
    """``detectable``: name and axis of the effects; ``covered``: by field, for parameters that are determined.

    ``over_truth``: by axis, the error after, 1 s ahead on the held-out logs, over that of the true structure.
    """

    detectable: set[tuple[str, str]]
    covered: dict[str, bool]
    over_truth: dict[str, float]


def measured(rig: Rig, diagnosis: Diagnosis) -> Measures:
    """Compare a diagnosis with what is possible for who knows the structure."""
    truth = rig.truth
    assert truth is not None
    entries = [effect(true.name, true.axis) for true in truth.effects]
    problem = Problem(tuple(reduce_log(log) for log in rig.training))
    told = fit(problem, with_true_effects(rig, diagnosis.plant_before), free_fields(entries))
    detectable = {(e.name, e.axis) for e in entries if abs(effect_score(told, e)) > DETECTABLE}
    by_errors = fit_multistep(
        Multistep(tuple(Starts(reduce_log(log, RATE)) for log in rig.training), told.parameters),
        (*BASE, *(entry.field for entry in entries)),
        [told.parameters],
    )
    over = {}
    for i, axis in enumerate(AXES):
        sizes = [
            np.concatenate([prediction_errors(reduce_log(log), plant, 1.0)[:, i] for log in rig.held_out]).std()
            for plant in (diagnosis.plant_after, by_errors.parameters)
        ]
        over[axis] = float(sizes[0] / sizes[1])
    return Measures(detectable, _covered(rig, diagnosis), over)


def _covered(rig: Rig, diagnosis: Diagnosis) -> dict[str, bool]:
    """Tell by field whether the interval of a determined parameter holds the truth."""
    assert rig.truth is not None
    true = dict(rig.truth.parameters)
    true |= {f"{e.name}_{e.axis}": e.coefficient for e in rig.truth.effects if e.coefficient is not None}
    covered = {}
    for field, estimate in {**diagnosis.parameters_after, **diagnosis.effects_after}.items():
        if field in true and estimate.standard_error and estimate.standard_error < DETERMINED * abs(true[field]):
            covered[field] = abs(estimate.value - true[field]) <= 1.96 * estimate.standard_error
    return covered
