r"""Efficient scores: what every effect of the catalogue would add to the likelihood, without fitting it.

H and g are those of F with base, air and all candidates as columns, and i are the columns in the model. Candidate j
adds

    u = -(g_j - a.g_i),    I = H_jj - H_ji a,    a = H_ii^-1 H_ij,    S = u^2/(2 I phi)   [nats]

at the minimum over i; u/I is its coefficient. phi >= 1 is the dispersion: how many times the variances of the
parameters from log to log are those of the model. It is 1 where the air's colour is right and logs are alike. The S of
an effect in the model is the loss of the quadratic form without it, where other parameters may stop at a bound. An
effect whose coefficient would have a sign that physics forbids has the score 0. If a law is tried with several shapes,
the logarithm of their number is subtracted (Bonferroni).

Sources: Cox and Hinkley, Theoretical Statistics, section 9.3 (efficient scores); McCullagh and Nelder, Generalized
Linear Models, 2nd ed., section 4.5 (dispersion); Smyth, Statistical Applications in Genetics and Molecular Biology 3
(2004) article 3, section 6.2 (variances with few degrees of freedom, pooled).
"""

from collections.abc import Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.signal import lfilter
from scipy.special import digamma

from .fit import Fit, bounded_step
from .noise import LOWEST, error_dynamics, match_steps
from .rig import Array, Candidate, Coordinate
from .sensitivity import linearise
from .settings import ESTABLISHED, FARTHEST, KEPT, SETTLING


@dataclass(frozen=True)
class Score:
    """Score of one effect."""

    field: str
    score: float
    """S [nats]."""
    value: float
    standard_error: float
    """value, standard_error: Coefficient and its standard error, in its unit."""
    visibility: float
    """I/H_jj, the share of its signature that the columns in the model cannot imitate."""
    shapes: Mapping[str, float]
    """The shapes of its law with the highest score."""
    column: int
    """Its place in :attr:`Scores.coordinates`."""


def columns_of(effect: Candidate, fitted: Fit) -> list[Coordinate]:
    """Coordinates of an effect that is not in the model, one for each shape that the search starts from."""
    rig, parameters = fitted.likelihood.rig, fitted.parameters
    if effect.fault is not None:
        return [Coordinate.of_fault(effect.fault)]
    starts: Sequence[Mapping[str, float]] = effect.starts
    if effect.steps_in_time:
        starts = [{effect.steps_in_time: step_time(fitted, rig.axes.index(effect.axis))}]
    return [
        replace(rig.coordinate(effect.field, rig.assign(parameters, start)), companions=dict(start)) for start in starts
    ]


def step_time(fitted: Fit, axis: int) -> float:
    """Instant [s] since the records began at which a step of an axis's torque would explain most.

    The logs are added up, because such a step would repeat in all of them.
    """
    likelihood, sums = fitted.likelihood, np.zeros(0)
    step = likelihood.records[0].step
    for record, e in zip(likelihood.records, fitted.e, strict=True):
        u = match_steps(likelihood.filters(record, fitted.point)[axis], record.weights[:, axis] * e[:, axis])
        u = np.interp(np.arange(0.0, record.time[-1], step), record.time, u) * record.step
        length = max(len(sums), len(u))
        sums = np.pad(sums, (0, length - len(sums))) + np.pad(u, (0, length - len(u)))
    first = likelihood.filters(likelihood.records[0], fitted.point)[axis]
    response = np.cumsum(lfilter(*error_dynamics(first), np.ones(len(sums))) ** 2)[::-1]
    merit = sums**2 / np.maximum(response, 1e-3 * response[0])
    merit[: round(2 * SETTLING / step)] = 0.0
    merit[-round(SETTLING / step) :] = 0.0
    return int(merit.argmax()) * step


def fall_by(H: Array, g: Array, step: Array) -> float:
    """Fall [nats] of a quadratic form with Hessian H (n, n) and gradient g (n,) by a step (n,)."""
    return -float(g @ step + 0.5 * step @ H @ step)


def pooled_dispersion(moves: Array, variances: Array) -> float:
    """Variances by ``moves`` (d + 1, P) of parameters over those of the likelihood (P,), at least 1.

    The geometric mean over the parameters that the logs determine better than their priors, whose variance is 1, do.
    With d degrees of freedom each alone says little: four logs miss every second variance that is too small, and find
    as many too small by chance. psi corrects the mean logarithm of a variance with d degrees of freedom.
    """
    known, d = (variances < 0.5) & moves.any(0), len(moves) - 1
    ratios = (moves[:, known] ** 2).sum(0) / variances[known]
    return max(1.0, float(np.exp(np.log(ratios).mean() - digamma(d / 2.0)) * d / 2.0)) if known.any() else 1.0


class Scores:
    """The quadratic form of F around a fit with columns of all candidates, and the scores of any subset of them.

    Torques act along the filter's motion, or along the ``smoothed`` one.
    """

    def __init__(self, fitted: Fit, candidates: Sequence[Candidate], smoothed: bool = False):
        self.fitted = fitted
        self.effects = {effect.field: effect for effect in candidates}
        instants = max(record.time[-1] for record in fitted.likelihood.records) / 0.5  # [s] that the filter tells apart
        trials = {e.field: len(e.starts) * (instants if e.steps_in_time else 1.0) for e in candidates}
        self.penalty = {name: float(np.log(count)) for name, count in trials.items()}  # the best of many by chance
        new = [c for e in candidates if e.field not in fitted.names for c in columns_of(e, fitted)]
        self.coordinates = [*fitted.coordinates, *new]
        self.x = np.array([*fitted.x, *(c.coordinate(0.0) for c in new)])
        self.quadratic = linearise(fitted.likelihood, fitted.point, self.coordinates, self.x, fitted.sigma, smoothed)
        self.H, self.g = self.quadratic.total
        P = self.P = len(self.x)
        z = fitted.point.z
        self.low = np.append([c.bounds[0] for c in self.coordinates] - self.x, LOWEST - z)
        self.high = np.append([c.bounds[1] for c in self.coordinates] - self.x, FARTHEST - z)
        self.of_field: dict[str, list[int]] = {}
        for j, coordinate in enumerate(self.coordinates):
            self.of_field.setdefault(coordinate.field, []).append(j)
        catalogue = {name for effect in candidates for name in effect.parameters}
        self.nuisance = [j for j, c in enumerate(fitted.coordinates) if c.field not in catalogue]
        self.nuisance += range(P, len(self.g))
        self.off: frozenset[str] = frozenset()
        """Parameters of the fit that are held at zero."""

    @property
    def selected(self) -> list[str]:
        """Effects and faults that are in the fit."""
        return [name for name in self.fitted.names if name in self.effects]

    def _with(self, **changed: Any) -> "Scores":
        """Return a copy with other attributes, which chooses its columns again."""
        part = copy(self)
        vars(part).pop("chosen", None)
        vars(part).update(changed)
        return part

    def of_logs(self, logs: Sequence[int]) -> "Scores":
        """Return the same for some of the logs."""
        H, g = self.quadratic.H[list(logs)].sum(0), self.quadratic.g[list(logs)].sum(0)
        return self._with(H=H + np.eye(len(g)), g=g + self.quadratic.prior)

    def all_but(self, log: int) -> "Scores":
        """Return the same for all logs but one."""
        return self.of_logs([other for other in range(len(self.quadratic.H)) if other != log])

    def without(self, fields: Collection[str]) -> "Scores":
        """Return the same with some parameters of the fit held at zero."""
        return self._with(off=frozenset(fields))

    def redraw(self, truth: Array, rng: np.random.Generator) -> "Scores":
        """Return the same with random gradients around a step ``truth`` (n,): further flights of that plant."""
        g = np.array([rng.multivariate_normal(-H @ truth, self.dispersion * H, check_valid="ignore", method="eigh")
                      for H in self.quadratic.H])  # fmt: skip
        return self._with(quadratic=replace(self.quadratic, g=g))

    @cached_property
    def spread(self) -> tuple[Array, Array]:
        """Moves (d + 1, n) of the fit's columns by single logs, and the variances (n,) of the sums of their squares.

        Of a single log, the moves by its blocks of :data:`.settings.BLOCK` s.
        """
        i, blocks = self.model_columns(self.selected), self.quadratic.blocks
        C = np.zeros_like(self.H)
        C[np.ix_(i, i)] = np.linalg.inv(self.quadratic.total[0][np.ix_(i, i)])
        scores = np.array([of_log.sum(0) for of_log in blocks]) if len(blocks) > 1 else blocks[0]
        moves = np.sqrt(len(scores) / max(len(scores) - 1, 1)) * scores @ C
        return moves - moves.mean(0), np.diag(C)

    @cached_property
    def dispersion(self) -> float:
        """Phi."""
        names, (moves, variances) = self.fitted.likelihood.rig.base, self.spread
        base = [j for j, c in enumerate(self.fitted.coordinates) if c.field in names]
        return pooled_dispersion(moves[:, base], variances[base])

    def dispersion_of(self, name: str) -> float:
        """Phi of an effect in the fit, where its own ratio of variances counts d times and that of all once.

        A torque that drifts or differs from log to log looks like one law and moves other parameters little.
        """
        moves, variances = self.spread
        j, d = self.of_field[name][0], len(moves) - 1
        own = (moves[:, j] @ moves[:, j] * d / variances[j] + self.dispersion) / (d + 1.0)
        return max(self.dispersion, float(own))

    @cached_property
    def units(self) -> dict[str, float]:
        """Return for each effect the plant's value that acts as 1 at the operating point; 1 for sizes of faults."""
        rig, p = self.fitted.likelihood.rig, self.fitted.parameters
        fields = {c.field for c in self.coordinates if c.fault is None}
        of_plant = {name: float(getattr(rig.assign(p, {name: 1.0}), name)) for name in self.effects.keys() & fields}
        return dict.fromkeys(self.effects, 1.0) | of_plant

    def entry_score(self, name: str) -> float:
        """Score at which an effect enters the model [nats]; a fault enters only where it is established."""
        return ESTABLISHED if self.effects[name].fault else KEPT

    def model_columns(self, selected: Collection[str]) -> list[int]:
        """Columns of a model: the nuisance, the selected effects, and their shapes where these were fitted."""
        columns = [j for j in self.nuisance if j >= self.P or self.coordinates[j].field not in self.off]
        for name in selected:
            fitted = self.effects[name].parameters if name in self.fitted.names else ()
            columns += [self.of_field[field][0] for field in fitted] or [self.chosen[name]]
        return sorted(set(columns))

    def signatures(self, columns: Sequence[int], selected: Collection[str]) -> Array:
        """Information (n, n) of some columns beside the other columns of a model."""
        i = [j for j in self.model_columns(selected) if j not in columns]
        across = self.H[np.ix_(i, columns)]
        return np.asarray(self.H[np.ix_(columns, columns)] - across.T @ np.linalg.solve(self.H[np.ix_(i, i)], across))

    @cached_property
    def chosen(self) -> dict[str, int]:
        """Column of every effect: of several shapes the one that adds most to the effects of the fit."""
        columns = {name: self.of_field[name] for name in self.effects}
        several = {name: js for name, js in columns.items() if len(js) > 1}
        best = {name: score.column for name, score in self._score_outside(self.minimum(self.selected), several).items()}
        return {name: js[0] for name, js in columns.items()} | best

    def minimum(self, selected: Collection[str]) -> tuple[Array, list[int]]:
        """Step to the minimum of the quadratic form with the selected effects alone, and its columns."""
        i, d = self.model_columns(selected), np.zeros(len(self.g))
        for name in self.fitted.names:
            if (name in self.effects and name not in selected) or name in self.off:
                j = self.of_field[name][0]
                d[j] = self.coordinates[j].coordinate(0.0) - self.x[j]
        d[i] = bounded_step(self.H[np.ix_(i, i)], (self.g + self.H @ d)[i], self.low[i], self.high[i])
        return d, i

    def fall(self, selected: Collection[str]) -> float:
        """Return how far F falls [nats] to that minimum."""
        return fall_by(self.H, self.g, self.minimum(selected)[0])

    def scores(self, selected: Collection[str], among: Collection[str] | None = None) -> dict[str, Score]:
        """Score candidates: their gain beside the ``selected`` ones, and for one of these the loss without it."""
        wanted = [name for name in self.effects if among is None or name in among]
        whole = self.minimum(selected)
        found = self._score_outside(whole, {name: [self.chosen[name]] for name in wanted if name not in selected})
        fall = fall_by(self.H, self.g, whole[0])
        for name in selected:
            if name in wanted:
                j, least = self.chosen[name], self.minimum([other for other in selected if other != name])
                lost = (fall - fall_by(self.H, self.g, least[0])) / self.dispersion - self.penalty[name]
                value = self.units[name] * self.coordinates[j].value(float(self.x[j] + whole[0][j]))
                outside = self._score_outside(least, {name: [j]})[name]  # without it others may stop at a bound
                found[name] = replace(outside, score=max(lost, 0.0), value=value)
        return found

    def _score_outside(self, least: tuple[Array, list[int]], tried: Mapping[str, Sequence[int]]) -> dict[str, Score]:
        """Score candidates outside of a model at its minimum ``least``, each by the best of its ``tried`` columns."""
        if not tried:
            return {}
        d, i = least
        columns = np.array([j for js in tried.values() for j in js])
        inside = np.array([j for j in i if self.low[j] < d[j] < self.high[j]])  # at a bound nothing moves
        a = np.linalg.solve(self.H[np.ix_(inside, inside)], self.H[np.ix_(inside, columns)])
        g = self.g + self.H @ d
        raw = self.H[columns, columns]
        information = np.maximum(raw - (self.H[np.ix_(inside, columns)] * a).sum(0), 1e-12 * raw)
        u = -(g[columns] - a.T @ g[inside])
        phi, seen = self.dispersion, np.diag(self.quadratic.H.sum(0))
        found: dict[str, Score] = {}
        for k, j in enumerate(columns):
            c = self.coordinates[j]
            x = self.x[j] + d[j] + u[k] / information[k]
            zero = c.coordinate(0.0)
            allowed = (x > zero and c.bounds[1] > zero) or (x < zero and c.bounds[0] < zero)
            S = max(0.5 * u[k] ** 2 / information[k] / phi - self.penalty[c.field], 0.0) if allowed else 0.0
            if c.field not in found or S > found[c.field].score:
                unit = self.units[c.field]
                at = float(np.clip(x, *c.bounds) if c.bend else x)  # a bent one has a pole beyond its bound
                error = unit * c.slope(0.0) * np.sqrt(phi / information[k])
                found[c.field] = Score(
                    c.field, float(S), unit * c.value(at), float(error),
                    float(min(information[k] / seen[j], 1.0)) if seen[j] > 0.0 else 0.0, c.companions, int(j),
                )  # fmt: skip
        return found
