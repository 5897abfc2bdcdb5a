"""The identifier's output: parameters and their standard errors by name, and how far they can be trusted."""

from math import atan2, copysign, hypot
from typing import NamedTuple

from .parameters import ModelParameters
from .plan import Plan
from .score import NOTHING, Score
from .state import IdentifierState


class Estimate(NamedTuple):
    """What is known after a sample.

    ``parameters`` and their ``standard_errors`` by name; per axis (pitch, elevation, travel) the adaptation error
    sigma [rad/s^2] and the ``excitation`` level [1]; ``adapting`` is false while the adaptation rests; ``scores`` are
    those of the watched effects, in the order of the settings.
    """

    parameters: ModelParameters
    standard_errors: ModelParameters
    sigma: tuple[float, float, float]
    excitation: tuple[float, float, float]
    adapting: bool
    scores: tuple[Score, ...] = ()


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
        _scores_in_order(state, plan) if plan.watch.candidates else (),
    )


def _scores_in_order(state: IdentifierState, plan: Plan) -> tuple[Score, ...]:
    """Scores in the order of the settings; coefficients that came out times the axis' gain are divided by it."""
    ordered = [NOTHING] * len(plan.watch.candidates)
    axes = (state.pitch, state.elevation, state.travel)
    for axis, columns in zip(axes, plan.watched_columns, strict=True):
        gain = axis.omega[-1]
        for i, (score, coefficient, visibility) in zip(columns, axis.scores, strict=True):
            if plan.watch.candidates[i].times_gain and gain != 0.0:
                score, coefficient = copysign(score, score * gain), coefficient / gain
            ordered[i] = Score(score, coefficient, visibility)
    return tuple(ordered)
