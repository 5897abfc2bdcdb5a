"""The plant as a differential equation x' = f(t, x, u), from the same laws that :func:`heli_plant.plant.step` advances.

    x = (theta, epsilon, lambda, theta', epsilon', lambda', nu_f, nu_r, q, q')      :data:`STATES`
    u = (v_f, v_r, x_m)                                                            voltages [V], the ADO's mass [m]

with eq. (9) as nu_i' = (u_i - nu_i) / T_m behind saturation, the chosen model and the effects as accelerations, and the
arm's bending mode q. Model exchange and linear models take it from here. An input delay is no part of a differential
equation, and neither are encoders. The ADO's mass stands where ``x_m`` says, within its travel: the lead screw's speed
is left out.
"""

from .laws import bending_acceleration, motor_input, motor_time_constant, switched_on, thrust_voltages
from .motor import saturate
from .parameters import PlantParameters
from .plant import accelerations

STATES = (
    ("pitch", "rad", 1.0),
    ("elevation", "rad", 1.0),
    ("travel", "rad", 1.0),
    ("pitch_rate", "rad/s", 1.0),
    ("elevation_rate", "rad/s", 1.0),
    ("travel_rate", "rad/s", 1.0),
    ("nu_front", "V", 5.0),
    ("nu_rear", "V", 5.0),
    ("bending", "rad", 0.1),
    ("bending_rate", "rad/s", 1.0),
)
"""Name, unit and nominal value of each state: the first fields of :class:`heli_plant.state.PlantState`."""


def rates_of_change(
    t: float, th: float, ep: float, la: float, w1: float, w2: float, w3: float, nu_front: float, nu_rear: float,
    q: float, w_q: float, v_front: float, v_rear: float, mass_position: float, cable_rest: float, p: PlantParameters,
) -> tuple[float, float, float, float, float, float, float, float, float, float]:  # fmt: skip
    """Return x' in the order of :data:`STATES`.

    Parameters
    ----------
    t : float
        Time since the start [s].
    th, ep, la, w1, w2, w3 : float
        Pitch, elevation of the rigid arm, travel [rad] and their rates [rad/s].
    nu_front, nu_rear : float
        Lagged voltages [V]; without a lag they do not count.
    q, w_q : float
        The arm's bending [rad] and its rate [rad/s].
    v_front, v_rear : float
        Voltages at the motors [V].
    mass_position : float
        Of the ADO [m].
    cable_rest : float
        Travel at which the cable is slack [rad].
    p : PlantParameters
    """
    u_front, u_rear = motor_input(v_front, p), motor_input(v_rear, p)
    time_constant = motor_time_constant(p)
    if time_constant > 0.0:
        rate_front, rate_rear = (u_front - nu_front) / time_constant, (u_rear - nu_rear) / time_constant
        mu_diff, mu_sum = thrust_voltages(nu_front, nu_rear, t, p)
    else:
        rate_front, rate_rear = 0.0, 0.0
        mu_diff, mu_sum = thrust_voltages(u_front, u_rear, t, p)
    x = saturate(mass_position, p.ado_travel)
    a1, a2, a3 = accelerations(t, th, ep, la, w1, w2, w3, mu_diff, mu_sum, x, cable_rest, switched_on(p), p)
    return w1, w2, w3, a1, a2, a3, rate_front, rate_rear, w_q, bending_acceleration(q, w_q, mu_sum, p)


def measured(
    th: float, ep: float, la: float, w1: float, w2: float, w3: float, q: float, w_q: float
) -> tuple[float, float, float, float, float, float]:
    """Return what the shafts show: pitch, elevation with the arm's bending, travel [rad], and their rates [rad/s]."""
    return th, ep + q, la, w1, w2 + w_q, w3
