"""Couplings between axes and with the rotors, as angular accelerations [rad/s^2].

airspeed_thrust_loss   pitch      -c mu_s theta'           thrust falls with the rotors' speed through the air
                       elevation  -c mu_s eps' cos(theta)
gyroscopic_coupling    pitch      -c mu_s eps'             the rotors' angular momentum, turned
                       elevation  +c mu_s theta'
rotor_drag_torque      travel     c mu_s cos(theta) cos(eps)
rotor_mismatch         pitch      c mu_s                   one rotor pulls more than the other
inertial_coupling      elevation  -c/2 sin(2 eps) lambda'^2        the omega x K term of eq. (1)
                       travel     +2 c tan(eps) eps' lambda'

mu_s = nu_f + nu_r [V]; angles [rad], rates [rad/s]; eps here is measured from the horizontal arm.
"""

from math import cos, sin, tan


def airspeed_thrust_loss_pitch(mu_sum, pitch_rate, c):
    """Pitch acceleration [rad/s^2] by lost thrust, c [1/(V s)]."""
    return -c * mu_sum * pitch_rate


def airspeed_thrust_loss_elevation(mu_sum, elevation_rate, pitch, c):
    """Elevation acceleration [rad/s^2] by lost thrust, c [1/(V s)]."""
    return -c * mu_sum * elevation_rate * cos(pitch)


def gyroscopic_coupling_pitch(mu_sum, elevation_rate, c):
    """Pitch acceleration [rad/s^2] by the rotors' angular momentum, c [1/(V s)]."""
    return -c * mu_sum * elevation_rate


def gyroscopic_coupling_elevation(mu_sum, pitch_rate, c):
    """Elevation acceleration [rad/s^2] by the rotors' angular momentum, c [1/(V s)]."""
    return c * mu_sum * pitch_rate


def rotor_drag_torque(mu_sum, pitch, elevation, c):
    """Travel acceleration [rad/s^2] by the propellers' drag torque, c [rad/s^2/V]."""
    return c * mu_sum * cos(pitch) * cos(elevation)


def rotor_mismatch(mu_sum, c):
    """Pitch acceleration [rad/s^2] by unequal rotors, c [rad/s^2/V]."""
    return c * mu_sum


def inertial_coupling_elevation(elevation_from_horizontal, travel_rate, c):
    """Elevation acceleration [rad/s^2] by the centrifugal force of the travel, c [1]."""
    return -0.5 * c * sin(2.0 * elevation_from_horizontal) * travel_rate * travel_rate


def inertial_coupling_travel(elevation_from_horizontal, elevation_rate, travel_rate, c):
    """Travel acceleration [rad/s^2] by the arm's changing moment of inertia, c [1]."""
    return 2.0 * c * tan(elevation_from_horizontal) * elevation_rate * travel_rate
