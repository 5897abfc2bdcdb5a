"""Encoders that stand still although the rig moves.

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

from .changes import Vector
from .observer import Angles, Instant
from .plan import FollowPlan

_PATH, _PATH_NOISE = 7.5e-3, 8.0
"""Path [rad], and path in standard deviations of the innovations, at which an encoder that stands still is at fault:
five counts of 4096, and more of a coarser one. The larger of the two counts."""

_DOUBTFUL = 2.0  # path in standard deviations of the innovations at which an encoder that stands still may be at fault
_JUMP = 4.0  # innovation in standard deviations by which an encoder that stood still jumps
_HELD = 0.06  # change of the acceleration that holds an axis [rad/s^2]: more than dry friction of a usual bearing


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

    def is_discounted(self, plan: FollowPlan) -> bool:
        """Return whether what it says does not count: it stands, or has stood until shortly before."""
        return self.still >= plan.stuck or self.unsettled > 0

    def is_doubtful(self, deviation: float, plan: FollowPlan) -> bool:
        """Return whether it stands still and should have moved; ``deviation`` of the innovations [rad]."""
        path = abs(self.rate) * self.still * plan.settings.sample_time
        return max(path, abs(self.way)) > _DOUBTFUL * deviation

    def stand(self, rate: float, torque: float, deviation: float, plan: FollowPlan) -> "Encoder":
        """Return the encoder after it has stood for one more sample, at the observer's ``rate`` and ``torque``."""
        one, h, still = self, plan.settings.sample_time, self.still + 1
        if self.still == 0:
            one = self._replace(rate=rate, torque=torque)
        passed = abs(one.rate) * still * h > max(_PATH, _PATH_NOISE * deviation)
        held = still >= plan.stuck and abs(torque - one.torque) > _HELD
        stuck = one.stuck or passed or held  # until it moves: meanwhile nothing holds the observer
        return one._replace(still=still, way=one.way + rate * h, stuck=stuck, unsettled=max(0, one.unsettled - 1))


def read_encoders(
    encoders: tuple[Encoder, ...], angles: Angles, seen: Instant, noise: Vector, plan: FollowPlan
) -> tuple[tuple[Encoder, ...], bool]:
    """Return the encoders after a sample of the ``angles`` [rad], and whether one is at fault.

    ``seen``: what the observer makes of the sample, ``noise``: the standard deviations of the innovations [rad].
    """
    state, faulty, read = seen.memory.state, False, []
    rates = state.pitch_rate, state.elevation_rate, state.travel_rate
    rows = zip(encoders, angles, measured_angles(state), rates, seen.torque, noise, strict=True)
    for one, angle, expected, rate, torque, deviation in rows:
        if angle == one.angle:
            read.append(one.stand(rate, torque, deviation, plan))
        else:
            stood = one.still >= plan.stuck
            faulty = faulty or (stood and abs(angle - expected) > _JUMP * deviation)
            read.append(Encoder(angle, unsettled=plan.settling if stood else max(0, one.unsettled - 1)))
    return tuple(read), faulty or any(one.stuck for one in read)
