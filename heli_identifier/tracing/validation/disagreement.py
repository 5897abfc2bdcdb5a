"""Where prediction errors and likelihood disagree about a parameter, its interval spans both values.

Under a controller the voltages measured within the predicted second already answer the torques within it. Prediction
errors are then least for gains that are too small, while the likelihood of whitened one-step innovations is consistent
(Forssell and Ljung 1999, Closed-loop identification revisited). With estimates p_e by errors and p_l by likelihood and
their standard errors s_e and s_l, the difference d = p_e - p_l is tested as Hausman (1978) does, with the larger
variance s_e^2 + s_l^2; where it is significant, d counts as the bias of p_e:

    s^2 = s_e^2 + d^2    if    |d| > 1.96 sqrt(s_e^2 + s_l^2).
"""

from dataclasses import dataclass
from math import hypot

from heli_identifier.online import Estimate


@dataclass(frozen=True)
class Disagreement:
    """A field about which two estimates differ by more than chance."""

    field: str
    by_errors: Estimate
    by_likelihood: Estimate


def disagree(by_errors: Estimate, by_likelihood: Estimate) -> bool:
    """Whether two estimates of a parameter differ by more than chance."""
    spread = hypot(by_errors.standard_error or 0.0, by_likelihood.standard_error or 0.0)
    return abs(by_errors.value - by_likelihood.value) > 1.96 * spread


def spanning(by_errors: Estimate, by_likelihood: Estimate) -> Estimate:
    """Give the value by errors with an interval that holds the other value as well."""
    difference = by_errors.value - by_likelihood.value
    return Estimate(by_errors.value, hypot(by_errors.standard_error or 0.0, difference), by_errors.unit)
