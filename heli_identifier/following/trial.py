"""What is done with a complete block: the mode says what is asked, from the alarm to the adoption and back.

    following --alarm--> alarmed --named--> on trial --better--> adopted --still better--> following
                            |                  |                    |
                            +-----held---------+--------held--------+--worse: rolled back--> following

What is named is put on trial if it passes three gates, else it is held, and the event says which gate held it:
* significant: a CUSUM raised the alarm, and z of the estimate is at least 4,
* excited: its standard error is at most the smallest change that matters, and the identifier sees its axes move,
* physically possible: the value stays within its bounds, a friction never pushes, a gain keeps its sign.

On trial a rival twin that has the change flies beside the one in use over the window, which begins after the change was
estimated, so that its errors 1 s ahead are out of sample for both. It must have been better, and the on-line identifier
must not contradict it. Name and size are then judged again from everything since the change. Another change that
explains it 100 times better goes on trial instead; else the size is ramped in. The values before go on as the rival; as
soon as they predict better with t > 3, they are taken again.
"""

from . import naming
from .baseline import add_uncertainty, forget_latest
from .blocks import deviations_of, is_noise_known, shift_block
from .changes import Direction
from .cusum import NOTHING, Finding, check_alarm, estimate_begin, estimate_size, update_cusum
from .naming import LEAD
from .plan import FollowPlan
from .prediction import WINDOWS, compare_errors, drop_rival
from .state import (
    ADOPTED,
    ALARM,
    ALARMED,
    FOLLOWING,
    HELD,
    ON_TRIAL,
    ROLLED_BACK,
    STARTING,
    SUSPENDED,
    WATCHED,
    CorrectorState,
    Event,
    IdentifierReport,
    make_event,
)
from .stream import is_doubtful

Judged = tuple[CorrectorState, list[Event]]
"""The state after a block, and what there is to report."""

_PATIENCE = 15
"""Blocks after an alarm in which the lead is waited for."""

_LEAST_Z = 4.0

_SCORE, _SCORE_TIME = 5.0, 10
"""Size of an effect's score on line, and the blocks for which it stays beyond it before the effect is put on trial."""

_HEARD_BLOCKS = 120
"""Blocks for which the identifier's estimates are kept."""

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


def judge_block(state: CorrectorState, report: IdentifierReport, plan: FollowPlan) -> Judged:
    """Return the state after a complete block, and what there is to report."""
    if state.mode == STARTING and is_noise_known(state.noises):
        return state.enter(FOLLOWING), []
    if state.mode in (STARTING, SUSPENDED):
        return state, []
    time = state.samples * plan.settings.sample_time
    directions = plan.directions(state.values.end)
    state = state._replace(inflations=naming.learn_inflations(state, directions))
    if report.scores:
        counts = [n + 1 if abs(score) > _SCORE else 0 for n, score in zip(state.scored, report.scores, strict=True)]
        state = state._replace(scored=tuple(counts))
    if report.estimates:
        state = state._replace(heard=(*state.heard, report.estimates)[-_HEARD_BLOCKS:])
    run = 0
    if state.mode in (FOLLOWING, WATCHED):
        state, run = _update_cusums(state, directions, plan)
    if state.mode == FOLLOWING:
        return look_for_change(state, directions, run, time, plan)
    if state.mode == ALARMED:
        return name_change(state, directions, report, time, plan)
    if state.mode == ON_TRIAL:
        return try_change(state, directions, report, time, plan)
    return watch_change(state, directions, time, plan)


def _update_cusums(
    state: CorrectorState, directions: tuple[Direction, ...], plan: FollowPlan
) -> tuple[CorrectorState, int]:
    """Take the newest block into the CUSUMs; return the blocks since the one that raises an alarm was zero, else 0."""
    newest = naming.project_blocks(state.tested[-1:], directions, state.inflations, common=False)
    seen = newest[0] if newest else ((0.0, 0.0),) * len(directions)
    rows = zip(state.cusums, seen, plan.changes, strict=True)
    cusums = tuple([update_cusum(cusum, *of_block, change.size) for cusum, of_block, change in rows])
    alarm, run = check_alarm(cusums, naming.find_thresholds(state.inflations, plan))
    return state._replace(cusums=cusums, cusums_before=state.cusums, alarm=alarm), run


def look_for_change(
    state: CorrectorState, directions: tuple[Direction, ...], run: int, time: float, plan: FollowPlan
) -> Judged:
    """Raise an alarm where a CUSUM, above zero for ``run`` blocks (0: no alarm), or a score says so.

    It waits while an encoder may be at fault.
    """
    if _is_worse_than_alone(state, plan):
        return take_back(state, plan.first_values, "worse than alone", time, plan)
    if run > 0 and not is_doubtful(state.stream, deviations_of(state.noises), plan):
        found, _ = naming.find_changes(state, directions, run + naming.SWINGING, plan)
        first = found[0] if found else NOTHING
        state = state.enter(ALARMED, finding=first, run=run, baseline=forget_latest(state.baseline))
        return state, [naming.report_finding(state, ALARM, "suspected", first, time, plan)]
    for slot, blocks in enumerate(state.scored):
        if blocks >= _SCORE_TIME:
            one = _measure(state, directions, len(plan.changes) - len(state.scored) + slot, plan)
            if one.change >= 0 and abs(one.z) >= _LEAST_Z:
                state = state._replace(scored=(0,) * len(state.scored), finding=one)
                return _put_on_trial(
                    state, one, time, plan, naming.report_finding(state, ALARM, "scored", one, time, plan)
                )
    return state, []


def _measure(state: CorrectorState, directions: tuple[Direction, ...], number: int, plan: FollowPlan) -> Finding:
    """Return the size of a change from all blocks that are kept."""
    seen = naming.project_blocks(state.blocks, directions, state.inflations, common=False)
    return estimate_size(seen, number, plan.changes[number].size, *plan.bounds(number, state.values.end))


def name_change(
    state: CorrectorState, directions: tuple[Direction, ...], report: IdentifierReport, time: float, plan: FollowPlan
) -> Judged:
    """Name the change as soon as it leads, or when patience is over."""
    elapsed = (state.samples - state.since) // (plan.block * plan.coarse)
    found, measured = naming.find_changes(state, directions, state.run + naming.SWINGING + elapsed, plan)
    late = elapsed >= _PATIENCE
    if not found:
        held = naming.report_finding(state, HELD, "impossible", NOTHING, time, plan)
        return (state.follow_again(), [held]) if late else (state, [])
    first = found[0]
    leads = len(found) == 1 or first.evidence - found[1].evidence >= LEAD
    if not leads:
        first = first._replace(other=found[1].change)
    state = state._replace(finding=first)
    change = plan.changes[first.change]
    why = ""
    if not measured or first.standard_error > change.size or min(report.excitation[k] for k in change.axes) <= 0.0:
        why = "undetermined"
    elif abs(first.z) < _LEAST_Z:
        why = "insignificant"
    if not why and (leads or late):
        event = naming.report_finding(state, ALARM, "named" if leads else "ambiguous", first, time, plan)
        return _put_on_trial(state, first, time, plan, event)
    if late:
        return state.follow_again(), [naming.report_finding(state, HELD, why, first, time, plan)]
    return state, []


def _put_on_trial(state: CorrectorState, finding: Finding, time: float, plan: FollowPlan, *events: Event) -> Judged:
    """Start a rival twin with the change; without corrections, hold. ``events`` are reported before."""
    if not plan.settings.correcting:
        return state.follow_again(), [*events, naming.report_finding(state, HELD, "off", finding, time, plan)]
    rival = plan.twin(plan.change_values(finding.change, finding.size, state.values.end))
    values = state.values._replace(rival=(rival,))
    predictions = drop_rival(state.predictions)
    return state.enter(ON_TRIAL, finding=finding, values=values, predictions=predictions), [*events]


def try_change(
    state: CorrectorState, directions: tuple[Direction, ...], report: IdentifierReport, time: float, plan: FollowPlan
) -> Judged:
    """Adopt the change if the rival was better over the window, hold it if not; else wait for another window."""
    rival = state.predictions.rival
    if len(rival) < plan.window:
        return state, []
    difference, t = compare_errors(rival, state.predictions.against, plan.changes[state.finding.change].axes)
    if abs(t) < _SURELY and len(rival) < _TRIAL_WINDOWS * plan.window:
        return state, []
    latest = naming.refine_size(state, directions, state.finding, plan)
    likelier = naming.find_likelier(state, directions, latest, plan)
    if likelier.change >= 0:
        held = naming.report_finding(state, HELD, "outdone", latest, time, plan)
        named = naming.report_finding(state, ALARM, "named", likelier, time, plan)
        return _put_on_trial(state, likelier, time, plan, held, named)
    why = ""
    if difference >= 0.0 or t > -_SURELY:
        why = "not better"
    elif naming.is_contradicted(state, latest, report, plan):
        why = "contradicted"
    if why:
        return state.follow_again(), [naming.report_finding(state, HELD, why, latest, time, plan)]
    event = naming.report_finding(state, ADOPTED, "better", latest, time, plan)
    return _adopt(state, directions[latest.change], latest, event.standard_error, plan), [event]


def _adopt(
    state: CorrectorState, direction: Direction, finding: Finding, error: float, plan: FollowPlan
) -> CorrectorState:
    """Return the state with the change ramped in; the values before are the rival from now on."""
    before, number = state.values, finding.change
    errors = list(before.errors)
    for place in plan.places(number):
        errors[place] = error
    values = before._replace(
        begin=before.now.values,
        end=plan.change_values(number, finding.size, before.end),
        ramp=state.samples,
        rival=(plan.twin(before.end),),
        errors=tuple(errors),
    )
    blocks = state.blocks[len(state.blocks) - finding.blocks :]
    return state.without_alarm().enter(
        WATCHED,
        finding=finding,
        values=values,
        blocks=tuple([shift_block(block, direction, finding.size) for block in blocks]),
        baseline=add_uncertainty(state.baseline, direction, finding.standard_error, plan.changes[number].size),
        tested=(),
        predictions=drop_rival(state.predictions),
    )


def watch_change(state: CorrectorState, directions: tuple[Direction, ...], time: float, plan: FollowPlan) -> Judged:
    """Watch what was adopted: take it back if the values before predict better, refine it when the watch is over."""
    number, rival = state.finding.change, state.predictions.rival
    if len(rival) >= plan.window:
        mean, t = compare_errors(rival, state.predictions.against, plan.changes[number].axes)
        if mean < 0.0 and t < -_ROLL_BACK:
            return take_back(state, state.values.rival[0].values, "worse", time, plan)
    if len(rival) < _WATCH_WINDOWS * plan.window:
        return state, []
    left = _measure(state, directions, number, plan)
    if left.change < 0 or abs(left.z) < _REFINING:
        # of a slow change the last part tells most
        seen = naming.project_blocks(state.blocks, directions, state.inflations, common=False)
        bounds = plan.bounds(number, state.values.end)
        left = estimate_begin(seen, number, len(seen), plan.changes[number].size, *bounds)
        if left.evidence < LEAD:
            left = NOTHING
    state = state.follow_again()._replace(cusums=state.cusums, cusums_before=state.cusums_before)
    return _put_on_trial(state, left, time, plan) if left.change >= 0 else (state, [])


def _is_worse_than_alone(state: CorrectorState, plan: FollowPlan) -> bool:
    """Return whether the twin in use has clearly been worse over the last windows than the one left alone."""
    used, alone = state.predictions.used, state.predictions.alone
    if state.values.end == plan.first_values or len(alone) < WINDOWS * plan.window:
        return False
    mean, t = compare_errors(alone, used, (0, 1, 2))
    return mean < -_WORSE and t < -_CLEARLY


def take_back(state: CorrectorState, end: tuple[float, ...], why: str, time: float, plan: FollowPlan) -> Judged:
    """Ramp the values ``end`` in again."""
    number = state.finding.change
    value = plan.value(number, end) if number >= 0 else 0.0
    event = make_event(time, ROLLED_BACK, why, plan, number, value=value)
    values = state.values._replace(begin=state.values.now.values, end=end, ramp=state.samples)
    return state.follow_again()._replace(values=values._replace(rival=()), blocks=(), tested=()), [event]
