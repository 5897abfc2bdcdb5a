"""What the truth of a field rig says of a diagnosis: scores of tests that are told, and covering intervals."""

from typing import NamedTuple

from benchmarks.blind_figures import TOLD_NEEDED
from benchmarks.blind_measures import told_scores
from heli_identifier.tools import Rig
from heli_identifier.tracing import Diagnosis
from heli_plant.effects import effect

DETERMINED = 0.5
"""Standard error over the true value up to which a parameter counts as determined."""


class Measures(NamedTuple):
    """``detectable``: name and axis of the effects; ``covered``: by field, for parameters that are determined."""

    detectable: set[tuple[str, str]]
    covered: dict[str, bool]


def measured(rig: Rig, diagnosis: Diagnosis) -> Measures:
    """Compare a diagnosis with what is possible for who knows the structure."""
    assert rig.truth is not None
    entries = {effect(true.name, true.axis).field: true for true in rig.truth.effects}
    scores = told_scores(rig.training, list(entries)) if entries else {}
    detectable = {(entries[f].name, entries[f].axis) for f, score in scores.items() if score > TOLD_NEEDED}
    return Measures(detectable, _covered(rig, diagnosis))


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
