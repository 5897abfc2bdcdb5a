"""The paper's parameters (Table 2) by name, as what an identifier starts from, estimates, or doubts."""

from typing import NamedTuple


class ModelParameters(NamedTuple):
    """One number per parameter of eqs (2), (10), (12): a value or a standard error.

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
