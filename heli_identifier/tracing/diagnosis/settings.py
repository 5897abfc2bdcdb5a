"""Settings of a diagnosis."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from heli_identifier.errors import ConfigurationError, require_positive, require_range
from heli_identifier.online import Estimate, ModelParameters
from heli_identifier.records import LOWEST_RATE_HZ, RigConfiguration, check_given
from heli_identifier.tracing.prediction.observer import DAMPING
from heli_plant.parameters import PlantParameters

BANDWIDTH = 4.0
"""Filter frequency omega_f [rad/s] of the search."""

AGREEMENT = (2.0, 8.0)
"""Further filter frequencies [rad/s] at which every effect has to hold."""

SLOWEST = 0.01
"""Lowest filter frequency [rad/s]: its observer settles in 10/omega_f, a thousand seconds, longer than logs last."""

FASTEST = 2.0 * (1.0 - DAMPING) * LOWEST_RATE_HZ
"""Highest filter frequency [rad/s], 30.

Faster logs are reduced to about 100 Hz, slower ones keep their rate, of 50 Hz at least. The observer is corrected once
a step h, so that on a double integrator its poles z obey, with w = omega_f h and the damping rho of eq. (11),

    z^2 - (2 - 2 rho w - w^2) z + 1 - 2 rho w = 0.

They are a complex pair, as those of the filter F(s) of eq. (11) are, while (w + 2 rho)^2 < 4, which is
omega_f < 2 (1 - rho) / h. Above it the innovations are no longer filtered by F, and from 1.04 / h on the observer is
unstable.
"""


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

    Raises
    ------
    ConfigurationError
        A value is out of bounds, or the catalogue has no such effect; the message names it, its value and its bound.
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

    def __post_init__(self) -> None:
        if not isinstance(self.agreement, tuple | list):
            raise ConfigurationError(
                f"agreement = {self.agreement!r} must be a tuple of filter frequencies [rad/s], as {AGREEMENT}."
            )
        _check_frequency("bandwidth", self.bandwidth)
        for number, frequency in enumerate(self.agreement):
            _check_frequency(f"agreement[{number}]", frequency)
        require_positive("voltage_limit", self.voltage_limit, "V")
        check_given("", self.motor_time_constant, self.rest_pitch, self.elevation_gain, self.horizontal, self.effects)

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


def _check_frequency(name: str, frequency: float) -> None:
    """Refuse a filter frequency [rad/s] that no log can serve."""
    try:
        require_range(name, frequency, "rad/s", SLOWEST, FASTEST)
    except ConfigurationError as error:
        raise ConfigurationError(
            f"{error}: below it a log ends before the observer settles, above it the steps of a log of "
            f"{LOWEST_RATE_HZ:g} Hz are too long for the observer; take some {BANDWIDTH:g} rad/s."
        ) from None
