"""What the paper prints: Table 1 (ranges of the pitch estimates over twelve runs) and Table 2 (the parameters).

Table 2 is the default parameter set of the plant. Nothing else in identification may use it: only here are estimates
compared with the truth.
"""

from typing import NamedTuple

from heli_identifier.online import ModelParameters
from heli_plant.parameter_table import BY_FIELD
from heli_plant.parameters import TABLE_2

EXPERIMENTS = (1, 2)
PITCH = ("a_wx", "a_th", "k_x")
"""Parameters of Table 1, in the order of the regressors."""


class Range(NamedTuple):
    """Lowest and highest of twelve estimates, in the parameter's unit."""

    lowest: float
    highest: float

    @property
    def middle(self) -> float:
        """Midpoint."""
        return 0.5 * (self.lowest + self.highest)

    @property
    def half_width(self) -> float:
        """Half of the width."""
        return 0.5 * (self.highest - self.lowest)


TABLE_1: dict[int, dict[str, Range]] = {
    1: {"a_wx": Range(0.059, 0.062), "a_th": Range(0.658, 0.668), "k_x": Range(0.289, 0.298)},
    2: {"a_wx": Range(0.064, 0.068), "a_th": Range(0.595, 0.623), "k_x": Range(0.257, 0.269)},
}
"""Ranges by experiment and parameter."""

TRUTH = ModelParameters(*(getattr(TABLE_2, name) for name in ModelParameters._fields))
"""Table 2."""

UNITS = {name: BY_FIELD[name].unit for name in ModelParameters._fields}
"""Unit of each parameter."""
