"""What a rotor's voltage goes through on its way to thrust, beyond eq. (9).

dead_zone             v  -> 0 while abs(v) < c, v - c sign(v) beyond        before the motor
quadratic_thrust      nu -> nu + c nu abs(nu)                               after it
reverse_thrust_loss   nu -> (1 - c) nu for nu < 0                           after it
thrust_fade           nu -> (1 - c t) nu                                    after it

v is the applied voltage [V], nu the motor's lagged voltage [V] of eq. (9), t the time [s] since the record began.
"""


def dead_zone(voltage, c):
    """Voltage [V] that is left of ``voltage`` [V] behind a dead zone of half width c [V]."""
    if voltage > c:
        return voltage - c
    if voltage < -c:
        return voltage + c
    return 0.0


def quadratic_thrust(nu, c):
    """Thrust-equivalent voltage [V] of ``nu`` [V] with a quadratic part c [1/V]."""
    return nu + c * nu * abs(nu)


def reverse_thrust_loss(nu, c):
    """Thrust-equivalent voltage [V] of ``nu`` [V] where reverse thrust lacks the fraction c [1]."""
    return (1.0 - c) * nu if nu < 0.0 else nu


def thrust_fade(nu, t, c):
    """Thrust-equivalent voltage [V] of ``nu`` [V] at time ``t`` [s], fading by the fraction c per second [1/s]."""
    return (1.0 - c * t) * nu
