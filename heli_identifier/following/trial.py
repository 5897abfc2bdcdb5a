"""What is done with a complete block: the mode says what is asked, from the alarm to the adoption and back.

    following --alarm--> alarmed --named--> on trial --better--> adopted --still better--> following
                            |                  |                    |
                            +-----held---------+--------held--------+--worse: rolled back--> following

What is named is put on trial if it is significant (z of at least 4), excited (its standard error is at most the
smallest change that matters) and physically possible; else it is held. On trial
a rival twin that has the change flies beside the one in use over the window, which begins after the change was
estimated, so that its errors 1 s ahead are out of sample for both. Name and size are then judged again from everything
since the change. The values before go on as the rival after an adoption.

**Names.** psi is what a change makes of the innovations that has always acted; right after a change they still swing.
Size and name are therefore taken from the blocks that begin two after the change, the same ones for every change, along
the direction of each and divided by the variance inflation factor along it; changes are compared under one mean factor.
"""

from math import sqrt

from heli_plant.effects import AXES

from ..online.linear_algebra import total
from .changes import Vector
from .cusum import NOTHING, Finding, cusum_statistic, judge_size, siegmund_threshold
from .evidence import loosen_baseline, project_block, shift_block, start_baseline
from .plan import FollowPlan
from .prediction import WINDOWS, compare_errors
from .state import REASONS, CorrectorState, Event

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
_LEAD = 4.6  # lead in ln B, ln 100, at which the likeliest change is named without waiting
SWINGING = 2  # blocks after a change in which the innovations still swing
_LEAST_BLOCKS = 5  # blocks that are needed after them


def judge_block(state: CorrectorState, plan: FollowPlan) -> CorrectorState:
    """Return the state after a complete block."""
    if state.mode == "starting" and state.is_noise_known:
        return state.enter("following")
    if state.mode in ("starting", "suspended"):
        return state
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
        for height, run in (cusum_statistic(own, change.size), cusum_statistic(own, -change.size)):
            alarm = max(alarm, height / limit)
            longest = max(longest, run if height > limit else 0)
    return state._replace(alarm=alarm), longest


def look_for_change(state: CorrectorState, run: int, plan: FollowPlan) -> CorrectorState:
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
        state = add_event(state, "suspected", plan, first)
        return state.enter("alarmed", finding=first, run=run, baseline=start_baseline(plan.deviations))
    return state


def name_change(state: CorrectorState, plan: FollowPlan) -> CorrectorState:
    """Name the change as soon as it leads, or when patience is over."""
    elapsed = state.blocks_in_mode(plan)
    found, measured = find_changes(state, state.run + SWINGING + elapsed, plan)
    late = elapsed >= _PATIENCE
    if not found:
        return _follow_on(state, NOTHING, "impossible", plan) if late else state
    first = found[0]
    leads = len(found) == 1 or first.evidence - found[1].evidence >= _LEAD
    if not leads:
        first = first._replace(other=found[1].change)
    state = state._replace(finding=first)
    why = ""
    if not measured or first.standard_error > plan.changes[first.change].size:
        why = "undetermined"
    elif abs(first.z) < _LEAST_Z:
        why = "insignificant"
    if not why and (leads or late):
        return _put_on_trial(add_event(state, "named" if leads else "ambiguous", plan, first), first, plan)
    return _follow_on(state, first, why, plan) if late else state


def _follow_on(state: CorrectorState, finding: Finding, why: str, plan: FollowPlan) -> CorrectorState:
    """Follow again without a change."""
    return add_event(state, why, plan, finding).follow_again()


def _put_on_trial(state: CorrectorState, finding: Finding, plan: FollowPlan) -> CorrectorState:
    """Start a rival twin with the change; without corrections, hold."""
    if not plan.settings.correcting:
        return _follow_on(state, finding, "off", plan)
    rival = plan.build_twin(plan.changes[finding.change].apply(finding.size, state.twin.values))
    return state.with_rival(rival).enter("on trial", finding=finding)


def _compare_rival(state: CorrectorState, plan: FollowPlan) -> tuple[int, float, float]:
    """Return the comparisons of the rival, and how much worse it is on the axes of the change; 0 within a window."""
    rival, used = state.predictions.copies[2].errors, state.predictions.used.errors
    if len(rival) < plan.window:
        return len(rival), 0.0, 0.0
    return len(rival), *compare_errors(rival, used, plan.changes[state.finding.change].axes)


def try_change(state: CorrectorState, plan: FollowPlan) -> CorrectorState:
    """Adopt the change if the rival was better over the window, hold it if not; else wait for another window."""
    compared, difference, t = _compare_rival(state, plan)
    if compared < plan.window or (abs(t) < _SURELY and compared < _TRIAL_WINDOWS * plan.window):
        return state
    latest = refine_size(state, state.finding, plan)
    ranked = rank_changes(state, latest.blocks, plan)
    own = max([one.evidence for one in ranked if one.change == latest.change], default=0.0)
    if ranked and ranked[0].change != latest.change and ranked[0].evidence > _LEAD + own:
        state = add_event(add_event(state, "outdone", plan, latest), "named", plan, ranked[0])
        return _put_on_trial(state, ranked[0], plan)
    if difference >= 0.0 or t > -_SURELY:
        return _follow_on(state, latest, "not better", plan)
    # the twin before is the rival from now on
    state, before, change = add_event(state, "better", plan, latest), state.twin, plan.changes[latest.change]
    errors = list(state.errors)
    for place in change.places:
        errors[place] = state.events[-1].standard_error
    direction, values = change.direction(before.values), change.apply(latest.size, before.values)
    state = state.use(values, tuple(errors), plan).with_rival(before)
    return state.enter(
        "adopted",
        finding=latest,
        blocks=tuple([shift_block(block, direction, latest.size) for block in state.blocks[-latest.blocks :]]),
        baseline=loosen_baseline(state.baseline, direction, latest.standard_error, change.size),
        tested=(),
        alarm=0.0,
    )


def watch_change(state: CorrectorState, plan: FollowPlan) -> CorrectorState:
    """Watch what was adopted: take it back if the values before predict better, refine it when the watch is over."""
    compared, mean, t = _compare_rival(state, plan)
    if mean < 0.0 and t < -_ROLL_BACK:
        return take_back(state, state.rival[0].values, "worse", plan)
    if compared < _WATCH_WINDOWS * plan.window:
        return state
    number, count = state.finding.change, len(state.blocks)
    left = explain_change(state, number, count, plan)
    if left.change < 0 or abs(left.z) < _REFINING:
        # of a slow change the last part tells most
        left = explain_change(state, number, count, plan, whole=False)
        if left.evidence < _LEAD:
            left = NOTHING
    state = state.follow_again()._replace(tested=state.tested)
    return _put_on_trial(state, left, plan) if left.change >= 0 else state


def take_back(state: CorrectorState, values: Vector, why: str, plan: FollowPlan) -> CorrectorState:
    """Use these ``values`` again."""
    state = state.use(values, state.errors, plan)._replace(blocks=())
    return add_event(state, why, plan, Finding(state.finding.change)).follow_again()


def sums_back(state: CorrectorState, number: int, count: int, plan: FollowPlan) -> list[tuple[float, float]]:
    """Return D^T b and D^T R D of the last block, of the last two, and so on, of ``count`` at most."""
    direction, found = plan.changes[number].direction(state.twin.values), [(0.0, 0.0)]
    for block in reversed(state.blocks[-count:]):
        response, information = project_block(block, direction)
        found.append((found[-1][0] + response, found[-1][1] + information))
    return found[1:]


def explain_change(
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
    found = [explain_change(state, number, count, plan, whole, share) for number in range(len(plan.changes))]
    return sorted([one for one in found if one.change >= 0], key=lambda one: one.evidence, reverse=True)


def find_changes(state: CorrectorState, longest: int, plan: FollowPlan) -> tuple[list[Finding], bool]:
    """Return every possible change with its size, the likeliest first, and whether it has been measured.

    It began at most ``longest`` blocks ago. Until enough blocks have passed since, the sizes are those since it began,
    and not to be used.
    """
    found = rank_changes(state, longest, plan, whole=False)
    count = found[0].blocks - SWINGING if found else 0
    return (found, False) if count < _LEAST_BLOCKS else (rank_changes(state, count, plan), True)


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


def add_event(state: CorrectorState, why: str, plan: FollowPlan, finding: Finding = NOTHING) -> CorrectorState:
    """Return the state with an event that tells of a ``finding``, or of none; ``why`` is a key of the reasons."""
    time, (what, reason) = state.samples * plan.settings.sample_time, REASONS[why]
    event = Event(time, what, since=time, why=reason)
    if finding.change >= 0:
        change, values = plan.changes[finding.change], state.twin.values
        blocks = finding.blocks + (SWINGING if finding.blocks > 0 and why != "suspected" else 0)
        event = event._replace(
            name=change.name,
            other=plan.changes[finding.other].name if finding.other >= 0 else "",
            axis=AXES[change.axes[0]] if change.field else "rotors",
            value=change.value(change.apply(finding.size, values)),
            standard_error=finding.standard_error * (1.0 if change.field else change.value(values)),
            since=time - blocks * plan.block * plan.settings.sample_time,
        )
    return state._replace(events=(*state.events, event))
