"""Generated rigs as the program takes them, with their truth in the catalogue's names, and what is held against it.

A diagnosis sees the logs alone. What a test can see that is told the structure (:func:`told_scores`) is measured with
the tracer's own likelihood: it says which effects the logs show at all.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.harness import Row
from heli_identifier.online import Estimate, ModelParameters
from heli_identifier.records import Log
from heli_identifier.tools import Rig
from heli_identifier.tracing import Likelihood, Scores, fit, helicopter
from heli_plant.parameters import PlantParameters
from tests.blind.damage import DAMAGES
from tests.blind.generator import Case
from tests.blind.windy import WindyLog, WindyRig

DETECTABLE = 8.0
"""Score from which on a test that is told the structure shows an effect [nats]."""


def log_of(name: str, rate: float, samples: np.ndarray) -> Log:
    """Give rows of a generator as a log; they end with two voltages and three angles."""
    return Log(name, rate, samples[:, -5:-3], samples[:, -3:])


def windy_log(name: str, log: WindyLog) -> Log:
    """Give a log of a windy rig, with its references where they are logged."""
    rate = (len(log.time) - 1) / float(log.time[-1] - log.time[0])
    return Log(name, round(rate, 6), log.voltages, log.angles, references=dict(log.references))


def struck(log: Log, damage: str) -> Log:
    """Give a log as a damage leaves it."""
    v, y = DAMAGES[damage](log.step * np.arange(log.samples, dtype=float), log.voltages, log.angles)
    return replace(log, voltages=v, angles=y)


def windy_logs(rig: WindyRig, letter: str) -> list[Log]:
    """Give the logs of a windy rig whose names begin with a letter."""
    return [windy_log(name, log) for name, log in rig.part(letter).items()]


def windy_plant(rig: WindyRig) -> PlantParameters:
    """Give the true plant of a windy rig."""
    effects = {name.replace("/", "_"): value for name, value in rig.truth.effects.items()}
    return PlantParameters(**rig.truth.parameters, **effects)


def blind_rig(kind: str, scale: float, index: int) -> Rig:
    """Make one rig of the blind battery."""
    made = Case("", kind, 0, scale).rig(index)
    training = tuple(log_of(f"train{number}", 100.0, samples) for number, samples in enumerate(made.train, 1))
    return Rig(training, (log_of("held", 100.0, made.held),), true_structure(made.truth))


def true_structure(rig: Any) -> dict[str, float | None]:
    """Translate the truth of a generator's rig into the names of a campaign."""
    truth: dict[str, float | None] = {symbol: getattr(rig.base, symbol) for symbol in ModelParameters._fields}
    for own in rig.effects:  # the tracer states the coefficient of the ground's effect at another point of the law
        truth[f"{own.name} {own.axis}"] = None if own.name == "ground_effect" else own.coefficient
    return truth | ({f"unknown {rig.unknown.axis}": None} if rig.unknown else {})


def against(estimate: Estimate, truth: float) -> Row:
    """Hold an estimate against the truth; ``ratio`` and ``half_width`` of its 95 % interval are over it."""
    low, high = estimate.interval
    return {"ratio": estimate.value / truth, "half_width": abs(0.5 * (high - low) / truth),
            "covers": low <= truth <= high, "determined": estimate.is_determined}  # fmt: skip


def likelihood_of(logs: Sequence[Log]) -> Likelihood:
    """Give the tracer's likelihood of some logs, nothing fitted."""
    return Likelihood.of(logs, helicopter(logs))


def told_scores(training: Sequence[Log], fields: Iterable[str]) -> dict[str, float]:
    """Score of each effect [nats], by its field, in a fit that is told the structure."""
    fields = list(fields)
    if not fields:
        return {}
    likelihood = likelihood_of(training)
    rig = likelihood.rig
    # no fit finds the time of a step from elsewhere: a law with one is scored as what it would add
    inside = [effect for effect in rig.effects if effect.field in fields and not effect.steps_in_time]
    fitted = fit(likelihood, list(dict.fromkeys((*rig.base, *(name for own in inside for name in own.parameters)))))
    scores = Scores(fitted, rig.candidates).scores([own.field for own in inside if own.field not in rig.base])
    return {field: score.score for field, score in scores.items() if field in fields}
