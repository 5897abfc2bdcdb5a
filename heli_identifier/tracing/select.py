"""Names: which effects the plant lacks, by forward and backward steps on the quadratic form and exact refits.

An effect enters the model at a score of :data:`.settings.KEPT` nats, the largest first, and leaves it below; when the
set stands, the model is refitted and the catalogue is scored again around it, until the set stands there as well. What
has left stays away. What is in the fit leaves before others enter, or a round later: two laws that bend one curve, a
dead zone and a quadratic thrust, seem to replace each other until both are fitted. Of laws of one family that the data
do not tell apart the one with the fewest shapes is taken. What scores :data:`.settings.NAMED` is established, if a
refit without it loses as much: the quadratic form of a law with corners, such as a dead zone, promises five times what
it keeps. Effects of one family are one finding: its score is what the likelihood loses without all its members.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

from .fit import Fit, fit
from .likelihood import Point
from .rig import Effect
from .score import Score, Scores
from .settings import CATALOGUE_WIDTHS, KEPT, REFITTED, ROUGHLY, TIMED, UNKNOWN

_NOT: Mapping[str, float] = {}


@dataclass(frozen=True, eq=False)
class Finding:
    """An effect in the model, with what stands for it."""

    effect: Effect
    score: Score
    """Its own: what is lost without it beside all others."""
    family_score: float
    """What is lost without all members of its family [nats]."""
    alternatives: tuple[Effect, ...]
    """Effects that would explain the data about as well in its place."""
    leads: bool = True
    """Whether it is the strongest of its family, which is named by it."""
    exact: float | None = None
    """What is lost without its family by a refit [nats]; None where that was not asked for."""
    at_end: bool = False
    """Whether a shape of its law lies at the end of its range, so that something else is more likely: slow turns that
    encoders round look like a friction that fades over less than they resolve, the answers of a controller to the
    encoder like an arm that bends faster than a metal arm does."""

    @property
    def established(self) -> bool:
        """Whether it is shown."""
        asked = self.effect.shown_from
        named = self.score.score > asked or (self.leads and self.family_score > asked)
        return named and not self.at_end and (self.exact is None or self.exact > REFITTED)

    @property
    def stated(self) -> float:
        """Score that is stated [nats]: of the family where it leads, and not more than a refit leaves."""
        score = max(self.score.score, self.family_score if self.leads else 0.0)
        return score if self.exact is None else min(score, self.exact)


@dataclass(frozen=True, eq=False)
class Selection:
    """What the search of one data set found."""

    null: Fit
    fit: Fit
    """null, fit: The model before, and that with all effects of the set."""
    findings: tuple[Finding, ...]
    """Strongest first."""
    scores: dict[str, Score]
    """The whole catalogue at the last fit."""
    last: Scores
    """The quadratic form there."""

    @cached_property
    def whole(self) -> Fit:
        """The plant with all effects of the set and, if the logs are as likely, with rigid-body mechanics."""
        return fit_delivered(self, [])


def select(null: Fit, candidates: Sequence[Effect], start: Fit | None = None) -> Selection:
    """Search the candidates beside the model before, ``null``, from a ``start`` with effects or curves of its own."""
    fitted, barred = start or null, set[str]()
    while True:
        around = Scores(fitted, candidates)
        selected = around.selected
        chosen = stepwise(around, selected, barred)
        barred |= set(selected) - set(chosen)
        if set(chosen) == set(selected) and (chosen := _simpler(around, selected, barred)) == selected:
            findings = _weighed(around, null)
            needless = _needless(around, findings)
            if not needless:
                break
            barred.update(needless)
            chosen = [name for name in selected if name not in needless]
        fitted = _fit_entered(around, chosen)
    findings.sort(key=lambda f: -f.stated)
    return Selection(null, around.fitted, tuple(findings), around.scores(around.selected), around)


def _needless(around: Scores, findings: Sequence[Finding]) -> list[str]:
    """Effects of the set that a refit shows to be worth less than their entry, and faults that no log could time."""
    faults = around.fitted.likelihood.faults.items()
    on_time = {fault.field for fault, size in faults if fault.unit == "s" and size < TIMED}
    return [name for f in findings if (name := f.effect.field) in on_time or f.stated < around.entry_score(name)]


def _fit_entered(around: Scores, chosen: Sequence[str]) -> Fit:
    """Fit a set with new effects, from their best shapes.

    Where a fault of the log is the best it enters alone, else effects without faults, and the others are asked for
    again beside it: an effect that is missing leaves much that faults of the log imitate, and the other way round.
    """
    new = [name for name in chosen if name not in around.selected]
    wrong = [name for name in new if around.effects[name].fault is not None]
    new = wrong[:1] if new and new[0] in wrong else [name for name in new if name not in wrong]
    shapes: dict[str, float] = {}
    for name in new:
        shapes |= dict(around.coordinates[around.chosen[name]].beside)
    kept = [name for name in chosen if name in around.selected]
    chosen = [*kept, *new]
    return refit(around.fitted, list(around.effects.values()), chosen, shapes, others=[around.point(chosen)])


def refit(
    fitted: Fit, candidates: Sequence[Effect], chosen: Sequence[str], values: Mapping[str, float] = _NOT,
    value_only: bool = False, others: Sequence[Point] = (),
) -> Fit:  # fmt: skip
    """Fit with other effects and faults of the candidates, from ``values`` of parameters or from ``others``' points."""
    by_field, likelihood = {effect.field: effect for effect in candidates}, fitted.likelihood
    gone = by_field.keys() - set(chosen)
    kept = {fault: size for fault, size in likelihood.faults.items() if fault.field not in gone}
    catalogue = {name for effect in candidates for name in effect.parameters}
    names = [name for name in fitted.names if name not in catalogue]
    names += [name for field in chosen for name in by_field[field].parameters if name not in names]
    off = {name: 0.0 for name in fitted.fields if name in gone}
    return fit(
        likelihood if kept == likelihood.faults else likelihood.undo_faults(kept), list(dict.fromkeys(names)), fitted,
        {**values, **off}, value_only, others,
    )  # fmt: skip


def fit_delivered(selection: Selection, dropped: Sequence[str]) -> Fit:
    """Fit the plant without some effects of the selection, and with rigid-body mechanics if the logs are as likely.

    Its terms come from one kinetic and one potential energy, so that a rig has all of them, each with c = 1 +-
    1/3: one that is established brings the others, unless the logs say that they are missing.
    """
    candidates = selection.null.likelihood.rig.candidates
    kept = [f.effect.field for f in selection.findings if f.effect.fault is None and f.effect.field not in dropped]
    alone = selection.fit
    if dropped:
        alone = refit(selection.fit, candidates, kept)
    if _lack_mechanics(selection.last, kept):
        return alone
    proven = any(f.established and f.effect.certain for f in selection.findings)
    least = alone.value + proven * KEPT
    whole = _add_mechanics(alone, kept)
    if whole.value < least + 2.0 * ROUGHLY:
        whole = refit(whole, candidates, [*kept, *_absent_mechanics(candidates, kept)])
    return alone if whole.value > least else whole


def _absent_mechanics(candidates: Iterable[Effect], kept: Collection[str]) -> list[str]:
    """Terms of rigid-body mechanics that are not among some effects."""
    return [effect.field for effect in candidates if effect.certain and effect.field not in kept]


def _lack_mechanics(around: Scores, kept: Collection[str]) -> bool:
    """Whether the rig has no terms of rigid-body mechanics, or the logs say that they are missing beside effects."""
    if not _absent_mechanics(around.fitted.likelihood.rig.candidates, ()):
        return True
    beside = around.scores(kept, among=_absent_mechanics(around.effects.values(), kept)).values()
    squares = [CATALOGUE_WIDTHS**-2 + own.standard_error**2 for own in beside]
    away = [0.5 * (1.0 - own.value) ** 2 / square - own.score for own, square in zip(beside, squares, strict=True)]
    return sum(away) > 3.0 * KEPT  # nats by the quadratic form, each term apart: it errs by less


def _add_mechanics(fitted: Fit, kept: Sequence[str]) -> Fit:
    """Fit roughly with some effects and all terms of rigid-body mechanics."""
    candidates, expected = fitted.likelihood.rig.candidates, (1.0, 1.0 / CATALOGUE_WIDTHS)
    begun = dict.fromkeys(_absent_mechanics(candidates, kept), 1.0)
    rig = fitted.likelihood.rig.expecting(dict.fromkeys(_absent_mechanics(candidates, ()), expected))
    start = replace(fitted, likelihood=replace(fitted.likelihood, rig=rig))
    return refit(start, candidates, [*kept, *begun], begun, value_only=True)


def _weighed(around: Scores, null: Fit) -> list[Finding]:
    """Weigh the effects of the set; each family is refitted without it.

    The plant has rigid-body mechanics or not, whichever is likelier with the effect and without: a law that bends the
    elevation stands for the gravity of a heavy arm as long as that is left out.
    """
    selected, fitted, rig = tuple(around.selected), around.fitted, null.likelihood.rig
    effects, values = list(around.effects.values()), {name: null.estimate(name) for name in null.fields}
    bare = replace(null.point, parameters=rig.assign(fitted.parameters, values), harmonics=fitted.point.harmonics)

    @cache
    def least(kept: tuple[str, ...], mechanics: bool) -> float:
        plain = fitted
        if kept != selected:
            plain = refit(fitted, effects, kept, value_only=True, others=(bare, around.point(kept)))
        if not mechanics or _lack_mechanics(around, kept):
            return plain.value
        of_plant = [name for name in kept if around.effects[name].fault is None]
        return min(plain.value, _add_mechanics(plain, of_plant).value)

    def lost(gone: Sequence[str]) -> float:
        rest = tuple(name for name in selected if name not in gone)
        mechanics = not any(around.effects[name].certain for name in gone)
        F = least(rest, mechanics)
        return F - least(selected, mechanics and F - fitted.value < UNKNOWN)  # what is clear needs no further fit

    scores = around.scores(selected)
    return [_weigh_effect(around, name, selected, scores, lost) for name in selected]


def stepwise(around: Scores, start: Sequence[str], barred: Collection[str] = ()) -> list[str]:
    """Let effects leave, then let others enter that are not ``barred``, until the set stands; what left stays away.

    Once one has entered, only what entered may leave: what the fit has and a new effect makes needless is weighed
    around a fit of both, as the quadratic form foresees such an exchange badly.
    """
    selected, entered, left = list(start), list[str](), set(barred)
    while True:
        scores = around.scores(selected)
        worst = min(entered or selected, key=lambda name: scores[name].score, default=None)
        if worst is not None and scores[worst].score < around.entry_score(worst):
            selected.remove(worst)
            entered = [name for name in entered if name != worst]
            left.add(worst)
            continue
        outside = {name: own.score for name, own in scores.items() if own.score > around.entry_score(name)}
        best = max(outside.keys() - {*selected, *left}, key=lambda name: outside[name], default=None)
        if best is None:
            return selected
        selected.append(best)
        entered.append(best)


def _simpler(around: Scores, selected: list[str], barred: set[str]) -> list[str]:
    """Put a law with fewer shapes in the place of one of its family where the data do not tell the two apart."""
    scores = around.scores(selected, among=selected)
    for name in selected:
        own = around.effects[name]
        for rival in _alternatives(around, name, selected, scores[name]) if own.shapes else []:
            if rival.family == own.family and len(rival.shapes) < len(own.shapes):
                barred.add(name)
                return [rival.field if other == name else other for other in selected]
    return selected


def established_families(around: Scores, selected: Sequence[str]) -> set[str]:
    """Families that the effects of a set establish, by the quadratic form alone."""
    scores = around.scores(selected, among=selected)
    found = [_weigh_effect(around, name, selected, scores) for name in selected]
    return {finding.effect.family for finding in found if finding.established}


def _weigh_effect(
    around: Scores, name: str, selected: Sequence[str], scores: dict[str, Score],
    lost: Callable[[Sequence[str]], float] | None = None,
) -> Finding:  # fmt: skip
    """Weigh an effect of a set; of what seems established a refit says what is ``lost``, and its rivals are named."""
    effect, own = around.effects[name], scores[name]
    relatives = [other for other in selected if around.effects[other].family == effect.family]
    names, bound = around.fitted.names, around.fitted.at_bound
    phi = float(around.dispersion[own.column])
    if name in names and len(relatives) == 1:  # members of a family differ from log to log in how they share its torque
        V, V_L = (float(of_all[names.index(name)]) for of_all in around.fitted.dispersion)
        across = max(1.0, V / phi, V_L / phi)
        phi, own = phi * across, replace(own, score=own.score / across)
    family = own.score
    if len(relatives) > 1:
        rest = [other for other in selected if other not in relatives]
        family = (around.fall(selected) - around.fall(rest)) / phi - KEPT * (len(relatives) - 1)
    leads = all(scores[other].score <= scores[name].score for other in relatives)
    at_end = any(bound[names.index(shape)] for shape in effect.shapes if shape in names)
    found = Finding(effect, own, family, (), leads, at_end=at_end)
    if lost is None:
        return found
    if found.established:
        exact = lost(relatives) / phi - around.price[name] - KEPT * (len(relatives) - 1)
        found = replace(found, exact=max(exact, 0.0))
    return replace(found, alternatives=tuple(_alternatives(around, name, selected, own)))


def _alternatives(around: Scores, name: str, selected: Sequence[str], own: Score) -> list[Effect]:
    """Effects that score about as much in place of ``name`` and make it needless."""
    others = [other for other in selected if other != name]
    found = []
    for rival, score in around.scores(others).items():
        if rival in selected or score.score < own.score - KEPT:
            continue
        if around.scores([*others, rival], among=[name])[name].score < KEPT:
            found.append(around.effects[rival])
    return found
