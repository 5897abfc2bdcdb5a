"""The fit: Gauss-Newton on the criterion between bounds, from calm and swirling air against local optima.

The plant's coordinates x, the air's z and the per-log parameters b move together. No coordinate moves by more than
:data:`.settings.LARGEST_STEP` widths of its prior in a step, and the step is halved while F grows. When F falls no
further, the fit tries a coarse grid of airs around the present one, and continues from there if F is lower.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, solve_triangular
from scipy.optimize import lsq_linear

from heli_identifier.chain import FAULTS

from .likelihood import Likelihood, Point
from .noise import LOWEST, SHAPES
from .rig import Array, Coordinate, Parameters
from .sensitivity import Quadratic, linearise
from .settings import (
    AIR_SCAN,
    AIRS,
    CONVERGED,
    FARTHEST,
    FIRST_FLIGHT,
    ITERATIONS,
    LARGEST_STEP,
    PER_LOG_PRIOR,
    ROUGHLY,
    ROUNDS,
)


@dataclass(frozen=True, eq=False)
class Fit:
    """A plant fitted to the records of a rig, or on the way to it."""

    likelihood: Likelihood
    coordinates: tuple[Coordinate, ...]
    """The P coordinates that are estimated, the sizes of faults last."""
    x: Array
    """Shape (P,)."""
    point: Point
    sigma: Array
    """Scales of the innovations [rad], shape (a,)."""
    value: float
    """F [nats]."""

    @classmethod
    def at(cls, likelihood: Likelihood, coordinates: tuple[Coordinate, ...], x: Array, point: Point) -> "Fit":
        """Evaluate F where plant and faults have the coordinates ``x`` (P,), and the rest is that of ``point``."""
        values, faults = dict[str, float](), dict(likelihood.faults)
        for c, v in zip(coordinates, x, strict=True):
            assigned = c.assigned(float(v)).items()
            values |= {name: min(max(value, c.lower), c.upper) for name, value in assigned}  # rounding leaves a bound
            if c.fault is not None:
                faults[c.fault] = c.value(float(v))
        likelihood = likelihood.undo_faults(faults) if faults != likelihood.faults else likelihood
        point = replace(point, parameters=likelihood.rig.assign(point.parameters, values))
        data, sigma = likelihood.data_terms(likelihood.run_all(point)[0])
        value = float((data + likelihood.log_determinants(point, sigma)).sum()) + likelihood.priors(x, point)
        return cls(likelihood, coordinates, x, point, sigma, value if np.isfinite(value) else np.inf)  # it may diverge

    @property
    def e(self) -> list[Array]:
        """Innovations [rad] of every record, as of :meth:`.Likelihood.run_all`."""
        return self.likelihood.run_all(self.point)[0]

    @cached_property
    def quadratic(self) -> Quadratic:
        """Quadratic form of F."""
        return linearise(self.likelihood, self.point, self.coordinates, self.x, self.sigma)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the coordinates, shape (P,) each."""
        low, high = np.array([c.bounds for c in self.coordinates]).reshape(-1, 2).T
        return low, high

    @property
    def at_bound(self) -> NDArray[np.bool_]:
        """Which of the coordinates are at a bound, shape (P,)."""
        return np.asarray(np.isclose(self.x, self.bounds, rtol=1e-9, atol=1e-9).any(0))

    @property
    def parameters(self) -> Parameters:
        """The plant."""
        return self.point.parameters

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates: parameters of the plant, then sizes of faults of the logs."""
        return tuple(coordinate.field for coordinate in self.coordinates)

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the plant's parameters that were estimated."""
        return tuple(coordinate.field for coordinate in self.coordinates if coordinate.fault is None)

    def estimate(self, name: str) -> float:
        """Return the value of a parameter as :meth:`.Rig.read` defines it at the operating point."""
        return self.likelihood.rig.read(self.parameters, name)

    def slope(self, name: str) -> float:
        """Return abs(dp/dx) of a parameter at its present value, in its unit."""
        i = self.fields.index(name)
        return self.coordinates[i].slope(self.coordinates[i].value(self.x[i]))

    def encoder_noise(self) -> Array:
        """Return the standard deviation r [rad] of the encoders' noise, shape (a,)."""
        axes = self.likelihood.filters(self.likelihood.records[0], self.point)
        return np.asarray(self.sigma / np.sqrt([axis.S for axis in axes]))

    def take_step(self, s: Array) -> "Fit | None":
        """Take a step ``s`` (n,), halved until F falls; None if it does not fall."""
        P, shape, share = len(self.x), self.point.z.shape, 1.0
        for _ in range(ROUNDS):
            taken = share * s
            moved = np.array([share * c - D @ taken for c, D in self.quadratic.per_log_steps])
            z = self.point.z + taken[P:].reshape(shape)
            point = replace(self.point, z=z, per_log=self.point.per_log + moved)
            there = self.at(self.likelihood, self.coordinates, np.clip(self.x + taken[:P], *self.bounds), point)
            if there.value < self.value:
                return there
            share *= 0.5
        return None

    def scan_air(self) -> "Fit | None":
        """Move the air of every axis to the best of a coarse grid; None if F does not fall by enough to go on."""
        z = self.point.z
        airs = [z, *(np.clip(z + np.array(move)[:, None], LOWEST, FARTHEST) for move in AIR_SCAN)]
        best = self.likelihood.compare_airs(self.point, self.e, airs).argmin(0)
        if not best.any():
            return None
        chosen = np.choose(best, airs)
        there = self.at(self.likelihood, self.coordinates, self.x, replace(self.point, z=chosen))
        return there if there.value < self.value - ROUGHLY else None


def bounded_step(H: Array, g: Array, low: Array, high: Array) -> Array:
    """Minimise g.s + s.H.s/2 over s (n,) under low <= s <= high, H positive definite."""
    root = np.linalg.cholesky(H)
    s = -cho_solve((root, True), g)
    if ((s < low) | (s > high)).any():
        s = lsq_linear(root.T, -solve_triangular(root, g, lower=True), (low, high), method="bvls").x
    return np.asarray(s)


def fit(
    likelihood: Likelihood, fields: Sequence[str], start: Fit | None = None,
    shapes: Mapping[str, float] | None = None, value_only: bool = False, other: Point | None = None,
) -> Fit:  # fmt: skip
    """Fit a plant to the records of a rig.

    The parameters and faults ``fields`` are estimated; others keep the values of ``start``, or those that are given of
    the rig. The fit begins at ``start`` with the values ``shapes`` of some parameters, or at the ``other`` point where
    F is lower. With ``value_only`` the caller wants F alone: the fit stops early and does not scan the air.
    """
    rig, new = likelihood.rig, start is None or not set(fields) <= set(start.names)
    if start is None:
        coordinates, x = _coordinates_of(likelihood, fields, rig.estimate(likelihood.records))
        within = np.clip(x, -FARTHEST, FARTHEST).tolist()  # a step is at most some widths of a prior
        first = rig.assign(rig.parameters, {c.field: c.value(v) for c, v in zip(coordinates, within, strict=True)})
        airs = (np.repeat(np.array(air)[:, None], len(rig.axes), axis=1) for air in AIRS)
        ends = np.cumsum([record.time[-1] for record in likelihood.records])
        first_logs = likelihood.records[: 1 + int(np.searchsorted(ends, FIRST_FLIGHT))]
        few = replace(likelihood, records=tuple(record.beginning(FIRST_FLIGHT) for record in first_logs))
        if (likelihood.counts & ~few.counts).any():  # an axis rests at first
            few = likelihood
        start = _join_airs([_descend(few, fields, [few.neutral_point(first, z)], ROUGHLY, False) for z in airs])
    points = [start.point] if other is None else [start.point, other]
    points = [replace(p, parameters=rig.assign(p.parameters, shapes or {})) for p in points]
    return _descend(likelihood, fields, points, ROUGHLY if value_only else CONVERGED, new and not value_only)


def _join_airs(fits: Sequence[Fit]) -> Fit:
    """Take for each axis the air of the fit that explains it best, and the coordinates that this axis determines most.

    Fits are compared by their evidence F + ln det(H)/2 over the air of the axis (Laplace; MacKay 1992): air that swirls
    fits chance as well, but only in a small part of the range of its prior.
    """
    least = min(fits, key=lambda fitted: fitted.value)
    a, P, evidence = len(least.sigma), len(least.x), list[Array]()
    for fitted in fits:
        of_air = fitted.quadratic.total[0][P:, P:].reshape(SHAPES, a, SHAPES, a)
        log_det = np.linalg.slogdet(np.moveaxis(np.diagonal(of_air, axis1=1, axis2=3), 2, 0))[1]
        evidence.append(fitted.likelihood.compare_airs(fitted.point, fitted.e, [fitted.point.z])[0] + 0.5 * log_det)
    best = np.argmin(evidence, axis=0)
    x = np.choose(best[least.quadratic.information[:, :P].argmax(0)], [fitted.x for fitted in fits])
    z = np.choose(best, [fitted.point.z for fitted in fits])
    per_log = least.point.per_log.copy()
    per_log[:, : 5 * a] = np.choose(np.tile(best, 5), [fitted.point.per_log[:, : 5 * a] for fitted in fits])
    return Fit.at(least.likelihood, least.coordinates, x, replace(least.point, z=z, per_log=per_log))


def _coordinates_of(
    likelihood: Likelihood, fields: Sequence[str], parameters: Parameters
) -> tuple[tuple[Coordinate, ...], Array]:
    """Return the coordinates of some parameters and faults, and their values x (P,) for a plant and a likelihood."""
    rig, faults = likelihood.rig, {fault.field: fault for fault in FAULTS}
    coordinates = [rig.coordinate(name, parameters) for name in fields if name not in faults]
    x = [c.coordinate(rig.read(parameters, c.field)) for c in coordinates]
    estimated = [faults[name] for name in fields if name in faults]
    coordinates += map(Coordinate.of_fault, estimated)
    x += [Coordinate.of_fault(fault).coordinate(likelihood.faults.get(fault, 0.0)) for fault in estimated]
    return tuple(coordinates), np.array(x)


def _descend(
    likelihood: Likelihood, fields: Sequence[str], points: Sequence[Point], least: float, scan: bool = True
) -> Fit:
    """Descend from the likeliest of some points until a step lowers F by less than ``least``, and no ``scan`` helps."""
    points = [replace(p, z=np.clip(p.z, LOWEST, FARTHEST), per_log=likelihood.pad_per_log(p.per_log)) for p in points]
    starts = [Fit.at(likelihood, *_coordinates_of(likelihood, fields, p.parameters), p) for p in points]
    now = min(starts, key=lambda start: start.value)
    lowest = np.repeat(LOWEST, now.point.z.shape[1])
    for _ in range(ITERATIONS if np.isfinite(now.value) else 0):  # a plant may diverge without an effect that it lacks
        z, (H, g) = now.point.z.ravel(), now.quadratic.total
        low, high = now.bounds
        low, high = np.concatenate((low - now.x, lowest - z)), np.concatenate((high - now.x, FARTHEST - z))
        s = bounded_step(H, g, np.maximum(low, -LARGEST_STEP), np.minimum(high, LARGEST_STEP))
        predicted = -(g @ s + 0.5 * s @ H @ s) + now.quadratic.per_log_fall
        step = now.take_step(s) if predicted >= least else None
        if step is not None:
            fall, now = now.value - step.value, step
            if fall > least and (predicted > 1.0 or abs(predicted - fall) > CONVERGED):  # else F is quadratic here
                continue
        better = now.scan_air() if scan else None
        if better is None:
            break
        now = better
    return now


def known_fit(likelihood: Likelihood, fields: Sequence[str], point: Point, sigma: Array) -> Fit:
    """Return the fit of ``fields`` whose result is known: a plant, its air, and scales ``sigma`` (a,) [rad]."""
    return replace(Fit.at(likelihood, *_coordinates_of(likelihood, fields, point.parameters), point), sigma=sigma)


def fit_per_log(likelihood: Likelihood, point: Point, sigma: Array) -> Fit:
    """Fit the per-log parameters alone: plant, air and scales ``sigma`` (a,) [rad] are known."""
    fitted = known_fit(likelihood, (), point, sigma)
    for _ in range(ROUNDS):
        if fitted.quadratic.per_log_fall < CONVERGED:
            break
        per_log = fitted.point.per_log + np.array([c for c, _ in fitted.quadratic.per_log_steps])
        fitted = known_fit(likelihood, (), replace(fitted.point, per_log=per_log), sigma)
    return fitted


def fit_log_spread(fitted: Fit) -> Fit:
    """Estimate how much torques, gains and zeros differ from log to log, and fit again with that.

    tau^2 = (nu s^2 + sum_l E (b_l - mean b)^2) / (nu + L - 3) on every axis, with the prior (nu, s): the mean of the
    scaled inverse chi-squared posterior, as its mode gives too narrow intervals of the gains where logs are few (Gelman
    et al., Bayesian Data Analysis, 3rd ed., section 2.6). The mean over the logs is taken off, because the plant has to
    explain it. A single log keeps the width of its gains, as it says nothing of their spread.
    """
    nu, *s = PER_LOG_PRIOR
    a, b, widths = len(fitted.likelihood.rig.axes), fitted.point.per_log, fitted.likelihood.widths.copy()
    variances = np.diagonal(fitted.quadratic.covariance, axis1=1, axis2=2).sum(0)
    squares = ((b - b.mean(0)) ** 2).sum(0) + (1.0 - 1.0 / len(b)) * variances
    torques, gains, zeros = slice(0, a), slice(3 * a, 4 * a), slice(4 * a, 5 * a)
    for size, part in zip(s, (torques, gains, zeros), strict=True):
        if len(b) > 1 or part != gains:
            widths[part] = np.sqrt((nu * size**2 + squares[part]) / max(nu + len(b) - 3.0, 1.0))
    return fit(replace(fitted.likelihood, widths=widths), fitted.names, fitted)


def covariance(fitted: Fit) -> Array:
    """Covariance (P, P) of the plant's coordinates.

    A coordinate at a bound does not move the others; its variance is the one without the bound.
    """
    P, (H, _) = len(fitted.fields), fitted.quadratic.total
    free = np.flatnonzero(np.append(~fitted.at_bound, np.ones(len(H) - len(fitted.x), dtype=bool)))
    C = np.diag(np.diag(np.linalg.inv(H)))
    C[np.ix_(free, free)] = np.linalg.inv(H[np.ix_(free, free)])
    return C[:P, :P]
