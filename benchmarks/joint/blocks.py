"""A fit's quadratic problem as sums of small matrices, out of which every subset, fold and resample is made.

Around the reference x_0 the loss of block b on axis a is, up to a constant, half of

    c_ba - 2 h_ba' x + x' G_ba x,    G_ba = J_b' W J_b,    h_ba = G_ba x_0 - J_b' W e_b,

summed over the starts in the block and the horizons of axis a. The errors e are those of predictions that know nothing
of their log's offsets, as on a new log: what differs from log to log is noise between blocks here. A field that is left
out has the coordinate 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.multistep.fit import MultistepFit
from heli_identifier.tracing.multistep.priors import prior_precision
from heli_identifier.tracing.multistep.problem import Multistep
from heli_identifier.tracing.multistep.robust import weights

INSIDE = 1e-9
"""Share of a prior's width by which a coordinate may overstep its bound in rounding."""


class Sample(NamedTuple):
    """Resamples of the blocks: slope (R, B, 3, P) and constant (R, B, 3); their curvature is the logs'."""

    slope: NDArray[np.float64]
    constant: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Blocks:
    """Quadratic losses of independent blocks.

    Attributes
    ----------
    reference : NDArray, shape (P,)
        x_0.
    curvature : NDArray, shape (B, 3, P, P)
        G by block and axis.
    slope : NDArray, shape (B, 3, P)
        h by block and axis.
    constant : NDArray, shape (B, 3)
        c by block and axis.
    precision : NDArray, shape (P, P)
        Q of the priors.
    lower, upper : NDArray, shape (P,)
        Bounds of the coordinates.
    """

    reference: NDArray[np.float64]
    curvature: NDArray[np.float64]
    slope: NDArray[np.float64]
    constant: NDArray[np.float64]
    precision: NDArray[np.float64]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]

    @property
    def count(self) -> int:
        """Number of blocks B."""
        return len(self.curvature)

    def solve(self, kept: NDArray[np.intp]) -> NDArray[np.float64]:
        """Coordinates (P,) that minimise losses and prior over the indices ``kept``, within bounds."""
        return self._bounded(kept)[0]

    def _bounded(self, kept: NDArray[np.intp]) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        """Solve, put on their bounds the coordinates that overstep them, solve the others again; also their indices."""
        G, h, free = self._curvature_sum, self._slope_sum, kept
        x = np.zeros(len(h))
        while len(free):
            # coordinates on a bound count with their value there, those left out are zero
            x[free] = 0.0
            x[free] = np.linalg.solve(G[np.ix_(free, free)], h[free] - G[free] @ x)
            inside = (x[free] >= self.lower[free] - INSIDE) & (x[free] <= self.upper[free] + INSIDE)
            if inside.all():
                break
            x[free] = np.clip(x[free], self.lower[free], self.upper[free])
            free = free[inside]
        return x, free

    def left_out_losses(self, kept: NDArray[np.intp], sample: "Sample | None" = None) -> NDArray[np.float64]:
        """Twice the loss (R, B, 3) of every block under a fit to all the others, in each of R resamples.

        Coordinates that lie on a bound in the fit to all measured blocks stay there. Without ``sample`` R is one, and
        the blocks are the measured ones.
        """
        sample = sample or Sample(self.slope[None], self.constant[None])
        bounded, free = self._bounded(kept)
        bounded[free] = 0.0
        G = self._curvature_sum - self._by_block
        of_block = sample.slope.sum(axis=2)
        h = of_block.sum(axis=1, keepdims=True) - of_block - G @ bounded
        x = np.empty((self.count, len(bounded), len(h)))
        x[...] = bounded[:, None]
        x[:, free] = np.linalg.solve(G[:, free[:, None], free], h.transpose(1, 2, 0)[:, free])
        x = np.clip(x, self.lower[:, None], self.upper[:, None])
        gradient = self.curvature @ x[:, None] - 2.0 * sample.slope.transpose(1, 2, 3, 0)
        return sample.constant + (gradient * x[:, None]).sum(axis=2).transpose(2, 0, 1)

    def resamples(self, count: int, random: np.random.Generator) -> "Sample":
        """Draw wild resamples: what the reference leaves of a block keeps its size and gets a sign drawn at random."""
        signs = random.choice((-1.0, 1.0), size=(count, self.count, 1, 1))
        fitted = self.curvature @ self.reference
        slope = fitted + signs * (self.slope - fitted)
        # the sum of the squared residuals at the reference, c - 2 h'x_0 + x_0'G x_0, is the same in every resample
        return Sample(slope, self.constant + 2.0 * (slope - self.slope) @ self.reference)

    def __post_init__(self) -> None:
        by_block = self.curvature.sum(axis=1)
        object.__setattr__(self, "_by_block", by_block)
        object.__setattr__(self, "_curvature_sum", by_block.sum(axis=0) + self.precision)
        object.__setattr__(self, "_slope_sum", self.slope.sum(axis=(0, 1)))

    _by_block: NDArray[np.float64] = None  # type: ignore[assignment]
    _curvature_sum: NDArray[np.float64] = None  # type: ignore[assignment]
    _slope_sum: NDArray[np.float64] = None  # type: ignore[assignment]


FEW_LOGS = 8
"""With fewer logs than this their pieces take the logs' place as independent blocks."""


def independent_blocks(problem: Multistep) -> list[NDArray[np.intp]]:
    """Give the number of the block of each start, one array a record: logs are blocks, or pieces of few logs."""
    if len(problem.records) < FEW_LOGS:
        return problem.pieces()
    return [np.full(len(starts.at), log) for log, starts in enumerate(problem.records)]


def blocks_of(fit: MultistepFit) -> Blocks:
    """Sum a fit's quadratic problem over its blocks, logs or pieces of them."""
    labels: Sequence[NDArray[np.intp]] = independent_blocks(fit.problem)
    P, B = len(fit.x), int(labels[-1].max()) + 1
    curvature, slope, constant = np.zeros((B, 3, P, P)), np.zeros((B, 3, P)), np.zeros((B, 3))
    W = weights(fit.problem, fit.errors, fit.scales)
    for log, (J, at_offsets, w) in enumerate(zip(fit.jacobian, fit.errors, W, strict=True)):
        columns, e = J[..., :P], at_offsets - J[..., P:] @ fit.offsets[log]
        for b in np.unique(labels[log]):
            own = labels[log] == b
            for axis in range(3):
                X = columns[own, :, axis].reshape(-1, P)
                weighted, error = X * w[own, :, axis].reshape(-1, 1), e[own, :, axis].ravel()
                G, g = weighted.T @ X, weighted.T @ error
                curvature[b, axis], slope[b, axis] = G, G @ fit.x - g
                left = float((w[own, :, axis].ravel() * error**2).sum())
                constant[b, axis] = left + 2.0 * slope[b, axis] @ fit.x - fit.x @ G @ fit.x
    lower, upper = np.array([c.bounds for c in fit.fields]).T
    return Blocks(fit.x, curvature, slope, constant, prior_precision(fit.fields), lower, upper)
