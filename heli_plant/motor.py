"""Motors, eq. (9): T_m dnu/dt + nu = v, exact for a voltage v held over the step; saturation of v."""

from math import exp


def advance(nu, voltage, h, time_constant):
    """Lagged voltage [V] after ``h`` [s] under a held ``voltage`` [V]; a ``time_constant`` of 0 s passes it through."""
    if time_constant <= 0.0:
        return voltage
    return voltage + (nu - voltage) * exp(-h / time_constant)


def saturate(voltage, limit):
    """``voltage`` clipped to plus or minus ``limit`` [V]."""
    if voltage > limit:
        return limit
    if voltage < -limit:
        return -limit
    return voltage
