"""What the identifier remembers between two samples, how that comes back from JSON, and what it says.

The state is nested tuples of numbers. ``json.dumps`` writes it, and :func:`restored` turns what ``json.loads`` reads
into the same state again, exact to the bit.
"""

from math import atan2, copysign, sqrt
from typing import Any, NamedTuple

from .axis import AxisState
from .estimate import ModelParameters
from .linear_algebra import hypotenuse
from .moments import Moments
from .plan import Plan
from .score import NOTHING, Score
from .signals import Signals
from .watch import WatchState


class IdentifierState(NamedTuple):
    """Everything remembered between two samples; ``samples`` counts those after sample 0."""

    samples: int
    signals: Signals
    watch: WatchState | None
    pitch: AxisState
    elevation: AxisState
    travel: AxisState


class IdentifierOutput(NamedTuple):
    """What is known after a sample.

    ``parameters`` and their ``standard_errors`` by name; per axis (pitch, elevation, travel) the adaptation error
    ``sigma`` [rad/s^2] and the ``excitation`` level [1]; ``adapting`` is false while the adaptation rests; ``scores``
    are those of the watched effects, in the order of the settings.
    """

    parameters: ModelParameters
    standard_errors: ModelParameters
    sigma: tuple[float, float, float]
    excitation: tuple[float, float, float]
    adapting: bool
    scores: tuple[Score, ...] = ()


def restored(saved: Any) -> IdentifierState:
    """Return the state that ``json.dumps`` wrote and ``json.loads`` read as ``saved``."""
    samples, signals, watch, *axes = _tuples(saved)
    pitch, elevation, travel = (_axis(*axis) for axis in axes)
    return IdentifierState(
        samples, Signals(*signals), None if watch is None else WatchState(*watch), pitch, elevation, travel
    )


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
    return IdentifierOutput(plan.settings.initial, errors, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), False)


def output_of(state: IdentifierState, plan: Plan) -> IdentifierOutput:
    """Return what is known in ``state``, without a step."""
    samples, _, _, pitch, elevation, travel = state
    _, omega_1, sigma_1, _, _, errors_1, excitation_1, _ = pitch
    _, omega_2, sigma_2, _, _, errors_2, excitation_2, _ = elevation
    _, omega_3, sigma_3, _, _, errors_3, excitation_3, _ = travel
    if plan.rest_angle_is_known:
        a_wx, a_th, k_x = omega_1
        theta0 = plan.settings.rest_angle or 0.0
        errors_1 = (*errors_1, 0.0)
    else:
        a_wx, p, q, k_x = omega_1
        a_th, theta0 = hypotenuse(p, q), atan2(q, p)
    return IdentifierOutput(
        ModelParameters._make((a_wx, a_th, k_x, theta0, *omega_2, *omega_3)),
        ModelParameters._make((*errors_1, *errors_2, *errors_3)),
        (sigma_1, sigma_2, sigma_3),
        (excitation_1, excitation_2, excitation_3),
        samples >= plan.hold_samples,
        _scores_in_order(state, plan) if plan.watch.candidates else (),
    )


def _scores_in_order(state: IdentifierState, plan: Plan) -> tuple[Score, ...]:
    """Return the scores in the order of the settings; coefficients times the axis' gain are divided by that gain."""
    ordered = [NOTHING] * len(plan.watch.candidates)
    axes = (state.pitch, state.elevation, state.travel)
    for axis, columns in zip(axes, plan.watched_columns, strict=True):
        gain = axis.omega[-1]
        for i, (score, coefficient, visibility) in zip(columns, axis.scores, strict=True):
            if plan.watch.candidates[i].times_gain and gain != 0.0:
                score, coefficient = copysign(score, score * gain), coefficient / gain
            ordered[i] = Score(score, coefficient, visibility)
    return tuple(ordered)
