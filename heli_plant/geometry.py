"""Parameters of the model from masses, lengths and hover voltage of the rig, as the course's script computes them.

The head carries two motors, each m_p with its share of the frame, l_p from the pitch's axis and l_h from the
elevation's; the counterweight m_c hangs at the distance l_c on the other side. About the horizontal arm

    J_p = 2 m_p l_p^2,    J_e = m_c l_c^2 + 2 m_p l_h^2,    J_lambda = m_c l_c^2 + 2 m_p (l_h^2 + l_p^2)
    K_f V_s l_h = g (2 m_p l_h - m_c l_c)                                 force per volt K_f from the hover V_s
    k_x = n l_p K_f / J_p,    k_z = n l_h K_f / J_e,    k_y = -l_h K_f / J_lambda

with n the slope of the thrust over thrust per volt: 1 where the thrust is proportional to the voltage, 2 where it is to
its square. K_f follows from the small difference of two large torques: one per cent of the counterweight changes it by
more than ten, so it is a wide prior. The ratios k_x / k_y and k_z / k_y do not depend on it.

Source: laboratory of TTK4115 Linear System Theory, NTNU, "Helicopter lab assignment", part I.
"""

from dataclasses import dataclass
from math import hypot, log, sqrt

from .models import GRAVITY

MASS_ERROR, LENGTH_ERROR = 0.02, 0.01
"""Relative standard deviations of masses, to which cables and frame are assigned by eye, and of lengths."""

RATIO_ERROR = hypot(MASS_ERROR, 3.0 * LENGTH_ERROR)
"""Relative standard deviation of a ratio of two gains, which depends on a ratio of masses and on three lengths."""

STEEPER = 2.0  # largest n: a propeller at rest in air thrusts with the square of its speed


@dataclass(frozen=True)
class Geometry:
    """Masses and lengths of a rig under the names of the course's script; None: not known."""

    m_p: float | None = None  # a motor with its share of the head [kg]
    m_c: float | None = None  # counterweight [kg]
    l_c: float | None = None  # elevation's axis to counterweight [m]
    l_h: float | None = None  # elevation's axis to head [m]
    l_p: float | None = None  # pitch's axis to a motor [m]
    hover_voltage: float | None = None  # sum of both at which the horizontal arm hovers [V]

    @property
    def ratios(self) -> dict[str, tuple[float, float]]:
        """k_x / |k_y| and k_z / |k_y| for n = 1 and :data:`STEEPER`, under k_x and k_z; empty if unknown."""
        m_p, m_c, l_c, l_h, l_p = self.m_p, self.m_c, self.l_c, self.l_h, self.l_p
        if m_p is None or m_c is None or l_c is None or l_h is None or l_p is None:
            return {}
        J_p, J_e, J_lambda = _inertias(m_p, m_c, l_c, l_h, l_p)
        ratios = {"k_x": l_p / l_h * J_lambda / J_p, "k_z": J_lambda / J_e}
        return {field: (ratio, STEEPER * ratio) for field, ratio in ratios.items()}

    def deviations(self, field: str, ratio: float, error: float) -> float:
        """Return by how many standard deviations a measured ratio with a relative ``error`` lies outside its range."""
        low, high = self.ratios[field]
        return max(log(ratio / high), log(low / ratio)) / hypot(error, RATIO_ERROR)

    def priors(self) -> dict[str, tuple[float, float]]:
        """Return gains [rad/s^2/V], each with the standard deviation of its logarithm; empty if K_f is unknown."""
        m_p, m_c, l_c, l_h, l_p, hover = self.m_p, self.m_c, self.l_c, self.l_h, self.l_p, self.hover_voltage
        if m_p is None or m_c is None or l_c is None or l_h is None or l_p is None or hover is None:
            return {}
        head, weight = 2.0 * m_p * l_h, m_c * l_c  # masses times levers [kg m]
        torque = GRAVITY * (head - weight)
        if torque <= 0.0:  # the counterweight lifts the head
            return {}
        K_f = torque / (l_h * hover)
        k_y, slope_error = l_h * K_f / _inertias(m_p, m_c, l_c, l_h, l_p)[2], 0.5 * log(STEEPER)
        force_error = hypot(MASS_ERROR, LENGTH_ERROR) * hypot(head, weight) / (head - weight)
        gains = {field: sqrt(low * high) * k_y for field, (low, high) in self.ratios.items()}
        priors = {field: (gain, hypot(force_error, slope_error)) for field, gain in gains.items()}
        return {**priors, "k_y": (-k_y, force_error)}


def _inertias(m_p: float, m_c: float, l_c: float, l_h: float, l_p: float) -> tuple[float, float, float]:
    """Return J_p, J_e and J_lambda [kg m^2]."""
    weight, head, body = m_c * l_c**2, 2.0 * m_p * l_h**2, 2.0 * m_p * l_p**2
    return body, weight + head, weight + head + body
