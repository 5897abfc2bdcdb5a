"""Settings of a diagnosis."""

from dataclasses import dataclass, field

from heli_identifier.tracing.search.settings import SelectionSettings
from heli_plant.parameters import PlantParameters


@dataclass(frozen=True)
class DiagnosisSettings:
    """What a diagnosis assumes and how strict it is.

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
    selection : SelectionSettings
    """

    bandwidth: float = 4.0
    agreement: tuple[float, ...] = (2.0, 8.0)
    motor_time_constant: float = 0.08
    voltage_limit: float = 5.0
    selection: SelectionSettings = field(default_factory=SelectionSettings)

    def base_parameters(self) -> PlantParameters:
        """Parameter set that carries what is given; the estimated fields hold no information."""
        return PlantParameters(T_m=self.motor_time_constant, v_max=self.voltage_limit)
