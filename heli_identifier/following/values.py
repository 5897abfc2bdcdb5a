"""The values in use, and the ramp by which an adopted change comes in."""

from typing import NamedTuple

from heli_plant.parameters import PlantParameters

from .plan import FollowPlan, parameters_of

RAMP = 2.0
"""Time in which an adopted change is ramped in [s]."""


class Values(NamedTuple):
    """Values in use, and where a ramp leads them.

    ``now``, ``begin`` and ``end`` of the ramp, the sample at which it began; ``rival``: values of the rival, empty
    without one; standard errors of what was adopted; the plant's parameters for ``now`` and for the rival.
    """

    now: tuple[float, ...]
    begin: tuple[float, ...]
    end: tuple[float, ...]
    ramp: int
    rival: tuple[float, ...]
    errors: tuple[float, ...]
    parameters: PlantParameters
    rival_parameters: PlantParameters


def start_values(plan: FollowPlan) -> Values:
    """Return the values of sample 0."""
    values = plan.first_values
    p = parameters_of(values, plan)
    return Values(values, values, values, 0, (), (0.0,) * len(values), p, p)


def ramped(values: Values, k: int, plan: FollowPlan) -> Values:
    """Return the values of sample ``k``: on the ramp from ``begin`` to ``end``, then there."""
    if values.now == values.end:
        return values
    share = min(1.0, (k - values.ramp) * plan.settings.sample_time / RAMP)
    now = tuple([a + share * (b - a) for a, b in zip(values.begin, values.end, strict=True)])
    if share >= 1.0:
        now = values.end
    return values._replace(now=now, parameters=parameters_of(now, plan))


def heading(values: Values, end: tuple[float, ...], k: int) -> Values:
    """Return the values on a ramp to ``end`` that begins at sample ``k``, without a rival."""
    return values._replace(begin=values.now, end=end, ramp=k, rival=())
