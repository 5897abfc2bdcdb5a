"""The measure of a rig that needs its truth: the score of a test that is told the structure."""

from collections.abc import Sequence

from heli_identifier.records import Log
from heli_identifier.tools import Rig
from heli_identifier.tracing import Diagnosis, DiagnosisSettings, Likelihood, Scores, fit, helicopter, records_of
from heli_identifier.tracing.select import with_shapes
from heli_plant.effects import effect

TOLD = "told_score"
"""Name of the measure."""


def told_scores(training: Sequence[Log], fields: Sequence[str]) -> dict[str, float]:
    """Score of each effect [nats], by its field, in a fit that is told the structure."""
    rig = helicopter(DiagnosisSettings(), [log.angles for log in training], [log.voltages for log in training])
    likelihood = Likelihood(rig, records_of(training, rig, {}))
    fitted = fit(likelihood, with_shapes(list(rig.base), fields, rig.effects))
    scores = Scores(fitted, rig.candidates).scores([field for field in fields if field not in rig.base])
    return {field: score.score for field, score in scores.items() if field in fields}


def measured(rig: Rig, diagnosis: Diagnosis) -> dict[str, float]:
    """Give the largest told score of the rig's effects; nothing for an unknown torque, which no parameter describes."""
    if rig.truth is None or not rig.truth.effects:
        return {}
    fields = [effect(true.name, true.axis).field for true in rig.truth.effects]
    scores = told_scores(rig.training, fields)
    return {TOLD: max(scores.values())} if scores else {}
