"""Measures of a rig that need its truth: the score of a test that knows the effect, and the best possible prediction.

The first is the score of a test that is told which effect to look for. The second is the prediction error of the true
structure, with its parameters fitted to the same training logs. One fit gives both. It starts at the parameters of the
null model and the true coefficients, so that it does not miss the optimum because of a poor start.
"""

import numpy as np

from heli_identifier.tracing.diagnosis.result import Diagnosis
from heli_identifier.tracing.diagnosis.settings import DiagnosisSettings
from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import Problem, reduce_log
from heli_identifier.tracing.search.model import effect_score, free_fields
from heli_identifier.tracing.validation.prediction import prediction_errors
from heli_identifier.workbench.campaign import Rig
from heli_plant.effects import AXES, effect
from heli_plant.parameters import PlantParameters

TOLD, TRUE_STRUCTURE = "told_score", "true_structure_1s_{axis}_rad"
"""Names of the measures."""


def measured(rig: Rig, diagnosis: Diagnosis) -> dict[str, float]:
    """Give the told score and, per axis, the true structure's 1 s prediction error on the held-out log [rad].

    If an effect has entries on several axes, all of them are fitted and the largest score counts. There is no measure
    for an unknown torque, because no parameter of the plant describes its structure.
    """
    if rig.truth is None or rig.truth.unknown is not None:
        return {}
    parameters, scores = diagnosis.plant_before, {}
    if rig.truth.effects:
        entries = [effect(true.name, true.axis) for true in rig.truth.effects]
        problem = Problem(tuple(reduce_log(log) for log in rig.training), DiagnosisSettings().bandwidth)
        fitted = fit(problem, with_true_effects(rig, diagnosis.plant_before), free_fields(entries))
        parameters = fitted.parameters
        scores = {TOLD: max(abs(effect_score(fitted, entry)) for entry in entries)}
    errors = np.concatenate([prediction_errors(reduce_log(log), parameters, 1.0) for log in rig.held_out])
    rms = np.sqrt((errors**2).mean(axis=0))
    return scores | {TRUE_STRUCTURE.format(axis=axis): float(value) for axis, value in zip(AXES, rms, strict=True)}


def with_true_effects(rig: Rig, null: PlantParameters) -> PlantParameters:
    """Give the parameters of a null model with the true effects on; a tenth of its range where c is not known."""
    assert rig.truth is not None
    for true in rig.truth.effects:
        entry = effect(true.name, true.axis)
        coefficient = true.coefficient if true.coefficient is not None else entry.upper / 10.0
        null = null._replace(**{entry.field: coefficient}, **true.shape)
    return null
