"""All coefficients of the catalogue and all parameters of the model over the rigs of a fleet, and what they say.

The estimates of an effect are those of the catalogue's verdicts, whether the rig's diagnosis named the effect or not,
so that a weak effect shows if it repeats. A rig is left out of the mean of an effect

* where the effect is not testable, since an estimate that the logs do not determine says nothing of the rig;
* where it is an alternative of an effect that was named, or one of the same mechanism was named on the same axis (a
  delay where a lag is named): its estimate is then what that one leaves of it.

That no rig has an effect is refuted at a false discovery rate of .5 % over all effects of the catalogue (Benjamini and
Hochberg 1995), the level at which a diagnosis accuses a clean rig. It is so low since the scores of entries that were
not found scatter by 1.2 standard errors on a clean rig, of whose shapes the likeliest speaks. Only such an effect
*repeats*, and only if two rigs name it, or if the interval of its mean excludes zero and the mean lies in the
catalogue's plausible range: no loss of thrust is negative. Where the rigs' coefficients are not alike it *differs*.
"""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from itertools import combinations, product
from math import inf
from typing import Any

from scipy.stats import false_discovery_control

from heli_identifier.errors import IdentifierError
from heli_identifier.online import Estimate
from heli_identifier.provenance import provenance
from heli_identifier.records import shared_flight
from heli_identifier.results import Diagnosis, effect_name, to_plain
from heli_identifier.tools.meta_analysis import HOMOGENEOUS, LARGEST_LIKE_SPREAD, LEVEL, Pooled, pool_estimates
from heli_identifier.tools.rigs import Rig, error_text, summary_of
from heli_identifier.tracing import CatalogueVerdict, Progress, Verdict
from heli_plant.effects import effect

FALSE_DISCOVERY_RATE = 0.005

SCHEMA = "heli-fleet/1"
"""Of fleet.json."""


class Finding(StrEnum):
    """What a fleet says of one effect."""

    REPEATS = "repeats"
    DIFFERS = "differs between rigs"
    UNCONFIRMED = "not confirmed together"
    OWN = "one rig's own"
    OPEN = "not testable elsewhere"
    NOT_SHOWN = "not shown"
    NOT_TESTABLE = "not testable"


@dataclass(frozen=True)
class RigEstimate:
    """The coefficient of one rig: the verdict on it, why the mean leaves it out, whether the rig's diagnosis named it.

    Texts are empty where there is nothing to say.
    """

    rig: str
    value: float
    standard_error: float | None
    unit: str
    interval: tuple[float, float]
    verdict: str
    left_out: str
    named: bool


@dataclass(frozen=True)
class Coefficient:
    """One coefficient over all rigs: of an effect of the catalogue, or a parameter by the paper's symbol.

    ``named`` are the rigs whose diagnosis named the effect, ``alternatives`` what explains the logs of one of them as
    well, ``alike`` says whether the rigs may have one value. A parameter has no axis and no finding. There is no mean
    where fewer than two rigs determine the coefficient.
    """

    name: str
    axis: str
    finding: Finding | None
    named: tuple[str, ...]
    alternatives: tuple[tuple[str, str], ...]
    unit: str
    alike: bool | None
    pooled: Pooled | None
    rigs: tuple[RigEstimate, ...]

    @property
    def counted(self) -> list[RigEstimate]:
        """Rigs that the mean is made of."""
        return [own for own in self.rigs if not own.left_out]


@dataclass(frozen=True, eq=False)
class Fleet:
    """What several diagnoses say together, by rig; ``failures`` say why a rig has none.

    ``effects`` are all entries of the catalogue in the order of :class:`Finding`, those that most rigs name first;
    ``parameters`` those of the corrected models.
    """

    diagnoses: Mapping[str, Diagnosis]
    effects: tuple[Coefficient, ...]
    parameters: tuple[Coefficient, ...]
    failures: Mapping[str, str]

    def effects_with(self, finding: str) -> tuple[Coefficient, ...]:
        """Effects with this finding."""
        return tuple(own for own in self.effects if own.finding == finding)

    def document(self) -> dict[str, Any]:
        """Give the content of fleet.json."""
        return to_plain(
            {
                "schema": SCHEMA,
                "rigs": [summary_of(rig, found) for rig, found in self.diagnoses.items()],
                "failures": [{"rig": rig, "error": error} for rig, error in self.failures.items()],
                "effects": self.effects,
                "parameters": self.parameters,
                "settings": {
                    "level": LEVEL,
                    "false_discovery_rate": FALSE_DISCOVERY_RATE,
                    "largest_like_spread": LARGEST_LIKE_SPREAD,
                    "homogeneous_p": HOMOGENEOUS,
                },
                "provenance": provenance(),
            }
        )


def diagnose_rigs(
    rigs: Mapping[str, Rig], failures: Mapping[str, str] | None = None, progress: Progress = lambda what, share: None
) -> Fleet:
    """Diagnose rigs one after the other; a rig whose logs cannot be diagnosed is lost alone, as are ``failures``.

    Rigs that share a flight are not diagnosed: one of them has a log of the other, and nobody knows which.
    IdentifierError if fewer than two rigs could be diagnosed; it says what is wrong with the others.
    """
    diagnoses: dict[str, Diagnosis] = {}
    lost = dict(failures or {}) | _find_shared_flights(rigs)
    for number, (name, rig) in enumerate(rigs.items() if len(rigs) > 1 else ()):

        def within(what: str, share: float, name: str = name, number: int = number) -> None:
            progress(f"{name}: {what}", (number + share) / len(rigs))

        if name not in lost:
            try:
                diagnoses[name] = rig.diagnose(progress=within)
            except Exception as error:
                lost[name] = error_text(error)
    if len(diagnoses) < 2:
        raise IdentifierError("; ".join(f"rig {name}: {error}" for name, error in lost.items()))
    return combine_rigs(diagnoses, lost)


def _find_shared_flights(rigs: Mapping[str, Rig]) -> dict[str, str]:
    """Rigs that share a flight with another one, and which."""
    found = dict[str, str]()
    for (name, rig), (other, beside) in combinations(rigs.items(), 2):
        logs = product((*rig.training, *rig.held_out), (*beside.training, *beside.held_out))
        if (pair := next((pair for pair in logs if shared_flight(*pair)), None)) is not None:
            mine, theirs = (log.path or log.name for log in pair)
            for own, of in ((name, other), (other, name)):
                found[own] = (
                    f"it shares a flight with rig {of}: {mine} and {theirs} are one; give the log to the rig that flew"
                )
    return found


def combine_rigs(diagnoses: Mapping[str, Diagnosis], failures: Mapping[str, str] | None = None) -> Fleet:
    """Set the diagnoses of two rigs or more beside each other; ``failures`` say why other rigs have none."""
    estimates: dict[tuple[str, str], list[RigEstimate]] = defaultdict(list)
    for rig, found in diagnoses.items():
        rows = [((e.name, e.axis), e.estimate, (str(e.verdict), *_reason_left_out(found, e))) for e in found.catalogue]
        for name, own in found.parameters_after.items():
            rows.append(((name, ""), own, ("", "" if _is_determined(own) else "given", False)))
        for key, own, said in rows:
            estimates[key].append(RigEstimate(rig, own.value, own.standard_error, own.unit, own.interval, *said))
    means = dict[tuple[str, str], Pooled | None]()
    for key, rigs in estimates.items():
        pairs = [(own.value, own.standard_error or 0.0) for own in rigs if not own.left_out]
        means[key] = pool_estimates(*zip(*pairs, strict=True)) if len(pairs) > 1 else None
    shown = [effect for found in diagnoses.values() for effect in found.effects]
    # Benjamini and Hochberg: p of every effect after correction over the catalogue
    tested = {key: mean.none_p for key, mean in means.items() if mean and key[1]}
    corrected = false_discovery_control([*tested.values()]) if tested else ()
    refuted = {key for key, p in zip(tested, corrected, strict=True) if p <= FALSE_DISCOVERY_RATE}
    found_of = list[Coefficient]()
    for (name, axis), rigs in estimates.items():
        mean, named_by = means[name, axis], tuple(own.rig for own in rigs if own.named)
        finding = _classify_effect(name, axis, rigs, mean, (name, axis) in refuted) if axis else None
        others = tuple(dict.fromkeys(o for e in shown if (e.name, e.axis) == (name, axis) for o in e.alternatives))
        alike = mean.alike if mean else None
        found_of.append(Coefficient(name, axis, finding, named_by, others, rigs[0].unit, alike, mean, tuple(rigs)))
    order = [*Finding]
    effects = sorted(
        (own for own in found_of if own.finding),
        key=lambda e: (order.index(e.finding or order[-1]), -len(e.named), e.pooled.p if e.pooled else 1.0),
    )
    parameters = tuple(own for own in found_of if not own.finding and own.pooled)
    return Fleet(dict(diagnoses), tuple(effects), parameters, dict(failures or {}))


def _reason_left_out(diagnosis: Diagnosis, entry: CatalogueVerdict) -> tuple[str, bool]:
    """Why the mean leaves out an entry of the catalogue on one rig, and whether the rig's diagnosis names it."""
    key, law = (entry.name, entry.axis), effect(entry.name, entry.axis)
    named = [own for own in diagnosis.effects if own.coefficient is not None]
    is_named = key in {(own.name, own.axis) for own in named}
    if entry.verdict == Verdict.NOT_TESTABLE or not _is_determined(entry.estimate):
        return f"not testable: {entry.why}", is_named
    if law.certain and key in {(own.name, own.axis) for own in diagnosis.possible if own.in_plant}:
        return "not testable: its value is near what mechanics expects of every rig, by that alone", is_named
    for own in () if is_named else named:
        if key in own.alternatives or (own.axis == entry.axis and effect(own.name, own.axis).family == law.family):
            return f"{effect_name(own.name, own.axis)} is named in its place", False
    return "", is_named


def _is_determined(estimate: Estimate) -> bool:
    return abs(estimate.value) < inf and 0.0 < (estimate.standard_error or 0.0) < inf


def _classify_effect(name: str, axis: str, rigs: list[RigEstimate], mean: Pooled | None, is_refuted: bool) -> Finding:
    """Find out of an effect, once it is known whether it is refuted that no rig has it."""
    entry, named = effect(name, axis), sum(own.named for own in rigs)
    if mean is not None and (named >= 2 or (is_refuted and mean.has_sign and entry.lower <= mean.mean <= entry.upper)):
        if not mean.alike:
            return Finding.DIFFERS
        return Finding.REPEATS if is_refuted else Finding.UNCONFIRMED
    if named:
        return Finding.OWN if mean else Finding.OPEN
    return Finding.NOT_TESTABLE if all(own.left_out for own in rigs) else Finding.NOT_SHOWN
