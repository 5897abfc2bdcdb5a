"""The on-line identifier of all three axes, as a pure step.

    plan = prepare(settings)
    state = start(plan, v_front, v_rear, pitch, elevation, travel)                          sample 0
    state, output = step(state, v_front, v_rear, pitch, elevation, travel, plan)            samples 1, 2, ...

Sample k holds the angles at t_k = k h and the voltages held over [t_k, t_k + h). The output for sample k uses
nothing later than its angles. The adaptation rests for the first 10/omega_f. By then the effect of the unknown motion
before sample 0 on the filters has faded to exp(-7).
"""

from math import cos, sin

from .axis import AxisState, adapt_axis, evaluate_axis, initial_axis, observe_axis
from .linear_algebra import hypotenuse
from .plan import Plan
from .signals import (
    advance_signals,
    elevation_regression,
    pitch_regression,
    pitch_regression_free,
    settled_signals,
    travel_regression,
)
from .state import IdentifierOutput, IdentifierState, output_of
from .watch import advance_watch, settled_watch


def start(plan: Plan, v_front: float, v_rear: float, pitch: float, elevation: float, travel: float) -> IdentifierState:
    """Return the state at sample 0, filters and motors settled at it; voltages [V], angles [rad]."""
    at, gain = plan.settings.initial, plan.settings.initial_gain
    if plan.rest_angle_is_known:
        pitch_omega: tuple[float, ...] = (at.a_wx, at.a_th, at.k_x)
    else:
        pitch_omega = (at.a_wx, at.a_th * cos(at.theta0), at.a_th * sin(at.theta0), at.k_x)
    signals = settled_signals(v_front, v_rear, pitch, elevation, travel, plan.signals)
    of_pitch, of_elevation, of_travel = (len(columns) for columns in plan.watched_columns)
    return IdentifierState(
        0,
        signals,
        settled_watch(signals, plan.watch) if plan.watch.candidates else None,
        initial_axis(pitch_omega, gain, of_pitch),
        initial_axis((at.a_wz, at.a_e, at.a_1, at.a_lt, at.k_z), gain, of_elevation),
        initial_axis((at.a_wy, at.k_y), gain, of_travel),
    )


def step(
    state: IdentifierState,
    v_front: float,
    v_rear: float,
    pitch: float,
    elevation: float,
    travel: float,
    plan: Plan,
) -> tuple[IdentifierState, IdentifierOutput]:
    """Take in the next sample; voltages [V], angles [rad].

    Returns
    -------
    state : IdentifierState
    output : IdentifierOutput
    """
    signals = advance_signals(state.signals, v_front, v_rear, pitch, elevation, travel, plan.signals)
    f = plan.signals.filter
    if plan.rest_angle_is_known:
        y_1, phi_1 = pitch_regression(signals, plan.sine_of_rest, plan.cosine_of_rest, f)
    else:
        y_1, phi_1 = pitch_regression_free(signals, f)
    y_2, phi_2 = elevation_regression(signals, f)
    y_3, phi_3 = travel_regression(signals, f)

    watch = state.watch
    own_1: tuple[float, ...] = ()
    own_2: tuple[float, ...] = ()
    own_3: tuple[float, ...] = ()
    if watch is not None:
        watch = advance_watch(watch, signals, plan.watch, f)
        own_1, own_2, own_3 = [tuple([watch.filtered[i][0] for i in columns]) for columns in plan.watched_columns]
    axis_1, axis_2, axis_3 = state.pitch, state.elevation, state.travel
    samples = state.samples + 1
    count = samples - plan.hold_samples
    if count >= 0:
        axis_1 = adapt_axis(axis_1, y_1, phi_1, own_1, count, plan.adaptation)
        axis_2 = adapt_axis(axis_2, y_2, phi_2, own_2, count, plan.adaptation)
        axis_3 = adapt_axis(axis_3, y_3, phi_3, own_3, count, plan.adaptation)
        averaged = plan.moment_samples
        if (count + 1) % averaged == 0:
            axis_1 = observe_axis(axis_1, averaged, plan.moments)
            axis_2 = observe_axis(axis_2, averaged, plan.moments)
            axis_3 = observe_axis(axis_3, averaged, plan.moments)
        # One axis per step, so that no step pays for all three.
        turn = count % plan.report_samples
        if turn == 0:
            axis_1 = _evaluated_pitch(axis_1, plan)
        elif turn == 1:
            axis_2 = evaluate_axis(axis_2, _ALL_FIVE, plan.settings.forgetting, plan.moments.interval)
        elif turn == 2:
            axis_3 = evaluate_axis(axis_3, _BOTH, plan.settings.forgetting, plan.moments.interval)
    state = IdentifierState(samples, signals, watch, axis_1, axis_2, axis_3)
    return state, output_of(state, plan)


def _unit_rows(n: int) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(1.0 if i == j else 0.0 for j in range(n)) for i in range(n))


_BOTH, _ALL_THREE, _ALL_FIVE = _unit_rows(2), _unit_rows(3), _unit_rows(5)


def _evaluated_pitch(axis: AxisState, plan: Plan) -> AxisState:
    """Evaluate the pitch; with theta0 free, by the gradients of a_th = sqrt(p^2 + q^2) and theta0 = atan2(q, p)."""
    rows = _ALL_THREE
    if not plan.rest_angle_is_known:
        _, p, q, _ = axis.omega
        a = hypotenuse(p, q) or 1.0
        rows = (
            (1.0, 0.0, 0.0, 0.0),
            (0.0, p / a, q / a, 0.0),
            (0.0, 0.0, 0.0, 1.0),
            (0.0, -q / (a * a), p / (a * a), 0.0),
        )
    return evaluate_axis(axis, rows, plan.settings.forgetting, plan.moments.interval)
