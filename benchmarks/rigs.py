"""Generated rigs as logs of the program, their truth with the catalogue's names, and comparisons with it.

A diagnosis sees only the logs. :func:`told_scores` tells a fit the true structure and measures with the tracer's
likelihood which effects the logs show at all.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from benchmarks.harness import Row
from heli_identifier.online import Estimate, ModelParameters
from heli_identifier.records import Log
from heli_identifier.tools import RigLogs
from heli_identifier.tracing import Likelihood, Scores, fit, helicopter
from heli_plant.parameters import PlantParameters
from tests.blind.damage import DAMAGES
from tests.blind.generator import Case
from tests.blind.windy import WindyLog, WindyRig

DETECTABLE = 8.0
"""Score [nats] above which a fit that is told the structure shows an effect."""


def log_of(name: str, rate: float, samples: np.ndarray) -> Log:
    """Return rows of a generator as a log; the last columns are two voltages and three angles."""
    return Log(name, rate, samples[:, -5:-3], samples[:, -3:])


def windy_log(name: str, log: WindyLog) -> Log:
    """Return a log of a windy rig, with its references if they are logged."""
    rate = (len(log.time) - 1) / float(log.time[-1] - log.time[0])
    return Log(name, round(rate, 6), log.voltages, log.angles, references=dict(log.references))


def damage_log(log: Log, damage: str) -> Log:
    """Return a damaged copy of a log."""
    v, y = DAMAGES[damage](log.step * np.arange(log.samples, dtype=float), log.voltages, log.angles)
    return replace(log, voltages=v, angles=y)


def windy_logs(rig: WindyRig, letter: str) -> list[Log]:
    """Return the logs of a windy rig whose names begin with a letter."""
    return [windy_log(name, log) for name, log in rig.part(letter).items()]


def windy_plant(rig: WindyRig) -> PlantParameters:
    """Return the true plant of a windy rig."""
    effects = {name.replace("/", "_"): value for name, value in rig.truth.effects.items()}
    return PlantParameters(**rig.truth.parameters, **effects)


@dataclass(frozen=True)
class TrueRig(RigLogs):
    """A rig with its true parameters and coefficients, which the diagnosis does not get."""

    truth: Mapping[str, float | None] = field(default_factory=dict)


def blind_rig(kind: str, scale: float, index: int) -> TrueRig:
    """Make one rig of the blind battery."""
    generated = Case("", kind, 0, scale).rig(index)
    training = tuple(log_of(f"train{number}", 100.0, samples) for number, samples in enumerate(generated.train, 1))
    return TrueRig(training, (log_of("held", 100.0, generated.held),), truth=true_structure(generated.truth))


def true_structure(rig: Any) -> dict[str, float | None]:
    """Return the truth of a generated rig; None for what is not compared, as of a torque of no catalogue."""
    truth: dict[str, float | None] = {symbol: getattr(rig.base, symbol) for symbol in ModelParameters._fields}
    for effect in rig.effects:  # the tracer states the coefficient of the ground's effect at another point of the law
        truth[f"{effect.name} {effect.axis}"] = None if effect.name == "ground_effect" else effect.coefficient
    return truth | ({f"unknown {rig.unknown.axis}": None} if rig.unknown else {})


def compare(estimate: Estimate, truth: float) -> Row:
    """Compare an estimate with the truth; ``ratio`` and ``half_width`` of its 95 % interval are over the truth."""
    low, high = estimate.interval
    return {"ratio": estimate.value / truth, "half_width": abs(0.5 * (high - low) / truth),
            "covers": low <= truth <= high, "determined": estimate.is_determined}  # fmt: skip


def likelihood_of(logs: Sequence[Log]) -> Likelihood:
    """Return the tracer's likelihood of some logs, with nothing fitted."""
    return Likelihood.of(logs, helicopter(logs))


def told_scores(training: Sequence[Log], fields: Iterable[str]) -> dict[str, float]:
    """Return the score of each effect [nats], by its field, in a fit that is told the structure."""
    fields = list(fields)
    if not fields:
        return {}
    likelihood = likelihood_of(training)
    rig = likelihood.rig
    # A fit does not find the time of a step: an effect that steps in time is not fitted, but scored as an addition.
    fitted_effects = [effect for effect in rig.effects if effect.field in fields and not effect.steps_in_time]
    parameters = (*rig.base, *(name for effect in fitted_effects for name in effect.parameters))
    fitted = fit(likelihood, list(dict.fromkeys(parameters)))
    added = [effect.field for effect in fitted_effects if effect.field not in rig.base]
    scores = Scores(fitted, rig.candidates).scores(added)
    return {field: score.score for field, score in scores.items() if field in fields}
