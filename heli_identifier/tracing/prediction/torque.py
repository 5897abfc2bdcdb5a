"""Response of the innovations to an acceleration that the model does not know, by the linearised observer.

Near its motion an axis obeys x'' + a x' + kappa x = d for a small error x; with the observer's correction the
innovation that an extra acceleration d [rad/s^2] leaves is a linear filter of d. kappa is the axis's stiffness.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from heli_identifier.tracing.prediction.observer import DAMPING
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.recursive_filter import filtered
from heli_plant.compiled import read_only
from heli_plant.parameters import PlantParameters


@lru_cache(maxsize=64)
def torque_filter(axis: int, parameters: PlantParameters, bandwidth: float, h: float) -> tuple[NDArray, NDArray]:
    """Numerator and denominator from d to omega_f^2 e of one axis, d held over the step ``h`` [s]."""
    stiffness = (parameters.a_th, parameters.a_e, 0.0)[axis]
    damping = (parameters.a_wx, parameters.a_wz, parameters.a_wy)[axis]
    generator = np.zeros((3, 3))
    generator[:2] = [[0.0, 1.0, 0.0], [-stiffness, -damping, 1.0]]
    transition = expm(generator * h)
    correction = np.array([[1.0 - 2.0 * DAMPING * bandwidth * h, 0.0], [-bandwidth * bandwidth * h, 1.0]])
    A, B, C = transition[:2, :2] @ correction, transition[:2, 2:], np.array([[bandwidth**2, 0.0]])
    # C adj(z - A) B = det(z - A + B C) - det(z - A), the numerator over the denominator det(z - A)
    denominator = np.poly(A)
    return read_only(np.poly(A - B @ C) - denominator), read_only(denominator)


def torque_responses(
    problem: Problem, axis: int, parameters: PlantParameters, accelerations: list[NDArray[np.float64]]
) -> list[NDArray[np.float64]]:
    """Reduced innovations of ``axis`` that extra accelerations cause.

    Parameters
    ----------
    accelerations : list of NDArray, shape (N_i, k)
        Per record, on its own grid [rad/s^2].

    Returns
    -------
    list of NDArray, shape (n_i, k)
    """
    out = []
    for record, d in zip(problem.records, accelerations, strict=True):
        numerator, denominator = torque_filter(axis, parameters, problem.bandwidth, record.step)
        out.append(problem.reduce(record, filtered(numerator, denominator, d)))
    return out
