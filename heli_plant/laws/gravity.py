"""Torques that depend on position or are constant, as angular accelerations [rad/s^2].

constant_torque          pitch, travel   c
cable_stiffness          travel          -c (lambda - lambda(0))
large_angle_gravity      elevation       a_e eps + a_1 becomes a_e sin(eps) + a_1 cos(eps) at c = 1
pitch_gravity_coupling   pitch           a_th sin(theta - theta0) is multiplied by cos(eps) at c = 1
ground_effect            elevation       lift is multiplied by 1 + c exp(-(eps - eps_ground) / eps_g)
moving_mass              elevation       a_1 steps by c at the time t_1

Where an effect replaces a term of the model, the law returns the difference, so that effects add up.
"""

from math import cos, exp, sin


def cable_stiffness(travel, rest, c):
    """Travel acceleration [rad/s^2] by a cable of stiffness c [1/s^2], at rest at ``rest`` [rad]."""
    return -c * (travel - rest)


def large_angle_gravity(elevation, a_e, a_1, c):
    """Elevation acceleration [rad/s^2]: linear gravity taken off, trigonometric gravity put in, share c [1]."""
    return c * (a_e * (elevation - sin(elevation)) + a_1 * (1.0 - cos(elevation)))


def pitch_gravity_coupling(pitch, elevation, a_th, theta0, c):
    """Pitch acceleration [rad/s^2]: the pendulum's gravity falls with cos(elevation), share c [1]."""
    return c * a_th * sin(pitch - theta0) * (1.0 - cos(elevation))


def ground_effect(lift, elevation, c, ground_elevation, ground_height):
    """Elevation acceleration [rad/s^2] that the ground adds to ``lift`` [rad/s^2], c [1].

    ``ground_elevation`` [rad] is the elevation on the ground, ``ground_height`` [rad] the decay length.
    """
    return lift * c * exp(-(elevation - ground_elevation) / ground_height)


def moving_mass(t, c, step_time):
    """Elevation acceleration [rad/s^2] by a step of c [rad/s^2] in a_1 at ``step_time`` [s]."""
    return -c if t >= step_time else 0.0
