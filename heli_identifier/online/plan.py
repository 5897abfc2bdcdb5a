"""The coefficients that a step computes with, from the settings of the identifier."""

from math import cos, exp, sin
from typing import NamedTuple

from heli_plant.motor import kept

from .adaptation import AdaptationCoefficients, adaptation_coefficients
from .candidates import candidate
from .feedback import FeedbackCoefficients, feedback_coefficients
from .lag import LagCoefficients, lag_coefficients
from .moments import MomentCoefficients, moment_coefficients
from .noise_model import BANDWIDTH_CHANGE, CORNER_CHANGE, noise_coefficients
from .outside import outside_coefficients
from .prediction_error import PredictorCoefficients
from .settings import PREDICTION_ERROR, IdentifierSettings
from .signals import SignalCoefficients
from .state_filter import FilterCoefficients, discretise
from .watch import WatchCoefficients, watch_coefficients
from .whitening import NEWEST, filter_polynomial

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
