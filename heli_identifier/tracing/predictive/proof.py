"""Proof of predictive families: fits by the multi-step errors themselves, with a representative and without it.

The quadratic problem around the fit of everything overstates what a curved law is worth far from there. So a
representative stays only if a fit without it is worse by more than :data:`WORTH` on some axis, and if the quadratic
problem around the fit says the same of every log predicted by a fit to the others. What the fit lacks is looked for
around it, and has to prove the same worth.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from heli_identifier.tracing.multistep.fit import MultistepFit, settled
from heli_identifier.tracing.multistep.nested import growth, search_without, widened, with_fields, without
from heli_identifier.tracing.multistep.robust import loss
from heli_identifier.tracing.multistep.search import Search
from heli_identifier.tracing.predictive.judge import STEADY, WORTH, Judge, Support
from heli_identifier.tracing.predictive.quadratic import quadratic_of


@dataclass(frozen=True, eq=False)
class Proven:
    """A fit with representatives that proved their worth, and what the quadratic problem around it says.

    Attributes
    ----------
    fit : MultistepFit
    fields : dict of str to str
        The representatives left, by family.
    worth : dict of str to float
        Share by which an axis's error grows without each.
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


def prove(
    shown: MultistepFit,
    begun: Search,
    everything: MultistepFit,
    fields: dict[str, str],
    families: dict[str, tuple[str, ...]],
) -> Proven:
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
        least = _worthless(worth)
        if least is None:
            around = _around(fit, everything, begun if fit is shown else None)
            judge = Judge(quadratic_of(around), everything.names, shown.names, families)
            least = _worthless(judge.unseen_worth(fields, fields))
        if least is not None:
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
            return Proven(fit, fields, worth, judge, found, stability)


def _worthless(worth: Mapping[str, float]) -> str | None:
    """Family of the least worth, if that is no more than :data:`WORTH`."""
    least = min(worth, key=lambda name: worth[name], default=None)
    return least if least is not None and worth[least] <= WORTH else None


def _larger(
    fit: MultistepFit, judge: Judge, name: str, fields: Mapping[str, str], dropped: set[str]
) -> tuple[MultistepFit | None, str]:
    """Fit with the first member of a family that proves its worth, the one that stands best tried first.

    ``dropped`` grows by the members that do not; None where no member is left.
    """
    while not dropped.issuperset(judge.families[name]):
        field = judge.best(name, fields, dropped)
        if judge.unseen_worth([name], {**fields, name: field})[name] > WORTH:
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
