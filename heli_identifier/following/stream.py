"""How the samples come in: a stream that stopped, an encoder that stands still although the rig moves.

An encoder that stands at one count is usual where an axis turns back or rests. It is at fault

* if at the rate that the axis had the rig would have gone much further than a count and the noise meanwhile,
* if after half a second the observer holds the axis by an acceleration that no bearing has,
* if after half a second it jumps by more than the noise: it stood while the rig moved slowly.

All three are seen only after a while, and an encoder that stood while the rig moved by a few counts cannot be told from
one that rested. What an encoder says therefore does not count while it stands for half a second or more. It does not
count afterwards either, until the observer has settled, because the observer took that angle for the rig's. An alarm
waits while an encoder stands that should have moved already, if only a little: at the rate that the axis had, or by the
rates that the observer has seen since, which a rig that set off from rest has.
"""

from typing import NamedTuple

from heli_plant.observer import Torque
from heli_plant.plant import measured_angles
from heli_plant.state import PlantState

from .errors import Row
from .plan import FollowPlan

_PATH, _PATH_NOISE = 7.5e-3, 8.0
"""Path [rad], and path in standard deviations of the innovations, at which an encoder that stands still is at fault:
five counts of 4096, and more of a coarser one. The larger of the two counts."""

_DOUBTFUL = 2.0
"""Path in standard deviations of the innovations at which an encoder that stands still may be at fault."""

_JUMP = 4.0
"""Innovation in standard deviations by which an encoder that stood still jumps."""

_HELD = 0.06
"""Change of the acceleration with which the observer holds an axis [rad/s^2]: more than dry friction of a usual
bearing."""


class Stream(NamedTuple):
    """How the samples come in.

    ``unseen`` instants without one; of each axis the last ``angles`` [rad], for how many samples (``still``) they have
    not moved, the rate [rad/s] and unmodelled acceleration [rad/s^2] that the observer saw when they stopped, the way
    that its rates since add up to [rad], and whether they are ``stuck``; for how many samples the observer has not
    ``settled`` since one that stood for half a second moved again; whether the stream is ``broken``.
    """

    unseen: int
    angles: Row
    still: tuple[int, int, int]
    rates: Row
    torques: Row
    ways: Row
    stuck: tuple[bool, bool, bool]
    unsettled: tuple[int, int, int]
    broken: bool


def first_stream(angles: Row) -> Stream:
    """Return how samples come in at sample 0 with its ``angles`` [rad]."""
    nothing = (0.0, 0.0, 0.0)
    return Stream(0, angles, (0, 0, 0), nothing, nothing, nothing, (False, False, False), (0, 0, 0), False)


def discounted(stream: Stream, axis: int, plan: FollowPlan) -> bool:
    """Return whether what the encoder of an axis says does not count: it stands, or has stood until shortly before."""
    return stream.still[axis] >= plan.stuck or stream.unsettled[axis] > 0


def withdraws(stream: Stream, samples: int, plan: FollowPlan) -> bool:
    """Return whether an encoder has just stood for half a second, and in the block before that of ``samples`` too."""
    within = samples % (plan.block * plan.coarse)
    return within < plan.stuck and plan.stuck in stream.still


def doubtful(stream: Stream, noise: Row, plan: FollowPlan) -> bool:
    """Return whether an encoder stands still that should have moved; ``noise`` of the innovations [rad]."""
    return any(
        max(_path(stream.rates[axis], stream.still[axis], plan), abs(stream.ways[axis])) > _DOUBTFUL * noise[axis]
        for axis in range(3)
    )


def _path(rate: float, still: int, plan: FollowPlan) -> float:
    """Return the path [rad] at a ``rate`` [rad/s] in ``still`` samples."""
    return abs(rate) * still * plan.settings.sample_time


def watched(
    stream: Stream, angles: Row, fresh: bool, state: PlantState, torque: Torque, noise: Row, plan: FollowPlan
) -> Stream:
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
    noise : tuple
        Standard deviations of the innovations [rad].
    plan : FollowPlan
    """
    if not fresh:
        unseen = stream.unseen + 1
        return stream._replace(unseen=unseen, broken=stream.broken or unseen >= plan.stop)
    seen, rates = measured_angles(state), (state.pitch_rate, state.elevation_rate, state.travel_rate)
    still, unsettled, stuck, jumped = [0, 0, 0], [0, 0, 0], [False, False, False], False
    began, torques, ways = list(stream.rates), list(stream.torques), [0.0, 0.0, 0.0]
    for axis in range(3):
        unsettled[axis] = max(0, stream.unsettled[axis] - 1)
        if angles[axis] != stream.angles[axis]:
            if stream.still[axis] >= plan.stuck:
                unsettled[axis] = plan.settling
                jumped = jumped or abs(angles[axis] - seen[axis]) > _JUMP * noise[axis]
            continue
        still[axis] = stream.still[axis] + 1
        ways[axis] = stream.ways[axis] + rates[axis] * plan.settings.sample_time
        if still[axis] == 1:
            began[axis], torques[axis] = rates[axis], torque[axis]
        passed = _path(began[axis], still[axis], plan) > max(_PATH, _PATH_NOISE * noise[axis])
        held = still[axis] >= plan.stuck and abs(torque[axis] - torques[axis]) > _HELD
        stuck[axis] = stream.stuck[axis] or passed or held  # until it moves: meanwhile nothing holds the observer
    return Stream(
        0,
        angles,
        (still[0], still[1], still[2]),
        (began[0], began[1], began[2]),
        (torques[0], torques[1], torques[2]),
        (ways[0], ways[1], ways[2]),
        (stuck[0], stuck[1], stuck[2]),
        (unsettled[0], unsettled[1], unsettled[2]),
        jumped or True in stuck,
    )
