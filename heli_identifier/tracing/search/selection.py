"""Forward selection over the catalogue and the unknown, with refits, and backward elimination.

A round scores all candidates at the present fit, takes the few that could win, refits the plant with each of them
(its shape parameters free) and compares the gains in likelihood: the largest wins if its score passes the threshold
that surrogates set for the whole catalogue. After every addition each effect has to be missed when it is left out.

An unknown torque is a last resort. It comes first only where it explains decidedly more than all named effects that the
catalogue would put in its place; otherwise it is looked for in what the named effects leave, and has to be more than
the imperfection of their laws.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.stats import chi2

from heli_identifier.tracing.prediction.fit import Fit, fit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.whitening import Whitener
from heli_identifier.tracing.prediction.workers import beside
from heli_identifier.tracing.search.candidates import candidates, companions, stepping_at
from heli_identifier.tracing.search.model import Model, eliminated, with_unknown
from heli_identifier.tracing.search.noise import noise_whitener
from heli_identifier.tracing.search.scan import Scan, extended, scan, scored
from heli_identifier.tracing.search.settings import SelectionSettings
from heli_identifier.tracing.search.steps import step_times
from heli_identifier.tracing.search.threshold import largest_scores, quantile
from heli_identifier.tracing.search.trials import Trial, Tried, named_trials, passes, trial
from heli_identifier.tracing.search.unknown import Unknown, search
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters


@dataclass(frozen=True, eq=False)
class Round:
    """A model with the catalogue scored at it, and the trials that were made there."""

    model: Model
    scanned: Scan
    colour: Whitener
    threshold: float
    hint: float
    tried: Tried = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Selection:
    """Outcome of the search.

    Attributes
    ----------
    bare, last : Round
        The catalogue scored at the simplified model alone, and at the model with all that was found.
    """

    bare: Round
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
    def hint(self) -> float:
        """Score of ten times the probability of the threshold's."""
        return self.last.hint


def looked_at(model: Model, settings: SelectionSettings) -> Round:
    """Score the catalogue at a model."""
    problem, parameters = model.fit.problem, model.fit.parameters
    scanned = scan(model.fit, candidates(problem.records, parameters))
    colour = noise_whitener(model.fit, scanned.raw)
    times = {t for whitener in (colour, model.fit.whitener) for t in step_times(model.fit, whitener)}
    scanned = extended(scanned, stepping_at(sorted(times), parameters))
    surrogates = largest_scores(scanned)
    threshold, hint = (quantile(surrogates, p * settings.significance) for p in (1.0, 10.0))
    return Round(model, scanned, colour, threshold, hint)


def is_material(bare: Fit, model: Model, tried: Trial, settings: SelectionSettings) -> bool:
    """Whether an effect gains more than the imperfection of what is in the model on its axes already."""
    for axis in tried.effect.axes:
        share = settings.share_beside_named
        if any(unknown.axis == axis for unknown in model.unknowns):
            share = max(share, settings.share_beside_unknown)
        if any(e.family == tried.effect.family and e.axis == axis for e in model.effects):
            share = max(share, settings.share_beside_kin)
        if tried.gain < share * gained(bare, model.fit, AXES.index(axis)):
            return False
    return True


def grown(bare: Fit, start: Round, settings: SelectionSettings) -> Round:
    """Add named effects, one a round, until none passes any more."""
    now, seen = start, set()
    while len(now.model.effects) < settings.most:
        sharp = scored(now.model.fit, now.colour, now.scanned.candidates, now.scanned.raw)
        trials = named_trials(now.model, now.scanned, sharp, now.threshold, settings, now.tried)
        trials = [tried for tried in trials if is_material(bare, now.model, tried, settings)]
        if not trials:
            break
        model = replace(now.model, fit=trials[0].fit, effects=(*now.model.effects, trials[0].effect))
        model = joined(eliminated(model, now.threshold), settings)
        fields = frozenset(effect.field for effect in model.effects)
        if fields in seen:
            break
        seen.add(fields)
        now = looked_at(model, settings)
    return now


def joined(model: Model, settings: SelectionSettings) -> Model:
    """Add couplings on the axes where they are expected because the model has them on others already."""
    for companion in companions(model.fit.parameters):
        tried = trial(model, companion, companion.size, settings)
        if passes(tried, settings.companion_score):
            model = replace(model, fit=tried.fit, effects=(*model.effects, tried.effect))
    return model


def unknown_level(settings: SelectionSettings) -> float:
    """Surplus (chi-squared of one degree) that an unknown torque must reach.

    The search looks at some 30 curves and, per axis, at some 600 resolvable lines.
    """
    return max(settings.unknown_least, float(chi2.isf(settings.unknown_significance / 2000.0, 1)))


def gained(bare: Fit, fit_: Fit, axis: int) -> float:
    """Gain in twice the log-likelihood of one axis from one fit to another."""
    ratio = bare.whitener.scales[axis] / fit_.whitener.scales[axis]
    return 2.0 * sum(bare.problem.lengths) * float(np.log(ratio))


def is_echo(model: Model, unknown: Unknown) -> bool:
    """Whether an unknown torque is one that the model has, seen again.

    A line of a frequency that is known on another axis is that line seen through the coupling of the axes; a second
    unknown of the same axis is what the first one's form could not take in.
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


def instead(unknowns: Sequence[Unknown], bare: Round, named: Round, settings: SelectionSettings) -> Unknown | None:
    """Return the unknown torque that explains decidedly more than the named effects on its axis, if there is one."""
    for unknown in unknowns:
        gain = gained(bare.model.fit, named.model.fit, AXES.index(unknown.axis))
        bar = max(unknown_level(settings), settings.unknown_factor * gain + settings.unknown_margin)
        if unknown.surplus > bar:
            return unknown
    return None


def leftover(bare: Fit, now: Round, settings: SelectionSettings) -> Unknown | None:
    """Return the unknown torque in what the model leaves that is more than its laws' imperfection, if there is one."""
    for unknown in search(now.model.fit, now.colour):
        share = settings.unknown_share * gained(bare, now.model.fit, AXES.index(unknown.axis))
        named_there = any(unknown.axis in effect.axes for effect in now.model.effects)
        bar = max(unknown_level(settings), share if named_there else 0.0)
        if unknown.surplus > bar and not is_echo(now.model, unknown):
            return unknown
    return None


def select(problem: Problem, start: PlantParameters, settings: SelectionSettings | None = None) -> Selection:
    """Search the catalogue for what ``problem``'s records hold beyond the simplified model."""
    settings = settings or SelectionSettings()
    bare = looked_at(Model(fit(problem, start)), settings)
    unknowns = beside(search, bare.model.fit, bare.colour)
    now = grown(bare.model.fit, bare, settings)
    unknown = instead(unknowns.result(), bare, now, settings)
    if unknown is not None:
        now = grown(bare.model.fit, looked_at(with_unknown(bare.model, unknown), settings), settings)
    while now is not bare and (unknown := leftover(bare.model.fit, now, settings)) is not None:
        now = grown(bare.model.fit, looked_at(with_unknown(now.model, unknown), settings), settings)
    return Selection(bare, now)
