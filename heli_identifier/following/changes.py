"""What may change on a rig, each as a direction in the space of the axes' regressors.

The acceleration of an axis is linear in what may change: with the thrust voltages mu_d, mu_s [V] of the twin in use,

    pitch      theta''   = ... + dk_x mu_d + ...              regressors  mu_d, mu_s, 1, -theta'
    elevation  epsilon'' = ... + dk_z mu_s cos(theta) + ...   regressors  (mu_s, mu_d) cos(theta), -1, -epsilon'
    travel     lambda''  = ... + dk_y mu_s sin(theta) + ...   regressors  (mu_s, mu_d) sin(theta), 1, -lambda'

followed on each axis by the laws of the effects that may be switched on, with c = 1, and on pitch and elevation by
that of the axis' stiffness, -sin(theta - theta_0) and -epsilon: no change of it is looked for, but the twin's value of
it is never exact (:mod:`.evidence`). A change of size delta adds delta D to the coefficients of these regressors. A
gain has one entry in D. A rotor that loses the share delta of its thrust F = (mu_s +- mu_d)/2 has entries on all three
axes: that is how it differs from a change of one gain.
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

_ADDED = tuple(
    (added, [in_slots(PlantParameters(**{field: 1.0})) for field in own])
    for added, own in zip((added_pitch, added_elevation, added_travel), LAWS, strict=True)
)

Direction = tuple[tuple[int, int, float], ...]
"""D: axis, regressor and value of every entry that is not zero."""

_OFFSET_COLUMN, _DAMPING_COLUMN, _COMMON = 2, 3, 4  # regressors of each axis; those of the effects begin at _COMMON
_GAIN_SHARE, _THRUST_SHARE = 0.15, 0.1  # smallest change of a gain and of a rotor's thrust that matters [1]

_OFFSET, _DAMPING, _FRICTION, _CABLE = 0.04, 0.15, 0.02, 0.04
"""Smallest change that matters of an offset torque [rad/s^2], a damping [1/s], a dry friction [rad/s^2] and of any
other effect [its unit]."""

_SHARE_ERROR, _MISMATCH_ERROR, _OFFSET_ERROR, _DAMPING_ERROR, _EFFECT_ERROR = 0.01, 0.003, 0.004, 0.01, 0.1
"""Standard deviations before the flight, the errors of diagnoses from a few minutes: of gains and stiffnesses, and of
what a rotor has more thrust than the other, as shares; of the balance of torques in hover [rad/s^2] and of a damping
[1/s]; of an effect, as a share of the smallest change that matters."""

_HOVER = 5.0
"""Sum of the voltages in hover, about [V]: there the offset of the elevation balances the gain, and errs with it."""

_ROTORS = (("rotor.front", (-2,), 0.5, 0.5), ("rotor.rear", (-1,), 0.5, -0.5), ("rotor.both", (-2, -1), 1.0, 0.0))
"""Names, places in the values of a twin, and entries of D, as shares of the gain, for the first two regressors."""


class Change(NamedTuple):
    """One thing that may change.

    ``name`` as in parameter sets; ``field`` of :class:`heli_plant.parameters.PlantParameters`, empty for the rotors;
    numbers of the ``axes`` on which it acts; ``places`` of what it changes among the values of a twin; ``entries`` of
    D, those of the rotors to be multiplied by the axis' gain; ``size``: the smallest change that matters [unit of the
    parameter]; bounds of the value after the change. The size of a rotor's change is a share of its thrust.
    """

    name: str
    field: str
    axes: tuple[int, ...]
    places: tuple[int, ...]
    entries: Direction
    size: float
    lower: float
    upper: float

    def direction(self, values: Vector) -> Direction:
        """Return D for a twin with these ``values``, of which the gains k_x, k_z, k_y stand first."""
        if self.field:
            return self.entries
        return tuple([(axis, column, share * values[axis]) for axis, column, share in self.entries])

    def value(self, values: Vector) -> float:
        """Return the value that is changed; of both rotors, the front one's share."""
        return values[self.places[0]]

    def apply(self, size: float, values: Vector) -> Vector:
        """Return ``values`` after a change of ``size``."""
        after = list(values)
        for place in self.places:
            after[place] = after[place] + size if self.field else after[place] * (1.0 + size)
        return tuple(after)

    def bounds(self, values: Vector) -> tuple[float, float]:
        """Return the smallest and largest size that is physically possible."""
        value = self.value(values)
        least, most = self.lower - value, self.upper - value
        return (least, most) if self.field else (least / value, most / value)


def smallest_size(field: str) -> float:
    """Return the smallest change that matters of the coefficient of an effect [its unit]."""
    return {"dry_friction": _FRICTION, "constant_torque": _OFFSET}.get(effect_of(field).name, _CABLE)


def list_changes(p: PlantParameters) -> tuple[Change, ...]:
    """Return everything that may change about a twin with the parameters ``p``."""
    own: list[Change] = []

    def add(field: str, axis: int, column: int, size: float, low: float, high: float) -> None:
        place, entries = len(own), ((axis, column, 1.0),)
        own.append(Change(BY_FIELD[field].name, field, (axis,), (place,), entries, size, low, high))

    for axis, field in enumerate(GAINS):
        value = getattr(p, field)
        low, high = sorted((value / 3.0, 3.0 * value))  # a gain keeps its sign
        add(field, axis, 0, _GAIN_SHARE * abs(value), low, high)
    add("a_1", ELEVATION, _OFFSET_COLUMN, _OFFSET, -inf, inf)
    for axis, field in enumerate(DAMPINGS):
        add(field, axis, _DAMPING_COLUMN, _DAMPING, 0.0, inf)
    before_rotors = len(own)
    for field in EFFECTS:
        axis, row = AXES.index(effect_of(field).axis), BY_FIELD[field]
        column = _COMMON + LAWS[axis].index(field) if field in LAWS[axis] else _OFFSET_COLUMN
        add(field, axis, column, smallest_size(field), row.minimum, row.maximum)
    rotors = []
    for name, places, share, apart in _ROTORS:
        entries = tuple([entry for axis in range(3) for entry in ((axis, 0, share), (axis, 1, apart))])
        rotors.append(Change(name, "", (PITCH, ELEVATION, TRAVEL), places, entries, _THRUST_SHARE, 0.2, 1.5))
    return (*own[:before_rotors], *rotors, *own[before_rotors:])


def prior_deviations(p: PlantParameters) -> Matrix:
    """Return for each axis by how much the coefficients of its regressors err, as standard deviations."""
    found = []
    for axis, stiffness in enumerate((p.a_th, p.a_e, 0.0)):
        k = abs(getattr(p, GAINS[axis]))
        balance = _SHARE_ERROR * k * _HOVER if axis == ELEVATION else 0.0
        offset = sqrt(_OFFSET_ERROR * _OFFSET_ERROR + balance * balance)
        own = [_SHARE_ERROR * k, _MISMATCH_ERROR * k, offset, _DAMPING_ERROR]
        own += [_EFFECT_ERROR * smallest_size(field) for field in LAWS[axis]]
        found.append(tuple(own if axis == TRAVEL else [*own, _SHARE_ERROR * abs(stiffness)]))
    return tuple(found)


def regress_motion(
    state: PlantState, mu_diff: float, mu_sum: float, theta0: float
) -> tuple[list[float], list[float], list[float]]:
    """Return the regressors of pitch, elevation and travel [rad/s^2 per unit of their coefficients].

    ``state`` as the observer sees it; ``mu_diff``, ``mu_sum``: difference and sum of the rotors' thrust voltages [V];
    ``theta0``: pitch at which gravity has no torque [rad].
    """
    th, ep, la, w1, w2, w3, _, _, _, _, _, rest = state
    up, aside = cos(th), sin(th)
    effects = [
        [added(0.0, th, ep, la, w1, w2, w3, mu_sum, mu_diff, rest, alone) for alone in own] for added, own in _ADDED
    ]
    return (
        [mu_diff, mu_sum, 1.0, -w1, *effects[0], -sin(th - theta0)],
        [mu_sum * up, mu_diff * up, -1.0, -w2, *effects[1], -ep],
        [mu_sum * aside, mu_diff * aside, 1.0, -w3, *effects[2]],
    )
