"""Settings of a diagnosis."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from heli_identifier.online import Estimate, ModelParameters
from heli_identifier.records import RigConfiguration
from heli_plant.parameters import PlantParameters

BANDWIDTH = 4.0
"""Filter frequency omega_f [rad/s] of the search."""

AGREEMENT = (2.0, 8.0)
"""Further filter frequencies [rad/s] at which every effect has to hold."""


@dataclass(frozen=True)
class DiagnosisSettings:
    """What a diagnosis takes as given.

    Attributes
    ----------
    bandwidth : float
        Filter frequency omega_f [rad/s] of the search.
    agreement : tuple of float
        Further filter frequencies [rad/s] at which every effect has to hold.
    motor_time_constant : float
        T_m [s] that the model before assumes; a different lag shows as the effect motor_lag.
    voltage_limit : float
        Saturation of both voltages [V].
    rest_pitch : float or None
        Pitch theta_0 at rest [rad]; None lets every fit estimate it.
    elevation_gain : float or None
        Gain k_z of the elevation [rad/s^2/V]; None lets every fit estimate it.
    horizontal : float or None
        What the elevation's encoder reads where the arm is horizontal [rad]; None lets the search estimate it.
    effects : mapping of str to Estimate
        Effects that the model before has, by their field: the coefficient with its standard deviation.
    keep_events : bool
        Use also the passages in which something other than the plant acts; by default they are cut out. They are
        listed either way.
    """

    bandwidth: float = BANDWIDTH
    agreement: tuple[float, ...] = AGREEMENT
    motor_time_constant: float = 0.08
    voltage_limit: float = 5.0
    rest_pitch: float | None = None
    elevation_gain: float | None = None
    horizontal: float | None = None
    effects: Mapping[str, Estimate] = field(default_factory=dict)
    keep_events: bool = False

    @classmethod
    def from_rig(
        cls, configuration: RigConfiguration, bandwidth: float = BANDWIDTH, agreement: tuple[float, ...] = AGREEMENT
    ) -> "DiagnosisSettings":
        """Make settings of all that a rig's configuration states.

        Parameters
        ----------
        configuration : RigConfiguration
        bandwidth : float
            Filter frequency [rad/s] of the search.
        agreement : tuple of float
            Further filter frequencies [rad/s].
        """
        return cls(
            bandwidth,
            agreement,
            configuration.motor_time_constant,
            configuration.format.voltage_limit,
            configuration.rest_pitch,
            configuration.elevation_gain,
            configuration.horizontal,
            configuration.effects,
        )

    @property
    def free(self) -> tuple[str, ...]:
        """Parameters of the simplified model that are estimated: theta0 and k_z only where they are not given."""
        given = {"theta0": self.rest_pitch, "k_z": self.elevation_gain}
        return tuple(name for name in ModelParameters._fields if given.get(name) is None)

    def base_parameters(self) -> PlantParameters:
        """Parameter set that carries what is given; the fields in ``free`` hold no information."""
        return PlantParameters(
            T_m=self.motor_time_constant,
            v_max=self.voltage_limit,
            theta0=self.rest_pitch or 0.0,
            k_z=self.elevation_gain or 0.0,
            horizontal_offset=-(self.horizontal or 0.0),
            **{name: given.value for name, given in self.effects.items()},
        )
