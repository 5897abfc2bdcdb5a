"""Scores of all candidates at a fitted model: what each would explain of the residual that the model leaves.

Each candidate's column is the whitened secant of the innovations along its move; the columns of the fitted
parameters are projected out of it. With u the projected column of unit length and z the whitened residual the score
is t = -u'z, standard normal under a model that lacks nothing; the visibility is the share of the column that the
projection leaves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.prediction.fit import Fit
from heli_identifier.tracing.prediction.problem import Residuals
from heli_identifier.tracing.prediction.whitening import Whitener
from heli_identifier.tracing.search.candidates import Candidate
from heli_plant.effects import Effect


@dataclass(frozen=True, eq=False)
class Scan:
    """Scores of candidates at one fit.

    Attributes
    ----------
    fit : Fit
    whitener : Whitener
        Under which the columns below stand: that of the fit, or of the noise proper.
    white : NDArray, shape (M,)
        Whitened residual z.
    candidates : tuple of Candidate, length K
    raw : list of NDArray, shape (n_i, 3, K)
        Secants of the reduced innovations, before whitening.
    directions : NDArray, shape (M, K)
        Projected, whitened columns of unit length; zero where nothing is visible.
    scores : NDArray, shape (K,)
        t of each candidate, positive for a positive coefficient.
    coefficients, standard_errors : NDArray, shape (K,)
        Linear estimate of c and its standard error, both in the coefficient's unit.
    visibility : NDArray, shape (K,)
    """

    fit: Fit
    whitener: Whitener
    white: NDArray[np.float64]
    candidates: tuple[Candidate, ...]
    raw: Residuals
    directions: NDArray[np.float64]
    scores: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    standard_errors: NDArray[np.float64]
    visibility: NDArray[np.float64]

    def allowed(self) -> NDArray[np.bool_]:
        """Where the estimated coefficient obeys its sign and range rule, shape (K,)."""
        return np.array(
            [admissible(c.effect, float(v)) for c, v in zip(self.candidates, self.coefficients, strict=True)]
        )


def admissible(effect: Effect, coefficient: float) -> bool:
    """Whether a linear estimate of an effect's coefficient obeys its sign and range.

    A secant over a curved law may overshoot the range that the refit then respects: half the range is granted.
    """
    return effect.lower - 0.5 * abs(effect.lower) <= coefficient <= 1.5 * effect.upper


def basis_of(jacobian: NDArray[np.float64]) -> NDArray[np.float64]:
    """Orthonormal basis of a Jacobian's columns, shape (M, rank)."""
    scale = np.linalg.norm(jacobian, axis=0)
    left, singular, _ = np.linalg.svd(jacobian / np.where(scale > 0.0, scale, 1.0), full_matrices=False)
    return left[:, singular > 1e-9 * singular[0]]


def scan(fit: Fit, candidates: Sequence[Candidate]) -> Scan:
    """Score ``candidates`` at ``fit``, under the fit's own whitening."""
    return scored(fit, fit.whitener, candidates, raw_columns(fit, candidates))


def extended(scanned: Scan, candidates: Sequence[Candidate]) -> Scan:
    """Extend ``scanned`` by further candidates."""
    more = scored(scanned.fit, scanned.whitener, candidates, raw_columns(scanned.fit, candidates))
    return replace(
        scanned,
        candidates=(*scanned.candidates, *more.candidates),
        raw=[np.concatenate(pair, axis=2) for pair in zip(scanned.raw, more.raw, strict=True)],
        directions=np.column_stack((scanned.directions, more.directions)),
        scores=np.concatenate((scanned.scores, more.scores)),
        coefficients=np.concatenate((scanned.coefficients, more.coefficients)),
        standard_errors=np.concatenate((scanned.standard_errors, more.standard_errors)),
        visibility=np.concatenate((scanned.visibility, more.visibility)),
    )


def subset(scanned: Scan, keep: Sequence[int]) -> Scan:
    """Keep some of the candidates of ``scanned``."""
    chosen = list(keep)
    return replace(
        scanned,
        candidates=tuple(scanned.candidates[i] for i in chosen),
        raw=[raw[..., chosen] for raw in scanned.raw],
        directions=scanned.directions[:, chosen],
        scores=scanned.scores[chosen],
        coefficients=scanned.coefficients[chosen],
        standard_errors=scanned.standard_errors[chosen],
        visibility=scanned.visibility[chosen],
    )


def raw_columns(fit: Fit, candidates: Sequence[Candidate]) -> Residuals:
    """Secants of the innovations along each candidate's move, (n_i, 3, K); zero where the plant diverges."""
    moves = [candidate.move(fit.parameters) for candidate in candidates]
    sizes = [candidate.size for candidate in candidates]
    raw = fit.problem.responses(fit.parameters, moves, fit.model_residuals, sizes)
    finite = np.all([np.isfinite(r).all(axis=(0, 1)) for r in raw], axis=0)
    return [np.where(finite, r, 0.0) for r in raw]


def _lengths(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Euclidean length of each column of (M, K)."""
    return np.sqrt(np.einsum("mk,mk->k", columns, columns))


def scored(fit: Fit, whitener: Whitener, candidates: Sequence[Candidate], raw: Residuals) -> Scan:
    """Score candidates from their raw columns under a given whitening."""
    white = whitener.apply(fit.residuals)
    columns = whitener.apply(raw)
    basis = basis_of(whitener.apply(fit.raw_jacobian))
    full = _lengths(columns)
    columns -= basis @ (basis.T @ columns)  # in place: these are the largest matrices of a search
    left = _lengths(columns)
    visible = left > 1e-9 * np.maximum(full, 1e-300)
    length = np.where(visible, left, 1.0)
    columns *= np.where(visible, 1.0 / length, 0.0)
    directions = columns
    scores = -(directions.T @ white)
    standard_errors = np.where(visible, 1.0 / length, np.inf)
    return Scan(
        fit,
        whitener,
        white,
        tuple(candidates),
        raw,
        directions,
        scores,
        np.where(visible, scores / length, 0.0),
        standard_errors,
        np.where(full > 0.0, left / np.where(full > 0.0, full, 1.0), 0.0),
    )
