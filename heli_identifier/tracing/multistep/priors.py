"""Weak priors from physics, and the coordinates in which a fit moves.

Every field has a coordinate x that is standard normal before any log is seen: x = (p - m) / w, or for the gains, whose
sign is the wiring's, x = ln(|p| / m) / w. Bounds exclude what is impossible: a damping that drives, a friction that
pushes. The widths come from what can be built on a bench, not from any rig's logs:

* Dampings: a motion does not die out much faster than in a second.
* Pitch stiffness g d / l^2: the body's mass lies within some 2 cm above or below its axis, with l = .2 m to the rotors.
* Elevation stiffness: the period of the balanced arm is longer than some 3 s. Its offset: the counterweight leaves no
  more than a fifth of g / l with l = .6 m, about 3 rad/s^2.
* Gains: half of the voltage limit on both rotors lifts a balanced arm with about 1 rad/s^2. The travel turns the same
  mass on the same arm. The body's smaller inertia makes the pitch some three times faster. A factor of two is usual.
  That k_z and |k_y| are nearly one is no part of the prior: an effect that the travel lacks changes k_y by a factor of
  six, and would take k_z along.
* Effects of the catalogue: nothing is known but the plausible range, whose end lies three widths from zero; of those
  that theory demands, centre and width are given.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import copysign, exp, inf, log
from types import MappingProxyType

from heli_identifier.online import Estimate
from heli_identifier.tracing.prediction.fit import BASE
from heli_plant.effects import BENDING, CATALOGUE, LAG, STEP_TIMES, Effect, effect_of
from heli_plant.parameter_table import BY_FIELD
from heli_plant.parameters import PlantParameters

WIDTHS_IN_RANGE = 3.0
"""Widths of an effect's prior between zero and the end of its plausible range."""

FARTHEST = 4.0
"""Widths from its centre at which a gain may begin: a factor of sixteen."""

SHORTEST_LAG = 0.005
"""Shortest lag [s] that T_m and the effect motor_lag may leave together."""


@dataclass(frozen=True)
class Coordinate:
    """A field of the plant's parameters as a fit moves it.

    Attributes
    ----------
    field : str
    centre, width : float
        m and w, in the field's unit; of a gain m in its unit and w in its logarithm.
    lower, upper : float
        Bounds in the field's unit.
    sign : float
        Sign of a gain; 0 for a field whose coordinate is linear.
    """

    field: str
    centre: float
    width: float
    lower: float = -inf
    upper: float = inf
    sign: float = 0.0

    def value(self, x: float) -> float:
        """Give the field's value at a coordinate."""
        if self.sign:
            return self.sign * self.centre * exp(self.width * x)
        return self.centre + self.width * x

    def coordinate(self, value: float) -> float:
        """Give the coordinate of a value within bounds; that of a gain is :data:`FARTHEST` from its centre at most."""
        if not self.sign:
            return (min(max(value, self.lower), self.upper) - self.centre) / self.width
        size = value * self.sign / self.centre
        return min(max(log(size) / self.width, -FARTHEST), FARTHEST) if size > 0.0 else -FARTHEST

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds of the coordinate."""
        if self.sign:
            return -inf, inf
        return (self.lower - self.centre) / self.width, (self.upper - self.centre) / self.width

    def slope(self, value: float) -> float:
        """Give the derivative dp/dx at a value, in the field's unit."""
        return self.width * value if self.sign else self.width


_LINEAR: Mapping[str, tuple[float, float]] = {
    "a_wx": (1.0, 0.0),
    "a_th": (4.0, -inf),
    "theta0": (0.5, -inf),
    "a_wz": (1.0, 0.0),
    "a_e": (4.0, 0.0),
    "a_1": (3.0, -inf),
    "a_lt": (0.5, -inf),
    "a_wy": (1.0, 0.0),
}
"""Width and lower bound of the base parameters that are centred at zero."""

_GAINS: Mapping[str, float] = {"k_x": 3.0, "k_z": 1.0, "k_y": 1.0}
"""Accelerations [rad/s^2] where the sum of both voltages (for the pitch their difference) is the voltage limit."""

GAIN_WIDTH = log(2.0)
"""Width of a gain's logarithm."""


def coordinates(
    fields: Iterable[str], start: PlantParameters, expected: Mapping[str, Estimate] = MappingProxyType({})
) -> tuple[Coordinate, ...]:
    """Give the coordinates of ``fields``; ``start`` tells the signs of the gains, the motors' lag and voltage limit.

    ``expected`` are coefficients of effects of which more is known than their plausible range.
    """
    return tuple(_coordinate(field, start, expected.get(field)) for field in fields)


def _coordinate(field: str, start: PlantParameters, expected: Estimate | None) -> Coordinate:
    if field in _GAINS:
        sign = 1.0 if field == "k_z" else copysign(1.0, getattr(start, field))
        return Coordinate(field, _GAINS[field] / start.v_max, GAIN_WIDTH, sign=sign)
    if field in _LINEAR:
        width, lower = _LINEAR[field]
        return Coordinate(field, 0.0, width, lower, BY_FIELD[field].maximum)
    entry = effect_of(field)
    lower = max(entry.lower, SHORTEST_LAG - start.T_m) if entry.place == LAG else entry.lower
    centre, width = 0.0, entry.upper / WIDTHS_IN_RANGE
    if expected is not None:
        centre, width = expected.value, expected.standard_error or width
    return Coordinate(field, centre, width, lower, entry.upper)


ENTRIES: tuple[Effect, ...] = tuple(
    entry for entry in CATALOGUE if entry.place != BENDING and all(shape.start != STEP_TIMES for shape in entry.shapes)
)
"""Effects of the catalogue that take part in a fit of everything at once."""

EVERYTHING: tuple[str, ...] = (*BASE, *(entry.field for entry in ENTRIES))
"""Fields of the fit of everything at once."""
