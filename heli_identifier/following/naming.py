"""What changed: every change judged by the blocks since it may have begun, the likeliest first.

Blocks are taken along the direction of each change, divided by the variance inflation factor along it.

The on-line identifier must not contradict a change. It estimates gains, offset and dampings by another method, without
the twin, with a memory of 50 s. Its estimate lags, so that it cannot confirm a change of a few seconds ago. It can
contradict one: since the change it has moved the other way, by more than _SURELY standard errors of the difference,

    (theta - theta_0) sign(change) < -_SURELY sqrt(2) sigma,

theta_0 the estimate two blocks before the change and sigma the present standard error. The identifier errs as well,
where the rig has what its model lacks; only the difference in time counts, in which most of that cancels.
"""

from math import sqrt

from .blocks import PROVED, Block, Inflation, learn_inflation, project_block
from .changes import ROTORS, Direction
from .cusum import (
    NOTHING,
    Finding,
    Projections,
    estimate_begin,
    estimate_size,
    siegmund_threshold,
)
from .plan import FollowPlan
from .state import ALARM, FOLLOWING, HEARD, CorrectorState, Event, IdentifierReport, make_event

LEAD = 4.6
"""Lead in ln B, ln 100, at which the likeliest change is named without waiting."""

SWINGING = 2
"""Blocks after a change in which the innovations still swing."""

_LEAST_BLOCKS = 5
"""Blocks that are needed after them."""

_SURELY = 3.0

_GAINS = 3
"""Places in :data:`.state.HEARD` that a rotor changes, the first ones."""


def learn_inflations(state: CorrectorState, directions: tuple[Direction, ...]) -> tuple[Inflation, ...]:
    """Return the inflations with the block that has become old enough without an alarm."""
    at = len(state.tested) - 1 - PROVED
    if at < 2 or state.mode != FOLLOWING:
        return state.inflations
    result = []
    for inflation, direction in zip(state.inflations, directions, strict=True):
        u, information = project_block(state.tested[at], direction)
        u_1, _ = project_block(state.tested[at - 1], direction)
        u_2, _ = project_block(state.tested[at - 2], direction)
        result.append(learn_inflation(inflation, u, u_1, u_2, information))
    return tuple(result)


def find_thresholds(inflations: tuple[Inflation, ...], plan: FollowPlan) -> tuple[float, ...]:
    """Return the threshold of every change's CUSUM."""
    return tuple(
        [
            siegmund_threshold(plan.threshold, change.size * change.size * c.information / (c.blocks * c.factor))
            if c.blocks > 0.0
            else plan.threshold
            for c, change in zip(inflations, plan.changes, strict=True)
        ]
    )


def project_blocks(
    blocks: tuple[Block, ...], directions: tuple[Direction, ...], inflations: tuple[Inflation, ...], common: bool
) -> Projections:
    """Return D^T b and D^T R D of every block and change, over the inflation factor.

    ``common``: over the mean factor, by which changes are compared with each other.
    """
    factors = [inflation.factor for inflation in inflations]
    shares = [1.0 / factor for factor in factors]
    if common:
        total = 0.0
        for factor in factors:
            total += factor
        shares = [len(factors) / total] * len(factors)
    result = []
    for block in blocks:
        row = []
        for share, direction in zip(shares, directions, strict=True):
            response, information = project_block(block, direction)
            row.append((share * response, share * information))
        result.append(tuple(row))
    return tuple(result)


def find_changes(
    state: CorrectorState, directions: tuple[Direction, ...], longest: int, plan: FollowPlan
) -> tuple[list[Finding], bool]:
    """Return every possible change with its size, the likeliest first, and whether it has been measured.

    It began at most ``longest`` blocks ago. Until enough blocks have passed since, the sizes are those since it began,
    and not to be used.
    """
    seen = project_blocks(state.blocks, directions, state.inflations, common=True)
    found = _sorted(
        [
            estimate_begin(seen, number, longest, change.size, *plan.bounds(number, state.values.end))
            for number, change in enumerate(plan.changes)
        ]
    )
    count = found[0].blocks - SWINGING if found else 0
    if count < _LEAST_BLOCKS:
        return found, False
    return rank_changes(state, directions, count, plan), True


def rank_changes(
    state: CorrectorState, directions: tuple[Direction, ...], count: int, plan: FollowPlan
) -> list[Finding]:
    """Return every possible change with its size from the last ``count`` blocks, the likeliest first."""
    last = state.blocks[len(state.blocks) - count :]
    seen = project_blocks(last, directions, state.inflations, common=True)
    return _sorted(
        [
            estimate_size(seen, number, change.size, *plan.bounds(number, state.values.end))
            for number, change in enumerate(plan.changes)
        ]
    )


def _sorted(findings: list[Finding]) -> list[Finding]:
    return sorted([one for one in findings if one.change >= 0], key=lambda one: one.evidence, reverse=True)


def find_likelier(
    state: CorrectorState, directions: tuple[Direction, ...], finding: Finding, plan: FollowPlan
) -> Finding:
    """Return the change that explains the blocks of ``finding`` better than it does by :data:`LEAD`, or nothing."""
    found = rank_changes(state, directions, finding.blocks, plan)
    own = [one.evidence for one in found if one.change == finding.change]
    if found and found[0].change != finding.change and found[0].evidence > LEAD + (own[0] if own else 0.0):
        return found[0]
    return NOTHING


def refine_size(
    state: CorrectorState, directions: tuple[Direction, ...], finding: Finding, plan: FollowPlan
) -> Finding:
    """Return the change on trial with its size from all blocks since it took place."""
    elapsed = (state.samples - state.since) // (plan.block * plan.coarse)
    count = min(finding.blocks + elapsed, len(state.blocks))
    response = information = 0.0
    for block in state.blocks[len(state.blocks) - count :]:
        b, r = project_block(block, directions[finding.change])
        response += b
        information += r
    if information <= 0.0:
        return finding
    least, most = plan.bounds(finding.change, state.values.end)
    size = min(max(response / information, least), most)
    error = sqrt(state.inflations[finding.change].factor / information)
    return finding._replace(blocks=count, size=size, standard_error=error, z=size / error)


def is_contradicted(state: CorrectorState, finding: Finding, report: IdentifierReport, plan: FollowPlan) -> bool:
    """Return whether the identifier has moved against a change since it took place."""
    if not state.heard or not report.estimates:
        return False
    change = plan.changes[finding.change]
    before = state.heard[max(0, len(state.heard) - 1 - finding.blocks - SWINGING)]
    for slot, name in enumerate(HEARD):
        moves = change.field == name
        size = finding.size
        if change.axis == ROTORS and slot < _GAINS:
            moves, size = True, finding.size * plan.first_values[plan.fields.index(name)]
        error = report.standard_errors[slot]
        if moves and error > 0.0:
            moved = (1.0 if size > 0.0 else -1.0) * (report.estimates[slot] - before[slot])
            if moved < -_SURELY * sqrt(2.0) * error:
                return True
    return False


def report_finding(
    state: CorrectorState, what: str, why: str, finding: Finding, time: float, plan: FollowPlan
) -> Event:
    """Return the event that tells of a finding; ``what`` happened at ``time`` [s] and ``why``."""
    number = finding.change
    if number < 0:
        return make_event(time, what, why, plan)
    values = state.values.end
    error = finding.standard_error
    if plan.changes[number].axis == ROTORS:
        error *= plan.value(number, values)
    swinging = 0 if what == ALARM and why == "suspected" else SWINGING
    blocks = (finding.blocks + swinging) * plan.block * plan.coarse * plan.settings.sample_time
    return make_event(
        time,
        what,
        why,
        plan,
        number,
        time - blocks,
        value=plan.value(number, plan.change_values(number, finding.size, values)),
        standard_error=error,
        other=plan.changes[finding.other].name if finding.other >= 0 else "",
    )
