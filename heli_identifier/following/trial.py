"""What happens after a complete block: the mode decides, from the alarm to the adoption and back.

    following --alarm--> alarmed --named--> on trial --better--> adopted --still better--> following
                            |                  |                    |
                            +-----held---------+--------held--------+--worse: rolled back--> following

On trial a rival twin that has the change runs beside the twin in use for a window, which begins after the change was
estimated: its errors 1 s ahead are out of sample for both. After an adoption the values before are the rival.

Size and name are estimated from the blocks that begin two after the change, the same ones for all changes.
"""

from heli_plant.effects import AXES
from heli_plant.observer import FIELDS

from ..online.linear_algebra import total
from .cusum import NOTHING, ChangeEstimate, cusum_statistic, judge_size, siegmund_threshold
from .evidence import loosen_baseline, project_block, shift_block, start_baseline
from .plan import FollowPlan
from .prediction import WINDOWS, compare_errors
from .state import DIGITS, REASONS, CorrectorState, TwinEvent

_LEARNED = 9  # blocks after which the noise is known
_PATIENCE = 15  # blocks after an alarm until the likeliest change is named without a lead
_LEAST_Z = 4.0
_TRIAL_T = 0.5  # t of smaller errors that passes a trial: the likelihood has shown the change, the trial that it helps
_ROLL_BACK_T = 3.0  # t of larger errors at which an adopted change is taken back; it is computed once per second

_WATCH_WINDOWS = 2  # an adopted change is watched for this many windows
_REFINING_Z = 2.5  # z of the remainder of an adopted change at which it is put on trial
_LEAD = 4.6  # lead in ln B, ln 100, at which the likeliest change is named without waiting
SWINGING = 2  # blocks after a change in which the innovations still swing
_LEAST_BLOCKS = 5  # blocks that are needed after them


def judge_block(state: CorrectorState, plan: FollowPlan) -> CorrectorState:
    """Return the state after a complete block."""
    if state.suspended:
        return state
    if state.mode == "starting":
        learned = max(noise.blocks for noise in state.noises)  # an axis that never moves learns nothing
        return state.enter("following") if learned >= _LEARNED else state
    if state.mode == "following":
        return look_for_change(*_update_cusums(state, plan), plan)
    if state.mode == "alarmed":
        return name_change(state, plan)
    if state.mode == "on trial":
        return try_change(state, plan)
    return watch_change(_update_cusums(state, plan)[0], plan)


def _update_cusums(state: CorrectorState, plan: FollowPlan) -> tuple[CorrectorState, int]:
    """Return the state with its alarm, and the longest run above zero of a CUSUM that exceeds its threshold, else 0."""
    alarm, longest = 0.0, 0
    for change, blocks in zip(plan.changes, zip(*state.tested, strict=True), strict=True):
        mean = total([block.information for block in blocks]) / len(blocks)
        limit = siegmund_threshold(plan.threshold, change.size * change.size * mean)
        for height, run in (cusum_statistic(blocks, change.size), cusum_statistic(blocks, -change.size)):
            alarm = max(alarm, height / limit)
            longest = max(longest, run if height > limit else 0)
    return state._replace(alarm=alarm), longest


def look_for_change(state: CorrectorState, run: int, plan: FollowPlan) -> CorrectorState:
    """Raise an alarm if a CUSUM exceeds its threshold and was above zero for ``run`` blocks; 0: none does.

    The alarm waits while an encoder may be at fault.
    """
    encoders = zip(state.encoders, state.noise, strict=True)
    if run > 0 and not any(encoder.is_doubtful(deviation, plan) for encoder, deviation in encoders):
        candidates, _ = find_changes(state, run + SWINGING, plan)
        likeliest = candidates[0] if candidates else NOTHING
        state = add_event(state, "suspected", plan, likeliest)
        return state.enter("alarmed", finding=likeliest, run=run, baseline=start_baseline(plan.deviations))
    return state


def name_change(state: CorrectorState, plan: FollowPlan) -> CorrectorState:
    """Name the likeliest change as soon as it leads, or when patience is over."""
    elapsed = state.blocks_in_mode(plan)
    candidates, measured = find_changes(state, state.run + SWINGING + elapsed, plan)
    is_late = elapsed >= _PATIENCE
    if not candidates:
        return _hold(state, NOTHING, "impossible", plan) if is_late else state
    likeliest = candidates[0]
    leads = len(candidates) == 1 or likeliest.log_bayes - candidates[1].log_bayes >= _LEAD
    if not leads:
        likeliest = likeliest._replace(other=candidates[1].change)
    state = state._replace(finding=likeliest)
    why = "" if measured else "undetermined"
    if measured and abs(likeliest.z) < _LEAST_Z:
        why = "insignificant"
    if not why and (leads or is_late):
        return _put_on_trial(add_event(state, "named" if leads else "ambiguous", plan, likeliest), likeliest, plan)
    return _hold(state, likeliest, why, plan) if is_late else state


def _hold(state: CorrectorState, finding: ChangeEstimate, why: str, plan: FollowPlan) -> CorrectorState:
    """Follow again without the change."""
    return add_event(state, why, plan, finding).follow_again()


def _put_on_trial(state: CorrectorState, finding: ChangeEstimate, plan: FollowPlan) -> CorrectorState:
    """Start a rival twin with the change; hold the change if corrections are off."""
    if not plan.settings.correcting:
        return _hold(state, finding, "off", plan)
    rival = plan.changes[finding.change].apply(finding.size, state.twin)
    return state.with_rival(rival).enter("on trial", finding=finding)


def _compare_rival(state: CorrectorState, plan: FollowPlan) -> tuple[int, float, float]:
    """Return the number of the rival's errors, and how much worse they are (0 before a window is complete), with t."""
    rival, used = state.predictions.copies[2].errors, state.predictions.used.errors
    if len(rival) < plan.window:
        return len(rival), 0.0, 0.0
    return len(rival), *compare_errors(rival, used, plan.changes[state.finding.change].axes)


def try_change(state: CorrectorState, plan: FollowPlan) -> CorrectorState:
    """Adopt the change if the rival was better over the window, hold it if not; else wait for another window."""
    compared, difference, t = _compare_rival(state, plan)
    if compared < plan.window or (abs(t) < _TRIAL_T and compared < WINDOWS * plan.window):
        return state
    # all blocks since the change say more than those that named it
    ranked = rank_changes(state, min(state.finding.blocks + state.blocks_in_mode(plan), len(state.blocks)), plan)
    same = [finding for finding in ranked if finding.change == state.finding.change]
    latest = (same or [state.finding._replace(log_bayes=0.0)])[0]._replace(other=state.finding.other)
    if ranked and ranked[0].log_bayes > _LEAD + latest.log_bayes:
        state = add_event(add_event(state, "outdone", plan, latest), "named", plan, ranked[0])
        return _put_on_trial(state, ranked[0], plan)
    if not same or difference >= 0.0 or t > -_TRIAL_T:
        return _hold(state, latest, "not better", plan)
    # the twin before is the rival from now on
    state, before, change = add_event(state, "better", plan, latest), state.twin, plan.changes[latest.change]
    direction, adopted = change.direction(before), state.events[-1].standard_error
    errors = [adopted if name in change.fields else error for name, error in zip(FIELDS, state.errors, strict=True)]
    state = state.use(change.apply(latest.size, before), tuple(errors)).with_rival(before)
    return state.enter(
        "adopted",
        finding=latest,
        blocks=tuple([shift_block(block, direction, latest.size) for block in state.blocks[-latest.blocks :]]),
        baseline=loosen_baseline(state.baseline, direction, latest.standard_error, change.size),
        tested=(),
        alarm=0.0,
    )


def watch_change(state: CorrectorState, plan: FollowPlan) -> CorrectorState:
    """Take an adopted change back if the values before predict better; refine its size when the watch is over."""
    compared, difference, t = _compare_rival(state, plan)
    if difference < 0.0 and t < -_ROLL_BACK_T:
        return take_back(state, plan)
    if compared < _WATCH_WINDOWS * plan.window:
        return state
    number, count = state.finding.change, len(state.blocks)
    remainder = estimate_change(state, number, count, plan)
    if remainder.change < 0 or abs(remainder.z) < _REFINING_Z:
        remainder = NOTHING
    # the last blocks show most of a change that went on or back meanwhile
    last = estimate_change(state, number, count, plan, all_blocks=False)
    if last.log_bayes >= remainder.log_bayes + _LEAD:
        remainder = last
    state = state.follow_again()._replace(tested=state.tested)
    return _put_on_trial(state, remainder, plan) if remainder.change >= 0 else state


def take_back(state: CorrectorState, plan: FollowPlan) -> CorrectorState:
    """Return the state that uses the rival's values again; those of the start have no standard error."""
    twin, fields = state.rival[0], zip(FIELDS, state.errors, strict=True)
    errors = tuple([0.0 if getattr(twin, name) == getattr(plan.alone, name) else error for name, error in fields])
    state = state.use(twin, errors)._replace(blocks=())
    return add_event(state, "worse", plan, ChangeEstimate(state.finding.change)).follow_again()


def sum_blocks(state: CorrectorState, number: int, count: int, plan: FollowPlan) -> list[tuple[float, float]]:
    """Return D^T b and D^T R D of the last block, of the last two blocks, and so on up to ``count`` blocks."""
    direction, sums = plan.changes[number].direction(state.twin), [(0.0, 0.0)]
    for block in reversed(state.blocks[-count:]):
        response, information = project_block(block, direction)
        sums.append((sums[-1][0] + response, sums[-1][1] + information))
    return sums[1:]


def estimate_change(
    state: CorrectorState, number: int, count: int, plan: FollowPlan, all_blocks: bool = True
) -> ChangeEstimate:
    """Return the change ``number`` as estimated from the last ``count`` blocks, or NOTHING.

    If not from ``all_blocks``, it is estimated from as many of the last ones as make it likeliest.
    """
    change = plan.changes[number]
    bounds = change.bounds(state.twin)
    sums = list(enumerate(sum_blocks(state, number, count, plan), 1))
    chosen = sums[-1:] if all_blocks else sums
    findings = [judge_size(number, n, b, r, change.size, bounds) for n, (b, r) in chosen]
    return max([one for one in findings if one.change >= 0], key=lambda one: one.log_bayes, default=NOTHING)


def rank_changes(state: CorrectorState, count: int, plan: FollowPlan, all_blocks: bool = True) -> list[ChangeEstimate]:
    """Return every possible change, the likeliest first, estimated as by :func:`estimate_change`."""
    findings = [estimate_change(state, number, count, plan, all_blocks) for number in range(len(plan.changes))]
    return sorted([one for one in findings if one.change >= 0], key=lambda one: one.log_bayes, reverse=True)


def find_changes(state: CorrectorState, longest: int, plan: FollowPlan) -> tuple[list[ChangeEstimate], bool]:
    """Return every change that is possible in the last ``longest`` blocks, the likeliest first, and if it is measured.

    Until enough blocks have passed since the likeliest change, it is not measured, and the sizes are not to be used.
    """
    findings = rank_changes(state, longest, plan, all_blocks=False)
    count = findings[0].blocks - SWINGING if findings else 0
    return (findings, False) if count < _LEAST_BLOCKS else (rank_changes(state, count, plan), True)


def add_event(state: CorrectorState, why: str, plan: FollowPlan, finding: ChangeEstimate = NOTHING) -> CorrectorState:
    """Return the state with a new event, about a ``finding`` or none; ``why`` is a key of :data:`.state.REASONS`."""
    h, (what, reason) = plan.settings.sample_time, REASONS[why]
    time = round(state.samples * h, DIGITS)
    event = TwinEvent(time, what, since_s=time, why=reason)
    if finding.change >= 0:
        change, p = plan.changes[finding.change], state.twin
        blocks = finding.blocks + (SWINGING if finding.blocks > 0 and why != "suspected" else 0)
        event = event._replace(
            name=change.name,
            other=plan.changes[finding.other].name if finding.other >= 0 else "",
            axis="rotors" if change.of_rotors else AXES[change.axes[0]],
            value=change.value(change.apply(finding.size, p)),
            standard_error=finding.standard_error * (change.value(p) if change.of_rotors else 1.0),
            since_s=round((state.samples - blocks * plan.block) * h, DIGITS),
        )
    return state._replace(events=(*state.events, event))
