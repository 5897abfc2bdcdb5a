"""All coefficients of the catalogue and all parameters of the model over the rigs of a fleet, and what they say.

The estimates of an effect are those of the catalogue's verdicts, whether the rig's diagnosis named the effect or not,
so that a weak effect shows if it repeats. A rig is left out of the mean of an effect

* where the effect is not testable, since an estimate that the logs do not determine says nothing of the rig;
* where it is an alternative of an effect that was named, or one of the same mechanism was named on the same axis (a
  delay where a lag is named): its estimate is then what that one leaves of it.

An effect *repeats* if at least two rigs name it, or if the estimates of all rigs show it together:

* that no rig has it is refuted at a false discovery rate of .5 % over all effects (Benjamini and Hochberg 1995), the
  level at which a diagnosis accuses a clean rig. It is so low since the scores of entries that were not found scatter
  by 1.2 standard errors on a clean rig, of whose shapes the likeliest speaks;
* the interval of the mean does without zero, so that it is no matter of one rig;
* and the mean lies in the catalogue's plausible range: no loss of thrust is negative.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import isfinite

from heli_identifier.errors import IdentifierError
from heli_identifier.online import Estimate
from heli_identifier.tracing import Diagnosis, FoundEffect, Verdict
from heli_identifier.workbench.fleet.meta_analysis import LEVEL, Pooled, pooled
from heli_identifier.workbench.report.sentences import effect_name
from heli_plant.effects import effect

FALSE_DISCOVERY_RATE = 0.005


class Finding(StrEnum):
    """What a fleet says of one effect."""

    REPEATS = "repeats"
    DIFFERS = "differs between rigs"
    OWN = "one rig's own"
    OPEN = "not testable elsewhere"
    NOT_SHOWN = "not shown"


@dataclass(frozen=True)
class RigEstimate:
    """The coefficient of one rig.

    Attributes
    ----------
    rig : str
    estimate : Estimate
    verdict : str
        Of the rig's diagnosis; empty for a parameter.
    named : bool
        Whether the effect is in the rig's corrected model.
    left_out : str
        Why the mean does without this rig; empty if it does not.
    """

    rig: str
    estimate: Estimate
    verdict: str = ""
    named: bool = False
    left_out: str = ""


@dataclass(frozen=True)
class Coefficient:
    """One coefficient over all rigs.

    Attributes
    ----------
    name : str
        Of an effect of the catalogue, or the paper's symbol of a parameter.
    axis : str
        Empty for a parameter.
    unit : str
    rigs : tuple of RigEstimate
        In the order of the rigs.
    mean : Pooled or None
        None where fewer than two rigs determine the coefficient.
    finding : Finding or None
        None for a parameter.
    """

    name: str
    axis: str
    unit: str
    rigs: tuple[RigEstimate, ...]
    mean: Pooled | None
    finding: Finding | None = None

    @property
    def named(self) -> tuple[str, ...]:
        """Rigs whose diagnosis named the effect."""
        return tuple(entry.rig for entry in self.rigs if entry.named)

    @property
    def counted(self) -> tuple[RigEstimate, ...]:
        """Rigs that the mean is made of."""
        return tuple(entry for entry in self.rigs if not entry.left_out)


@dataclass(frozen=True, eq=False)
class Fleet:
    """What several diagnoses say together.

    Attributes
    ----------
    diagnoses : mapping of str to Diagnosis
        By rig.
    effects : tuple of Coefficient
        Every entry of the catalogue: first what repeats, then what differs between rigs, and so on in the order of
        :class:`Finding`; inside of these the effects that most rigs name first.
    parameters : tuple of Coefficient
        Parameters of the corrected models by the paper's symbols.
    """

    diagnoses: Mapping[str, Diagnosis]
    effects: tuple[Coefficient, ...]
    parameters: tuple[Coefficient, ...]

    def found(self, *findings: Finding) -> tuple[Coefficient, ...]:
        """Effects with one of these findings."""
        return tuple(entry for entry in self.effects if entry.finding in findings)


def fleet_of(diagnoses: Mapping[str, Diagnosis]) -> Fleet:
    """Set the diagnoses of several rigs beside each other.

    Parameters
    ----------
    diagnoses : mapping of str to Diagnosis
        By the name of the rig; at least two.

    Raises
    ------
    IdentifierError
        Fewer than two diagnoses.
    """
    if len(diagnoses) < 2:
        raise IdentifierError(f"a fleet needs the diagnoses of two rigs or more, {len(diagnoses)} given.")
    keys = dict.fromkeys((entry.name, entry.axis) for found in diagnoses.values() for entry in found.catalogue)
    estimates = {key: [e for rig, found in diagnoses.items() for e in _of_effect(rig, found, key)] for key in keys}
    means = {key: _mean(entries) for key, entries in estimates.items()}
    together = _shown_together(means)
    effects = []
    for (name, axis), entries in estimates.items():
        mean = means[name, axis]
        finding = _finding(entries, mean, (name, axis) in together)
        effects.append(Coefficient(name, axis, entries[0].estimate.unit, tuple(entries), mean, finding))
    order = list(Finding)
    effects.sort(
        key=lambda e: (order.index(e.finding or Finding.NOT_SHOWN), -len(e.named), e.mean.p if e.mean else 1.0)
    )
    symbols = dict.fromkeys(symbol for found in diagnoses.values() for symbol in found.parameters_after)
    parameters = [_parameter(symbol, diagnoses) for symbol in symbols]
    return Fleet(dict(diagnoses), tuple(effects), tuple(p for p in parameters if p.mean is not None))


def _of_effect(rig: str, diagnosis: Diagnosis, key: tuple[str, str]) -> list[RigEstimate]:
    """Give the catalogue's estimate of one effect on one rig; none if its catalogue lacks the entry."""
    found = {(named.name, named.axis): named for named in diagnosis.effects if named.coefficient is not None}
    rivals = [named for named in found.values() if key in named.alternatives or _same_mechanism(named, key)]
    estimates = []
    for entry in diagnosis.catalogue:
        if (entry.name, entry.axis) != key:
            continue
        left_out = ""
        if entry.verdict == Verdict.NOT_TESTABLE or not _determined(entry.estimate):
            left_out = f"not testable: {entry.why}"
        elif key not in found and rivals:
            left_out = f"{effect_name(rivals[0].name, rivals[0].axis)} is named in its place"
        estimates.append(RigEstimate(rig, entry.estimate, str(entry.verdict), key in found, left_out))
    return estimates


def _same_mechanism(found: FoundEffect, key: tuple[str, str]) -> bool:
    """Whether a named effect acts on the axis of an entry by the mechanism of that entry."""
    return found.axis == key[1] and effect(found.name, found.axis).family == effect(*key).family


def _parameter(symbol: str, diagnoses: Mapping[str, Diagnosis]) -> Coefficient:
    """Set one parameter of all corrected models beside each other; where it was given it is left out."""
    entries = []
    for rig, found in diagnoses.items():
        if symbol in found.parameters_after:
            estimate = found.parameters_after[symbol]
            entries.append(RigEstimate(rig, estimate, left_out="" if _determined(estimate) else "given"))
    return Coefficient(symbol, "", entries[0].estimate.unit, tuple(entries), _mean(entries))


def _determined(estimate: Estimate) -> bool:
    error = estimate.standard_error
    return error is not None and isfinite(estimate.value) and isfinite(error) and error > 0.0


def _mean(entries: Sequence[RigEstimate]) -> Pooled | None:
    estimates = [entry.estimate for entry in entries if not entry.left_out]
    if len(estimates) < 2:
        return None
    return pooled([e.value for e in estimates], [e.standard_error or 0.0 for e in estimates])


def _shown_together(means: Mapping[tuple[str, str], Pooled | None]) -> set[tuple[str, str]]:
    """Effects that the estimates of all rigs show together."""
    from statsmodels.stats.multitest import fdrcorrection

    tested = {key: mean for key, mean in means.items() if mean is not None}
    if not tested:
        return set()
    refuted, _ = fdrcorrection([mean.none_p for mean in tested.values()], FALSE_DISCOVERY_RATE)
    return {
        key
        for (key, mean), yes in zip(tested.items(), refuted, strict=True)
        if yes and mean.p < 1.0 - LEVEL and effect(*key).lower <= mean.mean <= effect(*key).upper
    }


def _finding(entries: Sequence[RigEstimate], mean: Pooled | None, together: bool) -> Finding:
    named = sum(entry.named for entry in entries)
    if mean is None:
        return Finding.OPEN if named else Finding.NOT_SHOWN
    if named >= 2 or together:
        return Finding.REPEATS if mean.alike else Finding.DIFFERS
    return Finding.OWN if named else Finding.NOT_SHOWN
