"""What changed: every change judged by the blocks since it may have begun, the likeliest first.

Blocks are taken along the direction of each change, divided by what the noise along it scatters more than it should.
"""

from math import inf

from .blocks import PROVED, Block, Colour, coloured, kappa
from .changes import ROTORS
from .detection import Direction, Finding, began, directions, lowered, measured, projected
from .events import ALARM, PASSED, Event
from .plan import FollowPlan, limits
from .state import FOLLOWING, CorrectorState

LEAD = 4.6
"""Lead in ln B, ln 100, at which the likeliest change is named without waiting."""

SWINGING, _LEAST_BLOCKS = 2, 5
"""Blocks after a change in which the innovations still swing, and blocks that are needed after them."""


def compass_of(state: CorrectorState, plan: FollowPlan) -> tuple[Direction, ...]:
    """Return the direction of every change from the values that will be in use."""
    end, at = state.values.end, plan.fields
    gains = end[at.index("k_x")], end[at.index("k_z")], end[at.index("k_y")]
    return directions(plan.changes, gains, plan.columns, plan.times_gain)


def proved_colours(state: CorrectorState, compass: tuple[Direction, ...]) -> tuple[Colour, ...]:
    """Return the colours with the block that has become old enough without an alarm."""
    at = len(state.tested) - 1 - PROVED
    if at < 2 or state.mode != FOLLOWING:
        return state.colours
    result = []
    for number in range(len(compass)):
        u, information = projected(state.tested[at], compass[number])
        u_1, _ = projected(state.tested[at - 1], compass[number])
        u_2, _ = projected(state.tested[at - 2], compass[number])
        result.append(coloured(state.colours[number], u, u_1, u_2, information))
    return tuple(result)


def shares_of(colours: tuple[Colour, ...]) -> list[float]:
    """Return 1/kappa of every change, for a test of each."""
    return [1.0 / kappa(colour) for colour in colours]


def limits_of(colours: tuple[Colour, ...], plan: FollowPlan) -> tuple[float, ...]:
    """Return the threshold of every change's tests."""
    result = []
    for number in range(len(colours)):
        c, nu = colours[number], plan.sizes[number]
        if c.blocks > 0.0:
            result.append(lowered(plan.threshold, nu * nu * c.information / (c.blocks * kappa(c))))
        else:
            result.append(plan.threshold)
    return tuple(result)


def _common_shares(colours: tuple[Colour, ...]) -> list[float]:
    """Return one over the mean kappa for every change: changes are compared with each other by the same measure."""
    total = 0.0
    for colour in colours:
        total += kappa(colour)
    return [len(colours) / total] * len(colours)


def seen_by(
    blocks: tuple[Block, ...], compass: tuple[Direction, ...], shares: list[float]
) -> tuple[tuple[tuple[float, float], ...], ...]:
    """Return for each block D^T b and D^T R D of every change, both times its share."""
    result = []
    for block in blocks:
        row = []
        for number in range(len(compass)):
            response, information = projected(block, compass[number])
            row.append((shares[number] * response, shares[number] * information))
        result.append(tuple(row))
    return tuple(result)


def value_of(number: int, values: tuple[float, ...], plan: FollowPlan) -> float:
    """Return the value that the change ``number`` changes; a rotor's share, of both the front one's."""
    place = plan.places[number]
    if place >= 0:
        return values[place]
    return values[-1] if plan.changes[number].name.endswith("rear") else values[-2]


def changed(number: int, size: float, values: tuple[float, ...], plan: FollowPlan) -> tuple[float, ...]:
    """Return ``values`` with the change ``number`` of ``size``."""
    place = plan.places[number]
    after = list(values)
    if place >= 0:
        after[place] += size
        return tuple(after)
    name = plan.changes[number].name
    if not name.endswith("rear"):
        after[-2] *= 1.0 + size
    if not name.endswith("front"):
        after[-1] *= 1.0 + size
    return tuple(after)


def bounds_of(number: int, state: CorrectorState, plan: FollowPlan) -> tuple[float, float]:
    """Return the smallest and largest size that is physically possible; sizes of rotors are shares of their thrust."""
    value = value_of(number, state.values.end, plan)
    least, most = limits(plan.changes[number], value)
    return (least / value, most / value) if plan.places[number] < 0 else (least, most)


def findings(
    state: CorrectorState, compass: tuple[Direction, ...], longest: int, plan: FollowPlan
) -> tuple[list[Finding], bool]:
    """Return every possible change with its size, the likeliest first, and whether it has been measured.

    It began at most ``longest`` blocks ago. Until enough blocks have passed since, the sizes are those since it began,
    and not to be used.
    """
    seen = seen_by(state.blocks, compass, _common_shares(state.colours))
    found: list[Finding] = []
    for number in range(len(plan.changes)):
        least, most = bounds_of(number, state, plan)
        found.append(began(seen, number, longest, plan.sizes[number], least, most))
    found.sort(key=_evidence, reverse=True)
    count = found[0].blocks - SWINGING
    if found[0].change < 0 or count < _LEAST_BLOCKS:
        return [one for one in found if one.change >= 0], False
    return ranked(state, compass, count, plan), True


def ranked(state: CorrectorState, compass: tuple[Direction, ...], count: int, plan: FollowPlan) -> list[Finding]:
    """Return every possible change with its size from the last ``count`` blocks, the likeliest first."""
    seen = seen_by(state.blocks[len(state.blocks) - count :], compass, _common_shares(state.colours))
    found: list[Finding] = []
    for number in range(len(plan.changes)):
        least, most = bounds_of(number, state, plan)
        found.append(measured(seen, number, count, plan.sizes[number], least, most))
    found.sort(key=_evidence, reverse=True)
    return [one for one in found if one.change >= 0]


def _evidence(finding: Finding) -> float:
    return finding.evidence if finding.change >= 0 else -inf


def event_of(state: CorrectorState, what: int, why: int, finding: Finding, time: float, plan: FollowPlan) -> Event:
    """Return the event that tells of a finding; ``what`` happened at ``time`` [s] and ``why``."""
    if finding.change < 0:
        return Event(time, what, -1, 0.0, 0.0, why, -1, time)
    value = value_of(finding.change, changed(finding.change, finding.size, state.values.end, plan), plan)
    error = finding.standard_error
    if plan.places[finding.change] < 0:
        error *= value_of(finding.change, state.values.end, plan)
    since = (
        time
        - (finding.blocks + (SWINGING if what != ALARM or why != PASSED else 0))
        * plan.block
        * plan.coarse
        * plan.settings.sample_time
    )
    return Event(time, what, finding.change, value, error, why, plan.changes[finding.change].axis, since, finding.other)


def axes_of(number: int, plan: FollowPlan) -> tuple[int, ...]:
    """Return the axes on which a change acts."""
    axis = plan.changes[number].axis
    return (0, 1, 2) if axis == ROTORS else (axis,)
