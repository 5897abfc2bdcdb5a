"""Which families of effects predict beyond what is shown: a joint search around the fit of everything.

1. Everything at once is fitted (:func:`fit_everything`): a ridge regression under the priors, whose quadratic problem
   is taken apart into independent blocks. It shows what could be explained.
2. The families that are steady beside the effects that are shown (:meth:`Judge.steady`) are candidates. Of each the
   member that stands best for it alone is its representative.
3. The effects shown and the representatives are fitted, and each representative has to prove its worth
   (:mod:`heli_identifier.tracing.predictive.proof`).
4. Stability is taken once more around this fit, and that is what is reported.

The list says what improves predictions, not what causes the motion.
"""

from collections.abc import Collection
from dataclasses import dataclass, replace

from heli_identifier.tracing.multistep.fit import STEPS, MultistepFit, settled
from heli_identifier.tracing.multistep.nested import widened, without
from heli_identifier.tracing.multistep.priors import ENTRIES, coordinates
from heli_identifier.tracing.multistep.search import NEAR, Search
from heli_identifier.tracing.predictive.families import FAMILIES, family_of
from heli_identifier.tracing.predictive.judge import POSSIBLE, STEADY, WORTH, Judge
from heli_identifier.tracing.predictive.proof import Proven, prove
from heli_identifier.tracing.predictive.quadratic import quadratic_of
from heli_identifier.tracing.predictive.stand_ins import stand_ins

GROUND_EFFECT = "ground_effect_elevation"


@dataclass(frozen=True)
class Finding:
    """A family and what the logs say of it.

    Attributes
    ----------
    family : str
        Name of the family.
    field : str
        Coefficient of the member that represents it.
    stability : float
        Share of the halves of the data in which it is found.
    worth : float
        Largest share over the axes by which the error grows in a fit without it; NaN where none was made.
    stand_ins : tuple of str
        Coefficients of other families that could take its place.
    """

    family: str
    field: str
    stability: float
    worth: float
    stand_ins: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class PredictiveSelection:
    """Outcome of the search.

    Attributes
    ----------
    everything : MultistepFit
        The fit of everything at once.
    fit : MultistepFit
        Fit of the effects shown and the predictive ones.
    predictive : tuple of Finding
        Families that are steady and worth their parameter, the most worth first.
    possible : tuple of Finding
        Families that only some halves of the data find.
    """

    everything: MultistepFit
    fit: MultistepFit
    predictive: tuple[Finding, ...]
    possible: tuple[Finding, ...]


def with_everything(shown: MultistepFit) -> Search:
    """Give the search that stands where a fit ended, with the whole catalogue beside what is shown."""
    fields = [entry.field for entry in ENTRIES if entry.field not in shown.names]
    return widened(shown, coordinates(fields, shown.problem.base))


def fit_everything(begun: Search) -> MultistepFit:
    """Fit the whole catalogue beside what is shown, from :func:`with_everything`."""
    search = replace(begun)  # the descent moves it
    return settled(search, search.descend(STEPS, enough=NEAR))


def select_predictive(shown: MultistepFit) -> PredictiveSelection:
    """Search for families that improve predictions beyond the effects shown.

    Parameters
    ----------
    shown : MultistepFit
        Fit of the simplified model with the effects that are shown.
    """
    shown = _above_ground(shown)
    begun = with_everything(shown)
    everything = fit_everything(begun)
    represented = {family_of(field) for field in shown.names}
    families = {family.name: family.members for family in FAMILIES if family.name not in represented}
    judge = Judge(quadratic_of(everything), everything.names, shown.names, families)
    steady = judge.steady()
    fields = {name: judge.best(name, steady) for name in steady}
    proven = prove(shown, begun, everything, fields, families)
    fit, fields, worth, stability = proven.fit, proven.fields, proven.worth, proven.stability
    named = {name: field for name, field in fields.items() if stability[name] >= STEADY}
    instead = stand_ins(proven.judge, named)
    predictive = [Finding(name, named[name], stability[name], worth[name], instead[name]) for name in named]
    possible = _possible(proven, named)
    unsteady = [field for name, field in fields.items() if name not in named]
    if unsteady:
        fit = without(fit, unsteady)
    predictive.sort(key=lambda finding: -finding.worth)
    return PredictiveSelection(everything, fit, tuple(predictive), tuple(possible))


def _possible(proven: Proven, named: Collection[str]) -> list[Finding]:
    """Families that many halves of the data find, but not enough of them; all that prove their worth on unseen logs."""
    found, fields = [], proven.fields
    for name, support in proven.support.items():
        if name in named or proven.stability[name] < POSSIBLE or support.worth <= WORTH:
            continue
        field = fields.get(name) or proven.judge.best(name, fields)
        # those of the fit have proved their worth there
        if name in fields or proven.judge.unseen_worth([name], {**fields, name: field})[name] > WORTH:
            found.append(Finding(name, field, proven.stability[name], proven.worth.get(name, support.worth)))
    return found


def _above_ground(shown: MultistepFit) -> MultistepFit:
    """Put the ground at the lowest elevation of the logs, where no fit has found it."""
    if GROUND_EFFECT in shown.names:
        return shown
    lowest = min(float(starts.record.angles[:, 1].min()) for starts in shown.problem.records)
    return replace(shown, problem=replace(shown.problem, base=shown.problem.base._replace(ground_elevation=lowest)))
