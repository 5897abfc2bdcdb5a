"""The quadratic problem around a fit, out of which the fit of every subset of fields and blocks is made.

Around the coordinates x_0 of a fit the loss of block b is, up to a constant, half of

    - 2 h_b' x + x' G_b x,    G_b = J_b' W J_b,    h_b = G_b x_0 - J_b' W e_b,

summed over the starts in the block, the horizons and the axes. The errors e are those of predictions that know nothing
of their log's offsets, as on a new log: what differs from log to log is noise between blocks here. A field that is left
out has the coordinate 0. With N = sum_b G_b + I, the scores r_b = h_b - G_b x of the fit x, n independent observations
and k effective parameters,

    M = n / (n - k) sum_b r_b r_b',    V = N^-1 M N^-1

are the scores' covariance and the fit's sandwich covariance (White 1980). Variances below those of the dispersed
posterior, tr(N^-1 M) / k N^-1, are raised to them: few blocks may agree by chance. Blocks are pieces of some seconds.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.multistep.fit import MultistepFit
from heli_identifier.tracing.multistep.problem import overlap_weights
from heli_identifier.tracing.multistep.robust import weights

INSIDE = 1e-9
"""Share of a prior's width by which a coordinate may overstep its bound in rounding."""


@dataclass(frozen=True, eq=False)
class SubsetFit:
    """The fit of a subset of the coordinates.

    Attributes
    ----------
    x : NDArray, shape (P,)
        Coordinates; those left out are zero, some lie on a bound.
    free : NDArray, shape (F,)
        Indices of the coordinates that are fitted and on no bound.
    covariance : NDArray, shape (F, F)
        Of the free coordinates.
    """

    x: NDArray[np.float64]
    free: NDArray[np.intp]
    covariance: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Quadratic:
    """Quadratic losses of independent blocks.

    Attributes
    ----------
    curvature : NDArray, shape (B, P, P)
        G by block.
    slope : NDArray, shape (B, P)
        h by block.
    axis_curvature : NDArray, shape (3, P, P)
        G by axis, summed over blocks.
    axis_slope : NDArray, shape (3, P)
        h by axis.
    axis_constant : NDArray, shape (3,)
        Twice the loss at x = 0 by axis.
    observations : float
        n, starts by axis and horizon, each counted by what one of the overlapping predictions is worth.
    lower, upper : NDArray, shape (P,)
        Bounds of the coordinates.
    """

    curvature: NDArray[np.float64]
    slope: NDArray[np.float64]
    axis_curvature: NDArray[np.float64]
    axis_slope: NDArray[np.float64]
    axis_constant: NDArray[np.float64]
    observations: float
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]

    def solve(self, kept: NDArray[np.intp]) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        """Minimise losses and prior over the indices ``kept``, within bounds.

        Returns
        -------
        x : NDArray, shape (P,)
        free : NDArray, shape (F,)
            Indices of the coordinates on no bound.
        """
        N, h, free = self._matrix, self.slope.sum(axis=0), kept
        x = np.zeros(len(h))
        while len(free):
            # a coordinate that oversteps its bound is put there, and the others are solved again beside it
            x[free] = 0.0
            x[free] = np.linalg.solve(N[np.ix_(free, free)], h[free] - N[free] @ x)
            inside = (x[free] >= self.lower[free] - INSIDE) & (x[free] <= self.upper[free] + INSIDE)
            if inside.all():
                break
            x[free] = np.clip(x[free], self.lower[free], self.upper[free])
            free = free[inside]
        return x, free

    def fit(self, kept: NDArray[np.intp]) -> SubsetFit:
        """Fit the coordinates ``kept`` with their covariance."""
        x, free = self.solve(kept)
        own = np.ix_(free, free)
        inverse, scores = np.linalg.inv(self._matrix[own]), (self.slope - self.curvature @ x)[:, free]
        count, effective = self.observations, float(np.trace(inverse @ (self._matrix - np.eye(len(self._matrix)))[own]))
        # scores at the optimum are too small by the share that the fit took from each observation
        noise = np.sqrt(count / max(count - effective, 1.0)) * scores @ inverse
        sandwich = noise.T @ noise
        posterior = inverse * np.trace(sandwich @ self._matrix[own]) / effective
        variances = np.maximum(np.diag(posterior), np.diag(sandwich))
        raised = np.sqrt(variances / np.diag(posterior))
        return SubsetFit(x, free, posterior * np.outer(raised, raised))

    def part(self, blocks: NDArray[np.intp]) -> "Quadratic":
        """Give the problem of some of the blocks; the losses by axis stay those of all."""
        share = len(blocks) / len(self.slope)
        part = (self.curvature[blocks], self.slope[blocks])
        return replace(self, curvature=part[0], slope=part[1], observations=share * self.observations)

    def losses(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Twice the loss (3,) of the axes at coordinates (P,)."""
        return self.axis_constant + (self.axis_curvature @ x - 2.0 * self.axis_slope) @ x

    def own_loss(self, x: NDArray[np.float64]) -> float:
        """Twice the loss of the problem's own blocks at coordinates (P,), but for a constant."""
        return float((self.curvature.sum(axis=0) @ x - 2.0 * self.slope.sum(axis=0)) @ x)

    @cached_property
    def _matrix(self) -> NDArray[np.float64]:
        return self.curvature.sum(axis=0) + np.eye(self.curvature.shape[1])


def quadratic_of(fit: MultistepFit) -> Quadratic:
    """Sum a fit's quadratic problem over its pieces."""
    labels = fit.problem.pieces()
    P, B = len(fit.x), int(labels[-1].max()) + 1
    curvature, slope = np.zeros((B, P, P)), np.zeros((B, P))
    axis_curvature, axis_slope, axis_constant = np.zeros((3, P, P)), np.zeros((3, P)), np.zeros(3)
    W = weights(fit.problem, fit.errors, fit.scales)
    for log, (J, at_offsets, w) in enumerate(zip(fit.jacobian, fit.errors, W, strict=True)):
        columns, e = J[..., :P], at_offsets - J[..., P:] @ fit.offsets[log]
        for b in np.unique(labels[log]):
            own = labels[log] == b
            for axis in range(3):
                X = columns[own, :, axis].reshape(-1, P)
                weight, error = w[own, :, axis].ravel(), e[own, :, axis].ravel()
                target = X @ fit.x - error
                G, h = X.T @ (weight[:, None] * X), X.T @ (weight * target)
                curvature[b] += G
                slope[b] += h
                axis_curvature[axis] += G
                axis_slope[axis] += h
                axis_constant[axis] += weight @ target**2
    observations = sum(float((~np.isnan(r.measured) * overlap_weights()[:, None]).sum()) for r in fit.problem.records)
    lower, upper = np.array([c.bounds for c in fit.fields]).T
    return Quadratic(curvature, slope, axis_curvature, axis_slope, axis_constant, observations, lower, upper)
