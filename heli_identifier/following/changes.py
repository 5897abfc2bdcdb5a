"""What may change on a rig, each as a direction in the space of the axes' regressors.

The acceleration of an axis is linear in what may change: with the thrust voltages mu_d, mu_s [V] of the twin in use,

    pitch      theta''   = ... + dk_x mu_d + ...              regressors  mu_d, mu_s, 1, -theta'
    elevation  epsilon'' = ... + dk_z mu_s cos(theta) + ...   regressors  (mu_s, mu_d) cos(theta), -1, -epsilon'
    travel     lambda''  = ... + dk_y mu_s sin(theta) + ...   regressors  (mu_s, mu_d) sin(theta), 1, -lambda'

followed on each axis by the laws of the effects that may be switched on, with c = 1, and on pitch and elevation by
that of the axis' stiffness, -sin(theta - theta_0) and -epsilon: no change of it is looked for, but the twin's value of
it is never exact (:mod:`.baseline`). A change of size delta adds
delta D to the coefficients of these regressors. A gain has one entry in D. A rotor that loses the share delta of its
thrust F = (mu_s +- mu_d)/2 has entries on all three axes: that is how it differs from a change of one gain.
"""

from math import inf
from typing import NamedTuple

from heli_plant.effects import AXES, effect
from heli_plant.parameter_table import BY_FIELD
from heli_plant.parameters import PlantParameters

from ..online import Candidate, candidate

PITCH, ELEVATION, TRAVEL, ROTORS = 0, 1, 2, 3
"""Numbers of the axes; the rotors act on all."""

COMMON = 4
"""Regressors of each axis before those of the effects."""

FRONT, REAR, BOTH = "rotor.front", "rotor.rear", "rotors.thrust"
"""Changes of the rotors: shares of thrust that are left [1]."""


class Change(NamedTuple):
    """One thing that may change.

    ``name`` as in parameter sets; ``field`` of :class:`heli_plant.parameters.PlantParameters`, empty for the rotors;
    ``axis`` by number; ``column`` of its axis' regressor, -1 for the rotors; ``size``: the smallest change that matters
    [unit of the parameter], or as a share of the value where ``relative``; bounds of the value after the change.
    """

    name: str
    field: str
    axis: int
    column: int
    size: float
    relative: bool
    lower: float
    upper: float


_GAIN_SHARE, _THRUST_SHARE = 0.15, 0.1
"""Smallest change of a gain and of a rotor's thrust that matters [1]."""

_OFFSET, _DAMPING, _FRICTION, _CABLE = 0.04, 0.15, 0.02, 0.04
"""Smallest change that matters of an offset torque [rad/s^2], a damping [1/s], a dry friction [rad/s^2] and of any
other effect [its unit]."""

_SIZES = {"rad/s^2": _OFFSET, "1/s": _DAMPING}


def changes(p: PlantParameters, effects: tuple[tuple[str, str], ...]) -> tuple[Change, ...]:
    """Return everything that may change about a twin with the parameters ``p``."""
    bank = [
        _gain("k_x", PITCH, p.k_x),
        _gain("k_z", ELEVATION, p.k_z),
        _gain("k_y", TRAVEL, p.k_y),
        Change("elevation.offset", "a_1", ELEVATION, 2, _OFFSET, False, -inf, inf),
        Change("pitch.damping", "a_wx", PITCH, 3, _DAMPING, False, 0.0, inf),
        Change("elevation.damping", "a_wz", ELEVATION, 3, _DAMPING, False, 0.0, inf),
        Change("travel.damping", "a_wy", TRAVEL, 3, _DAMPING, False, 0.0, inf),
        *(Change(name, "", ROTORS, -1, _THRUST_SHARE, False, 0.2, 1.5) for name in (FRONT, REAR, BOTH)),
    ]
    taken = [COMMON, COMMON, COMMON]
    for name, axis in effects:
        number = AXES.index(axis)
        row = BY_FIELD[effect(name, axis).field]
        size = smallest_of(name, row.unit)
        column = taken[number]
        if name == "constant_torque":
            column = 2
        else:
            taken[number] += 1
        bank.append(Change(row.name, row.field, number, column, size, False, row.minimum, row.maximum))
    return tuple(bank)


def smallest_of(name: str, unit: str) -> float:
    """Return the smallest change that matters of an effect by its ``name`` and the ``unit`` of its coefficient."""
    return _FRICTION if name == "dry_friction" else _SIZES.get(unit, _CABLE)


def _gain(field: str, axis: int, value: float) -> Change:
    """Change of a gain, which keeps its sign and stays within three times its value."""
    low, high = sorted((value / 3.0, 3.0 * value))
    return Change(BY_FIELD[field].name, field, axis, 0, _GAIN_SHARE, True, low, high)


def laws(effects: tuple[tuple[str, str], ...]) -> tuple[tuple[Candidate, ...], ...]:
    """Return the laws that follow the common regressors on pitch, elevation and travel."""
    return tuple(
        tuple(candidate(name, own) for name, own in effects if own == axis and name != "constant_torque")
        for axis in AXES
    )
