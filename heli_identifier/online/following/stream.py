"""How the samples come in: a stream that stopped, an encoder that stands still although the rig moves."""

from typing import NamedTuple

from heli_plant.observer import Torque
from heli_plant.state import PlantState

from .errors import Row
from .plan import FollowPlan

_LONG_STUCK, _HELD = 0.5, 0.06
"""An encoder that stands still for this long [s] is at fault as well if meanwhile the acceleration with which the
observer holds the axis has grown by this much [rad/s^2]: more than dry friction of a usual bearing."""

_MOVING = 0.03
"""Rate [rad/s] at which an encoder that stands still is at fault: it would have moved by five counts of 4096."""


class Stream(NamedTuple):
    """How the samples come in.

    ``unseen`` instants without one; of each axis the last ``angles`` [rad], for how many samples (``still``) they have
    not moved, and the rate [rad/s] and unmodelled acceleration [rad/s^2] that the observer saw when they stopped;
    whether it is ``broken``.
    """

    unseen: int
    angles: Row
    still: tuple[int, int, int]
    rates: Row
    torques: Row
    broken: bool


def first_stream(angles: Row) -> Stream:
    """Return how samples come in at sample 0 with its ``angles`` [rad]."""
    nothing = (0.0, 0.0, 0.0)
    return Stream(0, angles, (0, 0, 0), nothing, nothing, False)


def watched(stream: Stream, angles: Row, fresh: bool, state: PlantState, torque: Torque, plan: FollowPlan) -> Stream:
    """Return how the samples come in, after one more instant.

    Parameters
    ----------
    stream : Stream
    angles : tuple
        Of the rig [rad].
    fresh : bool
        Whether they are of this instant.
    state : PlantState
        As the observer predicts it.
    torque : Torque
        Unmodelled accelerations [rad/s^2].
    plan : FollowPlan
    """
    if not fresh:
        unseen = stream.unseen + 1
        return stream._replace(unseen=unseen, broken=stream.broken or unseen >= plan.stop)
    rates = (state.pitch_rate, state.elevation_rate, state.travel_rate)
    still = [0, 0, 0]
    began, torques = list(stream.rates), list(stream.torques)
    frozen = False
    for axis in range(3):
        if angles[axis] == stream.angles[axis]:
            still[axis] = stream.still[axis] + 1
            if still[axis] == 1:
                began[axis], torques[axis] = rates[axis], torque[axis]
            moving = still[axis] >= plan.stuck and abs(began[axis]) > _MOVING
            held = still[axis] * plan.settings.sample_time >= _LONG_STUCK and abs(torque[axis] - torques[axis]) > _HELD
            frozen = frozen or moving or held
    return Stream(
        0,
        angles,
        (still[0], still[1], still[2]),
        (began[0], began[1], began[2]),
        (torques[0], torques[1], torques[2]),
        frozen,
    )
