"""From one instant to the next: the plant, what it lacks, and what the regressors make of its errors."""

from math import cos
from typing import NamedTuple

from heli_plant.communication import PlantMemory
from heli_plant.observer import Torque, predicted

from .plan import FollowPlan
from .regressors import acting
from .sensitivity import Sensitivity, predicted_sensitivity
from .twins import scaled
from .values import Values

Voltages = tuple[float, float]
"""Front and rear [V]."""


class Instant(NamedTuple):
    """The twin at one instant: its plant, the unmodelled accelerations [rad/s^2], the sensitivity of each axis."""

    memory: PlantMemory
    torque: Torque
    sensitivities: tuple[Sensitivity, Sensitivity, Sensitivity]


def later(now: Instant, voltages: Voltages, time: float, values: Values, plan: FollowPlan) -> tuple[Instant, Voltages]:
    """Return the twin one sampling interval later, and the voltages that arrived at its motors [V].

    Parameters
    ----------
    now : Instant
        At ``time`` [s], corrected if a sample came in.
    voltages : tuple
        Held from then on [V].
    time : float
    values : Values
    plan : FollowPlan

    Returns
    -------
    instant : Instant
        Not yet corrected: the sensitivities' ``angle`` is psi.
    arrived : tuple
        Front and rear, without the rotors' shares [V].
    """
    h, p, before = plan.settings.sample_time, values.parameters, now.memory.state
    memory, arrived = _advanced(now.memory, voltages, time, values, plan)
    kept, torque = predicted(memory.state, now.torque, h, plan.gains[0])
    # the accelerations by which each change would have acted, from the motion at the step's begin
    mu_diff, mu_sum = plan.thrusts(
        0.5 * (before.nu_front + kept.nu_front), 0.5 * (before.nu_rear + kept.nu_rear), time + h, p
    )
    g = acting(before, mu_diff, mu_sum, plan.laws, p.theta0)
    own = ((p.a_th * cos(before.pitch - p.theta0), p.a_wx), (p.a_e, p.a_wz), (0.0, p.a_wy))
    rows = []
    for axis in range(3):
        stiffness, damping = own[axis]
        rows.append(predicted_sensitivity(now.sensitivities[axis], g[axis], stiffness, damping, h, plan.gains[axis]))
    return Instant(memory._replace(state=kept), torque, (rows[0], rows[1], rows[2])), arrived


def _advanced(
    memory: PlantMemory, voltages: Voltages, time: float, values: Values, plan: FollowPlan
) -> tuple[PlantMemory, Voltages]:
    h, p = plan.settings.sample_time, values.parameters
    front, rear = scaled(voltages, values.now, p.v_max)
    memory = plan.communicate(
        memory, front, rear, 0.0, time, 0.0, h, h, plan.delay, p, plan.step, plan.arriving
    )  # fmt: skip
    if plan.delay > 0.0:
        front, rear = plan.arriving(memory.since, memory.held, len(memory.since) - 1, time, h, p)
        return memory, (front / values.now[-2], rear / values.now[-1])
    return memory, voltages
