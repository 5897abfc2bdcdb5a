"""The twin that follows: the on-line identifier and the corrector, sample by sample, as the units are wired.

At sample k the corrector takes the measurement of sample k and what the identifier said after sample k - 1: that is
what a unit sees whose inputs are set at a communication point.
"""

from typing import NamedTuple

from heli_plant.parameters import PlantParameters

from ..online import (
    PREDICTION_ERROR,
    IdentifierOutput,
    IdentifierSettings,
    IdentifierState,
    Plan,
    before_samples,
    prepare,
    start,
    step,
)
from .corrector import correct, start_correcting
from .hearing import HEARD
from .plan import FollowPlan, parameters_of, prepare_following
from .settings import FollowSettings
from .state import CorrectorOutput, CorrectorState, Sample, Told

FORGETTING = 0.02
"""Of the identifier beside the twin [1/s]: what changed a minute ago is known."""


class Follower(NamedTuple):
    """Plans of identifier and corrector."""

    identifier: Plan
    corrector: FollowPlan


class FollowState(NamedTuple):
    """States of identifier and corrector, and what the identifier said last."""

    identifier: IdentifierState
    corrector: CorrectorState
    estimates: IdentifierOutput


class FollowOutput(NamedTuple):
    """What the corrector says after a sample, and the identifier's estimates."""

    corrector: CorrectorOutput
    estimates: IdentifierOutput


def identifier_settings(settings: FollowSettings) -> IdentifierSettings:
    """Return the settings of the identifier beside a following twin: what holds in closed loop, and forgets."""
    return IdentifierSettings(
        sample_time=settings.sample_time,
        method=PREDICTION_ERROR,
        forgetting=FORGETTING,
        motor_time_constant=settings.parameters.T_m,
        voltage_limit=settings.parameters.v_max,
        report_interval=2.0,
        watched=settings.effects,
    )


def prepare_follower(settings: FollowSettings) -> Follower:
    """Return the plans of ``settings``."""
    return Follower(prepare(identifier_settings(settings)), prepare_following(settings))


def start_following(plan: Follower, now: Sample) -> FollowState:
    """Return the state at sample 0."""
    state = start(plan.identifier, now.v_front, now.v_rear, now.pitch, now.elevation, now.travel)
    return FollowState(state, start_correcting(plan.corrector, now), before_samples(plan.identifier))


def follow(state: FollowState, now: Sample, plan: Follower) -> tuple[FollowState, FollowOutput]:
    """Take in the next sample."""
    said = state.estimates
    told = Told(
        said.excitation,
        tuple([score.score for score in said.scores]),
        tuple([getattr(said.parameters, field) for field in HEARD]),
        tuple([getattr(said.standard_errors, field) for field in HEARD]),
    )
    corrector, output = correct(state.corrector, now, told, plan.corrector)
    identifier, estimates = step(
        state.identifier, now.v_front, now.v_rear, now.pitch, now.elevation, now.travel, plan.identifier
    )
    return FollowState(identifier, corrector, estimates), FollowOutput(output, estimates)


def parameters_in_use(state: CorrectorState, plan: FollowPlan) -> PlantParameters:
    """Return the plant's parameters that the twin uses, the rotors' shares folded in.

    Rotors with the shares f and r of their thrust have mu_d = f nu_f - r nu_r = a (nu_f - nu_r) + b (nu_f + nu_r) with
    a = (f + r)/2, b = (f - r)/2: on the pitch k_x becomes a k_x, and the rotors' sum turns it by b k_x (rotor
    mismatch); k_z and k_y become a k_z and a k_y, where b (nu_f - nu_r) is left out.
    """
    values = state.values.end
    p, front, rear = parameters_of(values, plan), values[-2], values[-1]
    if front == 1.0 and rear == 1.0:
        return p
    a, b = 0.5 * (front + rear), 0.5 * (front - rear)
    return p._replace(
        k_x=a * p.k_x, k_z=a * p.k_z, k_y=a * p.k_y, rotor_mismatch_pitch=p.rotor_mismatch_pitch + b * p.k_x
    )


def shares_in_use(state: CorrectorState) -> tuple[float, float]:
    """Return the shares of the front and the rear rotor's thrust that are left [1]."""
    return state.values.end[-2], state.values.end[-1]


def standard_errors_in_use(state: CorrectorState, plan: FollowPlan) -> dict[str, float]:
    """Return the standard errors of the values that were adopted, by name."""
    pairs = zip(plan.changeable, state.values.errors, strict=True)
    return {name: error for name, error in pairs if error > 0.0}
