"""The quadratic problem around a fit, out of which the fit of every subset of fields and blocks is made.

Around the coordinates x_0 of a fit the loss of block b is, up to a constant, half of

    - 2 h_b' x + x' G_b x,    G_b = J_b' W J_b,    h_b = G_b x_0 - J_b' W e_b,

summed over the starts in the block, the horizons and the axes. The errors e are those of predictions that know nothing
of their log's offsets, as on a new log: what differs from log to log is noise between blocks here. A field that is left
out has the coordinate 0. With N = sum_b G_b + I, the scores r_b = h_b - G_b x of the fit x, n independent observations
and k effective parameters,

    M = n / (n - k) sum_b r_b r_b',    V = N^-1 M N^-1

are the scores' covariance and the fit's sandwich covariance (White 1980). Blocks are pieces of some seconds. Variances
are raised to two others where those are larger. The first is the dispersed posterior, tr(N^-1 M) / k N^-1: few blocks
may agree by chance. The second is the sandwich over whole records (Liang and Zeger 1986), with L records

    M = L / (L - 1) sum_l r_l r_l',    r_l = sum of r_b over the blocks of record l.

What differs from log to log, such as where the cable lies, is alike in all pieces of a log: pieces alone would count
it as often as the log has pieces.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.multistep.fit import MultistepFit
from heli_identifier.tracing.multistep.problem import overlap_weights
from heli_identifier.tracing.multistep.robust import weights

PAIRS = 25
"""Pairs of halves: the share in which an effect is found is known within .07."""

SEED = 0
"""Of the halves: the same logs give the same answer."""

FOLDS = 10
"""Parts of a single record that are predicted by fits to the rest of it."""

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
    curvature : NDArray, shape (B, A, P, P)
        G by block and axis.
    slope : NDArray, shape (B, A, P)
        h by block and axis.
    constant : NDArray, shape (B, A)
        Twice the loss at x = 0 by block and axis.
    records : NDArray, shape (B,)
        Number of the record that each block is a piece of.
    observations : float
        n, starts by axis and horizon, each counted by what one of the overlapping predictions is worth.
    lower, upper : NDArray, shape (P,)
        Bounds of the coordinates.
    own : slice or NDArray, shape (C,)
        Which of the blocks are the problem's own. Parts of a problem share its arrays: those of long logs are large.
    """

    curvature: NDArray[np.float64]
    slope: NDArray[np.float64]
    constant: NDArray[np.float64]
    records: NDArray[np.intp]
    observations: float
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    own: NDArray[np.intp] | slice = field(default_factory=lambda: slice(None))

    def solve(self, kept: NDArray[np.intp]) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        """Minimise losses and prior over the indices ``kept``, within bounds.

        Returns
        -------
        x : NDArray, shape (P,)
        free : NDArray, shape (F,)
            Indices of the coordinates on no bound.
        """
        N, h, free = self._matrix, self._slopes.sum(axis=0), kept
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
        block, every = np.ix_(free, free), self.summed
        scores = (every.slope[self.own, 0] - every.curvature[self.own, 0] @ x)[:, free]
        inverse, of_data = np.linalg.inv(self._matrix[block]), self._matrix - np.eye(len(self._matrix))
        count, effective = self.observations, float(np.trace(inverse @ of_data[block]))
        # scores at the optimum are too small by the share that the fit took from each observation
        noise = np.sqrt(count / max(count - effective, 1.0)) * scores @ inverse
        sandwich = noise.T @ noise
        posterior = inverse * np.trace(sandwich @ self._matrix[block]) / effective
        variances = np.maximum(np.diag(posterior), np.diag(sandwich))
        variances = np.maximum(variances, self._between_records(scores @ inverse))
        raised = np.sqrt(variances / np.diag(posterior))
        return SubsetFit(x, free, posterior * np.outer(raised, raised))

    def part(self, blocks: NDArray[np.intp]) -> "Quadratic":
        """Give the problem of some of its own blocks."""
        own = np.arange(len(self.records))[self.own]
        return replace(self, own=own[blocks], observations=len(blocks) / len(own) * self.observations)

    def losses(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Twice the loss (A,) of the axes at coordinates (P,)."""
        curvature, slope = self._curvatures, self._slopes
        return np.asarray(self.constant[self.own].sum(axis=0) + (curvature @ x - 2.0 * slope) @ x)

    @cached_property
    def summed(self) -> "Quadratic":
        """The same problem with its axes summed into one, whose parts are made faster."""
        if self.curvature.shape[1] == 1:
            return self
        curvature, slope, constant = (v.sum(axis=1, keepdims=True) for v in (self.curvature, self.slope, self.constant))
        return replace(self, curvature=curvature, slope=slope, constant=constant)

    @cached_property
    def halves(self) -> list["Quadratic"]:
        """Halves of the blocks in complementary pairs, one behind the other, their axes summed."""
        random, count = np.random.default_rng(SEED), len(self.records)
        orders = [random.permutation(count) for _ in range(PAIRS)]
        return [self.summed.part(half) for order in orders for half in np.array_split(order, 2)]

    @cached_property
    def folds(self) -> list[tuple["Quadratic", "Quadratic"]]:
        """The problem without a record, and that of the record alone; of a single record, its :data:`FOLDS` parts."""
        count = len(self.records)
        labels = self.records if len(np.unique(self.records)) > 1 else np.arange(count) * FOLDS // count
        parts = [self.part(np.flatnonzero(labels == label)) for label in np.unique(labels)]
        return [(self._without(part), part) for part in parts]

    def _without(self, part: "Quadratic") -> "Quadratic":
        """Give the problem less one of its parts, as a single block."""
        return replace(
            self,
            curvature=(self._curvatures - part._curvatures)[None],
            slope=(self._slopes - part._slopes)[None],
            constant=(self.constant.sum(axis=0) - part.constant[part.own].sum(axis=0))[None],
            records=np.zeros(1, dtype=np.intp),
            observations=self.observations - part.observations,
        )

    def _between_records(self, noise: NDArray[np.float64]) -> NDArray[np.float64]:
        """Variances (F,) of the fit from the noise (B, F) of its blocks summed over records; zero for one record."""
        numbers, labels = np.unique(self.records[self.own], return_inverse=True)
        if len(numbers) < 2:
            return np.zeros(noise.shape[1])
        total = np.zeros((len(numbers), noise.shape[1]))
        np.add.at(total, labels, noise)
        return np.asarray(len(numbers) / (len(numbers) - 1) * (total**2).sum(axis=0))

    @cached_property
    def _curvatures(self) -> NDArray[np.float64]:
        """G (A, P, P) by axis."""
        return np.asarray(self.curvature[self.own].sum(axis=0))

    @cached_property
    def _slopes(self) -> NDArray[np.float64]:
        """Slopes h (A, P) by axis."""
        return np.asarray(self.slope[self.own].sum(axis=0))

    @cached_property
    def _matrix(self) -> NDArray[np.float64]:
        return np.asarray(self._curvatures.sum(axis=0) + np.eye(self.curvature.shape[-1]))


def quadratic_of(fit: MultistepFit) -> Quadratic:
    """Sum a fit's quadratic problem over its pieces."""
    labels = fit.problem.pieces()
    P, B = len(fit.x), int(labels[-1].max()) + 1
    curvature, slope, constant = np.zeros((B, 3, P, P)), np.zeros((B, 3, P)), np.zeros((B, 3))
    records = np.zeros(B, dtype=np.intp)
    W = weights(fit.problem, fit.errors, fit.scales)
    for log, (J, at_offsets, w) in enumerate(zip(fit.jacobian, fit.errors, W, strict=True)):
        columns, e = J[..., :P], at_offsets - J[..., P:] @ fit.offsets[log]
        for b in np.unique(labels[log]):
            own = labels[log] == b
            records[b] = log
            for axis in range(3):
                X = columns[own, :, axis].reshape(-1, P)
                weight, error = w[own, :, axis].ravel(), e[own, :, axis].ravel()
                target = X @ fit.x - error
                curvature[b, axis] = X.T @ (weight[:, None] * X)
                slope[b, axis] = X.T @ (weight * target)
                constant[b, axis] = weight @ target**2
    observations = sum(float((~np.isnan(r.measured) * overlap_weights()[:, None]).sum()) for r in fit.problem.records)
    lower, upper = np.array([c.bounds for c in fit.fields]).T
    return Quadratic(curvature, slope, constant, records, observations, lower, upper)
