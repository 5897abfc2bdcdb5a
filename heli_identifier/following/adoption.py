"""The last gate: a change on trial is adopted if it predicts better, watched, and taken back if that does not last.

A rival twin that has the change has flown beside the one in use over the window, which begins after the change was
estimated, so that its errors 1 s ahead are out of sample for both. It must have been better, and the on-line
identifier must not contradict it (:mod:`.hearing`). Name and size are
then judged anew from everything since the change. Another change that explains it 100 times better goes on trial
instead; else the size is ramped in. The values before go on as the rival; as soon as they
predict better with t > 3, they are taken again.
"""

from .baseline import uncertain
from .blocks import Block, shifted
from .detection import AT_ZERO, NOTHING, Direction, Finding, began, measured
from .errors import compared
from .events import ADOPTED, ALARM, BETTER, CONTRADICTED, HELD, NAMED, NOT_BETTER, OUTDONE, ROLLED_BACK, WORSE, Event
from .hearing import contradicted
from .naming import LEAD, axes_of, bounds_of, changed, event_of, seen_by, shares_of, value_of
from .plan import FollowPlan, parameters_of
from .state import WATCHED, CorrectorState, Told
from .trial import estimated_anew, put_on_trial, renamed, rested
from .twins import WINDOWS, without_rival
from .values import heading

_SURELY = 0.5
"""t of the fall of squared errors on trial: the likelihood has shown the change, the trial is to show that it helps."""

_TRIAL_WINDOWS = 3
"""A trial that shows neither more nor less than _SURELY goes on for at most this many windows."""

_ROLL_BACK = 3.0
"""t of the difference of squared errors at which an adopted change is taken back; it is looked at once per second."""

_WORSE, _CLEARLY = 0.1, 4.7
"""Share of squared errors, and t, by which a twin that is worse than the one left alone takes that one's values. With
29 degrees of freedom t is as improbable as 4 standard deviations: it is looked at once per second of a flight."""

_WATCH_WINDOWS = 2
"""An adopted change is watched for this many windows."""

_REFINING = 2.5
"""z of what is left of an adopted change at which its size is put on trial again."""


def on_trial(
    state: CorrectorState, compass: tuple[Direction, ...], told: Told, time: float, plan: FollowPlan
) -> tuple[CorrectorState, list[Event]]:
    """Adopt the change if the rival was better over the window, hold it if not; else wait for another window."""
    count = len(state.twins.rival)
    if count < plan.window:
        return state, []
    axes = axes_of(state.finding.change, plan)
    difference, t = compared(state.twins.rival, state.twins.against, axes)
    if abs(t) < _SURELY and count < _TRIAL_WINDOWS * plan.window:
        return state, []
    latest = estimated_anew(state, compass, state.finding, plan)
    likelier = renamed(state, compass, latest, plan)
    if likelier.change >= 0:
        events = [
            event_of(state, HELD, OUTDONE, latest, time, plan),
            event_of(state, ALARM, NAMED, likelier, time, plan),
        ]
        state, more = put_on_trial(state, likelier, time, plan)
        return state, events + more
    if difference >= 0.0 or t > -_SURELY:
        return rested(state), [event_of(state, HELD, NOT_BETTER, latest, time, plan)]
    if contradicted(state, latest, told, plan):
        return rested(state), [event_of(state, HELD, CONTRADICTED, latest, time, plan)]
    event = event_of(state, ADOPTED, BETTER, latest, time, plan)
    return _taken(state, compass[latest.change], latest, event, plan), [event]


def _taken(
    state: CorrectorState, direction: Direction, finding: Finding, event: Event, plan: FollowPlan
) -> CorrectorState:
    """Return the state with the change ramped in; the values before are the rival from now on."""
    before = state.values
    after = changed(finding.change, finding.size, before.end, plan)
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
    values = heading(before, after, state.samples)._replace(
        rival=before.end, rival_parameters=parameters_of(before.end, plan), errors=tuple(errors)
    )
    return state._replace(
        mode=WATCHED,
        since=state.samples,
        pages=(AT_ZERO,) * len(state.pages),
        pages_before=(AT_ZERO,) * len(state.pages),
        alarm=0.0,
        finding=finding,
        values=values,
        blocks=_moved(state.blocks[len(state.blocks) - finding.blocks :], direction, finding.size),
        baseline=uncertain(state.baseline, direction, finding.standard_error, plan.sizes[finding.change]),
        tested=(),
        twins=without_rival(state.twins),
    )


def _moved(blocks: tuple[Block, ...], direction: Direction, size: float) -> tuple[Block, ...]:
    """Return the blocks as they would be had the change been in use."""
    a, b, c = direction
    theta = (tuple([size * x for x in a]), tuple([size * x for x in b]), tuple([size * x for x in c]))
    return tuple([shifted(block, theta) for block in blocks])


def adopted(
    state: CorrectorState, compass: tuple[Direction, ...], time: float, plan: FollowPlan
) -> tuple[CorrectorState, list[Event]]:
    """Watch what was adopted: take it back if the values before predict better, refine it when the watch is over."""
    number = state.finding.change
    axes = axes_of(number, plan)
    count = len(state.twins.rival)
    if count >= plan.window:
        mean, t = compared(state.twins.rival, state.twins.against, axes)
        if mean < 0.0 and t < -_ROLL_BACK:
            return taken_back(state, state.values.rival, WORSE, time, plan)
    if count < _WATCH_WINDOWS * plan.window:
        return state, []
    least, most = bounds_of(number, state, plan)
    seen = seen_by(state.blocks, compass, shares_of(state.colours))
    nu = plan.sizes[number]
    left = measured(seen, number, len(seen), nu, least, most)
    if left.change < 0 or abs(left.z) < _REFINING:
        left = began(seen, number, len(seen), nu, least, most)  # of a slow change the last part tells most
        if left.evidence < LEAD:
            left = NOTHING
    state = rested(state)._replace(pages=state.pages, pages_before=state.pages_before)
    if left.change >= 0:
        return put_on_trial(state, left, time, plan)
    return state, []


def worse_than_alone(state: CorrectorState, plan: FollowPlan) -> bool:
    """Return whether the twin in use has clearly been worse over the last windows than the one left alone."""
    if state.values.end == plan.first_values or len(state.twins.alone) < WINDOWS * plan.window:
        return False
    mean, t = compared(state.twins.alone, state.twins.used, (0, 1, 2))
    return mean < -_WORSE and t < -_CLEARLY


def taken_back(
    state: CorrectorState, values: tuple[float, ...], why: int, time: float, plan: FollowPlan
) -> tuple[CorrectorState, list[Event]]:
    """Take ``values`` again."""
    number = state.finding.change
    value = value_of(number, values, plan) if number >= 0 else 0.0
    axis = plan.changes[number].axis if number >= 0 else -1
    event = Event(time, ROLLED_BACK, number, value, 0.0, why, axis, time)
    return rested(state._replace(values=heading(state.values, values, state.samples), blocks=(), tested=())), [event]
