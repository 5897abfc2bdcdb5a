"""Maximum-likelihood fit by Gauss-Newton on whitened innovations, the whitening refitted at every step.

With e(p) the innovations, W(p) their whitening and z = W e, each step solves min |z + J dp| for the sensitivities
J = W de/dp, with Levenberg-Marquardt damping when a step does not reduce |z|. Logarithm of the concentrated
likelihood: -sum over axes of n log(sigma). Standard errors: :mod:`heli_identifier.tracing.prediction.covariance`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import Estimate, ModelParameters
from heli_identifier.tracing.prediction.covariance import block_covariance
from heli_identifier.tracing.prediction.problem import Problem, Residuals
from heli_identifier.tracing.prediction.whitening import Whitener, fit_whitener
from heli_plant.effects import CATALOGUE, Effect, Shape
from heli_plant.parameter_table import BY_FIELD
from heli_plant.parameters import PlantParameters

BASE = ModelParameters._fields
"""Fields of the simplified model that every fit estimates."""

OUTDATED = 3.0
"""Sensitivities are computed again when a parameter has moved by more standard errors than this since the last time."""

_PARTS: list[Effect | Shape] = [*CATALOGUE, *(shape for effect in CATALOGUE for shape in effect.shapes)]
DIFFERENCE_STEPS = {part.field: part.difference_step for part in _PARTS if part.difference_step is not None}
"""Difference steps of parameters whose response has corners: wide enough to average over several samples."""


def difference_step(field: str, value: float) -> float:
    """Step for the numerical derivative by ``field`` at ``value``: small against any nonlinearity, above rounding."""
    if field in DIFFERENCE_STEPS:
        return DIFFERENCE_STEPS[field]
    return 1e-4 * max(abs(value), 0.05)


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted parameter set and the linear problem around it.

    Attributes
    ----------
    problem : Problem
    parameters : PlantParameters
    free : tuple of str
        Fields that were estimated, in the order of the columns below.
    model_residuals : list of NDArray, shape (n_i, 3)
        Reduced innovations at the optimum [rad/s^2].
    residuals : list of NDArray, shape (n_i, 3)
        The same less what the further columns explain.
    whitener : Whitener
    white : NDArray, shape (M,)
        Whitened innovations z.
    linear : NDArray, shape (k,)
        Coefficients of the further columns.
    raw_jacobian : list of NDArray, shape (n_i, 3, len(free) + k)
        Sensitivities of the reduced innovations, the further columns behind those of ``free``.
    jacobian : NDArray, shape (M, len(free) + k)
        The same, whitened.
    covariance : NDArray, shape (len(free) + k, len(free) + k)
    log_likelihood : float
    converged : bool
    """

    problem: Problem
    parameters: PlantParameters
    free: tuple[str, ...]
    model_residuals: Residuals
    residuals: Residuals
    whitener: Whitener
    white: NDArray[np.float64]
    linear: NDArray[np.float64]
    raw_jacobian: Residuals
    jacobian: NDArray[np.float64]
    covariance: NDArray[np.float64]
    log_likelihood: float
    converged: bool

    def standard_error(self, field: str) -> float:
        """Give the standard error of a free field, in its unit."""
        index = self.free.index(field)
        return float(np.sqrt(self.covariance[index, index]))

    def estimate(self, field: str) -> Estimate:
        """Value of a free field with its standard error."""
        return Estimate(getattr(self.parameters, field), self.standard_error(field), BY_FIELD[field].unit)


def log_likelihood(problem: Problem, whitener: Whitener) -> float:
    """Concentrated Gaussian log-likelihood of the innovations, up to a constant."""
    return -sum(problem.lengths) * float(np.log(whitener.scales).sum())


def sensitivities(
    problem: Problem, parameters: PlantParameters, free: Sequence[str], at: Residuals, near: Fit | None = None
) -> Residuals:
    """Sensitivities of the reduced innovations to ``free``, one array (n_i, 3, len(free)) a record.

    A difference that would leave the parameter's range is taken to the other side. Sensitivities to fields that
    ``near`` estimates are taken from it unchanged.
    """
    known = near.free if near is not None else ()
    missing = [name for name in free if name not in known]
    moves, sizes = [], []
    for name in missing:
        value = getattr(parameters, name)
        size = difference_step(name, value)
        if value + size > BY_FIELD[name].maximum:
            size = -size
        moves.append({name: value + size})
        sizes.append(size)
    taken = problem.responses(parameters, moves, at, sizes)
    if near is None:
        return taken
    order = [(known + tuple(missing)).index(name) for name in free]
    width = len(known)  # of the columns of ``near`` that are fields; those of an unknown torque follow them
    pairs = zip(near.raw_jacobian, taken, strict=True)
    return [np.concatenate((old[..., :width], new), axis=2)[..., order] for old, new in pairs]


def clipped(parameters: PlantParameters, free: Sequence[str], step: NDArray[np.float64]) -> PlantParameters:
    """``parameters`` moved by ``step`` along ``free``, every field kept in its range."""
    moved = {}
    for name, change in zip(free, step, strict=True):
        row = BY_FIELD[name]
        moved[name] = float(min(max(getattr(parameters, name) + change, row.minimum), row.maximum))
    if "T_m" in moved or "motor_lag_rotors" in moved:
        T_m = moved.get("T_m", parameters.T_m)
        moved["motor_lag_rotors"] = max(moved.get("motor_lag_rotors", parameters.motor_lag_rotors), 1e-3 - T_m)
    return parameters._replace(**moved)


def fit(
    problem: Problem,
    start: PlantParameters,
    free: Sequence[str] = BASE,
    extra: Residuals | None = None,
    weights: NDArray[np.float64] | None = None,
    near: Fit | None = None,
    iterations: int = 16,
    tolerance: float = 3e-2,
) -> Fit:
    """Fit the fields ``free`` of ``start`` to the records of ``problem``.

    Parameters
    ----------
    problem : Problem
    start : PlantParameters
        Values of what is not estimated, and where the search begins.
    free : sequence of str
    extra : list of NDArray, shape (n_i, 3, k), optional
        Linear columns that are fitted along (the responses to an unknown torque); they follow ``free`` in the
        Jacobian and the covariance.
    weights : NDArray, shape (k,), optional
        Where the search for their coefficients begins.
    near : Fit, optional
        A fit to the same problem whose sensitivities the search begins with.
    iterations : int
        Most Gauss-Newton steps.
    tolerance : float
        Stops when no parameter moves by more than this fraction of its standard error.

    Returns
    -------
    Fit
    """
    free = tuple(free)
    columns = extra if extra is not None else [np.empty((n, 3, 0)) for n in problem.lengths]
    parameters, linear = start, np.zeros(columns[0].shape[2]) if weights is None else weights
    damping, converged, fresh = 0.0, False, near is None
    model = problem.residuals(parameters)
    residuals = explained(model, columns, linear)

    def linearised(known: Fit | None = None) -> Residuals:
        """Sensitivities at the current parameters, and the further columns."""
        return _joined(sensitivities(problem, parameters, free, model, known), columns)

    raw = linearised(near)
    taken_at = parameters if near is None else near.parameters
    for _ in range(iterations):
        whitener = fit_whitener(residuals, problem.order)
        white = whitener.apply(residuals)
        jacobian = whitener.apply(raw)
        scale = np.linalg.norm(jacobian, axis=0)
        scale[scale == 0.0] = 1.0
        cost = float(white @ white)
        normal, gradient = (jacobian / scale).T @ (jacobian / scale), (jacobian / scale).T @ white
        errors = np.sqrt(np.maximum(np.diag(np.linalg.pinv(normal)), 0.0)) / scale
        for _ in range(6 if fresh else 1):
            step = -np.linalg.solve(normal + (damping + 1e-10) * np.eye(len(scale)), gradient) / scale
            moved = clipped(parameters, free, step[: len(free)])
            moved_linear = linear + step[len(free) :]
            trial_model = problem.residuals(moved)
            trial = explained(trial_model, columns, moved_linear)
            trial_white = whitener.apply(trial)
            if np.isfinite(trial_white).all() and float(trial_white @ trial_white) <= cost * (1.0 + 1e-9):
                damping *= 0.1 if damping > 1e-6 else 0.0
                break
            damping = max(10.0 * damping, 1e-3) if fresh else damping
        else:
            if fresh:
                break
            raw, taken_at, fresh = linearised(), parameters, True
            continue
        actual = np.concatenate((_apart(moved, parameters, free), moved_linear - linear))
        parameters, model, residuals, linear = moved, trial_model, trial, moved_linear
        # sensitivities change slowly: they are kept until the parameters have moved away from them (chord method)
        fresh = bool(np.any(np.abs(_apart(parameters, taken_at, free)) > OUTDATED * errors[: len(free)]))
        if fresh:
            raw, taken_at = linearised(), parameters
        if np.all(np.abs(actual) <= tolerance * errors):
            converged = True
            break
    whitener = fit_whitener(residuals, problem.order)
    white = whitener.apply(residuals)
    jacobian = whitener.apply(raw)
    covariance = block_covariance(problem, whitener, jacobian, white)
    return Fit(
        problem, parameters, free, model, residuals, whitener, white, linear, raw, jacobian, covariance,
        log_likelihood(problem, whitener), converged,
    )  # fmt: skip


def _apart(parameters: PlantParameters, others: PlantParameters, fields: Sequence[str]) -> NDArray[np.float64]:
    """Differences of two parameter sets in some fields."""
    return np.array([getattr(parameters, field) - getattr(others, field) for field in fields])


def explained(model: Residuals, columns: Residuals, linear: NDArray[np.float64]) -> Residuals:
    """Give the innovations less what the further columns explain."""
    return [r + c @ linear for r, c in zip(model, columns, strict=True)]


def _joined(sensitivities_: Residuals, columns: Residuals) -> Residuals:
    return [np.concatenate(pair, axis=2) for pair in zip(sensitivities_, columns, strict=True)]
