"""The ADO (active disturbance): a lead screw moves a mass along the arm.

At the position x [m] from its middle the mass shifts a_1 by ado_offset x and a_e by ado_stiffness x. The mass follows
its command at the lead screw's speed, between the ends of its travel; over one integration step it counts as standing
where it arrives.
"""

from .motor import saturate
from .parameters import PlantParameters


def mass_after(position: float, command: float, h: float, p: PlantParameters) -> float:
    """Position [m] of the mass after ``h`` [s] on its way from ``position`` to ``command`` [m]."""
    return position + saturate(saturate(command, p.ado_travel) - position, p.ado_speed * h)


def ado_acceleration(elevation: float, mass_position: float, p: PlantParameters) -> float:
    """Elevation acceleration [rad/s^2] by the mass at ``mass_position`` [m]."""
    return -(p.ado_offset + p.ado_stiffness * elevation) * mass_position
