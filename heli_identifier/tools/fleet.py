"""Which effects repeat over the rigs of a fleet: all coefficients of the catalogue, and all parameters of the model.

The estimates of an effect come from the catalogue's verdicts, whether the rig's diagnosis named the effect or not, so
that a weak effect shows if it repeats. The mean of an effect leaves out a rig

* where the effect is not testable: an estimate that the logs do not determine says nothing about the rig;
* where the effect is an alternative of a named effect, or an effect of the same mechanism was named on the same axis (a
  delay where a lag is named): the named effect then explains what this effect would.

The hypothesis that no rig has an effect is refuted at a false discovery rate of .5 % over all effects of the catalogue
(Benjamini and Hochberg 1995), the rate at which a diagnosis names an effect on a clean rig. The rate is so low because
the scores of effects that were not found scatter by 1.2 standard errors on a clean rig: each effect is scored with its
likeliest shape. Only such an effect *repeats*, and only if two rigs name it, or if the interval of its mean excludes
zero and the mean lies in the catalogue's plausible range: a loss of thrust is never negative. Where the rigs'
coefficients are not alike, the effect *differs*.
"""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from itertools import combinations, product
from math import inf, isclose
from typing import Any

from scipy.stats import false_discovery_control

from heli_identifier.errors import IdentifierError
from heli_identifier.online import Estimate
from heli_identifier.provenance import provenance
from heli_identifier.records import find_shared_flight
from heli_identifier.results import CatalogueVerdict, Diagnosis, Verdict, effect_name, slope_estimates, to_json_value
from heli_identifier.tools.meta_analysis import Pooled, pool_estimates
from heli_identifier.tools.rigs import RigLogs, error_text
from heli_identifier.tracing import Progress
from heli_plant.effects import effect

FALSE_DISCOVERY_RATE = 0.005

SCHEMA = "heli-fleet/1"  # of fleet.json


class FleetVerdict(StrEnum):
    """The verdict on one effect in a fleet."""

    REPEATS = "repeats"
    DIFFERS = "differs between rigs"
    UNCONFIRMED = "not confirmed together"
    OWN = "one rig's own"
    OPEN = "not testable elsewhere"
    NOT_SHOWN = "not shown"
    NOT_TESTABLE = "not testable"


@dataclass(frozen=True)
class RigEstimate:
    """The ``estimate`` of one rig, with its ``verdict``.

    ``left_out`` says why the mean leaves the rig out and is empty if it does not; ``named`` whether the rig's diagnosis
    named the effect. A parameter has no verdict.
    """

    rig: str
    estimate: Estimate
    verdict: str
    left_out: str
    named: bool


@dataclass(frozen=True)
class Coefficient:
    """One coefficient over all rigs: of an effect of the catalogue, or a parameter by the paper's symbol.

    ``named`` are the rigs whose diagnosis named the effect, ``alternatives`` the effects that explain the logs of one
    of them equally well. A parameter has no axis and no finding. ``pooled`` is None where fewer than two rigs determine
    the coefficient.
    """

    name: str
    axis: str
    finding: FleetVerdict | None
    named: tuple[str, ...]
    alternatives: tuple[tuple[str, str], ...]
    unit: str
    pooled: Pooled | None
    rigs: tuple[RigEstimate, ...]

    @property
    def counted(self) -> list[RigEstimate]:
        """Rigs that the mean counts."""
        return [estimate for estimate in self.rigs if not estimate.left_out]


@dataclass(frozen=True, eq=False)
class Fleet:
    """What several diagnoses say together, by rig; ``failures`` say why a rig has no diagnosis.

    ``effects`` are all entries of the catalogue in the order of :class:`FleetVerdict`, then by how many rigs name them;
    ``parameters`` are those of the corrected plants, gains as slopes at the median voltage of a rig's logs.
    """

    diagnoses: Mapping[str, Diagnosis]
    effects: tuple[Coefficient, ...]
    parameters: tuple[Coefficient, ...]
    failures: Mapping[str, str]

    def effects_with(self, finding: str) -> tuple[Coefficient, ...]:
        """Effects with this finding."""
        return tuple(effect for effect in self.effects if effect.finding == finding)

    def document(self) -> dict[str, Any]:
        """Return the content of fleet.json."""
        return to_json_value(
            {
                "schema": SCHEMA,
                "rigs": [{"rig": rig, **diagnosis.to_dict()} for rig, diagnosis in self.diagnoses.items()],
                "failures": [{"rig": rig, "error": error} for rig, error in self.failures.items()],
                "effects": self.effects,
                "parameters": self.parameters,
                "provenance": provenance(),
            }
        )


def diagnose_rigs(
    rigs: Mapping[str, RigLogs],
    failures: Mapping[str, str] | None = None,
    progress: Progress = lambda what, share: None,
) -> Fleet:
    """Diagnose rigs one after the other; a rig that fails does not stop the others.

    ``failures`` are errors of other rigs, known before. Rigs that share a flight are not diagnosed: one of them has a
    log of the other, and nobody knows which. IdentifierError if fewer than two rigs could be diagnosed; it says what is
    wrong with the others.
    """
    diagnoses: dict[str, Diagnosis] = {}
    errors = dict(failures or {}) | _find_shared_flights(rigs)
    for number, (name, rig) in enumerate(rigs.items() if len(rigs) > 1 else ()):

        def rig_progress(what: str, share: float, name: str = name, number: int = number) -> None:
            progress(f"{name}: {what}", (number + share) / len(rigs))

        if name not in errors:
            try:
                diagnoses[name] = rig.diagnose(progress=rig_progress)
            except Exception as error:
                errors[name] = error_text(error)
    if len(diagnoses) < 2:
        raise IdentifierError("; ".join(f"rig {name}: {error}" for name, error in errors.items()))
    return combine_rigs(diagnoses, errors)


def _find_shared_flights(rigs: Mapping[str, RigLogs]) -> dict[str, str]:
    """Return an error for every rig that shares a flight with another one."""
    errors = dict[str, str]()
    for (name_a, rig_a), (name_b, rig_b) in combinations(rigs.items(), 2):
        pairs = product((*rig_a.training, *rig_a.held_out), (*rig_b.training, *rig_b.held_out))
        if (pair := next((pair for pair in pairs if find_shared_flight(*pair)), None)) is not None:
            log_a, log_b = (log.path or log.name for log in pair)
            same = f"{log_a} and {log_b} are one; give the log to the rig that flew"
            errors[name_a] = f"it shares a flight with rig {name_b}: {same}"
            errors[name_b] = f"it shares a flight with rig {name_a}: {same}"
    return errors


def combine_rigs(diagnoses: Mapping[str, Diagnosis], failures: Mapping[str, str] | None = None) -> Fleet:
    """Combine the diagnoses of two rigs or more; ``failures`` say why other rigs have none."""
    estimates: dict[tuple[str, str], list[RigEstimate]] = defaultdict(list)
    for rig, diagnosis in diagnoses.items():
        for entry in diagnosis.catalogue:
            status = (str(entry.verdict), *_reason_left_out(diagnosis, entry))
            estimates[entry.name, entry.axis].append(RigEstimate(rig, entry.estimate, *status))
        for name, value in slope_estimates(diagnosis).items():
            left_out = "" if _is_determined(value) else "given"
            estimates[name, ""].append(RigEstimate(rig, value, "", left_out, False))
    means = dict[tuple[str, str], Pooled | None]()
    for key, of_rigs in estimates.items():
        pooled = [of_rig.estimate for of_rig in of_rigs if not of_rig.left_out]
        pairs = [(estimate.value, estimate.standard_error or 0.0) for estimate in pooled]
        means[key] = pool_estimates(*zip(*pairs, strict=True)) if len(pairs) > 1 else None
    shown = [effect for diagnosis in diagnoses.values() for effect in diagnosis.effects]
    # Benjamini and Hochberg: p of every effect after correction over the catalogue
    tested = {key: mean.p_no_effect for key, mean in means.items() if mean and key[1]}
    corrected = false_discovery_control([*tested.values()]) if tested else ()
    refuted = {key for key, p in zip(tested, corrected, strict=True) if p <= FALSE_DISCOVERY_RATE}
    coefficients = list[Coefficient]()
    for (name, axis), of_rigs in estimates.items():
        mean, named = means[name, axis], tuple(estimate.rig for estimate in of_rigs if estimate.named)
        finding = _classify_effect(name, axis, of_rigs, mean, (name, axis) in refuted) if axis else None
        others = tuple(dict.fromkeys(o for e in shown if (e.name, e.axis) == (name, axis) for o in e.alternatives))
        unit = of_rigs[0].estimate.unit
        coefficients.append(Coefficient(name, axis, finding, named, others, unit, mean, tuple(of_rigs)))
    order = [*FleetVerdict]
    effects = sorted(
        (c for c in coefficients if c.finding),
        key=lambda c: (order.index(c.finding or order[-1]), -len(c.named), c.pooled.p if c.pooled else 1.0),
    )
    parameters = tuple(c for c in coefficients if not c.finding and c.pooled)
    return Fleet(dict(diagnoses), tuple(effects), parameters, dict(failures or {}))


def _reason_left_out(diagnosis: Diagnosis, entry: CatalogueVerdict) -> tuple[str, bool]:
    """Return why the mean leaves out an effect of one rig, empty if it does not, and whether the rig names it."""
    key, law = (entry.name, entry.axis), effect(entry.name, entry.axis)
    named = [shown for shown in diagnosis.effects if shown.coefficient is not None]
    is_named = key in {(shown.name, shown.axis) for shown in named}
    if entry.verdict == Verdict.NOT_TESTABLE or not _is_determined(entry.estimate):
        return f"not testable: {entry.why}", is_named
    if not law.certain and any(end and isclose(entry.estimate.value, end) for end in (law.lower, law.upper)):
        return "not testable: its value stands at the end of what is plausible", is_named
    if law.certain and key in {(possible.name, possible.axis) for possible in diagnosis.possible if possible.in_plant}:
        return "not testable: its value is near what mechanics expects of every rig, by that alone", is_named
    for shown in () if is_named else named:
        same_mechanism = shown.axis == entry.axis and effect(shown.name, shown.axis).family == law.family
        if key in shown.alternatives or same_mechanism:
            return f"{effect_name(shown.name, shown.axis)} is named in its place", False
    return "", is_named


def _is_determined(estimate: Estimate) -> bool:
    return abs(estimate.value) < inf and 0.0 < (estimate.standard_error or 0.0) < inf


def _classify_effect(
    name: str, axis: str, rigs: list[RigEstimate], mean: Pooled | None, is_refuted: bool
) -> FleetVerdict:
    """Return the finding on an effect; ``is_refuted``: the hypothesis that no rig has the effect is refuted."""
    entry, named = effect(name, axis), sum(estimate.named for estimate in rigs)
    if mean is not None and (named >= 2 or (is_refuted and mean.has_sign and entry.lower <= mean.mean <= entry.upper)):
        if not mean.alike:
            return FleetVerdict.DIFFERS
        return FleetVerdict.REPEATS if is_refuted else FleetVerdict.UNCONFIRMED
    if named:  # those of several rigs that have no mean cannot be compared
        return FleetVerdict.OWN if mean else FleetVerdict.OPEN if named == 1 else FleetVerdict.UNCONFIRMED
    return FleetVerdict.NOT_TESTABLE if all(estimate.left_out for estimate in rigs) else FleetVerdict.NOT_SHOWN
