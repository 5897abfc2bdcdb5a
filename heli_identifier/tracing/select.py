"""Names: which effects the plant lacks, by forward and backward steps on the quadratic form and exact refits.

An effect enters the model at a score of :data:`.settings.KEPT` nats, the largest first, and leaves it below; when the
set no longer changes, the model is refitted and the catalogue is scored again around that fit, until the set does not
change there either. An effect that scores :data:`.settings.ESTABLISHED` is established, if a refit without it loses as
much: for a law with corners, such as a dead zone, the quadratic form predicts five times the loss of the refit. Effects
of one family are one finding, and its score is the loss of the likelihood without all of them.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from heli_identifier.chain import STILL

from .fit import Fit, fit
from .likelihood import Point
from .rig import Candidate
from .score import Score, Scores
from .settings import CATALOGUE_WIDTHS, KEPT, REFITTED, ROUGHLY, SMOOTH_NATS, TIMED, UNKNOWN


@dataclass(frozen=True, eq=False)
class Finding:
    """A candidate in the model, with its evidence."""

    effect: Candidate
    score: Score
    """Of the effect alone: the loss without it, beside all others."""
    family_score: float
    """Loss without its whole family [nats] if it is the strongest member, which names the family; 0 otherwise."""
    alternatives: tuple[Candidate, ...]
    """Effects that would explain the data about as well in its place."""
    refit_score: float | None = None
    """The loss of a refit without its family [nats]; None where no refit was made."""
    doubtful: bool = False
    """Whether something else is more likely: a shape of the law lies at the end of its range (a controller's answers to
    the encoder look like an arm that bends faster than metal does), or the law acts along the filter's motion alone
    (where an axis turns slowly, the filter follows the counts of its encoder and seems braked)."""

    @property
    def established(self) -> bool:
        """Whether it is shown."""
        strong = max(self.score.score, self.family_score) > self.effect.shown_from
        return strong and not self.doubtful and (self.refit_score is None or self.refit_score > REFITTED)

    @property
    def stated_score(self) -> float:
        """Score for results [nats]: the family's for its strongest member, and at most the loss of the refit."""
        score = max(self.score.score, self.family_score)
        return score if self.refit_score is None else min(score, self.refit_score)


@dataclass(frozen=True, eq=False)
class Selection:
    """The result of the search in one set of logs."""

    null: Fit
    fit: Fit
    """null, fit: The model before, and the model with all effects of the set."""
    findings: tuple[Finding, ...]
    """Strongest first."""
    scores: dict[str, Score]
    """The whole catalogue at the last fit."""
    form: Scores
    """The quadratic form there."""

    @cached_property
    def plant(self) -> Fit:
        """The plant with all effects of the set and, if the logs are as likely, with rigid-body mechanics."""
        return fit_delivered(self, [])


def select(null: Fit, candidates: Sequence[Candidate], start: Fit | None = None) -> Selection:
    """Search the candidates beside the model before, ``null``, from a ``start`` that may have effects or curves."""
    fitted, barred = start or null, set[str]()
    while True:
        form = Scores(fitted, candidates)
        selected = form.selected
        chosen = stepwise(form, selected, barred)
        barred |= set(selected) - set(chosen)
        if set(chosen) == set(selected) and (chosen := _prefer_simpler(form, selected, barred)) == selected:
            findings = list[Finding]()
            for finding in _weigh_effects(form, null):
                if _is_needless(form, finding):
                    break
                findings.append(finding)
            else:
                break
            barred.add(finding.effect.field)
            chosen = [name for name in selected if name != finding.effect.field]
        fitted = _fit_entered(form, chosen)
        if not np.isfinite(fitted.value):  # the plant diverges with these
            fitted, barred = null, {*barred, *chosen}
    findings.sort(key=lambda f: -f.stated_score)
    return Selection(null, form.fitted, tuple(findings), form.scores(form.selected), form)


def _is_needless(form: Scores, finding: Finding) -> bool:
    """Whether a refit shows an effect to be worth less than its entry, or a fault is less than its log resolves."""
    if (fault := finding.effect.fault) is not None:
        rig, size = form.fitted.likelihood.rig, form.fitted.likelihood.faults[fault]
        count = dict(zip(rig.axes, rig.resolution, strict=True)).get(fault.channel, 0.0)
        if size < {"s": TIMED, "rad": STILL * count}.get(fault.unit, -np.inf):  # a late channel; backlash
            return True
    return finding.stated_score < form.entry_score(finding.effect.field)


def _fit_entered(form: Scores, chosen: Sequence[str]) -> Fit:
    """Fit a set with new effects, from their best shapes; or with a fault of the log alone, if it scores highest."""
    # an effect that is missing looks like faults of the log, and the other way round
    new = [name for name in chosen if name not in form.selected]
    faults = [name for name in new if form.effects[name].fault is not None]
    new = faults[:1] if new and new[0] in faults else [name for name in new if name not in faults]
    shapes = {key: value for name in new for key, value in form.coordinates[form.chosen[name]].companions.items()}
    kept = [name for name in chosen if name in form.selected]
    return refit(form.fitted, list(form.effects.values()), [*kept, *new], shapes)


def refit(
    fitted: Fit, candidates: Sequence[Candidate], chosen: Sequence[str], values: Mapping[str, float] | None = None,
    value_only: bool = False, other: Point | None = None,
) -> Fit:  # fmt: skip
    """Fit with other effects and faults of the candidates, from ``values`` of parameters or the ``other`` point."""
    by_field, likelihood = {effect.field: effect for effect in candidates}, fitted.likelihood
    gone = by_field.keys() - set(chosen)
    kept = {fault: size for fault, size in likelihood.faults.items() if fault.field not in gone}
    catalogue = {name for effect in candidates for name in effect.parameters}
    names = [name for name in fitted.names if name not in catalogue]
    names += [name for field in chosen for name in by_field[field].parameters if name not in names]
    off = {name: 0.0 for name in fitted.fields if name in gone}
    return fit(
        likelihood if kept == likelihood.faults else likelihood.undo_faults(kept), list(dict.fromkeys(names)), fitted,
        {**(values or {}), **off}, value_only, other,
    )  # fmt: skip


def fit_delivered(selection: Selection, dropped: Sequence[str]) -> Fit:
    """Fit the plant without some effects of the selection, and with rigid-body mechanics if the logs are as likely.

    The terms of rigid-body mechanics come from one kinetic and one potential energy, so that a rig has all of them,
    each with c = 1 +- 1/3. If one is established the others join it, unless the logs say that they are missing.
    """
    candidates = selection.null.likelihood.rig.candidates
    kept = [f.effect.field for f in selection.findings if f.effect.fault is None and f.effect.field not in dropped]
    alone = refit(selection.fit, candidates, kept) if dropped else selection.fit
    if _lack_mechanics(selection.form, kept):
        return alone
    proven = any(f.established and f.effect.certain for f in selection.findings)
    least = alone.value + proven * KEPT
    with_terms = _add_mechanics(alone, kept)
    if with_terms.value < least + 2.0 * ROUGHLY:
        with_terms = refit(with_terms, candidates, [*kept, *_absent_mechanics(candidates, kept)])
    return alone if with_terms.value > least else with_terms


def _absent_mechanics(candidates: Iterable[Candidate], kept: Collection[str]) -> list[str]:
    """Terms of rigid-body mechanics that are not among the effects ``kept``."""
    return [effect.field for effect in candidates if effect.certain and effect.field not in kept]


def _lack_mechanics(form: Scores, kept: Collection[str]) -> bool:
    """Whether the rig has no terms of rigid-body mechanics, or the logs say that they are missing beside effects."""
    if not _absent_mechanics(form.fitted.likelihood.rig.candidates, ()):
        return True
    scores = form.scores(kept, among=_absent_mechanics(form.effects.values(), kept)).values()
    squares = [CATALOGUE_WIDTHS**-2 + score.standard_error**2 for score in scores]
    losses = [0.5 * (1.0 - one.value) ** 2 / square - one.score for one, square in zip(scores, squares, strict=True)]
    return sum(losses) > 3.0 * KEPT  # the quadratic form, each term alone, errs by less


def _add_mechanics(fitted: Fit, kept: Sequence[str]) -> Fit:
    """Fit roughly with some effects and all terms of rigid-body mechanics."""
    candidates, expected = fitted.likelihood.rig.candidates, (1.0, 1.0 / CATALOGUE_WIDTHS)
    absent = dict.fromkeys(_absent_mechanics(candidates, kept), 1.0)
    rig, priors = fitted.likelihood.rig, dict.fromkeys(_absent_mechanics(candidates, ()), expected)
    start = replace(fitted, likelihood=replace(fitted.likelihood, rig=replace(rig, known={**rig.known, **priors})))
    return refit(start, candidates, [*kept, *absent], absent, value_only=True)


def _weigh_effects(form: Scores, null: Fit) -> Iterator[Finding]:
    """Weigh the effects of the set, weakest first, by refits without each family."""
    selected, fitted, rig = tuple(form.selected), form.fitted, null.likelihood.rig
    effects, values = list(form.effects.values()), {name: null.estimate(name) for name in null.fields}
    bare = replace(null.point, parameters=rig.assign(fitted.parameters, values), harmonics=fitted.point.harmonics)

    @cache
    def plain(kept: tuple[str, ...]) -> Fit:
        return fitted if kept == selected else refit(fitted, effects, kept, value_only=True, other=bare)

    @cache  # where the gravity of a heavy arm is left out, another law that bends the elevation takes its place
    def least(kept: tuple[str, ...], mechanics: bool) -> float:
        if not mechanics or _lack_mechanics(form, kept):
            return plain(kept).value
        of_plant = [name for name in kept if form.effects[name].fault is None]
        return min(plain(kept).value, _add_mechanics(plain(kept), of_plant).value)

    def lost(gone: Sequence[str]) -> float:
        rest = tuple(name for name in selected if name not in gone)
        mechanics = not any(form.effects[name].certain for name in gone)
        F = least(rest, mechanics)
        return F - least(selected, mechanics and F - fitted.value < UNKNOWN)  # a clear case needs no further fit

    @cache
    def seen(gone: tuple[str, ...]) -> bool:
        rest = tuple(name for name in selected if name not in gone)
        if not np.isfinite(plain(rest).value):  # the plant diverges without them
            return True
        smooth = Scores(plain(rest), [form.effects[name] for name in selected], smoothed=True)
        gain = (smooth.fall(selected) - smooth.fall(rest)) / smooth.dispersion
        return gain - max(smooth.penalty[name] for name in gone) > SMOOTH_NATS

    scores = form.scores(selected)
    for name in sorted(selected, key=lambda name: scores[name].score):
        yield _weigh_effect(form, name, selected, scores, lost, seen)


def stepwise(form: Scores, start: Sequence[str], barred: Collection[str] = ()) -> list[str]:
    """Let effects leave, and others enter that are not ``barred``, until the set does not change.

    An effect that left does not enter again.
    """
    selected, left = list(start), set(barred)
    while True:
        scores = form.scores(selected)
        worst = min(selected, key=lambda name: scores[name].score, default=None)
        if worst is not None and scores[worst].score < form.entry_score(worst):
            selected.remove(worst)
            left.add(worst)
            continue
        outside = {name: one.score for name, one in scores.items() if one.score > form.entry_score(name)}
        best = max(outside.keys() - {*selected, *left}, key=lambda name: outside[name], default=None)
        if best is None:
            return selected
        selected.append(best)


def _prefer_simpler(form: Scores, selected: list[str], barred: set[str]) -> list[str]:
    """Replace a law by one of its family with fewer shapes if the data do not tell the two apart."""
    scores = form.scores(selected, among=selected)
    for name in selected:
        effect = form.effects[name]
        for other in _alternatives(form, name, selected, scores[name]) if effect.shapes else []:
            if other.family == effect.family and len(other.shapes) < len(effect.shapes):
                barred.add(name)
                return [other.field if one == name else one for one in selected]
    return selected


def established_families(form: Scores, selected: Sequence[str]) -> set[str]:
    """Families that the effects of a set establish, by the quadratic form alone."""
    scores = form.scores(selected, among=selected)
    findings = [_weigh_effect(form, name, selected, scores) for name in selected]
    return {finding.effect.family for finding in findings if finding.established}


def _weigh_effect(
    form: Scores, name: str, selected: Sequence[str], scores: dict[str, Score],
    lost: Callable[[Sequence[str]], float] | None = None, seen: Callable[[tuple[str, ...]], bool] | None = None,
) -> Finding:  # fmt: skip
    """Weigh an effect of a set; with ``lost`` and ``seen`` also by a refit, the smoothed motion, and its alternatives.

    ``lost`` returns the loss of a refit without some effects [nats], ``seen`` whether the smoothed motion shows them.
    """
    effect, score = form.effects[name], scores[name]
    relatives = tuple(other for other in selected if form.effects[other].family == effect.family)
    names, bound = form.fitted.names, form.fitted.at_bound
    # members of a family share its torque differently from log to log
    phi = form.dispersion_of(name) if name in names and len(relatives) == 1 else form.dispersion
    score = replace(score, score=score.score * form.dispersion / phi)
    family = score.score
    if any(scores[other].score > scores[name].score for other in relatives):
        family = 0.0
    elif len(relatives) > 1:
        rest = [other for other in selected if other not in relatives]
        family = (form.fall(selected) - form.fall(rest)) / phi - KEPT * (len(relatives) - 1)
    at_bound = any(bound[names.index(shape)] for shape in effect.shapes if shape in names)
    finding = Finding(effect, score, family, (), doubtful=at_bound)
    if lost is None or seen is None:
        return finding
    if finding.established:
        by_refit = lost(relatives) / phi - form.penalty[name] - KEPT * (len(relatives) - 1)
        finding = replace(finding, refit_score=max(by_refit, 0.0))
    if finding.established and effect.fault is None:
        finding = replace(finding, doubtful=not seen(relatives))
    return replace(finding, alternatives=tuple(_alternatives(form, name, selected, score)))


def _alternatives(form: Scores, name: str, selected: Sequence[str], score: Score) -> list[Candidate]:
    """Effects that score about as much in place of ``name``, whose score is given, and make it needless."""
    others = [other for other in selected if other != name]
    found = []
    for candidate, its in form.scores(others).items():
        if candidate in selected or its.score < score.score - KEPT:
            continue
        if form.scores([*others, candidate], among=[name])[name].score < KEPT:
            found.append(form.effects[candidate])
    return found
