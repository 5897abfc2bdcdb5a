"""What may change on a rig, each as a direction in the space of the axes' regressors.

The acceleration of an axis is linear in what may change: with the thrust voltages mu_d, mu_s [V] of the twin in use,

    pitch      theta''   = ... + dk_x mu_d + ...              regressors  mu_d, mu_s, 1, -theta'
    elevation  epsilon'' = ... + dk_z mu_s cos(theta) + ...   regressors  (mu_s, mu_d) cos(theta), -1, -epsilon'
    travel     lambda''  = ... + dk_y mu_s sin(theta) + ...   regressors  (mu_s, mu_d) sin(theta), 1, -lambda'

followed on each axis by the laws of the effects that may be switched on, with c = 1, and on pitch and elevation by
that of the axis' stiffness, -sin(theta - theta_0) and -epsilon: no change of it is looked for, but the twin's value of
it is never exact (:mod:`.baseline`). A change of size delta adds delta D to the coefficients of these regressors. A
gain has one entry in D. A rotor that loses the share delta of its thrust F = (mu_s +- mu_d)/2 has entries on all three
axes: that is how it differs from a change of one gain.
"""

from math import cos, inf, sin
from typing import NamedTuple

from heli_plant.effects import AXES, effect
from heli_plant.parameters import BY_FIELD, PlantParameters
from heli_plant.state import PlantState

from ..online import Candidate, Motion, candidate, candidate_value
from ..online.linear_algebra import bilinear_form

PITCH, ELEVATION, TRAVEL, ROTORS = 0, 1, 2, 3
"""Numbers of the axes; the rotors act on all."""

FRONT, REAR, BOTH = "rotor.front", "rotor.rear", "rotors.thrust"
"""Changes of the rotors: shares of thrust that are left [1]."""

Laws = tuple[tuple[Candidate, ...], tuple[Candidate, ...], tuple[Candidate, ...]]
"""Laws of the effects that may be switched on, by axis; a constant torque is the regressor 1."""

_COMMON = 4
"""Regressors of each axis before those of the effects."""

_GAIN_SHARE, _THRUST_SHARE = 0.15, 0.1
"""Smallest change of a gain and of a rotor's thrust that matters [1]."""

_OFFSET, _DAMPING, _FRICTION, _CABLE = 0.04, 0.15, 0.02, 0.04
"""Smallest change that matters of an offset torque [rad/s^2], a damping [1/s], a dry friction [rad/s^2] and of any
other effect [its unit]."""


class Change(NamedTuple):
    """One thing that may change.

    ``name`` as in parameter sets; ``field`` of :class:`heli_plant.parameters.PlantParameters`, empty for the rotors;
    ``axis`` by number; ``column`` of its axis' regressor, -1 for the rotors; ``size``: the smallest change that matters
    [unit of the parameter]; ``times_gain``: the coefficient is the parameter times the axis' gain; bounds of the value
    after the change.
    """

    name: str
    field: str
    axis: int
    column: int
    size: float
    times_gain: bool
    lower: float
    upper: float

    @property
    def axes(self) -> tuple[int, ...]:
        """Numbers of the axes on which the change acts."""
        return (PITCH, ELEVATION, TRAVEL) if self.axis == ROTORS else (self.axis,)


class Direction(NamedTuple):
    """D: coefficients of the regressors of pitch, elevation and travel (``rows``), and those of D^T R D (``squares``).

    The squares of an axis whose row is zero are empty.
    """

    rows: tuple[tuple[float, ...], ...]
    squares: tuple[tuple[float, ...], ...]


def smallest_size(name: str, unit: str) -> float:
    """Return the smallest change that matters of an effect by its ``name`` and the ``unit`` of its coefficient."""
    return _FRICTION if name == "dry_friction" else {"rad/s^2": _OFFSET, "1/s": _DAMPING}.get(unit, _CABLE)


def list_laws(effects: tuple[tuple[str, str], ...]) -> Laws:
    """Return the laws of ``effects`` (name, axis) by axis."""
    a, b, c = (
        tuple([candidate(name, own) for name, own in effects if own == axis and name != "constant_torque"])
        for axis in AXES
    )
    return a, b, c


def list_changes(p: PlantParameters, effects: tuple[tuple[str, str], ...], laws: Laws) -> tuple[Change, ...]:
    """Return everything that may change about a twin with the parameters ``p``."""
    changes = []
    for field, axis in (("k_x", PITCH), ("k_z", ELEVATION), ("k_y", TRAVEL)):
        value = getattr(p, field)
        low, high = sorted((value / 3.0, 3.0 * value))  # a gain keeps its sign
        changes.append(Change(BY_FIELD[field].name, field, axis, 0, _GAIN_SHARE * abs(value), False, low, high))
    changes.append(Change("elevation.offset", "a_1", ELEVATION, 2, _OFFSET, False, -inf, inf))
    for field, axis in (("a_wx", PITCH), ("a_wz", ELEVATION), ("a_wy", TRAVEL)):
        changes.append(Change(f"{AXES[axis]}.damping", field, axis, 3, _DAMPING, False, 0.0, inf))
    changes += [Change(name, "", ROTORS, -1, _THRUST_SHARE, False, 0.2, 1.5) for name in (FRONT, REAR, BOTH)]
    for name, on in effects:
        axis = AXES.index(on)
        row = BY_FIELD[effect(name, on).field]
        column, times_gain = 2, False
        for place, law in enumerate(laws[axis]):
            if law.name == name:
                column, times_gain = _COMMON + place, law.times_gain
        size = smallest_size(name, row.unit)
        changes.append(Change(row.name, row.field, axis, column, size, times_gain, row.minimum, row.maximum))
    return tuple(changes)


def regress_motion(
    state: PlantState, mu_diff: float, mu_sum: float, laws: Laws, theta0: float
) -> tuple[list[float], list[float], list[float]]:
    """Return the regressors of pitch, elevation and travel [rad/s^2 per unit of their coefficients].

    ``state`` as the observer sees it; ``mu_diff``, ``mu_sum``: difference and sum of the rotors' thrust voltages [V];
    ``theta0``: pitch at which gravity has no torque [rad].
    """
    th, ep, la, w1, w2, w3, nu_front, nu_rear, _, _, _, rest = state
    up, aside = cos(th), sin(th)
    motion = Motion(th, ep, la, w1, w2, w3, nu_front, nu_rear, rest)
    effects = [[candidate_value(law, motion) for law in own] for own in laws]
    return (
        [mu_diff, mu_sum, 1.0, -w1, *effects[0], -sin(th - theta0)],
        [mu_sum * up, mu_diff * up, -1.0, -w2, *effects[1], -ep],
        [mu_sum * aside, mu_diff * aside, 1.0, -w3, *effects[2]],
    )


def find_directions(
    changes: tuple[Change, ...], gains: tuple[float, float, float], columns: tuple[int, int, int]
) -> tuple[Direction, ...]:
    """Return D of every change; ``gains`` k_x, k_z, k_y in use [rad/s^2/V]; ``columns``: regressors of each axis."""
    found: list[Direction] = []
    for change in changes:
        rows = [[0.0] * n for n in columns]
        if change.axis != ROTORS:
            rows[change.axis][change.column] = gains[change.axis] if change.times_gain else 1.0
        else:
            share, apart = {FRONT: (0.5, 0.5), REAR: (0.5, -0.5), BOTH: (1.0, 0.0)}[change.name]
            for row, k in zip(rows, gains, strict=True):
                row[:2] = share * k, apart * k
        squares = tuple([tuple(bilinear_form(row, row)) if any(row) else () for row in rows])
        found.append(Direction(tuple([tuple(row) for row in rows]), squares))
    return tuple(found)
