"""Settings of the on-line identifier; the defaults are the paper's (section on the estimator).

:func:`prepare` computes from them, once, the coefficients of a step.
"""

from dataclasses import dataclass
from math import cos, exp, expm1, inf, log, pi, sin
from typing import NamedTuple

from ..errors import ConfigurationError, require_positive, require_range
from .loop import product_interval, score_samples
from .state_filter import FilterCoefficients, discretise
from .whitening import ANY_ROOM, Bounds, Noise, Whitening, angle_slopes, bound_noise, noise_bounds, whitening

DETERMINED = 0.1
"""Largest half width of the 95 % interval of a determined value, as a share of the value."""


def is_determined(value: float, standard_error: float, unit: str) -> bool:
    """Return whether half a 95 % interval is at most a tenth of the value; of an offset, .05 rad or .1 rad/s^2."""
    of_offset = 0.05 if unit == "rad" else 0.1 if unit == "rad/s^2" else 0.0
    return 1.96 * standard_error <= max(DETERMINED * abs(value), of_offset)


@dataclass(frozen=True)
class Estimate:
    """A value with its standard error, both in ``unit``; a given value has None as its standard error."""

    value: float
    standard_error: float | None
    unit: str

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval, lower and upper end."""
        half_width = 1.96 * (self.standard_error or 0.0)
        return self.value - half_width, self.value + half_width

    @property
    def is_determined(self) -> bool:
        """Whether the data determine the value (:func:`is_determined`)."""
        return self.standard_error is None or is_determined(self.value, self.standard_error, self.unit)


class ModelParameters(NamedTuple):
    """One number for each parameter of eqs (2), (10), (12), Table 2 of the paper: a value or a standard error."""

    a_wx: float = 0.0  # [1/s]
    a_th: float = 0.0  # [1/s^2]
    k_x: float = 0.0  # [rad/s^2/V]
    theta0: float = 0.0  # [rad]
    a_wz: float = 0.0  # [1/s]
    a_e: float = 0.0  # [1/s^2]
    a_1: float = 0.0  # [rad/s^2]
    a_lt: float = 0.0  # [1]
    k_z: float = 0.0  # [rad/s^2/V]
    a_wy: float = 0.0  # [1/s]
    k_y: float = 0.0  # [rad/s^2/V]


ADAPTATION, PREDICTION_ERROR = METHODS = "adaptation", "prediction_error"
"""Methods of estimation."""
_SAMPLES_PER_RADIAN = 5.0  # least samples per 1/omega_f: with fewer, (h^2/12) omega_f^2 exceeds .3 %
_SLOWEST = 1e-3  # lowest bandwidth omega_f [rad/s]: a quarter of an hour, longer than a flight


def default_settings() -> "IdentifierSettings":
    """Return the default settings, for the units in C."""
    return IdentifierSettings()


@dataclass(frozen=True)
class IdentifierSettings:
    """Everything that can be set on the identifier; ConfigurationError names a setting that is out of range."""

    sample_time: float = 0.01  # h [s]
    filter_frequency: float = 1.0  # bandwidth omega_f of the state filters [rad/s]
    filter_damping: float = 0.7  # their damping ratio rho
    initial_gain: float = 1e3  # Gamma(0) = initial_gain I
    gain_limit: float = 1e3  # Gamma_max, which Gamma approaches without excitation; infinite for (7) as printed
    forgetting: float = 0.001  # alpha [1/s]
    hold_time: float | None = None  # before the estimation begins [s]; None: 10/omega_f, with prediction errors 2 s
    rest_angle: float | None = None  # theta0 [rad] if it is known; None to estimate it
    motor_time_constant: float = 0.08  # T_m [s]
    voltage_limit: float = 5.0  # saturation of both voltages [V]
    report_interval: float = 5.0  # between two evaluations of standard errors [s]
    initial: ModelParameters = ModelParameters()  # Omega(0); theta0 if it is estimated
    method: str = ADAPTATION  # the paper's, or prediction_error, which stays right in closed loop
    lag_known: bool = False  # if not, prediction errors estimate the lag as well, from motor_time_constant on
    noise: tuple[Noise, Noise, Noise] = (
        ANY_ROOM,
        ANY_ROOM,
        ANY_ROOM,
    )  # initial noise models of the axes

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
        require_range("report_interval", self.report_interval, "s", lower=self.sample_time)
        for name, value in zip(ModelParameters._fields, self.initial, strict=True):
            require_range(f"initial.{name}", value, "(SI)")
        if self.method not in METHODS:
            raise ConfigurationError(f"method {self.method!r} must be one of {', '.join(METHODS)}")


WIDTHS = ModelParameters(
    a_wx=0.5, a_th=4.0, k_x=1.2, theta0=0.5, a_wz=0.5, a_e=4.0, a_1=3.0, a_lt=0.5, k_z=0.4, a_wy=0.5, k_y=0.4
)
"""Prior standard deviations: a motion takes about a second or more to decay; g d / l^2 of the pitch with the mass
within 2 cm of its axis; a period of the elevation longer than 3 s, and a_1 of the weight that the counterweight does
not balance; gains of twice a full thrust of 3 rad/s^2 (pitch) or 1 rad/s^2 at 5 V."""

PITCH_LAG, ELEVATION_LAG = 0.03, 0.008
"""Prior standard deviations of k Delta [rad/s^2 s/V] (:mod:`.signals`): .04 s of lag, half of the assumed one, times
usual gains."""

BANDWIDTH_PRIOR, CORNER_PRIOR = 1.0, 0.7
"""Prior standard deviations of ln omega_o and ln gamma: a factor of 2.7, which includes a rig without air and one in
stirred air, and a factor of 2."""

_HOLD_RADIANS = 10.0  # omega_f times the time before the adaptation begins
_PREDICTION_HOLD = 2.0  # time before prediction errors begin [s]: omega_o begins at 10 rad/s
_PREDICTION_PERIOD = 0.01  # least time between two innovations [s]: at higher rates encoder errors are not independent
_RESTORING_SHARE = 0.01  # share of the information that is forgotten before it is restored: overshoot over Gamma_max
_LEAST_RESTORING, _MOST_RESTORING = 5, 1000  # samples between that: at least one for each of five parameters
_REFRESH, _LEAST_REFRESH = 0.2, 8  # time [s] and samples between two whitening filters: one for each of 8 parameters
_MOMENT_SPACING = 0.2  # omega_f times the time between samples of the moments: filtered signals change little in it


@dataclass(frozen=True)
class AxisPlan:
    """Coefficients of one axis."""

    first: tuple[float, ...]  # Omega(0), with k Delta if the lag is estimated and with nu for prediction errors
    prior: tuple[float, ...]  # their variances, the diagonal of Gamma(0)
    gain: int  # index of k in Omega, before that of k Delta
    reported: int  # number of parameters without nu


@dataclass(frozen=True)
class Plan:
    """Coefficients of a step; :func:`prepare` computes them once from the settings."""

    settings: IdentifierSettings
    predicting: bool
    estimates_lag: bool
    decimation: int  # of so many samples one is taken, with the mean of their voltages
    sample_time: float  # between samples that are used [s]
    noise: float  # r of a measurement [1/s]
    kept: float  # exp(-alpha h) [1]
    restoring_samples: int  # between two additions of restored information
    restoring_noise: float  # r of an addition [1]; infinite if there is none
    refresh_samples: int  # from one whitening filter of prediction errors to the next
    product_samples: int  # from one product of instruments and regressors to the next
    score_samples: tuple[int, int]  # before the first block of the score of a closed loop, and in a block
    hold_samples: int  # before the estimation begins
    moment_samples: int  # from one sample of the moments to the next
    moment_interval: float  # the same [s]
    report_samples: int  # from one evaluation to the next
    filter: FilterCoefficients
    angle_slopes: tuple[float, float, float]
    noise_bounds: Bounds
    error_whitening: Whitening  # of adaptation errors, with the noise model of a calm room
    axes: tuple[AxisPlan, AxisPlan, AxisPlan]


def prepare(settings: IdentifierSettings) -> Plan:
    """Return the plan of ``settings``."""
    omega, lag, alpha = settings.filter_frequency, settings.motor_time_constant, settings.forgetting
    predicting = settings.method == PREDICTION_ERROR
    estimates_lag = predicting and not settings.lag_known
    decimation = max(1, round(_PREDICTION_PERIOD / settings.sample_time)) if predicting else 1
    h = decimation * settings.sample_time
    default_hold = _PREDICTION_HOLD if predicting else _HOLD_RADIANS / omega
    hold = settings.hold_time if settings.hold_time is not None else default_hold
    spacing = max(1, round(_MOMENT_SPACING / (omega * h)))
    restoring = min(max(round(_RESTORING_SHARE / (alpha * h)), _LEAST_RESTORING), _MOST_RESTORING) if alpha > 0.0 else 1
    initial, widths = settings.initial, WIDTHS
    pitch: tuple[float, ...] = initial[:3]
    pitch_widths: tuple[float, ...] = widths[:3]
    if settings.rest_angle is None:
        pitch = (initial.a_wx, initial.a_th * cos(initial.theta0), initial.a_th * sin(initial.theta0), initial.k_x)
        pitch_widths = (widths.a_wx, widths.a_th, widths.a_th * widths.theta0, widths.k_x)
    lag_1, lag_2 = (PITCH_LAG, ELEVATION_LAG) if estimates_lag else (0.0, 0.0)
    noise_1, noise_2, noise_3 = settings.noise
    f, calm, bounds = discretise(omega, settings.filter_damping, h, lag), Noise(), noise_bounds(h)
    return Plan(
        settings=settings,
        predicting=predicting,
        estimates_lag=estimates_lag,
        decimation=decimation,
        sample_time=h,
        noise=alpha / expm1(alpha * h) if alpha > 0.0 else 1.0 / h,  # beta / w, exact for small alpha h
        kept=exp(-alpha * h),
        restoring_samples=restoring,
        restoring_noise=-settings.gain_limit / expm1(-alpha * h * restoring) if alpha > 0.0 else inf,
        refresh_samples=max(_LEAST_REFRESH, round(_REFRESH / h)),
        product_samples=product_interval(h),
        score_samples=score_samples(h),
        hold_samples=round(hold / h),
        moment_samples=spacing,
        moment_interval=spacing * h,
        report_samples=max(3, round(settings.report_interval / h)),
        filter=f,
        angle_slopes=angle_slopes(f),
        noise_bounds=bounds,
        error_whitening=whitening(log(calm.bandwidth), log(calm.corner), f, h),
        axes=(
            _axis_plan(pitch, pitch_widths, lag_1, noise_1, settings, bounds),
            _axis_plan(initial[4:9], widths[4:9], lag_2, noise_2, settings, bounds),
            _axis_plan(initial[9:], widths[9:], 0.0, noise_3, settings, bounds),
        ),
    )


def _axis_plan(
    first: tuple[float, ...], widths: tuple[float, ...], lag_width: float, noise: Noise, settings: IdentifierSettings,
    bounds: Bounds,
) -> AxisPlan:  # fmt: skip
    """Return the plan of an axis; ``lag_width`` is the prior deviation of k Delta, 0 if the lag is not estimated."""
    gain = len(first) - 1
    if lag_width > 0.0:
        first, widths = (*first, 0.0), (*widths, lag_width)
    reported, largest = len(first), settings.initial_gain
    prior = tuple([largest for _ in first])
    if settings.method == PREDICTION_ERROR:
        bandwidth, corner = bound_noise(log(noise.bandwidth), log(noise.corner), bounds)
        first = (*first, bandwidth, corner)
        variances = [min(largest, width * width) for width in widths]
        prior = (*variances, BANDWIDTH_PRIOR * BANDWIDTH_PRIOR, CORNER_PRIOR * CORNER_PRIOR)
    return AxisPlan(first, prior, gain, reported)
