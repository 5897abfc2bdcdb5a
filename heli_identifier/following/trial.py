"""What is done with a complete block: the mode says what is asked, from the alarm to the adoption and back.

    following --alarm--> alarmed --named--> on trial --better--> adopted --still better--> following
                            |                  |                    |
                            +-----held---------+--------held--------+--worse: rolled back--> following

What is named is put on trial if it is significant (z of at least 4), excited (its standard error is at most the
smallest change that matters) and physically possible; else it is held. On trial
a rival twin that has the change flies beside the one in use over the window, which begins after the change was
estimated, so that its errors 1 s ahead are out of sample for both. Name and size are then judged again from everything
since the change. The values before go on as the rival after an adoption.
"""

from .changes import Vector
from .cusum import NOTHING, Finding, cusum, siegmund_threshold
from .evidence import loosen_baseline, shift_block, start_baseline
from .naming import LEAD, SWINGING, explain, find_changes, find_likelier, make_event, refine_size
from .plan import FollowPlan
from .prediction import WINDOWS, compare_errors
from .state import CorrectorState, Event

Judged = tuple[CorrectorState, list[Event]]
"""The state after a block, and what there is to report."""

_PATIENCE = 15  # blocks after an alarm in which the lead is waited for
_LEAST_Z = 4.0
_SURELY = 0.5  # t of the fall of errors on trial: the likelihood has shown the change, the trial shows that it helps
_TRIAL_WINDOWS = 3  # a trial that shows neither more nor less than _SURELY goes on for at most this many windows
_ROLL_BACK = 3.0  # t of the rise of errors at which an adopted change is taken back; it is looked at once per second

_WORSE, _CLEARLY = 0.1, 4.7
"""Share of squared errors, and t, by which a twin that is worse than the one left alone takes that one's values. With
29 degrees of freedom t is as improbable as 4 standard deviations: it is looked at once per second of a flight."""

_WATCH_WINDOWS = 2  # an adopted change is watched for this many windows
_REFINING = 2.5  # z of what is left of an adopted change at which its size is put on trial again


def judge_block(state: CorrectorState, plan: FollowPlan) -> Judged:
    """Return the state after a complete block, and what there is to report."""
    if state.mode == "starting" and state.is_noise_known:
        return state.enter("following"), []
    if state.mode in ("starting", "suspended"):
        return state, []
    if state.mode == "following":
        return look_for_change(*_update_cusums(state, plan), plan)
    if state.mode == "alarmed":
        return name_change(state, plan)
    if state.mode == "on trial":
        return try_change(state, plan)
    return watch_change(_update_cusums(state, plan)[0], plan)


def _update_cusums(state: CorrectorState, plan: FollowPlan) -> tuple[CorrectorState, int]:
    """Set the alarm; return the blocks since the CUSUM that raises it was zero, the most, else 0."""
    alarm, longest = 0.0, 0
    for change, c, own in zip(plan.changes, state.inflations, zip(*state.tested, strict=True), strict=True):
        limit = plan.threshold
        if c.blocks > 0.0:
            limit = siegmund_threshold(limit, change.size * change.size * c.information / (c.blocks * c.factor))
        for total, run in (cusum(own, change.size), cusum(own, -change.size)):
            alarm = max(alarm, total / limit)
            longest = max(longest, run if total > limit else 0)
    return state._replace(alarm=alarm), longest


def look_for_change(state: CorrectorState, run: int, plan: FollowPlan) -> Judged:
    """Raise an alarm where a CUSUM, above zero for ``run`` blocks (0: no alarm), says so.

    It waits while an encoder may be at fault.
    """
    used, alone = state.predictions.used.errors, state.predictions.alone.errors
    if state.twin.values != plan.alone.values and len(alone) == WINDOWS * plan.window:
        mean, t = compare_errors(alone, used, (0, 1, 2))
        if mean < -_WORSE and t < -_CLEARLY:
            return take_back(state, plan.alone.values, "worse than alone", plan)
    encoders = zip(state.encoders, state.noise, strict=True)
    if run > 0 and not any(one.is_doubtful(deviation, plan) for one, deviation in encoders):
        found, _ = find_changes(state, run + SWINGING, plan)
        first = found[0] if found else NOTHING
        state = state.enter("alarmed", finding=first, run=run, baseline=start_baseline(plan.deviations))
        return state, [make_event(state, "suspected", plan, first)]
    return state, []


def name_change(state: CorrectorState, plan: FollowPlan) -> Judged:
    """Name the change as soon as it leads, or when patience is over."""
    elapsed = state.blocks_in_mode(plan)
    found, measured = find_changes(state, state.run + SWINGING + elapsed, plan)
    late = elapsed >= _PATIENCE
    if not found:
        return _hold(state, NOTHING, "impossible", plan) if late else (state, [])
    first = found[0]
    leads = len(found) == 1 or first.evidence - found[1].evidence >= LEAD
    if not leads:
        first = first._replace(other=found[1].change)
    state = state._replace(finding=first)
    why = ""
    if not measured or first.standard_error > plan.changes[first.change].size:
        why = "undetermined"
    elif abs(first.z) < _LEAST_Z:
        why = "insignificant"
    if not why and (leads or late):
        event = make_event(state, "named" if leads else "ambiguous", plan, first)
        return _put_on_trial(state, first, plan, event)
    return _hold(state, first, why, plan) if late else (state, [])


def _hold(state: CorrectorState, finding: Finding, why: str, plan: FollowPlan, *events: Event) -> Judged:
    """Follow again without a change; ``events`` are reported before."""
    return state.follow_again(), [*events, make_event(state, why, plan, finding)]


def _put_on_trial(state: CorrectorState, finding: Finding, plan: FollowPlan, *events: Event) -> Judged:
    """Start a rival twin with the change; without corrections, hold. ``events`` are reported before."""
    if not plan.settings.correcting:
        return _hold(state, finding, "off", plan, *events)
    rival = plan.twin(plan.changes[finding.change].applied(finding.size, state.twin.values))
    return state.with_rival(rival).enter("on trial", finding=finding), [*events]


def _compare_rival(state: CorrectorState, plan: FollowPlan) -> tuple[int, float, float]:
    """Return the comparisons of the rival, and how much worse it is on the axes of the change; 0 within a window."""
    rival, used = state.predictions.copies[2].errors, state.predictions.used.errors
    if len(rival) < plan.window:
        return len(rival), 0.0, 0.0
    return len(rival), *compare_errors(rival, used, plan.changes[state.finding.change].axes)


def try_change(state: CorrectorState, plan: FollowPlan) -> Judged:
    """Adopt the change if the rival was better over the window, hold it if not; else wait for another window."""
    compared, difference, t = _compare_rival(state, plan)
    if compared < plan.window or (abs(t) < _SURELY and compared < _TRIAL_WINDOWS * plan.window):
        return state, []
    latest = refine_size(state, state.finding, plan)
    likelier = find_likelier(state, latest, plan)
    if likelier.change >= 0:
        held = make_event(state, "outdone", plan, latest)
        return _put_on_trial(state, likelier, plan, held, make_event(state, "named", plan, likelier))
    if difference >= 0.0 or t > -_SURELY:
        return _hold(state, latest, "not better", plan)
    # the twin before is the rival from now on
    event, before, change = make_event(state, "better", plan, latest), state.twin, plan.changes[latest.change]
    errors = list(state.errors)
    for place in change.places:
        errors[place] = event.standard_error
    direction, values = change.direction(before.values), change.applied(latest.size, before.values)
    state = state.use(values, tuple(errors), plan).with_rival(before)
    return state.enter(
        "adopted",
        finding=latest,
        blocks=tuple([shift_block(block, direction, latest.size) for block in state.blocks[-latest.blocks :]]),
        baseline=loosen_baseline(state.baseline, direction, latest.standard_error, change.size),
        tested=(),
        alarm=0.0,
    ), [event]


def watch_change(state: CorrectorState, plan: FollowPlan) -> Judged:
    """Watch what was adopted: take it back if the values before predict better, refine it when the watch is over."""
    compared, mean, t = _compare_rival(state, plan)
    if mean < 0.0 and t < -_ROLL_BACK:
        return take_back(state, state.rival[0].values, "worse", plan)
    if compared < _WATCH_WINDOWS * plan.window:
        return state, []
    number, count = state.finding.change, len(state.blocks)
    left = explain(state, number, count, plan)
    if left.change < 0 or abs(left.z) < _REFINING:
        # of a slow change the last part tells most
        left = explain(state, number, count, plan, whole=False)
        if left.evidence < LEAD:
            left = NOTHING
    state = state.follow_again()._replace(tested=state.tested)
    return _put_on_trial(state, left, plan) if left.change >= 0 else (state, [])


def take_back(state: CorrectorState, values: Vector, why: str, plan: FollowPlan) -> Judged:
    """Use these ``values`` again."""
    state = state.use(values, state.errors, plan)._replace(blocks=())
    event = make_event(state, why, plan, Finding(state.finding.change))
    return state.follow_again(), [event._replace(since=event.time)]
