"""How the samples come in: a stream that stopped, an encoder that stands still although the rig moves.

An encoder is at fault if at the rate that the axis had the rig would have gone much further than a count and the noise
meanwhile, or if after half a second the observer holds the axis by an acceleration that no bearing has, or the encoder
jumps by more than the noise. All three are seen only after a while, and an encoder that stood while the rig moved by a
few counts cannot be told from one that rested. What an encoder says therefore does not count while it stands for half a
second or more, and afterwards until the observer has settled, which took that angle for the rig's. An alarm waits while
an encoder stands that should have moved already, if only a little: at the rate that the axis had, or by the rates that
the observer has seen since, which a rig that set off from rest has.
"""

from typing import NamedTuple

from heli_plant.plant import measured_angles

from .blocks import Vector
from .observer import Angles, Instant
from .plan import FollowPlan

_PATH, _PATH_NOISE = 7.5e-3, 8.0
"""Path [rad], and path in standard deviations of the innovations, at which an encoder that stands still is at fault:
five counts of 4096, and more of a coarser one. The larger of the two counts."""

_DOUBTFUL = 2.0  # path in standard deviations of the innovations at which an encoder that stands still may be at fault
_JUMP = 4.0  # innovation in standard deviations by which an encoder that stood still jumps

_HELD = 0.06
"""Change of the acceleration with which the observer holds an axis [rad/s^2]: more than dry friction of a usual
bearing."""


class Encoder(NamedTuple):
    """One encoder.

    Its last ``angle`` [rad]; for how many samples it has been ``still``; the ``rate`` [rad/s] and unmodelled
    acceleration ``torque`` [rad/s^2] that the observer saw when it stopped; the ``way`` that the observer's rates since
    add up to [rad]; whether it is ``stuck``; for how many samples the observer has not ``settled`` since it moved again
    after half a second.
    """

    angle: float
    still: int = 0
    rate: float = 0.0
    torque: float = 0.0
    way: float = 0.0
    stuck: bool = False
    unsettled: int = 0


class Stream(NamedTuple):
    """Instants without a sample since the last one; the encoders of the axes; whether the stream is ``broken``."""

    encoders: tuple[Encoder, ...]
    unseen: int = 0
    broken: bool = False


def is_discounted(encoder: Encoder, plan: FollowPlan) -> bool:
    """Return whether what an encoder says does not count: it stands, or has stood until shortly before."""
    return encoder.still >= plan.stuck or encoder.unsettled > 0


def is_doubtful(stream: Stream, noise: Vector, plan: FollowPlan) -> bool:
    """Return whether an encoder stands still that should have moved; ``noise`` of the innovations [rad]."""
    h = plan.settings.sample_time
    return any(
        max(abs(one.rate) * one.still * h, abs(one.way)) > _DOUBTFUL * deviation
        for one, deviation in zip(stream.encoders, noise, strict=True)
    )


def update_stream(
    stream: Stream, angles: Angles, fresh: bool, seen: Instant, noise: Vector, plan: FollowPlan
) -> Stream:
    """Return how the samples come in, after one more instant.

    The ``angles`` of the rig [rad] are of this instant if they are ``fresh``; ``seen``: what the observer makes of it,
    ``noise``: the standard deviations of the innovations [rad].
    """
    if not fresh:
        unseen = stream.unseen + 1
        return stream._replace(unseen=unseen, broken=stream.broken or unseen >= plan.stop)
    state, jumped, encoders = seen.memory.state, False, []
    rates = state.pitch_rate, state.elevation_rate, state.travel_rate
    rows = zip(stream.encoders, angles, measured_angles(state), rates, seen.torque, noise, strict=True)
    for one, angle, expected, rate, torque, deviation in rows:
        stood = one.still >= plan.stuck
        jumped = jumped or (angle != one.angle and stood and abs(angle - expected) > _JUMP * deviation)
        if angle != one.angle:
            encoders.append(Encoder(angle, unsettled=plan.settling if stood else max(0, one.unsettled - 1)))
        else:
            encoders.append(_stand(one, rate, torque, deviation, plan))
    return Stream(tuple(encoders), 0, jumped or any(one.stuck for one in encoders))


def _stand(one: Encoder, rate: float, torque: float, deviation: float, plan: FollowPlan) -> Encoder:
    """Return an encoder that stands for one more sample."""
    if one.still == 0:
        one = one._replace(rate=rate, torque=torque)
    h, still = plan.settings.sample_time, one.still + 1
    passed = abs(one.rate) * still * h > max(_PATH, _PATH_NOISE * deviation)
    held = still >= plan.stuck and abs(torque - one.torque) > _HELD
    stuck = one.stuck or passed or held  # until it moves: meanwhile nothing holds the observer
    return one._replace(still=still, way=one.way + rate * h, stuck=stuck, unsettled=max(0, one.unsettled - 1))
