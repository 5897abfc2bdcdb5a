"""Effects of the catalogue that can be watched on line, each as one more regressor of an axis.

An effect that enters an axis' acceleration as c g(motion) is watched by the signal g, filtered as every other. g is
the plant's own law with c = 1; no law is written here again.

* On the axis itself (friction, couplings, constant torque, ...): g is what the law adds to the acceleration.
* In the rotors (place THRUST): g is the thrust voltage that the effect adds, in the place of mu_d, mu_s cos(theta) or
  mu_s sin(theta). The regression finds k c with k the axis' gain, as for an effect that is a share of the lift:
  divided by the estimate of k.

The tracer, which sees whole records, is left the effects whose time, delay, lag, width or frequency has to be
searched, and those of gravity, which replace terms that are being estimated.
"""

from collections.abc import Callable
from math import cos, sin
from typing import NamedTuple

from heli_plant.effects import AXES, CATALOGUE, ROTORS, effect
from heli_plant.laws import added_elevation, added_pitch, added_travel, thrust_voltage
from heli_plant.parameters import PlantParameters
from heli_plant.specialised import specialised

from ..errors import ConfigurationError

WATCHABLE: dict[str, tuple[str, ...]] = {
    axis: tuple(entry.name for entry in CATALOGUE if entry.watchable and entry.axis in (axis, ROTORS)) for axis in AXES
}
"""Names of the effects that can be watched, per axis."""

_SUMS = dict(zip(AXES, (added_pitch, added_elevation, added_travel), strict=True))


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
    """One watched effect: its ``name`` and ``axis``, its law, and what its coefficient stands for.

    ``law`` is the plant's, made for ``parameters`` in which c is 1 and all else is off. ``in_rotors``: it changes the
    thrust voltages. ``times_gain``: the regression finds c times the axis' gain k.
    """

    name: str
    axis: str
    law: Callable[..., float]
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
    in_rotors = (name, axis) not in {(entry.name, entry.axis) for entry in CATALOGUE}
    entry = effect(name, ROTORS if in_rotors else axis)
    alone = dict.fromkeys(PlantParameters._fields, 0.0)
    alone |= {shape.field: shape.default for shape in entry.shapes}
    alone |= {entry.field: 1.0, "k_z": 1.0}
    law = specialised(thrust_voltage if in_rotors else _SUMS[axis], alone)
    return Candidate(name, axis, law, PlantParameters(**alone), in_rotors, in_rotors or entry.share_of_lift)


def candidate_value(c: Candidate, m: Motion) -> float:
    """Return g of the candidate for the motion ``m``: [rad/s^2] or [V] per unit of its coefficient."""
    if c.in_rotors:
        front = c.law(m.nu_front, 0.0, c.parameters) - m.nu_front
        rear = c.law(m.nu_rear, 0.0, c.parameters) - m.nu_rear
        if c.axis == "pitch":
            return front - rear
        return (front + rear) * (cos(m.pitch) if c.axis == "elevation" else sin(m.pitch))
    return c.law(
        0.0,
        m.pitch,
        m.elevation,
        m.travel,
        m.pitch_rate,
        m.elevation_rate,
        m.travel_rate,
        m.nu_front + m.nu_rear,
        m.nu_front - m.nu_rear,
        m.cable_rest,
        c.parameters,
    )
