"""What estimation hands on: a value with its uncertainty, and the model's eleven parameters by the paper's symbols."""

from dataclasses import dataclass
from typing import NamedTuple

OFFSETS = (("rad", 0.05), ("rad/s^2", 0.1))
"""Half widths of an interval that are narrow enough for an offset, which may be zero, by its unit."""


DETERMINED = 0.1
"""Half width of a 95 % interval over the value up to which data determine a parameter.

In 95 % of the cases, what is called determined is then within ten percent of the truth, the accuracy that is asked of a
gain in closed loop. With .5 it might be wrong by half, and one that came out too large would pass sooner than others.
"""


def determined(value: float, standard_error: float, unit: str) -> bool:
    """Return whether data determine a parameter: half its 95 % interval is at most a tenth of its value.

    For offsets, a rest angle [rad] or a constant torque [rad/s^2], a width of :data:`OFFSETS` is narrow enough as well.
    """
    half = 1.96 * standard_error
    if half <= DETERMINED * abs(value):
        return True
    for name, width in OFFSETS:
        if name == unit:
            return half <= width
    return False


@dataclass(frozen=True)
class Estimate:
    """A value with its standard error, both in ``unit``; a standard error of None means that the value was given."""

    value: float
    standard_error: float | None
    unit: str

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval, lower and upper end."""
        half = 1.96 * (self.standard_error or 0.0)
        return self.value - half, self.value + half

    @property
    def is_determined(self) -> bool:
        """Whether the data determine the value (:func:`determined`)."""
        return self.standard_error is None or determined(self.value, self.standard_error, self.unit)


class ModelParameters(NamedTuple):
    """One number for each parameter of eqs (2), (10), (12) (Table 2 of the paper): a value or a standard error.

    ``a_wx``, ``a_wz``, ``a_wy`` [1/s]; ``a_th``, ``a_e`` [1/s^2]; ``k_x``, ``k_z``, ``k_y`` [rad/s^2/V]; ``theta0``
    [rad]; ``a_1`` [rad/s^2]; ``a_lt`` [1].
    """

    a_wx: float = 0.0
    a_th: float = 0.0
    k_x: float = 0.0
    theta0: float = 0.0
    a_wz: float = 0.0
    a_e: float = 0.0
    a_1: float = 0.0
    a_lt: float = 0.0
    k_z: float = 0.0
    a_wy: float = 0.0
    k_y: float = 0.0
