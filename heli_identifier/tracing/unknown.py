r"""What the catalogue cannot name: on each axis a torque over one variable of the motion, or periodic in time.

Both are searched in the same likelihood. The innovations e of a fit and their derivatives A by all that it estimates
are averaged to :data:`.settings.SEEN_AT`; a further torque Phi x enters them as J = G Phi, G the filter's error
dynamics, and beside A explains

    S = u' (D + 1)^-1 u / 2  [nats],   k = tr D (D + 1)^-1,   u = -J' M e,   D = J' M J,   M = 1 - A (A'A + 1)^-1 A'

in units of sigma and of the priors' widths; k are its degrees of freedom beside the fitted parameters. Phi of a curve
are the weights of the torques in the plant's own table; of a period sine and cosine in every log apart, at the
frequency where the periodogram of e stands out.

The best are fitted, with the air, and the catalogue is selected anew beside them: what stood in their place leaves. One
stays if the likelihood of named effects alone lacks :data:`.settings.UNKNOWN`, and more than comes from no law being
exact. A curve is then part of the plant; a period is not, as every log has its own phase.

Sources: Cox and Hinkley, Theoretical Statistics, section 9.3; Hastie and Tibshirani, Generalized Additive Models,
section 3.5 (degrees of freedom); Quinn and Hannan, The Estimation and Tracking of Frequency, chapter 2.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.linalg import cho_solve, cholesky, solve_triangular
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter
from scipy.special import chdtrc, chdtri, gammaln

from .fit import Fit, covariance, fit
from .helicopter import Tables
from .noise import error_dynamics
from .result import CurveShape, FoundEffect, PeriodicShape, Verdict, variable_name
from .rig import Array, Effect
from .select import Selection, select
from .sensitivity import Sensitivities, means
from .settings import OWN, PERIODIC_BAND, PERIODS, UNKNOWN, UNKNOWN_SHARE

TIME, POINTS = "time", 121
"""The variable of periods, and the points of a drawn curve."""


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


class _Seen:
    """What a fit says about further torques: averaged innovations by axis, and what explains them already."""

    def __init__(self, fitted: Fit):
        L, point, rig, P = fitted.likelihood, fitted.point, fitted.likelihood.rig, len(fitted.x)
        sensitivities = Sensitivities(L, point, fitted.coordinates, fitted.x)
        self.tables, self.axes, self.steps, self.response = rig.tables, rig.axes, [], []
        self.times, self.variables = [], []
        self.w: list[Array] = []
        self.e: list[Array] = []
        self.A: list[Array] = []
        self.root: list[Array] = []
        rows: list[list[Array]] = [[] for _ in rig.axes]  # weight, weighted innovations and derivatives
        for i, record in enumerate(L.records):
            held = record.held
            for chunk, _, slow in sensitivities.of_record(i, fitted.e[i], fitted.motion[i]):
                first = np.arange(0, chunk.stop - chunk.start, held)
                for a, (named, J) in enumerate(slow):
                    w = record.weights[chunk, a]
                    full = np.zeros((len(first), P + 5))
                    at = [2 + (j if j < P else P + (j - sensitivities.own) // len(rows)) for j in named]
                    full[:, 0] = np.add.reduceat(w, first)
                    full[:, 1] = np.add.reduceat(w * fitted.e[i][chunk, a], first)
                    full[:, at] = J.T * full[:, :1]
                    rows[a].append(full)
            self.steps.append(held * record.step)
            self.response.append([error_dynamics(own, held) for own in L.filters(record, point)])
            self.times.append(means(record.time[:, None], held)[:, 0])
            self.variables.append(rig.tables.values(record, fitted.parameters, fitted.motion[i]))
        self.ends = np.cumsum([0, *map(len, self.times)])
        for a, chunks in enumerate(rows):
            stacked = np.concatenate(chunks)
            w = np.sqrt(stacked[:, 0]) / fitted.sigma[a]
            stacked[:, 1:] *= (w / np.maximum(stacked[:, 0], 1e-12))[:, None]
            e, A = stacked[:, 1], stacked[:, 2:]
            self.w, self.A = [*self.w, w], [*self.A, A]
            part = slice(a, 3 * len(rows), len(rows))  # torque, angle and rate of every log
            prior = np.concatenate((np.ones(P), np.tile(L.widths[part] ** -2.0, len(self.times))))
            H, left = np.diag(prior), self.across(a, A[:, :P])
            H[:, :P] += left
            H[:P, P:] += left[P:].T
            for own, (first, last) in zip(range(P, len(H), 3), pairwise(self.ends), strict=True):
                H[own : own + 3, own : own + 3] += A[first:last, P:].T @ A[first:last, P:]
            root = cholesky(H, lower=True)
            x = prior * np.concatenate((fitted.x, point.own[:, part].ravel()))
            c = cho_solve((root, True), self.across(a, e) + x)
            of_logs = [A[first:last, P:] @ own for own, (first, last) in
                       zip(c[P:].reshape(-1, 3), pairwise(self.ends), strict=True)]  # fmt: skip
            self.root, self.e = [*self.root, root], [*self.e, e - A[:, :P] @ c[:P] - np.concatenate(of_logs)]

    def across(self, a: int, values: Array) -> Array:
        """A'v of values v (N, ...): derivatives by the P coordinates first, then by the three of every log's own."""
        A = self.A[a]
        own = [A[first:last, -3:].T @ values[first:last] for first, last in pairwise(self.ends)]
        return np.concatenate((A[:, :-3].T @ values, *own))

    def explained(self, a: int, torques: Sequence[Array], width: float) -> tuple[Array, Array, float, float]:
        """Weights of torques (n_i, k) of axis ``a`` under a prior of ``width``, their covariance, S and k."""
        parts = [lfilter(*response[a], Phi, axis=0) for response, Phi in zip(self.response, torques, strict=True)]
        J: Array = np.concatenate(parts) * self.w[a][:, None]
        known = solve_triangular(self.root[a], self.across(a, J), lower=True)
        D = width**2 * (J.T @ J - known.T @ known)
        u = -width * (J.T @ self.e[a])
        C = np.linalg.inv(D + np.eye(len(D)))
        return width * (C @ u), np.asarray(width**2 * C), float(0.5 * u @ C @ u), float(np.trace(D @ C))

    def curve(self, a: int, variable: str) -> Unknown:
        """Curve over one variable, where it has been."""
        column, knots = list(self.tables.variables).index(variable), self.tables.basis(np.zeros(1)).shape[1]
        x = [values[:, column] for values in self.variables]
        low, high = np.quantile(np.concatenate(x)[self.w[a] > 0.0], (0.001, 0.999))
        if variable in self.tables.turning:
            low, high = 0.0, 2.0 * np.pi
        first, spacing = float(low), max(float(high - low), 1e-6) / (knots - 1)
        torques = [_basis(self.tables, variable, first, spacing, own) for own in x]
        return Unknown(self.axes[a], variable, first, spacing, *self.explained(a, torques, OWN[0]))

    def waves(self, a: int, frequency: float) -> Unknown:
        """Torque of one frequency [Hz], its phase and amplitude free in every log."""
        waves = [np.exp(2j * np.pi * frequency * t) for t in self.times]
        both = [np.column_stack((wave.imag, wave.real)) for wave in waves]
        torques = [np.kron(own, two) for own, two in zip(np.eye(len(both)), both, strict=True)]
        x, C, S, k = self.explained(a, torques, 10.0 * OWN[0])
        return Unknown(self.axes[a], TIME, 0.0, frequency, x, C, S, k + 1.0)

    def refined(self, a: int, frequency: float) -> Unknown:
        """Period that explains most within a bin of ``frequency`` [Hz], to .02 of a bin."""
        bin_width = 1.0 / max(float(t[-1]) for t in self.times)
        best = minimize_scalar(
            lambda f: -self.waves(a, float(f)).nats, bounds=(frequency - bin_width, frequency + bin_width),
            method="bounded", options={"xatol": 0.02 * bin_width},
        )  # fmt: skip
        return self.waves(a, float(best.x))

    def period(self, a: int) -> Unknown:
        """Period where the periodogram, summed over the logs, stands out most."""
        longest, step = max(float(t[-1]) for t in self.times), self.steps[0]
        size = 2 ** int(np.ceil(np.log2(longest / step) + 3))  # a line between two bins loses 1 %
        f, power = np.fft.rfftfreq(size, step), np.zeros(size // 2 + 1)
        for h, first, last in zip(self.steps, self.ends, self.ends[1:], strict=False):
            own = np.abs(np.fft.rfft(self.e[a][first:last], size)) ** 2 / (last - first)
            power += np.interp(f, np.fft.rfftfreq(size, h), own)
        power[(f < max(PERIODIC_BAND[0], PERIODS / longest)) | (f > PERIODIC_BAND[1])] = 0.0
        return self.waves(a, float(f[power.argmax()]))


def _basis(tables: type[Tables], variable: str, first: float, spacing: float, x: Array) -> Array:
    """Weights (n, k) of a curve's torques where its variable is ``x`` (n,)."""
    if variable not in tables.turning:
        return tables.basis((x - first) / spacing)
    B = tables.basis(np.mod(x - first, 2.0 * np.pi) / spacing)
    B[:, 0] += B[:, -1]
    return B[:, :-1]


def scan(fitted: Fit) -> list[Unknown]:
    """Score what a fit and its catalogue lack: of every axis curves, if it has none, and the strongest period."""
    seen, found = _Seen(fitted), []
    for a, axis in enumerate(seen.axes):
        if seen.w[a].any():
            found.append(seen.period(a))
            if not set(seen.tables.fields(axis, "")) & set(fitted.fields):
                found += [seen.curve(a, name) for name in seen.tables.variables]
    return sorted(found, key=lambda u: -u.score)


def search_unknown(selection: Selection, candidates: Sequence[Effect]) -> tuple[Selection, tuple[FoundEffect, ...]]:
    """Search what the ``candidates`` of the catalogue cannot name beside what a ``selection`` of them does.

    Give the selection with curves as tables of the plant and periods as harmonics of the fit, and the unknown torques.
    """
    found: list[Unknown] = []
    tried = scan(selection.fit)[:2]
    # beside air that follows it a torque looks smaller than it is
    while tried and tried[0].score > 0.5 * UNKNOWN and len(found) < len(selection.fit.likelihood.rig.axes):
        start, u = _started(selection.fit, tried.pop(0), found)
        if _weighed(selection, selection.fit.value - start.value, u).score < UNKNOWN:
            continue
        after = select(selection.null, candidates, start)
        more = len(after.findings) - len(selection.findings)
        weighed = _weighed(after, selection.fit.value - after.fit.value, replace(u, freedom=max(u.freedom + more, 1.0)))
        named = sum(f.score.score for f in after.findings if f.effect.axis in (u.axis, "rotors"))
        if weighed.score > max(UNKNOWN, UNKNOWN_SHARE * named):
            selection, found = after, [*found, weighed]
            tried = scan(selection.fit)[:2]
    return selection, tuple(_described(selection.fit, u) for u in found)


def _started(fitted: Fit, u: Unknown, found: Sequence[Unknown]) -> tuple[Fit, Unknown]:
    """Fit with an unknown torque, its period refined."""
    tables = fitted.likelihood.rig.tables
    if u.variable == TIME:
        alone = fit(fitted.likelihood, fitted.names, _with_waves(fitted, [*found, u]))  # air that does not follow it
        u = _Seen(_with_waves(alone, found)).refined(fitted.likelihood.rig.axes.index(u.axis), u.spacing)
        return fit(fitted.likelihood, fitted.names, _with_waves(alone, [*found, u])), u
    fields = tables.fields(u.axis, u.variable)
    shapes = tables.placed(u.axis, u.variable, u.first, u.spacing) | dict(zip(fields, u.weights, strict=True))
    return fit(fitted.likelihood, (*fitted.names, *fields), fitted, shapes), u


def _with_waves(fitted: Fit, unknowns: Sequence[Unknown]) -> Fit:
    """Let those of some unknown torques that are periods act in the logs of a fit, and no others."""
    axes, count = fitted.likelihood.rig.axes, len(fitted.likelihood.records)
    heads = [((axes.index(u.axis), 2.0 * np.pi * u.spacing), u.weights) for u in unknowns if u.variable == TIME]
    rows = [[[*head, *x[2 * i : 2 * i + 2]] for head, x in heads] for i in range(count)]
    harmonics = tuple(np.array(own, dtype=float).reshape(-1, 4) for own in rows)
    point = replace(fitted.point, harmonics=harmonics)
    e, motion = fitted.likelihood.filtered(point)
    return replace(fitted, point=point, e=e, motion=motion)


def _weighed(around: Selection, fall: float, u: Unknown) -> Unknown:
    """Give the unknown torque what the likelihood gains by it, a ``fall`` of F, over the dispersion of its axis."""
    quadratic, axis = around.last.quadratic, around.fit.likelihood.rig.axes.index(u.axis)
    phi = np.median(around.last.dispersion[quadratic.information.argmax(0) == axis])
    return replace(u, nats=fall / float(phi))


def _described(fitted: Fit, u: Unknown) -> FoundEffect:
    """State an unknown torque; of a period the mean amplitude over the logs."""
    family, periodic = f"unknown torque of the {u.axis}", u.variable == TIME
    if periodic:
        amplitudes = np.hypot(u.weights[0::2], u.weights[1::2])
        A, error = float(amplitudes.mean()), float(np.sqrt(np.trace(u.covariance) / 2.0) / len(amplitudes))
        words = f"periodic in time at {u.spacing:.3f} Hz, amplitude {A:.2g} rad/s^2"
        shape: CurveShape | PeriodicShape = PeriodicShape(u.spacing, A, error, words)
        do = "Log the rig at rest, motors off, and look for what turns or blows in that time."
    else:
        shape = _curve(fitted, u)
        do = f"Lead the {u.axis} through all of its angles, motors off, and feel where the curve bends."
        if u.variable != u.axis:
            do = f"Visit all values of the {variable_name(u.variable)} evenly in one more log, all axes moving."
    return FoundEffect("unknown", u.axis, None, Verdict.UNKNOWN, family, (), shape, u.score, do, not periodic)


def _curve(fitted: Fit, u: Unknown) -> CurveShape:
    """Draw a table's torque where the logs were, less a constant and a line that the model before has itself."""
    seen, a = _Seen(fitted), fitted.likelihood.rig.axes.index(u.axis)
    tables, turning = seen.tables, u.variable in seen.tables.turning
    x = u.first + u.spacing * np.linspace(0.0, tables.basis(np.zeros(1)).shape[1] - 1.0, POINTS)
    values = np.concatenate(seen.variables)[seen.w[a] > 0.0, list(tables.variables).index(u.variable)]
    values = u.first + np.mod(values - u.first, 2.0 * np.pi) if turning else np.clip(values, x[0], x[-1])
    visits = np.sqrt(np.histogram(values, np.append(x, x[-1]) - 0.5 * (x[1] - x[0]))[0])
    visits[[0, -1]] = visits[[0, -1]].max()  # half a bin each, and of a turn the same angle
    B = _basis(tables, u.variable, u.first, u.spacing, x)
    trend = np.column_stack((np.ones(POINTS), x - x.mean())[: 1 + ((u.axis, u.variable) in tables.held)])
    B = B - trend @ np.linalg.lstsq(trend * visits[:, None], B * visits[:, None], rcond=None)[0]
    at = [fitted.fields.index(name) for name in tables.fields(u.axis, u.variable)]
    y = OWN[0] * (B @ fitted.x[at])
    half = 1.96 * OWN[0] * np.sqrt(np.einsum("ij,jk,ik->i", B, covariance(fitted)[np.ix_(at, at)], B))
    there = visits > 0.0
    x, y, half, unit = x[there], y[there], half[there], tables.variables[u.variable]
    said = _words(turning and bool(there.all()), unit, x, y, half)
    words = f"a torque by the {variable_name(u.variable)}, {said}"
    return CurveShape(u.variable, unit, words, np.column_stack((x, y)), np.column_stack((x, y - half, y + half)))


def _words(closed: bool, unit: str, x: Array, y: Array, half: Array) -> str:
    """Describe what of a curve is determined: where its band is narrow beside its range."""
    known = np.ones(len(y), dtype=bool)
    while (less := known & (half < 0.25 * np.ptp(y[known]))).sum() > max(10, 0.1 * len(y)) and (less != known).any():
        known = less
    X, Y = x[known], y[known]
    words = f"{np.ptp(Y):.2g} rad/s^2 from lowest to highest"
    if not known.all():
        words += f" between {X[0]:.2g} and {X[-1]:.2g} {unit}, where its band is narrow"
    if closed:
        power = np.abs(np.fft.rfft(y[:-1] - y[:-1].mean())) ** 2
        n = int(power.argmax())
        return f"{words}, periodic with {n} wave{'s'[: n > 1]} per turn" if power[n] > 0.5 * power.sum() else words
    if len(X) < 10:
        return words
    away = np.abs(Y - np.median(Y))
    wide = X[away > 0.5 * away.max()]
    if wide[0] > X[0] and wide[-1] < X[-1] and len(wide) < 0.35 * len(X):  # large at an end, it may go on there
        return f"{words}, a notch near {0.5 * (wide[0] + wide[-1]):.3g} {unit}, {np.ptp(wide):.2g} {unit} wide"
    return words
