"""From applied voltage to the voltage that thrust is proportional to: the rotors' chain of effects.

v -> saturation -> (input_delay, kept by the caller) -> dead_zone -> motor lag, eq. (9) -> quadratic_thrust
-> reverse_thrust_loss -> thrust_fade. Each link is passed through untouched where its coefficient is zero.
"""

from .laws.rotors import dead_zone, quadratic_thrust, reverse_thrust_loss, thrust_fade
from .motor import saturate


def motor_input(voltage, p):
    """Voltage [V] that drives the lag of eq. (9)."""
    v = saturate(voltage, p.v_max)
    if p.dead_zone_rotors != 0.0:
        v = dead_zone(v, p.dead_zone_rotors)
    return v


def thrust_voltage(nu, t, p):
    """Thrust-equivalent voltage [V] of a lagged voltage ``nu`` [V] at time ``t`` [s]."""
    if p.quadratic_thrust_rotors != 0.0:
        nu = quadratic_thrust(nu, p.quadratic_thrust_rotors)
    if p.reverse_thrust_loss_rotors != 0.0:
        nu = reverse_thrust_loss(nu, p.reverse_thrust_loss_rotors)
    if p.thrust_fade_rotors != 0.0:
        nu = thrust_fade(nu, t, p.thrust_fade_rotors)
    return nu
