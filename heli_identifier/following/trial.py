"""A change on trial: a rival twin has it, flies beside the one in use, and its size is estimated anew."""

from .blocks import kappa
from .detection import AT_ZERO, NOTHING, Direction, Finding, projected
from .events import HELD, OFF, Event
from .naming import LEAD, bounds_of, changed, event_of, ranked
from .plan import FollowPlan, parameters_of
from .state import FOLLOWING, ON_TRIAL, CorrectorState
from .twins import without_rival


def put_on_trial(
    state: CorrectorState, finding: Finding, time: float, plan: FollowPlan
) -> tuple[CorrectorState, list[Event]]:
    """Start a rival twin with the change; without corrections, hold."""
    if not plan.settings.correcting:
        return rested(state), [event_of(state, HELD, OFF, finding, time, plan)]
    rival = changed(finding.change, finding.size, state.values.end, plan)
    values = state.values._replace(rival=rival, rival_parameters=parameters_of(rival, plan))
    return state._replace(
        mode=ON_TRIAL, since=state.samples, finding=finding, values=values, twins=without_rival(state.twins)
    ), []


def rested(state: CorrectorState) -> CorrectorState:
    """Return the state following again, Page's sums at zero, without a rival."""
    return state._replace(
        mode=FOLLOWING,
        since=state.samples,
        pages=(AT_ZERO,) * len(state.pages),
        pages_before=(AT_ZERO,) * len(state.pages),
        alarm=0.0,
        finding=NOTHING,
        values=state.values._replace(rival=()),
        twins=without_rival(state.twins),
    )


def renamed(state: CorrectorState, compass: tuple[Direction, ...], finding: Finding, plan: FollowPlan) -> Finding:
    """Return the change that explains the blocks of ``finding`` better than it does by :data:`LEAD`, or nothing."""
    found = ranked(state, compass, finding.blocks, plan)
    own = [one.evidence for one in found if one.change == finding.change]
    if found and found[0].change != finding.change and found[0].evidence > LEAD + (own[0] if own else 0.0):
        return found[0]
    return NOTHING


def estimated_anew(
    state: CorrectorState, compass: tuple[Direction, ...], finding: Finding, plan: FollowPlan
) -> Finding:
    """Return the change on trial with its size from all blocks since it took place."""
    elapsed = (state.samples - state.since) // (plan.block * plan.coarse)
    count = min(finding.blocks + elapsed, len(state.blocks))
    response = information = 0.0
    for block in state.blocks[len(state.blocks) - count :]:
        b, r = projected(block, compass[finding.change])
        response += b
        information += r
    if information <= 0.0:
        return finding
    least, most = bounds_of(finding.change, state, plan)
    size = min(max(response / information, least), most)
    error = (kappa(state.colours[finding.change]) / information) ** 0.5
    return finding._replace(blocks=count, size=size, standard_error=error, z=size / error)
