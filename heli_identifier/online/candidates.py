"""Effects of the catalogue that can be watched on line, each as one more regressor of an axis.

An effect that enters an axis' acceleration as c g(motion) is watched by the signal g, filtered as every other. g is
the plant's own law with c = 1 and every other parameter at zero; no law is written here again.

* On the axis itself (friction, couplings, constant torque, ...): g is what the law adds to the acceleration.
* In the rotors (quadratic_thrust, reverse_thrust_loss): g is the thrust voltage that the effect adds, in the place of
  mu_d, mu_s cos(theta) or mu_s sin(theta). Its coefficient is k c with k the axis' gain, as that of ground_effect,
  whose law is a share of the lift: divided by the estimate of k.

Left to the tracer, which sees whole records: effects whose time, delay, lag, width or frequency has to be searched,
and the two of gravity, which replace terms that are being estimated.
"""

from math import cos, sin
from typing import NamedTuple

from heli_plant.effects import effect
from heli_plant.neglected import neglected_elevation, neglected_pitch, neglected_travel
from heli_plant.parameters import PlantParameters
from heli_plant.rotors import thrust_voltages

from ..errors import ConfigurationError

_FRICTION = ("dry_friction", "breakaway_friction", "quadratic_drag")
_IN_ROTORS = ("quadratic_thrust", "reverse_thrust_loss")

WATCHABLE: dict[str, tuple[str, ...]] = {
    "pitch": (
        *_FRICTION,
        *("constant_torque", "rotor_mismatch", "airspeed_thrust_loss", "gyroscopic_coupling"),
        *_IN_ROTORS,
    ),
    "elevation": (
        *_FRICTION,
        *("airspeed_thrust_loss", "gyroscopic_coupling", "inertial_coupling", "ground_effect"),
        *_IN_ROTORS,
    ),
    "travel": (
        *_FRICTION,
        *("constant_torque", "rotor_drag_torque", "cable_stiffness", "inertial_coupling"),
        *_IN_ROTORS,
    ),
}
"""Names of the effects that can be watched, per axis."""


class Motion(NamedTuple):
    """What the laws depend on at one instant: angles [rad], rates [rad/s], nu_f and nu_r [V], travel at rest [rad]."""

    pitch: float
    elevation: float
    travel: float
    pitch_rate: float
    elevation_rate: float
    travel_rate: float
    nu_front: float
    nu_rear: float
    cable_rest: float


class Candidate(NamedTuple):
    """One watched effect: its ``name`` and ``axis``, its law's parameters, and what its coefficient stands for.

    ``in_rotors``: the law changes the thrust voltages. ``times_gain``: the coefficient is that of the effect times
    the axis' gain k.
    """

    name: str
    axis: str
    parameters: PlantParameters
    in_rotors: bool
    times_gain: bool


def candidate(name: str, axis: str) -> Candidate:
    """Return the candidate of the effect ``name`` watched on ``axis``.

    Raises
    ------
    ConfigurationError
        Unknown axis, or an effect that cannot be watched there; the message lists those that can.
    """
    if axis not in WATCHABLE:
        raise ConfigurationError(f"watched axis {axis!r} must be one of {', '.join(WATCHABLE)}")
    if name not in WATCHABLE[axis]:
        raise ConfigurationError(f"effect {name!r} cannot be watched on {axis}; choose of {', '.join(WATCHABLE[axis])}")
    in_rotors = name in _IN_ROTORS
    entry = effect(name, "rotors" if in_rotors else axis)
    alone = {field: 0.0 for field in PlantParameters._fields}
    alone |= {shape.field: shape.default for shape in entry.shapes}
    alone |= {entry.field: 1.0}
    lift_share = name == "ground_effect"
    if lift_share:
        alone["k_z"] = 1.0
    return Candidate(name, axis, PlantParameters(**alone), in_rotors, in_rotors or lift_share)


def candidate_value(c: Candidate, m: Motion) -> float:
    """Return g of the candidate for the motion ``m``: [rad/s^2] or [V] per unit of its coefficient."""
    total = m.nu_front + m.nu_rear
    if c.in_rotors:
        thrust_difference, thrust_total = thrust_voltages(m.nu_front, m.nu_rear, 0.0, c.parameters)
        if c.axis == "pitch":
            return thrust_difference - (m.nu_front - m.nu_rear)
        return (thrust_total - total) * (cos(m.pitch) if c.axis == "elevation" else sin(m.pitch))
    if c.axis == "pitch":
        return neglected_pitch(m.pitch, m.elevation, m.pitch_rate, m.elevation_rate, total, c.parameters)
    if c.axis == "elevation":
        return neglected_elevation(
            0.0, m.pitch, m.elevation, m.pitch_rate, m.elevation_rate, m.travel_rate, total, c.parameters
        )
    return neglected_travel(
        m.pitch, m.elevation, m.travel, m.elevation_rate, m.travel_rate, m.cable_rest, total, c.parameters
    )
