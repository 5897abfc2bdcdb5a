"""What the identifier remembers between two samples, how that comes back from JSON, and what it says.

The state is nested tuples of numbers. ``json.dumps`` writes it, and :func:`restored` turns what ``json.loads`` reads
into the same state again, exact to the bit.
"""

from math import atan2, copysign, sqrt
from typing import Any, NamedTuple

from .axis import AxisState
from .estimate import ModelParameters
from .feedback import Feedback, feedback_score
from .instruments import Instruments, References, contradicts
from .lag import LagState
from .linear_algebra import hypotenuse
from .moments import Moments
from .noise_model import NoiseModel
from .outside import Outside
from .plan import Plan
from .prediction_error import PredictorState
from .score import NOTHING, Score
from .signals import Signals
from .watch import WatchState
from .whitening import Whitening

Predictors = tuple[PredictorState, PredictorState, PredictorState]
"""Of pitch, elevation and travel."""


class IdentifierState(NamedTuple):
    """Everything remembered between two samples.

    ``samples`` counts those after sample 0; ``voltages`` are the sums of front and rear voltage [V] since the last
    sample that was taken, where not all of them are (:class:`.plan.Plan`); ``lag`` is None where the lag is not
    estimated, ``watch`` where no effect is watched, ``predictors`` where the method is the adaptation; ``loops`` is
    what is known about the loops of pitch, elevation and travel; ``references`` are the instruments of all axes.
    """

    samples: int
    voltages: tuple[float, float]
    signals: Signals
    lag: LagState | None
    watch: WatchState | None
    pitch: AxisState
    elevation: AxisState
    travel: AxisState
    predictors: Predictors | None
    loops: tuple[Feedback, Feedback, Feedback]
    references: References


Omega = tuple[float, ...]

_LEAST_ERROR = 1e-9
"""Least standard error of a lag [s], so that weights stay finite."""


class Lag(NamedTuple):
    """The motors' time constant T_m and its standard error, 0 where it is given [s]."""

    value: float
    standard_error: float


Gains = tuple[float, float, float]
"""k_x, k_z, k_y, or their standard errors [rad/s^2/V]."""


class IdentifierOutput(NamedTuple):
    """What is known after a sample.

    ``parameters`` and their ``standard_errors`` by name; per axis (pitch, elevation, travel) the adaptation error
    ``sigma`` [rad/s^2], the ``excitation`` level [1] and the score of a closed loop, ``feedback`` [1]
    (:mod:`.feedback`); the motors' ``lag``; what references say as ``instruments`` of k_x, k_z, k_y
    with their standard errors ``instrument_errors`` [rad/s^2/V], 0 where none has moved, and whether an estimate is
    ``contradicted`` by them (:mod:`.instruments`); ``adapting`` is false while the adaptation rests; ``scores``
    are those of the watched effects, in the order of the settings.
    """

    parameters: ModelParameters
    standard_errors: ModelParameters
    sigma: tuple[float, float, float]
    excitation: tuple[float, float, float]
    feedback: tuple[float, float, float]
    lag: Lag
    instruments: Gains
    instrument_errors: Gains
    contradicted: bool
    adapting: bool
    scores: tuple[Score, ...] = ()


def restored(saved: Any) -> IdentifierState:
    """Return the state that ``json.dumps`` wrote and ``json.loads`` read as ``saved``."""
    samples, voltages, signals, lag, watch, pitch, elevation, travel, predictors, loops, references = _tuples(saved)
    first, second, third = loops
    return IdentifierState(
        samples,
        voltages,
        Signals(*signals),
        None if lag is None else LagState(*lag),
        None if watch is None else WatchState(*watch),
        _axis(*pitch),
        _axis(*elevation),
        _axis(*travel),
        None if predictors is None else _predictors(*predictors),
        (Feedback(*first), Feedback(*second), Feedback(*third)),
        References(*references),
    )


def _predictors(pitch, elevation, travel) -> Predictors:
    return _predictor(*pitch), _predictor(*elevation), _predictor(*travel)


def _predictor(memory, noise, whitening, outside, waiting, first, prior, instruments) -> PredictorState:
    known = NoiseModel(*noise), Whitening(*whitening), Outside(*outside)
    return PredictorState(memory, *known, waiting, first, prior, Instruments(*instruments))


def _axis(factor, omega, sigma, sums, moments, errors, excitation, scores) -> AxisState:
    of_candidates = tuple(Score(*score) for score in scores)
    return AxisState(factor, omega, sigma, sums, Moments(*moments), errors, excitation, of_candidates)


def _tuples(value: Any) -> Any:
    """Return ``value`` with every list in it, at any depth, as a tuple."""
    return tuple(map(_tuples, value)) if isinstance(value, list | tuple) else value


def before_samples(plan: Plan) -> IdentifierOutput:
    """Return what is known before the first sample: the initial estimate, and how uncertain Gamma(0) makes it."""
    error = sqrt(plan.settings.initial_gain)
    errors = ModelParameters(error, error, error, error, error, error, error, error, error, error, error)
    nothing = (0.0, 0.0, 0.0)
    lag = Lag(plan.settings.motor_time_constant, 0.0)
    return IdentifierOutput(
        plan.settings.initial, errors, nothing, nothing, nothing, lag, nothing, nothing, False, False
    )


def output_of(state: IdentifierState, plan: Plan) -> IdentifierOutput:
    """Return what is known in ``state``, without a step."""
    samples, _, _, _, _, pitch, elevation, travel, predictors, loops, _ = state
    _, omega_1, sigma_1, _, _, errors_1, excitation_1, _ = pitch
    _, omega_2, sigma_2, _, _, errors_2, excitation_2, _ = elevation
    _, omega_3, sigma_3, _, _, errors_3, excitation_3, _ = travel
    # Behind the parameters stands the noise model, where there is one.
    omega_1, omega_2, omega_3 = omega_1[: len(errors_1)], omega_2[: len(errors_2)], omega_3[: len(errors_3)]
    lag = Lag(plan.settings.motor_time_constant, 0.0)
    if plan.lag is not None:
        lag = lag_of(pitch, elevation, plan.lag.time_constant)
        omega_1, omega_2, errors_1, errors_2 = omega_1[:-1], omega_2[:-1], errors_1[:-1], errors_2[:-1]
    if plan.rest_angle_is_known:
        a_wx, a_th, k_x = omega_1
        theta0 = plan.settings.rest_angle or 0.0
        errors_1 = (*errors_1, 0.0)
    else:
        a_wx, p, q, k_x = omega_1
        a_th, theta0 = hypotenuse(p, q), atan2(q, p)
    instruments, instrument_errors, contradicted = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), False
    if predictors is not None:
        p_1, p_2, p_3 = predictors[0].instruments, predictors[1].instruments, predictors[2].instruments
        instruments = p_1.gain, p_2.gain, p_3.gain
        instrument_errors = p_1.standard_error, p_2.standard_error, p_3.standard_error
        contradicted = contradicts(p_1, k_x) or contradicts(p_2, omega_2[-1]) or contradicts(p_3, omega_3[-1])
    return IdentifierOutput(
        ModelParameters._make((a_wx, a_th, k_x, theta0, *omega_2, *omega_3)),
        ModelParameters._make((*errors_1, *errors_2, *errors_3)),
        (sigma_1, sigma_2, sigma_3),
        (excitation_1, excitation_2, excitation_3),
        (feedback_score(loops[0]), feedback_score(loops[1]), feedback_score(loops[2])),
        lag,
        instruments,
        instrument_errors,
        contradicted,
        samples // plan.every >= plan.hold_samples,
        _scores_in_order(state, plan) if plan.watch.candidates else (),
    )


def lag_of(pitch: AxisState, elevation: AxisState, assumed: float) -> Lag:
    """Return the lag from pitch and elevation, each weighted by the inverse square of its standard error."""
    # Behind the parameters stands the noise model, where there is one.
    omega_1, omega_2 = pitch.omega[: len(pitch.standard_errors)], elevation.omega[: len(elevation.standard_errors)]
    error_1 = max(pitch.standard_errors[-1], _LEAST_ERROR)
    error_2 = max(elevation.standard_errors[-1], _LEAST_ERROR)
    weight_1, weight_2 = 1.0 / (error_1 * error_1), 1.0 / (error_2 * error_2)
    beyond_1 = omega_1[-1] / omega_1[-2] if omega_1[-2] != 0.0 else 0.0
    beyond_2 = omega_2[-1] / omega_2[-2] if omega_2[-2] != 0.0 else 0.0
    both = weight_1 + weight_2
    return Lag(assumed + (weight_1 * beyond_1 + weight_2 * beyond_2) / both, 1.0 / sqrt(both))


def _scores_in_order(state: IdentifierState, plan: Plan) -> tuple[Score, ...]:
    """Return the scores in the order of the settings; coefficients times the axis' gain are divided by that gain."""
    ordered = [NOTHING] * len(plan.watch.candidates)
    axes = (state.pitch, state.elevation, state.travel)
    # Behind the parameters stands the noise model, where there is one.
    of_1, of_2, of_3 = (len(axis.standard_errors) for axis in axes)
    gain_1, gain_2, gain_3 = state.pitch.omega[of_1 - 1], state.elevation.omega[of_2 - 1], state.travel.omega[of_3 - 1]
    if plan.lag is not None:  # k stands before k Delta
        gain_1, gain_2 = state.pitch.omega[of_1 - 2], state.elevation.omega[of_2 - 2]
    for axis, gain, columns in zip(axes, (gain_1, gain_2, gain_3), plan.watched_columns, strict=True):
        for i, (score, coefficient, visibility) in zip(columns, axis.scores, strict=True):
            if plan.watch.candidates[i].times_gain and gain != 0.0:
                score, coefficient = copysign(score, score * gain), coefficient / gain
            ordered[i] = Score(score, coefficient, visibility)
    return tuple(ordered)
