"""Settings of the on-line identifier; the defaults are the paper's (section on the estimator).

:func:`prepare` makes of them, once, the coefficients that a step computes with.
"""

from dataclasses import dataclass, field
from math import cos, exp, inf, pi, sin
from typing import NamedTuple

from heli_plant.effects import AXES
from heli_plant.motor import kept

from ..errors import ConfigurationError, require_positive, require_range
from .adaptation import AdaptationCoefficients, adaptation_coefficients
from .loop import FeedbackCoefficients, feedback_coefficients, outside_coefficients
from .moments import MomentCoefficients, moment_coefficients
from .prediction_error import PredictorCoefficients
from .signals import LagCoefficients, SignalCoefficients, lag_coefficients
from .state_filter import FilterCoefficients, discretise
from .watch import WatchCoefficients, candidate, watch_coefficients
from .whitening import (
    ANY_ROOM,
    BANDWIDTH_CHANGE,
    BANDWIDTHS,
    CORNER_CHANGE,
    CORNERS,
    NEWEST,
    Noise,
    filter_polynomial,
    noise_coefficients,
)

OFFSETS = (("rad", 0.05), ("rad/s^2", 0.1))
"""Half widths of an interval that are narrow enough for an offset, which may be zero, by its unit."""


DETERMINED = 0.1
"""Half width of a 95 % interval over the value up to which data determine a parameter.

In 95 % of the cases, what is called determined is then within ten percent of the truth, the accuracy that is asked of a
gain in closed loop. With .5 it might be wrong by half, and one that came out too large would pass sooner than others.
"""


def determined(value: float, standard_error: float, unit: str) -> bool:
    """Return whether data determine a parameter: half its 95 % interval is at most a tenth of its value.

    For offsets, a rest angle [rad] or a constant torque [rad/s^2], a width of :data:`OFFSETS` is narrow enough as well.
    """
    half = 1.96 * standard_error
    if half <= DETERMINED * abs(value):
        return True
    for name, width in OFFSETS:
        if name == unit:
            return half <= width
    return False


@dataclass(frozen=True)
class Estimate:
    """A value with its standard error, both in ``unit``; a standard error of None means that the value was given."""

    value: float
    standard_error: float | None
    unit: str

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval, lower and upper end."""
        half = 1.96 * (self.standard_error or 0.0)
        return self.value - half, self.value + half

    @property
    def is_determined(self) -> bool:
        """Whether the data determine the value (:func:`determined`)."""
        return self.standard_error is None or determined(self.value, self.standard_error, self.unit)


class ModelParameters(NamedTuple):
    """One number for each parameter of eqs (2), (10), (12) (Table 2 of the paper): a value or a standard error.

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


ADAPTATION, PREDICTION_ERROR = METHODS = "adaptation", "prediction_error"
"""Methods of estimation."""
_SAMPLES_PER_RADIAN = 5.0
"""Samples per 1/omega_f that the discretisation needs: with fewer, (h^2/12) omega_f^2 exceeds .3 %."""

_SLOWEST = 1e-3
"""Lowest bandwidth omega_f [rad/s]: a quarter of an hour, longer than a rig flies."""


def default_settings() -> "IdentifierSettings":
    """Return the settings that :class:`IdentifierSettings` has by default."""
    return IdentifierSettings()


@dataclass(frozen=True)
class IdentifierSettings:
    """Everything that can be set on the identifier.

    Parameters
    ----------
    sample_time : float
        Sampling period h [s].
    filter_frequency : float
        Bandwidth omega_f of the state filters [rad/s].
    filter_damping : float
        Damping ratio rho of the state filters [1].
    initial_gain : float
        Gamma(0) = initial_gain I.
    gain_limit : float
        Gamma_max, which Gamma approaches without excitation; infinite for (7) as printed. With Gamma_max = Gamma(0)
        the estimates never become less certain than they were at the start.
    forgetting : float
        alpha [1/s].
    hold_time : float or None
        Time before the estimation begins [s]; None for 10/omega_f, with prediction errors for 2 s.
    rest_angle : float or None
        theta0 [rad] where it is known; None to estimate it.
    motor_time_constant : float
        T_m [s].
    voltage_limit : float
        Saturation of both voltages [V].
    excitation_window : float
        Time constant of the window over which the excitation level is taken [s].
    report_interval : float
        Time between two evaluations of standard errors, excitation levels and scores [s].
    initial : ModelParameters
        Omega(0); its theta0 is used only where theta0 is estimated.
    method : str
        ``adaptation``, the paper's (7), or ``prediction_error`` (:mod:`.prediction_error`), which stays right where a
        controller closes the loop.
    lag_known : bool
        Whether the motors' lag is ``motor_time_constant``. Where it is not known, prediction errors estimate it along,
        beginning with that (:mod:`.signals`); the adaptation always takes it for known, as the paper does.
    noise : tuple of three Noise
        Where the noise models of pitch, elevation and travel begin (:mod:`.whitening`).
    watched : tuple of (name, axis)
        Effects of the catalogue to score while the rig runs (:data:`heli_identifier.online.WATCHABLE`).

    Raises
    ------
    ConfigurationError
        A setting is out of range; the message names it, its value and its bound.
    """

    sample_time: float = 0.01
    filter_frequency: float = 1.0
    filter_damping: float = 0.7
    initial_gain: float = 1e3
    gain_limit: float = 1e3
    forgetting: float = 0.001
    hold_time: float | None = None
    rest_angle: float | None = None
    motor_time_constant: float = 0.08
    voltage_limit: float = 5.0
    excitation_window: float = 20.0
    report_interval: float = 5.0
    initial: ModelParameters = field(default_factory=ModelParameters)
    watched: tuple[tuple[str, str], ...] = ()
    method: str = ADAPTATION
    lag_known: bool = False
    noise: tuple[Noise, Noise, Noise] = (ANY_ROOM, ANY_ROOM, ANY_ROOM)

    def __post_init__(self) -> None:
        require_positive("sample_time", self.sample_time, "s")
        fastest = 1.0 / (_SAMPLES_PER_RADIAN * self.sample_time)
        require_range("filter.frequency", self.filter_frequency, "rad/s", _SLOWEST, fastest)
        require_range("filter.damping", self.filter_damping, "1", 0.1, 10.0)
        require_positive("adaptation.initial_gain", self.initial_gain, "1")
        if self.gain_limit != inf:
            require_positive("adaptation.gain_limit", self.gain_limit, "1")
        require_range("adaptation.forgetting", self.forgetting, "1/s", 0.0, 0.2 / self.sample_time)
        if self.hold_time is not None:
            require_range("adaptation.hold_time", self.hold_time, "s", lower=0.0)
        if self.rest_angle is not None:
            require_range("pitch.rest_angle", self.rest_angle, "rad", -pi, pi)
        require_range("motor.time_constant", self.motor_time_constant, "s", lower=0.0)
        if self.voltage_limit != inf:
            require_positive("motor.voltage_limit", self.voltage_limit, "V")
        require_positive("excitation.window", self.excitation_window, "s")
        require_range("report_interval", self.report_interval, "s", lower=self.sample_time)
        for name, value in zip(ModelParameters._fields, self.initial, strict=True):
            require_range(f"initial.{name}", value, "(SI)")
        if self.method not in METHODS:
            raise ConfigurationError(f"method {self.method!r} must be one of {', '.join(METHODS)}")
        for axis, noise in zip(AXES, self.noise, strict=True):
            require_range(f"noise.{axis}.bandwidth", noise.bandwidth, "rad/s", *BANDWIDTHS)
            require_range(f"noise.{axis}.corner", noise.corner, "rad/s", *CORNERS)
        for name, axis in self.watched:
            candidate(name, axis)


_HOLD_RADIANS = 10.0
"""omega_f times the time for which the adaptation rests."""

_PREDICTION_HOLD = 2.0
"""Time for which prediction errors rest [s]: whitening has cancelled F, and omega_o begins at 7 rad/s."""

_PREDICTION_PERIOD = 0.01
"""Least time between two innovations [s]. Read faster, encoders do not err independently from sample to sample: one
count lasts many samples. Innovations one after the other would be correlated, and omega_o would come out too large."""

_REFRESH = 0.2
"""Time between two evaluations of the whitening filter [s]."""

_MOST_PARAMETERS = 8
"""Of an axis: the elevation's with the motors' lag and the noise model."""

_MOMENT_SPACING = 0.2
"""omega_f times the time between two samples of the moments: filtered by F, signals change little in it."""


class Plan(NamedTuple):
    """What a step computes with; :func:`prepare` makes it once from the settings."""

    settings: IdentifierSettings
    signals: SignalCoefficients
    adaptation: AdaptationCoefficients
    moments: MomentCoefficients
    hold_samples: int
    moment_samples: int
    report_samples: int
    every: int
    """Of the samples, every how many are taken; the voltages between two of them are averaged."""
    rest_angle_is_known: bool
    sine_of_rest: float
    cosine_of_rest: float
    watch: WatchCoefficients
    predictor: PredictorCoefficients | None
    """None where the method is the adaptation."""
    lag: LagCoefficients | None
    """None where the motors' lag is not estimated."""
    feedback: FeedbackCoefficients
    watched_columns: tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]
    """For each axis, which of the watched effects are its own."""


def prepare(settings: IdentifierSettings) -> Plan:
    """Return the plan of ``settings``."""
    omega, predicting = settings.filter_frequency, settings.method == PREDICTION_ERROR
    every = max(1, round(_PREDICTION_PERIOD / settings.sample_time)) if predicting else 1
    h = every * settings.sample_time
    usual_hold = _PREDICTION_HOLD if predicting else _HOLD_RADIANS / omega
    hold = settings.hold_time if settings.hold_time is not None else usual_hold
    spacing = max(1, round(_MOMENT_SPACING / (omega * h)))
    rest = settings.rest_angle if settings.rest_angle is not None else 0.0
    lag = settings.motor_time_constant
    pitch, elevation, travel = (
        tuple(i for i, (_, axis) in enumerate(settings.watched) if axis == own)
        for own in ("pitch", "elevation", "travel")
    )
    f = discretise(omega, settings.filter_damping, h, lag)
    return Plan(
        settings,
        SignalCoefficients(f, h, kept(h, lag), settings.voltage_limit),
        adaptation_coefficients(settings.forgetting, h, settings.gain_limit),
        moment_coefficients(spacing * h, settings.forgetting, settings.excitation_window),
        round(hold / h),
        spacing,
        max(3, round(settings.report_interval / h)),
        every,
        settings.rest_angle is not None,
        sin(rest),
        cos(rest),
        watch_coefficients(tuple(candidate(name, axis) for name, axis in settings.watched), h, predicting),
        predictor_coefficients(settings, h, f) if predicting else None,
        lag_coefficients(lag, h, kept(h, lag)) if predicting and not settings.lag_known else None,
        feedback_coefficients(h, *filter_polynomial(omega, settings.filter_damping, h)),
        (pitch, elevation, travel),
    )


def predictor_coefficients(settings: IdentifierSettings, h: float, f: FilterCoefficients) -> PredictorCoefficients:
    """Return what prediction errors need every ``h`` [s], from the settings and the discretised state filter."""
    f1, f2 = filter_polynomial(settings.filter_frequency, settings.filter_damping, h)
    # Derivatives with respect to the newest angle: of second_derivative, and of xi_2 and xi_1 behind a line.
    refresh = max(_MOST_PARAMETERS, round(_REFRESH / h))
    newest = f.omega_squared * (NEWEST - f.ramp_1) - f.two_rho_omega * f.ramp_2
    return PredictorCoefficients(
        f1,
        f2,
        h,
        newest / NEWEST,
        f.ramp_2 / NEWEST,
        f.ramp_1 / NEWEST,
        noise_coefficients(h, newest / NEWEST),
        refresh,
        exp(-settings.forgetting * refresh * h),
        BANDWIDTH_CHANGE * refresh * h,
        CORNER_CHANGE * refresh * h,
        outside_coefficients(h, settings.forgetting),
    )
