"""Which families of effects predict beyond what is shown: a joint search around the fit of everything.

1. Everything at once is fitted (:func:`fit_everything`): a ridge regression under the priors, whose quadratic problem
   is taken apart into independent blocks. It shows what could be explained.
2. The families that are steady beside the effects that are shown (:meth:`Judge.steady`) are candidates. Of each the
   member that stands best for it alone is its representative.
3. The effects shown and the representatives are fitted. A representative stays if a fit without it is worse by more
   than :data:`WORTH` on some axis, and if the quadratic problem around the fit says the same of every log predicted by
   a fit to the others. What this fit lacks is looked for around it, and has to prove the same worth.
   The quadratic problem around everything overstates what a curved law is worth far from there.
4. Stability is taken once more around this fit, and that is what is reported.

The list says what improves predictions, not what causes the motion.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from heli_identifier.tracing.multistep.fit import STEPS, MultistepFit, settled
from heli_identifier.tracing.multistep.nested import growth, search_without, widened, with_fields, without
from heli_identifier.tracing.multistep.priors import ENTRIES, coordinates
from heli_identifier.tracing.multistep.robust import loss
from heli_identifier.tracing.multistep.search import NEAR, Search
from heli_identifier.tracing.predictive.families import FAMILIES, family_of
from heli_identifier.tracing.predictive.judge import POSSIBLE, STEADY, WORTH, Judge, Support
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
    proven = _proven(shown, begun, everything, fields, families)
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


def _above_ground(shown: MultistepFit) -> MultistepFit:
    """Put the ground at the lowest elevation of the logs, where no fit has found it."""
    if GROUND_EFFECT in shown.names:
        return shown
    lowest = min(float(starts.record.angles[:, 1].min()) for starts in shown.problem.records)
    return replace(shown, problem=replace(shown.problem, base=shown.problem.base._replace(ground_elevation=lowest)))


@dataclass(frozen=True, eq=False)
class _Proven:
    """A fit with representatives that proved their worth, and what the quadratic problem around it says.

    Attributes
    ----------
    fit : MultistepFit
    fields : dict of str to str
        The representatives left, by family.
    worth : dict of str to float
        Share of an axis's error that each takes off.
    judge : Judge
        Of the quadratic problem around the fit.
    support : dict of str to Support
        Of every family, beside those left.
    stability : dict of str to float
        The same for the share of the halves.
    """

    fit: MultistepFit
    fields: dict[str, str]
    worth: dict[str, float]
    judge: Judge
    support: dict[str, Support]
    stability: dict[str, float]


def _possible(proven: _Proven, named: Collection[str]) -> list[Finding]:
    """Families that many halves of the data find, but not enough of them; all that prove their worth on unseen logs."""
    found, fields = [], proven.fields
    for name, support in proven.support.items():
        if name in named or proven.stability[name] < POSSIBLE or support.worth <= WORTH:
            continue
        field = fields.get(name) or proven.judge.best(name, fields)
        beside = {**fields, name: field}
        if proven.judge.with_single(beside).unseen_worth([name], beside)[name] > WORTH:
            found.append(Finding(name, field, proven.stability[name], proven.worth.get(name, support.worth)))
    return found


def _proven(
    shown: MultistepFit,
    begun: Search,
    everything: MultistepFit,
    fields: dict[str, str],
    families: dict[str, tuple[str, ...]],
) -> _Proven:
    """Fit with the representatives that prove their worth, and with what that fit lacks.

    No field comes back that was dropped here; another member of its family may take its place, since the quadratic
    problem can err about which of them fits best.
    """
    dropped: set[str] = set()
    fields = dict(fields)
    fit = _fitted(shown, everything, list(fields.values())) if fields else shown
    while True:
        smaller = {name: search_without(fit, {field}) for name, field in fields.items()}
        worth = {name: growth(fit, search.errors) for name, search in smaller.items()}
        least = min(worth, key=lambda name: worth[name], default=None)
        if least is not None and worth[least] <= WORTH:
            fit = settled(smaller[least], True)
            dropped.add(fields.pop(least))
            continue
        around = _around(fit, everything, begun if fit is shown else None)
        judge = Judge(quadratic_of(around), everything.names, shown.names, families)
        unseen = judge.with_single(fields).unseen_worth(fields, fields)
        least = min(unseen, key=lambda name: unseen[name], default=None)
        if least is not None and unseen[least] <= WORTH:
            fit = settled(smaller[least], True)
            dropped.add(fields.pop(least))
            continue
        found, stability = judge.around(list(fields))
        lacking = [n for n in found if n not in fields and found[n].enough and stability[n] >= STEADY]
        for name in sorted(lacking, key=lambda n: -found[n].score):
            larger, field = _larger(fit, judge, name, fields, dropped)
            if larger is not None:
                fit, fields = larger, {**fields, name: field}
                break
        else:
            return _Proven(fit, fields, worth, judge, found, stability)


def _larger(
    fit: MultistepFit, judge: Judge, name: str, fields: Mapping[str, str], dropped: set[str]
) -> tuple[MultistepFit | None, str]:
    """Fit with the first member of a family that proves its worth, the one that stands best tried first.

    ``dropped`` grows by the members that do not; None where no member is left.
    """
    while not dropped.issuperset(judge.families[name]):
        field = judge.best(name, fields, dropped)
        beside = {**fields, name: field}
        if judge.with_single(beside).unseen_worth([name], beside)[name] > WORTH:
            larger = with_fields(fit, [field])
            if growth(larger, fit.errors) > WORTH:
                return larger, field
        dropped.add(field)
    return None, ""


def _fitted(shown: MultistepFit, everything: MultistepFit, added: Sequence[str]) -> MultistepFit:
    """Fit with some effects beside those shown, begun at what is shown and at everything; the better optimum.

    Friction that sticks makes corners in the objective, at which one of the two may end early.
    """
    others = set(everything.names) - set(shown.names) - set(added)
    ends = [with_fields(shown, added), without(everything, others)]
    common = np.min([end.scales for end in ends], axis=0)
    return min(ends, key=lambda end: loss(end.errors, common) + 0.5 * float(end.x @ end.x))


def _around(fit: MultistepFit, everything: MultistepFit, search: Search | None = None) -> MultistepFit:
    """Give the problem of everything linearised at another fit, where all other effects are off.

    ``search`` is that of everything begun at this fit, where it is known.
    """
    names = fit.names
    search = search or widened(fit, [c for c in everything.fields if c.field not in names])
    order = [[c.field for c in search.frame].index(name) for name in everything.names]
    columns = [*order, *range(len(order), search.jacobian[0].shape[-1])]
    return replace(
        fit,
        fields=tuple(search.frame[i] for i in order),
        x=search.x[order],
        jacobian=[J[..., columns] for J in search.jacobian],
    )
