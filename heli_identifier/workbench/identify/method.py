"""Which method suits a set of logs: the paper's adaptation in open loop, prediction errors under a controller.

Every log is passed through prediction errors, which hold in both cases, and gives a score of a closed loop on each axis
(:mod:`heli_identifier.online.feedback`). In open loop a score is roughly normal. With n logs the loop is closed if one
of the 3 n scores is beyond the quantile that all of them together exceed in 1 % of the cases, or if on one axis the
sum of the scores over sqrt(n) is beyond ``CLOSED``. One log in closed loop suffices: least squares would be wrong on
it, while prediction errors are right on the others as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from heli_identifier.online import ADAPTATION, CLOSED, PREDICTION_ERROR
from heli_plant.effects import AXES

_FALSE_ALARMS = 0.01
"""Share of sets of logs in open loop in which one score is beyond the quantile by chance."""


@dataclass(frozen=True)
class Choice:
    """The ``method`` taken, why, and whether a controller flew."""

    method: str
    reason: str
    closed_loop: bool


def loop_is_closed(scores: Sequence[Sequence[float]]) -> tuple[bool, str]:
    """Return whether a controller flew, and the evidence in words.

    Parameters
    ----------
    scores : sequence of three floats each, length n
        Scores of pitch, elevation and travel of every log.
    """
    table = np.atleast_2d(np.array(scores, dtype=float))
    limit = max(CLOSED, float(norm.isf(_FALSE_ALARMS / (2.0 * table.size))))
    together = table.sum(axis=0) / np.sqrt(len(table))
    single = np.unravel_index(np.abs(table).argmax(), table.shape)
    joint = int(np.abs(together).argmax())
    closed = bool(abs(table[single]) > limit or abs(together[joint]) > CLOSED)
    axis, value, bound = AXES[single[1]], table[single], limit
    if closed and abs(table[single]) <= limit:
        axis, value, bound = AXES[joint], together[joint], CLOSED
    return closed, f"the voltages follow the {axis}'s innovations with a score of {abs(value):.1f} (limit {bound:.1f})"


def choose(scores: Sequence[Sequence[float]], wanted: str | None) -> Choice:
    """Return the method for logs with these ``scores``, or the ``wanted`` one."""
    closed, evidence = loop_is_closed(scores)
    if wanted is not None:
        return Choice(wanted, f"{wanted}, as asked for", closed)
    if closed:
        return Choice(PREDICTION_ERROR, f"{PREDICTION_ERROR}: a controller flew the rig, since {evidence}", True)
    return Choice(ADAPTATION, f"{ADAPTATION}: no controller flew the rig, since {evidence}", False)
