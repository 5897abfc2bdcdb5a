"""Every number that the simulated rig depends on, as flat tuples of floats that compiled code takes."""

from collections import namedtuple
from typing import TYPE_CHECKING, NamedTuple

AXES = ("pitch", "elevation", "travel")

BASE = {
    "a_wx": 0.060, "a_th": 0.664, "k_x": 0.293, "theta0": -0.13613568165555773,
    "a_wz": 0.032, "a_e": 2.59, "a_1": -0.142, "a_lt": 0.026, "k_z": 0.157,
    "a_wy": 0.114, "k_y": -0.112, "t_m": 0.08,
}  # fmt: skip
"""Base model, eqs (2), (10), (12), (9), by the paper's names. [1/s], [1/s^2], [rad/s^2/V], [rad], [s]"""

ON_AXES = {
    "dry_friction": AXES, "breakaway_friction": AXES, "quadratic_drag": AXES, "constant_torque": ("pitch", "travel"),
    "airspeed_thrust_loss": ("pitch", "elevation"), "gyroscopic_coupling": ("pitch", "elevation"),
    "inertial_coupling": AXES, "translational_lift": ("elevation", "travel"),
}  # fmt: skip
"""Effects with a coefficient on each of several axes; in `Coefficients` its name ends with the axis."""

ALONE = (
    "quadratic_thrust", "reverse_thrust_loss", "dead_zone", "motor_lag", "input_delay", "thrust_fade", "rotor_mismatch",
    "speed_stability", "rotor_drag_torque", "cable_stiffness", "thrust_tilt", "large_angle_gravity",
    "pitch_gravity_coupling", "ground_effect", "moving_mass", "arm_bending", "product_of_inertia",
)  # fmt: skip
"""Effects with one coefficient."""

SHAPES = {
    "stribeck_rate": 0.05, "presliding": 0.0, "ground_angle": -0.2, "ground_length": 0.15, "mass_time": 0.0,
    "bending_frequency": 3.0, "bending_damping": 0.05, "elevation_zero": 0.0, "table_angle": -9.0,
}  # fmt: skip
"""Further numbers of the laws [rad/s], [rad], [s], [Hz], [1]; the arm is horizontal where the elevation encoder reads
minus `elevation_zero` [rad], and lies on a table that gives way below `table_angle` [rad]."""

_NUMBERS = BASE | dict.fromkeys([f"{own}_{axis}" for own in ON_AXES for axis in ON_AXES[own]], 0.0)
_NUMBERS |= dict.fromkeys(ALONE, 0.0) | SHAPES


class Coefficients(namedtuple("Coefficients", _NUMBERS, defaults=_NUMBERS.values())):
    """Numbers of the plant; those of an effect are zero when it is off."""

    __slots__ = ()
    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> float: ...


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
