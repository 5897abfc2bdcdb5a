"""What changed: every change judged by the blocks since it may have begun, the likeliest first.

psi is what a change makes of the innovations that has always acted; right after a change they still swing. Size and
name are therefore taken from the blocks that begin two after the change, the same ones for every change, along the
direction of each and divided by the variance inflation factor along it; changes are compared under one mean factor.
"""

from math import sqrt

from heli_plant.effects import AXES

from ..online.linear_algebra import total
from .cusum import NOTHING, Finding, judge_size
from .evidence import project_block
from .plan import FollowPlan
from .state import REASONS, CorrectorState, Event

LEAD = 4.6  # lead in ln B, ln 100, at which the likeliest change is named without waiting
SWINGING = 2  # blocks after a change in which the innovations still swing
_LEAST_BLOCKS = 5  # blocks that are needed after them


def sums_back(state: CorrectorState, number: int, count: int, plan: FollowPlan) -> list[tuple[float, float]]:
    """Return D^T b and D^T R D of the last block, of the last two, and so on, of ``count`` at most."""
    direction, found = plan.changes[number].direction(state.twin.values), [(0.0, 0.0)]
    for block in reversed(state.blocks[-count:]):
        response, information = project_block(block, direction)
        found.append((found[-1][0] + response, found[-1][1] + information))
    return found[1:]


def explain(
    state: CorrectorState, number: int, count: int, plan: FollowPlan, whole: bool = True, share: float = 0.0
) -> Finding:
    """Return the change ``number`` as the last ``count`` blocks have it, or nothing.

    All of these blocks count, or if not ``whole`` those from the one on which makes it likeliest. Their sums count with
    a ``share``, by default one over the change's own variance inflation factor.
    """
    change, share = plan.changes[number], share or 1.0 / state.inflations[number].factor
    bounds = change.bounds(state.twin.values)
    sums = list(enumerate(sums_back(state, number, count, plan), 1))
    chosen = sums[-1:] if whole else sums
    found = [judge_size(number, n, share * b, share * r, change.size, bounds) for n, (b, r) in chosen]
    return max([one for one in found if one.change >= 0], key=lambda one: one.evidence, default=NOTHING)


def rank_changes(state: CorrectorState, count: int, plan: FollowPlan, whole: bool = True) -> list[Finding]:
    """Return every possible change from the last ``count`` blocks, the likeliest first; ``whole`` as above."""
    share = len(plan.changes) / total([inflation.factor for inflation in state.inflations])
    found = [explain(state, number, count, plan, whole, share) for number in range(len(plan.changes))]
    return sorted([one for one in found if one.change >= 0], key=lambda one: one.evidence, reverse=True)


def find_changes(state: CorrectorState, longest: int, plan: FollowPlan) -> tuple[list[Finding], bool]:
    """Return every possible change with its size, the likeliest first, and whether it has been measured.

    It began at most ``longest`` blocks ago. Until enough blocks have passed since, the sizes are those since it began,
    and not to be used.
    """
    found = rank_changes(state, longest, plan, whole=False)
    count = found[0].blocks - SWINGING if found else 0
    return (found, False) if count < _LEAST_BLOCKS else (rank_changes(state, count, plan), True)


def find_likelier(state: CorrectorState, finding: Finding, plan: FollowPlan) -> Finding:
    """Return the change that explains the blocks of ``finding`` better than it does by :data:`LEAD`, or nothing."""
    found = rank_changes(state, finding.blocks, plan)
    own = [one.evidence for one in found if one.change == finding.change]
    if found and found[0].change != finding.change and found[0].evidence > LEAD + (own[0] if own else 0.0):
        return found[0]
    return NOTHING


def refine_size(state: CorrectorState, finding: Finding, plan: FollowPlan) -> Finding:
    """Return the change on trial with its size from all blocks since it took place."""
    count = min(finding.blocks + state.blocks_in_mode(plan), len(state.blocks))
    response, information = sums_back(state, finding.change, count, plan)[-1]
    if information <= 0.0:
        return finding
    least, most = plan.changes[finding.change].bounds(state.twin.values)
    size = min(max(response / information, least), most)
    error = sqrt(state.inflations[finding.change].factor / information)
    return finding._replace(blocks=count, size=size, standard_error=error)


def make_event(state: CorrectorState, why: str, plan: FollowPlan, finding: Finding = NOTHING) -> Event:
    """Return the event of this sample that tells of a ``finding``, or of none; ``why`` is a key of the reasons."""
    time, (what, reason) = state.samples * plan.settings.sample_time, REASONS[why]
    if finding.change < 0:
        return Event(time, what, since=time, why=reason)
    change, values = plan.changes[finding.change], state.twin.values
    blocks = finding.blocks + (0 if why == "suspected" else SWINGING)
    return Event(
        time,
        what,
        name=change.name,
        other=plan.changes[finding.other].name if finding.other >= 0 else "",
        axis=AXES[change.axes[0]] if change.field else "rotors",
        value=change.value(change.applied(finding.size, values)),
        standard_error=finding.standard_error * (1.0 if change.field else change.value(values)),
        since=time - blocks * plan.block * plan.settings.sample_time,
        why=reason,
    )
