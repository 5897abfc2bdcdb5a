"""What `benchmarks.windy` asks of the tracer: all that it knows of a diagnosis stands here.

Another tracer can be measured in its place: a module with these functions, given as ``--tracer``.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from benchmarks.blind_measures import told_scores
from heli_identifier.records import Log
from heli_identifier.tracing.fit import fit
from heli_identifier.tracing.helicopter import family_of, helicopter
from heli_identifier.tracing.identification import Identification, identify_plant
from heli_identifier.tracing.likelihood import Likelihood
from heli_identifier.tracing.records import records_of
from heli_identifier.tracing.settings import DiagnosisSettings
from heli_plant.parameters import PlantParameters
from tests.blind.windy import WindyLog, WindyTruth


@dataclass(frozen=True)
class Measured:
    """A diagnosis in the terms of the benchmark.

    Attributes
    ----------
    gains
        k_x, k_z and k_y, slopes at the operating point, each with the half-width of its 95 % interval [rad/s^2/V].
    status
        What each of them rests on: "outside", "noise" or "open" (not determined).
    shown, possible
        Families of the effects that are shown, and of those that are only possible.
    plant
        What is delivered.
    expected
        Agreement of halves that sampling alone allows [1]; None if it was not said.
    """

    gains: Mapping[str, tuple[float, float]]
    status: Mapping[str, str]
    shown: frozenset[str]
    possible: frozenset[str]
    plant: Any
    expected: float | None = None


_STATUS = {"determined from outside": "outside", "rests on the noise model": "noise", "not determined": "open"}


def log_of(name: str, log: WindyLog) -> Log:
    """Give a generated log as the identifier's."""
    rate = (len(log.time) - 1) / float(log.time[-1] - log.time[0])
    return Log(name, round(rate, 6), log.voltages, log.angles, references=dict(log.references))


def measured(found: Identification) -> Measured:
    """Read off an identification what the benchmark compares with the truth."""
    reports = {name: found.parameters[name] for name in ("k_x", "k_z", "k_y")}
    findings = found.selection.findings
    return Measured(
        {name: (r.estimate.value, 1.96 * (r.estimate.standard_error or 0.0)) for name, r in reports.items()},
        {name: _STATUS[r.determination.value] for name, r in reports.items()},
        frozenset(finding.effect.family for finding in findings if finding.established),
        frozenset(finding.effect.family for finding in findings if not finding.established),
        found.plant.parameters,
        None if found.agreement is None else found.agreement.expected,
    )


def diagnosed(training: Sequence[Log], held_out: Sequence[Log]) -> Measured:
    """Identify the plant of one half; the held-out logs decide nothing."""
    return measured(identify_plant(training))


def families(effects: Iterable[str]) -> frozenset[str]:
    """Families of effects that are given by "name/axis"."""
    return frozenset(family_of(effect.replace("/", "_")) for effect in effects)


def true_plant(truth: WindyTruth) -> PlantParameters:
    """Give the rig itself."""
    effects = {name.replace("/", "_"): value for name, value in truth.effects.items()}
    return PlantParameters(**truth.parameters, **effects)


def _likelihood(logs: Sequence[Log], plant: PlantParameters | None = None) -> Likelihood:
    """Likelihood of logs, about a plant if one is given."""
    rig = helicopter(DiagnosisSettings(), [log.angles for log in logs], [log.voltages for log in logs])
    if plant is not None:
        rig = replace(rig, parameters=plant, estimate=lambda _: plant)
    return Likelihood(rig, records_of(logs, rig, {}))


def scores_told(training: Sequence[Log], effects: Sequence[str]) -> dict[str, float]:
    """Score of each effect, by "name/axis", in a fit that is told the structure [nats]."""
    found = told_scores(training, [effect.replace("/", "_") for effect in effects])
    return {effect: found[effect.replace("/", "_")] for effect in effects if effect.replace("/", "_") in found}


def log_likelihood(plant: PlantParameters, logs: Sequence[Log]) -> float:
    """Log-likelihood of logs under a plant, air and offsets fitted to them [nats]."""
    return -fit(_likelihood(logs, plant), ()).value
