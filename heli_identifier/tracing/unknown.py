r"""Torques that the catalogue cannot name: on each axis a curve over one variable of the motion, or periodic in time.

Both are searched in the same likelihood. Its quadratic form takes the torques as further coordinates x with standard
normal priors. Beside the fitted plant i, in the air of the fit, they explain

    S = u' (D + 1)^-1 u / 2  [nats],   k = tr D (D + 1)^-1,   u = H_xi H_ii^-1 g_i - g_x,   D = H_xx - H_xi H_ii^-1 H_ix

with D and H_xx without the prior; k are their degrees of freedom beside the fitted parameters. The torques of a curve
are those of the plant's table. A periodic torque has a sine and a cosine in each log, at the frequency with the highest
periodogram of the innovations.

The best ones are fitted, with the air, and the catalogue is searched again beside them: effects that took their place
leave. One stays if the likelihood without it, but with named effects and rigid-body mechanics, is lower by
:data:`.settings.UNKNOWN`, and by more than results from inexact laws.

Sources: Cox and Hinkley, Theoretical Statistics, section 9.3; Hastie and Tibshirani, Generalized Additive Models,
section 3.5 (degrees of freedom); Quinn and Hannan, The Estimation and Tracking of Frequency, chapter 2.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.special import chdtrc, chdtri, gammaln

from .fit import Fit, fit
from .likelihood import NO_HARMONICS
from .motion import Tables
from .rig import Array, Candidate, Coordinate, means
from .select import Selection, select
from .sensitivity import linearise
from .settings import ESTABLISHED, FORCE, PER_LOG, UNKNOWN
from .stability import left_out_gain

TIME = "time"  # the variable of periods


@dataclass(frozen=True, eq=False)
class Unknown:
    """A torque that the catalogue does not have.

    ``first`` and ``spacing`` are those of a curve's table [unit of the variable]; of a period 0 and the frequency [Hz].
    ``weights`` (k,) [rad/s^2] are the table's torques, or of every log sine and cosine; S = ``nats``, k = ``freedom``.
    """

    axis: str
    variable: str
    first: float
    spacing: float
    weights: Array
    covariance: Array
    nats: float
    freedom: float

    @property
    def score(self) -> float:
        """Half of the chi-squared of one degree of freedom that is as rare as 2 S of k degrees [nats]."""
        S, k = self.nats, self.freedom
        if 2.0 * S <= k or (tail := float(chdtrc(k, 2.0 * S))) > 1e-280:
            return 0.5 * float(chdtri(1.0, tail)) if 2.0 * S > k else 0.0
        depth = S - (0.5 * k - 1.0) * np.log(S) + gammaln(0.5 * k)  # the tails' leading terms
        return float(depth - 0.5 * np.log(depth) - gammaln(0.5))


Torques = tuple[str, float, float, float, Array, Sequence[NDArray[np.intp]]]
"""Variable, ``first`` and ``spacing`` as in :class:`Unknown`, width of the prior [rad/s^2], torques (m, k) [rad/s^2]
for weights of that width, and for each record which of the m acts at every :attr:`.rig.Record.held`-th sample."""


def _weigh_torques(fitted: Fit, a: int, groups: Sequence[Torques]) -> list[Unknown]:
    """Weigh groups of torques of axis ``a``, each alone, beside the fitted plant."""
    columns = [Coordinate("", 0.0, width, step=1.0, torque=(a, torque, which))
               for *_, width, torques, which in groups for torque in torques.T]  # fmt: skip
    P, all_x = len(fitted.x), np.concatenate((fitted.x, np.zeros(len(columns))))
    every = (*fitted.coordinates, *columns)
    H, g = linearise(fitted.likelihood, fitted.point, every, all_x, fitted.sigma).total
    beside, found, last = np.linalg.solve(H[:P, :P], H[:P]), list[Unknown](), P
    for variable, head, spacing, width, torques, _ in groups:
        J = slice(last, last := last + torques.shape[1])
        C = np.asarray(np.linalg.inv(H[J, J] - H[J, :P] @ beside[:, J]), dtype=float)
        u = beside[:, J].T @ g[:P] - g[J]
        S, k = float(0.5 * u @ C @ u), float(len(C) - np.trace(C)) + (variable == TIME)  # its frequency is chosen
        axis, x = fitted.likelihood.rig.axes[a], np.asarray(width * (C @ u))
        found.append(Unknown(axis, variable, head, spacing, x, np.asarray(width**2 * C), S, k))
    return found


def table_variables(fitted: Fit) -> list[Array]:
    """Return the variables of the tables along each record's motion, shape (n_i, V)."""
    L, motion = fitted.likelihood, fitted.likelihood.run_all(fitted.point)[1]
    return [L.rig.tables.values(r, fitted.parameters, m) for r, m in zip(L.records, motion, strict=True)]


def visited_values(fitted: Fit, a: int, variables: Sequence[Array]) -> Array:
    """Variables of the tables where axis ``a`` counts, of all records, shape (n, V)."""
    count = [means(record.weights[:, [a]], record.held)[:, 0] > 0.0 for record in fitted.likelihood.records]
    return np.concatenate(variables)[np.concatenate(count)]


def _curves(fitted: Fit, a: int) -> Iterator[Torques]:
    """Curves of an axis over each of the variables, where it has been."""
    tables, x = fitted.likelihood.rig.tables, table_variables(fitted)
    ends = np.quantile(visited_values(fitted, a, x), (0.001, 0.999), axis=0).T.tolist()
    for column, (variable, (low, high)) in enumerate(zip(tables.variables, ends, strict=True)):
        if variable in tables.turning:
            low, high = 0.0, 2.0 * np.pi
        spacing = max(high - low, 1e-6) / (tables.knots - 1)
        basis, which = curve_basis(tables, variable, low, spacing, [values[:, column] for values in x])
        yield variable, low, spacing, PER_LOG[0], PER_LOG[0] * basis, which


def _period(fitted: Fit, a: int, near: float | None = None) -> Torques:
    """Torque of one period at the peak of the periodogram, with a phase and an amplitude for every log.

    The periodogram is that of the innovations, summed over the logs; with ``near`` [Hz] within a bin of it. A bin
    around each period of the fit does not count: the rest of its torque is no further torque.
    """
    records = fitted.likelihood.records
    known = fitted.point.harmonics[0] if fitted.point.harmonics else NO_HARMONICS
    longest, step = max(float(record.time[-1]) for record in records), records[0].held * records[0].step
    finer = 3 if near is None else 6  # a line between two bins loses 1 %, or lies within a hundredth of a bin
    size = 2 ** int(np.ceil(np.log2(longest / step) + finer))
    f, power = np.fft.rfftfreq(size, step), np.zeros(size // 2 + 1)
    for record, e in zip(records, fitted.e, strict=True):
        white = means((record.weights * e)[:, [a]], record.held)[:, 0]
        spectrum = np.abs(np.fft.rfft(white, size)) ** 2 / len(white)
        power += np.interp(f, np.fft.rfftfreq(size, record.held * record.step), spectrum)
    low, high = max(0.06, 4.0 / longest), 3.0  # fewer periods are a drift; an encoder's counts are faster
    if near is not None:
        low, high = max(low, near - 1.0 / longest), min(high, near + 1.0 / longest)
    power[(f < low) | (f > high)] = 0.0
    for omega in known[known[:, 0] == a, 1]:
        power[np.abs(f - omega / (2.0 * np.pi)) < 1.0 / longest] = 0.0
    frequency = float(f[power.argmax()])
    turns = [np.exp(2j * np.pi * frequency * means(r.time[:, None], r.held)[:, 0]) for r in records]
    both = [np.column_stack((turn.imag, turn.real)) for turn in turns]
    width, ends = FORCE, np.cumsum([len(two) for two in both])
    return TIME, 0.0, frequency, width, width * block_diag(*both), np.split(np.arange(ends[-1]), ends[:-1])


def curve_basis(
    tables: type[Tables], variable: str, first: float, spacing: float, x: Sequence[Array]
) -> tuple[Array, list[NDArray[np.intp]]]:
    """Weights (m, k) of a curve's torques at the points of its table, and the nearest of these points to ``x``."""
    basis = tables.basis()
    if variable not in tables.turning:
        return basis, [tables.points((values - first) / spacing) for values in x]
    closed = np.column_stack((basis[:, 0] + basis[:, -1], basis[:, 1:-1]))
    return closed, [tables.points(np.mod(values - first, 2.0 * np.pi) / spacing) for values in x]


def scan(fitted: Fit) -> list[Unknown]:
    """Score the curves of every axis that has no table, and its strongest periodic torque, beside a fit."""
    rig, found = fitted.likelihood.rig, list[Unknown]()
    for a in np.flatnonzero(fitted.likelihood.counts).tolist():
        has_table = set(rig.tables.fields(rig.axes[a], "")) & set(fitted.fields)
        found += _weigh_torques(fitted, a, [_period(fitted, a), *(() if has_table else _curves(fitted, a))])
    return sorted(found, key=lambda u: -u.score)


def search_unknown(selection: Selection, candidates: Sequence[Candidate]) -> tuple[Selection, tuple[Unknown, ...]]:
    """Search torques beside a ``selection`` of the ``candidates`` of the catalogue.

    Returns the selection, with curves as tables of the plant and periodic torques as harmonics of the fit, and the
    unknown torques.
    """
    found: list[Unknown] = []
    tried = scan(selection.fit)[:2]
    # beside air that follows it a torque looks smaller than it is
    while tried and tried[0].score > 0.5 * UNKNOWN and len(found) < len(selection.fit.likelihood.rig.axes):
        start, u = _fit_torque(selection.fit, tried.pop(0), found)
        if replace(u, nats=(selection.fit.value - start.value) / selection.form.dispersion).score < UNKNOWN:
            continue
        after = select(selection.null, candidates, start)
        more = len(after.findings) - len(selection.findings)
        fall = selection.plant.value - after.plant.value
        weighed = replace(u, nats=fall / after.form.dispersion, freedom=max(u.freedom + more, 1.0))
        named = sum(f.score.score for f in after.findings if f.effect.axis in (u.axis, "rotors"))
        if weighed.score > max(UNKNOWN, 0.25 * named) and _helps_others(after, u):  # no law is exact
            selection, found = after, [*found, weighed]
            tried = scan(selection.fit)[:2]
    return selection, tuple(found)


def _helps_others(after: Selection, u: Unknown) -> bool:
    """Whether logs that are left out get likelier with a curve, and all logs but any one show it.

    A hand in one log bends a curve where that log alone has been, and frees the other parameters, so all others get
    likelier.
    """
    likelihood, form, count = after.fit.likelihood, after.form, len(after.fit.likelihood.records)
    if u.variable == TIME or count == 1:
        return True
    table = likelihood.rig.tables.fields(u.axis, u.variable)
    for log in range(count):
        others = form.all_but(log)
        fall = others.fall(form.selected) - others.without(table).fall(form.selected)
        if replace(u, nats=fall / after.form.dispersion).score < ESTABLISHED:
            return False
    return left_out_gain(form, form.selected, table=table) > 0.0


def _fit_torque(fitted: Fit, u: Unknown, found: Sequence[Unknown]) -> tuple[Fit, Unknown]:
    """Fit with an unknown torque, its period refined."""
    tables = fitted.likelihood.rig.tables
    if u.variable == TIME:
        alone = fit(fitted.likelihood, fitted.names, _set_harmonics(fitted, [*found, u]))  # its air does not follow u
        bare, a = _set_harmonics(alone, found), fitted.likelihood.rig.axes.index(u.axis)
        (u,) = _weigh_torques(bare, a, [_period(bare, a, near=u.spacing)])
        return fit(fitted.likelihood, fitted.names, _set_harmonics(alone, [*found, u])), u
    fields = tables.fields(u.axis, u.variable)
    shapes = tables.switch_on(u.axis, u.variable, u.first, u.spacing) | dict(zip(fields, u.weights, strict=True))
    return fit(fitted.likelihood, (*fitted.names, *fields, tables.first(u.axis)), fitted, shapes), u


def _set_harmonics(fitted: Fit, unknowns: Sequence[Unknown]) -> Fit:
    """Let the periodic ones of some unknown torques act in the logs of a fit, and no others."""
    axes, count = fitted.likelihood.rig.axes, len(fitted.likelihood.records)
    heads = [((axes.index(u.axis), 2.0 * np.pi * u.spacing), u.weights) for u in unknowns if u.variable == TIME]
    rows = [[[*head, *x[2 * i : 2 * i + 2]] for head, x in heads] for i in range(count)]
    harmonics = tuple(np.array(sines, dtype=float).reshape(-1, 4) for sines in rows)
    return replace(fitted, point=replace(fitted.point, harmonics=harmonics))
