"""How much a sample counts: the observer's gains, and by how much its innovations scatter, after a gap and without."""

from math import sin, sqrt
from typing import NamedTuple

from heli_plant.observer import ObserverGains

from .plan import FollowPlan
from .roughness import Roughness
from .uncertainty import Uncertainty, corrected, gains_of, grown
from .values import Values

Uncertainties = tuple[Uncertainty, ...]
"""P of pitch, elevation and travel after the last correction; empty in the steady state."""


class Trust(NamedTuple):
    """For one sample: the gains; the innovations' standard deviations in those of the steady state [1]; P after it."""

    gains: tuple[ObserverGains, ObserverGains, ObserverGains]
    deviations: tuple[float, float, float]
    uncertainties: Uncertainties


def full_trust(plan: FollowPlan) -> Trust:
    """Return how much a sample counts in a stream without gaps."""
    return Trust(plan.gains, (1.0, 1.0, 1.0), ())


def trusted(
    known: Uncertainties,
    unseen: int,
    pitch: float,
    roughness: Roughness,
    noise: tuple[float, float, float],
    values: Values,
    plan: FollowPlan,
) -> Trust:
    """Return how much a sample counts that came in after ``unseen`` instants without one.

    Parameters
    ----------
    known : Uncertainties
        After the last sample that came in.
    unseen : int
    pitch : float
        [rad].
    roughness : Roughness
    noise : tuple
        Standard deviations of the innovations of the axes in the steady state [rad].
    values : Values
    plan : FollowPlan
    """
    if not known and unseen == 0:
        return full_trust(plan)
    h, p = plan.settings.sample_time, values.parameters
    of_travel = p.k_y * sin(pitch)
    kicks = (
        (p.k_x * h) ** 2 * roughness.difference,
        (p.k_z * h) ** 2 * roughness.total,
        (of_travel * h) ** 2 * roughness.total,
    )
    gains: list[ObserverGains] = []
    deviations: list[float] = []
    after: list[Uncertainty] = []
    for axis in range(3):
        steady, kept = plan.steady[axis], plan.gains[axis].kept
        u = grown(known[axis] if known else steady.uncertainty, h, kept, 0.0, steady.drive)
        of_rate = kicks[axis] * steady.variance / (noise[axis] * noise[axis])
        for _ in range(unseen):
            u = grown(u, h, kept, of_rate, steady.drive)
        gains.append(gains_of(u, kept))
        deviations.append(sqrt((u.angle + 1.0) / steady.variance))
        after.append(corrected(u))
    return Trust(
        (gains[0], gains[1], gains[2]), (deviations[0], deviations[1], deviations[2]), (after[0], after[1], after[2])
    )
