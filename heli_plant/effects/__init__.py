"""The catalogue: every physical effect that the simplified model may lack.

To add one, write its law and its declaration (:mod:`.definition`) in the file of its kind; parameters, the plant's
sums, FMU variables, search, report and documentation follow from that. Sources: section 2.3 of the paper (neglects) and
its footnote on thrust asymmetry; eq. (1); LAAS report 18040.
"""

# ruff: noqa: F401 - the names are the subpackage's interface
from . import friction, rotors, arm  # noqa: I001 - this order is that of the parameters
from .definition import ACCELERATION, AXES, BENDING, DECLARED, DELAY, LAG, ROTORS, STEP_TIMES, THRUST, VOLTAGE, Effect

CATALOGUE = tuple(DECLARED)
"""Every effect on every axis that it acts on."""

_BY_FIELD = {entry.field: entry for entry in CATALOGUE}


def effect(name: str, axis: str) -> Effect:
    """Return the catalogue entry of an effect on an axis; KeyError if there is none."""
    return effect_of(f"{name}_{axis}")


def effect_of(field: str) -> Effect:
    """Return the catalogue entry of a coefficient, by its field of the plant's parameters; KeyError if it has none."""
    return _BY_FIELD[field]


def effects_at(place: str, axis: str = ROTORS) -> tuple[Effect, ...]:
    """Return the effects of one axis, or of the rotors, that enter the plant at one place, in order."""
    return tuple(entry for entry in CATALOGUE if entry.place == place and entry.axis == axis)
