"""Standard errors that allow for the correlation that whitening leaves.

The sandwich (J'J)^-1 (sum over blocks s s') (J'J)^-1 with s = J_b' z_b over blocks of some seconds (Newey and West
1987; Hansen 2007), or the plain (J'J)^-1 where that is larger.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.whitening import Whitener

BLOCK_SECONDS = 4.0
"""Length [s] of the sandwich's blocks: several times the memory that a whitened residual can keep."""


def block_covariance(
    problem: Problem, whitener: Whitener, jacobian: NDArray[np.float64], white: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Sandwich covariance with blocks in time that span the three axes; infinite where a column is zero."""
    length = np.linalg.norm(jacobian, axis=0)
    silent = length == 0.0
    length = np.where(silent, 1.0, length)
    jacobian = jacobian / length  # equal lengths: otherwise the units decide which direction counts as zero
    inverse = np.linalg.pinv(jacobian.T @ jacobian)
    scores = block_membership(problem, whitener.order) @ (jacobian * white[:, None])
    small_sample = len(scores) / max(len(scores) - 1, 1)
    robust = inverse @ (scores.T @ scores) @ inverse * small_sample
    plain = inverse * float(white @ white) / max(len(white) - jacobian.shape[1], 1)
    widen = np.sqrt(np.maximum(np.diag(plain) / np.maximum(np.diag(robust), 1e-300), 1.0))
    covariance = robust * np.outer(widen, widen) / np.outer(length, length)
    covariance[silent, silent] = np.inf
    return covariance


def block_labels(problem: Problem, order: int) -> NDArray[np.intp]:
    """Label each whitened sample with the number of its time block, shape (M,)."""
    width = max(1, int(BLOCK_SECONDS * problem.reduced_rate))
    labels, first = [], 0
    for length in problem.lengths:
        own = np.arange(length - order) // width
        labels.append(own + first)
        first += int(own.max()) + 1
    return np.tile(np.concatenate(labels), 3)


def block_membership(problem: Problem, order: int) -> csr_array:
    """Sparse matrix (blocks, M) of ones where a whitened sample belongs to a block: its product sums over blocks."""
    labels = block_labels(problem, order)
    return csr_array((np.ones(len(labels)), (labels, np.arange(len(labels)))))
