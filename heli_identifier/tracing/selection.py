"""Forward selection over the catalogue and the unknown, with refits, and backward elimination.

A round scores all candidates at the present fit, takes the few that could win, refits the plant with each of them
(its shape parameters free) and compares the gains in likelihood: the largest wins if its score passes the threshold
that surrogates set for the whole catalogue. An unknown torque wins a round only where it explains decidedly more
than the best named effect. Afterwards every effect has to be missed when it is left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from heli_identifier.prediction.fit import BASE, Fit, fit
from heli_identifier.prediction.problem import Problem, Residuals
from heli_identifier.prediction.relinearised import linear_gain
from heli_identifier.tracing.candidates import Candidate, candidates, moving_mass_at, shape_fields
from heli_identifier.tracing.noise import noise_whitener
from heli_identifier.tracing.scan import Scan, admissible, extended, scan, scored
from heli_identifier.tracing.steps import step_times
from heli_identifier.tracing.threshold import largest_scores, quantile
from heli_identifier.tracing.unknown import Unknown, refined_line, search
from heli_plant.effects import AXES, Effect
from heli_plant.parameters import PlantParameters


@dataclass(frozen=True)
class SelectionSettings:
    """Levels of the search.

    Attributes
    ----------
    significance : float
        Probability that a record of the bare model has any effect shown.
    shortlist : int
        Candidates that are refitted in a round.
    shape_price : float
        Gain in twice the log-likelihood that a free shape parameter must bring: the Bayesian criterion's log(n) for
        the some thousand independent samples of a data set.
    unknown_factor, unknown_margin : float
        An unknown torque must gain this factor times what the best named effect gains, plus this margin.
    unknown_share : float
        Beside a named effect on its axis, an unknown torque must gain this share of what the named effects gained:
        a law is never exact, and what is left of it is not a discovery.
    unknown_significance : float
        Probability that a record of the bare model shows an unknown torque.
    most : int
        Most effects in a model.
    """

    significance: float = 0.005
    shortlist: int = 4
    shape_price: float = 8.0
    unknown_factor: float = 1.2
    unknown_margin: float = 10.0
    unknown_share: float = 0.25
    unknown_significance: float = 1e-5
    most: int = 6


@dataclass(frozen=True, eq=False)
class Trial:
    """A named effect added to a model and refitted: its gain over that model, less the price of its shapes."""

    effect: Effect
    fit: Fit
    gain: float
    score: float


@dataclass(frozen=True, eq=False)
class Model:
    """A fitted model with the effects found so far."""

    fit: Fit
    effects: tuple[Effect, ...] = ()
    unknowns: tuple[Unknown, ...] = ()

    @property
    def fields(self) -> tuple[str, ...]:
        """Fields that its fit estimates."""
        return free_fields(self.effects)

    @property
    def extra(self) -> Residuals | None:
        """Columns of the unknown torques on all axes, (n_i, 3, k) per record."""
        return unknown_columns(self.fit.problem, self.unknowns)


def free_fields(effects: Sequence[Effect]) -> tuple[str, ...]:
    """Fields of the base model, of ``effects`` and of their shapes."""
    fields = list(BASE)
    for effect in effects:
        fields.append(effect.field)
        fields.extend(name for name in shape_fields(effect) if name not in fields)
    return tuple(fields)


def unknown_columns(problem: Problem, unknowns: Sequence[Unknown]) -> Residuals | None:
    """Join the columns of unknown torques, zero on the axes that they do not act on."""
    if not unknowns:
        return None
    joined = []
    for index, length in enumerate(problem.lengths):
        parts = []
        for unknown in unknowns:
            part = np.zeros((length, 3, unknown.degrees))
            part[:, AXES.index(unknown.axis)] = unknown.columns[index][:, 0]
            parts.append(part)
        joined.append(np.concatenate(parts, axis=2))
    return joined


def effect_score(fit_: Fit, effect: Effect) -> float:
    """Coefficient over its standard error."""
    return getattr(fit_.parameters, effect.field) / fit_.standard_error(effect.field)


def started(parameters: PlantParameters, candidate: Candidate, coefficient: float) -> PlantParameters:
    """``parameters`` with the candidate's effect on, inside its range, as a start for its refit."""
    effect = candidate.effect
    value = float(np.clip(coefficient, effect.lower, effect.upper))
    if effect.grid:
        # the secant holds near its own grid value; start no farther away than that
        value = float(np.clip(value, min(0.3 * candidate.size, 0.0), max(1.2 * candidate.size, 0.0)))
    return parameters._replace(**{effect.field: value, **candidate.shapes})


def trial(model: Model, candidate: Candidate, coefficient: float, settings: SelectionSettings) -> Trial:
    """Refit ``model`` with a candidate's effect added."""
    effect = candidate.effect
    start = started(model.fit.parameters, candidate, coefficient)
    fitted = fit(model.fit.problem, start, free_fields((*model.effects, effect)), model.extra, model.fit.linear)
    price = settings.shape_price * len(shape_fields(effect))
    gain = 2.0 * (fitted.log_likelihood - model.fit.log_likelihood) - price
    return Trial(effect, fitted, gain, effect_score(fitted, effect))


def contenders(scanned: Scan, sharp: Scan, floor: float, shortlist: int) -> list[tuple[int, float, float]]:
    """Candidates to refit as (index, coefficient, gain): one per effect, those with the largest relinearised gain.

    Looked at are those that score well under either whitening, the fit's own or the noise's (``sharp``).
    """
    best: dict[str, tuple[float, int, float]] = {}
    for index in promising(scanned, floor) | promising(sharp, floor):
        candidate = scanned.candidates[index]
        axes = [AXES.index(axis) for axis in candidate.effect.axes]
        columns = [raw[:, axes, index : index + 1] for raw in scanned.raw]
        gain = linear_gain(scanned.fit, columns, axes, sharp.whitener)
        value = float(gain.coefficients[0])
        if admissible(candidate.effect, value) and gain.value > best.get(candidate.effect.field, (0.0,))[0]:
            best[candidate.effect.field] = (gain.value, int(index), value)
    ranked = sorted(best.values(), reverse=True)
    return [(index, value, gain) for gain, index, value in ranked[:shortlist] if gain >= 0.4 * ranked[0][0]]


def promising(scanned: Scan, floor: float, most: int = 10) -> set[int]:
    """Admissible candidates above ``floor`` and a quarter of the best, at most ``most`` of them."""
    scores = np.where(scanned.allowed(), np.abs(scanned.scores), 0.0)
    level = max(floor, 0.25 * float(scores.max(initial=0.0)))
    return {int(i) for i in np.argsort(-scores)[:most] if scores[i] >= level}


def named_trials(
    model: Model, scanned: Scan, sharp: Scan, threshold: float, settings: SelectionSettings
) -> list[Trial]:
    """Refits of the round's contenders that pass ``threshold``, largest gain first."""
    trials = [
        trial(model, scanned.candidates[index], value, settings)
        for index, value, _ in contenders(scanned, sharp, 0.8 * threshold, settings.shortlist)
    ]
    return sorted((t for t in trials if passes(t, threshold)), key=lambda t: -t.gain)


def passes(candidate: Trial, threshold: float) -> bool:
    """Whether a refitted effect is inside its range, large enough to be meant, and both score and gain pass."""
    effect = candidate.effect
    value = getattr(candidate.fit.parameters, effect.field)
    inside = effect.lower <= value <= effect.upper and abs(value) >= smallest(candidate.fit, effect)
    return inside and abs(candidate.score) >= threshold and candidate.gain >= threshold**2


def smallest(fit_: Fit, effect: Effect) -> float:
    """Smallest abs(coefficient) that is claimed: of lags and delays half a sample of the logs.

    Below that the instant at which a log's row was taken is not known well enough.
    """
    if effect.name in ("motor_lag", "input_delay"):
        return 0.5 * min(record.step for record in fit_.problem.records)
    return 0.0


def with_unknown(model: Model, unknown: Unknown) -> Model:
    """Refit ``model`` with an unknown torque beside it."""
    if unknown.frequency is not None:
        unknown = refined_line(model.fit, AXES.index(unknown.axis), unknown.frequency)
    unknowns = (*model.unknowns, unknown)
    columns = unknown_columns(model.fit.problem, unknowns)
    weights = np.concatenate((model.fit.linear, unknown.gain.coefficients))
    fitted = fit(model.fit.problem, model.fit.parameters, model.fields, columns, weights)
    return Model(fitted, model.effects, unknowns)


def without(model: Model, effect: Effect) -> Model:
    """Refit ``model`` with one of its effects switched off."""
    rest = tuple(e for e in model.effects if e is not effect)
    start = model.fit.parameters._replace(**{effect.field: 0.0})
    fitted = fit(model.fit.problem, start, free_fields(rest), model.extra, model.fit.linear)
    return Model(fitted, rest, model.unknowns)


def eliminated(model: Model, threshold: float) -> Model:
    """Drop, weakest first, every effect whose score has fallen below ``threshold``."""
    while model.effects:
        weakest = min(model.effects, key=lambda e: abs(effect_score(model.fit, e)))
        if abs(effect_score(model.fit, weakest)) >= threshold:
            break
        model = without(model, weakest)
    return model


def unknown_level(settings: SelectionSettings) -> float:
    """Surplus (chi-squared of one degree) that an unknown torque must reach.

    The search looks at some 30 curves and, per axis, at some 600 resolvable lines.
    """
    from scipy.stats import chi2

    return float(chi2.isf(settings.unknown_significance / 2000.0, 1))


def leftover_bar(bare: Model, model: Model, unknown: Unknown, settings: SelectionSettings) -> float:
    """Surplus that an unknown torque must reach beside what is in the model already.

    Beside named effects on its axis, a share of what they gained. A line of a frequency that is known on another axis
    is that line seen through the coupling of the axes, and never a discovery.
    """
    resolution = 2.0 / max(record.duration for record in model.fit.problem.records)
    for known in model.unknowns:
        if None not in (known.frequency, unknown.frequency) and abs(known.frequency - unknown.frequency) < resolution:
            return np.inf
    axis = AXES.index(unknown.axis)
    if not any(unknown.axis in effect.axes for effect in model.effects) and not any(
        unknown.axis == known.axis for known in model.unknowns
    ):
        return 0.0
    ratio = bare.fit.whitener.scales[axis] / model.fit.whitener.scales[axis]
    return settings.unknown_share * 2.0 * sum(model.fit.problem.lengths) * float(np.log(ratio))


@dataclass(frozen=True, eq=False)
class Selection:
    """Outcome of the search.

    Attributes
    ----------
    bare : Model
        The simplified model alone, fitted.
    model : Model
        With all that was found.
    first_scan, last_scan : Scan
        Scores of the catalogue at either.
    threshold, hint : float
        Scores of the levels ``significance`` and ten times that.
    """

    bare: Model
    model: Model
    first_scan: Scan
    last_scan: Scan
    threshold: float
    hint: float


def select(problem: Problem, start: PlantParameters, settings: SelectionSettings | None = None) -> Selection:
    """Search the catalogue for what ``problem``'s records hold beyond the simplified model."""
    settings = settings or SelectionSettings()
    bare = model = Model(fit(problem, start))
    first = None
    level = unknown_level(settings)
    while True:
        scanned = scan(model.fit, candidates(problem.records, model.fit.parameters))
        colour = noise_whitener(model.fit, scanned.raw)
        times = {t for whitener in (colour, model.fit.whitener) for t in step_times(model.fit, whitener)}
        scanned = extended(scanned, moving_mass_at(sorted(times), model.fit.parameters))
        first = first or scanned
        surrogates = largest_scores(scanned)
        threshold, hint = (quantile(surrogates, p * settings.significance) for p in (1.0, 10.0))
        if len(model.effects) + len(model.unknowns) == settings.most:
            break
        sharp = scored(model.fit, colour, scanned.candidates, scanned.raw)
        trials = named_trials(model, scanned, sharp, threshold, settings)
        best_gain = trials[0].gain if trials else 0.0
        bar = max(level, settings.unknown_factor * best_gain + settings.unknown_margin)
        unknowns = [
            unknown
            for unknown in search(model.fit, sharp.whitener)
            if unknown.surplus > max(bar, leftover_bar(bare, model, unknown, settings))
        ]
        if unknowns:
            model = with_unknown(model, unknowns[0])
        elif trials:
            model = replace(model, fit=trials[0].fit, effects=(*model.effects, trials[0].effect))
            model = eliminated(model, threshold)
        else:
            break
    return Selection(bare, model, first, scanned, threshold, hint)
