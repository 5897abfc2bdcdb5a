"""The identifier between communication points: it samples at its own period, whatever step its host takes.

Sample k is due at t_0 + k h. At a communication point t the samples that are due are taken in; one between two points
has the angles of the straight line between them and the voltages held since the earlier one.
"""

from typing import NamedTuple

from .identifier import start, step
from .instruments import NO_REFERENCES
from .plan import Plan
from .state import IdentifierOutput, IdentifierState

_EARLY = 1e-6
"""A sample is due this fraction of its period early, because communication points k H have rounding errors."""

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
) -> tuple[Sampled, IdentifierOutput]:
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
    state, output = step(sampled.state, v_front, v_rear, pitch, elevation, travel, plan, references)
    return sampled._replace(state=state), output


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
        sampled, output = take_sample(sampled, time, now, plan, references)
    return sampled._replace(before=time, previous=now), output
