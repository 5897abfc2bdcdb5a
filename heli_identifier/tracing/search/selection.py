"""Forward selection over the catalogue and unknown torques, with refits, and backward elimination.

A round scores all candidates at the current fit, takes the few that could win, refits the plant with each of them
(its shape parameters free) and compares their likelihood ratios. The largest wins if its score passes the threshold
that surrogates set for the whole catalogue. After every addition, effects whose scores have fallen below the threshold
are dropped.

An unknown torque is a last resort. It is searched for in what the named effects leave, and has to be more than the
imperfection of their laws. Only where it then explains decidedly more than the named effects on its axis does it take
their place.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from heli_identifier.online import CLOSED
from heli_identifier.tracing.prediction.fit import Fit
from heli_identifier.tracing.prediction.whitening import Whitener
from heli_identifier.tracing.search.candidates import companions, open_moves
from heli_identifier.tracing.search.feedback import feedback_score
from heli_identifier.tracing.search.model import Model, eliminated, with_unknown
from heli_identifier.tracing.search.noise import noise_whitener
from heli_identifier.tracing.search.scan import Scan, extended, scan, scored
from heli_identifier.tracing.search.settings import (
    COMPANION_SCORE,
    MOST_EFFECTS,
    SHARE_BESIDE_NAMED,
    SHARE_BESIDE_SAME_MECHANISM,
    SHARE_BESIDE_UNKNOWN,
    SHORT_LOGS,
    SHOWN_SCORE,
    SHOWN_SCORE_CLOSED,
    SIGNIFICANCE,
    UNKNOWN_FACTOR,
    UNKNOWN_LEVEL,
    UNKNOWN_MARGIN,
    UNKNOWN_SHARE,
)
from heli_identifier.tracing.search.steps import best_steps
from heli_identifier.tracing.search.threshold import largest_scores, quantile
from heli_identifier.tracing.search.trials import Trial, Trials, named_trials, passes, trial
from heli_identifier.tracing.search.unknown import Unknown, search
from heli_plant.effects import AXES


@dataclass(frozen=True, eq=False)
class Round:
    """A model with the catalogue scored at it.

    Attributes
    ----------
    model : Model
    scanned : Scan
        Scores under the whitener of the model's fit.
    noise_whitener : Whitener
        Whitener of the noise alone.
    threshold : float
        Score that shows an effect.
    suggestive_level : float
        Score of ten times the threshold's probability.
    trials : Trials
        Trials that were made at the model.
    """

    model: Model
    scanned: Scan
    noise_whitener: Whitener
    threshold: float
    suggestive_level: float
    trials: Trials = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Selection:
    """Outcome of the search.

    Attributes
    ----------
    null, named, last : Round
        The catalogue scored at the null model, at the model with the named effects that are found without any unknown
        torque, and at the model with all that was found.
    """

    null: Round
    named: Round
    last: Round

    @property
    def model(self) -> Model:
        """The model with all that was found."""
        return self.last.model

    @property
    def threshold(self) -> float:
        """Score that shows an effect, at the last scan."""
        return self.last.threshold

    @property
    def suggestive_level(self) -> float:
        """Score of ten times the threshold's probability, at the last scan."""
        return self.last.suggestive_level


def score_catalogue(model: Model) -> Round:
    """Score the catalogue at a model."""
    scanned = scan(model.fit, open_moves(model.fit))
    of_noise = noise_whitener(model.fit, scanned.raw)
    scanned = extended(scanned, best_steps(model.fit, of_noise))
    surrogates = largest_scores(scanned)
    threshold, suggestive_level = (quantile(surrogates, p * SIGNIFICANCE) for p in (1.0, 10.0))
    return Round(model, scanned, of_noise, max(threshold, least_score(model.fit)), suggestive_level)


def least_score(fit_: Fit) -> float:
    """Score below which no surrogate is trusted: more in closed loop, and where the logs are short."""
    seconds = sum(record.duration for record in fit_.problem.records)
    hard = seconds < SHORT_LOGS or feedback_score(fit_) > CLOSED
    return SHOWN_SCORE_CLOSED if hard else SHOWN_SCORE


def is_material(null: Fit, model: Model, tried: Trial) -> bool:
    """Whether a trial explains more than the imperfection of what the model has on its axes already."""
    for axis in tried.effect.axes:
        share = SHARE_BESIDE_NAMED
        if any(unknown.axis == axis for unknown in model.unknowns):
            share = max(share, SHARE_BESIDE_UNKNOWN)
        if any(e.family == tried.effect.family and e.axis == axis for e in model.effects):
            share = max(share, SHARE_BESIDE_SAME_MECHANISM)
        if tried.likelihood_ratio < share * axis_likelihood_ratio(null, model.fit, AXES.index(axis)):
            return False
    return True


def add_named(null: Fit, start: Round) -> Round:
    """Add named effects, one a round, until none passes any more."""
    current, seen = start, set()
    while len(current.model.effects) < MOST_EFFECTS:
        trials = [tried for tried in named_trials_of(current) if is_material(null, current.model, tried)]
        if not trials:
            break
        model = replace(current.model, fit=trials[0].fit, effects=(*current.model.effects, trials[0].effect))
        model = add_companions(eliminated(model, current.threshold))
        fields = frozenset(effect.field for effect in model.effects)
        if fields in seen:
            break
        seen.add(fields)
        current = score_catalogue(model)
    return current


def named_trials_of(current: Round) -> list[Trial]:
    """Trials of a round that pass its threshold, the winner first."""
    model, scanned = current.model, current.scanned
    noise_scan = scored(model.fit, current.noise_whitener, scanned.candidates, scanned.raw)
    return named_trials(model, scanned, noise_scan, current.threshold, current.trials)


def add_companions(model: Model) -> Model:
    """Add couplings on the axes where they are expected because the model has them on others already."""
    for companion in companions(model.fit.parameters):
        tried = trial(model, companion, companion.size)
        if passes(tried, COMPANION_SCORE):
            model = replace(model, fit=tried.fit, effects=(*model.effects, tried.effect))
    return model


def axis_likelihood_ratio(null: Fit, fit_: Fit, axis: int) -> float:
    """Likelihood-ratio statistic of one fit over another, of one axis alone."""
    ratio = null.whitener.scales[axis] / fit_.whitener.scales[axis]
    return 2.0 * sum(null.problem.lengths) * float(np.log(ratio))


def is_duplicate(model: Model, unknown: Unknown) -> bool:
    """Whether an unknown torque is one that the model has already.

    A periodic torque of a frequency that is known on another axis is that torque seen through the coupling of the axes;
    a second unknown torque on the same axis is what the form of the first one could not describe.
    """
    resolution = 2.0 / max(record.duration for record in model.fit.problem.records)
    for known in model.unknowns:
        if known.axis == unknown.axis:
            return True
        if (
            known.frequency is not None
            and unknown.frequency is not None
            and abs(known.frequency - unknown.frequency) < resolution
        ):
            return True
    return False


def unknown_in_place_of_named(unknowns: Sequence[Unknown], null: Fit, named: Fit, axis: str) -> Unknown | None:
    """Unknown torque that explains decidedly more than the named effects on its axis, if there is one."""
    of_named = axis_likelihood_ratio(null, named, AXES.index(axis))
    for unknown in unknowns:
        if unknown.axis == axis and unknown.likelihood_ratio > UNKNOWN_FACTOR * of_named + UNKNOWN_MARGIN:
            return unknown
    return None


def least_beside(null: Fit, model: Model, axis: str) -> float:
    """Likelihood ratio that an unknown torque on an axis must have beside the named effects of a model."""
    named_there = any(axis in effect.axes for effect in model.effects)
    share = UNKNOWN_SHARE * axis_likelihood_ratio(null, model.fit, AXES.index(axis)) if named_there else 0.0
    return max(UNKNOWN_LEVEL, share)


def unknown_beside_named(null: Fit, current: Round) -> Unknown | None:
    """Unknown torque in what the model leaves, if there is one that is more than the imperfection of its laws."""
    model = current.model
    for unknown in search(model.fit, current.noise_whitener):
        if unknown.likelihood_ratio > least_beside(null, model, unknown.axis) and not is_duplicate(model, unknown):
            return unknown
    return None


def select(null_model: Model) -> Selection:
    """Search for what the logs hold beyond the model before.

    Parameters
    ----------
    null_model : Model
        The model before, as :func:`heli_identifier.tracing.search.expected.null_model` fits it.
    """
    null = score_catalogue(null_model)
    null_fit = null.model.fit
    named = current = add_named(null_fit, null)
    if (left := unknown_beside_named(null_fit, named)) is not None and named is not null:
        instead = unknown_in_place_of_named(search(null_fit, null.noise_whitener), null_fit, named.model.fit, left.axis)
        current = null if instead is not None else named
        left = instead or left
    while left is not None:
        current = add_named(null_fit, score_catalogue(with_unknown(current.model, left)))
        left = unknown_beside_named(null_fit, current)
    return Selection(null, named, current)
