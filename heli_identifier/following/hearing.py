"""What the on-line identifier says of a change: it must not contradict it.

The identifier estimates gains, offset and dampings by another method, without the twin, with a memory of 50 s. Its
estimate lags, so that it cannot confirm a change of a few seconds ago. It can contradict one: since the change it has
moved the other way, by more than _SURELY standard errors of the difference,

    (theta - theta_0) sign(change) < -_SURELY sqrt(2) sigma,

theta_0 the estimate two blocks before the change and sigma the present standard error. The identifier errs as well,
where the rig has what its model lacks; only the difference in time counts, in which most of that cancels.
"""

from math import sqrt

from .changes import ROTORS
from .detection import Finding
from .naming import SWINGING
from .plan import FollowPlan
from .state import CorrectorState, Told

HEARD = ("k_x", "k_z", "k_y", "a_1", "a_wx", "a_wz", "a_wy")
"""Fields of the estimates that are heard, in their order."""

_GAINS = 3
"""The first of them, which a rotor changes."""

_SURELY = 3.0

_KEPT = 120
"""Blocks for which estimates are kept."""


def heard(state: CorrectorState, told: Told) -> CorrectorState:
    """Return the state with what the identifier says after a block."""
    if not told.estimates:
        return state
    return state._replace(heard=(*state.heard, told.estimates)[-_KEPT:])


def contradicted(state: CorrectorState, finding: Finding, told: Told, plan: FollowPlan) -> bool:
    """Return whether the identifier has moved against a change since it took place."""
    if not state.heard or not told.estimates:
        return False
    before = state.heard[max(0, len(state.heard) - 1 - finding.blocks - SWINGING)]
    for slot in range(len(HEARD)):
        sign = _sign(slot, finding, plan)
        error = told.standard_errors[slot]
        if sign != 0.0 and error > 0.0:
            moved = sign * (told.estimates[slot] - before[slot])
            if moved < -_SURELY * sqrt(2.0) * error:
                return True
    return False


def _sign(slot: int, finding: Finding, plan: FollowPlan) -> float:
    """Return the sign by which a change moves the estimate at ``slot``, 0 where it does not."""
    change = plan.changes[finding.change]
    if change.axis == ROTORS and slot < _GAINS:
        gain = plan.first_values[plan.fields.index(HEARD[slot])]
        return 1.0 if finding.size * gain > 0.0 else -1.0
    if change.field == HEARD[slot]:
        return 1.0 if finding.size > 0.0 else -1.0
    return 0.0
