"""Encoders that stand still although the rig moves.

An encoder stands at one count wherever an axis turns back or rests. It is at fault if at the rate that the axis had
when it stopped the rig would have gone further than five counts and the noise since. This is seen only after a while,
and one that stood while the rig moved by less cannot be told from one that rested. What an encoder says therefore does
not count while it stands for half a second or more, and afterwards until the observer has settled, which took that
angle for the rig's. An alarm waits while an encoder stands from which the rig should have gone by more than the noise.
"""

from typing import NamedTuple

from .plan import FollowPlan

_PATH, _PATH_NOISE = 7.5e-3, 8.0
"""Path [rad], and path in standard deviations of the innovations, at which an encoder that stands still is at fault:
five counts of 4096, and more of a coarser one. The larger of the two counts."""

_DOUBTFUL = 2.0  # path in standard deviations of the innovations at which an encoder that stands still may be at fault


class Encoder(NamedTuple):
    """One encoder.

    Its last ``angle`` [rad]; for how many samples it has been ``still``, and the ``rate`` [rad/s] that the observer saw
    when it stopped; for how many samples the observer has not ``settled`` since it moved again after half a second.
    """

    angle: float
    still: int = 0
    rate: float = 0.0
    unsettled: int = 0

    def read(self, angle: float, rate: float, plan: FollowPlan) -> "Encoder":
        """Return the encoder after a sample of its ``angle`` [rad], the observer at a ``rate`` [rad/s]."""
        unsettled = max(0, self.unsettled - 1)
        if angle == self.angle:
            return Encoder(angle, self.still + 1, self.rate if self.still else rate, unsettled)
        return Encoder(angle, unsettled=plan.settling if self.still >= plan.stuck else unsettled)

    def is_discounted(self, plan: FollowPlan) -> bool:
        """Return whether what it says does not count: it stands, or has stood until shortly before."""
        return self.still >= plan.stuck or self.unsettled > 0

    def path(self, plan: FollowPlan) -> float:
        """Return how far the rig has gone since it stopped, at the rate that it had [rad]."""
        return abs(self.rate) * self.still * plan.settings.sample_time

    def is_at_fault(self, deviation: float, plan: FollowPlan) -> bool:
        """Return whether it stands although the rig has moved on; ``deviation`` of the innovations [rad]."""
        return self.path(plan) > max(_PATH, _PATH_NOISE * deviation)

    def is_doubtful(self, deviation: float, plan: FollowPlan) -> bool:
        """Return whether it stands and should have moved; ``deviation`` of the innovations [rad]."""
        return self.path(plan) > _DOUBTFUL * deviation
