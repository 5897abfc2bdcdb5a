"""The on-line identifier of all three axes, as a pure step: its state between two samples, and its output.

    plan = prepare(settings)
    state = start(plan, now)                            sample 0
    state, output = step(state, now, plan)              samples 1, 2, ...

Sample k has the angles at t_k = k h and the voltages, constant over [t_k, t_k + h). The output for sample k uses
nothing later than its angles. The adaptation rests for the first 10/omega_f, in which the effect of the unknown motion
before sample 0 on the filters decays to exp(-7).

Sample k is due at t_0 + k h, whatever step a host takes. At a communication point all samples due by then are taken.
A sample between two points has linearly interpolated angles and the voltages of the earlier point.
"""

from math import atan2, sqrt
from typing import NamedTuple, Optional

from heli_plant.motor import saturate

from .adaptation import (
    AxisState,
    adapt_axis,
    combinations,
    evaluate_axis,
    initial_axis,
    kept_information,
    update_moments,
)
from .instruments import NO_REFERENCES, References, advance_references, contradicts, solve_gain
from .linear_algebra import hypotenuse
from .loop import Feedback, feedback_score, shares, update_score
from .prediction_error import PredictorState, initial_predictor, predict_axis
from .settings import ModelParameters, Plan
from .signals import (
    Angles,
    LagState,
    Sample,
    Signals,
    advance_lag,
    advance_signals,
    follow_lag,
    regressions,
    settled_lag,
    settled_signals,
)
from .whitening import settled_memory, whiten

_PITCH, _ELEVATION, _TRAVEL = 0, 1, 2  # axes, and the steps of a report interval in which they are evaluated


class Axis(NamedTuple):
    """State of one axis; without a predictor the method is the adaptation."""

    estimate: AxisState
    predictor: Optional[PredictorState]  # noqa: UP045 - a host's Python may be 3.9, where types have no |
    loop: Feedback


class IdentifierState(NamedTuple):
    """State between two samples."""

    samples: int  # number of samples after sample 0
    voltages: tuple[float, float]  # sums of front and rear voltage [V] since the last sample that was used
    signals: Signals
    lag: Optional[LagState]  # noqa: UP045
    axes: tuple[Axis, Axis, Axis]  # pitch, elevation, travel
    references: References


_LEAST_ERROR = 1e-9  # least standard error of a lag [s], so that weights stay finite


class Lag(NamedTuple):
    """The motors' time constant T_m and its standard error [s], which is 0 for a known time constant."""

    value: float
    standard_error: float


class IdentifierOutput(NamedTuple):
    """The output after a sample; triples are of pitch, elevation, travel."""

    parameters: ModelParameters
    standard_errors: ModelParameters
    sigma: tuple[float, float, float]  # adaptation error [rad/s^2]
    feedback: tuple[float, float, float]  # score of a closed loop [1]
    lag: Lag
    instruments: tuple[float, float, float]  # k_x, k_z, k_y by the references [rad/s^2/V], 0 if none has moved
    instrument_errors: tuple[float, float, float]  # their standard errors
    contradicted: bool  # whether the instruments exclude an estimate
    adapting: bool  # false while the adaptation rests


def start(plan: Plan, now: Sample, references: Angles = NO_REFERENCES) -> IdentifierState:
    """Return the state at sample 0, which is ``now``, with filters and motors in steady state; references [rad]."""
    settings, h = plan.settings, plan.sample_time
    signals = settled_signals(now, settings.voltage_limit)
    lag = settled_lag(signals, h, settings.motor_time_constant) if plan.estimates_lag else None
    z_1, z_2, z_3 = regressions(signals, lag, settings.rest_angle, plan.filter)
    front, rear = signals.voltages
    axes = (
        _initial_axis(_PITCH, z_1, front - rear, plan),
        _initial_axis(_ELEVATION, z_2, front + rear, plan),
        _initial_axis(_TRAVEL, z_3, front - rear, plan),
    )
    return IdentifierState(0, signals.voltages, signals, lag, axes, References(references))


def before_samples(plan: Plan) -> IdentifierOutput:
    """Return the output before the first sample: the initial estimate with the uncertainty of Gamma(0)."""
    return output_of(start(plan, (0.0, 0.0, 0.0, 0.0, 0.0)), plan)._replace(parameters=plan.settings.initial)


def _initial_axis(which: int, z: tuple[float, ...], voltage: float, plan: Plan) -> Axis:
    axis_plan = plan.axes[which]
    predictor = initial_predictor(z, axis_plan, plan) if plan.predicting else None
    return Axis(initial_axis(axis_plan, plan), predictor, Feedback(settled_memory(0.0, plan.error_whitening), voltage))


def step(
    state: IdentifierState, now: Sample, plan: Plan, references: Angles = NO_REFERENCES
) -> tuple[IdentifierState, IdentifierOutput]:
    """Return state and output after the next sample with the controller's references [rad]."""
    samples, previous, decimation, settings = state.samples + 1, state.signals, plan.decimation, plan.settings
    if decimation > 1:
        limit = settings.voltage_limit
        sum_front, sum_rear = state.voltages
        if samples % decimation > 0:
            sums = sum_front + saturate(now[0], limit), sum_rear + saturate(now[1], limit)
            state = state._replace(samples=samples, voltages=sums)
            return state, output_of(state, plan)
        previous = previous._replace(voltages=(sum_front / decimation, sum_rear / decimation))
    h, assumed, f = plan.sample_time, settings.motor_time_constant, plan.filter
    lag = state.lag
    signals = advance_signals(previous, now, h, assumed, settings.voltage_limit, f)
    if lag is not None:
        lag = advance_lag(lag, previous, signals, h, f)
    z_1, z_2, z_3 = regressions(signals, lag, settings.rest_angle, f)
    count, early, new_references = samples // decimation - plan.hold_samples, 1.0, state.references
    if count >= 0 and plan.predicting:
        early = kept_information(count, 1, h)
        new_references = advance_references(new_references, references, count, plan.product_samples, h)
    front, rear = signals.voltages
    b: tuple[float, ...] = state.references.b if new_references.moved else ()
    pitch_axis, elevation_axis, travel_axis = state.axes
    axes = (
        _advance_axis(_PITCH, pitch_axis, z_1, front - rear, count, early, b, new_references, plan),
        _advance_axis(_ELEVATION, elevation_axis, z_2, front + rear, count, early, b, new_references, plan),
        _advance_axis(_TRAVEL, travel_axis, z_3, front - rear, count, early, b, new_references, plan),
    )
    if lag is not None and count >= 0 and count % plan.report_samples == _TRAVEL:
        estimate = lag_of(axes[0].estimate, axes[1].estimate, plan)
        lag = follow_lag(lag, estimate.value, estimate.standard_error, h, assumed)
    state = IdentifierState(samples, signals.voltages, signals, lag, axes, new_references)
    return state, output_of(state, plan)


def _advance_axis(
    which: int, axis: Axis, z: tuple[float, ...], voltage: float, count: int, early: float, b: tuple[float, ...],
    references: References, plan: Plan,
) -> Axis:  # fmt: skip
    """Return one axis after a sample; once per report interval its standard errors are evaluated."""
    estimate, predictor, loop = axis
    axis_plan, h = plan.axes[which], plan.sample_time
    if count < 0:
        if predictor is None:
            return axis
        memory, _ = whiten(predictor.memory, z, predictor.whitening)
        return axis._replace(predictor=predictor._replace(memory=tuple(memory)))
    if predictor is None:
        estimate = adapt_axis(estimate, z, count, plan)
        whitened, e = whiten(loop[:1], (estimate.sigma,), plan.error_whitening)
        loop = update_score(Feedback(whitened[0], *loop[1:]), e[0], voltage, count, plan.score_samples)
    else:
        estimate, predictor = predict_axis(estimate, predictor, z, count, early, b, axis_plan, plan)
        loop = update_score(loop, estimate.sigma, voltage, count, plan.score_samples)
    if (count + 1) % plan.moment_samples == 0:
        estimate = update_moments(estimate, count, plan)
    if count % plan.report_samples == which:
        rows = combinations(which, estimate, plan)
        estimate = evaluate_axis(estimate, rows, count, plan)
        if predictor is not None:
            from_outside = shares(predictor.outside, rows)  # only information from outside the loop counts
            errors = [error / sqrt(share) for error, share in zip(estimate.standard_errors, from_outside, strict=True)]
            estimate = estimate._replace(standard_errors=tuple(errors))
            if references.moved:
                instruments = solve_gain(predictor.instruments, estimate.omega, axis_plan.prior, axis_plan.gain, h)
                predictor = predictor._replace(instruments=instruments)
    return Axis(estimate, predictor, loop)


def output_of(state: IdentifierState, plan: Plan) -> IdentifierOutput:
    """Return the output of ``state``, without a step."""
    (pitch, p_1, loop_1), (elevation, p_2, loop_2), (travel, p_3, loop_3) = state.axes
    rest, errors = plan.settings.rest_angle, pitch.standard_errors
    if rest is not None:
        a_wx, a_th, k_x = pitch.omega[:3]
        theta0 = rest
        errors_1 = (*errors[:3], 0.0)
    else:
        a_wx, p, q, k_x = pitch.omega[:4]
        a_th, theta0 = hypotenuse(p, q), atan2(q, p)
        errors_1 = errors[:4]
    instruments, instrument_errors, contradicted = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), False
    if state.references.moved and p_1 is not None and p_2 is not None and p_3 is not None:
        i_1, i_2, i_3 = p_1.instruments, p_2.instruments, p_3.instruments
        instruments = i_1.gain, i_2.gain, i_3.gain
        instrument_errors = i_1.standard_error, i_2.standard_error, i_3.standard_error
        k_z, k_y = elevation.omega[4], travel.omega[1]
        contradicted = contradicts(i_1, k_x) or contradicts(i_2, k_z) or contradicts(i_3, k_y)
    return IdentifierOutput(
        ModelParameters._make((a_wx, a_th, k_x, theta0, *elevation.omega[:5], *travel.omega[:2])),
        ModelParameters._make((*errors_1, *elevation.standard_errors[:5], *travel.standard_errors[:2])),
        (pitch.sigma, elevation.sigma, travel.sigma),
        (feedback_score(loop_1), feedback_score(loop_2), feedback_score(loop_3)),
        lag_of(pitch, elevation, plan),
        instruments,
        instrument_errors,
        contradicted,
        state.samples // plan.decimation >= plan.hold_samples,
    )


def lag_of(pitch: AxisState, elevation: AxisState, plan: Plan) -> Lag:
    """Return the lag as the mean of pitch and elevation, weighted by their inverse squared standard errors."""
    assumed = plan.settings.motor_time_constant
    if not plan.estimates_lag:
        return Lag(assumed, 0.0)
    weighted, weights = 0.0, 0.0
    for axis, axis_plan in ((pitch, plan.axes[0]), (elevation, plan.axes[1])):
        gain, product = axis.omega[axis_plan.gain], axis.omega[axis_plan.gain + 1]
        error = max(axis.standard_errors[-1], _LEAST_ERROR)
        weight = 1.0 / (error * error)
        weighted += weight * (product / gain if gain != 0.0 else 0.0)
        weights += weight
    return Lag(assumed + weighted / weights, 1.0 / sqrt(weights))


class Sampled(NamedTuple):
    """State of the identifier within a host that chooses the communication points."""

    state: IdentifierState
    first: float  # time of sample 0 [s]
    before: float  # time of the last communication point [s]
    previous: Sample  # values at the last communication point


def begin_sampling(time: float, now: Sample, plan: Plan, references: Angles = NO_REFERENCES) -> Sampled:
    """Return the state after sample 0, which is ``now`` at ``time`` [s], with its ``references`` [rad]."""
    return Sampled(start(plan, now, references), time, time, now)


def next_due(first: float, samples: int, plan: Plan) -> float:
    """Return the time at which the sample after number ``samples`` is due; ``first`` is that of sample 0 [s]."""
    return first + (samples + 1) * plan.settings.sample_time


def take_samples(
    sampled: Sampled, time: float, early: float, now: Sample, plan: Plan, references: Angles = NO_REFERENCES
) -> tuple[Sampled, IdentifierOutput | None]:
    """Take all samples due by the communication point ``time`` [s] with the values ``now`` and ``references``.

    A sample is due up to ``early`` [s] before its instant, because hosts round their times. The output is None if there
    is none.
    """
    state, first, before, last = sampled
    output: IdentifierOutput | None = None
    due = next_due(first, state.samples, plan)
    while due <= time + early:
        row = now
        if due < time - early:
            share = (due - before) / (time - before)
            pitch, elevation, travel = [a + share * (b - a) for a, b in zip(last[2:], now[2:], strict=True)]
            row = last[0], last[1], pitch, elevation, travel
        state, output = step(state, row, plan, references)
        due = next_due(first, state.samples, plan)
    return Sampled(state, first, time, now), output
