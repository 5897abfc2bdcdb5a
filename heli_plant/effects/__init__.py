# ruff: noqa: F401 - the modules below are read through globals()
"""The catalogue: every physical effect that the simplified model may lack, one file each.

A file holds all of one effect (:mod:`.definition` says what that is). To add one, write its file and name it in the
list below; parameters, the plant's sums, FMU variables, search, report and documentation follow from that.
Sources: section 2.3 of the paper (neglects) and its footnote on thrust asymmetry; eq. (1); LAAS report 18040.
"""

from .definition import (
    ACCELERATION,
    AXES,
    BENDING,
    DELAY,
    FRICTION,
    GRID,
    LAG,
    LOWEST_ELEVATION,
    ROTORS,
    STEP_TIMES,
    THRUST,
    VOLTAGE,
    Effect,
    Shape,
)

# In the catalogue's order, which parameters, FMU variables and reports follow.
# isort: off
from . import (
    dry_friction,
    breakaway_friction,
    quadratic_drag,
    constant_torque,
    rotor_mismatch,
    quadratic_thrust,
    reverse_thrust_loss,
    dead_zone,
    motor_lag,
    input_delay,
    thrust_fade,
    airspeed_thrust_loss,
    gyroscopic_coupling,
    rotor_drag_torque,
    thrust_tilt,
    translational_lift,
    cable_stiffness,
    inertial_coupling,
    large_angle_gravity,
    pitch_gravity_coupling,
    speed_stability,
    ground_effect,
    arm_bending,
    moving_mass,
)

# isort: on

CATALOGUE: tuple[Effect, ...] = tuple(
    entry for module in tuple(globals().values()) for entry in getattr(module, "EFFECTS", ())
)
"""Every effect on every axis that it acts on."""


def effect(name: str, axis: str) -> Effect:
    """Return the catalogue entry of an effect.

    Raises
    ------
    KeyError
        No entry has this name and axis.
    """
    for entry in CATALOGUE:
        if (entry.name, entry.axis) == (name, axis):
            return entry
    raise KeyError(f"no effect {name!r} on axis {axis!r} in the catalogue")


def effect_of(field: str) -> Effect:
    """Return the catalogue entry of a coefficient, by its field of the plant's parameters.

    Raises
    ------
    KeyError
        No entry has this field.
    """
    for entry in CATALOGUE:
        if entry.field == field:
            return entry
    raise KeyError(f"the field {field!r} is no coefficient of an effect in the catalogue")


def at(place: str, axis: str = ROTORS) -> tuple[Effect, ...]:
    """Return the effects of one axis, or of the rotors, that enter the plant at one place, in order."""
    return tuple(entry for entry in CATALOGUE if entry.place == place and entry.axis == axis)
