"""The sum of the catalogue's effects on each axis: what :mod:`heli_plant.simplified_model` neglects.

A coefficient of zero costs one comparison, so that the bare model stays cheap inside an FMU.
"""

from math import cos

from .laws.coupling import (
    airspeed_thrust_loss_elevation,
    airspeed_thrust_loss_pitch,
    gyroscopic_coupling_elevation,
    gyroscopic_coupling_pitch,
    inertial_coupling_elevation,
    inertial_coupling_travel,
    rotor_drag_torque,
    rotor_mismatch,
)
from .laws.friction import breakaway_friction, dry_friction, quadratic_drag
from .laws.gravity import (
    cable_stiffness,
    ground_effect,
    large_angle_gravity,
    moving_mass,
    pitch_gravity_coupling,
)


def neglected_pitch(pitch, elevation, pitch_rate, elevation_rate, mu_sum, p):
    """Pitch acceleration [rad/s^2] by all effects that are switched on."""
    a = p.constant_torque_pitch
    if p.dry_friction_pitch != 0.0:
        a += dry_friction(pitch_rate, p.dry_friction_pitch)
    if p.breakaway_friction_pitch != 0.0:
        a += breakaway_friction(pitch_rate, p.breakaway_friction_pitch, p.stribeck_rate_pitch)
    if p.quadratic_drag_pitch != 0.0:
        a += quadratic_drag(pitch_rate, p.quadratic_drag_pitch)
    if p.rotor_mismatch_pitch != 0.0:
        a += rotor_mismatch(mu_sum, p.rotor_mismatch_pitch)
    if p.airspeed_thrust_loss_pitch != 0.0:
        a += airspeed_thrust_loss_pitch(mu_sum, pitch_rate, p.airspeed_thrust_loss_pitch)
    if p.gyroscopic_coupling_pitch != 0.0:
        a += gyroscopic_coupling_pitch(mu_sum, elevation_rate, p.gyroscopic_coupling_pitch)
    if p.pitch_gravity_coupling_pitch != 0.0:
        a += pitch_gravity_coupling(pitch, elevation, p.a_th, p.theta0, p.pitch_gravity_coupling_pitch)
    return a


def neglected_elevation(t, pitch, elevation, pitch_rate, elevation_rate, travel_rate, mu_sum, p):
    """Elevation acceleration [rad/s^2] by all effects that are switched on."""
    a = 0.0
    if p.dry_friction_elevation != 0.0:
        a += dry_friction(elevation_rate, p.dry_friction_elevation)
    if p.breakaway_friction_elevation != 0.0:
        a += breakaway_friction(elevation_rate, p.breakaway_friction_elevation, p.stribeck_rate_elevation)
    if p.quadratic_drag_elevation != 0.0:
        a += quadratic_drag(elevation_rate, p.quadratic_drag_elevation)
    if p.airspeed_thrust_loss_elevation != 0.0:
        a += airspeed_thrust_loss_elevation(mu_sum, elevation_rate, pitch, p.airspeed_thrust_loss_elevation)
    if p.gyroscopic_coupling_elevation != 0.0:
        a += gyroscopic_coupling_elevation(mu_sum, pitch_rate, p.gyroscopic_coupling_elevation)
    if p.inertial_coupling_elevation != 0.0:
        from_horizontal = elevation + p.horizontal_offset
        a += inertial_coupling_elevation(from_horizontal, travel_rate, p.inertial_coupling_elevation)
    if p.large_angle_gravity_elevation != 0.0:
        a += large_angle_gravity(elevation, p.a_e, p.a_1, p.large_angle_gravity_elevation)
    if p.ground_effect_elevation != 0.0:
        lift = p.k_z * mu_sum * cos(pitch)
        a += ground_effect(lift, elevation, p.ground_effect_elevation, p.ground_elevation, p.ground_height)
    if p.moving_mass_elevation != 0.0:
        a += moving_mass(t, p.moving_mass_elevation, p.moving_mass_time)
    return a


def neglected_travel(pitch, elevation, travel, elevation_rate, travel_rate, cable_rest, mu_sum, p):
    """Travel acceleration [rad/s^2] by all effects that are switched on."""
    a = p.constant_torque_travel
    if p.dry_friction_travel != 0.0:
        a += dry_friction(travel_rate, p.dry_friction_travel)
    if p.breakaway_friction_travel != 0.0:
        a += breakaway_friction(travel_rate, p.breakaway_friction_travel, p.stribeck_rate_travel)
    if p.quadratic_drag_travel != 0.0:
        a += quadratic_drag(travel_rate, p.quadratic_drag_travel)
    if p.rotor_drag_torque_travel != 0.0:
        a += rotor_drag_torque(mu_sum, pitch, elevation, p.rotor_drag_torque_travel)
    if p.cable_stiffness_travel != 0.0:
        a += cable_stiffness(travel, cable_rest, p.cable_stiffness_travel)
    if p.inertial_coupling_travel != 0.0:
        from_horizontal = elevation + p.horizontal_offset
        a += inertial_coupling_travel(from_horizontal, elevation_rate, travel_rate, p.inertial_coupling_travel)
    return a
