"""All coefficients of the catalogue and all parameters of the model over the rigs of a fleet, and what they say.

The estimates of an effect are those of the catalogue's verdicts, whether the rig's diagnosis named the effect or not,
so that a weak effect shows if it repeats. A rig is left out of the mean of an effect

* where the effect is not testable, since an estimate that the logs do not determine says nothing of the rig;
* where it is an alternative of an effect that was named, or one of the same mechanism was named on the same axis (a
  delay where a lag is named): its estimate is then what that one leaves of it.

That no rig has an effect is refuted at a false discovery rate of .5 % over all effects of the catalogue (Benjamini and
Hochberg 1995), the level at which a diagnosis accuses a clean rig. It is so low since the scores of entries that were
not found scatter by 1.2 standard errors on a clean rig, of whose shapes the likeliest speaks. Only such an effect
*repeats*, and only if two rigs name it, or if the interval of its mean does without zero and the mean lies in the
catalogue's plausible range: no loss of thrust is negative. Where the rigs' coefficients are not alike it *differs*.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import combinations, product
from math import inf
from typing import Any

from scipy.stats import false_discovery_control

from heli_identifier.errors import IdentifierError
from heli_identifier.online import Estimate
from heli_identifier.records import shared_flight
from heli_identifier.results import effect_name, plain
from heli_identifier.tools.meta_analysis import HOMOGENEOUS, LARGEST_LIKE_SPREAD, LEVEL, Pooled, pooled
from heli_identifier.tools.rigs import Rig, error_text
from heli_identifier.tracing import CatalogueVerdict, Diagnosis, Verdict
from heli_plant.effects import Effect, effect

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


@dataclass(frozen=True)
class RigEstimate:
    """The coefficient of one rig: the diagnosis' verdict on it, and why the mean leaves it out, or empty texts."""

    rig: str
    value: float
    standard_error: float | None
    unit: str
    interval: tuple[float, float]
    verdict: str = ""
    left_out: str = ""
    named: bool = False
    """Whether the rig's diagnosis named the effect."""


@dataclass(frozen=True)
class Coefficient:
    """One coefficient over all rigs: of an effect of the catalogue, or a parameter by the paper's symbol.

    A parameter has no axis and no finding. There is no mean where fewer than two rigs determine the coefficient.
    """

    name: str
    axis: str
    finding: Finding | None
    named: tuple[str, ...]
    """Rigs whose diagnosis named the effect."""
    unit: str
    alike: bool | None
    """Whether the rigs may have one value; None without a mean."""
    pooled: Pooled | None
    rigs: tuple[RigEstimate, ...]

    @property
    def certain(self) -> bool:
        """Whether a rig names the effect and the interval of its mean does without zero."""
        return bool(self.named) and self.pooled is not None and self.pooled.has_sign

    @property
    def counted(self) -> tuple[RigEstimate, ...]:
        """Rigs that the mean is made of."""
        return tuple(entry for entry in self.rigs if not entry.left_out)


@dataclass(frozen=True, eq=False)
class Fleet:
    """What several diagnoses say together."""

    diagnoses: Mapping[str, Diagnosis]
    """By rig."""
    effects: tuple[Coefficient, ...]
    """Every entry of the catalogue: first what repeats, then what differs between rigs, and so on in the order of
    :class:`Finding`; inside of these the effects that most rigs name first."""
    parameters: tuple[Coefficient, ...]
    """Parameters of the corrected models by the paper's symbols."""
    failures: Mapping[str, str]
    """Why a rig has no diagnosis, by rig."""

    def found(self, *findings: str) -> tuple[Coefficient, ...]:
        """Effects with one of these findings."""
        return tuple(entry for entry in self.effects if entry.finding in findings)

    def document(self, provenance: Mapping[str, Any]) -> dict[str, Any]:
        """Give the content of fleet.json."""
        return plain(
            {
                "schema": SCHEMA,
                "rigs": [_rig_document(rig, found) for rig, found in self.diagnoses.items()],
                "failures": [{"rig": rig, "error": error} for rig, error in self.failures.items()],
                "effects": self.effects,
                "parameters": self.parameters,
                "settings": {
                    "level": LEVEL,
                    "false_discovery_rate": FALSE_DISCOVERY_RATE,
                    "largest_like_spread": LARGEST_LIKE_SPREAD,
                    "homogeneous_p": HOMOGENEOUS,
                },
                "provenance": provenance,
            }
        )


def _rig_document(rig: str, found: Diagnosis) -> dict[str, Any]:
    return {
        "rig": rig,
        "verdict": found.verdict,
        "effects": [{"name": effect.name, "axis": effect.axis} for effect in found.effects],
        "possible": [{"name": effect.name, "axis": effect.axis} for effect in found.possible],
        "use": {axis: report.use for axis, report in found.axes.items()},
        "held_out_nats": found.held_out.gain.value,
        "prediction_1s_rad": {
            axis: {"before": report.before.prediction_1s.value, "after": report.after.prediction_1s.value}
            for axis, report in found.axes.items()
        },
        "data": [{"file": entry.file, "sha256": entry.sha256, "used_for": entry.used_for} for entry in found.data],
        "notes": found.notes,
        "seconds": found.seconds,
    }


def diagnose_rigs(
    rigs: Mapping[str, Rig],
    failures: Mapping[str, str] | None = None,
    progress: Callable[[str, float], None] = lambda what, share: None,
) -> Fleet:
    """Diagnose rigs one after the other; a rig whose logs cannot be diagnosed is lost alone, as are ``failures``.

    Rigs that share a flight are not diagnosed: one of them has a log of the other, and nobody knows which.
    IdentifierError if fewer than two rigs could be diagnosed; it says what is wrong with the others.
    """
    diagnoses: dict[str, Diagnosis] = {}
    lost = dict(failures or {}) | _sharing(rigs)
    for number, (name, rig) in enumerate(rigs.items() if len(rigs) > 1 else ()):

        def within(what: str, share: float, name: str = name, number: int = number) -> None:
            progress(f"{name}: {what}", (number + share) / len(rigs))

        if name not in lost:
            try:
                diagnoses[name] = rig.diagnose(progress=within)
            except Exception as error:
                lost[name] = error_text(error)
    if lost and len(diagnoses) < 2:
        raise IdentifierError("; ".join(f"rig {name}: {error}" for name, error in lost.items()))
    return fleet_of(diagnoses, lost)


def _sharing(rigs: Mapping[str, Rig]) -> dict[str, str]:
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


def fleet_of(diagnoses: Mapping[str, Diagnosis], failures: Mapping[str, str] | None = None) -> Fleet:
    """Set the diagnoses of several rigs beside each other.

    IdentifierError if there are fewer than two; ``failures`` say why other rigs have none.
    """
    if len(diagnoses) < 2:
        raise IdentifierError(f"a fleet needs the diagnoses of two rigs or more, {len(diagnoses)} given.")
    estimates: dict[tuple[str, str], list[RigEstimate]] = {}
    for rig, found in diagnoses.items():
        for entry in found.catalogue:
            estimates.setdefault((entry.name, entry.axis), []).append(_of_effect(rig, found, entry))
        for symbol, own in found.parameters_after.items():
            known = _of_rig(rig, own, "", "" if _determined(own) else "given")
            estimates.setdefault((symbol, ""), []).append(known)
    means = {key: _mean(rigs) for key, rigs in estimates.items()}
    # Benjamini and Hochberg: p of every effect after correction over the catalogue
    tested = {key: mean.none_p for key, mean in means.items() if mean and key[1]}
    corrected = false_discovery_control([*tested.values()]) if tested else ()
    refuted = {key for key, p in zip(tested, corrected, strict=True) if p <= FALSE_DISCOVERY_RATE}
    effects, parameters = [], []
    for (name, axis), rigs in estimates.items():
        mean, named = means[name, axis], tuple(entry.rig for entry in rigs if entry.named)
        finding = _finding(effect(name, axis), len(named), mean, (name, axis) in refuted) if axis else None
        alike = mean.alike if mean else None
        coefficient = Coefficient(name, axis, finding, named, rigs[0].unit, alike, mean, tuple(rigs))
        if axis:
            effects.append(coefficient)
        elif mean:
            parameters.append(coefficient)
    order = [*Finding, None]
    effects.sort(key=lambda e: (order.index(e.finding), -len(e.named), e.pooled.p if e.pooled else 1.0))
    return Fleet(dict(diagnoses), tuple(effects), tuple(parameters), dict(failures or {}))


def _of_rig(rig: str, own: Estimate, verdict: str, left_out: str, named: bool = False) -> RigEstimate:
    return RigEstimate(rig, own.value, own.standard_error, own.unit, own.interval, verdict, left_out, named)


def _of_effect(rig: str, diagnosis: Diagnosis, entry: CatalogueVerdict) -> RigEstimate:
    """Give the catalogue's estimate of one effect on one rig, and why the mean does without it."""
    key, family = (entry.name, entry.axis), effect(entry.name, entry.axis).family
    named = [own for own in diagnosis.effects if own.coefficient is not None]
    is_named = key in {(own.name, own.axis) for own in named}
    rivals = [
        effect_name(own.name, own.axis)
        for own in named
        if key in own.alternatives or (own.axis == entry.axis and effect(own.name, own.axis).family == family)
    ]
    left_out = ""
    if entry.verdict == Verdict.NOT_TESTABLE or not _determined(entry.estimate):
        left_out = f"not testable: {entry.why}"
    elif not is_named and rivals:
        left_out = f"{rivals[0]} is named in its place"
    return _of_rig(rig, entry.estimate, str(entry.verdict), left_out, is_named)


def _determined(estimate: Estimate) -> bool:
    return abs(estimate.value) < inf and 0.0 < (estimate.standard_error or 0.0) < inf


def _mean(rigs: Sequence[RigEstimate]) -> Pooled | None:
    counted = [entry for entry in rigs if not entry.left_out]
    if len(counted) < 2:
        return None
    return pooled([entry.value for entry in counted], [entry.standard_error or 0.0 for entry in counted])


def _finding(entry: Effect, named: int, mean: Pooled | None, is_refuted: bool) -> Finding:
    """Find out of an effect that so many rigs name, once it is known whether it is refuted that no rig has it."""
    if mean is None:
        return Finding.OPEN if named else Finding.NOT_SHOWN
    if named >= 2 or (is_refuted and mean.has_sign and entry.lower <= mean.mean <= entry.upper):
        if not mean.alike:
            return Finding.DIFFERS
        return Finding.REPEATS if is_refuted else Finding.UNCONFIRMED
    return Finding.OWN if named else Finding.NOT_SHOWN
