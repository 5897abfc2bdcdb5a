"""Motors, eq. (9): T_m dnu/dt + nu = v, exact for a voltage v held over the step; saturation of v."""

from math import exp


def kept(h: float, time_constant: float) -> float:
    """Share exp(-h / T_m) of a lagged voltage's distance from its goal that is left after ``h`` [s]; T_m of 0: none."""
    if time_constant <= 0.0:
        return 0.0
    return exp(-h / time_constant)


def toward(nu: float, voltage: float, share: float) -> float:
    """Lagged voltage [V] when ``share`` of its distance from the held ``voltage`` [V] is left."""
    return voltage + (nu - voltage) * share


def lagged(nu: float, voltage: float, h: float, time_constant: float) -> float:
    """Lagged voltage [V] after ``h`` [s] under a held ``voltage`` [V]; a ``time_constant`` of 0 s passes it through."""
    return toward(nu, voltage, kept(h, time_constant))


def saturate(voltage: float, limit: float) -> float:
    """``voltage`` clipped to plus or minus ``limit`` [V]; any quantity of one unit will do."""
    if voltage > limit:
        return limit
    if voltage < -limit:
        return -limit
    return voltage
