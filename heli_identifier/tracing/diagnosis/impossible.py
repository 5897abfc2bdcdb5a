"""Values of parameters that no rig can have, and the sentences that say so.

A fit by multi-step errors keeps a parameter inside of what is possible and stops at the bound. The likelihood knows no
bounds. Where its value is outside by more than chance, the logs hold something that the model lacks: a damping below
zero, for example, would feed energy into the motion.
"""

from collections.abc import Mapping

from heli_identifier.online import Estimate
from heli_identifier.tracing.diagnosis.signs import CERTAIN
from heli_plant.effects import CATALOGUE, FRICTION

_DAMPING = "such a damping would drive the motion, which no bearing does"

_POSITIVE: Mapping[str, str] = {
    "a_wx": _DAMPING,
    "a_wz": _DAMPING,
    "a_wy": _DAMPING,
    "a_e": "with such a stiffness the arm would have no balance",
    "k_x": "with such a gain a larger front voltage would lower the front rotor",
    "k_z": "with such a gain more voltage would lower the arm",
}
"""Parameters of the simplified model that are positive on every rig, and what a negative one would mean.

The pitch's stiffness is not among them: a body whose mass is above its axis is unstable. Nor is k_y, whose sign is the
sense in which the travel counts.
"""

_EFFECTS = {effect.field: effect for effect in CATALOGUE if effect.lower >= 0.0}
"""Effects whose coefficients are positive on every rig."""


def impossible_values(estimates: Mapping[str, Estimate]) -> dict[str, Estimate]:
    """Give the estimates that are negative by more than chance where every rig has a positive value.

    Parameters
    ----------
    estimates : mapping of str to Estimate
        By the plant's fields; shapes of effects are not judged.
    """
    return {field: value for field, value in estimates.items() if _outside(field, value)}


def _outside(field: str, estimate: Estimate) -> bool:
    return (field in _POSITIVE or field in _EFFECTS) and estimate.value < -CERTAIN * (estimate.standard_error or 0.0)


def impossible_notes(impossible: Mapping[str, Estimate], plant: Mapping[str, Estimate]) -> tuple[str, ...]:
    """Say which values no rig can have, why, and what the corrected plant has instead.

    Parameters
    ----------
    impossible : mapping of str to Estimate
        By field, of the likelihood: :func:`impossible_values` finds them.
    plant : mapping of str to Estimate
        Values of the corrected plant.
    """
    notes = []
    for field, value in impossible.items():
        unit = "" if value.unit == "1" else f" {value.unit}"
        size = f"{value.value:.3g} ± {1.96 * (value.standard_error or 0.0):.2g}{unit}"
        has = f" The corrected plant has {plant[field].value:.3g}{unit}." if field in plant else ""
        notes.append(
            f"IMPOSSIBLE: {field} = {size} by likelihood: {_meaning(field)}. The logs hold something that the model "
            f"lacks.{has}"
        )
    return tuple(notes)


def _meaning(field: str) -> str:
    """Say what an impossible value would mean."""
    if field in _POSITIVE:
        return _POSITIVE[field]
    if _EFFECTS[field].family == FRICTION:
        return "such a friction would drive the motion, which no bearing does"
    return f"{_EFFECTS[field].name.replace('_', ' ')} has a positive coefficient on every rig"
