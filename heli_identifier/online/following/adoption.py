"""From an alarm to an adopted change, once per block.

    following --alarm--> alarmed --named--> on trial --better--> adopted --still better--> following
                            |                  |                    |
                            +--undetermined----+--not better--------+--worse: rolled back--> following

A change is adopted if it is
* significant: Page's test raised the alarm, and z of the estimate is at least 4,
* excited: its standard error is at most the smallest change that matters, and the identifier sees its axes move,
* physically possible: the value stays within its bounds, a friction never pushes, a gain keeps its sign,
* better: a rival twin that has it beside the one in use has had smaller errors 1 s ahead over the window, which begins
  after the change was estimated. The errors are out of sample for both.

Then its size is estimated anew from everything since the change and ramped in. The values before go on as the rival; as
soon as they predict better with t > 3, they are taken again.
"""

from .blocks import Block, kappa, shifted
from .detection import (
    AT_ZERO,
    NOTHING,
    Direction,
    Finding,
    longest_run,
    measured,
    paged,
    projected,
)
from .errors import compared
from .events import (
    ADOPTED,
    ALARM,
    AMBIGUOUS,
    BETTER,
    HELD,
    NAMED,
    NOT_BETTER,
    OFF,
    PASSED,
    ROLLED_BACK,
    SCORED,
    UNDETERMINED,
    WORSE,
    WORSE_ALONE,
    Event,
)
from .naming import (
    SWINGING,
    axes_of,
    bounds_of,
    changed,
    compass_of,
    event_of,
    findings,
    proved_colours,
    seen_by,
    shares_of,
    value_of,
)
from .plan import FollowPlan, parameters_of
from .state import ALARMED, FOLLOWING, ON_TRIAL, STARTING, SUSPENDED, WATCHED, CorrectorState, Told

KEPT = 90
"""Blocks that are kept: a change is looked for in the last minute and a half."""

_LEAD = 4.6
"""Lead in ln B, ln 100, at which the likeliest change is named without waiting."""

_PATIENCE = 15
"""Blocks after an alarm in which the lead is waited for."""

_LEAST_Z = 4.0

_SURELY = 0.5
"""t of the fall of squared errors on trial: the likelihood has shown the change, the trial is to show that it helps."""

_ROLL_BACK = 3.0
"""t of the difference of squared errors at which an adopted change is taken back; it is looked at once per second."""

_WORSE, _CLEARLY = 0.1, 4.0
"""Share of squared errors, and t, by which a twin that is worse than the one left alone takes that one's values."""

_WATCH_WINDOWS = 2
"""An adopted change is watched for this many windows."""

_REFINING = 2.5
"""z of what is left of an adopted change at which its size is put on trial again."""

_SCORE, _SCORE_TIME = 5.0, 10
"""An effect whose score on line stays beyond the first for the second [blocks] is put on trial."""


def judged(state: CorrectorState, told: Told, plan: FollowPlan) -> tuple[CorrectorState, list[Event]]:
    """Return the state after a complete block, and what there is to report."""
    time = state.samples * plan.settings.sample_time
    if state.mode == STARTING:
        if state.samples >= plan.learning:
            state = state._replace(mode=FOLLOWING, since=state.samples)
        return state, []
    if state.mode == SUSPENDED:
        return state, []
    compass = compass_of(state, plan)
    state = _scored(state._replace(colours=proved_colours(state, compass)), told)
    newest = (
        seen_by(state.blocks[-1:], compass, shares_of(state.colours))[0]
        if state.blocks
        else ((0.0, 0.0),) * len(compass)
    )
    if state.mode in (FOLLOWING, WATCHED):
        state = state._replace(pages=paged(state.pages, newest, plan.sizes))
    if state.mode == FOLLOWING:
        return _following(state, compass, time, plan)
    if state.mode == ALARMED:
        return _alarmed(state, compass, told, time, plan)
    if state.mode == ON_TRIAL:
        return _on_trial(state, compass, time, plan)
    return _adopted(state, compass, time, plan)


def _scored(state: CorrectorState, told: Told) -> CorrectorState:
    """Count for how long each watched effect's score has been beyond its threshold."""
    if not told.scores:
        return state
    counts = [n + 1 if abs(score) > _SCORE else 0 for n, score in zip(state.scored, told.scores, strict=True)]
    return state._replace(scored=tuple(counts))


def _following(
    state: CorrectorState, compass: tuple[Direction, ...], time: float, plan: FollowPlan
) -> tuple[CorrectorState, list[Event]]:
    """Raise an alarm where Page's test or a score says so."""
    values = state.values
    if values.end != plan.first_values and len(state.twins.alone) == plan.window:
        mean, t = compared(state.twins.alone, state.twins.used, (0, 1, 2))
        if mean < -_WORSE and t < -_CLEARLY:
            return _back(state, plan.first_values, WORSE_ALONE, time, plan)
    run = longest_run(state.pages, plan.threshold)
    if run > 0:
        found, _ = findings(state, compass, run + SWINGING, plan)
        first = found[0] if found else NOTHING
        state = state._replace(mode=ALARMED, since=state.samples, finding=first, run=run)
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
                state, more = _put_on_trial(state, one, time, plan)
                return state, events + more
    return state, []


def _alarmed(
    state: CorrectorState, compass: tuple[Direction, ...], told: Told, time: float, plan: FollowPlan
) -> tuple[CorrectorState, list[Event]]:
    """Name the change as soon as it leads, or when patience is over."""
    block = plan.block * plan.coarse
    longest = state.run + SWINGING + (state.samples - state.since) // block
    found, ready = findings(state, compass, longest, plan)
    late = state.samples - state.since >= _PATIENCE * block
    if not found:
        if late:
            return _rested(state), [event_of(state, HELD, UNDETERMINED, NOTHING, time, plan)]
        return state, []
    first = found[0]
    lead = first.evidence - found[1].evidence if len(found) > 1 else _LEAD
    state = state._replace(finding=first)
    moving = min([told.excitation[axis] for axis in axes_of(first.change, plan)]) > 0.0
    enough = ready and moving and abs(first.z) >= _LEAST_Z and first.standard_error <= plan.sizes[first.change]
    if enough and (lead >= _LEAD or late):
        events = [event_of(state, ALARM, NAMED if lead >= _LEAD else AMBIGUOUS, first, time, plan)]
        state, more = _put_on_trial(state, first, time, plan)
        return state, events + more
    if late:
        return _rested(state), [event_of(state, HELD, UNDETERMINED, first, time, plan)]
    return state, []


def _put_on_trial(
    state: CorrectorState, finding: Finding, time: float, plan: FollowPlan
) -> tuple[CorrectorState, list[Event]]:
    """Start a rival twin with the change; without corrections, hold."""
    if not plan.settings.correcting:
        return _rested(state), [event_of(state, HELD, OFF, finding, time, plan)]
    rival = changed(finding.change, finding.size, state.values.end, plan)
    values = state.values._replace(rival=rival, rival_parameters=parameters_of(rival, plan))
    twins = state.twins._replace(copies_rival=(), against=(), rival=())
    return state._replace(mode=ON_TRIAL, since=state.samples, finding=finding, values=values, twins=twins), []


def _rested(state: CorrectorState) -> CorrectorState:
    """Return the state following again, Page's sums at zero, without a rival."""
    return state._replace(
        mode=FOLLOWING,
        since=state.samples,
        pages=(AT_ZERO,) * len(state.pages),
        finding=NOTHING,
        values=state.values._replace(rival=()),
        twins=state.twins._replace(copies_rival=(), against=(), rival=()),
    )


def _on_trial(
    state: CorrectorState, compass: tuple[Direction, ...], time: float, plan: FollowPlan
) -> tuple[CorrectorState, list[Event]]:
    """Adopt the change if the rival was better over the window, else hold."""
    if len(state.twins.rival) < plan.window:
        return state, []
    number = state.finding.change
    axes = axes_of(number, plan)
    difference, t = compared(state.twins.rival, state.twins.against, axes)
    latest = _again(state, compass, number, state.finding, time, plan)
    if difference >= 0.0 or t > -_SURELY:
        return _rested(state), [event_of(state, HELD, NOT_BETTER, latest, time, plan)]
    event = event_of(state, ADOPTED, BETTER, latest, time, plan)
    return _taken(state, compass, latest, event, plan), [event]


def _again(
    state: CorrectorState,
    compass: tuple[Direction, ...],
    number: int,
    finding: Finding,
    time: float,
    plan: FollowPlan,
) -> Finding:
    """Estimate the size of a change anew, from the time of the change to now."""
    elapsed = (state.samples - state.since) // (plan.block * plan.coarse)
    count = min(finding.blocks + elapsed, len(state.blocks))
    response = information = 0.0
    for block in state.blocks[len(state.blocks) - count :]:
        b, r = projected(block, compass[number])
        response += b
        information += r
    if information <= 0.0:
        return finding
    least, most = bounds_of(number, state, plan)
    size = min(max(response / information, least), most)
    error = (kappa(state.colours[number]) / information) ** 0.5
    return Finding(number, count, size, error, finding.evidence, size / error)


def _taken(
    state: CorrectorState, compass: tuple[Direction, ...], finding: Finding, event: Event, plan: FollowPlan
) -> CorrectorState:
    """Return the state with the change ramped in; the values before are the rival from now on."""
    before = state.values
    after = changed(finding.change, finding.size, before.end, plan)
    kept = state.blocks[len(state.blocks) - finding.blocks :]
    state = state._replace(blocks=_moved(kept, compass[finding.change], finding.size))
    errors = list(before.errors)
    place = plan.places[finding.change]
    if place >= 0:
        errors[place] = event.standard_error
    else:
        name = plan.changes[finding.change].name
        if not name.endswith("rear"):
            errors[-2] = event.standard_error
        if not name.endswith("front"):
            errors[-1] = event.standard_error
    values = before._replace(
        begin=before.now,
        end=after,
        ramp=state.samples,
        rival=before.end,
        rival_parameters=parameters_of(before.end, plan),
        errors=tuple(errors),
    )
    return state._replace(
        mode=WATCHED,
        since=state.samples,
        pages=(AT_ZERO,) * len(state.pages),
        finding=finding,
        values=values,
        twins=state.twins._replace(copies_rival=(), against=(), rival=()),
    )


def _moved(blocks: tuple[Block, ...], direction: Direction, size: float) -> tuple[Block, ...]:
    """Return the blocks as they would be had the change been in use."""
    a, b, c = direction
    theta = (tuple([size * x for x in a]), tuple([size * x for x in b]), tuple([size * x for x in c]))
    return tuple([shifted(block, theta) for block in blocks])


def _adopted(
    state: CorrectorState, compass: tuple[Direction, ...], time: float, plan: FollowPlan
) -> tuple[CorrectorState, list[Event]]:
    """Watch what was adopted: take it back if the values before predict better, refine it when the watch is over."""
    number = state.finding.change
    axes = axes_of(number, plan)
    count = len(state.twins.rival)
    if count >= plan.window:
        mean, t = compared(state.twins.rival, state.twins.against, axes)
        if mean < 0.0 and t < -_ROLL_BACK:
            return _back(state, state.values.rival, WORSE, time, plan)
    if count < _WATCH_WINDOWS * plan.window:
        return state, []
    least, most = bounds_of(number, state, plan)
    seen = seen_by(state.blocks, compass, shares_of(state.colours))
    left = measured(seen, number, len(seen), plan.sizes[number], least, most)
    state = _rested(state)._replace(pages=state.pages)
    if left.change >= 0 and abs(left.z) >= _REFINING:
        return _put_on_trial(state, left, time, plan)
    return state, []


def _back(
    state: CorrectorState, values: tuple[float, ...], why: int, time: float, plan: FollowPlan
) -> tuple[CorrectorState, list[Event]]:
    """Take ``values`` again."""
    number = state.finding.change
    value = value_of(number, values, plan) if number >= 0 else 0.0
    axis = plan.changes[number].axis if number >= 0 else -1
    event = Event(time, ROLLED_BACK, number, value, 0.0, why, axis, time)
    ramped = state.values._replace(begin=state.values.now, end=values, ramp=state.samples, rival=())
    return _rested(state._replace(values=ramped, blocks=())), [event]
