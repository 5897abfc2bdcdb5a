"""Normal equations of a multi-step fit: curvature, steps between bounds, and a covariance that covers.

With J_l = [J, J_o] the derivatives of log l's errors by coordinates x and its offsets, W its weights and e its errors,

    N = sum_l J_l' W J_l + D,    g = sum_l J_l' W e + D (x, o),    D = diag(Q, T),

Q and T the precisions of the coordinates' and the offsets' priors. The variances of x are the larger of the
posterior's, N^-1, and those of the sandwich N^-1 (sum_b g_b g_b') N^-1 over independent blocks b with the scores
g_b = J_b' W e_b (Hansen 2007).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

HELD_MEAN = 1e6
"""Precision of the offsets' mean over that of one offset."""


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """N and g, and where blocks were asked for the covariance.

    Attributes
    ----------
    matrix : NDArray, shape (P + 4 L, P + 4 L)
    gradient : NDArray, shape (P + 4 L,)
    count : int
        P, number of common coordinates.
    scores : NDArray, shape (B, P + 4 L)
        J' W e of each block.
    """

    matrix: NDArray[np.float64]
    gradient: NDArray[np.float64]
    count: int
    scores: NDArray[np.float64]

    def step(
        self, damping: float, at_lower: NDArray[np.bool_], at_upper: NDArray[np.bool_]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Damped step of coordinates (P,) and offsets (L, 4); a coordinate that its bound holds does not move."""
        held = np.zeros(len(self.gradient), dtype=bool)
        held[: self.count] = (at_lower & (self.gradient[: self.count] > 0.0)) | (
            at_upper & (self.gradient[: self.count] < 0.0)
        )
        free = np.flatnonzero(~held)
        matrix = self.matrix[np.ix_(free, free)]
        step = np.zeros(len(self.gradient))
        step[free] = -np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), self.gradient[free])
        return step[: self.count], step[self.count :].reshape(-1, 4)

    def promised(self, step: NDArray[np.float64], offset_step: NDArray[np.float64]) -> float:
        """Gain that a step promises by the quadratic model."""
        whole = np.concatenate((step, offset_step.ravel()))
        return -float(self.gradient @ whole + 0.5 * whole @ self.matrix @ whole)

    @property
    def posterior(self) -> NDArray[np.float64]:
        """Covariance (P, P) of the coordinates if the weights are right: N^-1."""
        return np.asarray(np.linalg.inv(self.matrix), dtype=np.float64)[: self.count, : self.count]

    @property
    def offset_variances(self) -> NDArray[np.float64]:
        """Posterior variances (L, 4) of the offsets."""
        return np.diag(np.linalg.inv(self.matrix))[self.count :].reshape(-1, 4)

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance (P, P) of the coordinates: the posterior, widened where the sandwich over blocks is wider."""
        inverse = np.linalg.inv(self.matrix)
        blocks = len(self.scores)
        meat = self.scores.T @ self.scores * blocks / max(blocks - 1, 1)
        robust = np.diag(inverse @ meat @ inverse)[: self.count]
        plain = inverse[: self.count, : self.count]
        widen = np.sqrt(np.maximum(robust / np.diag(plain), 1.0))
        return plain * np.outer(widen, widen)


def normal_equations(
    jacobian: Sequence[NDArray[np.float64]],
    errors: Sequence[NDArray[np.float64]],
    weights: Sequence[NDArray[np.float64]],
    x: NDArray[np.float64],
    precision: NDArray[np.float64],
    offsets: NDArray[np.float64],
    spreads: NDArray[np.float64],
    blocks: Sequence[NDArray[np.intp]] | None = None,
) -> NormalEquations:
    """Assemble N and g from the records' arrays, whose shapes are those of a multi-step fit's attributes.

    ``blocks`` numbers the independent block of each start; without it no scores are kept.
    """
    common, per_log = len(x), len(spreads)
    size = common + offsets.size
    matrix = np.zeros((size, size))
    total = 0 if blocks is None else int(blocks[-1].max()) + 1
    scores, gradient = np.zeros((total, size)), np.zeros(size)
    for log, (J, e, W) in enumerate(zip(jacobian, errors, weights, strict=True)):
        own = np.concatenate((np.arange(common), common + per_log * log + np.arange(per_log)))
        columns, weighted = J.reshape(e.size, -1), J * W[..., None]
        matrix[np.ix_(own, own)] += columns.T @ weighted.reshape(e.size, -1)
        by_start = np.einsum("shj,shjp->sp", e, weighted)
        gradient[own] += by_start.sum(axis=0)
        if blocks is not None:
            np.add.at(scores, (blocks[log][:, None], own[None, :]), by_start)
    matrix[:common, :common] += precision
    gradient[:common] += precision @ x
    of_offsets = offset_precision(spreads, len(offsets))
    matrix[common:, common:] += of_offsets
    gradient[common:] += of_offsets @ offsets.ravel()
    return NormalEquations(matrix, gradient, common, scores)


def offset_precision(spreads: NDArray[np.float64], logs: int) -> NDArray[np.float64]:
    """Precision (4 L, 4 L) of the offsets: each has the spread tau, and their mean over the logs is held at zero.

    What all logs share is the model's to explain: offsets that were free to have a mean would hide a constant torque.
    """
    return np.kron(np.eye(logs) + np.full((logs, logs), HELD_MEAN / logs), np.diag(1.0 / spreads**2))
