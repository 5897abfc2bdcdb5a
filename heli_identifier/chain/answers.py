r"""How late an angle is in its log: a controller answers it, and never before it has read it.

What a controller makes of an angle y is linear, so that second differences D of its voltages v and of y obey

    D v_k = sum_j g_j D y_{k-j} + D r_k,    j = 0 ... 5,

with steps of a reference r that are few. Where the counts of the encoder rule D y, these are a noise that no voltage
makes: it comes from the angle alone. If a log that is read s samples later tells more of D v, R2(s) > R2(0), its angle
is late by s samples; one sample less than that, if the controller answers a period later. On logs of a plant and a
controller R2 is .9 to 1 at the right s, and falls to below .7 one sample before.

A likelihood cannot decide this: the voltages of a late log know the angle's future, and a plant that is wrong in just
the right way, with an arm that bends, uses it.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import ANGLES, Array, Log

from .inspection import Defect

LONGEST = 0.1
"""Time [s] that an angle may be late: a controller that reads it so late is no longer stable."""

TAPS, ROWS = 6, 4000
"""Samples of the angle that an answer takes into account, and equations of one log: more only cost time."""

TOLD, LATER, AS_WELL = 0.1, 0.1, 0.02
"""R2 from which a controller's answer is seen; what a later reading has to add, and what is no more than chance."""

RULED = -0.4
"""Correlation of D y with the sample before, below which the encoder's noise rules it: -2/3 of white noise."""


def undo_delays(logs: Sequence[Log]) -> tuple[tuple[Log, ...], tuple[Defect, ...], frozenset[str]]:
    """Read late angles earlier; give the logs, what was found, and the axes that are seen to be on time.

    ``logs`` are those of one rig that a controller flew.
    """
    used, found, prompt = list(logs), list[Defect](), set[str]()
    for column, axis in enumerate(ANGLES):
        told = [own for log in logs if (own := _estimate_lateness(log, column)) is not None]
        if not told:
            continue
        late = float(np.median(told))
        if late == 0.0 and max(told) == 0.0:
            prompt.add(axis)
        if late > 0.0:
            used = [_shift_earlier(log, column, round(late * log.rate_hz)) for log in used]
            found.append(Defect(
                "late", axis, f"the voltages answer the {axis} {1e3 * late:.3g} ms before the log has it; it was read "
                "so much earlier. Log all channels in the task that reads the encoders, without a filter or a buffer",
            ))  # fmt: skip
    return tuple(used), tuple(found), frozenset(prompt)


def controller_samples(log: Log) -> tuple[NDArray[np.intp], int, int]:
    """Give the samples at which a controller renews the voltages of a log, and how many lie between: it may be slower.

    The third number says how often the voltages change.
    """
    changes = np.flatnonzero(np.any(np.diff(log.voltages, axis=0) != 0.0, axis=1)) + 1
    hold = max(1, int(np.median(np.diff(changes)))) if len(changes) > 10 else 1
    first = int(np.bincount(changes % hold).argmax()) if len(changes) else 0
    return np.arange(first, log.samples, hold), hold, len(changes)


def _estimate_lateness(log: Log, column: int) -> float | None:
    """Time [s] by which an angle is late in a log; None where no answer to it is seen."""
    rows, hold, changes = controller_samples(log)
    if changes < 100:
        return None
    sign, others = (1.0, []) if ANGLES[column] == "elevation" else (-1.0, [2 - column])
    answer = np.diff(log.voltages[rows] @ np.array([1.0, sign]), 2)
    angles = np.diff(log.angles[rows], 2, axis=0)
    own = angles[:, column]
    if not own.any() or own[1:] @ own[:-1] > RULED * (own @ own):
        return None
    most = round(LONGEST * log.rate_hz / hold)
    k = np.arange(TAPS, len(answer) - most)
    k = k[(np.abs(answer[k]) > 0.0) & (np.abs(answer[k]) <= np.quantile(np.abs(answer[k]), 0.9))]  # no steps of r
    k = k[:: max(1, len(k) // ROWS)]
    if len(k) < 20 * TAPS:
        return None
    beside = [angles[k - j, other] for other in others for j in range(TAPS)]
    R2 = np.array([
        _r_squared(answer[k], np.column_stack([*(own[k + s - j] for j in range(TAPS)), *beside]))
        for s in range(most + 1)
    ])  # fmt: skip
    alone = _r_squared(answer[k], np.column_stack(beside)) if beside else 0.0
    if R2.max() - alone < TOLD:
        return None
    first = int(np.argmax(R2 >= R2.max() - AS_WELL))
    if 0 < first and R2[first] - R2[0] < LATER:
        return None
    return float(first * hold * log.step)


def _r_squared(y: Array, X: Array) -> float:
    """R2 of a regression of y (n,) on X (n, k)."""
    left = y - X @ np.linalg.lstsq(X, y, rcond=None)[0]
    return 1.0 - float(left @ left) / float(y @ y)


def _shift_earlier(log: Log, column: int, samples: int) -> Log:
    """Read one angle so many samples earlier; the log ends with the last one that it has."""
    kept = log.samples - samples
    angles = log.angles[:kept].copy()
    angles[:, column] = log.angles[samples:, column]
    references = {name: values[:kept] for name, values in log.references.items()}
    return replace(log, angles=angles, voltages=log.voltages[:kept], references=references)
