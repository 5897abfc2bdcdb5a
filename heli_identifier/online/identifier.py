"""The on-line identifier of all three axes, as a pure step.

    plan = prepare(settings)
    state = start(plan, v_front, v_rear, pitch, elevation, travel)                          sample 0
    state, output = step(state, v_front, v_rear, pitch, elevation, travel, plan)            samples 1, 2, ...

Sample k holds the angles at t_k = k h and the voltages held over [t_k, t_k + h). The output for sample k uses
nothing later than its angles. The adaptation rests for the first 10/omega_f. By then the effect of the unknown motion
before sample 0 on the filters has faded to exp(-7).
"""

from math import cos, sin

from heli_plant.motor import saturate

from .axis import AxisState, adapt_axis, evaluate_axis, initial_axis, observe_axis, observe_products
from .early import kept_early
from .feedback import first_feedback, watch_error, watch_innovation
from .instruments import NO_REFERENCES, References, advance_references, evaluated, first_references, have_moved
from .lag import LagState, advance_lag, follow_lag, settled_lag
from .linear_algebra import hypotenuse
from .moments import fade
from .outside import widened
from .plan import Plan
from .prediction_error import (
    PredictorCoefficients,
    PredictorState,
    first_predictor,
    predict_axis,
    rest_predictor,
    with_noise,
)
from .prior import ELEVATION, ELEVATION_LAG, PITCH, PITCH_FREE, PITCH_LAG, TRAVEL
from .signals import (
    Signals,
    advance_signals,
    elevation_regression,
    pitch_regression,
    pitch_regression_free,
    settled_signals,
    travel_regression,
)
from .state import IdentifierOutput, IdentifierState, Predictors, lag_of, output_of
from .watch import WatchState, advance_watch, settled_watch

_LAST_TURN = 2
"""Step of a report interval in which the last axis is evaluated (:func:`_evaluated`)."""

Regressions = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
"""(phi, watched, y) of pitch, elevation and travel."""


Rows = tuple[tuple[float, ...], ...]
"""Combinations of the Omega of one axis."""


def start(
    plan: Plan,
    v_front: float,
    v_rear: float,
    pitch: float,
    elevation: float,
    travel: float,
    references: tuple[float, float, float] = NO_REFERENCES,
) -> IdentifierState:
    """Return the state at sample 0, filters and motors settled at it; voltages [V], angles and references [rad]."""
    at, gain = plan.settings.initial, plan.settings.initial_gain
    if plan.rest_angle_is_known:
        pitch_omega: tuple[float, ...] = (at.a_wx, at.a_th, at.k_x)
    else:
        pitch_omega = (at.a_wx, at.a_th * cos(at.theta0), at.a_th * sin(at.theta0), at.k_x)
    of_pitch, of_elevation, of_travel = (len(columns) for columns in plan.watched_columns)
    elevation_omega: tuple[float, ...] = (at.a_wz, at.a_e, at.a_1, at.a_lt, at.k_z)
    if plan.lag is not None:
        pitch_omega, elevation_omega = (*pitch_omega, 0.0), (*elevation_omega, 0.0)
    pitch_axis = initial_axis(pitch_omega, gain, of_pitch)
    elevation_axis = initial_axis(elevation_omega, gain, of_elevation)
    travel_axis = initial_axis((at.a_wy, at.k_y), gain, of_travel)
    signals = settled_signals(v_front, v_rear, pitch, elevation, travel, plan.signals)
    watch = settled_watch(signals, plan.watch) if plan.watch.candidates else None
    lag = settled_lag(signals, plan.lag) if plan.lag is not None else None
    predictors: Predictors | None = None
    if plan.predictor is not None:
        c, (first, second, third) = plan.predictor, plan.settings.noise
        of_pitch_known: tuple[float, ...] = PITCH if plan.rest_angle_is_known else PITCH_FREE
        of_elevation_known: tuple[float, ...] = ELEVATION
        if plan.lag is not None:
            of_pitch_known, of_elevation_known = (*of_pitch_known, PITCH_LAG), (*of_elevation_known, ELEVATION_LAG)
        pitch_axis = with_noise(pitch_axis, first, of_pitch_known, c)
        elevation_axis = with_noise(elevation_axis, second, of_elevation_known, c)
        travel_axis = with_noise(travel_axis, third, TRAVEL, c)
        z_1, z_2, z_3 = _regressions(signals, lag, watch, plan)
        predictors = (
            first_predictor(z_1, pitch_axis, c),
            first_predictor(z_2, elevation_axis, c),
            first_predictor(z_3, travel_axis, c),
        )
    return IdentifierState(
        0,
        (signals.v_front, signals.v_rear),
        signals,
        lag,
        watch,
        pitch_axis,
        elevation_axis,
        travel_axis,
        predictors,
        (
            first_feedback(signals.v_front - signals.v_rear, plan.feedback),
            first_feedback(signals.v_front + signals.v_rear, plan.feedback),
            first_feedback(signals.v_front - signals.v_rear, plan.feedback),
        ),
        first_references(references),
    )


def _regressions(signals: Signals, lag: LagState | None, watch: WatchState | None, plan: Plan) -> Regressions:
    """Return (phi, watched, y) of the three axes."""
    f = plan.signals.filter
    if plan.rest_angle_is_known:
        y_1, given = pitch_regression(signals, plan.sine_of_rest, plan.cosine_of_rest, f)
        phi_1: tuple[float, ...] = given
    else:
        y_1, phi_1 = pitch_regression_free(signals, f)
    y_2, of_elevation = elevation_regression(signals, f)
    phi_2: tuple[float, ...] = of_elevation
    if lag is not None:
        phi_1, phi_2 = (*phi_1, -lag.difference_f[0]), (*phi_2, -lag.lift_f[0])
    y_3, phi_3 = travel_regression(signals, f)
    if watch is None:
        return (*phi_1, y_1), (*phi_2, y_2), (*phi_3, y_3)
    own_1, own_2, own_3 = [tuple([watch.filtered[i][0] for i in columns]) for columns in plan.watched_columns]
    return (*phi_1, *own_1, y_1), (*phi_2, *own_2, y_2), (*phi_3, *own_3, y_3)


def step(
    state: IdentifierState,
    v_front: float,
    v_rear: float,
    pitch: float,
    elevation: float,
    travel: float,
    plan: Plan,
    references: tuple[float, float, float] = NO_REFERENCES,
) -> tuple[IdentifierState, IdentifierOutput]:
    """Take in the next sample; voltages [V], angles and, where there are any, the controller's references [rad].

    Returns
    -------
    state : IdentifierState
    output : IdentifierOutput
    """
    samples, signals, every = state.samples + 1, state.signals, plan.every
    if every > 1:
        limit = plan.signals.voltage_limit
        sum_front, sum_rear = state.voltages
        if samples % every > 0:
            sums = sum_front + saturate(v_front, limit), sum_rear + saturate(v_rear, limit)
            state = state._replace(samples=samples, voltages=sums)
            return state, output_of(state, plan)
        signals = signals._replace(v_front=sum_front / every, v_rear=sum_rear / every)
    before, lag, watch = signals, state.lag, state.watch
    signals = advance_signals(before, v_front, v_rear, pitch, elevation, travel, plan.signals)
    if lag is not None and plan.lag is not None:
        lag = advance_lag(lag, before, signals, plan.lag, plan.signals.filter)
    if watch is not None:
        watch = advance_watch(watch, signals, plan.watch, plan.signals.filter)
    z_1, z_2, z_3 = _regressions(signals, lag, watch, plan)
    axis_1, axis_2, axis_3, predictors = state.pitch, state.elevation, state.travel, state.predictors
    loop_1, loop_2, loop_3 = state.loops
    outside = state.references
    difference, total = signals.v_front - signals.v_rear, signals.v_front + signals.v_rear
    count = samples // every - plan.hold_samples
    c, a, loop = plan.predictor, plan.adaptation, plan.feedback
    if predictors is not None and c is not None:
        p_1, p_2, p_3 = predictors
        if count < 0:
            predictors = rest_predictor(p_1, z_1), rest_predictor(p_2, z_2), rest_predictor(p_3, z_3)
        else:
            outside = have_moved(outside, references)
            b: tuple[float, ...] = outside.b if outside.moved else ()
            axis_1, p_1 = predict_axis(axis_1, p_1, z_1, count, c, a, b)
            axis_2, p_2 = predict_axis(axis_2, p_2, z_2, count, c, a, b)
            axis_3, p_3 = predict_axis(axis_3, p_3, z_3, count, c, a, b)
            if outside.moved and count % c.outside.stride == 0:
                kept = c.outside.kept * kept_early(count, c.outside.stride, c.sample_time)
                outside = advance_references(outside, references, kept, c.outside)
            if outside.moved:
                turn, before_lag = count % plan.report_samples, 1 if plan.lag is not None else 0
                if turn == 0:
                    p_1 = with_instruments(axis_1, p_1, outside, before_lag, c)
                elif turn == 1:
                    p_2 = with_instruments(axis_2, p_2, outside, before_lag, c)
                elif turn == _LAST_TURN:
                    p_3 = with_instruments(axis_3, p_3, outside, 0, c)
            predictors = p_1, p_2, p_3
            loop_1 = watch_innovation(loop_1, axis_1.sigma, difference, count, loop)
            loop_2 = watch_innovation(loop_2, axis_2.sigma, total, count, loop)
            loop_3 = watch_innovation(loop_3, axis_3.sigma, difference, count, loop)
    elif count >= 0:
        axis_1 = adapt_axis(axis_1, z_1, count, a)
        axis_2 = adapt_axis(axis_2, z_2, count, a)
        axis_3 = adapt_axis(axis_3, z_3, count, a)
        loop_1 = watch_error(loop_1, axis_1.sigma, difference, count, loop)
        loop_2 = watch_error(loop_2, axis_2.sigma, total, count, loop)
        loop_3 = watch_error(loop_3, axis_3.sigma, difference, count, loop)
    if count >= 0:
        axis_1, axis_2, axis_3 = _evaluated(axis_1, axis_2, axis_3, predictors, count, plan)
    if lag is not None and plan.lag is not None and count >= 0 and count % plan.report_samples == _LAST_TURN:
        found = lag_of(axis_1, axis_2, plan.lag.time_constant)
        lag = follow_lag(lag, found.value, found.standard_error, plan.lag)
    voltages = signals.v_front, signals.v_rear
    loops = loop_1, loop_2, loop_3
    state = IdentifierState(samples, voltages, signals, lag, watch, axis_1, axis_2, axis_3, predictors, loops, outside)
    return state, output_of(state, plan)


def with_instruments(
    axis: AxisState, p: PredictorState, references: References, behind: int, c: PredictorCoefficients
) -> PredictorState:
    """Return ``p`` with what the instruments say about the gain, ``behind`` which so many parameters follow."""
    n = len(axis.omega) - 2
    found = evaluated(p.instruments, references, axis.omega, p.prior, n - 1 - behind, c.sample_time)
    return p._replace(instruments=found)


def _evaluated(
    axis_1: AxisState,
    axis_2: AxisState,
    axis_3: AxisState,
    predictors: Predictors | None,
    count: int,
    plan: Plan,
) -> tuple[AxisState, AxisState, AxisState]:
    """Return the axes with their moments and, in turns, their standard errors, excitation levels and scores brought up.

    One axis is evaluated per step, so that no step pays for all three.
    """
    averaged, predicted = plan.moment_samples, predictors is not None
    if (count + 1) % averaged == 0:
        kept = kept_early(count, averaged, plan.signals.sample_time) if predicted else 1.0
        axis_1 = _observed(axis_1, averaged, kept, predicted, plan)
        axis_2 = _observed(axis_2, averaged, kept, predicted, plan)
        axis_3 = _observed(axis_3, averaged, kept, predicted, plan)
    turn = count % plan.report_samples
    if turn == 0:
        rows = _pitch_rows(axis_1, plan)
        axis_1 = evaluate_axis(axis_1, rows, plan.settings.forgetting, plan.moments.interval, predicted)
        if predictors is not None:
            errors = widened(axis_1.standard_errors, predictors[0].outside, rows)
            axis_1 = axis_1._replace(standard_errors=errors)
    elif turn == 1:
        rows = _elevation_rows(axis_2, plan)
        axis_2 = evaluate_axis(axis_2, rows, plan.settings.forgetting, plan.moments.interval, predicted)
        if predictors is not None:
            errors = widened(axis_2.standard_errors, predictors[1].outside, rows)
            axis_2 = axis_2._replace(standard_errors=errors)
    elif turn == 2:
        axis_3 = evaluate_axis(axis_3, _BOTH, plan.settings.forgetting, plan.moments.interval, predicted)
        if predictors is not None:
            errors = widened(axis_3.standard_errors, predictors[2].outside, _BOTH)
            axis_3 = axis_3._replace(standard_errors=errors)
    return axis_1, axis_2, axis_3


def _observed(axis: AxisState, samples: int, kept: float, predicted: bool, plan: Plan) -> AxisState:
    """Return ``axis`` with the mean over the last ``samples`` added to its moments, of which a share is ``kept``."""
    if kept < 1.0:
        axis = axis._replace(moments=fade(axis.moments, kept))
    if predicted:
        return observe_products(axis, samples, plan.moments)
    return observe_axis(axis, samples, plan.moments)


def combinations(state: IdentifierState, plan: Plan) -> tuple[Rows, Rows, Rows]:
    """Return, for pitch, elevation and travel, the rows j whose j^T Omega are what is reported, to first order."""
    return _pitch_rows(state.pitch, plan), _elevation_rows(state.elevation, plan), _BOTH


def _unit_rows(n: int) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(1.0 if i == j else 0.0 for j in range(n)) for i in range(n))


_NOTHING = 1e-100
"""Value of a gain [rad/s^2/V] or torque [rad/s^2] that has been forgotten: the square of a smaller one may be zero."""

_BOTH, _ALL_THREE, _ALL_FIVE = _unit_rows(2), _unit_rows(3), _unit_rows(5)


def _pitch_rows(axis: AxisState, plan: Plan) -> tuple[tuple[float, ...], ...]:
    """Return the pitch's combinations; theta0 free, gradients of a_th = sqrt(p^2 + q^2) and theta0 = atan2(q, p)."""
    rows: tuple[tuple[float, ...], ...] = _ALL_THREE
    if not plan.rest_angle_is_known:
        p, q = axis.omega[1:3]
        a = hypotenuse(p, q)
        a = a if a > _NOTHING else 1.0
        rows = (
            (1.0, 0.0, 0.0, 0.0),
            (0.0, p / a, q / a, 0.0),
            (0.0, 0.0, 0.0, 1.0),
            (0.0, -q / (a * a), p / (a * a), 0.0),
        )
    if plan.lag is not None:
        rows = _with_lag(rows, axis.omega[: len(rows[0]) + 1])
    return rows


def _elevation_rows(axis: AxisState, plan: Plan) -> tuple[tuple[float, ...], ...]:
    """Return the elevation's combinations."""
    return _ALL_FIVE if plan.lag is None else _with_lag(_ALL_FIVE, axis.omega[:6])


def _with_lag(rows: tuple[tuple[float, ...], ...], omega: tuple[float, ...]) -> tuple[tuple[float, ...], ...]:
    """Return ``rows`` for an Omega that ends with k and k Delta, and the gradient of Delta."""
    gain, product = omega[-2], omega[-1]
    gain = gain if abs(gain) > _NOTHING else 1.0
    slope = (*([0.0] * (len(omega) - 2)), -product / (gain * gain), 1.0 / gain)
    return (*[(*row, 0.0) for row in rows], slope)
