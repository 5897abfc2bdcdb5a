"""What may change on a rig, each as a direction in the space of the axes' regressors.

The acceleration of an axis is linear in what may change: with the thrust voltages mu_d, mu_s [V] of the twin in use,

    pitch      theta''   = ... + dk_x mu_d + ...              regressors  mu_d, mu_s, 1, -theta'
    elevation  epsilon'' = ... + dk_z mu_s cos(theta) + ...   regressors  (mu_s, mu_d) cos(theta), -1, -epsilon'
    travel     lambda''  = ... + dk_y mu_s sin(theta) + ...   regressors  (mu_s, mu_d) sin(theta), 1, -lambda'

Further regressors of each axis are the laws of the effects that may be switched on, with c = 1. Pitch and elevation end
with the law of their stiffness, -sin(theta - theta_0) and -epsilon: the stiffness is not among the changes, but the
twin's value of it is never exact (:mod:`.evidence`). A change of size delta adds delta D to the coefficients of these
regressors. A gain has one entry in D. A rotor that loses the share delta of its thrust F = (mu_s +- mu_d)/2 has entries
on all three axes. This distinguishes it from a change of one gain.
"""

from math import cos, inf, sin, sqrt
from typing import NamedTuple

from heli_plant.effects import AXES, effect_of
from heli_plant.laws import added_elevation, added_pitch, added_travel
from heli_plant.observer import DAMPINGS, EFFECTS, GAINS
from heli_plant.parameters import BY_FIELD, PlantParameters, in_slots
from heli_plant.state import PlantState

PITCH, ELEVATION, TRAVEL = range(3)
"""Numbers of the axes."""

Vector = tuple[float, ...]
Matrix = tuple[Vector, ...]

LAWS = ("dry_friction_pitch",), ("dry_friction_elevation",), ("dry_friction_travel", "cable_stiffness_travel")
"""Effects by axis that have a regressor of their own; a constant torque is the regressor 1."""

_ACCELERATIONS = tuple(
    (acceleration, [in_slots(PlantParameters(**{field: 1.0})) for field in fields])
    for acceleration, fields in zip((added_pitch, added_elevation, added_travel), LAWS, strict=True)
)
"""For each axis: the acceleration by effects, and the parameters with which one effect alone acts, with c = 1."""

Direction = tuple[tuple[int, int, float], ...]
"""D: axis, regressor and value of every entry that is not zero."""

_OFFSET_COLUMN, _DAMPING_COLUMN, _EFFECT_COLUMN = 2, 3, 4  # regressors of each axis; effects begin at the last one
_GAIN_SHARE, _THRUST_SHARE = 0.15, 0.1  # smallest change of a gain and of a rotor's thrust that matters [1]

_OFFSET, _DAMPING, _FRICTION, _CABLE = 0.04, 0.15, 0.02, 0.04
"""Smallest change that matters of an offset torque [rad/s^2], a damping [1/s], a dry friction [rad/s^2] and of any
other effect [its unit]."""

_SHARE_ERROR, _MISMATCH_ERROR, _OFFSET_ERROR, _DAMPING_ERROR, _EFFECT_ERROR = 0.01, 0.003, 0.004, 0.01, 0.1
"""Standard deviations of a diagnosis from a few minutes of flight: of gains and stiffnesses [share], of the difference
of the rotors' thrusts [share], of the balance of torques in hover [rad/s^2], of a damping [1/s], and of an effect
[share of the smallest change that matters]."""

_HOVER = 5.0
"""Sum of the voltages in hover, about [V]. There the offset of the elevation balances the gain: their errors go
together."""

_FRONT, _REAR = "share_front", "share_rear"
_ROTORS = (
    ("rotor.front", (_FRONT,), 0.5, 0.5), ("rotor.rear", (_REAR,), 0.5, -0.5), ("rotor.both", (_FRONT, _REAR), 1.0, 0.0)
)  # fmt: skip
"""Name, fields of the shares of thrust, and entries of D for the first two regressors [share of the gain]."""


class Change(NamedTuple):
    """One thing that may change.

    ``name`` as in parameter sets; the ``fields`` of the plant's parameters that it changes, by the same share of each
    if it is ``of_rotors``; numbers of the ``axes`` on which it acts; ``entries`` of D, for the rotors to be multiplied
    by the axis' gain; ``size``: the smallest change that matters [unit of the parameter, or share of a rotor's thrust];
    bounds of the value after the change.
    """

    name: str
    fields: tuple[str, ...]
    of_rotors: bool
    axes: tuple[int, ...]
    entries: Direction
    size: float
    lower: float
    upper: float

    def direction(self, p: PlantParameters) -> Direction:
        """Return D for a twin with the parameters ``p``."""
        if not self.of_rotors:
            return self.entries
        return tuple([(axis, column, share * getattr(p, GAINS[axis])) for axis, column, share in self.entries])

    def value(self, p: PlantParameters) -> float:
        """Return the value that changes; for both rotors, the front one's share."""
        return getattr(p, self.fields[0])

    def apply(self, size: float, p: PlantParameters) -> PlantParameters:
        """Return ``p`` after a change of ``size``."""
        before = {field: getattr(p, field) for field in self.fields}
        return p._replace(**{name: x * (1.0 + size) if self.of_rotors else x + size for name, x in before.items()})

    def bounds(self, p: PlantParameters) -> tuple[float, float]:
        """Return the smallest and the largest size that are physically possible."""
        value = self.value(p)
        lower, upper = self.lower - value, self.upper - value
        return (lower / value, upper / value) if self.of_rotors else (lower, upper)


def smallest_size(field: str) -> float:
    """Return the smallest change of an effect's coefficient that matters [its unit]."""
    return {"dry_friction": _FRICTION, "constant_torque": _OFFSET}.get(effect_of(field).name, _CABLE)


def list_changes(p: PlantParameters) -> tuple[Change, ...]:
    """Return everything that may change on a rig whose twin has the parameters ``p``."""
    changes: list[Change] = []

    def add(field: str, axis: int, column: int, size: float, low: float, high: float) -> None:
        changes.append(Change(BY_FIELD[field].name, (field,), False, (axis,), ((axis, column, 1.0),), size, low, high))

    for axis, field in enumerate(GAINS):
        value = getattr(p, field)
        low, high = sorted((value / 3.0, 3.0 * value))  # a gain keeps its sign
        add(field, axis, 0, _GAIN_SHARE * abs(value), low, high)
    add("a_1", ELEVATION, _OFFSET_COLUMN, _OFFSET, -inf, inf)
    for axis, field in enumerate(DAMPINGS):
        add(field, axis, _DAMPING_COLUMN, _DAMPING, 0.0, inf)
    first_effect = len(changes)
    for field in EFFECTS:
        axis, parameter = AXES.index(effect_of(field).axis), BY_FIELD[field]
        column = _EFFECT_COLUMN + LAWS[axis].index(field) if field in LAWS[axis] else _OFFSET_COLUMN
        add(field, axis, column, smallest_size(field), parameter.minimum, parameter.maximum)
    rotors = []
    for name, fields, first, second in _ROTORS:
        entries = tuple([entry for axis in range(3) for entry in ((axis, 0, first), (axis, 1, second))])
        rotors.append(Change(name, fields, True, (PITCH, ELEVATION, TRAVEL), entries, _THRUST_SHARE, 0.2, 1.5))
    return (*changes[:first_effect], *rotors, *changes[first_effect:])


def prior_deviations(p: PlantParameters) -> Matrix:
    """Return for each axis the standard deviations by which a twin's coefficients of the regressors err."""
    deviations = []
    for axis, stiffness in enumerate((p.a_th, p.a_e, 0.0)):
        k = abs(getattr(p, GAINS[axis]))
        balance = _SHARE_ERROR * k * _HOVER if axis == ELEVATION else 0.0
        offset = sqrt(_OFFSET_ERROR * _OFFSET_ERROR + balance * balance)
        row = [_SHARE_ERROR * k, _MISMATCH_ERROR * k, offset, _DAMPING_ERROR]
        row += [_EFFECT_ERROR * smallest_size(field) for field in LAWS[axis]]
        deviations.append(tuple(row if axis == TRAVEL else [*row, _SHARE_ERROR * abs(stiffness)]))
    return tuple(deviations)


def regress_motion(
    state: PlantState, mu_diff: float, mu_sum: float, theta0: float
) -> tuple[list[float], list[float], list[float]]:
    """Return the regressors of pitch, elevation and travel [rad/s^2 per unit of their coefficients].

    ``state`` as the observer sees it; ``mu_diff``, ``mu_sum``: difference and sum of the rotors' thrust voltages [V];
    ``theta0``: pitch at which gravity has no torque [rad].
    """
    th, ep, la, w1, w2, w3, _, _, _, _, _, cable_rest = state
    cos_th, sin_th = cos(th), sin(th)
    effects = [
        [acceleration(0.0, th, ep, la, w1, w2, w3, mu_sum, mu_diff, cable_rest, slots) for slots in effects_alone]
        for acceleration, effects_alone in _ACCELERATIONS
    ]
    return (
        [mu_diff, mu_sum, 1.0, -w1, *effects[0], -sin(th - theta0)],
        [mu_sum * cos_th, mu_diff * cos_th, -1.0, -w2, *effects[1], -ep],
        [mu_sum * sin_th, mu_diff * sin_th, 1.0, -w3, *effects[2]],
    )
