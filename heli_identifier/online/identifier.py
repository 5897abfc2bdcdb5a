"""The on-line identifier of all three axes, as a pure step.

    plan = prepare(settings)
    state = start(plan, v_front, v_rear, pitch, elevation, travel)                          sample 0
    state, estimate = step(state, v_front, v_rear, pitch, elevation, travel, plan)          samples 1, 2, ...

Sample k holds the angles at t_k = k h and the voltages held over [t_k, t_k + h). The estimate returned for sample k
uses nothing beyond its angles. The adaptation rests for the first 10/omega_f, until what the filters were not told
about the motion before sample 0 has faded (exp(-7)).

The state is nested tuples of numbers: ``json`` writes it, :func:`restored` reads it back, exact to the bit.
"""

from math import atan2, cos, hypot, sin
from typing import NamedTuple

from .adaptation import AdaptationCoefficients, adaptation_coefficients
from .axis import AxisState, adapt_axis, initial_axis, judge_axis, observe_axis
from .moments import MomentCoefficients, Moments, moment_coefficients
from .parameters import ModelParameters
from .settings import IdentifierSettings
from .signals import (
    SignalCoefficients,
    Signals,
    advance_signals,
    elevation_regression,
    pitch_regression,
    pitch_regression_free,
    settled_signals,
    travel_regression,
)
from .state_filter import discretise

_HOLD_RADIANS = 10.0
"""omega_f times the time for which the adaptation rests."""

_MOMENT_SPACING = 0.2
"""omega_f times the time between two samples of the moments: behind F, signals turn little in it."""


class Plan(NamedTuple):
    """Settings turned into what a step computes with; made once by :func:`prepare`."""

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


class IdentifierState(NamedTuple):
    """Everything remembered between two samples; ``samples`` counts those after sample 0."""

    samples: int
    signals: Signals
    pitch: AxisState
    elevation: AxisState
    travel: AxisState


class Estimate(NamedTuple):
    """What is known after a sample.

    ``parameters`` and their ``standard_errors`` by name; per axis (pitch, elevation, travel) the adaptation error
    sigma [rad/s^2] and the ``excitation`` level [1]; ``adapting`` is false while the adaptation rests.
    """

    parameters: ModelParameters
    standard_errors: ModelParameters
    sigma: tuple[float, float, float]
    excitation: tuple[float, float, float]
    adapting: bool


def prepare(settings: IdentifierSettings) -> Plan:
    """Return the plan of ``settings``."""
    h, omega = settings.sample_time, settings.filter_frequency
    hold = settings.hold_time if settings.hold_time is not None else _HOLD_RADIANS / omega
    spacing = max(1, round(_MOMENT_SPACING / (omega * h)))
    rest = settings.rest_angle if settings.rest_angle is not None else 0.0
    lag = settings.motor_time_constant
    return Plan(
        settings,
        SignalCoefficients(
            discretise(omega, settings.filter_damping, h, lag), h, lag, settings.voltage_limit
        ),
        adaptation_coefficients(settings.forgetting, h, settings.gain_limit),
        moment_coefficients(spacing * h, settings.forgetting, settings.excitation_window),
        round(hold / h),
        spacing,
        max(3, round(settings.report_interval / h)),
        settings.rest_angle is not None,
        sin(rest),
        cos(rest),
    )


def start(
    plan: Plan, v_front: float, v_rear: float, pitch: float, elevation: float, travel: float
) -> IdentifierState:
    """Return the state at sample 0, filters and motors settled at it; voltages [V], angles [rad]."""
    at, gain = plan.settings.initial, plan.settings.initial_gain
    if plan.rest_angle_is_known:
        pitch_omega: tuple[float, ...] = (at.a_wx, at.a_th, at.k_x)
    else:
        pitch_omega = (at.a_wx, at.a_th * cos(at.theta0), at.a_th * sin(at.theta0), at.k_x)
    return IdentifierState(
        0,
        settled_signals(v_front, v_rear, pitch, elevation, travel, plan.signals),
        initial_axis(pitch_omega, gain),
        initial_axis((at.a_wz, at.a_e, at.a_1, at.a_lt, at.k_z), gain),
        initial_axis((at.a_wy, at.k_y), gain),
    )


def step(
    state: IdentifierState,
    v_front: float,
    v_rear: float,
    pitch: float,
    elevation: float,
    travel: float,
    plan: Plan,
) -> tuple[IdentifierState, Estimate]:
    """Take in the next sample; voltages [V], angles [rad].

    Returns
    -------
    state : IdentifierState
    estimate : Estimate
    """
    signals = advance_signals(state.signals, v_front, v_rear, pitch, elevation, travel, plan.signals)
    f = plan.signals.filter
    if plan.rest_angle_is_known:
        y_1, phi_1 = pitch_regression(signals, plan.sine_of_rest, plan.cosine_of_rest, f)
    else:
        y_1, phi_1 = pitch_regression_free(signals, f)
    y_2, phi_2 = elevation_regression(signals, f)
    y_3, phi_3 = travel_regression(signals, f)

    axis_1, axis_2, axis_3 = state.pitch, state.elevation, state.travel
    samples = state.samples + 1
    count = samples - plan.hold_samples
    if count >= 0:
        axis_1 = adapt_axis(axis_1, y_1, phi_1, count, plan.adaptation)
        axis_2 = adapt_axis(axis_2, y_2, phi_2, count, plan.adaptation)
        axis_3 = adapt_axis(axis_3, y_3, phi_3, count, plan.adaptation)
        if count % plan.moment_samples == 0:
            axis_1 = observe_axis(axis_1, y_1, phi_1, plan.moments)
            axis_2 = observe_axis(axis_2, y_2, phi_2, plan.moments)
            axis_3 = observe_axis(axis_3, y_3, phi_3, plan.moments)
        # One axis a step, so that no step pays for all three.
        turn = count % plan.report_samples
        if turn == 0:
            axis_1 = _judged_pitch(axis_1, plan)
        elif turn == 1:
            axis_2 = judge_axis(axis_2, _ALL_FIVE, plan.settings.forgetting, plan.moments.interval)
        elif turn == 2:
            axis_3 = judge_axis(axis_3, _BOTH, plan.settings.forgetting, plan.moments.interval)
    state = IdentifierState(samples, signals, axis_1, axis_2, axis_3)
    return state, estimate_of(state, plan)


def _unit_rows(n: int) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(1.0 if i == j else 0.0 for j in range(n)) for i in range(n))


_BOTH, _ALL_THREE, _ALL_FIVE = _unit_rows(2), _unit_rows(3), _unit_rows(5)


def _judged_pitch(axis: AxisState, plan: Plan) -> AxisState:
    """Judge the pitch; with theta0 free, through the gradients of a_th = hypot(p, q) and theta0 = atan2(q, p)."""
    rows = _ALL_THREE
    if not plan.rest_angle_is_known:
        _, p, q, _ = axis.omega
        a = hypot(p, q) or 1.0
        rows = (
            (1.0, 0.0, 0.0, 0.0),
            (0.0, p / a, q / a, 0.0),
            (0.0, 0.0, 0.0, 1.0),
            (0.0, -q / (a * a), p / (a * a), 0.0),
        )
    return judge_axis(axis, rows, plan.settings.forgetting, plan.moments.interval)


def estimate_of(state: IdentifierState, plan: Plan) -> Estimate:
    """Return what ``state`` says, without taking a step."""
    axis_1, axis_2, axis_3 = state.pitch, state.elevation, state.travel
    error_1 = axis_1.standard_errors
    if plan.rest_angle_is_known:
        a_wx, a_th, k_x = axis_1.omega
        theta0, theta0_error = plan.settings.rest_angle or 0.0, 0.0
    else:
        a_wx, p, q, k_x = axis_1.omega
        a_th, theta0, theta0_error = hypot(p, q), atan2(q, p), error_1[3]
    return Estimate(
        ModelParameters(a_wx, a_th, k_x, theta0, *axis_2.omega, *axis_3.omega),
        ModelParameters(
            error_1[0], error_1[1], error_1[2], theta0_error, *axis_2.standard_errors, *axis_3.standard_errors
        ),
        (axis_1.sigma, axis_2.sigma, axis_3.sigma),
        (axis_1.excitation, axis_2.excitation, axis_3.excitation),
        state.samples >= plan.hold_samples,
    )


def restored(saved) -> IdentifierState:
    """Return the state that was written as JSON and read back as nested lists."""
    samples, signals, *axes = saved
    pitch, elevation, travel = (
        AxisState(
            tuple(factor),
            tuple(omega),
            Moments(m[0], m[1], tuple(m[2]), tuple(map(tuple, m[3])), tuple(m[4])),
            tuple(errors),
            excitation,
            sigma,
        )
        for factor, omega, m, errors, excitation, sigma in axes
    )
    plain: list = [tuple(x) if isinstance(x, list) else x for x in signals]
    return IdentifierState(samples, Signals(*plain), pitch, elevation, travel)
