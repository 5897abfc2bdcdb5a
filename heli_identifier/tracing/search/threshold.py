"""Thresholds for the largest of many scores, from surrogates of the residual over the whole catalogue.

A surrogate residual is the whitened residual with the sign of every block of some seconds drawn at random (wild block
bootstrap): it keeps what correlation and changing variance the whitening left, and loses every relation to the
candidates. The threshold is the quantile of the largest admissible score over all candidates and their grids, and
never less than the same quantile for Gaussian white noise of unit variance. Scores are in units of their own standard
errors, so that one candidate whose score varies much does not set the level of all. Source: Westfall and Young 1993, on
max-type thresholds; Davidson and Flachaire 2008, on the wild bootstrap.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.prediction.covariance import block_membership
from heli_identifier.tracing.search.scan import Scan
from heli_plant.compiled import read_only

DRAWS = 4000
"""Surrogates: the .2 % quantile then rests on eight draws."""


def largest_scores(scan: Scan, seed: int = 0) -> NDArray[np.float64]:
    """Largest admissible score of each of :data:`DRAWS` surrogates, sorted, shape (DRAWS,).

    A candidate of which only one sign is admissible contributes with that sign only.
    """
    in_block = block_membership(scan.fit.problem, scan.fit.whitener.order)
    count = in_block.shape[0]
    sums = -(in_block @ (scan.directions * scan.white[:, None]))
    # what the candidate itself explains is not noise: each block loses its share of the score
    sums -= scan.scores * (in_block @ scan.directions**2)
    # in the units of the standard error with which an effect is accepted: the larger of the plain and the sandwich one
    sums /= np.maximum(np.sqrt((sums**2).sum(axis=0)), 1.0)
    one_sided = np.array([candidate.effect.lower >= 0.0 for candidate in scan.candidates])
    signs, noise = _draws(seed, count, scan.directions.shape[1])
    blocks, gaussian = signs @ sums, noise @ _root(scan.directions.T @ scan.directions).T
    return np.maximum(*(np.sort(_largest(draws, one_sided)) for draws in (blocks, gaussian)))


@lru_cache(maxsize=4)
def _draws(seed: int, blocks: int, candidates: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Signs (DRAWS, blocks) and standard normal numbers (DRAWS, candidates), made once for scans of a size."""
    random = np.random.default_rng(seed)
    signs = random.choice((-1.0, 1.0), size=(DRAWS, blocks))
    return read_only(signs), read_only(random.standard_normal((DRAWS, candidates)))


def _largest(draws: NDArray[np.float64], one_sided: NDArray[np.bool_]) -> NDArray[np.float64]:
    return np.where(one_sided, draws, np.abs(draws)).max(axis=1)


def _root(correlation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give A with A A' = correlation, for a singular one too."""
    values, vectors = np.linalg.eigh(correlation)
    return vectors * np.sqrt(np.maximum(values, 0.0))


def quantile(sorted_scores: NDArray[np.float64], probability: float) -> float:
    """Score that a share ``probability`` of the surrogates exceeds."""
    return float(np.quantile(sorted_scores, 1.0 - probability))
