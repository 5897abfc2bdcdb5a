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

PITCH, ELEVATION, TRAVEL = range(3)
"""Numbers of the axes."""

Laws = tuple[tuple[Candidate, ...], ...]
"""Laws of the effects that may be switched on, by axis; a constant torque is the regressor 1."""

Direction = tuple[tuple[int, int, float], ...]
"""D: axis, regressor and value of every entry that is not zero."""

_COMMON = 4  # regressors of each axis before those of the effects
_GAIN_SHARE, _THRUST_SHARE = 0.15, 0.1  # smallest change of a gain and of a rotor's thrust that matters [1]

_OFFSET, _DAMPING, _FRICTION, _CABLE = 0.04, 0.15, 0.02, 0.04
"""Smallest change that matters of an offset torque [rad/s^2], a damping [1/s], a dry friction [rad/s^2] and of any
other effect [its unit]."""

_ROTORS = (("rotor.front", (-2,), 0.5, 0.5), ("rotor.rear", (-1,), 0.5, -0.5), ("rotors.thrust", (-2, -1), 1.0, 0.0))
"""Names, places in the values of a twin, and entries of D, as shares of the gain, for the first two regressors."""


class Change(NamedTuple):
    """One thing that may change.

    ``name`` as in parameter sets; ``field`` of :class:`heli_plant.parameters.PlantParameters`, empty for the rotors;
    numbers of the ``axes`` on which it acts; ``places`` of what it changes among the values of a twin; ``entries`` of
    D, to be multiplied by the axis' gain if ``times_gain``; ``size``: the smallest change that matters [unit of the
    parameter]; bounds of the value after the change. The size of a rotor's change is a share of its thrust.
    """

    name: str
    field: str
    axes: tuple[int, ...]
    places: tuple[int, ...]
    entries: Direction
    times_gain: bool
    size: float
    lower: float
    upper: float

    def direction(self, values: tuple[float, ...]) -> Direction:
        """Return D for a twin with these ``values``, of which the gains k_x, k_z, k_y stand first."""
        if not self.times_gain:
            return self.entries
        return tuple([(axis, column, share * values[axis]) for axis, column, share in self.entries])

    def value(self, values: tuple[float, ...]) -> float:
        """Return the value that is changed; of both rotors, the front one's share."""
        return values[self.places[0]]

    def applied(self, size: float, values: tuple[float, ...]) -> tuple[float, ...]:
        """Return ``values`` after a change of ``size``."""
        after = list(values)
        for place in self.places:
            after[place] = after[place] + size if self.field else after[place] * (1.0 + size)
        return tuple(after)

    def bounds(self, values: tuple[float, ...]) -> tuple[float, float]:
        """Return the smallest and largest size that is physically possible."""
        value = self.value(values)
        least, most = self.lower - value, self.upper - value
        return (least, most) if self.field else (least / value, most / value)


def smallest_size(name: str, unit: str) -> float:
    """Return the smallest change that matters of an effect by its ``name`` and the ``unit`` of its coefficient."""
    return _FRICTION if name == "dry_friction" else {"rad/s^2": _OFFSET, "1/s": _DAMPING}.get(unit, _CABLE)


def list_laws(effects: tuple[tuple[str, str], ...]) -> Laws:
    """Return the laws of ``effects`` (name, axis) by axis."""
    return tuple(
        [
            tuple([candidate(name, own) for name, own in effects if own == axis and name != "constant_torque"])
            for axis in AXES
        ]
    )


def list_changes(p: PlantParameters, effects: tuple[tuple[str, str], ...], laws: Laws) -> tuple[Change, ...]:
    """Return everything that may change about a twin with the parameters ``p``."""
    found: list[Change] = []

    def add(
        name: str, field: str, axis: int, column: int, size: float, low: float, high: float, times_gain: bool = False
    ) -> None:
        place, entry = len(found), (axis, column, 1.0)
        found.append(Change(name, field, (axis,), (place,), (entry,), times_gain, size, low, high))

    for axis, field in enumerate(("k_x", "k_z", "k_y")):
        value = getattr(p, field)
        low, high = sorted((value / 3.0, 3.0 * value))  # a gain keeps its sign
        add(BY_FIELD[field].name, field, axis, 0, _GAIN_SHARE * abs(value), low, high)
    add("elevation.offset", "a_1", ELEVATION, 2, _OFFSET, -inf, inf)
    for axis, field in enumerate(("a_wx", "a_wz", "a_wy")):
        add(f"{AXES[axis]}.damping", field, axis, 3, _DAMPING, 0.0, inf)
    before_rotors = len(found)
    for name, on in effects:
        axis, row = AXES.index(on), BY_FIELD[effect(name, on).field]
        names = [law.name for law in laws[axis]]
        place = names.index(name) if name in names else -1
        column, times_gain = (_COMMON + place, laws[axis][place].times_gain) if place >= 0 else (2, False)
        add(row.name, row.field, axis, column, smallest_size(name, row.unit), row.minimum, row.maximum, times_gain)
    rotors = []
    for name, places, share, apart in _ROTORS:
        entries = tuple([entry for axis in range(3) for entry in ((axis, 0, share), (axis, 1, apart))])
        rotors.append(Change(name, "", (PITCH, ELEVATION, TRAVEL), places, entries, True, _THRUST_SHARE, 0.2, 1.5))
    return (*found[:before_rotors], *rotors, *found[before_rotors:])


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
