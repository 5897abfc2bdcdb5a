"""Corrections of a plant while it runs: what is added to its parameters, and the rotors' shares of thrust.

A rotor that is damaged loses a share of its thrust. Motors and thrust are linear in the simplified model; the share
therefore stands before the motor, behind the saturation of its voltage.
"""

from typing import NamedTuple

from .motor import saturate
from .parameter_table import BY_FIELD
from .parameters import PlantParameters


class Correction(NamedTuple):
    """What is added to the parameters of the same names, and to the rotors' shares of thrust, which are 1 without."""

    k_x: float = 0.0
    k_z: float = 0.0
    k_y: float = 0.0
    a_1: float = 0.0
    a_wx: float = 0.0
    a_wz: float = 0.0
    a_wy: float = 0.0
    dry_friction_pitch: float = 0.0
    dry_friction_elevation: float = 0.0
    dry_friction_travel: float = 0.0
    constant_torque_pitch: float = 0.0
    constant_torque_travel: float = 0.0
    cable_stiffness_travel: float = 0.0
    front: float = 0.0
    rear: float = 0.0


CORRECTED = tuple(
    (BY_FIELD[field].name, BY_FIELD[field].unit) if field in BY_FIELD else (f"rotor.{field}", "1")
    for field in Correction._fields
)
"""Name and unit of what each field corrects."""


def with_correction(p: PlantParameters, c: Correction) -> PlantParameters:
    """Return ``p`` with the corrections added; the rotors' shares are not among the parameters."""
    return p._replace(**{field: getattr(p, field) + getattr(c, field) for field in Correction._fields[:-2]})


def with_share(voltage: float, share: float, limit: float) -> float:
    """Return the ``voltage`` [V] that gives the ``share`` [1] of the thrust; ``limit`` of the voltage [V]."""
    if share == 1.0:
        return voltage
    return share * saturate(voltage, limit)
