"""Samples that did not come in: until the next one comes their voltages are unknown, and then they nearly are.

While nothing comes in, the twin goes on under the last voltages. That is not what acted on the rig. A controller
answers the motion, so that the difference goes along with the rate, as a friction or a damping does: a twentieth of
the samples lost gives a bias, not noise. With the next sample the voltages at both ends of the gap are known. The
twin goes back to the gap's begin and through it once more, under voltages on a straight line between the two,

    V_j = V_0 + (V_n - V_0) j/n,     j = 0 .. n - 1  of  n  sampling intervals

which err by the curvature of V instead of its slope. After a stop (:mod:`.suspension`) the twin begins anew instead.
"""

from typing import NamedTuple

from .instant import Instant, Voltages, later
from .plan import FollowPlan
from .values import Values


class Gap(NamedTuple):
    """Since the last sample that came in.

    ``begin``: the twin then, and the ``voltages`` of that sample [V]; ``unseen``: instants without a sample since;
    ``arrived``: the sum of the voltages that the twin has taken for those that arrived at its motors since [V].
    """

    begin: Instant
    voltages: Voltages
    unseen: int
    arrived: Voltages


def no_gap(begin: Instant, voltages: Voltages) -> Gap:
    """Return the gap after a sample that came in: nothing is missing yet."""
    return Gap(begin, voltages, 0, (0.0, 0.0))


def widened(gap: Gap, arrived: Voltages) -> Gap:
    """Return the gap with one more instant without a sample, reached under the voltages ``arrived`` [V]."""
    return gap._replace(unseen=gap.unseen + 1, arrived=(gap.arrived[0] + arrived[0], gap.arrived[1] + arrived[1]))


def crossed(gap: Gap, voltages: Voltages, k: int, values: Values, plan: FollowPlan) -> tuple[Instant, Voltages]:
    """Return the twin at sample ``k``, the first that came in after ``gap``, before its correction.

    Parameters
    ----------
    gap : Gap
    voltages : tuple
        Of sample ``k`` [V].
    k : int
    values : Values
    plan : FollowPlan

    Returns
    -------
    instant : Instant
    arrived : tuple
        Sum of the voltages that arrived since the gap's begin, less those that the twin has taken for them before [V].
    """
    n = gap.unseen + 1
    instant, front, rear = gap.begin, -gap.arrived[0], -gap.arrived[1]
    for j in range(n):
        share = j / n
        held = (
            gap.voltages[0] + share * (voltages[0] - gap.voltages[0]),
            gap.voltages[1] + share * (voltages[1] - gap.voltages[1]),
        )
        instant, arrived = later(instant, held, (k - n + j) * plan.settings.sample_time, values, plan)
        front, rear = front + arrived[0], rear + arrived[1]
    return instant, (front, rear)
