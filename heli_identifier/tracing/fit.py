"""The fit: Gauss-Newton on the criterion between bounds, from calm and swirling air against local optima.

The plant's coordinates x, the air's z and what the logs have of their own, b, move together. A step is at most
:data:`.settings.LARGEST_STEP` widths of a prior and is halved where F grows. A first fit begins with the first
:data:`.settings.COARSE` s of flight in each of the airs :data:`.settings.AIRS`, and every axis goes on from the better.
Once a step brings nothing more, the air of every axis is tried on a coarse grid around where it is; the fit goes on
from there where F falls.
"""

from collections.abc import Callable, Mapping, Sequence
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
    ITERATIONS,
    LARGEST_STEP,
    NOISE_WIDTH,
    OWN_PRIOR,
    ROUGHLY,
    ROUNDS,
)


@dataclass(frozen=True, eq=False)
class Fit:
    """A plant fitted to the records of a rig, or on the way to it."""

    likelihood: Likelihood
    coordinates: tuple[Coordinate, ...]
    """What is estimated, P of them, the sizes of faults last."""
    x: Array
    """Shape (P,)."""
    point: Point
    sigma: Array
    """Scales of the innovations [rad], shape (a,)."""
    value: float
    """F [nats]."""

    @classmethod
    def at(cls, likelihood: Likelihood, coordinates: tuple[Coordinate, ...], x: Array, point: Point) -> "Fit":
        """Go to where the plant and the faults have the coordinates ``x`` (P,)."""
        values, faults = dict[str, float](), dict(likelihood.faults)
        for c, v in zip(coordinates, x, strict=True):
            values |= c.assigned(float(v))
            if c.fault is not None:
                faults[c.fault] = c.value(float(v))
        likelihood = likelihood.undo_faults(faults) if faults != likelihood.faults else likelihood
        point = replace(point, parameters=likelihood.rig.assign(point.parameters, values))
        of_axes, sigma = likelihood.of_axes(likelihood.run_all(point)[0])
        value = float((of_axes + likelihood.volume(point, sigma)).sum()) + likelihood.priors(x, point)
        return cls(likelihood, coordinates, x, point, sigma, value)

    @property
    def e(self) -> list[Array]:
        """Innovations [rad] of every record, as of :meth:`.Likelihood.run_all`."""
        return self.likelihood.run_all(self.point)[0]

    @cached_property
    def quadratic(self) -> Quadratic:
        """Quadratic form of F."""
        return linearise(self.likelihood, self.point, self.coordinates, self.x, self.sigma)

    @property
    def hessian(self) -> Array:
        """Hessian of F (n, n) for a step: innovations are about linear in exp(-k h) of an encoder, and not in ln k."""
        H, g = self.quadratic.total[0].copy(), self.quadratic.g.sum(0)
        k = np.arange(len(H))[-len(self.sigma) :]
        kh = self.likelihood.rig.air(self.point.z)[-1] * self.likelihood.records[0].step
        H[k, k] += np.maximum(0.0, NOISE_WIDTH[-1] * (1.0 - kh) * g[k])
        return H

    @cached_property
    def inverse(self) -> Array:
        """Inverse Hessian (n, n) of F with coordinates at a bound held."""
        H, _ = self.quadratic.total
        free = np.concatenate((~self.at_bound, np.ones(len(H) - len(self.x), dtype=bool)))
        found = np.zeros_like(H)
        found[np.ix_(free, free)] = np.linalg.inv(H[np.ix_(free, free)])
        return found

    @cached_property
    def dispersion(self) -> tuple[Array, Array]:
        """Variances of the scores over those of the model, [H^-1 V H^-1]_jj / [H^-1]_jj, shape (n,) each.

        V is the sum of squares of the scores of blocks of :data:`.settings.BLOCK` s, and V_L that of whole logs: what
        differs from log to log beyond what logs have of their own (a cable that lies otherwise, a drift of the air) is
        no noise of a block. V_L of L logs is known badly: the blocks' V counts in it as one log more; a single log
        tells nothing of it. Sources: Huber 1967; White 1982; Liang and Zeger 1986 (clusters).
        """
        inverse, of_blocks = self.inverse, [own.sum(1) for own in self.quadratic.blocks]
        model = np.maximum(np.diag(inverse), 1e-300)
        V = np.asarray(((inverse @ np.concatenate(of_blocks).T) ** 2).sum(1) / model)
        if (logs := len(of_blocks)) == 1:
            return V, V
        squares = ((inverse @ np.array([own.sum(0) for own in of_blocks]).T) ** 2).sum(1) / model
        return V, np.asarray((squares * logs / (logs - 1) * logs + V) / (logs + 1))

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
        """Names of all that was estimated: parameters of the plant, then sizes of faults of the logs."""
        return tuple(coordinate.field for coordinate in self.coordinates)

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the plant's parameters that were estimated."""
        return tuple(coordinate.field for coordinate in self.coordinates if coordinate.fault is None)

    @property
    def counts(self) -> NDArray[np.bool_]:
        """Whether any sample of each axis counted, shape (a,)."""
        return np.asarray(sum(record.weights.sum(0) for record in self.likelihood.records) > 0.0)

    def estimate(self, name: str) -> float:
        """Give the value of a parameter as the rig reads it: of a gain the slope, of a_1 what is beyond the lift."""
        return self.likelihood.rig.read(self.parameters, name)

    def slope(self, name: str) -> float:
        """Give abs(dp/dx) of a parameter where it is, in its unit."""
        i = self.fields.index(name)
        return self.coordinates[i].slope(self.coordinates[i].value(self.x[i]))

    def gradient(self, read: Callable[[Parameters], float]) -> Array:
        """Give the derivative (P,) of a number that is read off the plant by the coordinates of :attr:`fields`."""
        rig, found = self.likelihood.rig, np.empty(len(self.fields))
        for i in range(len(found)):
            c, x = self.coordinates[i], self.x[i]
            low, high = (read(rig.assign(self.parameters, c.assigned(x + d))) for d in (-1e-4, 1e-4))
            found[i] = (high - low) / 2e-4
        return found

    def air(self) -> Array:
        """Give level [rad/s^2], c, f [1/s], psi [rad] and k [1/s] of every axis, shape (5, a).

        The level is the standard deviation of what lasts 1/:data:`.settings.SEEN_AT`: what is shorter moves no bench.
        """
        found, record = self.likelihood.rig.air(self.point.z), self.likelihood.records[0]
        own = self.likelihood.filters(record, self.point)
        lasting = [max(np.linalg.matrix_power(axis.F, record.held)[0, 0], 0.0) for axis in own]
        return np.vstack((found[0] * self.encoder_noise() * np.sqrt(lasting), found[1:]))

    def encoder_noise(self) -> Array:
        """Give the standard deviation r [rad] of the encoders' noise, shape (a,)."""
        own = self.likelihood.filters(self.likelihood.records[0], self.point)
        return np.asarray(self.sigma / np.sqrt([axis.S for axis in own]))

    def take_step(self, s: Array) -> "tuple[Fit, float] | None":
        """Go a step ``s`` (n,), halved until F falls, and give the share of it; None if it does not fall by enough.

        Where F rises it is about a parabola along the step, which tells its lowest value: (share slope)^2 / (4 bend)
        below the start.
        """
        P, shape = len(self.x), self.point.z.shape
        share = min(1.0, LARGEST_STEP / max(float(np.abs(s[:P]).max(initial=0.0)), 1e-12))
        slope = float(self.quadratic.total[1] @ s) - 2.0 * self.quadratic.by_own
        for _ in range(ROUNDS):
            taken = share * s
            own = self.point.own + np.array([share * c - D @ taken for c, D in self.quadratic.back])
            point = replace(self.point, z=self.point.z + taken[P:].reshape(shape), own=own)
            there = self.at(self.likelihood, self.coordinates, np.clip(self.x + taken[:P], *self.bounds), point)
            if there.value < self.value:
                return there, share
            bend = there.value - self.value - share * slope
            if -slope * share > 0.1 * bend and (share * slope) ** 2 < 4.0 * bend * CONVERGED:
                return None
            share *= 0.5
        return None

    def scan_air(self) -> "Fit | None":
        """Move the air of every axis to the best of a coarse grid; None if F does not fall by enough to go on."""
        z = self.point.z
        airs = [z, *(np.clip(z + np.array(move)[:, None], LOWEST, FARTHEST) for move in AIR_SCAN)]
        best = self.likelihood.in_airs(self.point, self.e, airs).argmin(0)
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
    shapes: Mapping[str, float] | None = None, value_only: bool = False, others: Sequence[Point] = (),
) -> Fit:  # fmt: skip
    """Fit a plant to the records of a rig.

    Estimated are the parameters and faults ``fields``. Other parameters keep the values of ``start``, or what the rig
    is given as; other faults of the likelihood stay undone as they are. ``shapes`` are values of parameters to begin
    from. With ``value_only`` F alone is asked for: the fit is a rough one, from the air of ``start``. Where one of the
    ``others`` is likelier the fit begins there.
    """
    rig, new = likelihood.rig, start is None or not set(fields) <= set(start.names)
    if start is None:
        coordinates, x = _coordinates_of(likelihood, fields, rig.estimate(likelihood.records))
        within = np.clip(x, -FARTHEST, FARTHEST).tolist()  # a step is at most some widths of a prior
        first = rig.assign(rig.parameters, {c.field: c.value(v) for c, v in zip(coordinates, within, strict=True)})
        beginning = replace(likelihood, records=likelihood.beginning)
        airs = (np.repeat(np.array(air)[:, None], len(rig.axes), axis=1) for air in AIRS)
        start = _join_airs([_descend(beginning, fields, [beginning.resting(first, z)], ROUGHLY, False) for z in airs])
        start = replace(start, point=replace(start.point, own=likelihood.fill(start.point.own)))
    points = [replace(own, parameters=rig.assign(own.parameters, shapes or {})) for own in (start.point, *others)]
    return _descend(likelihood, fields, points, ROUGHLY if value_only else CONVERGED, new and not value_only)


def _join_airs(begun: Sequence[Fit]) -> Fit:
    """Take from the fit that explains an axis best its air, and the coordinates that this axis tells most of.

    Fits are compared by their evidence F + ln det(H)/2 over the air of the axis (Laplace; MacKay 1992): air that swirls
    fits chance as well, but only in a small part of what its prior allows.
    """
    least = min(begun, key=lambda fitted: fitted.value)
    a, P, evidence = len(least.sigma), len(least.x), list[Array]()
    for fitted in begun:
        of_air = fitted.quadratic.total[0][P:, P:].reshape(SHAPES, a, SHAPES, a)
        volume = np.linalg.slogdet(np.moveaxis(np.diagonal(of_air, axis1=1, axis2=3), 2, 0))[1]
        evidence.append(fitted.likelihood.in_airs(fitted.point, fitted.e, [fitted.point.z])[0] + 0.5 * volume)
    best = np.argmin(evidence, axis=0)
    telling = best[least.quadratic.information[:, :P].argmax(0)]
    x = np.choose(telling, [fitted.x for fitted in begun])
    z = np.choose(best, [fitted.point.z for fitted in begun])
    own = least.point.own.copy()
    own[:, : 5 * a] = np.choose(np.tile(best, 5), [fitted.point.own[:, : 5 * a] for fitted in begun])
    return Fit.at(least.likelihood, least.coordinates, x, replace(least.point, z=z, own=own))


def _coordinates_of(
    likelihood: Likelihood, fields: Sequence[str], parameters: Parameters
) -> tuple[tuple[Coordinate, ...], Array]:
    """Give the coordinates of some parameters and faults, and where (P,) a plant and the likelihood have them."""
    rig, faults = likelihood.rig, {fault.field: fault for fault in FAULTS}
    coordinates = [rig.coordinate(name, parameters) for name in fields if name not in faults]
    x = [c.coordinate(rig.read(parameters, c.field)) for c in coordinates]
    wrong = [faults[name] for name in fields if name in faults]
    coordinates += map(Coordinate.of_fault, wrong)
    x += [Coordinate.of_fault(fault).coordinate(likelihood.faults.get(fault, 0.0)) for fault in wrong]
    return tuple(coordinates), np.array(x)


def _descend(
    likelihood: Likelihood, fields: Sequence[str], points: Sequence[Point], least: float, scan: bool = True
) -> Fit:
    """Fit from the likeliest of some points until F falls by less than ``least`` by a step, and by no ``scan``."""
    starts = [replace(p, z=np.clip(p.z, LOWEST, FARTHEST), own=likelihood.fill(p.own)) for p in points]
    begun = [Fit.at(likelihood, *_coordinates_of(likelihood, fields, own.parameters), own) for own in starts]
    now = min(begun, key=lambda own: own.value)
    point = now.point
    (low, high), lowest = now.bounds, np.repeat(LOWEST, point.z.shape[1])
    reach, moved = np.ones(point.z.size), np.zeros(point.z.size)  # of the air: shorter where it swings
    for _ in range(ITERATIONS):
        z, H, g = now.point.z.ravel(), now.hessian, now.quadratic.total[1]
        s = bounded_step(
            H, g, np.concatenate((low - now.x, np.maximum(-reach, lowest - z))),
            np.concatenate((high - now.x, np.minimum(reach, FARTHEST - z))),
        )  # fmt: skip
        promised = -(g @ s + 0.5 * s @ H @ s) + now.quadratic.by_own
        step = now.take_step(s) if promised >= least else None
        if step is not None:
            fall, far = now.value - step[0].value, promised > 1.0 or step[1] < 1.0
            now, last, moved = step[0], moved, step[0].point.z.ravel() - z
            reach = np.where(moved * last < 0.0, 0.5 * reach, np.minimum(1.5 * reach, 1.0))
            if fall > least and (far or abs(promised - fall) > CONVERGED):  # else the quadratic form is F's own
                continue
        better = now.scan_air() if scan else None
        if better is None:
            break
        now = better
    return now


def around(likelihood: Likelihood, fields: Sequence[str], point: Point, sigma: Array) -> Fit:
    """Take a plant, its air and the scales ``sigma`` (a,) [rad] as known; a fit would estimate ``fields``."""
    return replace(Fit.at(likelihood, *_coordinates_of(likelihood, fields, point.parameters), point), sigma=sigma)


def fit_own(likelihood: Likelihood, point: Point, sigma: Array) -> Fit:
    """Fit what logs have of their own to a plant, an air and scales ``sigma`` (a,) [rad] that are known."""
    fitted = around(likelihood, (), point, sigma)
    for _ in range(ROUNDS):
        if fitted.quadratic.by_own < CONVERGED:
            break
        own = fitted.point.own + np.array([c for c, _ in fitted.quadratic.back])
        fitted = around(likelihood, (), replace(fitted.point, own=own), sigma)
    return fitted


def fit_own_spread(fitted: Fit) -> Fit:
    """Estimate how much torques, gains and zeros differ from log to log, and fit again with that.

    tau^2 = (nu s^2 + sum_l E (b_l - mean b)^2) / (nu + L - 3) on every axis, with what is known beforehand (nu, s): the
    mean of the scaled inverse chi-squared posterior, as its mode gives too narrow intervals of the gains where logs are
    few (Gelman et al., Bayesian Data Analysis, 3rd ed., section 2.6). What the logs have in common is none of their
    own, and a plant has to name it; all of a single log's torques and zeros is, and nothing is known of its gains.
    """
    nu, *s = OWN_PRIOR
    a, own, widths = len(fitted.likelihood.rig.axes), fitted.point.own, fitted.likelihood.widths.copy()
    unsure = np.diagonal(fitted.quadratic.covariance, axis1=1, axis2=2).sum(0)
    squares = ((own - own.mean(0)) ** 2).sum(0) + (1.0 - 1.0 / len(own)) * unsure
    torques, gains, zeros = slice(0, a), slice(3 * a, 4 * a), slice(4 * a, 5 * a)
    for size, part in zip(s, (torques, gains, zeros), strict=True):
        if len(own) > 1 or part != gains:
            widths[part] = np.sqrt((nu * size**2 + squares[part]) / max(nu + len(own) - 3.0, 1.0))
    return fit(replace(fitted.likelihood, widths=widths), fitted.names, fitted)


def covariance(fitted: Fit) -> Array:
    """Covariance (P, P) of the plant's coordinates.

    A coordinate at a bound moves nothing else, and its variance is that without the bound.
    """
    P = len(fitted.fields)
    found, bound = fitted.inverse[:P, :P].copy(), np.flatnonzero(fitted.at_bound[:P])
    found[bound, bound] = np.diag(np.linalg.inv(fitted.quadratic.total[0]))[bound]
    return found
