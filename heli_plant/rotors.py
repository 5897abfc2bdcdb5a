"""From applied voltage to the voltage that thrust is proportional to: the rotors' chain of effects.

saturation           v -> clipped to plus or minus v_max
input_delay          v(t) -> v(t - c), kept by the caller (:mod:`heli_plant.delay`)
dead_zone            v -> 0 while abs(v) < c, v - c sign(v) beyond
motor lag, eq. (9)   v -> nu, its time constant longer by motor_lag (:mod:`heli_plant.motor`)
quadratic_thrust     nu -> nu + c nu abs(nu)
reverse_thrust_loss  nu -> (1 - c) nu where nu < 0
thrust_fade          nu -> (1 - c t) nu, t [s] since the record began

Each link passes its voltage through untouched where its coefficient is zero.
"""

from .motor import saturate
from .parameters import PlantParameters


def dead_zone(voltage: float, width: float) -> float:
    """Voltage [V] that is left of ``voltage`` [V] behind a dead zone of half width ``width`` [V]."""
    if voltage > width:
        return voltage - width
    if voltage < -width:
        return voltage + width
    return 0.0


def motor_input(voltage: float, p: PlantParameters) -> float:
    """Voltage [V] that drives the lag of eq. (9) under an applied ``voltage`` [V]."""
    return dead_zone(saturate(voltage, p.v_max), p.dead_zone_rotors)


def thrust_voltage(nu: float, t: float, p: PlantParameters) -> float:
    """Thrust-equivalent voltage [V] of a lagged voltage ``nu`` [V] at time ``t`` [s]."""
    thrust = nu + p.quadratic_thrust_rotors * nu * abs(nu)
    if thrust < 0.0:
        thrust *= 1.0 - p.reverse_thrust_loss_rotors
    return (1.0 - p.thrust_fade_rotors * t) * thrust


def thrust_voltages(nu_front: float, nu_rear: float, t: float, p: PlantParameters) -> tuple[float, float]:
    """Return (mu_d, mu_s) [V], difference and sum of the rotors' thrust-equivalent voltages at time ``t`` [s]."""
    front, rear = thrust_voltage(nu_front, t, p), thrust_voltage(nu_rear, t, p)
    return front - rear, front + rear
