"""The coefficients that a step computes with, from the settings of the identifier."""

from math import cos, sin
from typing import NamedTuple

from heli_plant.motor import kept

from .adaptation import AdaptationCoefficients, adaptation_coefficients
from .candidates import candidate
from .moments import MomentCoefficients, moment_coefficients
from .settings import IdentifierSettings
from .signals import SignalCoefficients
from .state_filter import discretise
from .watch import WatchCoefficients, watch_coefficients

_HOLD_RADIANS = 10.0
"""omega_f times the time for which the adaptation rests."""

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
    rest_angle_is_known: bool
    sine_of_rest: float
    cosine_of_rest: float
    watch: WatchCoefficients
    watched_columns: tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]
    """For each axis, which of the watched effects are its own."""


def prepare(settings: IdentifierSettings) -> Plan:
    """Return the plan of ``settings``."""
    h, omega = settings.sample_time, settings.filter_frequency
    hold = settings.hold_time if settings.hold_time is not None else _HOLD_RADIANS / omega
    spacing = max(1, round(_MOMENT_SPACING / (omega * h)))
    rest = settings.rest_angle if settings.rest_angle is not None else 0.0
    lag = settings.motor_time_constant
    pitch, elevation, travel = (
        tuple(i for i, (_, axis) in enumerate(settings.watched) if axis == own)
        for own in ("pitch", "elevation", "travel")
    )
    return Plan(
        settings,
        SignalCoefficients(discretise(omega, settings.filter_damping, h, lag), h, kept(h, lag), settings.voltage_limit),
        adaptation_coefficients(settings.forgetting, h, settings.gain_limit),
        moment_coefficients(spacing * h, settings.forgetting, settings.excitation_window),
        round(hold / h),
        spacing,
        max(3, round(settings.report_interval / h)),
        settings.rest_angle is not None,
        sin(rest),
        cos(rest),
        watch_coefficients(tuple(candidate(name, axis) for name, axis in settings.watched), h),
        (pitch, elevation, travel),
    )
