"""The on-line identifier of all three axes, as a pure step.

    plan = prepare(settings)
    state = start(plan, v_front, v_rear, pitch, elevation, travel)                          sample 0
    state, output = step(state, v_front, v_rear, pitch, elevation, travel, plan)            samples 1, 2, ...

Sample k holds the angles at t_k = k h and the voltages held over [t_k, t_k + h). The output for sample k uses
nothing later than its angles. The adaptation rests for the first 10/omega_f. By then the effect of the unknown motion
before sample 0 on the filters has faded to exp(-7).

Between communication points the identifier samples at its own period, whatever step its host takes. Sample k is due at
t_0 + k h. At a communication point t the samples that are due are taken in; one between two points has the angles of
the straight line between them and the voltages held since the earlier one.
"""

from math import cos, sin
from typing import NamedTuple

from heli_plant.motor import saturate

from .adaptation import AxisState, adapt_axis, evaluate_axis, initial_axis, kept_early, observe_axis, observe_products
from .instruments import NO_REFERENCES, References, advance_references, evaluated, first_references, have_moved
from .linear_algebra import hypotenuse
from .loop import first_feedback, watch_error, watch_innovation, widened
from .moments import fade
from .prediction_error import (
    ELEVATION,
    ELEVATION_LAG,
    PITCH,
    PITCH_FREE,
    PITCH_LAG,
    TRAVEL,
    PredictorState,
    first_predictor,
    predict_axis,
    rest_predictor,
    with_noise,
)
from .settings import Plan
from .signals import (
    LagState,
    Signals,
    advance_lag,
    advance_signals,
    elevation_regression,
    follow_lag,
    pitch_regression,
    pitch_regression_free,
    settled_lag,
    settled_signals,
    travel_regression,
)
from .state import Axis, IdentifierOutput, IdentifierState, lag_of, output_of
from .watch import WatchState, advance_watch, settled_watch

_PITCH, _ELEVATION, _TRAVEL = 0, 1, 2
"""An axis is evaluated in that step of a report interval, so that no step pays for all three."""

_EARLY = 1e-6
"""A sample is due this fraction of its period early, because communication points k H have rounding errors."""

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
    at = plan.settings.initial
    if plan.rest_angle_is_known:
        pitch_omega: tuple[float, ...] = (at.a_wx, at.a_th, at.k_x)
    else:
        pitch_omega = (at.a_wx, at.a_th * cos(at.theta0), at.a_th * sin(at.theta0), at.k_x)
    elevation_omega: tuple[float, ...] = (at.a_wz, at.a_e, at.a_1, at.a_lt, at.k_z)
    pitch_widths: tuple[float, ...] = PITCH if plan.rest_angle_is_known else PITCH_FREE
    elevation_widths: tuple[float, ...] = ELEVATION
    if plan.lag is not None:
        pitch_omega, elevation_omega = (*pitch_omega, 0.0), (*elevation_omega, 0.0)
        pitch_widths, elevation_widths = (*pitch_widths, PITCH_LAG), (*elevation_widths, ELEVATION_LAG)
    signals = settled_signals(v_front, v_rear, pitch, elevation, travel, plan.signals)
    watch = settled_watch(signals, plan.watch) if plan.watch.candidates else None
    lag = settled_lag(signals, plan.lag) if plan.lag is not None else None
    z_1, z_2, z_3 = _regressions(signals, lag, watch, plan)
    difference, total = signals.v_front - signals.v_rear, signals.v_front + signals.v_rear
    axes = (
        _first_axis(_PITCH, pitch_omega, pitch_widths, z_1, difference, plan),
        _first_axis(_ELEVATION, elevation_omega, elevation_widths, z_2, total, plan),
        _first_axis(_TRAVEL, (at.a_wy, at.k_y), TRAVEL, z_3, difference, plan),
    )
    return IdentifierState(
        0, (signals.v_front, signals.v_rear), signals, lag, watch, axes, first_references(references)
    )


def _first_axis(
    which: int,
    omega: tuple[float, ...],
    widths: tuple[float, ...],
    z: tuple[float, ...],
    voltage: float,
    plan: Plan,
) -> Axis:
    """Return one axis at sample 0, ``widths`` the standard deviations of ``omega`` beforehand."""
    estimate = initial_axis(omega, plan.settings.initial_gain, len(plan.watched_columns[which]))
    p: PredictorState | None = None
    if plan.predictor is not None:
        estimate = with_noise(estimate, plan.settings.noise[which], widths, plan.predictor)
        p = first_predictor(z, estimate, plan.predictor)
    return Axis(estimate, p, first_feedback(voltage, plan.feedback))


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
    count = samples // every - plan.hold_samples
    held, asked = state.references, state.references
    if count >= 0 and plan.predictor is not None:
        held = have_moved(held, references)
        asked = advance_references(held, references, count, plan.predictor.sample_time, plan.predictor.outside)
    difference, total = signals.v_front - signals.v_rear, signals.v_front + signals.v_rear
    b: tuple[float, ...] = held.b if held.moved else ()
    pitch_axis, elevation_axis, travel_axis = state.axes
    axes = (
        _advance(_PITCH, pitch_axis, z_1, difference, count, b, asked, plan),
        _advance(_ELEVATION, elevation_axis, z_2, total, count, b, asked, plan),
        _advance(_TRAVEL, travel_axis, z_3, difference, count, b, asked, plan),
    )
    if lag is not None and plan.lag is not None and count >= 0 and count % plan.report_samples == _TRAVEL:
        found = lag_of(axes[0].estimate, axes[1].estimate, plan.lag.time_constant)
        lag = follow_lag(lag, found.value, found.standard_error, plan.lag)
    voltages = (signals.v_front, signals.v_rear)
    state = IdentifierState(samples, voltages, signals, lag, watch, axes, asked)
    return state, output_of(state, plan)


def _advance(
    which: int,
    axis: Axis,
    z: tuple[float, ...],
    voltage: float,
    count: int,
    b: tuple[float, ...],
    references: References,
    plan: Plan,
) -> Axis:
    """Return one axis after a sample, with its moments and, in its turn, its standard errors, excitation and scores."""
    own, p, loop = axis
    c, alpha, interval = plan.predictor, plan.settings.forgetting, plan.moments.interval
    observed, evaluating = (count + 1) % plan.moment_samples == 0, count % plan.report_samples == which
    if p is not None and c is not None:
        if count < 0:
            return Axis(own, rest_predictor(p, z), loop)
        own, after = predict_axis(own, p, z, count, c, plan.adaptation, b)
        loop = watch_innovation(loop, own.sigma, voltage, count, plan.feedback)
        if observed:
            kept = kept_early(count, plan.moment_samples, c.sample_time)
            if kept < 1.0:
                own = own._replace(moments=fade(own.moments, kept))
            own = observe_products(own, plan.moment_samples, plan.moments)
        if evaluating:
            rows = _rows(which, own, plan)
            own = evaluate_axis(own, rows, alpha, interval, True)
            own = own._replace(standard_errors=widened(own.standard_errors, after.outside, rows))
            if references.moved:
                gain = len(own.omega) - (4 if plan.lag is not None and which != _TRAVEL else 3)  # k Delta, nu behind
                found = evaluated(after.instruments, references, own.omega, p.prior, gain, c.sample_time)
                after = after._replace(instruments=found)
        return Axis(own, after, loop)
    if count >= 0:
        own = adapt_axis(own, z, count, plan.adaptation)
        loop = watch_error(loop, own.sigma, voltage, count, plan.feedback)
        if observed:
            own = observe_axis(own, plan.moment_samples, plan.moments)
        if evaluating:
            own = evaluate_axis(own, _rows(which, own, plan), alpha, interval)
    return Axis(own, p, loop)


def combinations(state: IdentifierState, plan: Plan) -> tuple[Rows, Rows, Rows]:
    """Return, for pitch, elevation and travel, the rows j whose j^T Omega are what is reported, to first order."""
    return (
        _rows(_PITCH, state.axes[0].estimate, plan),
        _rows(_ELEVATION, state.axes[1].estimate, plan),
        _rows(_TRAVEL, state.axes[2].estimate, plan),
    )


def _unit_rows(n: int) -> Rows:
    return tuple(tuple(1.0 if i == j else 0.0 for j in range(n)) for i in range(n))


_NOTHING = 1e-100
"""Value of a gain [rad/s^2/V] or torque [rad/s^2] that has been forgotten: the square of a smaller one may be zero."""

_BOTH, _ALL_THREE, _ALL_FIVE = _unit_rows(2), _unit_rows(3), _unit_rows(5)


def _rows(which: int, axis: AxisState, plan: Plan) -> Rows:
    """Return the combinations of an axis: gradients of a_th = sqrt(p^2 + q^2) and theta0 = atan2(q, p) among them."""
    rows: Rows = _BOTH if which == _TRAVEL else _ALL_FIVE if which == _ELEVATION else _ALL_THREE
    if which == _PITCH and not plan.rest_angle_is_known:
        p, q = axis.omega[1:3]
        a = hypotenuse(p, q)
        a = a if a > _NOTHING else 1.0
        rows = (
            (1.0, 0.0, 0.0, 0.0),
            (0.0, p / a, q / a, 0.0),
            (0.0, 0.0, 0.0, 1.0),
            (0.0, -q / (a * a), p / (a * a), 0.0),
        )
    if plan.lag is None or which == _TRAVEL:
        return rows
    n = len(rows[0])
    gain, product = axis.omega[n - 1], axis.omega[n]
    gain = gain if abs(gain) > _NOTHING else 1.0
    slope = (*([0.0] * (n - 1)), -product / (gain * gain), 1.0 / gain)
    return (*[(*row, 0.0) for row in rows], slope)


Sample = tuple[float, float, float, float, float]
"""Front and rear voltage [V]; pitch, elevation, travel [rad]."""


class Sampled(NamedTuple):
    """State of the identifier; times [s] of sample 0 and of the communication point before; what was read there."""

    state: IdentifierState
    first: float
    before: float
    previous: Sample


def begin_sampling(
    time: float, now: Sample, plan: Plan, references: tuple[float, float, float] = NO_REFERENCES
) -> Sampled:
    """Return what is remembered after sample 0, which is ``now`` at ``time`` [s], with its ``references`` [rad]."""
    v_front, v_rear, pitch, elevation, travel = now
    return Sampled(start(plan, v_front, v_rear, pitch, elevation, travel, references), time, time, now)


def is_due(sampled: Sampled, time: float, plan: Plan) -> bool:
    """Return whether a further sample is due up to ``time`` [s]."""
    period = plan.settings.sample_time
    return sampled.first + (sampled.state.samples + 1) * period <= time + _EARLY * period


def take_sample(
    sampled: Sampled, time: float, now: Sample, plan: Plan, references: tuple[float, float, float] = NO_REFERENCES
) -> tuple[IdentifierState, IdentifierOutput]:
    """Take in the next sample, which is due up to ``time`` [s], at which ``now`` and the ``references`` are read."""
    period = plan.settings.sample_time
    due = sampled.first + (sampled.state.samples + 1) * period
    v_front, v_rear, pitch, elevation, travel = now
    if due < time - _EARLY * period:
        v_front, v_rear, pitch_0, elevation_0, travel_0 = sampled.previous
        share = (due - sampled.before) / (time - sampled.before)
        pitch = pitch_0 + share * (pitch - pitch_0)
        elevation = elevation_0 + share * (elevation - elevation_0)
        travel = travel_0 + share * (travel - travel_0)
    return step(sampled.state, v_front, v_rear, pitch, elevation, travel, plan, references)


def take_samples(
    sampled: Sampled, time: float, now: Sample, plan: Plan, references: tuple[float, float, float] = NO_REFERENCES
) -> tuple[Sampled, IdentifierOutput | None]:
    """Take in the samples that are due up to ``time`` [s], at which ``now`` and the ``references`` [rad] are read.

    Returns
    -------
    sampled : Sampled
    output : IdentifierOutput or None
        None if no sample was due.
    """
    output: IdentifierOutput | None = None
    while is_due(sampled, time, plan):
        state, output = take_sample(sampled, time, now, plan, references)
        sampled = sampled._replace(state=state)
    return sampled._replace(before=time, previous=now), output
