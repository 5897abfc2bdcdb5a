"""A reference step of the closed loop, simulated on the whole plant: friction, saturation, delay, sampling included."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.workbench.linearise.operating_point import OperatingPoint
from heli_plant.control import PidSettings, PidState, pid_step, start_pid
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters
from heli_plant.plant import advance, measured_angles, rigid_start

SETTLED = 0.05
"""Share of the step within which a response counts as settled."""

LEAD = 1.0
"""Time [s] before the step."""


@dataclass(frozen=True, eq=False)
class StepResponse:
    """Response to a step of one reference.

    Attributes
    ----------
    axis : str
    time : NDArray, shape (N,)
        [s], the step at 0.
    angle : NDArray, shape (N,)
        Deviation from the operating point [rad].
    voltages : NDArray, shape (N, 2)
        [V].
    size : float
        Of the step [rad].
    """

    axis: str
    time: NDArray[np.float64]
    angle: NDArray[np.float64]
    voltages: NDArray[np.float64]
    size: float

    @property
    def overshoot(self) -> float:
        """Largest excess over the step, as a share of it."""
        return max(float(np.max(self.angle / self.size)) - 1.0, 0.0)

    @property
    def settling_time(self) -> float:
        """Time [s] after which the response stays within :data:`SETTLED` of the step; infinite if it does not."""
        outside = np.abs(self.angle / self.size - 1.0) > SETTLED
        if outside[-1]:
            return float("inf")
        return float(self.time[int(np.flatnonzero(outside)[-1]) + 1]) if outside.any() else 0.0


def step_response(
    parameters: PlantParameters,
    point: OperatingPoint,
    settings: PidSettings,
    axis: str,
    size: float = 0.1,
    duration: float = 12.0,
    period: float = 0.01,
) -> StepResponse:
    """Simulate a reference step of ``size`` [rad] on the pitch or the elevation.

    The controller holds the operating point in its integrals from the start. Its voltages appear one period after the
    angles they follow from, as those of the unit do, and reach the motors after the plant's input delay.
    """
    index = AXES.index(axis)
    state = rigid_start(point.state(parameters), parameters)
    held = point.v_front, point.v_rear
    pid = _holding(point, settings, start_pid(point.pitch, point.elevation, 0.0))
    lead, count = round(LEAD / period), round((LEAD + duration) / period)
    time = np.arange(count, dtype=np.float64) * period
    angles, voltages = np.empty(count), np.empty((count, 2))
    for k in range(count):
        measured = measured_angles(state)
        angles[k], voltages[k] = measured[index], held
        reference = [point.pitch, point.elevation, 0.0]
        if k >= lead:
            reference[index] += size
        following, wanted = pid_step(pid, *measured, (reference[0], reference[1], 0.0), period, settings)
        state = advance(state, time, voltages, k, 0.0, period, parameters)
        pid, held = following, wanted
    base = (point.pitch, point.elevation)[index]
    return StepResponse(axis, time - LEAD, angles - base, voltages, size)


def _holding(point: OperatingPoint, settings: PidSettings, pid: PidState) -> PidState:
    """Return the state whose integrals give the operating point's voltages at zero error."""
    difference, total = point.v_front - point.v_rear, point.v_front + point.v_rear
    integrals = {}
    if settings.pitch.integral:
        integrals["integral_pitch"] = -difference / settings.pitch.integral
    if settings.elevation.integral:
        integrals["integral_elevation"] = (settings.trim - total) / settings.elevation.integral
    return pid._replace(**integrals)
