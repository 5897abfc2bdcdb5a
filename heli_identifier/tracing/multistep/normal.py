"""Normal equations of a multi-step fit: curvature, steps between bounds, and a covariance that covers.

With J_l = [J, J_o] the derivatives of log l's errors by coordinates x and its offsets, W its weights and e its errors,

    N = sum_l J_l' W J_l + D,    g = sum_l J_l' W e + D (x, o),    D = diag(I, T),

the unit matrix and T the precisions of the coordinates' and the offsets' priors. With the scores g_b = J_b' W e_b of B
independent blocks b and k = tr(N^-1 (N - D)) effective parameters, M = B / (B - k) sum_b g_b g_b' is the scores'
covariance (Hansen 2007) and phi = tr(N^-1 M) / k the dispersion of the errors over what W says. The variances of x are
the larger of the posterior's, ((N - D) / phi + D)^-1 with what differs from log to log, and the sandwich's,
N^-1 M N^-1.
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
    prior : NDArray, shape (P + 4 L, P + 4 L)
        D.
    offsets : NDArray, shape (L, 4)
        o, where N and g were taken.
    """

    matrix: NDArray[np.float64]
    gradient: NDArray[np.float64]
    count: int
    scores: NDArray[np.float64]
    prior: NDArray[np.float64]
    offsets: NDArray[np.float64]

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
    def offset_variances(self) -> NDArray[np.float64]:
        """Posterior variances (L, 4) of the offsets."""
        return np.diag(np.linalg.inv(self.matrix))[self.count :].reshape(-1, 4)

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance (P, P) of the coordinates: posterior under the observed dispersion, or sandwich if wider."""
        inverse, blocks = np.linalg.inv(self.matrix), len(self.scores)
        of_data = self.matrix - self.prior
        parameters = float(np.trace(inverse @ of_data))
        # scores at the optimum are too small by the share that the fit took from each block
        meat = self.scores.T @ self.scores * blocks / max(blocks - parameters, 1.0)
        dispersion = float(np.trace(inverse @ meat)) / parameters
        posterior = np.linalg.inv(of_data / dispersion + self.prior)[: self.count, : self.count] + self._between_logs
        robust = np.diag(inverse @ meat @ inverse)[: self.count]
        widen = np.sqrt(np.maximum(robust / np.diag(posterior), 1.0))
        return posterior * np.outer(widen, widen)

    @property
    def _between_logs(self) -> NDArray[np.float64]:
        """Covariance (P, P) of the coordinates by offsets that differ from log to log.

        Without offsets log l would move the coordinates by N_xx^-1 N_xo o_l. The mean over a few logs is not that of
        the rig: it varies by the sum of the squares of these moves. A single log tells nothing of that.
        """
        logs = len(self.offsets)
        if logs == 1:
            return np.zeros((self.count, self.count))
        blocks = self.matrix[: self.count, self.count :].reshape(self.count, logs, -1)
        moves = np.linalg.solve(self.matrix[: self.count, : self.count], np.einsum("plo,lo->pl", blocks, self.offsets))
        return np.asarray(moves @ moves.T * logs / (logs - 1), dtype=np.float64)


def normal_equations(
    jacobian: Sequence[NDArray[np.float64]],
    errors: Sequence[NDArray[np.float64]],
    weights: Sequence[NDArray[np.float64]],
    x: NDArray[np.float64],
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
    prior = np.zeros((size, size))
    prior[:common, :common] = np.eye(common)
    prior[common:, common:] = offset_precision(spreads, len(offsets))
    gradient += prior @ np.concatenate((x, offsets.ravel()))
    return NormalEquations(matrix + prior, gradient, common, scores, prior, offsets)


def offset_precision(spreads: NDArray[np.float64], logs: int) -> NDArray[np.float64]:
    """Precision (4 L, 4 L) of the offsets: each has the spread tau, and their mean over the logs is held at zero.

    What all logs share is the model's to explain: offsets that were free to have a mean would hide a constant torque.
    """
    return np.kron(np.eye(logs) + np.full((logs, logs), HELD_MEAN / logs), np.diag(1.0 / spreads**2))
