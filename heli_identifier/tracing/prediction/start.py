"""First estimates for the fit: least squares on smoothed derivatives, axis by axis, linear in the parameters.

The equations (2), (10), (12) with sin(theta - theta0) split into sin(theta) and cos(theta). Derivatives come from a
zero-phase local polynomial (Savitzky and Golay 1964). Biased by disturbances; only the fit's start depends on it.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import ModelParameters
from heli_identifier.records import Log
from heli_identifier.tracing.prediction.local_cubic import local_cubic
from heli_identifier.tracing.prediction.recursive_filter import filtered
from heli_plant.parameters import PlantParameters

SMOOTHING_WINDOW = 0.6
"""Length [s] of the local polynomial of degree 3: keeps .94 of an acceleration at .5 Hz and .76 at 1 Hz."""


def smoothed(
    values: NDArray[np.float64], step: float, order: int = 0, window: float = SMOOTHING_WINDOW
) -> NDArray[np.float64]:
    """Zero-phase derivative of ``order`` of ``values`` (N, ...) sampled every ``step`` [s], by cubics over ``window``.

    ``window`` [s] is widened to five samples where it holds fewer.
    """
    length = max(int(window / step) | 1, 5)
    return local_cubic(values, length, order, step)


def lagged_voltages(record: Log, time_constant: float) -> NDArray[np.float64]:
    """Voltages (N, 2) [V] behind the lag of eq. (9), settled at the first sample."""
    kept = float(np.exp(-record.step / time_constant)) if time_constant > 0.0 else 0.0
    first = record.voltages[0]
    return filtered([0.0, 1.0 - kept], [1.0, -kept], record.voltages - first) + first


def _regression(
    record: Log, time_constant: float, rest_pitch: float | None
) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Regressors and accelerations of the three axes of one record, ends cut off.

    The pitch has the columns -sin(theta) and cos(theta) of gravity, or -sin(theta - theta0) where theta0 is given.
    """
    h = record.step
    angle, rate, acceleration = (smoothed(record.angles, h, order) for order in (0, 1, 2))
    nu = smoothed(lagged_voltages(record, time_constant), h)
    mu_diff, mu_sum = nu[:, 0] - nu[:, 1], nu[:, 0] + nu[:, 1]
    sine, cosine = np.sin(angle[:, 0]), np.cos(angle[:, 0])
    cut = int(SMOOTHING_WINDOW / h)
    inner = slice(cut, -cut)
    gravity = (-sine, cosine) if rest_pitch is None else (-np.sin(angle[:, 0] - rest_pitch),)
    regressors = (
        np.column_stack((-rate[:, 0], *gravity, mu_diff)),
        np.column_stack((-rate[:, 1], -angle[:, 1], -np.ones_like(sine), -rate[:, 0] * rate[:, 2], mu_sum * cosine)),
        np.column_stack((-rate[:, 2], mu_sum * sine)),
    )
    return [(x[inner], acceleration[inner, axis]) for axis, x in enumerate(regressors)]


def first_estimate(
    records: Sequence[Log], base: PlantParameters, free: Sequence[str] = ModelParameters._fields
) -> PlantParameters:
    """Return ``base`` with the parameters of the simplified model estimated from ``records``.

    Parameters
    ----------
    records : sequence of Log
    base : PlantParameters
        What is not estimated: the motor's time constant [s], the voltage limit [V], and theta0 [rad] and k_z
        [rad/s^2/V] if they are given.
    free : sequence of str
        Parameters to estimate: all eleven, or all but theta0 or k_z.
    """
    rest_pitch = None if "theta0" in free else base.theta0
    rows = [_regression(record, base.T_m, rest_pitch) for record in records]
    systems = [
        (np.concatenate([row[axis][0] for row in rows]), np.concatenate([row[axis][1] for row in rows]))
        for axis in range(3)
    ]
    if "k_z" not in free:
        regressors, acceleration = systems[1]
        systems[1] = regressors[:, :-1], acceleration - base.k_z * regressors[:, -1]
    pitch, elevation, travel = (np.linalg.lstsq(columns, target, rcond=None)[0] for columns, target in systems)
    if rest_pitch is None:
        a_th, theta0 = _stiffness_and_rest(float(pitch[1]), float(pitch[2]))
    else:
        a_th, theta0 = float(pitch[1]), rest_pitch
    return base._replace(
        a_wx=float(pitch[0]),
        a_th=a_th,
        theta0=theta0,
        k_x=float(pitch[-1]),
        a_wz=float(elevation[0]),
        a_e=float(elevation[1]),
        a_1=float(elevation[2]),
        a_lt=float(elevation[3]),
        k_z=float(elevation[4]) if "k_z" in free else base.k_z,
        a_wy=float(travel[0]),
        k_y=float(travel[1]),
    )


def _stiffness_and_rest(of_sine: float, of_cosine: float) -> tuple[float, float]:
    """(a_th, theta0) from a_th cos(theta0) and a_th sin(theta0); a statically unstable pitch has a_th < 0."""
    sign = 1.0 if of_sine >= 0.0 else -1.0
    return sign * float(np.hypot(of_sine, of_cosine)), float(np.arctan2(sign * of_cosine, sign * of_sine))
