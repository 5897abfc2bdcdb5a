"""The identifier's output: parameters and their standard errors by name, and how far they can be trusted."""

from math import atan2, copysign, hypot
from typing import NamedTuple

from .parameters import ModelParameters
from .plan import Plan
from .score import NOTHING, Score
from .state import IdentifierState


class IdentifierOutput(NamedTuple):
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


def output_of(state: IdentifierState, plan: Plan) -> IdentifierOutput:
    """Return what ``state`` says, without taking a step."""
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
        a_th, theta0 = hypot(p, q), atan2(q, p)
    return IdentifierOutput(
        ModelParameters._make((a_wx, a_th, k_x, theta0, *omega_2, *omega_3)),
        ModelParameters._make((*errors_1, *errors_2, *errors_3)),
        (sigma_1, sigma_2, sigma_3),
        (excitation_1, excitation_2, excitation_3),
        samples >= plan.hold_samples,
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
