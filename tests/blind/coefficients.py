"""Every number that the simulated rig depends on, as flat tuples of floats that compiled code takes.

Names of the base parameters are the paper's; one field per effect and axis, zero when it is off; then shapes.
"""

from typing import NamedTuple


class Coefficients(NamedTuple):
    """Numbers of the plant."""

    # Base model: eqs (2), (10), (12), (9). [1/s], [1/s^2], [rad/s^2/V], [rad], [s]
    a_wx: float = 0.060
    a_th: float = 0.664
    k_x: float = 0.293
    theta0: float = -0.13613568165555773
    a_wz: float = 0.032
    a_e: float = 2.59
    a_1: float = -0.142
    a_lt: float = 0.026
    k_z: float = 0.157
    a_wy: float = 0.114
    k_y: float = -0.112
    t_m: float = 0.08

    # Friction and drag of the pivots.
    dry_friction_pitch: float = 0.0
    dry_friction_elevation: float = 0.0
    dry_friction_travel: float = 0.0
    breakaway_friction_pitch: float = 0.0
    breakaway_friction_elevation: float = 0.0
    breakaway_friction_travel: float = 0.0
    stribeck_rate: float = 0.05
    presliding: float = 0.0
    quadratic_drag_pitch: float = 0.0
    quadratic_drag_elevation: float = 0.0
    quadratic_drag_travel: float = 0.0

    # Rotors and motors.
    quadratic_thrust: float = 0.0
    reverse_thrust_loss: float = 0.0
    dead_zone: float = 0.0
    motor_lag: float = 0.0
    input_delay: float = 0.0
    thrust_fade: float = 0.0

    # Torques on the axes.
    constant_torque_pitch: float = 0.0
    constant_torque_travel: float = 0.0
    rotor_mismatch: float = 0.0
    airspeed_thrust_loss_pitch: float = 0.0
    airspeed_thrust_loss_elevation: float = 0.0
    gyroscopic_coupling_pitch: float = 0.0
    gyroscopic_coupling_elevation: float = 0.0
    speed_stability: float = 0.0
    rotor_drag_torque: float = 0.0
    cable_stiffness: float = 0.0
    thrust_tilt: float = 0.0
    translational_lift: float = 0.0
    inertial_coupling_elevation: float = 0.0
    inertial_coupling_travel: float = 0.0
    large_angle_gravity: float = 0.0
    pitch_gravity_coupling: float = 0.0
    ground_effect: float = 0.0
    ground_angle: float = -0.2
    ground_length: float = 0.15
    moving_mass: float = 0.0
    mass_time: float = 0.0

    # Bending of the arm, seen by the elevation encoder alone. [rad/V], [Hz], [1]
    arm_bending: float = 0.0
    bending_frequency: float = 3.0
    bending_damping: float = 0.05

    # The arm is horizontal where the elevation encoder reads minus this. [rad]
    elevation_zero: float = 0.0


class Strange(NamedTuple):
    """Numbers of a torque that no catalogue names; at most one amplitude is not zero."""

    axis: int = -1
    periodic: float = 0.0
    frequency: float = 0.0
    phase: float = 0.0
    detent: float = 0.0
    centre: float = 0.0
    width: float = 1.0
    by_travel: float = 0.0
    waves: float = 1.0
