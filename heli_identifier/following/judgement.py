"""What is done with a complete block: noise and scores are learned, and the mode says what is asked.

    following --alarm--> alarmed --named--> on trial --better--> adopted --still better--> following
                            |                  |                    |
                            +-----held---------+--------held--------+--worse: rolled back--> following

:mod:`.alarm` raises and names, :mod:`.trial` puts on trial, :mod:`.adoption` adopts, watches and takes back.
"""

from .adoption import adopted, on_trial
from .alarm import alarmed, following
from .blocks import noise_is_known
from .detection import alarm_of, paged
from .events import Event
from .hearing import heard
from .naming import compass_of, limits_of, proved_colours, seen_by, shares_of
from .plan import LEARNING, FollowPlan
from .state import ALARMED, FOLLOWING, ON_TRIAL, STARTING, SUSPENDED, WATCHED, CorrectorState, Told

KEPT = 90
"""Blocks that are kept: a change is looked for in the last minute and a half."""

_SCORE = 5.0
"""Size of a score on line beyond which it is counted for how long it stays there."""


def judged(state: CorrectorState, told: Told, plan: FollowPlan) -> tuple[CorrectorState, list[Event]]:
    """Return the state after a complete block, and what there is to report."""
    time = state.samples * plan.settings.sample_time
    if state.mode == STARTING:
        if noise_is_known(state.levels, LEARNING):
            state = state._replace(mode=FOLLOWING, since=state.samples)
        return state, []
    if state.mode == SUSPENDED:
        return state, []
    compass = compass_of(state, plan)
    state = heard(_scored(state._replace(colours=proved_colours(state, compass)), told), told)
    newest = (
        seen_by(state.tested[-1:], compass, shares_of(state.colours))[0]
        if state.tested
        else ((0.0, 0.0),) * len(compass)
    )
    run = 0
    if state.mode in (FOLLOWING, WATCHED):
        pages = paged(state.pages, newest, plan.sizes)
        alarm, run = alarm_of(pages, limits_of(state.colours, plan))
        state = state._replace(pages=pages, pages_before=state.pages, alarm=alarm)
    if state.mode == FOLLOWING:
        return following(state, compass, run, time, plan)
    if state.mode == ALARMED:
        return alarmed(state, compass, told, time, plan)
    if state.mode == ON_TRIAL:
        return on_trial(state, compass, told, time, plan)
    return adopted(state, compass, time, plan)


def _scored(state: CorrectorState, told: Told) -> CorrectorState:
    """Count for how long each watched effect's score has been beyond its threshold."""
    if not told.scores:
        return state
    counts = [n + 1 if abs(score) > _SCORE else 0 for n, score in zip(state.scored, told.scores, strict=True)]
    return state._replace(scored=tuple(counts))
