"""Rigs whose truth is known, and the catalogue scored at each one's simplified model: the matrix to select from."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.blind_rigs import sources
from heli_identifier.records import Log, demo_logs, read_logs
from heli_identifier.tracing.diagnosis.settings import DiagnosisSettings
from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import Problem, reduce_log
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.search.model import Model
from heli_identifier.tracing.search.scan import Scan, subset
from heli_identifier.tracing.search.selection import score_catalogue
from heli_identifier.tracing.search.settings import MOST_EFFECTS, SIGNIFICANCE
from heli_identifier.tracing.search.threshold import largest_scores, quantile
from heli_plant.parameters import PlantParameters

Entries = frozenset[tuple[str, str]]
"""Names and axes of effects."""

DEMO_TRUTH: dict[str, Entries] = {
    "rig-a": frozenset({("dry_friction", "pitch")}),
    "rig-b": frozenset({("quadratic_thrust", "rotors")}),
    "rig-c": frozenset(),
}
"""As the demonstration logs' README states it."""


@dataclass(frozen=True, eq=False)
class Matrix:
    """The candidates of one rig.

    Attributes
    ----------
    rig : str
    true : frozenset of (str, str)
    problem : Problem
    start : PlantParameters
    scanned : Scan
        The catalogue at the fitted simplified model, without columns that show nothing. Its ``directions`` (M, K) are
        the regressors: whitened, the model's own parameters projected out, of unit length; ``-white`` (M,) is the
        regressand.
    """

    rig: str
    true: Entries
    problem: Problem
    start: PlantParameters
    scanned: Scan

    def entries(self, chosen: list[int]) -> Entries:
        """Effects that columns belong to."""
        effects = [self.scanned.candidates[i].effect for i in chosen]
        return frozenset((effect.name, effect.axis) for effect in effects)


def matrices() -> Iterator[Matrix]:
    """Give the demonstration rigs and the first of each of the blind battery's kinds of pairs."""
    for rig, true in DEMO_TRUTH.items():
        yield matrix(rig, true, read_logs(demo_logs(rig)[0]))
    for name, (_, source) in sources(("pair",), {"pair": 1}).items():
        made = source.load()
        assert made.truth is not None
        true = frozenset((effect.name, effect.axis) for effect in made.truth.effects)
        yield matrix(name, true, made.training)


def matrix(rig: str, true: Entries, logs: tuple[Log, ...]) -> Matrix:
    """Fit the simplified model to a rig's training logs and score the catalogue."""
    diagnosis = DiagnosisSettings()
    problem = Problem(tuple(reduce_log(log) for log in logs), diagnosis.bandwidth)
    start = first_estimate(problem.records, diagnosis.base_parameters())
    scanned = score_catalogue(Model(fit(problem, start))).scanned
    seen = np.flatnonzero(np.linalg.norm(scanned.directions, axis=0) > 0.5)
    return Matrix(rig, true, problem, start, subset(scanned, [int(i) for i in seen]))


def chosen(scanned: Scan) -> list[int]:
    """Columns that the tracer's scores and thresholds choose of the matrix alone.

    A round of the tracer without its refits: the largest admissible score enters if it passes the threshold over the
    whole catalogue; its column is projected out of residual and regressors, and the next round begins.
    """
    found: list[int] = []
    while len(found) < MOST_EFFECTS:
        scores = np.where(scanned.allowed(), np.abs(scanned.scores), 0.0)
        best = int(np.argmax(scores))
        if scores[best] < quantile(largest_scores(scanned), SIGNIFICANCE):
            break
        found.append(best)
        scanned = without_column(scanned, best)
    return found


def without_column(scanned: Scan, index: int) -> Scan:
    """Give a scan after the projection that removes one column; every column of the same effect becomes zero.

    All columns have unit length, so the new lengths and scores follow from the products of the column with the others.
    """
    direction = scanned.directions[:, index]
    overlap = direction @ scanned.directions
    length = np.sqrt(np.maximum(1.0 - overlap**2, 0.0))
    effect = scanned.candidates[index].effect
    other = np.array([candidate.effect.field != effect.field for candidate in scanned.candidates])
    # a shorter column is the removed one under another name, and its length is mostly the rounding of 1 - overlap^2
    seen = other & scanned.directions.any(axis=0) & (length > 1e-4)
    share = np.where(seen, 1.0 / np.where(seen, length, 1.0), 0.0)
    directions = np.multiply.outer(direction, -overlap * share)
    directions += scanned.directions * share
    errors = np.where(seen, scanned.standard_errors, np.inf) * np.where(seen, share, 1.0)
    scores = (scanned.scores - overlap * scanned.scores[index]) * share
    return replace(
        scanned,
        white=scanned.white + direction * scanned.scores[index],
        directions=directions,
        scores=scores,
        standard_errors=errors,
        coefficients=np.where(seen, scores * np.where(seen, errors, 0.0), 0.0),
    )
