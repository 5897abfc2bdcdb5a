r"""What the catalogue cannot name: on each axis a torque over one variable of the motion, or periodic in time.

Both are searched in the same likelihood. The innovations e of a fit and their derivatives A by all that it estimates
are averaged to :data:`.settings.SEEN_AT`; a further torque with weights Phi(t) enters them as J = G Phi, G the filter's
error dynamics, and beside A explains

    S = u' (I + 1)^-1 u / 2,    k = tr I (I + 1)^-1,    u = -J' M e,    I = J' M J,    M = 1 - A (A'A + 1)^-1 A'

in units of sigma and of the prior's widths: S nats by k degrees of freedom, what is left beside the fitted parameters.
As nats of one degree of freedom S is comparable. Phi of a curve are the weights of the torques in the plant's own
table; of a period sine and cosine in every log apart, and the frequency where the periodogram of e stands out.

The best are fitted, with the air, and the catalogue is selected anew beside them: what was named in their place leaves.
An unknown torque stays if the likelihood of named effects alone is worse by :data:`.settings.UNKNOWN`, and by more than
no law is exact. A curve is then part of the plant; a period is not, as its phase is another in every log.

Sources: Cox and Hinkley, Theoretical Statistics, section 9.3; Hastie and Tibshirani, Generalized Additive Models,
section 3.5 (degrees of freedom); Quinn and Hannan, The Estimation and Tracking of Frequency, chapter 2.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.special import chdtrc, chdtri, gammaln

from .fit import Fit, covariance, fit
from .likelihood import NO_HARMONICS
from .noise import error_dynamics, physical
from .result import CurveShape, FoundEffect, PeriodicShape, Verdict
from .rig import Effect, Tables
from .select import Selection, select
from .settings import CURVE_WIDTH, PERIODIC_BAND, SEEN_AT, UNKNOWN, UNKNOWN_SHARE, UNKNOWN_TRIED

Array = NDArray[np.float64]

POINTS = 121
"""Points of a drawn curve."""

PERIODS = 4.0
"""Least periods in the longest log: fewer are not told from a drift."""


@dataclass(frozen=True, eq=False)
class Unknown:
    """A torque that the catalogue does not have.

    Attributes
    ----------
    axis, variable : str
        "time" for one that is periodic.
    first, spacing : float
        Of a curve's table, in the variable's unit; of a period 0 and the frequency [Hz].
    weights : Array, shape (k,)
        Torques of the table, or of every log coefficients of sine and cosine [rad/s^2].
    covariance : Array, shape (k, k)
    nats, freedom : float
        S and k.
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
        """S as nats of one degree of freedom."""
        return one_degree(self.nats, self.freedom)


def one_degree(nats: float, freedom: float) -> float:
    """Half of the chi-squared of one degree of freedom that is as rare as 2 ``nats`` of ``freedom`` degrees."""
    if 2.0 * nats <= freedom or freedom <= 0.0:
        return 0.0
    tail = float(chdtrc(freedom, 2.0 * nats))
    if tail > 1e-280:
        return 0.5 * float(chdtri(1.0, tail))
    # both tails by their leading terms: x - (k/2 - 1) ln x + ln Gamma(k/2) is the same for either, x in nats
    depth = nats - (0.5 * freedom - 1.0) * np.log(nats) + gammaln(0.5 * freedom)
    x = depth
    for _ in range(5):
        x = depth - 0.5 * np.log(x) - gammaln(0.5)
    return float(x)


class _Axis:
    """What one axis of a fit says about further torques: averaged innovations, and what explains them already."""

    def __init__(self, index: int, step: float, response: tuple[Array, Array], e: list, w: list, A: list, at: Array, tau: float):
        self.index, self.step, self.response, self.w = index, step, response, w
        self.e = np.concatenate(e)
        own, L = A[0].shape[1] - 1, len(A)
        rows = np.zeros((len(self.e) + own + L, own + L))
        self.logs = np.cumsum([0, *map(len, e)])
        for i, part in enumerate(A):
            rows[self.logs[i] : self.logs[i + 1], :own] = part[:, :-1]
            rows[self.logs[i] : self.logs[i + 1], own + i] = part[:, -1]
        rows[len(self.e) :] = np.diag([1.0] * own + [1.0 / tau] * L)
        Q = np.linalg.qr(rows[:, rows[: len(self.e)].any(0)])[0]
        self.Q = Q[: len(self.e)]
        self.e = self.e - self.Q @ (Q.T @ np.concatenate((self.e, at)))

    def explained(self, torques: Sequence[Array], width: float) -> tuple[Array, Array, float, float]:
        """Weights of torques given log by log (n_i, k), with a prior of ``width``: weights, covariance, S, freedom."""
        parts = [lfilter(*self.response, T, axis=0) * w[:, None] for T, w in zip(torques, self.w, strict=True)]
        J = np.concatenate(parts)
        held = self.Q.T @ J
        I = (J.T @ J - held.T @ held) * width**2
        u = -width * (J.T @ self.e)
        C = np.linalg.inv(I + np.eye(len(I)))
        return width * (C @ u), width**2 * C, float(0.5 * u @ C @ u), float(np.trace(I @ C))


def _axes(fitted: Fit) -> tuple[dict[str, _Axis], list[Array], list[Array]]:
    """Axes that move, and of every log times and the tables' variables, all averaged to :data:`.settings.SEEN_AT`."""
    likelihood, point = fitted.likelihood, fitted.point
    rig, step = likelihood.rig, likelihood.records[0].step
    linear, air = rig.linear(fitted.parameters), physical(point.z)
    moves = [likelihood.moved(point, c, x) for c, x in zip(fitted.coordinates, fitted.x, strict=True)]
    n, a = len(moves) + point.z.size, len(rig.axes)
    held, times, variables = max(1, round(1.0 / (SEEN_AT * step))), [], []
    e: list[list[Array]] = [[] for _ in range(a)]
    w: list[list[Array]] = [[] for _ in range(a)]
    A: list[list[Array]] = [[] for _ in range(a)]
    for i, record in enumerate(likelihood.records):
        chunks = [
            (motion, [_averaged(own[:, axis], part, record.weights[first : first + len(own), axis], n, axis, held)
                      for axis, part in enumerate(columns)])
            for first, own, motion, columns in likelihood.columns(i, point, moves, filters_move=False)
        ]  # fmt: skip
        for axis in range(a):
            own_w, own_e, own_A = (np.concatenate([c[1][axis][k] for c in chunks]) for k in range(3))
            scale = np.sqrt(held * own_w) / fitted.sigma[axis]
            w[axis].append(scale)
            e[axis].append(own_e * scale)
            A[axis].append(own_A * scale[:, None])
        times.append(_means(record.time[:, None], held)[:, 0])
        motion = np.concatenate([c[0] for c in chunks])
        variables.append(_means(rig.tables.values(record, fitted.parameters, motion), held))
    made = {
        name: _Axis(i, held * step, error_dynamics(step, linear[i], air[:, i], held), e[i], w[i], A[i],
                    np.concatenate((fitted.quadratic.prior, point.offsets[:, i] / likelihood.offset_width[i])),
                    float(likelihood.offset_width[i]))
        for i, name in enumerate(rig.axes) if any(part.any() for part in w[i])
    }  # fmt: skip
    return made, times, variables


def _means(values: Array, held: int) -> Array:
    """Means over blocks of ``held`` samples (n, k); the last block may be shorter."""
    starts = np.arange(0, len(values), held)
    return np.asarray(np.add.reduceat(values, starts, axis=0) / np.diff([*starts, len(values)])[:, None])


def _averaged(e: Array, columns: dict[int, Array], weights: Array, n: int, axis: int, held: int) -> list[Array]:
    """Weights (m,), innovations (m,) and derivatives (m, n + 1) of one axis, averaged with the weights."""
    at = sorted(columns)
    stacked = np.column_stack([weights, weights * e, *(weights * columns[j] for j in at)])
    means = _means(stacked, held)
    means[:, 1:] /= np.maximum(means[:, :1], 1e-12)
    full = np.zeros((len(means), n + 1))
    full[:, [j if j < n else n for j in at]] = means[:, 2:]
    return [means[:, 0], means[:, 1], full]


def _basis(tables: Tables, u: Unknown, x: Array) -> Array:
    """Weights (n, k) of a curve's torques where its variable is ``x`` (n,)."""
    if u.variable not in tables.turning:
        return tables.basis((x - u.first) / u.spacing)
    B = tables.basis(np.mod(x - u.first, 2.0 * np.pi) / u.spacing)
    B[:, 0] += B[:, -1]
    return B[:, :-1]


def _curves(tables: Tables, name: str, axis: _Axis, variables: list[Array]) -> list[Unknown]:
    """Curves of one axis."""
    found, counted, knots = [], np.concatenate(axis.w) > 0.0, tables.basis(np.zeros(1)).shape[1]
    for column, variable in enumerate(tables.variables):
        x = [own[:, column] for own in variables]
        low, high = np.quantile(np.concatenate(x)[counted], (0.001, 0.999))
        if variable in tables.turning:
            low, high = 0.0, 2.0 * np.pi
        if high > low:
            empty = Unknown(name, variable, float(low), float(high - low) / (knots - 1), *_NOTHING)
            explained = axis.explained([_basis(tables, empty, own) for own in x], CURVE_WIDTH)
            found.append(replace(empty, **dict(zip(("weights", "covariance", "nats", "freedom"), explained))))
    return found


def _waves(name: str, axis: _Axis, times: list[Array], frequency: float) -> Unknown:
    """Torque of one frequency [Hz] on an axis, its phase and amplitude free in every log."""
    torques = []
    for i, t in enumerate(times):
        waves = np.zeros((len(t), 2 * len(times)))
        phase = 2.0 * np.pi * frequency * t
        waves[:, 2 * i], waves[:, 2 * i + 1] = np.sin(phase), np.cos(phase)
        torques.append(waves)
    weights, covariance, nats, freedom = axis.explained(torques, 10.0 * CURVE_WIDTH)
    return Unknown(name, "time", 0.0, frequency, weights, covariance, nats, freedom + 1.0)


def _periods(name: str, axis: _Axis, times: list[Array]) -> list[Unknown]:
    """Periods of one axis: where the periodogram, summed over the logs, stands out most."""
    longest = max(float(t[-1]) for t in times)
    size = 2 ** int(np.ceil(np.log2(longest / axis.step) + 2))
    f, power = np.fft.rfftfreq(size, axis.step), np.zeros(size // 2 + 1)
    for first, last in pairwise(axis.logs):
        power += np.abs(np.fft.rfft(axis.e[first:last], size)) ** 2 / (last - first)
    power[(f < max(PERIODIC_BAND[0], PERIODS / longest)) | (f > PERIODIC_BAND[1])] = 0.0
    return [_refined(name, axis, times, float(f[power.argmax()]))]


def _refined(name: str, axis: _Axis, times: list[Array], frequency: float) -> Unknown:
    """Period of the largest likelihood within a bin of ``frequency`` [Hz], to .02 of a bin."""
    for width in np.array([0.25, 0.07, 0.02]) / max(t[-1] for t in times):
        near = [_waves(name, axis, times, frequency + float(k * width)) for k in range(-4, 5)]
        best = max(near, key=lambda u: u.nats)
        frequency = best.spacing
    return best


_NOTHING = (np.empty(0), np.empty((0, 0)), 0.0, 0.0)


def scan(fitted: Fit) -> list[Unknown]:
    """Score what a fit's catalogue cannot name, on every axis curves and periods, the best first.

    Parameters
    ----------
    fitted : Fit

    Returns
    -------
    list of Unknown
        Curves of axes that have none, and the strongest period of every axis.
    """
    tables = fitted.likelihood.rig.tables
    axes, times, variables = _axes(fitted)
    found = []
    for name, axis in axes.items():
        if not set(tables.fields(name, "")) & set(fitted.fields):
            found += _curves(tables, name, axis, variables)
        found += _periods(name, axis, times)
    return sorted(found, key=lambda u: -u.score)


def search_unknown(selection: Selection, candidates: Sequence[Effect]) -> tuple[Selection, tuple[FoundEffect, ...]]:
    """Search what the catalogue cannot name beside what it names.

    Parameters
    ----------
    selection : Selection
        What the catalogue explains.
    candidates : sequence of Effect
        The catalogue.

    Returns
    -------
    selection : Selection
        With curves as tables of the plant and periods as harmonics of the fit, and what is named beside them.
    effects : tuple of FoundEffect
        The unknown torques.
    """
    found: list[Unknown] = []
    while len(found) < len(selection.fit.likelihood.rig.axes):
        tried = [u for u in scan(selection.fit) if u.score > UNKNOWN_TRIED]
        for u in tried[:2]:
            after, u = _beside(selection, u, candidates)
            kept = _weighed(selection, after, u)
            if kept is not None:
                selection, found = after, [*found, kept]
                break
        else:
            break
    return selection, tuple(_described(selection.fit, u) for u in found)


def _beside(selection: Selection, u: Unknown, candidates: Sequence[Effect]) -> tuple[Selection, Unknown]:
    """Fit with an unknown torque, and select the catalogue anew beside it; a period is refined on the way."""
    before, likelihood = selection.fit, selection.fit.likelihood
    tables = likelihood.rig.tables
    if u.variable != "time":
        fields = tables.fields(u.axis, u.variable)
        shapes = tables.placed(u.axis, u.variable, u.first, u.spacing) | dict(zip(fields, u.weights, strict=True))
        return select(selection.null, candidates, fit(likelihood, (*before.fields, *fields), before, shapes)), u
    first = _without_waves(fit(likelihood, before.fields, _with_waves(before, u)), u.axis, u.spacing)
    axes, times, _ = _axes(first)  # its air has not followed the torque
    u = _refined(u.axis, axes[u.axis], times, u.spacing)
    return select(selection.null, candidates, fit(likelihood, before.fields, _with_waves(first, u))), u


def _with_waves(fitted: Fit, u: Unknown) -> Fit:
    """Add the sines of a period to what acts in the logs of a fit."""
    others = fitted.point.harmonics or (NO_HARMONICS,) * len(fitted.likelihood.records)
    head = fitted.likelihood.rig.axes.index(u.axis), 2.0 * np.pi * u.spacing
    own = [np.array([[*head, *pair]]) for pair in u.weights.reshape(-1, 2)]
    harmonics = tuple(np.concatenate(rows) for rows in zip(others, own, strict=True))
    return replace(fitted, point=replace(fitted.point, harmonics=harmonics))


def _without_waves(fitted: Fit, axis: str, frequency: float) -> Fit:
    """Take the sines of one period out again, and nothing else."""
    key = fitted.likelihood.rig.axes.index(axis), 2.0 * np.pi * frequency
    harmonics = tuple(rows[~(rows[:, :2] == key).all(1)] for rows in fitted.point.harmonics)
    return replace(fitted, point=replace(fitted.point, harmonics=harmonics))


def _weighed(before: Selection, after: Selection, u: Unknown) -> Unknown | None:
    """Give the unknown torque with what the likelihood of named effects alone lacks, if that establishes it."""
    around, index = after.last, after.fit.likelihood.rig.axes.index(u.axis)
    of_axis = around.quadratic.information.argmax(0) == index
    phi = float(np.median(around.dispersion[of_axis])) if of_axis.any() else 1.0
    more = len(after.findings) - len(before.findings)
    weighed = replace(u, nats=(before.fit.value - after.fit.value) / phi, freedom=max(u.freedom + more, 1.0))
    named = sum(f.score.score for f in after.findings if f.effect.axis in (u.axis, "rotors"))
    return weighed if weighed.score > max(UNKNOWN, UNKNOWN_SHARE * named) else None


def _described(fitted: Fit, u: Unknown) -> FoundEffect:
    """State an unknown torque as it is in the last fit."""
    family = f"unknown torque of the {u.axis}"
    if u.variable == "time":
        bare = _without_waves(fitted, u.axis, u.spacing)
        axes, times, _ = _axes(bare)
        shape, experiment = _period(_waves(u.axis, axes[u.axis], times, u.spacing)), _STILL.format(u.spacing)
        return FoundEffect("unknown", u.axis, None, Verdict.UNKNOWN, family, (), shape, u.score, experiment, False)
    shape = _curve(fitted, u)
    experiment = _BY_HAND.format(u.axis, u.variable) if shape.unit == "rad" else ""
    return FoundEffect("unknown", u.axis, None, Verdict.UNKNOWN, family, (), shape, u.score, experiment)


_STILL = "Log the rig at rest, motors off, and look for what turns or blows at {:.3g} Hz."
_BY_HAND = "Lead the {} by hand through all of the {}, motors off, and look at what touches or pulls where the curve bends."


def _period(u: Unknown) -> PeriodicShape:
    """Frequency and mean amplitude over the logs."""
    amplitudes = np.hypot(u.weights[0::2], u.weights[1::2])
    amplitude, error = float(amplitudes.mean()), float(np.sqrt(np.trace(u.covariance) / 2.0) / len(amplitudes))
    words = f"periodic in time at {u.spacing:.3f} Hz, amplitude {amplitude:.2g} rad/s^2"
    return PeriodicShape(u.spacing, amplitude, error, words)


def _curve(fitted: Fit, u: Unknown) -> CurveShape:
    """Draw a table's torque where the logs were, less a constant and a line that the model before has itself."""
    tables = fitted.likelihood.rig.tables
    at = [fitted.fields.index(name) for name in tables.fields(u.axis, u.variable)]
    axes, _, variables = _axes(fitted)
    values = np.concatenate(variables)[np.concatenate(axes[u.axis].w) > 0.0, list(tables.variables).index(u.variable)]
    turning = u.variable in tables.turning
    x = u.first + u.spacing * np.linspace(0.0, tables.basis(np.zeros(1)).shape[1] - 1.0, POINTS)
    s = (np.mod(values - u.first, 2.0 * np.pi) if turning else values - u.first) / (x[1] - x[0])
    visits = np.bincount(np.clip(np.rint(s), 0, POINTS - 1).astype(int), minlength=POINTS).astype(float)
    if turning:
        visits[[0, -1]] = visits[0] + visits[-1]
    B = _basis(tables, u, np.minimum(x, u.first + (2.0 * np.pi - 1e-9 if turning else np.inf)))
    trend = np.column_stack((np.ones(POINTS), x - x.mean())[: 1 + ((u.axis, u.variable) in tables.held)])
    B = B - trend @ np.linalg.lstsq(trend * np.sqrt(visits)[:, None], B * np.sqrt(visits)[:, None], rcond=None)[0]
    C = covariance(fitted)[np.ix_(at, at)] * CURVE_WIDTH**2
    y = B @ np.array([fitted.coordinates[j].value(fitted.x[j]) for j in at])
    half = 1.96 * np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", B, C, B), 0.0))
    seen = visits > 0.0
    unit, words = tables.variables[u.variable], f"a torque of {u.variable}"
    if seen.sum() > 1:
        words = _words(u, words, unit, x[seen], y[seen], half[seen], bool(seen.all()))
    return CurveShape(
        u.variable, unit, words, np.column_stack((x, y))[seen], np.column_stack((x, y - half, y + half))[seen]
    )


def _words(u: Unknown, words: str, unit: str, x: Array, y: Array, half: Array, whole: bool) -> str:
    """Describe a curve by what of it is determined: where its band is narrow beside its range."""
    known = np.ones(len(y), dtype=bool)
    while (narrower := known & (half < 0.25 * np.ptp(y[known]))).sum() >= 0.1 * len(y) and (narrower != known).any():
        known = narrower
    words += f", {np.ptp(y[known]):.2g} rad/s^2 from lowest to highest"
    if u.variable == "travel" and whole:
        power = np.abs(np.fft.rfft(y[:-1] - y[:-1].mean())) ** 2
        waves = int(power.argmax())
        return f"{words}, periodic with {waves} wave{'s'[: waves > 1]} per turn" if power[waves] > 0.5 * power.sum() else words
    X, Y = x[known], y[known]
    if len(X) < 10:
        return words
    level, line = float(np.median(Y)), np.polyfit(X, Y, 1)
    away = np.abs(Y - level)
    wide = away > 0.5 * away.max()
    if not (wide[0] or wide[-1]) and wide.mean() < 0.35:  # large at an end, it may go on there
        lowest, highest = X[wide].min(), X[wide].max()
        return f"{words}, a notch near {0.5 * (lowest + highest):.3g} {unit}, {highest - lowest:.2g} {unit} wide"
    if np.var(Y - np.polyval(line, X)) < 0.1 * np.var(Y):
        kinds = {u.axis: ("a spring", "pushing away"), f"{u.axis}_rate": ("damping", "driving")}
        return f"{words}, {kinds.get(u.variable, ('falling straight', 'rising straight'))[int(line[0] > 0.0)]}"
    inner = X[np.abs(X) <= min(-X[0], X[-1])] if X[0] < 0.0 < X[-1] else X[:0]
    if len(inner) > 0.5 * len(X):
        own, mirrored = np.interp(inner, X, Y), np.interp(-inner, X, Y)
        odd = float(np.var(own - mirrored) / max(4.0 * np.var(own), 1e-30))
        words += ", odd" if odd > 0.8 else ", even" if odd < 0.2 else ""
    slope, tenth = np.abs(np.gradient(Y, X)), max(1, len(X) // 10)
    ends = 0.5 * (slope[:tenth].mean() + slope[-tenth:].mean())
    return words + (", saturating" if ends < 0.3 * slope[len(X) // 3 : -len(X) // 3].mean() else "")
