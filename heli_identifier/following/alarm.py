"""From a twin that follows to a change with a name: alarms by Page's test or by a score, names by likelihood.

What is named is put on trial if it passes three gates, else it is held, and the event says which gate held it:
* significant: Page's test raised the alarm, and z of the estimate is at least 4,
* excited: its standard error is at most the smallest change that matters, and the identifier sees its axes move,
* physically possible: the value stays within its bounds, a friction never pushes, a gain keeps its sign.
The fourth, that it predicts better, is that of :mod:`.adoption`.
"""

from .adoption import taken_back, worse_than_alone
from .baseline import forgotten
from .blocks import noise_of
from .detection import NOTHING, Direction, Finding, measured
from .events import (
    ALARM,
    AMBIGUOUS,
    HELD,
    IMPOSSIBLE,
    INSIGNIFICANT,
    NAMED,
    PASSED,
    SCORED,
    UNDETERMINED,
    WORSE_ALONE,
    Event,
)
from .naming import LEAD, SWINGING, axes_of, bounds_of, event_of, findings, seen_by, shares_of
from .plan import FollowPlan
from .state import ALARMED, CorrectorState, Told
from .stream import doubtful
from .trial import put_on_trial, rested

_PATIENCE = 15
"""Blocks after an alarm in which the lead is waited for."""

_LEAST_Z = 4.0

_SCORE_TIME = 10
"""Blocks for which an effect's score stays beyond its threshold before the effect is put on trial."""

_OPEN = -1
"""Of a gate that lets pass."""


def following(
    state: CorrectorState, compass: tuple[Direction, ...], run: int, time: float, plan: FollowPlan
) -> tuple[CorrectorState, list[Event]]:
    """Raise an alarm where Page's test, above zero for ``run`` blocks (0: no alarm), or a score says so.

    It waits while an encoder may be at fault.
    """
    if worse_than_alone(state, plan):
        return taken_back(state, plan.first_values, WORSE_ALONE, time, plan)
    if run > 0 and not doubtful(state.stream, noise_of(state.levels), plan):
        found, _ = findings(state, compass, run + SWINGING, plan)
        first = found[0] if found else NOTHING
        state = state._replace(
            mode=ALARMED, since=state.samples, finding=first, run=run, baseline=forgotten(state.baseline)
        )
        return state, [event_of(state, ALARM, PASSED, first, time, plan)]
    for slot in range(len(state.scored)):
        if state.scored[slot] >= _SCORE_TIME:
            number = len(plan.changes) - len(state.scored) + slot
            seen = seen_by(state.blocks, compass, shares_of(state.colours))
            least, most = bounds_of(number, state, plan)
            one = measured(seen, number, len(seen), plan.sizes[number], least, most)
            if one.change >= 0 and abs(one.z) >= _LEAST_Z:
                state = state._replace(scored=(0,) * len(state.scored), finding=one)
                events = [event_of(state, ALARM, SCORED, one, time, plan)]
                state, more = put_on_trial(state, one, time, plan)
                return state, events + more
    return state, []


def alarmed(
    state: CorrectorState, compass: tuple[Direction, ...], told: Told, time: float, plan: FollowPlan
) -> tuple[CorrectorState, list[Event]]:
    """Name the change as soon as it leads, or when patience is over."""
    block = plan.block * plan.coarse
    longest = state.run + SWINGING + (state.samples - state.since) // block
    found, ready = findings(state, compass, longest, plan)
    late = state.samples - state.since >= _PATIENCE * block
    if not found:
        return (rested(state), [event_of(state, HELD, IMPOSSIBLE, NOTHING, time, plan)]) if late else (state, [])
    first = found[0]
    lead = first.evidence - found[1].evidence if len(found) > 1 else LEAD
    if lead < LEAD:
        first = first._replace(other=found[1].change)
    state = state._replace(finding=first)
    gate = _gate(first, ready, told, plan)
    if gate == _OPEN and (lead >= LEAD or late):
        events = [event_of(state, ALARM, NAMED if lead >= LEAD else AMBIGUOUS, first, time, plan)]
        state, more = put_on_trial(state, first, time, plan)
        return state, events + more
    if late:
        return rested(state), [event_of(state, HELD, gate, first, time, plan)]
    return state, []


def _gate(finding: Finding, ready: bool, told: Told, plan: FollowPlan) -> int:
    """Return why a change cannot go on trial, as a place in the reasons of events, or :data:`_OPEN`."""
    moving = min([told.excitation[axis] for axis in axes_of(finding.change, plan)]) > 0.0
    if not ready or not moving or finding.standard_error > plan.sizes[finding.change]:
        return UNDETERMINED
    if abs(finding.z) < _LEAST_Z:
        return INSIGNIFICANT
    return _OPEN
