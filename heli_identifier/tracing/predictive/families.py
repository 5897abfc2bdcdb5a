"""Families: effects of the catalogue that logs of a bench helicopter hardly tell apart, each family one finding.

They are fixed beforehand, from mechanics: members of a family move the same axis in nearly the same way once the base
parameters have taken their share. Were they found in the data, resamples would split their votes between aliases.
"""

from collections.abc import Collection
from dataclasses import dataclass

from heli_identifier.tracing.multistep.priors import ENTRIES
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters


@dataclass(frozen=True)
class Family:
    """Effects that are one finding.

    Attributes
    ----------
    name : str
        What they have in common.
    members : tuple of str
        Fields of the plant's parameters.
    """

    name: str
    members: tuple[str, ...]


_NAMED: tuple[Family, ...] = (
    *(
        Family(
            f"friction of the {axis}",
            tuple(f"{law}_{axis}" for law in ("dry_friction", "breakaway_friction", "quadratic_drag")),
        )
        for axis in AXES
    ),
    Family("torque on the pitch", ("constant_torque_pitch", "rotor_mismatch_pitch")),
    Family("torque on the travel", ("constant_torque_travel", "rotor_drag_torque_travel", "cable_stiffness_travel")),
    Family("curve of the thrust", ("quadratic_thrust_rotors", "dead_zone_rotors")),
    Family("lag or delay of the rotors", ("motor_lag_rotors", "input_delay_rotors")),
    Family("thrust lost by airspeed", ("airspeed_thrust_loss_pitch", "airspeed_thrust_loss_elevation")),
    Family("gyroscopic coupling", ("gyroscopic_coupling_pitch", "gyroscopic_coupling_elevation")),
    Family("inertial coupling", ("inertial_coupling_elevation", "inertial_coupling_travel")),
)

FAMILIES: tuple[Family, ...] = (
    *_NAMED,
    *(
        Family(f"{entry.name.replace('_', ' ')} of the {entry.axis}", (entry.field,))
        for entry in ENTRIES
        if not any(entry.field in family.members for family in _NAMED)
    ),
)
"""Every effect that takes part in a fit of everything at once, in one family each."""


def family_of(field: str) -> str | None:
    """Name of the family of an effect's coefficient; None for an effect that takes no part."""
    return next((family.name for family in FAMILIES if field in family.members), None)


def members_of(name: str) -> tuple[str, ...]:
    """Coefficients of a family's members, by its name."""
    return next(family.members for family in FAMILIES if family.name == name)


def together(fields: Collection[str], parameters: PlantParameters) -> str:
    """Give the figure that effects which cannot be told apart have in common, in words; empty if there is none."""
    if {"motor_lag_rotors", "input_delay_rotors"} <= set(fields):
        total = parameters.T_m + parameters.motor_lag_rotors + parameters.input_delay_rotors
        return f"lag and delay of the rotors together: {1e3 * total:.0f} ms"
    return ""
