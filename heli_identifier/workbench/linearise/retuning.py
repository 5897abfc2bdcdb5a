"""A PID for the identified plant: the fastest that keeps its margins over every plant that the data allow.

Per loop the gains (P, I, D) minimise the integrated time-weighted error of a reference step of the linear closed loop,

    J = sum_k t_k abs(1 - y_k) h + sum_k t_k abs(y_k under a load step) h,

subject to a peak of the sensitivity of at most :data:`PEAK` for all drawn plants (Astrom and Hagglund, Advanced PID
Control, 2006, chapters 4 and 7), and to no more gain on encoder noise, P + D/tau, than the present PID has.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from heli_identifier.workbench.linearise.closed_loop import closed_loop
from heli_identifier.workbench.linearise.linear_model import LinearModel
from heli_identifier.workbench.linearise.margins import (
    LOOPS,
    controller_response,
    frequencies,
    loop_gain,
    plant_response,
)
from heli_plant.control import AxisGains, PidSettings

PEAK = 1.6
"""Largest peak of the sensitivity: a phase margin of 36 degrees and a gain margin of 2.7 at least."""

UNSTABLE = 1e6
"""Error J [s^2] of a loop that does not settle."""

HORIZON = 10.0
"""Length [s] of the simulated steps."""

WEIGHT = 50.0
"""Penalty on a violated bound: larger than any improvement of a step response."""


def retuned(
    model: LinearModel, settings: PidSettings, others: Sequence[LinearModel] = (), trim: float | None = None
) -> PidSettings:
    """Return the PID with new gains of pitch and elevation.

    Parameters
    ----------
    model : LinearModel
        Of the identified plant.
    settings : PidSettings
        The present PID; everything but the gains of pitch and elevation is kept.
    others : sequence of LinearModel
        Further plants, allowed by the data, for which the margins have to be kept.
    trim : float, optional
        Sum of the voltages [V] at zero error.
    """
    omega = frequencies(model.sampled.dt, 250)
    plants = np.array([plant_response(one, omega) for one in (model, *others)])
    for loop, axis in enumerate(LOOPS):
        settings = with_gains(settings, axis, _tuned(model, plants, omega, settings, loop))
    return settings if trim is None else settings._replace(trim=trim)


def with_gains(settings: PidSettings, axis: str, gains: AxisGains) -> PidSettings:
    """Return ``settings`` with other gains of one axis."""
    changed: dict[str, Any] = {axis: gains}
    return settings._replace(**changed)


def _tuned(
    model: LinearModel, plants: NDArray[np.complex128], omega: NDArray[np.float64], settings: PidSettings, loop: int
) -> AxisGains:
    """Return the gains of one loop; the other loop is kept."""
    axis = LOOPS[loop]
    present: AxisGains = getattr(settings, axis)
    tau = settings.rate_time_constant
    loudest = present.proportional + present.derivative / tau

    def cost(logarithms: NDArray[np.float64]) -> float:
        gains = AxisGains(*np.exp(logarithms).tolist())
        trial = with_gains(settings, axis, gains)
        pid = controller_response(trial, model.sampled.dt, omega)
        peak = float(np.max(1.0 / np.abs(1.0 + loop_gain(plants, pid, loop))))
        noise = (gains.proportional + gains.derivative / tau) / loudest
        violated = max(peak / PEAK - 1.0, 0.0) + max(noise - 1.0, 0.0)
        return weighted_error(model, trial, loop) + WEIGHT * violated

    options = {"xatol": 1e-3, "fatol": 1e-4, "maxiter": 250}
    found = minimize(cost, np.log(present), method="Nelder-Mead", options=options)
    return AxisGains(*(float(f"{gain:.4g}") for gain in np.exp(found.x)))


def weighted_error(model: LinearModel, settings: PidSettings, loop: int) -> float:
    """Return the time-weighted error J [s^2] of a linear loop under a unit reference step and a load step of 1 V."""
    closed, steps = closed_loop(model, settings), round(HORIZON / model.sampled.dt)
    weights = np.arange(steps) * model.sampled.dt**2
    with np.errstate(over="ignore", invalid="ignore"):
        followed = np.abs(1.0 - closed.trajectory(closed.R[:, loop], steps)[:, loop])
        pushed = np.abs(closed.trajectory(closed.Q[:, loop], steps)[:, loop])
        error = float(weights @ (followed + pushed))
    return error if np.isfinite(error) and error < UNSTABLE else UNSTABLE
