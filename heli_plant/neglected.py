"""What the simplified model neglects: the catalogue's effects on each axis, as added accelerations [rad/s^2].

With F(w) the axis's friction (:mod:`heli_plant.friction`), mu_s = nu_f + nu_r [V], eps_h = eps + eps_0 the elevation
from the horizontal arm, and one coefficient c per effect:

pitch      c_torque + mu_s (c_mismatch - c_airspeed theta' - c_gyro eps') + F(theta')
           + c_gravity a_th sin(theta - theta0) (1 - cos eps)

elevation  mu_s (c_gyro theta' - c_airspeed eps' cos theta) + F(eps') - c_inertial/2 sin(2 eps_h) lambda'^2
           + c_gravity (a_e (eps - sin eps) + a_1 (1 - cos eps))
           + c_ground k_z mu_s cos(theta) exp(-(eps - eps_ground) / eps_g) - [t >= t_1] c_mass

travel     c_torque + c_drag mu_s cos(theta) cos(eps) + F(lambda') - c_cable (lambda - lambda(0))
           + 2 c_inertial tan(eps_h) eps' lambda'

Where an effect replaces a term of the simplified model (gravity), the difference stands here, so that effects add up;
the general model, eq. (1), has inertial coupling and trigonometric gravity already. The products cost less than a
question whether they are on, the transcendental functions more. Effects of the rotors are in :mod:`heli_plant.rotors`,
the arm's bending in :mod:`heli_plant.bending`.
"""

from math import cos, exp, sin, tan

from .friction import friction
from .parameters import PlantParameters


def switched_on(p: PlantParameters) -> tuple[bool, bool, bool]:
    """Return for pitch, elevation and travel whether any of its effects has a coefficient other than zero."""
    pitch = (
        p.dry_friction_pitch != 0.0
        or p.breakaway_friction_pitch != 0.0
        or p.quadratic_drag_pitch != 0.0
        or p.constant_torque_pitch != 0.0
        or p.rotor_mismatch_pitch != 0.0
        or p.airspeed_thrust_loss_pitch != 0.0
        or p.gyroscopic_coupling_pitch != 0.0
        or p.pitch_gravity_coupling_pitch != 0.0
    )
    elevation = (
        p.dry_friction_elevation != 0.0
        or p.breakaway_friction_elevation != 0.0
        or p.quadratic_drag_elevation != 0.0
        or p.airspeed_thrust_loss_elevation != 0.0
        or p.gyroscopic_coupling_elevation != 0.0
        or p.inertial_coupling_elevation != 0.0
        or p.large_angle_gravity_elevation != 0.0
        or p.ground_effect_elevation != 0.0
        or p.moving_mass_elevation != 0.0
    )
    travel = (
        p.dry_friction_travel != 0.0
        or p.breakaway_friction_travel != 0.0
        or p.quadratic_drag_travel != 0.0
        or p.constant_torque_travel != 0.0
        or p.rotor_drag_torque_travel != 0.0
        or p.cable_stiffness_travel != 0.0
        or p.inertial_coupling_travel != 0.0
    )
    return pitch, elevation, travel


def neglected_pitch(
    pitch: float, elevation: float, pitch_rate: float, elevation_rate: float, mu_sum: float, p: PlantParameters
) -> float:
    """Pitch acceleration [rad/s^2] by the catalogue's effects on the pitch."""
    rotors = (
        p.rotor_mismatch_pitch
        - p.airspeed_thrust_loss_pitch * pitch_rate
        - p.gyroscopic_coupling_pitch * elevation_rate
    )
    acceleration = (
        p.constant_torque_pitch
        + rotors * mu_sum
        + friction(
            pitch_rate,
            p.dry_friction_pitch,
            p.breakaway_friction_pitch,
            p.stribeck_rate_pitch,
            p.quadratic_drag_pitch,
        )
    )
    if p.pitch_gravity_coupling_pitch != 0.0:
        acceleration += p.pitch_gravity_coupling_pitch * p.a_th * sin(pitch - p.theta0) * (1.0 - cos(elevation))
    return acceleration


def neglected_elevation(
    t: float,
    pitch: float,
    elevation: float,
    pitch_rate: float,
    elevation_rate: float,
    travel_rate: float,
    mu_sum: float,
    p: PlantParameters,
) -> float:
    """Elevation acceleration [rad/s^2] by the catalogue's effects on the elevation at time ``t`` [s]."""
    cos_pitch = cos(pitch)
    rotors = (
        p.gyroscopic_coupling_elevation * pitch_rate
        - p.airspeed_thrust_loss_elevation * elevation_rate * cos_pitch
    )  # fmt: skip
    acceleration = rotors * mu_sum + friction(
        elevation_rate,
        p.dry_friction_elevation,
        p.breakaway_friction_elevation,
        p.stribeck_rate_elevation,
        p.quadratic_drag_elevation,
    )
    if p.inertial_coupling_elevation != 0.0:
        centrifugal = 0.5 * sin(2.0 * (elevation + p.horizontal_offset)) * travel_rate * travel_rate
        acceleration -= p.inertial_coupling_elevation * centrifugal
    if p.large_angle_gravity_elevation != 0.0:
        straightened = p.a_e * (elevation - sin(elevation)) + p.a_1 * (1.0 - cos(elevation))
        acceleration += p.large_angle_gravity_elevation * straightened
    if p.ground_effect_elevation != 0.0:
        lift = p.k_z * mu_sum * cos_pitch
        cushion = exp(-(elevation - p.ground_elevation) / p.ground_height)
        acceleration += p.ground_effect_elevation * lift * cushion
    if t >= p.moving_mass_time:
        acceleration -= p.moving_mass_elevation
    return acceleration


def neglected_travel(
    pitch: float,
    elevation: float,
    travel: float,
    elevation_rate: float,
    travel_rate: float,
    cable_rest: float,
    mu_sum: float,
    p: PlantParameters,
) -> float:
    """Travel acceleration [rad/s^2] by the catalogue's effects on the travel; the cable rests at ``cable_rest``."""
    acceleration = (
        p.constant_torque_travel
        - p.cable_stiffness_travel * (travel - cable_rest)
        + friction(
            travel_rate,
            p.dry_friction_travel,
            p.breakaway_friction_travel,
            p.stribeck_rate_travel,
            p.quadratic_drag_travel,
        )
    )
    if p.rotor_drag_torque_travel != 0.0:
        acceleration += p.rotor_drag_torque_travel * mu_sum * cos(pitch) * cos(elevation)
    if p.inertial_coupling_travel != 0.0:
        turning = 2.0 * tan(elevation + p.horizontal_offset) * elevation_rate * travel_rate
        acceleration += p.inertial_coupling_travel * turning
    return acceleration
